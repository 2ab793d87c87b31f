"""Tests of the package: python -m unittest discover python/tests

Some need a served finger (`cargo xtask serve`) on the port FINGERTIP_PORT. FINGERTIP_TIMEOUT_MS is the time to wait for
its answers. `cargo xtask test` sets both.
"""

import dataclasses
import fcntl
import os
import signal
import socket
import subprocess
import sys
import threading
import time
import unittest
from pathlib import Path

from dynamixel_sdk import PacketHandler

from fingertip import Bus, Fault, Fingertip, FingertipError, Limits, Mode, NoAnswer, PortLost, State
from fingertip import registers as reg

PORT = os.environ.get("FINGERTIP_PORT")
TIMEOUT_MS = float(os.environ.get("FINGERTIP_TIMEOUT_MS", 1000.0))
LONG_S = 2.54  # bus watchdog that does not trip on a busy machine


def answer(*data):
    """A status packet of ID 1 without an error."""
    packet = [0xFF, 0xFF, 0xFD, 0, 1, len(data) + 4, 0, 0x55, 0, *data]
    crc = PacketHandler(2.0).updateCRC(0, packet, len(packet))
    return bytes([*packet, crc & 0xFF, crc >> 8])


class FakeSerial:
    """A port without a machine behind it: `reads` has an action for each read that finds no bytes."""

    def __init__(self, reads):
        self.reads, self.buffer, self.now_ms = list(reads), b"", 0.0

    def read(self, size):
        if not self.buffer and self.reads:
            self.reads.pop(0)(self)
            return b""
        if not self.buffer:
            self.now_ms += 10.0
        data, self.buffer = self.buffer[:size], self.buffer[size:]
        return data

    def write(self, data):
        return len(data)

    def reset_input_buffer(self):
        self.buffer = b""

    def close(self):
        pass


def late(data):
    """Bytes come and the time-out passes, both while the program does not run."""

    def action(fake):
        fake.buffer += data
        fake.now_ms += 1e6

    return action


def arrive(data):
    def action(fake):
        fake.buffer += data

    return action


def interrupt(fake):
    raise KeyboardInterrupt


