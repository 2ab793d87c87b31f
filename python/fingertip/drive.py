"""The drive asked what it is like, by motions in the air."""

import time
from dataclasses import dataclass
from typing import Dict

from . import registers as reg
from .device import Device
from .line import FingertipError
from .state import Restarted

_COMMISSION_S = 60.0
JOG, MEASURE = 1, 2
RUNNING = 1
_NO_TASK, _REFUSED = 0, 4
_DONE = {JOG: 2, MEASURE: 3}
_REASONS = {
    1: "a stop, torque, a fault, a tare or new parameters ended it",
    2: "tare first, with torque off; nothing may touch the tip",
    3: "jog first, and confirm the direction",
    4: "the encoder did not count at 5 % of duty: is the motor connected, and free to move?",
    5: "the encoder counts against the motor: swap the motor's leads or the encoder's channels",
    6: "the encoder does not follow the motor: is one of its channels open?",
    7: "the tip touched something: leave it 2 mm of air",
    8: "the motor felt a force that the array did not: leave the finger 2 mm to both sides",
    9: "the guard or a limit held the voltage back: are slew, current and speed limits wide enough?",
    10: "the tip did not come to rest: does something move it?",
    11: "the strokes do not agree: does friction or a spring change along the way?",
    12: "a result is outside of its parameter's range: check gear, encoder and resistance",
}


@dataclass(frozen=True)
class Drive:
    """A drive as measured; `sigma` has the standard uncertainties, as shares, by the names of the other fields."""

    torque_constant_unm_per_a: int
    time_constant_us: int
    inertia_ug_m2: int  # where the parameter resistance_mohm is true, as the friction
    friction_forward_unm: int
    friction_back_unm: int
    sigma: Dict[str, float]


def carry_out(finger: Device, task: int) -> None:
    """Jogs or measures, and waits for the end. Torque off ends it before."""
    finger.write(reg.COMMISSION, task)
    begun, frame_s = finger.read(reg.FRAME_COUNTER), 1e-9 * finger.read(reg.FRAME_PERIOD_NS)
    state, frames = RUNNING, 0
    # By the controller's own time: a simulated one may be slower than a real one.
    while state == RUNNING and frames * frame_s < _COMMISSION_S:
        time.sleep(0.02)
        state = finger.read(reg.COMMISSION_STATE)
        frames = (finger.read(reg.FRAME_COUNTER) - begun) % 2**32
        if frames >= 2**31:
            # Frames count back.
            state = _NO_TASK
    if state == RUNNING:
        raise FingertipError("it did not end in a minute: stopped")
    if state == _REFUSED:
        refusal = finger.read(reg.COMMISSION_REFUSAL)
        raise FingertipError(f"refused: {_REASONS.get(refusal, refusal)}")
    if state != _DONE[task]:
        # A controller that started anew knows of no task.
        raise Restarted("it came to no end: the controller started anew, or its parameters were set")


def measured(finger: Device) -> Drive:
    """What the last measurement found."""
    rows = {
        "torque_constant_unm_per_a": (reg.MEASURED_TORQUE_CONSTANT, reg.TORQUE_CONSTANT_SIGMA),
        "time_constant_us": (reg.MEASURED_TIME_CONSTANT, reg.TIME_CONSTANT_SIGMA),
        "inertia_ug_m2": (reg.MEASURED_INERTIA, reg.INERTIA_SIGMA),
        "friction_forward_unm": (reg.MEASURED_FRICTION_FORWARD, reg.FRICTION_FORWARD_SIGMA),
        "friction_back_unm": (reg.MEASURED_FRICTION_BACK, reg.FRICTION_BACK_SIGMA),
    }
    values = {name: finger.read(value) for name, (value, _) in rows.items()}
    return Drive(sigma={name: finger.read(sigma) * 1e-3 for name, (_, sigma) in rows.items()}, **values)
