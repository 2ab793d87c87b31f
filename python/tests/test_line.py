"""Tests of a line without a finger behind it.

All tests of the package: python -m unittest discover python/tests. Others need served fingers; see `served.py`.
"""

import contextlib
import dataclasses
import fcntl
import os
import random
import signal
import socket
import subprocess
import sys
import threading
import time
import unittest
from typing import Any, Callable, Iterator, List, Optional
from unittest import mock

from dynamixel_sdk import PacketHandler  # type: ignore[import-untyped]

from fingertip import Fault, Fingertip, FingertipError, Limits, Mode, NoAnswer, PortLost, State, bus, run
from fingertip.device import Device
from fingertip.line import Line


def answer(*data: int, device_id: int = 1) -> bytes:
    """A status packet without an error."""
    return status(0, *data, device_id=device_id)


def status(*after: int, device_id: int = 1) -> bytes:
    """A status packet with these bytes after the instruction; without any it is too short."""
    packet = [0xFF, 0xFF, 0xFD, 0, device_id, len(after) + 3, 0, 0x55, *after]
    crc = PacketHandler(2.0).updateCRC(0, packet, len(packet))
    return bytes([*packet, crc & 0xFF, crc >> 8])


class FakeSerial:
    """A port without a machine behind it: `reads` has an action for each read that finds no bytes."""

    def __init__(self, *reads: "Callable[[FakeSerial], None]") -> None:
        self.reads, self.buffer, self.written, self.now_ms = list(reads), b"", b"", 0.0

    def read(self, size: int) -> bytes:
        if not self.buffer and self.reads:
            self.reads.pop(0)(self)
            return b""
        if not self.buffer:
            self.now_ms += 10.0
        data, self.buffer = self.buffer[:size], self.buffer[size:]
        return data

    def write(self, data: bytes) -> int:
        self.written += bytes(data)
        return len(data)

    def reset_input_buffer(self) -> None:
        self.buffer = b""

    def close(self) -> None:
        pass


class Babbling(FakeSerial):
    """A port that receives this junk endlessly, at 1 Mbaud."""

    def __init__(self, junk: Iterator[int]) -> None:
        super().__init__()
        self.junk = junk

    def read(self, size: int) -> bytes:
        self.now_ms += 0.01 * max(1, size)
        return bytes(next(self.junk) for _ in range(size))


def late(data: bytes) -> Callable[[FakeSerial], None]:
    """Bytes come and the time-out passes, both while the program does not run."""

    def action(fake: FakeSerial) -> None:
        fake.buffer += data
        fake.now_ms += 1e6

    return action


def arrive(data: bytes) -> Callable[[FakeSerial], None]:
    def action(fake: FakeSerial) -> None:
        fake.buffer += data

    return action


def stall(fake: FakeSerial) -> None:
    fake.now_ms += 300.0


def interrupt(fake: Optional[FakeSerial] = None) -> None:
    raise KeyboardInterrupt


def for_ever(data: bytes) -> Iterator[int]:
    while True:
        yield from data


