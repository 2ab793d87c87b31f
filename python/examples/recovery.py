"""Holds a force, and recovers from a fault: reports it, clears it, tares if necessary, and continues.

    python recovery.py --port /tmp/finger --newtons 1.0 --seconds 30

Where a simulated finger is served, `fault supply-low` and then `mend` on its standard input are something to recover
from.
"""

import argparse
import time

from fingertip import Fingertip, FingertipError


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--port", required=True)
    parser.add_argument("--newtons", type=float, default=1.0)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--timeout-ms", type=float, default=1000.0, help="how long to wait for an answer")
    arguments = parser.parse_args()
    with Fingertip(arguments.port, timeout_ms=arguments.timeout_ms) as finger:
        until = time.monotonic() + arguments.seconds
        recovered = 0
        if finger.state().fault:
            finger.recover()
        finger.tare()
        finger.press(arguments.newtons)
        while time.monotonic() < until:
            state = finger.state()
            if state.fault:
                print(f"stopped by {state.fault.name}")
                try:
                    finger.recover()
                    # The tare outlives a fault: a new goal is all that is needed.
                    finger.press(arguments.newtons)
                    recovered += 1
                except FingertipError as why:
                    # The cause may still be there: try again later.
                    print(why)
                    time.sleep(0.5)
            time.sleep(0.05)
    print(f"recovered {recovered} times")


if __name__ == "__main__":
    main()