class OnPseudoTerminal(unittest.TestCase):
    def setUp(self):
        self.near, far = os.openpty()
        self.name = os.ttyname(far)
        self.far = open(far, closefd=True)
        self.addCleanup(self.far.close)
        self.addCleanup(self.hang_up)

    def hang_up(self):
        if self.near is not None:
            os.close(self.near)
            self.near = None

    def fake(self, *reads):
        """A bus on a fake port."""
        bus = Bus(self.name)
        self.addCleanup(bus.close)
        bus._port.ser.close()
        bus._port.ser = fake = FakeSerial(reads)
        bus._port.getCurrentTime = lambda: fake.now_ms
        return bus

    def test_an_answer_that_came_before_the_time_out_was_looked_at_is_read(self):
        self.assertEqual(self.fake(late(answer(7))).read_bytes(64, 1), b"\x07")

    def test_a_silent_line_ends_with_no_answer(self):
        with self.assertRaises(NoAnswer):
            self.fake().read_bytes(64, 1)

    def test_a_late_answer_is_not_taken_for_the_next_one(self):
        nothing = [late(b"")] * 2  # ends the first exchange
        bus = self.fake(*nothing, arrive(answer(1)), arrive(answer(2)))
        with self.assertRaises(NoAnswer):
            bus.read_bytes(64, 1)
        self.assertEqual(bus.read_bytes(64, 1), b"\x02")

    def test_an_interrupted_exchange_leaves_the_port_usable(self):
        bus = self.fake(interrupt, arrive(answer(1)), arrive(answer(2)))
        with self.assertRaises(KeyboardInterrupt):
            bus.read_bytes(64, 1)
        self.assertEqual(bus.read_bytes(64, 1), b"\x02")

    def test_an_exchange_that_was_interrupted_before_it_was_sent_leaves_the_port_usable(self):
        bus = self.fake(arrive(answer(1)))
        clear, bus._port.clearPort = bus._port.clearPort, lambda: interrupt(None)
        with self.assertRaises(KeyboardInterrupt):
            bus.read_bytes(64, 1)
        bus._port.clearPort = clear
        self.assertEqual(bus.read_bytes(64, 1), b"\x01")

    def test_an_answer_of_another_length_is_not_the_one_that_is_owed(self):
        bus = self.fake(arrive(answer(1)), arrive(answer(*[2] * 9)), arrive(answer(*[3] * 9)))
        with self.assertRaises(NoAnswer):
            bus.read_bytes(64, 9)
        self.assertEqual(bus.read_bytes(64, 9), b"\x03" * 9)

    def test_an_answer_whose_reading_was_interrupted_is_owed_no_more(self):
        bus = self.fake(arrive(answer(1)), arrive(answer(2)))
        check = bus._packets.updateCRC

        def interrupted(*data):
            if len(bus._port.ser.reads) == 2:
                return check(*data)  # of the packet that is sent
            bus._packets.updateCRC = check
            raise KeyboardInterrupt

        bus._packets.updateCRC = interrupted
        with self.assertRaises(KeyboardInterrupt):
            bus.read_bytes(64, 1)
        before_ms = bus._port.ser.now_ms
        self.assertEqual(bus.read_bytes(64, 1), b"\x02")
        self.assertEqual(bus._port.ser.now_ms, before_ms, "nothing was waited for")

    def test_a_lost_link_is_an_error_of_the_package(self):
        bus = Bus(self.name)
        self.hang_up()
        for _ in range(2):
            with self.assertRaises(PortLost):
                bus.read_bytes(64, 1)
        bus.close()
        with self.assertRaises(PortLost):
            bus.ping()

    def test_a_port_that_another_program_uses_is_refused(self):
        with open(self.name, "rb", buffering=0, opener=lambda path, _: os.open(path, os.O_RDWR | os.O_NOCTTY)) as other:
            fcntl.flock(other, fcntl.LOCK_EX)
            with self.assertRaisesRegex(FingertipError, f"cannot open {self.name}: another program has it open"):
                Bus(self.name)
            fcntl.flock(other, fcntl.LOCK_UN)
            with Bus(self.name), self.assertRaises(BlockingIOError):
                fcntl.flock(other, fcntl.LOCK_EX | fcntl.LOCK_NB)
            fcntl.flock(other, fcntl.LOCK_EX | fcntl.LOCK_NB)

    def test_objects_of_one_program_share_a_port(self):
        first, second = Bus(self.name), Bus(self.name, 2)
        first.close()
        with self.assertRaises(PortLost):
            first.ping()
        self.assertTrue(second._port.is_open)
        with self.assertRaisesRegex(FingertipError, "uses it at 1000000 baud"):
            Bus(self.name, 3, baud=57_600)
        second.close()
        self.assertFalse(second._port.is_open)


class OnTcp(unittest.TestCase):
    def serve(self, *sent):
        """Serves one client: sends each of these once it has got something. Returns the port's name."""
        listener = socket.create_server(("127.0.0.1", 0))

        def run():
            with listener, listener.accept()[0] as client:
                for data in sent:
                    client.recv(1024)
                    client.sendall(data)

        threading.Thread(target=run, daemon=True).start()
        return "tcp:%s:%d" % listener.getsockname()

    def test_a_tcp_port_is_taken(self):
        with Bus(self.serve(answer(70, 84, 1), answer(5)), timeout_ms=60_000) as bus:
            self.assertEqual(bus.ping(), 21574)
            self.assertEqual(bus.read_bytes(64, 1), b"\x05")
            with self.assertRaises(PortLost):
                bus.ping()

    def test_a_second_client_is_told_who_is_there(self):
        words = b"busy: 127.0.0.1:9 is connected to this fingertip, one client at a time\n"
        for before in [False, True]:
            with Bus(self.serve(words), timeout_ms=60_000) as bus:
                if before:
                    bus._port.writePort(b"?")
                    while not bus._port.ser.in_waiting:
                        time.sleep(0.01)
                with self.assertRaisesRegex(PortLost, "busy: 127.0.0.1:9 is"):
                    bus._port.owed = False
                    bus.ping()

    def test_a_port_where_nobody_listens_is_refused(self):
        with socket.create_server(("127.0.0.1", 0)) as listener:
            number = listener.getsockname()[1]
        for name in [f"tcp:127.0.0.1:{number}", "tcp:127.0.0.1", "tcp:", "/nowhere", os.devnull]:
            with self.assertRaisesRegex(FingertipError, f"cannot open {name}: "):
                Bus(name)


