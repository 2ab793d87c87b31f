"""The pressures live in the terminal, in 256 colours. Ctrl-C ends.

    python heat_map.py --port /tmp/finger
"""

import argparse

from fingertip import Fingertip, State

HEAT = [234, 17, 18, 54, 90, 126, 161, 196, 208, 226]
HOTTEST_KPA = 20.0


def picture(state: State) -> str:
    top_kpa = max([HOTTEST_KPA] + [max(row) for row in state.pressures_kpa])
    lines = []
    # The last row on top, as in recordings.
    for row in reversed(state.pressures_kpa):
        heat = [HEAT[int(max(0.0, kpa) / top_kpa * (len(HEAT) - 1))] for kpa in row]
        lines.append("".join(f"\x1b[48;5;{colour}m{kpa:4.0f}" for colour, kpa in zip(heat, row)) + "\x1b[0m")
    fault = f"  fault {state.fault.name}" if state.fault else ""
    lines.append(f"{state.force_n:7.3f} N of {state.goal_n:.3f} N  {state.mode.name}{fault}\x1b[K")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--port", required=True)
    parser.add_argument("--seconds", type=float)
    parser.add_argument("--timeout-ms", type=float, default=1000.0, help="how long to wait for an answer")
    arguments = parser.parse_args()
    with Fingertip(arguments.port, timeout_ms=arguments.timeout_ms) as finger:
        print("\x1b[2J", end="")
        try:
            for state in finger.stream(20.0, arguments.seconds):
                print("\x1b[H" + picture(state), flush=True)
        except KeyboardInterrupt:
            pass


if __name__ == "__main__":
    main()
