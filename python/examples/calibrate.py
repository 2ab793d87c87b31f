"""Calibrates a finger's array on a hard flat plate, and its scale on a kitchen scale; see docs/commissioning.md.

    python calibrate.py --port /dev/ttyACM0 --modulus --presses 3 --holds 1.5 4 --save

Before each press, move finger or plate by 1 to 3 mm, or tilt it by a degree or two; nothing may touch the tip then. With
--holds put the plate on a kitchen scale, zero it, and type in what it shows in grams.
"""

import argparse
import time

from fingertip import ArrayCalibration, Fingertip

GRAVITY = 9.81e-3  # N for each gram


def wait(text: str, asks: bool) -> None:
    if asks:
        input(f"{text}, then press Enter ")


def main() -> None:
    arguments = argparse.ArgumentParser(description="Calibrate the array of a fingertip.")
    arguments.add_argument("--port", required=True)
    arguments.add_argument("--timeout-ms", type=float, default=1000.0, help="how much longer than usual to wait for answers")
    arguments.add_argument("--presses", type=int, default=3)
    arguments.add_argument("--modulus", action="store_true", help="measure and set Young's modulus first")
    arguments.add_argument("--holds", type=float, nargs="*", default=[], help="forces in N to hold on a kitchen scale")
    arguments.add_argument("--shown", type=float, nargs="*", default=[], help="what it shows in g, instead of asking")
    arguments.add_argument("--no-wait", action="store_true", help="ask for nothing between presses")
    arguments.add_argument("--save", action="store_true", help="keep it over a reset")
    given = arguments.parse_args()

    with Fingertip(given.port, timeout_ms=given.timeout_ms) as finger:
        array = ArrayCalibration(finger, patience_s=60.0 + 1e-3 * given.timeout_ms)
        if given.modulus:
            wait("modulus: free the tip over the plate", not given.no_wait)
            finger.tare()
            print(f"modulus {array.modulus():.1f} kPa")
        if given.presses:
            array.forget()
        for press in range(given.presses):
            wait(f"press {press + 1}: free the tip over the plate", not given.no_wait)
            finger.tare()
            reached = array.press()
            print(f"press {press + 1}: {reached} taxels reached")
        if given.presses:
            known = [gain for gain in array.proposal() if gain.sigma is not None]
            least, most = min(gain.gain for gain in known), max(gain.gain for gain in known)
            print(f"gains {least:.3f} to {most:.3f}, the worst known to {max(gain.sigma or 0 for gain in known):.3f}")
            array.accept()
        shown = list(given.shown)
        for newtons in given.holds:
            wait(f"{newtons} N: free the tip over the plate on the scale", not given.no_wait)
            finger.tare()
            finger.press(newtons)
            until = time.monotonic() + 10.0 + 1e-3 * given.timeout_ms
            while abs(finger.state().force_n - newtons) > 0.1 and time.monotonic() < until:
                time.sleep(0.05)
            list(finger.stream(10, 1.0, pressures=False))  # a second of the controller's time
            grams = shown.pop(0) if shown else float(input("the scale shows, in g: "))
            scale = array.shows(grams * GRAVITY)
            print(f"forces times {scale.factor:.4f} +- {scale.sigma:.4f} by {scale.numbers} numbers")
            finger.release()
        if given.holds:
            array.accept_scale()
        if given.save:
            finger.save()
        print("done: tare before the next press")


if __name__ == "__main__":
    main()
