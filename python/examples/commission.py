"""Commissions a drive: jogs, asks which way the tip went, measures, and keeps what was measured.

    python commission.py --port /dev/ttyACM0
"""

import argparse
import sys

from fingertip import Fingertip, FingertipError


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--port", required=True, help="serial port, or that of a served finger")
    parser.add_argument("--timeout-ms", type=float, default=1000.0, help="how long to wait for an answer")
    parser.add_argument("--yes", action="store_true", help="do not ask: the tip goes towards the object first")
    parser.add_argument("--save", action="store_true", help="keep the parameters over a reset")
    options = parser.parse_args()
    with Fingertip(options.port, timeout_ms=options.timeout_ms) as finger:
        finger.tare()
        finger.jog()
        if not options.yes and input("Did the tip first go towards the object? [y/N] ").lower() != "y":
            print("swap the motor's leads and the encoder's channels, both, and begin anew")
            return 1
        finger.confirm_direction()
        drive = finger.measure_drive()
        for name, sigma in drive.sigma.items():
            print(f"{name} {getattr(drive, name)} +- {100 * sigma:.1f} %")
        finger.accept_drive(options.save)
        print("accepted")
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except FingertipError as why:
        sys.exit(f"commission.py: {why}")
