"""Parameters: shown, changed (all or none), and restored.

    python parameters.py --port /tmp/finger
    python parameters.py --port /tmp/finger --set modulus_pa=300000 --save
"""

import argparse

from fingertip import Fingertip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--port", required=True)
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE")
    parser.add_argument("--save", action="store_true", help="keep them over a reset")
    parser.add_argument("--timeout-ms", type=float, default=1000.0, help="how long to wait for an answer")
    arguments = parser.parse_args()
    values = {name: int(value) for name, _, value in (text.partition("=") for text in arguments.set)}
    with Fingertip(arguments.port, timeout_ms=arguments.timeout_ms) as finger:
        before = finger.parameters()
        if values:
            finger.set_parameters(values, save=arguments.save)
        for name, value in finger.parameters().items():
            changed = f"  (was {before[name]})" if value != before[name] else ""
            print(f"{name:28} {value:>9}{changed}")


if __name__ == "__main__":
    main()
