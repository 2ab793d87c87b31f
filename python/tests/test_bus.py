"""Tests of several fingers on one bus."""

import signal
import threading
import time
from typing import Any, List
from unittest import mock

from fingertip import Bus, Fault, FingertipError, Mode, NoAnswer, Refused
from fingertip import registers as reg
from fingertip.device import Device

from served import LONG_S, PATIENT_MS, SOON_MS, OnServed

# Two fingers press; then the program executes the code of the test.
CHILD = """
import sys
from fingertip import Bus
bus = Bus(sys.argv[1], timeout_ms=60_000)
for finger in [bus.finger(1), bus.finger(2)]:
    finger.tare()
bus.press({1: 0.5, 2: 0.8}, 2.54)
print("pressing", flush=True)
"""
GO_ON = "while True: bus.states()"
# Ctrl-C while the end of the program releases the fingers.
SECOND = "import signal; rest = bus._rest; bus._rest = lambda *given: signal.raise_signal(signal.SIGINT) or rest(*given)"


class Group(OnServed):
    def pressing(self, timeout_ms: float = PATIENT_MS) -> Bus:
        bus = self.open_bus(timeout_ms=timeout_ms)
        bus.press({1: 0.5, 2: 0.8}, LONG_S)
        self.holds(bus, [1, 2])
        return bus

    def test_a_release_survives_a_refused_read_and_a_lost_packet_before_a_pause(self) -> None:
        bus = self.pressing()
        look, tell = bus._look, bus._tell

        def refused(*arguments: Any) -> Any:
            bus._look = look  # type: ignore[method-assign]
            return dict.fromkeys(arguments[0], Refused("read", 3))

        def late(*arguments: Any) -> Any:
            bus._look = look  # type: ignore[method-assign]
            states = look(*arguments)
            time.sleep(1.0)
            return states

        def lost(*arguments: Any) -> None:
            bus._tell = tell  # type: ignore[method-assign]

        for device_id, first in [(1, refused), (2, late)]:
            setattr(bus, "_look", first)
            setattr(bus, "_tell", lost)
            bus.release([device_id], 0.5)
            self.assert_released(first.__name__, [device_id])

    def test_a_release_that_a_stalled_line_delivers_late_leaves_no_force(self) -> None:
        bus = self.pressing()
        bus.line.timeout_ms = 20.0
        self.served.process.send_signal(signal.SIGSTOP)
        with self.assertRaises(NoAnswer):
            bus.stop()
        self.served.process.send_signal(signal.SIGCONT)  # it hears all packets at once
        while any(truth.mode not in ["Off", "Fault"] for truth in self.served.truths().values()):
            time.sleep(0.01)
        self.assert_released(ids=[1, 2])

    def test_a_scan_finds_all_fingers(self) -> None:
        bus = Bus(self.served.port, timeout_ms=SOON_MS)
        self.addCleanup(self.close, bus)
        self.assertEqual(bus.scan(), [1, 2])
        self.assertEqual(list(bus.fingers), [1, 2])
        self.assertIs(bus.finger(2), bus.fingers[2])
        with self.assertRaises(NoAnswer):
            bus.finger(3)
        for finger in bus.fingers.values():
            finger.tare()
        bus.press(0.3)
        with self.assertRaises(FingertipError):
            bus.scan()

    def test_all_states_are_of_one_exchange(self) -> None:
        bus = self.pressing()
        goals = [state.goal_n for state in bus.states().values()]
        self.assertEqual(goals, [0.5, 0.8])
        before = [finger.read(reg.GOOD_PACKETS) for finger in bus.fingers.values()]
        bus.line.feed_s = None
        for _ in range(10):
            states = bus.states(pressures=True)
            self.assertEqual(states[1].frame, states[2].frame)
            self.assertEqual(len(states[2].pressures_kpa), 10)
        after = [finger.read(reg.GOOD_PACKETS) for finger in bus.fingers.values()]
        self.assertEqual([new - old for new, old in zip(after, before)], [11, 11], "one packet for each look")

    def test_a_finger_that_nobody_polls_is_kept_alive(self) -> None:
        bus = self.pressing()
        first, silent = bus.fingers[1], bus.fingers[2]
        # Reads of one finger leave no time for the thread, and the other hears them not as its own.
        begun_s = first.state(pressures=False).time_s
        while (state := first.state(pressures=False)).time_s - begun_s < 4.0 * LONG_S:
            self.assertFalse(state.fault)
        self.assertEqual(silent.state().mode, Mode.FORCE)
        # The release of one, which waits, leaves the other in peace.
        self.served.ask("fault encoder-frozen 1")
        first.release(3.0 * LONG_S)
        self.assertEqual(silent.state().mode, Mode.FORCE)
        silent.release()
        self.assert_released(ids=[1, 2])

    def test_a_group_is_released_and_stopped(self) -> None:
        bus = self.pressing()
        for let_go in [bus.release, bus.stop]:
            let_go()
            self.assert_released(ids=[1, 2])
            for finger in bus.fingers.values():
                values = [finger.read(register) for register in [reg.TORQUE_ENABLE, reg.BUS_WATCHDOG, reg.FAULT]]
                self.assertEqual(values, [0, 0, 0])
            bus.press(0.4, LONG_S)
            self.holds(bus, [1, 2])
        bus.close()
        self.assert_released(ids=[1, 2])

    def test_one_in_a_fault_does_not_keep_the_others(self) -> None:
        bus = self.pressing()
        self.served.ask("fault bridge 2")
        while not bus.states()[2].fault:
            pass
        self.assertEqual(bus.states()[1].mode, Mode.FORCE)
        with self.assertRaisesRegex(FingertipError, "ID 2 is stopped by BRIDGE"):
            bus.press(0.3)
        self.assertEqual(bus.states()[1].goal_n, 0.5, "nothing was changed")
        bus.stop()
        self.assert_released(ids=[1])
        self.assertEqual(bus.states()[1].mode, Mode.OFF)

    def test_one_that_refuses_takes_the_others_back(self) -> None:
        bus = self.open_bus()
        with self.assertRaises(Refused):
            bus.press({1: 0.5, 2: 100.0})
        # The second is beyond what `ready` sees: as if the limit had changed behind it.
        bus.fingers[2].ready = lambda goal_mn: False  # type: ignore[method-assign]
        with self.assertRaises(Refused):
            bus.press({1: 0.5, 2: 100.0})
        self.assert_released(ids=[1, 2])
        self.assertEqual([finger.read(reg.TORQUE_ENABLE) for finger in bus.fingers.values()], [0, 0])

    def test_a_press_while_another_program_commands_writes_nothing_more(self) -> None:
        self.open_bus().close()
        bus = self.open_bus(tared=False)
        refused = mock.patch.object(Device, "write_bytes", side_effect=Refused("write", 7))
        for wrote, silence_s in [(False, None), (False, LONG_S), (True, None), (True, LONG_S)]:
            for finger in bus.fingers.values():
                finger.wrote = wrote
            with refused, mock.patch.object(bus.line, "sync_write") as told, self.assertRaises(Refused):
                bus.press(0.5, silence_s)
            told.assert_not_called()
            self.assertEqual([finger.wrote for finger in bus.fingers.values()], [False] * 2, "nothing to release at the end")

    def test_a_release_after_another_client_took_the_command_raises_nothing(self) -> None:
        bus = self.pressing()
        write = Device.write_bytes

        def share(device: Device, address: int, data: bytes, doing: str = "") -> None:
            if any(data) or address == reg.BUS_WATCHDOG.address:
                raise Refused(doing, 7)
            write(device, address, data, doing)

        with mock.patch.object(Device, "write_bytes", share):
            bus.release()
        self.assert_released(ids=[1, 2])
        self.assertIsNone(bus.line.feed_s)

    def test_a_watchdog_that_one_refuses_is_turned_off_at_the_others(self) -> None:
        bus = self.open_bus()
        bus.fingers[2].write_bytes = mock.Mock(side_effect=Refused("write", 7))  # type: ignore[method-assign]
        self.assertRaises(Refused, bus.press, 0.5, LONG_S)
        self.assertEqual((bus.fingers[1].read(reg.BUS_WATCHDOG), bus.line.feed_s), (0, None))

    def test_one_that_does_not_answer_does_not_keep_the_others(self) -> None:
        bus = self.pressing(SOON_MS)
        # Another ID is for this bus the same as an unplugged finger.
        for finger in bus.fingers.values():
            finger.write(reg.GOAL_FORCE_MN, 0)
            finger.write(reg.TORQUE_ENABLE, 0)
        bus.finger(2).write(reg.ID, 7)
        bus.finger(1).press(0.5, LONG_S)
        self.holds_one(bus)
        with self.assertRaisesRegex(NoAnswer, "ID 2"):
            bus.states()
        with self.assertRaisesRegex(NoAnswer, "ID 2"):
            bus.press(0.3)
        self.assertEqual(bus.fingers[1].state().mode, Mode.FORCE, "it was kept alive meanwhile")
        with self.assertRaisesRegex(NoAnswer, "ID 2"):
            bus.stop()
        self.assert_released(ids=[1])
        self.assertEqual(bus.fingers[1].read(reg.BUS_WATCHDOG), 0)

    def holds_one(self, bus: Bus) -> None:
        while bus.fingers[1].state().mode != Mode.FORCE:
            time.sleep(0.01)

    def test_the_end_of_a_program_releases_all(self) -> None:
        kills = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]
        ends = [("", 0), (SECOND, 0), ("raise ValueError", 0), *((GO_ON, kill) for kill in kills)]
        for then, kill in ends:
            with self.subTest(then=then, kill=kill):
                child = self.python("-c", CHILD + then, self.served.port)
                assert child.stdout
                self.assertEqual(child.stdout.readline(), "pressing\n")
                if kill:
                    child.send_signal(kill)
                child.communicate()
                self.assert_released(ids=[1, 2])
                # By the program: no bus watchdog had to do it.
                self.assertEqual([truth.mode for truth in self.served.truths().values()], ["Off", "Off"])

    def test_after_an_interrupted_read_of_all_the_line_is_free_at_once(self) -> None:
        bus = self.open_bus(tared=False)
        read, is_over = bus.line.ser.read, bus.line.isPacketTimeout

        def interrupted(length: int) -> bytes:
            bus.line.ser.read = read
            raise KeyboardInterrupt

        def not_over() -> bool:
            self.assertFalse(is_over(), "it waited for an answer that had come")
            return False

        bus.line.ser.read = interrupted
        self.assertRaises(KeyboardInterrupt, bus.states)
        bus.line.isPacketTimeout = not_over  # type: ignore[method-assign]
        self.assertEqual(list(bus.states()), [1, 2])

    def test_a_signal_releases_what_plain_writes_began(self) -> None:
        torque_and_goal = "finger.write(reg.TORQUE_ENABLE, 1); finger.write(reg.GOAL_FORCE_MN, 800)"
        code = CHILD.split("bus.press")[0] + f"from fingertip import registers as reg; {torque_and_goal}\nprint(flush=True)\n"
        child = self.python("-c", code + GO_ON, self.served.port)
        assert child.stdout
        child.stdout.readline()
        while self.served.truths()[2].mode != "Force":
            time.sleep(0.01)
        child.terminate()
        child.communicate()
        self.assert_released(ids=[2])

    def test_a_tare_releases_first_also_after_a_restart(self) -> None:
        bus = self.pressing()
        for finger in bus.fingers.values():
            finger.tare()
        self.assert_released(ids=[1, 2])
        bus.line.exchange("reboot", 1, bus.line.packets.reboot)
        bus.fingers[1].wait(reg.TARE_STATE, 2)  # tared
        bus.fingers[1].write(reg.TARE, 1)
        bus.fingers[1].wait(reg.TARE_STATE, 0, 1)
        bus.press({1: 0.5}, LONG_S)
        while self.served.truths()[1].mode != "Force":
            time.sleep(0.01)
        bus.release()
        self.assert_released(ids=[1, 2])

    def test_recover_without_a_fault_leaves_the_watchdog_on(self) -> None:
        bus = self.pressing()
        self.assertFalse(bus.fingers[1].recover())
        self.assertGreater(bus.fingers[1].read(reg.BUS_WATCHDOG), 0)

    def test_no_other_thread_presses_while_a_bus_is_closed(self) -> None:
        bus = self.pressing()

        def press() -> None:
            try:
                while True:
                    bus.fingers[1].write(reg.GOAL_FORCE_MN, 800)
            except FingertipError:
                pass  # the bus is closed

        thread = threading.Thread(target=press)
        thread.start()
        bus.close()
        thread.join()
        self.assert_released(ids=[1, 2])

    def test_killed_programs_leave_no_finger_pressing(self) -> None:
        child = self.python("-c", CHILD + GO_ON, self.served.port)
        assert child.stdout
        self.assertEqual(child.stdout.readline(), "pressing\n")
        with self.assertRaises(FingertipError):  # it holds the port
            Bus(self.served.port)
        time.sleep(0.3)
        child.kill()
        child.communicate()
        # A packet for a third ID feeds neither watchdog and gets no answer, so the server is asked for the modes.
        while any(truth.mode != "Fault" for truth in self.served.truths().values()):
            time.sleep(0.01)
        self.assert_released(ids=[1, 2])
        with Bus(self.served.port, timeout_ms=PATIENT_MS) as bus:
            self.assertEqual([bus.finger(one).recover() for one in [1, 2]], [Fault.BUS_SILENT] * 2)


