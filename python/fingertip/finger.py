"""What one does with a fingertip."""

import atexit
import os
import signal
import sys
import threading
import time
import weakref
from typing import Any, Dict, Iterator, Mapping, Optional, Tuple, Type

from . import registers as reg
from .bus import Bus, FingertipError, NoAnswer, PortLost, Refused, numbers
from .drive import JOG, MEASURE, Drive, carry_out, measured
from .state import Fault, Limits, Mode, Restarted, State

_MODEL = 21574  # the letters FT
_TARING, _TARED = 1, 2
_SAME, _CHANGED = 0, 1
_FIRST, _LAST = reg.PICTURE_TIME_US, reg.PRESSURES
_PARAMETERS = [
    register
    for register in reg.ALL
    if register.stored and register.numbers == 1 and register.address >= reg.TIP_RADIUS_UM.address
]
_PATIENCE_S = 10.0
_RELEASE_S = 0.5  # longest wait for the release when an object or the program ends
_TRIES = 3  # on a noisy line
_live: "weakref.WeakSet[Fingertip]" = weakref.WeakSet()


@atexit.register
def _close_all() -> None:
    for finger in list(_live):
        try:
            finger.close()
        except FingertipError as why:
            print(f"fingertip: {why}", file=sys.stderr)


def _exit(number: int, frame: Any) -> None:
    sys.exit(128 + number)


def _check_silence(silence_s: Optional[float]) -> None:
    if silence_s is not None and not 0.02 <= silence_s <= 2.54:
        raise ValueError(f"silence_s of {silence_s}: 0.02 to 2.54 are allowed")


def _catch_signals() -> None:
    """Makes SIGTERM and SIGHUP end the program as `sys.exit` does, where nobody else handles them."""
    if threading.current_thread() is not threading.main_thread():
        return  # Python sets handlers in the main thread only
    for name in ["SIGTERM", "SIGHUP"]:
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) == signal.SIG_DFL:
            signal.signal(number, _exit)


