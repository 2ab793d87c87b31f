"""Tests of one finger, of the ends of its program, and of a controller that restarts."""

import signal
import threading
import time
from typing import Any, Callable, List, Tuple, Type

from fingertip import Fault, Finger, FingertipError, Mode, Restarted
from fingertip import registers as reg

from served import LONG_S, OnServed

# Presses, reports it, and executes the code of the test.
CHILD = """
import sys
from fingertip import Fingertip, registers
finger = Fingertip(sys.argv[1], timeout_ms=60_000, leave_pressing="leave" in sys.argv)
finger.tare()
finger.press(0.5, 2.54)
print("pressing", flush=True)
"""
GO_ON = "while True: finger.state()"
# Presses from a process of `multiprocessing`.
FORK = """
finger.close()
def press():
    Fingertip(sys.argv[1], timeout_ms=60_000).press(0.5, 2.54)
    {}
import multiprocessing, signal
child = multiprocessing.get_context("fork").Process(target=press)
child.start()
child.join()
"""


def restart(finger: Finger) -> None:
    """Restarts the controller by a broadcast, which has no answer."""
    packets, line = finger.line.packets, finger.line

    def action() -> Tuple[None, int]:
        result = packets.txPacket(line, [0xFF, 0xFF, 0xFD, 0, 254, 3, 0, 8, 0, 0])
        line.is_using = False
        return None, result

    line._run("reboot", action)


class Ends(OnServed):
    def child(self, then: str, *arguments: str, kill: int = 0) -> int:
        """How a program ends that presses; `kill` is the signal for it."""
        child = self.python("-c", CHILD + then, self.served.port, *arguments)
        assert child.stdout
        self.assertEqual(child.stdout.readline(), "pressing\n")
        if kill:
            child.send_signal(kill)
        self.said, _ = child.communicate()
        return child.returncode

    def left(self) -> List[int]:
        """Torque, goal, bus watchdog and fault as a program left them."""
        with self.open() as finger:
            registers = [reg.TORQUE_ENABLE, reg.GOAL_FORCE_MN, reg.BUS_WATCHDOG, reg.FAULT]
            return [finger.read(register) for register in registers]

    def test_every_end_of_a_program_turns_torque_off(self) -> None:
        ends = [
            ("", 0, 0),
            ("finger.close()", 0, 0),
            ("with finger: pass", 0, 0),
            ("with finger: raise ValueError", 0, 1),
            ("raise ValueError", 0, 1),
            (FORK.format(""), 0, 0),
            (FORK.format("signal.raise_signal(signal.SIGTERM)"), 0, 0),
            (GO_ON, signal.SIGTERM, 128 + signal.SIGTERM),
            (GO_ON, signal.SIGHUP, 128 + signal.SIGHUP),
            ("with finger:\n    " + GO_ON, signal.SIGTERM, 128 + signal.SIGTERM),
            (GO_ON, signal.SIGINT, -signal.SIGINT),
        ]
        for then, kill, code in ends:
            with self.subTest(then=then, kill=kill):
                self.assertEqual(self.child(then, kill=kill), code)
                self.assertEqual(self.left(), [0, 0, 0, Fault.NONE])
                self.assert_released()

    def test_leave_pressing_leaves_torque_and_goal(self) -> None:
        self.assertEqual(self.child("", "leave"), 0)
        self.assertEqual(self.left(), [1, 500, 0, Fault.NONE], "one that only reads leaves the finger as it is")
        with self.open() as finger:
            finger.release()
        self.assertEqual(self.left(), [0, 0, 0, Fault.NONE])

    def test_a_forked_child_leaves_the_finger_to_its_parent(self) -> None:
        # The child exits like a program: it calls the registered exit functions.
        then = "import os\nif os.fork(): print(os.wait()[1], finger.read(registers.TORQUE_ENABLE))"
        self.assertEqual(self.child(then), 0)
        self.assertEqual(self.said, "0 1\n")
        self.assertEqual(self.left(), [0, 0, 0, Fault.NONE])

    def test_an_interrupted_block_lets_go(self) -> None:
        with self.assertRaises(KeyboardInterrupt), self.open() as finger:
            finger.tare()
            finger.press(0.5)
            raise KeyboardInterrupt
        self.assert_released()

    def test_handlers_of_the_program_stay(self) -> None:
        def own(number: int, frame: Any) -> None:
            pass

        signal.signal(signal.SIGTERM, own)
        signal.signal(signal.SIGHUP, signal.SIG_IGN)
        finger = self.open()
        finger.tare()
        finger.press(0.5, LONG_S)
        self.assertEqual((signal.getsignal(signal.SIGTERM), signal.getsignal(signal.SIGHUP)), (own, signal.SIG_IGN))


