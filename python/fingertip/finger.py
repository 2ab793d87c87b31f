"""What one does with a fingertip."""

import time
from typing import TYPE_CHECKING, Dict, Iterator, Mapping, Optional, Tuple

from . import registers as reg
from .device import Device, numbers
from .line import FingertipError, NoAnswer, Refused
from .state import FIRST, Fault, Limits, Restarted, State, length, number

if TYPE_CHECKING:
    from .bus import Bus

MODEL = 21574  # the letters FT
PATIENCE_S = 10.0
_TARING, _TARED, _REFUSED = 1, 2, 3
_SAME, _CHANGED = 0, 1
_PARAMETERS = [
    register
    for register in reg.ALL
    if register.stored and register.numbers == 1 and register.address >= reg.TIP_RADIUS_UM.address
]


def check_silence(silence_s: Optional[float]) -> None:
    """Raises `ValueError` for a time that the bus watchdog cannot have."""
    if silence_s is not None and not 0.02 <= silence_s <= 2.54:
        raise ValueError(f"silence_s of {silence_s}: 0.02 to 2.54 are allowed")


class Finger(Device):
    """A fingertip controller on a bus."""

    def __init__(self, bus: "Bus", device_id: int):
        super().__init__(bus.line, device_id)
        self.bus = bus
        self.wrote = False  # something was written: the bus releases the finger when it is closed
        self._last: Optional[Tuple[int, int]] = None  # time and frame of the last state
        self._time_us = 0
        model = self.ping()
        if model != MODEL:
            raise FingertipError(f"ID {device_id} on {self.line.port_name} is no fingertip: its model number is {model}")
        self._columns = self.read(reg.MODEL_INFORMATION) >> 8 & 0xFF

    def write_bytes(self, address: int, data: bytes, doing: str = "") -> None:
        """Writes whole registers side by side: all of it happens or nothing."""
        with self.line.lock:
            wrote = self.wrote
            self.bus.touch(self)
            try:
                super().write_bytes(address, data, doing)
            except Refused:
                self.wrote = wrote  # nothing was written: the finger may press for another program
                raise

    def state(self, pressures: bool = True) -> State:
        """Reads state and time in one packet, with the pressures or without: that is five times as short.

        Raises `Restarted` once where the controller restarted since the last one.
        """
        # Threads must count the time in the order of their reads.
        with self.line.lock:
            return self.state_of(self.read_bytes(FIRST.address, length(pressures)))

    def state_of(self, data: bytes) -> State:
        """The state that these bytes tell, read by whoever; raises `Restarted` as `state` does."""
        time_s = self._beyond_wrap(number(reg.PICTURE_TIME_US, data), number(reg.PICTURE_FRAME, data))
        return State.of(data, self._columns, time_s)

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
        """Releases the object, turns torque off and measures every taxel's zero; nothing may touch the tip."""
        self.stop()
        self.write(reg.TARE, 1)
        state = self.wait(reg.TARE_STATE, _TARING)
        if state != _TARED:
            fault = Fault(self.read(reg.FAULT))
            touches = "something seems to touch the tip: free it, and let the reading decay"
            why = fault.name if fault else touches if state == _REFUSED else "the controller restarted"
            raise FingertipError(f"the tare came to nothing: {why}")
        if self.read(reg.LIMITS) & Limits.TARED_TOUCHING:
            raise FingertipError("something seemed to touch the tip while it was tared: free it and tare again")

    def enable_torque(self, silence_s: Optional[float] = 0.5) -> None:
        """Turns torque on under the bus watchdog: the controller stops the motor after `silence_s` without a packet.

        A thread of the bus sends one often enough until `release()`, `recover()` or the end. So the watchdog stops the
        motor when the program is killed or the link breaks: fault 7. None turns the watchdog off.
        """
        self.bus.watch([self.device_id], silence_s)
        self.write(reg.TORQUE_ENABLE, 1)

    def press(self, newtons: float, silence_s: Optional[float] = 0.5) -> None:
        """Asks for a force: the tip approaches, touches and holds it. Returns at once.

        Where the force is refused, torque is as it was. `silence_s` is that of `enable_torque`.
        """
        self.bus.press({self.device_id: newtons}, silence_s)

    def ready(self, goal_mn: int) -> bool:
        """Raises an error if the finger cannot press with this force. Returns True if torque is already on."""
        if self.read(reg.FAULT):
            raise FingertipError(f"ID {self.device_id} is stopped by {Fault(self.read(reg.FAULT)).name}: call recover()")
        if self.read(reg.LIMITS) & Limits.NOT_TARED:
            raise FingertipError("the tip is not tared since the controller started: free it and call tare()")
        if not self.read(reg.DIRECTION_CONFIRMED):
            raise FingertipError("nobody confirmed yet which way the motor goes: run `fingertip commission`")
        if goal_mn > self.read(reg.FORCE_MAX_MN):
            raise Refused(f"press with {goal_mn} mN", 6)
        return self.read(reg.TORQUE_ENABLE) == 1

    def release(self, within_s: float = PATIENCE_S) -> None:
        """Lets go, and turns torque off once the tip is clear, or after `within_s`."""
        self.bus.release([self.device_id], within_s)

    def stop(self) -> None:
        """Stops the finger in every mode: a grip is released within 0.5 s, then torque is off, which ends all else."""
        self.release(0.5)

    def recover(self) -> Fault:
        """Clears the fault and returns it; torque is off then, and the goal 0. Without a fault nothing changes."""
        fault = Fault(self.read(reg.FAULT))
        try:
            self.write(reg.RECOVER, 1)
        except Refused as why:
            hindrance = self.read(reg.RECOVER_HINDRANCE)
            words = {1: "the supply is low", 2: "the supply is high", 3: "too many taxels are bad", 4: "a save waits"}
            raise FingertipError(f"{fault.name} cannot be cleared: {words.get(hindrance, why)}") from why
        if not fault:
            return fault
        self.bus.unwatch([self.device_id])
        if self.wait(reg.FAULT, int(fault)):
            raise FingertipError(f"{Fault(self.read(reg.FAULT)).name} is back: what causes it is still there")
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
        if self.wait(reg.SAVED_STATE, _CHANGED) != _SAME:
            raise FingertipError("the save failed: the flash holds what it did")
        if self.parameters() != meant:
            raise Restarted("the controller restarted before it saved: the flash holds what it did")

    def wait(self, register: reg.Register, *while_it_is: int) -> int:
        """Reads a register until it is something else, or the time is over."""
        until = time.monotonic() + PATIENCE_S + self.line.timeout_ms * 1e-3
        value = self.read(register)
        while value in while_it_is and time.monotonic() < until:
            time.sleep(0.002)
            value = self.read(register)
        return value

    def _beyond_wrap(self, time_us: int, frame: int) -> float:
        """Seconds since the first state; the controller's microseconds wrap after 71 minutes."""
        last_us, last_frame = self._last or (time_us, frame)
        self._last = (time_us, frame)
        if (frame - last_frame) & 0x80000000:
            self._last, self._time_us = None, 0
            raise Restarted("the controller restarted: torque is off, and it is not tared")
        self._time_us += (time_us - last_us) & 0xFFFFFFFF
        return self._time_us / 1e6
