"""State of the controller."""

from dataclasses import dataclass
from enum import IntEnum, IntFlag
from typing import Optional, Tuple

from . import registers as reg
from .device import numbers
from .line import FingertipError

FIRST, _LAST = reg.PICTURE_TIME_US, reg.PRESSURES  # first and last register of a state


def length(pressures: bool) -> int:
    """Bytes of a state with the pressures, or without: that is five times as short."""
    return _LAST.address - FIRST.address + (_LAST.width * _LAST.numbers if pressures else 0)


def number(register: reg.Register, data: bytes) -> int:
    """The number of a register in the bytes of a state."""
    return numbers(register, data[register.address - FIRST.address :])[0]


class _Open(IntEnum):
    """Numbers with names. A number of a newer firmware has the name `UNKNOWN_` and itself."""

    @classmethod
    def _missing_(cls, value: object) -> "Optional[_Open]":
        if not isinstance(value, int):
            return None
        member = int.__new__(cls, value)
        member._name_, member._value_ = f"UNKNOWN_{value}", value
        return member


class Mode(_Open):
    """What the controller is doing."""

    OFF, TARE, APPROACH, FORCE, RELEASE, FAULT, PRESS, STROKES = range(8)


class Fault(_Open):
    """Why the motor was stopped."""

    NONE, LOST_FRAMES, ARRAY_BROKEN, ROW_STUCK, ARRAY_FROZEN, ENCODER_FROZEN, OVER_FORCE, BUS_SILENT = range(8)
    BROKEN_PARAMETERS, SUPPLY_LOW, SUPPLY_HIGH, BRIDGE, MISSED_DEADLINE, CRASH, RUNAWAY, REVERSED, UNSEEN = range(8, 17)
    NO_CLOCK, BROWN_OUT_LEVEL = 17, 18


class Limits(IntFlag):
    """What holds the loop back. Bits of a newer firmware are kept."""

    VOLTAGE = 1 << 0
    CURRENT = 1 << 1
    SPEED = 1 << 2
    GOAL = 1 << 3
    TRAVEL = 1 << 4
    TAXELS = 1 << 5
    NOT_TARED = 1 << 6
    FRAME_MISSED = 1 << 7
    SLEW = 1 << 8
    FIT_LEVEL = 1 << 9
    TARED_TOUCHING = 1 << 10
    FROM_BELOW = 1 << 11
    GUARD = 1 << 12
    WINDING = 1 << 13
    DIRECTION = 1 << 14
    TORQUE_HELD = 1 << 15


class Restarted(FingertipError):
    """The controller restarted in between: torque is off, it is not tared, and its time begins again."""


@dataclass(frozen=True)
class State:
    """The state of the loop, all of it from one frame."""

    time_s: float  # by the controller's clock, from the first state that this object read
    frame: int
    force_n: float
    goal_n: float
    centre_x_mm: float
    centre_y_mm: float
    indentation_mm: float
    travel_mm: float
    speed_mm_per_s: float
    duty: float  # share of the supply, -1 to 1
    mode: Mode
    fault: Fault
    limits: Limits
    pressures_kpa: Tuple[Tuple[float, ...], ...]  # row by row; empty if they were not read

    @classmethod
    def of(cls, data: bytes, columns: int, time_s: float) -> "State":
        """The state in these bytes, with the pressures if they are included."""

        def at(register: reg.Register) -> int:
            return number(register, data)

        pascals = numbers(_LAST, data[_LAST.address - FIRST.address :]) if len(data) == length(True) else []
        rows = [pascals[begin : begin + columns] for begin in range(0, len(pascals), columns)]
        return cls(
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