class Moves(OnServed):
    def refused(self, kind: Type[BaseException], doing: Callable[..., Any], *arguments: Any) -> None:
        with self.assertRaises(kind, msg=f"{doing} {arguments}"):
            doing(*arguments)

    def test_wrong_numbers_move_nothing(self) -> None:
        finger = self.open()
        finger.tare()
        # Outside the range of the register, above force_max_mn, and not a number.
        no_numbers = [(float(text), ValueError) for text in ("nan", "inf", "-inf")]
        for newtons, kind in [(-1.0, ValueError), (1e6, ValueError), (100.0, FingertipError), *no_numbers]:
            self.refused(kind, finger.press, newtons)
            self.assertEqual(finger.read(reg.TORQUE_ENABLE), 0)
        for silence_s in [0.0, 3.0, float("nan")]:
            self.refused(ValueError, finger.press, 1.0, silence_s)
        for rate_hz, seconds in [(float("nan"), 1.0), (-1.0, 1.0), (1e-30, 1.0), (100.0, float("nan")), (100.0, -1.0)]:
            self.refused(ValueError, lambda: next(finger.stream(rate_hz, seconds)))
        self.assertGreater(len(list(finger.stream(0, 0.05, pressures=False))), 1, "0 is as fast as it goes")
        # A number is written in the unit in which it is read.
        finger.write(reg.BUS_WATCHDOG, 500)
        self.assertEqual(finger.read(reg.BUS_WATCHDOG), 500)
        for value in [10, 2560, -20]:
            self.refused(ValueError, finger.write, reg.BUS_WATCHDOG, value)

    def test_who_was_refused_leaves_the_finger_as_it_is(self) -> None:
        with self.open(leave_pressing=True) as finger:
            finger.tare()
            finger.press(0.5, LONG_S)
        finger = self.open()
        self.refused(FingertipError, finger.write_bytes, reg.TARE.address, b"\1")  # not while torque is on
        finger.close()
        with self.open() as finger:
            self.assertEqual(finger.read(reg.GOAL_FORCE_MN), 500)

    def test_release_right_after_press_lets_go(self) -> None:
        finger = self.open()
        finger.tare()
        for wait_s in [0.0, 0.002, 0.01, 0.05, 0.1, 0.2]:
            finger.press(1.0, LONG_S)
            time.sleep(wait_s)
            finger.release()
            self.assert_released(f"after {wait_s} s")
            self.assertEqual(finger.read(reg.BUS_WATCHDOG), 0)

    def test_a_press_that_measures_is_released(self) -> None:
        finger = self.open()
        finger.tare()
        finger.enable_torque(LONG_S)
        finger.write(reg.MEASURE, 3)
        while self.served.truths()[1].force_n < 0.1:
            time.sleep(0.002)
        finger.stop()
        self.assert_released()

    def test_the_goal_goes_before_torque_and_torque_before_the_watchdog(self) -> None:
        finger = self.open()
        finger.tare()
        finger.press(0.5, LONG_S)
        told: List[str] = []
        exchange = finger.line._run

        def note(failing: str, action: Any) -> Any:
            # The feeder may be due at any time.
            if failing != "keep alive":
                told.append(failing)
            return exchange(failing, action)

        finger.line._run = note  # type: ignore[method-assign]
        finger.close()
        self.assertEqual(told[0], "sync write", "of the goal")
        self.assertEqual([text.split()[1] for text in told if text[:3] == "set"], ["torque_enable", "bus_watchdog"])

    def test_the_watchdog_is_on_and_fed(self) -> None:
        finger = self.open()
        finger.tare()
        finger.press(0.5, silence_s=LONG_S)
        self.assertEqual(finger.read(reg.BUS_WATCHDOG), 2540)
        before = finger.read(reg.GOOD_PACKETS)
        for own in range(1, 60):
            time.sleep(0.5)
            if finger.read(reg.GOOD_PACKETS) - before > own:
                break
        else:
            self.fail("nobody feeds the watchdog")
        finger.release()
        self.assertEqual(finger.read(reg.BUS_WATCHDOG), 0)

    def test_recover_tells_the_fault(self) -> None:
        finger = self.open()
        finger.tare()
        finger.press(0.5, LONG_S)
        self.served.ask("fault supply-low")
        while not finger.state().fault:
            pass
        self.refused(FingertipError, finger.press, 0.5)
        self.refused(FingertipError, finger.recover)
        self.served.ask("mend")
        while True:
            try:
                self.assertEqual(finger.recover(), Fault.SUPPLY_LOW)
                break
            except FingertipError:
                pass  # the supply is not yet seen as mended
        finger.press(0.5)

    def test_numbers_of_the_control_table_have_names(self) -> None:
        for kind, register in [(Fault, reg.FAULT), (Mode, reg.PRESENT_MODE)]:
            for number in range(register.largest + 1):
                self.assertNotIn("UNKNOWN", kind(number).name)

    def test_a_restart_is_an_error(self) -> None:
        finger = self.open()
        finger.tare()
        stream = finger.stream(0, pressures=False)
        [next(stream) for _ in range(10)]
        restart(finger)
        with self.assertRaises(FingertipError):
            for _ in stream:
                pass
        self.assertEqual(finger.state().time_s, 0.0, "what comes then is of another time, which begins again")
        self.refused(FingertipError, finger.press, 1.0)


class Threads(OnServed):
    def test_threads_share_an_object(self) -> None:
        finger, wrong = self.open(), []
        finger.state()

        def read() -> None:
            try:
                for _ in range(150):
                    finger.state(pressures=False)
                    values = [finger.ping(), finger.read(reg.MODEL_NUMBER), finger.read(reg.ID)]
                    if values != [21574, 21574, 1]:
                        wrong.append(str(values))
            except Exception as why:
                wrong.append(repr(why))

        threads = [threading.Thread(target=read) for _ in range(4)]
        [thread.start() for thread in threads]  # type: ignore[func-returns-value]
        [thread.join() for thread in threads]  # type: ignore[func-returns-value]
        self.assertEqual(wrong, [])

    def test_threads_count_the_time_in_the_order_of_their_reads(self) -> None:
        finger = self.open()
        other, read = threading.Thread(target=finger.state), finger.read_bytes

        def read_and_let_the_other_read(address: int, length: int) -> bytes:
            finger.read_bytes = read  # type: ignore[method-assign]
            data = read(address, length)
            other.start()
            other.join(0.5)
            return data

        finger.state()
        finger.read_bytes = read_and_let_the_other_read  # type: ignore[method-assign]
        finger.state()  # raises `Restarted` where the other thread counted a later frame first
        other.join()
