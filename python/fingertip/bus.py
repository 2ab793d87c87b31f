"""The fingers of one bus, together: read, pressed, released and kept alive as a group."""

import atexit
import os
import signal
import subprocess
import sys
import threading
import time
from multiprocessing.util import Finalize
from typing import Any, Dict, Iterable, List, Mapping, Optional, Set, Type, Union

from . import registers as reg
from .device import encoded
from .finger import MODEL, PATIENCE_S, Finger, check_silence
from .line import DAMAGED, FORBIDDEN, FingertipError, Line, NoAnswer, PortLost, Refused
from .state import FIRST, Mode, State, length

_RELEASE_S = 0.5  # longest wait for the release when a bus or the program ends
_TRIES = 3  # on a noisy line
_CHUNK = 1000  # bytes of data in one Fast Sync Read, at most
_GRIPS = [Mode.APPROACH, Mode.FORCE, Mode.RELEASE]
_DRIVEN = [*_GRIPS, Mode.PRESS, Mode.STROKES]
_live: "Set[Bus]" = set()  # those that wrote something
children: "Set[subprocess.Popen[str]]" = set()  # programs that `run` waits for


@atexit.register
def _close_all() -> None:
    # A second Ctrl-C must not interrupt the release.
    handlers = {number: signal.signal(number, signal.SIG_IGN) for number in _signals("SIGINT", "SIGTERM", "SIGHUP")}
    _end_children()
    for bus in list(_live):
        try:
            bus.close()
        except BaseException as why:
            print(f"fingertip: {why}", file=sys.stderr)
    for number, handler in handlers.items():
        signal.signal(number, handler or signal.SIG_DFL)


def _end_children() -> None:
    for child in list(children):
        child.terminate()  # it stops the finger


def _exit(number: int, frame: Any) -> None:
    _end_children()  # before `_close_all`, Python joins the threads that wait for them
    sys.exit(128 + number)


def _signals(*names: str) -> List[signal.Signals]:
    """Returns the signals that can be handled here: none outside of the main thread, and no SIGHUP on Windows."""
    main = threading.current_thread() is threading.main_thread()
    return [getattr(signal, name) for name in names if main and hasattr(signal, name)]


def catch_signals() -> None:
    """Makes SIGTERM and SIGHUP end the program as `sys.exit` does, unless the program handles them."""
    for number in _signals("SIGTERM", "SIGHUP"):
        if signal.getsignal(number) == signal.SIG_DFL:
            signal.signal(number, _exit)


