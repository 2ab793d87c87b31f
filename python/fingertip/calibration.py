"""Calibrates the array: the taxels' gains by presses onto a hard flat plate, the absolute scale by a kitchen scale.

docs/commissioning.md says how it is done. Nothing counts before it is accepted, nor outlives a reset before it is saved.
"""

import time
from dataclasses import dataclass
from typing import Callable, List, Optional

from . import registers as reg
from .line import FingertipError
from .finger import Finger

ONE = 16384  # a gain of 1 on the bus
_RUNNING, _DONE = 1, 2
_PRESS, _FORGET, _ACCEPT = 1, 2, 3
_UNKNOWN, _WAITS = 255, 255
_NOT_PRESSED = {
    1: "what is pressed yields: take something hard, as a glass or steel plate",
    2: "the plate moved: hold finger and plate fast",
    3: "the contact is too near to the array's edge: press nearer the middle",
    4: "what is pressed is not flat, or moves: take a clean plate larger than the tip, hold it fast",
    5: "too few taxels were pressed: press deeper, force_max_mn allowing",
    6: "the contact was lost: hold finger and plate fast",
    7: "the travel ended without a contact: bring the plate nearer",
    8: "the tip did not move on for a second: is the current too small?",
    9: "torque went off, a fault stopped the motor, or parameters or gains changed",
    10: "torque is off or the array is not tared",
    11: "all taxels read less than half or more than twice of what the modulus says: identify it first",
}
_NOT_SHOWN = {
    1: "no force is held, or not yet for 0.3 s: hold one first",
    2: "the array does not see all of the contact: press nearer the middle",
    3: "less than 100 mN is shown: hold a larger force",
    4: "it is less than half or more than twice of what the array reads: is the scale zeroed?",
    5: "it contradicts the numbers before by more than 2 % and 20 mN: read again, or forget all",
    6: "there are eight numbers already: accept or forget them",
}


@dataclass(frozen=True)
class Gain:
    """A taxel's gain."""

    gain: float
    sigma: Optional[float]  # standard uncertainty; None where no press reached the taxel


@dataclass(frozen=True)
class Scale:
    """What forces are to be multiplied by."""

    factor: float
    sigma: float
    numbers: int


class ArrayCalibration:
    """The procedures that calibrate a finger's array."""

    def __init__(self, finger: Finger, patience_s: float = 60.0):
        self.finger, self.patience_s = finger, patience_s

    def modulus(self) -> float:
        """Measures Young's modulus by a press onto a hard flat plate and sets it; kPa."""
        finger = self.finger
        finger.enable_torque()
        try:
            finger.write(reg.IDENTIFY, 1)
            until = time.monotonic() + self.patience_s
            while (state := finger.read(reg.IDENTIFY_STATE)) == _RUNNING and time.monotonic() < until:
                time.sleep(0.02)
        finally:
            finger.release()
        if state != _DONE:
            refusal = finger.read(reg.IDENTIFY_REFUSAL)
            raise FingertipError(f"the modulus was not measured: reason {refusal}, see docs/identify.md")
        modulus_pa = finger.read(reg.IDENTIFIED_MODULUS_PA)
        finger.set_parameters({"modulus_pa": modulus_pa})
        return 1e-3 * modulus_pa

    def press(self, progress: Optional[Callable[[int], None]] = None) -> int:
        """Presses once onto a hard flat plate and lets go; how many taxels have a proposal by now."""
        finger = self.finger
        finger.enable_torque()
        try:
            finger.write(reg.CALIBRATE, _PRESS)
            until = time.monotonic() + self.patience_s
            while finger.read(reg.CALIBRATE_STATE) == _RUNNING and time.monotonic() < until:
                if progress:
                    progress(finger.read(reg.CALIBRATE_PROGRESS))
                time.sleep(0.02)
            state = finger.read(reg.CALIBRATE_STATE)
        finally:
            finger.release()
        if state != _DONE:
            refusal = finger.read(reg.CALIBRATE_REFUSAL)
            raise FingertipError(f"the press was not taken: {_NOT_PRESSED.get(refusal, f'reason {refusal}')}")
        return finger.read(reg.CALIBRATE_TAXELS)

    def proposal(self) -> List[Gain]:
        """The gains that all presses propose, row by row."""
        gains, sigmas = self.finger.read_all(reg.PROPOSED_GAINS), self.finger.read_all(reg.PROPOSED_SIGMAS)
        return [
            Gain(gain / ONE, None if sigma == _UNKNOWN else 1e-3 * sigma * gain / ONE)
            for gain, sigma in zip(gains, sigmas)
        ]

    def accept(self) -> None:
        """Makes the proposed gains those in force; a tare is needed then."""
        self.finger.write(reg.CALIBRATE, _ACCEPT)

    def forget(self) -> None:
        """Forgets all presses and all numbers of a scale."""
        self.finger.write(reg.CALIBRATE, _FORGET)

    def gains(self) -> List[float]:
        """The gains in force, row by row."""
        return [gain / ONE for gain in self.finger.read_all(reg.GAINS)]

    def set_gains(self, gains: List[float]) -> None:
        """Sets all gains, with torque off; a tare is needed then."""
        numbers = [round(gain * ONE) for gain in gains]
        if len(numbers) != reg.GAINS.numbers:
            raise ValueError(f"{len(numbers)} gains: there are {reg.GAINS.numbers} taxels")
        for place, number in enumerate(numbers):
            if not reg.GAINS.least <= number <= reg.GAINS.largest:
                raise ValueError(f"gain {gains[place]} of taxel {place}: 0.5 to just below 2 are allowed")
        data = b"".join(number.to_bytes(2, "little") for number in numbers)
        self.finger.write_bytes(reg.GAINS.address, data, "set the gains")

    def shows(self, newtons: float) -> Scale:
        """Takes what a scale under the plate shows while a force is held; the factor by all numbers so far."""
        finger = self.finger
        finger.write(reg.SCALE_SHOWS_MN, round(1000 * newtons))
        until = time.monotonic() + self.patience_s
        while (numbers := finger.read(reg.SCALE_POINTS)) == _WAITS and time.monotonic() < until:
            time.sleep(0.002)
        refusal = finger.read(reg.SCALE_REFUSAL)
        if refusal:
            raise FingertipError(f"{newtons} N was not taken: {_NOT_SHOWN.get(refusal, f'reason {refusal}')}")
        return Scale(1e-6 * finger.read(reg.SCALE_FACTOR_PPM), 1e-6 * finger.read(reg.SCALE_SIGMA_PPM), numbers)

    def accept_scale(self) -> None:
        """Makes forces what the scale showed: changes codes_per_kpa_milli and modulus_pa, with torque off."""
        self.finger.write(reg.SCALE, _ACCEPT)