class Fingertip(Bus):
    """A fingertip controller.

    An object that has written anything turns torque off when it is closed: at the end of a `with`, in `close()`, and when
    the program exits, also by SIGTERM or SIGHUP. `leave_pressing=True` leaves torque and goal as they are.
    """

    def __init__(
        self,
        port: str,
        device_id: int = 1,
        baud: int = 1_000_000,
        timeout_ms: float = 100.0,
        leave_pressing: bool = False,
    ):
        super().__init__(port, device_id, baud, timeout_ms)
        self.leave_pressing = leave_pressing
        self._wrote = False
        self._silence_s = 0.0  # time of the bus watchdog
        self._fed: Optional[threading.Event] = None  # ends the thread that feeds the bus watchdog
        self._process = os.getpid()
        _live.add(self)
        self._last: Optional[Tuple[int, int]] = None  # time and frame of the last state
        self._time_us = 0
        try:
            model = self.ping()
            if model != _MODEL:
                raise FingertipError(f"ID {device_id} on {port} is no fingertip: its model number is {model}")
            self._columns = self.read(reg.MODEL_INFORMATION) >> 8 & 0xFF
        except FingertipError:
            self.close()
            raise

    def __enter__(self) -> "Fingertip":
        return self

    def __exit__(self, kind: Optional[Type[BaseException]], why: Any, trace: Any) -> None:
        try:
            self.close()
        except FingertipError:
            if kind is None:
                raise
            # The exception that ended the block is reported instead.

    def close(self) -> None:
        """Turns torque off, unless `leave_pressing`, and gives the port back.

        Where the controller does not answer, the bus watchdog stops the motor.
        """
        if self._process != os.getpid():
            return  # a forked child: the finger is its parent's
        # Any other exception, as Ctrl-C, leaves the port open: the exit of the program tries again.
        try:
            if self._wrote:
                self._end()
        except FingertipError:
            self._wrote = False
            super().close()
            raise
        super().close()

    def _end(self) -> None:
        for left in reversed(range(_TRIES)):
            try:
                if not self.leave_pressing:
                    self.release(_RELEASE_S)
                self._unwatch()
                break
            except (NoAnswer, Restarted):
                if not left:
                    raise
        self._wrote = False

    def write_bytes(self, address: int, data: bytes, doing: str = "") -> None:
        """Writes whole registers side by side: all of it happens or nothing."""
        self._wrote = True
        super().write_bytes(address, data, doing)

    def state(self, pressures: bool = True) -> State:
        """Reads state and time in one packet, with the pressures or without: that is five times as short.

        Raises `Restarted` once where the controller started anew since the last one.
        """
        end = _LAST.address + _LAST.width * _LAST.numbers if pressures else _LAST.address

        def at(register: reg.Register) -> int:
            return numbers(register, data[register.address - _FIRST.address :])[0]

        # Threads must count the time in the order of their reads.
        with self._port.lock:
            data = self.read_bytes(_FIRST.address, end - _FIRST.address)
            time_s = self._beyond_wrap(at(reg.PICTURE_TIME_US), at(reg.PICTURE_FRAME))
        pascals = numbers(_LAST, data[_LAST.address - _FIRST.address :]) if pressures else []
        rows = [pascals[at : at + self._columns] for at in range(0, len(pascals), self._columns)]
        return State(
            time_s=time_s,
            frame=at(reg.PICTURE_FRAME),
            force_n=at(reg.PICTURE_FORCE_MN) * 1e-3,
            goal_n=at(reg.PICTURE_GOAL_MN) * 1e-3,
            centre_x_mm=at(reg.PICTURE_CENTRE_X_UM) * 1e-3,
            centre_y_mm=at(reg.PICTURE_CENTRE_Y_UM) * 1e-3,
            indentation_mm=at(reg.PICTURE_INDENTATION_UM) * 1e-3,
            travel_mm=at(reg.PICTURE_TRAVEL_UM) * 1e-3,
            speed_mm_per_s=at(reg.PICTURE_SPEED_UM_PER_S) * 1e-3,
            duty=at(reg.PICTURE_DUTY_PERMILLE) * 1e-3,
            mode=Mode(at(reg.PICTURE_MODE)),
            fault=Fault(at(reg.PICTURE_FAULT)),
            limits=Limits(at(reg.PICTURE_LIMITS)),
            pressures_kpa=tuple(tuple(pascal * 1e-3 for pascal in row) for row in rows),
        )

    def stream(
        self, rate_hz: float = 200.0, seconds: Optional[float] = None, pressures: bool = True
    ) -> Iterator[State]:
        """States in turn, each of another frame; those that got no answer are left out, ten in a row end it.

        A rate of 0 is as fast as it goes; without seconds it goes on for ever.
        """
        if rate_hz != 0 and not 0.001 <= rate_hz <= 1e6:
            raise ValueError(f"rate_hz of {rate_hz}: 0, or 0.001 to 1e6")
        if seconds is not None and not 0 <= seconds <= 1e9:
            raise ValueError(f"seconds of {seconds}: 0 to 1e9")
        period_s = 1.0 / rate_hz if rate_hz else 0.0
        due, missed, frame, first_s = time.monotonic(), 0, None, None
        while True:
            try:
                state = self.state(pressures)
                missed = 0
            except NoAnswer:
                missed += 1
                if missed >= 10:
                    raise
                continue
            first_s = state.time_s if first_s is None else first_s
            if seconds is not None and state.time_s - first_s > seconds:
                return
            if state.frame != frame:
                frame = state.frame
                yield state
            # The rate holds on average: a state that came late is made up for, up to a tenth of a second.
            due = max(due + period_s, time.monotonic() - 0.1)
            time.sleep(max(0.0, due - time.monotonic()))

    def tare(self) -> None:
        """Measures every taxel's zero, with torque off; nothing may touch the tip."""
        self.write(reg.TORQUE_ENABLE, 0)
        self.write(reg.TARE, 1)
        state = self._wait(reg.TARE_STATE, _TARING)
        if state != _TARED:
            raise FingertipError(f"the tare came to nothing: fault {self.read(reg.FAULT)}")
        if self.read(reg.LIMITS) & Limits.TARED_TOUCHING:
            raise FingertipError("something seemed to touch the tip while it was tared: free it and tare again")

    def jog(self) -> None:
        """Moves the tip a little, towards the object first: proves that motor and encoder go the same way."""
        carry_out(self, JOG)

    def confirm_direction(self) -> None:
        """Says that somebody saw the jog go towards the object first: torque is refused before."""
        self.write(reg.COMMISSION_ACCEPT, 1)

    def measure_drive(self) -> Drive:
        """Measures the drive by motions of 1 mm to both sides in the air. The parameters stay until it is accepted."""
        carry_out(self, MEASURE)
        return measured(self)

    def accept_drive(self, save: bool = False) -> None:
        """Takes what was measured into the parameters."""
        self.write(reg.COMMISSION_ACCEPT, 2)
        if save:
            self.save()

    def enable_torque(self, silence_s: Optional[float] = 0.5) -> None:
        """Turns torque on under the bus watchdog: the controller stops the motor after `silence_s` without a packet.

        A thread of this object reads a register often enough until `release()`, `recover()` or the end. So the watchdog
        stops the motor when the program is killed or the link breaks: fault 7. None turns the watchdog off.
        """
        _check_silence(silence_s)
        _catch_signals()
        if silence_s is None:
            self._unwatch()
        else:
            self.write(reg.BUS_WATCHDOG, 20 * round(silence_s / 0.02))
            if self._fed is None or silence_s != self._silence_s:
                self._stop_feeding()
                self._silence_s, self._fed = silence_s, threading.Event()
                threading.Thread(target=self._feed, args=(self._fed, silence_s / 4), daemon=True).start()
        self.write(reg.TORQUE_ENABLE, 1)

    def _feed(self, end: threading.Event, period_s: float) -> None:
        while not end.wait(period_s):
            try:
                self.read(reg.BUS_WATCHDOG)
            except PortLost:
                return
            except FingertipError:
                pass  # the program sees a bad line in its own reads

    def _stop_feeding(self) -> None:
        if self._fed:
            self._fed.set()
            self._fed = None

    def _unwatch(self) -> None:
        if self._fed:
            self.write(reg.BUS_WATCHDOG, 0)
            self._stop_feeding()

    def press(self, newtons: float, silence_s: Optional[float] = 0.5) -> None:
        """Asks for a force: the tip approaches, touches and holds it. Returns at once.

        Where the force is refused, torque is as it was. `silence_s` is that of `enable_torque`.
        """
        _check_silence(silence_s)
        goal_mn = round(1000 * newtons)
        if not reg.GOAL_FORCE_MN.least <= goal_mn <= reg.GOAL_FORCE_MN.largest:
            raise ValueError(f"{newtons} N: 0 to {reg.GOAL_FORCE_MN.largest / 1000} N are allowed")
        if self.read(reg.LIMITS) & Limits.NOT_TARED:
            raise FingertipError("the tip is not tared since the controller started: free it and call tare()")
        if not self.read(reg.DIRECTION_CONFIRMED):
            raise FingertipError("nobody confirmed yet which way the motor goes: jog(), watch, confirm_direction()")
        was_on = self.read(reg.TORQUE_ENABLE)
        try:
            self.enable_torque(silence_s)
            self.write(reg.GOAL_FORCE_MN, goal_mn)
        except Refused:
            if not was_on:
                self.write(reg.TORQUE_ENABLE, 0)
                self._unwatch()
            raise

    def release(self, within_s: float = _PATIENCE_S) -> None:
        """Lets go, and turns torque off once the tip is clear, or after `within_s`."""
        try:
            if self.read(reg.TORQUE_ENABLE):
                self.write(reg.GOAL_FORCE_MN, 0)
                self._wait_clear(within_s)
        except Refused:
            pass  # a fault has ended the press
        self.write(reg.TORQUE_ENABLE, 0)
        self._unwatch()

    def _wait_clear(self, within_s: float) -> None:
        until = time.monotonic() + within_s
        while time.monotonic() < until:
            state = self.state(pressures=False)
            if state.fault or state.mode == Mode.RELEASE and abs(state.speed_mm_per_s) < 1.0 and state.force_n < 0.01:
                break
            time.sleep(0.01)

    def recover(self) -> Fault:
        """Clears what stopped the motor; torque is off then, and the goal 0. Returns what it was."""
        fault = Fault(self.read(reg.FAULT))
        try:
            self.write(reg.RECOVER, 1)
        except Refused as why:
            hindrance = self.read(reg.RECOVER_HINDRANCE)
            words = {1: "the supply is low", 2: "the supply is high", 3: "too many taxels are bad", 4: "a save waits"}
            raise FingertipError(f"{fault.name} cannot be cleared: {words.get(hindrance, why)}") from why
        self._unwatch()
        if self._wait(reg.FAULT, int(fault)) if fault else 0:
            raise FingertipError(f"{Fault(self.read(reg.FAULT)).name} stands again: what causes it is still there")
        return fault

    def parameters(self) -> Dict[str, int]:
        """All parameters by name, in the units that the names end with."""
        first, last = _PARAMETERS[0], _PARAMETERS[-1]
        data = self.read_bytes(first.address, last.address + last.width - first.address)
        return {register.name: numbers(register, data[register.address - first.address :])[0] for register in _PARAMETERS}

    def set_parameters(self, values: Mapping[str, int], save: bool = False) -> None:
        """Sets parameters with torque off: all of them or none, as they go out in one packet."""
        all_values = self.parameters()
        for name, value in values.items():
            known = [register for register in _PARAMETERS if register.name == name]
            if not known:
                raise ValueError(f"no parameter {name}: there are {', '.join(all_values)}")
            if not known[0].least <= value <= known[0].largest:
                raise ValueError(f"{name} of {value}: {known[0].least} to {known[0].largest} are allowed")
            all_values[name] = value
        data = b"".join(
            all_values[register.name].to_bytes(register.width, "little", signed=register.signed)
            for register in _PARAMETERS
        )
        self.write_bytes(_PARAMETERS[0].address, data, f"set {', '.join(values)}")
        if save:
            self.save()

    def save(self) -> None:
        """Keeps the parameters over a reset."""
        meant = self.parameters()
        self.write(reg.SAVE_PARAMETERS, 1)
        if self._wait(reg.SAVED_STATE, _CHANGED) != _SAME:
            raise FingertipError("the save failed: the flash holds what it did")
        if self.parameters() != meant:
            raise Restarted("the controller started anew before it saved: the flash holds what it did")

    def _wait(self, register: reg.Register, while_it_is: int) -> int:
        """Reads a register until it is something else, or the time is over."""
        until = time.monotonic() + _PATIENCE_S
        value = self.read(register)
        while value == while_it_is and time.monotonic() < until:
            time.sleep(0.002)
            value = self.read(register)
        return value

    def _beyond_wrap(self, time_us: int, frame: int) -> float:
        """Seconds since the first state; the controller's microseconds wrap after 71 minutes."""
        last_us, last_frame = self._last or (time_us, frame)
        self._last = (time_us, frame)
        if (frame - last_frame) & 0x80000000:
            self._last, self._time_us = None, 0
            raise Restarted("the controller started anew: torque is off, and it is not tared")
        self._time_us += (time_us - last_us) & 0xFFFFFFFF
        return self._time_us / 1e6