class Bus:
    """A bus with its fingers: a serial port, a pseudo-terminal, or `tcp:ADDRESS:PORT` of a served finger.

        with Bus("/dev/ttyACM0") as bus:
            bus.scan()
            bus.press({1: 0.5, 2: 1.0})
            print(bus.states()[1].force_n)

    The fingers that this object has written to are released when it is closed: at the end of a `with`, in `close()`, and
    when the program exits, also by SIGTERM or SIGHUP. `leave_pressing=True` leaves torque and goals as they are.
    """

    def __init__(
        self, port: str, baud: int = 1_000_000, timeout_ms: float = 1000.0, leave_pressing: bool = False
    ) -> None:
        self.line = Line(port, baud, timeout_ms)
        self.fingers: Dict[int, Finger] = {}  # by ID: those that `finger` or `scan` found
        self._leave_pressing = leave_pressing
        self._silence_s: Dict[int, float] = {}  # bus watchdogs that are on, by ID
        self._feeder: Optional[threading.Thread] = None
        self._absent: Set[int] = set()  # those that gave no answer last time
        self._process = os.getpid()
        Finalize(None, _close_all, exitpriority=0)  # `multiprocessing` ends its processes without `atexit`

    def __enter__(self) -> "Bus":
        return self

    def __exit__(self, kind: Optional[Type[BaseException]], why: Any, trace: Any) -> None:
        try:
            self.close()
        except FingertipError as failed:
            if kind is None:
                raise
            # The exception that ended the block goes on.
            print(f"fingertip: {failed}", file=sys.stderr)

    def close(self) -> None:
        """Releases the fingers, unless `leave_pressing`, and gives the port back.

        Where a controller does not answer, its bus watchdog stops the motor.
        """
        if self._process != os.getpid():
            return  # a forked child: the fingers are its parent's
        with self.line.lock:  # no other thread presses again meanwhile
            wrote = [device_id for device_id, finger in self.fingers.items() if finger.wrote]
            # Any other exception, as Ctrl-C, leaves the port open: the exit of the program tries again.
            try:
                if wrote and not self._leave_pressing:
                    self.release(wrote, _RELEASE_S)
                self.unwatch(self._silence_s)
            except FingertipError:
                self._shut()
                raise
            self._shut()

    def _shut(self) -> None:
        with self.line.lock:
            self._silence_s.clear()
            self.line.feed_s = None
            self.line.closePort()
        for finger in self.fingers.values():
            finger.wrote = False
        _live.discard(self)

    def touch(self, finger: Finger) -> None:
        """Notes that something is written to a finger: it may press because of this program."""
        finger.wrote = True
        _live.add(self)
        catch_signals()

    def finger(self, device_id: int = 1) -> Finger:
        """The finger with this ID; raises `NoAnswer` if no device answers."""
        if device_id not in self.fingers:
            self.fingers[device_id] = Finger(self, device_id)
        return self.fingers[device_id]

    def scan(self) -> List[int]:
        """Finds all fingers of the bus by a broadcast Ping, while none presses; returns their IDs. Takes a second."""
        if self._silence_s:
            raise FingertipError("a scan is silent for longer than a bus watchdog allows: release() first")
        found = self.line.scan()
        return [device_id for device_id in sorted(found) if found[device_id] == MODEL and self.finger(device_id)]

    def states(self, pressures: bool = False) -> Dict[int, State]:
        """The states of all fingers, by ID, in one exchange; raises the error of the first finger without a state."""
        states = {}
        for device_id, state in self._look(self.fingers, pressures).items():
            if isinstance(state, FingertipError):
                raise state
            states[device_id] = state
        return states

    def press(self, newtons: Union[float, Mapping[int, float]], silence_s: Optional[float] = 0.5) -> None:
        """Asks fingers for forces, all of them or each of these IDs: the tips approach, touch and hold. Returns at once.

        Nothing moves where one of them cannot press. Where one refuses all the same, those that did not press before are
        released again. `silence_s` is that of `Finger.enable_torque`.
        """
        check_silence(silence_s)
        forces = newtons if isinstance(newtons, Mapping) else dict.fromkeys(self.fingers, newtons)
        if not forces:
            raise FingertipError("no finger is known on this bus: call scan() or finger()")
        goals = {device_id: round(min(max(1000 * force, -1.0), 1e9)) for device_id, force in forces.items()}
        for goal_mn in goals.values():
            encoded(reg.GOAL_FORCE_MN, goal_mn)
        rest = [device_id for device_id, goal_mn in goals.items() if not self.finger(device_id).ready(goal_mn)]
        self.watch(goals, silence_s)  # if refused, another client commands: to release would stop its fingers
        try:
            _check(self._set(reg.TORQUE_ENABLE, dict.fromkeys(goals, 1)))
            self._tell(reg.GOAL_FORCE_MN, goals)
            _check(self._set(reg.GOAL_FORCE_MN, goals))
        except FingertipError:
            try:
                self.release([device_id for device_id in rest if self.fingers[device_id].wrote], _RELEASE_S)
            except FingertipError:
                pass  # the first failure is more informative
            raise

    def release(self, ids: Optional[Iterable[int]] = None, within_s: float = PATIENCE_S) -> None:
        """Releases all fingers, or these IDs: each turns torque off once its tip is clear, or after `within_s`.

        A finger in a fault has been stopped by it. One that does not answer does not keep the others from it; its error is
        raised when they are at rest. It keeps torque and releases, until its bus watchdog stops it: on a line that stalled,
        torque off would arrive together with the goal of 0, and friction would keep most of the force.
        """
        all_ids = list(self.fingers if ids is None else ids)
        failed = self._rest(all_ids, within_s)
        failed.update(self._set(reg.TORQUE_ENABLE, {device_id: 0 for device_id in all_ids if device_id not in failed}))
        for device_id in all_ids:
            if device_id not in failed:
                try:
                    self.fingers[device_id].wait(reg.PRESENT_MODE, *_DRIVEN)  # the loop takes torque off with its next frame
                except NoAnswer as why:
                    failed[device_id] = why
        self.unwatch(all_ids, failed)
        _check(failed)

    def stop(self) -> None:
        """Stops all fingers in every mode: a grip is released within 0.5 s, then torque is off, which ends all else."""
        self.release(None, _RELEASE_S)

    def watch(self, ids: Iterable[int], silence_s: Optional[float]) -> None:
        """Sets bus watchdogs, and feeds them from a thread until the fingers are released. None turns them off."""
        check_silence(silence_s)
        if silence_s is None:
            return self.unwatch(ids)
        with self.line.lock:
            added = [device_id for device_id in ids if device_id not in self._silence_s]
            self._silence_s.update(dict.fromkeys(ids, silence_s))
            self.line.feed_s = min(self._silence_s.values()) / 4
            if self._feeder is None:
                self._feeder = threading.Thread(target=self._feed, daemon=True)
                self._feeder.start()
        failed = self._set(reg.BUS_WATCHDOG, dict.fromkeys(ids, 20 * round(silence_s / 0.02)))
        if failed:
            self.unwatch([*added, *failed], failed)
        _check(failed)

    def _feed(self) -> None:
        while True:
            with self.line.lock:
                feed_s = self.line.feed_s
                if feed_s is None or not self.line.is_open:
                    self._feeder = None
                    return
                try:
                    self.line.feed()
                except FingertipError:
                    pass  # the program sees a bad line in its own exchanges
            time.sleep(feed_s / 2)

    def unwatch(self, ids: Iterable[int], failed: Iterable[int] = ()) -> None:
        """Turns the watchdogs off and feeds them no more. Those of fingers that did not answer stay on, to stop them.

        Where another client of `fingertip share` commands, the watchdogs are left to that client.
        """
        watched = [device_id for device_id in ids if device_id in self._silence_s]
        kept = self._set(reg.BUS_WATCHDOG, {device_id: 0 for device_id in watched if device_id not in failed})
        with self.line.lock:
            for device_id in watched:
                self._silence_s.pop(device_id, None)
            self.line.feed_s = min(self._silence_s.values()) / 4 if self._silence_s else None
        _check({device_id: why for device_id, why in kept.items() if getattr(why, "number", None) != FORBIDDEN})

    def _look(self, ids: Iterable[int], pressures: bool = False) -> "Dict[int, Union[State, FingertipError]]":
        """The states of these fingers; for a finger without one the error."""
        wanted, size = list(ids), length(pressures)
        data: Dict[int, bytes] = {}
        found: Dict[int, Union[State, FingertipError]] = {}
        with self.line.lock:  # threads must count the time in the order of their reads
            at_once = _CHUNK // (size + 4)
            # A missing finger also silences those after it. Then each finger is read separately.
            there = [device_id for device_id in wanted if device_id not in self._absent]
            for part in (there[at : at + at_once] for at in range(0, len(there), at_once)):
                if len(part) > 1:
                    try:
                        data.update(self.line.sync_read(FIRST.address, size, part))
                    except NoAnswer:
                        pass
            for device_id in wanted:
                finger = self.fingers[device_id]
                try:
                    found[device_id] = finger.state_of(data.get(device_id) or finger.read_bytes(FIRST.address, size))
                    self._absent.discard(device_id)
                except PortLost:
                    raise
                except FingertipError as why:
                    found[device_id] = why
                    if isinstance(why, NoAnswer):
                        self._absent.add(device_id)
        return found

    def _tell(self, register: reg.Register, values: Mapping[int, int]) -> None:
        """Writes a register of several fingers in one packet, without an answer."""
        for device_id in values:
            self.touch(self.fingers[device_id])
        data = {device_id: encoded(register, value) for device_id, value in values.items()}
        if data:
            self.line.sync_write(register.address, register.width, data)

    def _set(self, register: reg.Register, values: Mapping[int, int]) -> Dict[int, FingertipError]:
        """Writes a register of each finger, with an answer. Returns the failures.

        The register must be one that can be written while torque is on: then only `fingertip share` refuses with error 7.
        """
        failed: Dict[int, FingertipError] = {}
        for device_id, value in values.items():
            for _ in range(1 if device_id in self._absent else _TRIES):
                try:
                    self.fingers[device_id].write(register, value)
                    failed.pop(device_id, None)
                    break
                except NoAnswer as why:
                    failed[device_id] = why
                except Refused as why:
                    failed[device_id] = why
                    if why.number == FORBIDDEN:
                        # Another client commands. Once this one leaves, `share` stops all its fingers but those of the other.
                        for finger in self.fingers.values():
                            finger.wrote = False
                    if why.number != DAMAGED:
                        break
        return failed

    def _rest(self, ids: Iterable[int], within_s: float) -> Dict[int, FingertipError]:
        """Releases the tips, and waits for the end by the controllers' clocks. Returns the failures."""
        until = time.monotonic() + PATIENCE_S + self.line.timeout_ms * 1e-3
        missed = dict.fromkeys(ids, 0)  # reads in a row without an answer, of the fingers that may still press
        failed: Dict[int, FingertipError] = {}
        begun_s: Dict[int, float] = {}
        goals = list(missed)
        while missed and time.monotonic() < until:
            self._tell(reg.GOAL_FORCE_MN, dict.fromkeys(goals, 0))
            goals = []
            for device_id, state in self._look(missed).items():
                if isinstance(state, FingertipError):
                    missed[device_id] += 1
                    if missed[device_id] == _TRIES:
                        failed[device_id] = state
                        del missed[device_id]
                    continue
                missed[device_id] = 0
                if state.mode == Mode.PRESS or state.mode in _GRIPS and state.goal_n:
                    goals.append(device_id)  # the first packet was lost: the release has not begun
                elif state.time_s - begun_s.setdefault(device_id, state.time_s) > within_s:
                    del missed[device_id]
                elif state.mode not in _GRIPS or _is_clear(state):
                    del missed[device_id]
            if missed:
                time.sleep(0.01)
        return failed


def _check(failed: Mapping[int, FingertipError]) -> None:
    for why in failed.values():
        raise why


def _is_clear(state: State) -> bool:
    return state.mode == Mode.RELEASE and abs(state.speed_mm_per_s) < 1.0 and state.force_n < 0.01


class Fingertip(Finger):
    """The one finger of a bus: opens the port, and closes it as `Bus` does."""

    def __init__(
        self,
        port: str,
        device_id: int = 1,
        baud: int = 1_000_000,
        timeout_ms: float = 1000.0,
        leave_pressing: bool = False,
    ):
        bus = Bus(port, baud, timeout_ms, leave_pressing)
        try:
            super().__init__(bus, device_id)
            bus.fingers[device_id] = self
        except BaseException:
            bus.close()
            raise

    def __enter__(self) -> "Fingertip":
        return self

    def __exit__(self, kind: Optional[Type[BaseException]], why: Any, trace: Any) -> None:
        self.bus.__exit__(kind, why, trace)

    def close(self) -> None:
        """Releases the finger, unless `leave_pressing`, and gives the port back."""
        self.bus.close()