class OnPseudoTerminal(unittest.TestCase):
    def setUp(self) -> None:
        near, far = os.openpty()
        self.near: Optional[int] = near
        self.name = os.ttyname(far)
        self.far = open(far, closefd=True)
        self.addCleanup(self.far.close)
        self.addCleanup(self.hang_up)

    def hang_up(self) -> None:
        if self.near is not None:
            os.close(self.near)
            self.near = None

    def device(self, name: str = "", timeout_ms: float = 100.0) -> Device:
        line = Line(name or self.name, 1_000_000, timeout_ms)
        self.addCleanup(line.closePort)
        return Device(line, 1)

    def fake(self, serial: FakeSerial) -> Device:
        """A device on a fake port."""
        device = self.device()
        device.line.ser.close()
        device.line.ser = serial
        device.line.getCurrentTime = lambda: serial.now_ms  # type: ignore[method-assign]
        return device

    def test_an_answer_that_came_before_the_time_out_was_looked_at_is_read(self) -> None:
        self.assertEqual(self.fake(FakeSerial(late(answer(7)))).read_bytes(64, 1), b"\x07")

    def test_a_silent_line_ends_with_no_answer(self) -> None:
        with self.assertRaises(NoAnswer):
            self.fake(FakeSerial()).read_bytes(64, 1)

    def test_junk_without_an_end_ends_with_an_error_in_time(self) -> None:
        draw = random.Random(1)
        junk = {
            "silence at the level": for_ever(b"\0"),
            "headers": for_ever(b"\xff\xff\xfd\0"),
            "answers of another ID": for_ever(answer(1, device_id=2)),
            "packets too short for an answer": for_ever(status()),
            "packets of the longest kind": for_ever(b"\xff\xff\xfd\0\1\xff\3\x55\0"),
            "noise": (draw.randrange(256) for _ in iter(int, 1)),
            "noise of few bytes": (draw.choice(b"\xff\xff\xfd\0\1\4\0\x55") for _ in iter(int, 1)),
        }
        for name, data in junk.items():
            with self.subTest(name):
                device = self.fake(Babbling(data))
                serial = device.line.ser
                calls: List[Callable[[], object]] = [
                    device.ping,
                    lambda: device.read_bytes(64, 1),
                    lambda: device.write_bytes(64, b"\0"),
                ]
                for call in calls:
                    begun_ms = serial.now_ms
                    with self.assertRaises(FingertipError):
                        call()
                    self.assertLess(serial.now_ms - begun_ms, 600.0)
                try:
                    self.assertEqual(device.line.sync_read(64, 1, [1, 2]), {})
                except NoAnswer:
                    pass
                device.line.closePort()

    def test_a_late_answer_is_not_taken_for_the_next_one(self) -> None:
        nothing = [late(b"")] * 2  # ends the first exchange
        device = self.fake(FakeSerial(*nothing, stall, stall, arrive(answer(1)), arrive(answer(2))))
        device.line.timeout_ms = 1000.0
        with self.assertRaises(NoAnswer):
            device.read_bytes(64, 1)
        self.assertEqual(device.read_bytes(64, 1), b"\x02")

    def test_an_interrupted_exchange_leaves_the_port_usable(self) -> None:
        device = self.fake(FakeSerial(interrupt, arrive(answer(1)), arrive(answer(2))))
        with self.assertRaises(KeyboardInterrupt):
            device.read_bytes(64, 1)
        self.assertEqual(device.read_bytes(64, 1), b"\x02")

    def test_an_exchange_that_was_interrupted_before_it_was_sent_leaves_the_port_usable(self) -> None:
        device = self.fake(FakeSerial(arrive(answer(1))))
        clear, device.line.clearPort = device.line.clearPort, interrupt  # type: ignore[method-assign]
        with self.assertRaises(KeyboardInterrupt):
            device.read_bytes(64, 1)
        device.line.clearPort = clear  # type: ignore[method-assign]
        self.assertEqual(device.read_bytes(64, 1), b"\x01")

    def test_an_answer_of_another_length_is_not_the_one_that_is_owed(self) -> None:
        device = self.fake(FakeSerial(arrive(answer(1)), arrive(answer(*[2] * 9)), arrive(answer(*[3] * 9))))
        with self.assertRaises(NoAnswer):
            device.read_bytes(64, 9)
        self.assertEqual(device.read_bytes(64, 9), b"\x03" * 9)

    def test_an_answer_whose_reading_was_interrupted_is_owed_no_more(self) -> None:
        device = self.fake(FakeSerial(arrive(answer(1)), arrive(answer(2))))
        packets, serial = device.line.packets, device.line.ser
        check = packets.updateCRC

        def interrupted(*data: Any) -> Any:
            if len(serial.reads) == 2:
                return check(*data)  # of the packet that is sent
            packets.updateCRC = check
            raise KeyboardInterrupt

        packets.updateCRC = interrupted
        with self.assertRaises(KeyboardInterrupt):
            device.read_bytes(64, 1)
        before_ms = serial.now_ms
        self.assertEqual(device.read_bytes(64, 1), b"\x02")
        self.assertEqual(serial.now_ms, before_ms, "nothing was waited for")

    def test_watchdogs_are_fed_also_while_an_answer_is_waited_for(self) -> None:
        serial = FakeSerial()
        device = self.fake(serial)
        device.line.timeout_ms, device.line.feed_s = 1000.0, 0.05
        with self.assertRaises(NoAnswer), mock.patch("time.monotonic", lambda: serial.now_ms * 1e-3):
            device.ping()
        self.assertGreater(serial.written.count(b"\xff\xff\xfd\0\xfe\7\0\x83\0\0\0\0"), 15)

    def test_a_lost_link_is_an_error_of_the_package(self) -> None:
        device = self.device()
        self.hang_up()
        for _ in range(2):
            with self.assertRaises(PortLost):
                device.read_bytes(64, 1)
        device.line.closePort()
        with self.assertRaises(PortLost):
            device.ping()

    def test_a_port_that_another_program_uses_is_refused(self) -> None:
        with open(self.name, "rb", buffering=0, opener=lambda path, _: os.open(path, os.O_RDWR | os.O_NOCTTY)) as other:
            fcntl.flock(other, fcntl.LOCK_EX)
            with self.assertRaisesRegex(FingertipError, f"cannot open {self.name}: another program"):
                self.device()
            fcntl.flock(other, fcntl.LOCK_UN)
            self.device()
            with self.assertRaises(BlockingIOError):
                fcntl.flock(other, fcntl.LOCK_EX | fcntl.LOCK_NB)

    def test_a_port_that_this_program_uses_is_refused(self) -> None:
        self.device()
        with self.assertRaisesRegex(FingertipError, "another program, or this one, has it open already"):
            self.device()