class Grasp(OnServed):
    ARGUMENTS = ("grasp",)

    def test_two_fingers_hold_an_object_between_them_and_let_go(self) -> None:
        bus = self.open_bus()
        bus.press(0.9, LONG_S)
        self.holds(bus, [1, 2])
        bus.release()
        self.assert_released(ids=[1, 2])


class Broken(OnServed):
    """Whatever breaks in the middle of a method, its error is one of the package."""

    def test_all_errors_are_of_the_package(self) -> None:
        def methods(bus: Bus) -> List[Any]:
            finger = bus.fingers[1]
            return [
                bus.states, lambda: bus.press(0.2), bus.release, bus.stop, bus.scan, finger.state, finger.tare,
                finger.enable_torque, finger.recover, finger.parameters, lambda: finger.set_parameters({"contact_on_mn": 50}, True),
                lambda: list(finger.stream(0, 0.05)), bus.close,
            ]  # fmt: skip

        def close(bus: Bus) -> None:
            bus.line.closePort()

        def kill(bus: Bus) -> None:
            self.served.stop(signal.SIGKILL)

        def junk(bus: Bus) -> None:
            bus.line.ser.read = bytes  # zeros, as many as are asked for

        def other_id(bus: Bus) -> None:
            bus.fingers[1].write(reg.ID, 9)

        for broken in [close, junk, other_id, kill]:
            for number in range(13):
                # A new finger each time: late answers to an earlier exchange would be taken for answers to this one.
                self.served.stop()
                self.served = self.serve(*self.ARGUMENTS)
                bus = self.open_bus(tared=False)
                method = methods(bus)[number]
                bus.line.timeout_ms = 20.0
                # In the middle of the method: in front of its second exchange.
                exchange, left = bus.line._run, [2]

                def run(failing: str, action: Any) -> Any:
                    left[0] -= 1
                    if left[0] == 0:
                        broken(bus)
                    return exchange(failing, action)

                bus.line._run = run  # type: ignore[method-assign]
                for doing in [method, bus.close]:
                    with self.subTest(broken=broken.__name__, method=number, doing=doing):
                        try:
                            doing()
                        except FingertipError:
                            pass