class Values(unittest.TestCase):
    def test_numbers_of_a_newer_firmware_are_values(self):
        for kind, name in [(Fault, "UNKNOWN_200"), (Mode, "UNKNOWN_200")]:
            self.assertEqual((kind(200), kind(200).name, type(kind(200))), (200, name, kind))
            with self.assertRaises(ValueError):
                kind("no number")
        limits = Limits(1 << 15 | 1)
        self.assertEqual((int(limits), limits & Limits.VOLTAGE, type(limits)), (1 << 15 | 1, Limits.VOLTAGE, Limits))

    def test_a_state_has_a_hash(self):
        numbers = dict.fromkeys((field.name for field in dataclasses.fields(State)), 0)
        state = State(**{**numbers, "pressures_kpa": ((1.0, 2.0),)})
        self.assertEqual(hash(state), hash(dataclasses.replace(state)))


# Presses, says so, and goes on as the test wants it.
CHILD = """
import sys
from fingertip import Fingertip, registers
finger = Fingertip(sys.argv[1], timeout_ms=float(sys.argv[2]), leave_pressing="leave" in sys.argv)
finger.press(0.5, float(sys.argv[3]))
print("pressing", flush=True)
"""
GO_ON = "while True: finger.state()"


@unittest.skipUnless(PORT, "needs a served finger on FINGERTIP_PORT")
class OnServedFinger(unittest.TestCase):
    def open(self, **options):
        finger = Fingertip(PORT, timeout_ms=TIMEOUT_MS, **options)
        self.addCleanup(finger.close)
        return finger

    def setUp(self):
        for number in [signal.SIGTERM, signal.SIGHUP]:
            self.addCleanup(signal.signal, number, signal.getsignal(number))
        self.clear()

    def clear(self):
        """Takes the tip off the object, and tares: the 0.5 s at the end of a program are short on a busy machine."""
        with self.open() as finger:
            for _ in range(10):
                try:
                    if finger.read(reg.FAULT):
                        finger.recover()
                    if not finger.read(reg.LIMITS) & Limits.NOT_TARED:
                        finger.press(0.3, LONG_S)
                        for _ in range(1000):
                            if finger.state().mode in [Mode.FORCE, Mode.FAULT]:
                                break
                            time.sleep(0.01)
                        finger.release()
                    return finger.tare()
                except FingertipError as error:
                    why = error
                    if finger.read(reg.LIMITS) & Limits.TARED_TOUCHING:
                        finger.write(reg.TARE, 2)  # allows torque all the same
                        while finger.read(reg.TARE_STATE) == 1:
                            pass
        self.fail(f"the tip does not come off the object: {why}")

    def child(self, then, *arguments, silence_s=LONG_S, kill=None):
        """How a program ends that presses; `kill` is the signal for it."""
        command = [sys.executable, "-c", CHILD + then, PORT, str(min(TIMEOUT_MS, 5000.0)), str(silence_s), *arguments]
        environment = {**os.environ, "PYTHONPATH": str(Path(__file__).resolve().parents[1])}
        pipe = subprocess.PIPE
        with subprocess.Popen(command, env=environment, text=True, stdout=pipe, stderr=pipe) as child:
            self.assertEqual(child.stdout.readline(), "pressing\n")
            if kill is not None:
                child.send_signal(kill)
            self.said, _ = child.communicate()
        return child.returncode

    def left(self):
        """Torque, goal, bus watchdog and fault as a program left them."""
        with self.open() as finger:
            registers = [reg.TORQUE_ENABLE, reg.GOAL_FORCE_MN, reg.BUS_WATCHDOG, reg.FAULT]
            return [finger.read(register) for register in registers]

    def test_every_end_of_a_program_turns_torque_off(self):
        ends = [
            ("", None, 0),
            ("finger.close()", None, 0),
            ("with finger: pass", None, 0),
            ("with finger: raise ValueError", None, 1),
            ("raise ValueError", None, 1),
            (GO_ON, signal.SIGTERM, 128 + signal.SIGTERM),
            (GO_ON, signal.SIGHUP, 128 + signal.SIGHUP),
            ("with finger:\n    " + GO_ON, signal.SIGTERM, 128 + signal.SIGTERM),
            (GO_ON, signal.SIGINT, -signal.SIGINT),
        ]
        for then, kill, code in ends:
            with self.subTest(then=then, kill=kill):
                self.clear()
                self.assertEqual(self.child(then, kill=kill), code)
                self.assertEqual(self.left(), [0, 0, 0, Fault.NONE])

    def test_a_killed_program_is_ended_by_the_watchdog(self):
        self.child(GO_ON, silence_s=0.5, kill=signal.SIGKILL)
        for _ in range(60):
            time.sleep(1.0)  # each look feeds the watchdog
            torque, _, _, fault = self.left()
            if fault:
                break
        self.assertEqual((torque, fault), (0, Fault.BUS_SILENT))
        with self.open() as finger:
            self.assertEqual(finger.recover(), Fault.BUS_SILENT)

    def test_leave_pressing_leaves_torque_and_goal(self):
        self.assertEqual(self.child("", "leave"), 0)
        self.assertEqual(self.left(), [1, 500, 0, Fault.NONE], "one that only reads leaves the finger as it is")
        self.open().release()
        self.assertEqual(self.left(), [0, 0, 0, Fault.NONE])

    def test_the_goal_goes_before_torque_and_torque_before_the_watchdog(self):
        finger = self.open()
        finger.press(0.5, LONG_S)
        written, write = [], finger.write

        def note(register, value):
            written.append((register, value))
            write(register, value)

        finger.write = note
        finger.close()
        self.assertEqual(written, [(reg.GOAL_FORCE_MN, 0), (reg.TORQUE_ENABLE, 0), (reg.BUS_WATCHDOG, 0)])

    def test_the_watchdog_is_on_and_fed(self):
        finger = self.open()
        finger.press(0.5)
        self.assertIn(finger.read(reg.BUS_WATCHDOG), [500, -20], "on, or tripped on a busy machine")
        finger.recover()
        finger.press(0.5, LONG_S)
        before = finger.read(reg.GOOD_PACKETS)
        for own in range(1, 60):
            time.sleep(0.5)
            if finger.read(reg.GOOD_PACKETS) - before > own:
                break
        else:
            self.fail("nobody feeds the watchdog")
        finger.release()
        self.assertEqual(finger.read(reg.BUS_WATCHDOG), 0)

    def test_a_forked_child_leaves_the_finger_to_its_parent(self):
        # The child exits as a program does: it runs what is registered for the exit.
        then = "import os\nif os.fork(): print(os.wait()[1], finger.read(registers.TORQUE_ENABLE))"
        self.assertEqual(self.child(then), 0)
        self.assertEqual(self.said, "0 1\n")
        self.assertEqual(self.left(), [0, 0, 0, Fault.NONE])

    def test_handlers_of_the_program_stay(self):
        def own(number, frame):
            pass

        signal.signal(signal.SIGTERM, own)
        signal.signal(signal.SIGHUP, signal.SIG_IGN)
        finger = self.open()
        finger.press(0.5, LONG_S)
        self.assertEqual((signal.getsignal(signal.SIGTERM), signal.getsignal(signal.SIGHUP)), (own, signal.SIG_IGN))

    def test_threads_share_an_object(self):
        finger, wrong = self.open(), []
        finger.state()

        def read():
            try:
                for _ in range(150):
                    finger.state(pressures=False)
                    values = [finger.ping(), finger.read(reg.MODEL_NUMBER), finger.read(reg.ID)]
                    if values != [21574, 21574, 1]:
                        wrong.append(values)
            except Exception as why:
                wrong.append(why)

        threads = [threading.Thread(target=read) for _ in range(4)]
        [thread.start() for thread in threads]
        [thread.join() for thread in threads]
        self.assertEqual(wrong, [])

    def test_threads_count_the_time_in_the_order_of_their_reads(self):
        finger = self.open()
        other, read = threading.Thread(target=finger.state), finger.read_bytes

        def read_and_let_the_other_read(address, length):
            finger.read_bytes = read
            data = read(address, length)
            other.start()
            other.join(0.5)
            return data

        finger.state()
        finger.read_bytes = read_and_let_the_other_read
        finger.state()  # raises `Restarted` where the other thread counted a later frame first
        other.join()


if __name__ == "__main__":
    unittest.main()