class OnTcp(unittest.TestCase):
    def serve(self, *sent: bytes) -> str:
        """Serves one client: sends each of these once it has got something. Returns the port's name."""
        listener = socket.create_server(("127.0.0.1", 0))

        def run() -> None:
            with listener, listener.accept()[0] as client:
                for data in sent:
                    client.recv(1024)
                    client.sendall(data)

        threading.Thread(target=run, daemon=True).start()
        return "tcp:%s:%d" % listener.getsockname()

    def test_a_tcp_port_is_taken(self) -> None:
        device = Device(Line(self.serve(answer(70, 84, 1), answer(5)), 1_000_000, 60_000), 1)
        self.assertEqual(device.ping(), 21574)
        self.assertEqual(device.read_bytes(64, 1), b"\x05")
        with self.assertRaises(PortLost):
            device.ping()

    def test_a_second_client_is_told_who_is_there(self) -> None:
        words = b"busy: 127.0.0.1:9 is connected to this fingertip, one client at a time\n"
        for there in [False, True]:
            with socket.create_server(("127.0.0.1", 0)) as listener:
                line = Line("tcp:%s:%d" % listener.getsockname(), 1_000_000, 60_000)
                with listener.accept()[0] as client:
                    client.sendall(words)
            if there:
                while not line.ser.in_waiting:
                    time.sleep(0.001)
                line.ser.reset_input_buffer()  # as `pyserial` does while it opens the port
            with self.assertRaisesRegex(PortLost, "busy: 127.0.0.1:9 is"):
                Device(line, 1).ping()

    def test_a_port_where_nobody_listens_is_refused(self) -> None:
        with socket.create_server(("127.0.0.1", 0)) as listener:
            number = listener.getsockname()[1]
        for name in [f"tcp:127.0.0.1:{number}", "tcp:127.0.0.1", "tcp:", "/nowhere", os.devnull]:
            with self.assertRaisesRegex(FingertipError, f"cannot open {name}: "):
                Fingertip(name)


class Program(unittest.TestCase):
    def test_the_end_of_this_program_ends_the_one_that_run_waits_for(self) -> None:
        def end_and_wait(**given: Any) -> Any:
            with contextlib.suppress(SystemExit):
                end()
            os.close(far)  # ends `cat` if nothing else did
            return communicate(**given)

        ends: List[Callable[[], None]] = [bus._close_all, lambda: bus._exit(signal.SIGTERM, None)]
        for end in ends:
            near, far = os.pipe()
            child = subprocess.Popen(["cat"], stdin=near, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            os.close(near)
            communicate = child.communicate
            program = mock.patch.object(sys.modules[run.__module__], "program")
            start = mock.patch("subprocess.Popen", return_value=child)
            waits = mock.patch.object(child, "communicate", end_and_wait)
            with program, start, waits, self.assertRaises(FingertipError):
                run(port="")
            self.assertEqual(child.returncode, -signal.SIGTERM)


class Values(unittest.TestCase):
    def test_numbers_of_a_newer_firmware_are_values(self) -> None:
        for value, kind in [(Fault(200), Fault), (Mode(200), Mode)]:
            self.assertEqual((int(value), value.name, type(value)), (200, "UNKNOWN_200", kind))
        with self.assertRaises(ValueError):
            Fault("no number")  # type: ignore[arg-type]
        limits = Limits(1 << 15 | 1)
        self.assertEqual((int(limits), limits & Limits.VOLTAGE, type(limits)), (1 << 15 | 1, Limits.VOLTAGE, Limits))

    def test_a_state_has_a_hash(self) -> None:
        numbers: Any = dict.fromkeys((field.name for field in dataclasses.fields(State)), 0)
        state = State(**{**numbers, "pressures_kpa": ((1.0, 2.0),)})
        self.assertEqual(hash(state), hash(dataclasses.replace(state)))


if __name__ == "__main__":
    unittest.main()
