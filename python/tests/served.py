"""Served fingers for the tests: start, injected faults, and their true state."""

import os
import re
import select
import signal
import socket
import subprocess
import sys
import threading
import time
import tty
import unittest
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Optional, Tuple

from fingertip import Bus, Fingertip, FingertipError, PortLost

# Under `nohup` the programs of the tests would ignore it too.
signal.signal(signal.SIGHUP, signal.SIG_DFL)

SERVE = os.environ.get("FINGERTIP_SERVE", "")
PYTHON = Path(__file__).resolve().parents[1]
PATIENT_MS = 60_000.0  # time within which the slowest machine answers
SOON_MS = 2_000.0  # time-out for devices that do not answer
LONG_S = 2.54  # bus watchdog that does not trip on a busy machine
RESIDUAL_N = 0.05  # a tip that presses with less counts as released


class Truth(NamedTuple):
    mode: str
    force_n: float


class Served:
    """A scene with its fingers behind a pseudo-terminal, or behind TCP."""

    def __init__(self, *arguments: str) -> None:
        pipe = subprocess.PIPE
        self.process = subprocess.Popen([SERVE, *arguments], stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL, text=True)
        name = self._line().split()[1]
        self.port = f"tcp:{name}" if "--tcp" in arguments else name
        self._line()

    def _line(self) -> str:
        assert self.process.stdout
        return self.process.stdout.readline()

    def ask(self, command: str) -> str:
        assert self.process.stdin
        self.process.stdin.write(command + "\n")
        self.process.stdin.flush()
        return self._line()

    def truths(self, fingers: int = 2) -> Dict[int, Truth]:
        lines = [self.ask("state"), *(self._line() for _ in range(fingers))]
        found = [re.match(r"finger (\d+): (\w+).*true force (\S+) N", line) for line in lines[:fingers]]
        return {int(match[1]): Truth(match[2], float(match[3])) for match in found if match}

    def stop(self, number: int = signal.SIGINT) -> None:
        if self.process.poll() is None:
            self.process.send_signal(number)
            self.process.communicate()


class Cable:
    """A pseudo-terminal wired to a finger that is served by TCP; it can be unplugged."""

    def __init__(self, port: str) -> None:
        _, host, number = port.split(":")
        self._served = socket.create_connection((host, int(number)))
        self._served.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._near, self._far = os.openpty()
        tty.setraw(self._far)
        self.port = os.ttyname(self._far)
        self._unplugged, self._hand = os.pipe()
        self._threads = [threading.Thread(target=self._pump, args=ends, daemon=True) for ends in [(0, 1), (1, 0)]]
        for thread in self._threads:
            thread.start()

    def _pump(self, source: int, target: int) -> None:
        ends = [self._near, self._served.fileno()]
        try:
            while self._unplugged not in select.select([ends[source], self._unplugged], [], [])[0]:
                data = os.read(ends[source], 4096)
                if not data:
                    break
                os.write(ends[target], data)
        except OSError:
            pass  # the program or the served finger has ended

    def unplug(self) -> None:
        os.close(self._hand)
        for thread in self._threads:
            thread.join()  # the system soon gives their file descriptors to others
        for end in [self._unplugged, self._far, self._near]:
            os.close(end)
        self._served.close()


@unittest.skipUnless(SERVE, "FINGERTIP_SERVE names the program `serve` that `cargo xtask serve` builds")
class OnServed(unittest.TestCase):
    """A test with its own served finger."""

    ARGUMENTS: Tuple[str, ...] = ("wall", "--set", "hand.fingers=2")

    def setUp(self) -> None:
        # The package sets handlers of signals.
        for number in [signal.SIGTERM, signal.SIGHUP]:
            self.addCleanup(signal.signal, number, signal.getsignal(number))
        # A shell's background job ignores SIGINT, and so would the programs that it starts.
        signal.signal(signal.SIGINT, signal.default_int_handler)
        self.served = self.serve(*self.ARGUMENTS)

    def serve(self, *arguments: str) -> Served:
        served = Served(*arguments)
        self.addCleanup(served.stop)
        return served

    def open(self, device_id: int = 1, **options: Any) -> Fingertip:
        options.setdefault("timeout_ms", PATIENT_MS)
        finger = Fingertip(self.served.port, device_id, **options)
        self.addCleanup(self.close, finger.bus)
        return finger

    def open_bus(self, tared: bool = True, timeout_ms: float = PATIENT_MS) -> Bus:
        bus = Bus(self.served.port, timeout_ms=timeout_ms)
        self.addCleanup(self.close, bus)
        for device_id in [1, 2]:
            finger = bus.finger(device_id)
            if tared:
                finger.tare()
        return bus

    def close(self, bus: Bus) -> None:
        try:
            bus.close()
        except FingertipError:
            pass  # the test broke it

    def python(self, *arguments: str) -> "subprocess.Popen[str]":
        environment = {**os.environ, "PYTHONPATH": str(PYTHON)}
        pipe = subprocess.PIPE
        child = subprocess.Popen(
            [sys.executable, *arguments], env=environment, text=True, stdin=pipe, stdout=pipe, stderr=pipe
        )
        self.addCleanup(child.kill)
        return child

    def holds(self, bus: Bus, ids: List[int]) -> None:
        """Waits until these fingers hold their goals: after the first touch a free object still flies between two tips."""
        while any(
            state.mode.name != "FORCE" or abs(state.force_n - state.goal_n) > 0.1 * state.goal_n
            for device_id, state in bus.states().items()
            if device_id in ids
        ):
            for device_id in ids:
                fault = bus.states()[device_id].fault
                self.assertFalse(fault, f"ID {device_id}: {fault!r}")
            time.sleep(0.01)

    def pass_s(self, seconds: float, device_id: int = 2) -> None:
        """Lets time of the controllers pass, while only this one hears anything."""
        with self.connected() as bus:
            finger = bus.finger(device_id)
            begun_s = finger.state(pressures=False).time_s
            while finger.state(pressures=False).time_s - begun_s < seconds:
                time.sleep(0.02)

    def connected(self) -> Bus:
        while True:
            try:
                return Bus(self.served.port, timeout_ms=PATIENT_MS)
            except PortLost:
                pass  # the served finger has not yet heard that the client before is gone

    def assert_released(self, why: Optional[str] = None, ids: List[int] = [1]) -> None:
        truths = self.served.truths()
        for device_id in ids:
            self.assertLess(truths[device_id].force_n, RESIDUAL_N, f"{why}: {truths}")
            self.assertIn(truths[device_id].mode, ["Off", "Fault"], f"{why}: {truths}")
