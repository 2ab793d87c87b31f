"""What the controller says of itself."""

from dataclasses import dataclass
from enum import IntEnum
from typing import List

from .bus import FingertipError


class Mode(IntEnum):
    """What the controller is doing."""

    OFF, TARE, APPROACH, FORCE, RELEASE, FAULT, IDENTIFY, COMMISSION = range(8)


class Fault(IntEnum):
    """Why the motor was stopped."""

    NONE, LOST_FRAMES, ARRAY_BROKEN, ROW_STUCK, ARRAY_FROZEN, ENCODER_FROZEN, OVER_FORCE, BUS_SILENT = range(8)
    BROKEN_PARAMETERS, SUPPLY_LOW, SUPPLY_HIGH, BRIDGE, MISSED_DEADLINE, CRASH, RUNAWAY, REVERSED, UNSEEN = range(8, 17)
    NO_CLOCK, BROWN_OUT_LEVEL = 17, 18


class Restarted(FingertipError):
    """The controller started anew in between: torque is off, it is not tared, and its time begins again."""


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
    limits: int  # a bit each
    pressures_kpa: List[List[float]]  # row by row; none where they were not read
