"""A fingertip force controller on its bus, by ROBOTIS' package `dynamixel-sdk`.

    from fingertip import Fingertip

    with Fingertip("/dev/ttyACM0") as finger:
        finger.tare()                    # nothing may touch the tip
        finger.press(1.5)                # returns at once; approaches, touches, holds 1.5 N
        for state in finger.stream(rate_hz=10, seconds=1.0):
            print(state.time_s, state.force_n)
        finger.release()                 # releases the object, torque off

The end of the `with`, an exception and the end of the program let go too. Times are the controller's own; registers and their units are in `fingertip.registers`.
"""

from . import registers
from .bus import Bus, Fingertip
from .finger import Finger
from .line import FingertipError, NoAnswer, PortLost, Refused
from .program import program, run
from .state import Fault, Limits, Mode, Restarted, State

__all__ = [
    "Bus",
    "Fault",
    "Finger",
    "Fingertip",
    "FingertipError",
    "Limits",
    "Mode",
    "NoAnswer",
    "PortLost",
    "Refused",
    "Restarted",
    "State",
    "program",
    "registers",
    "run",
]
