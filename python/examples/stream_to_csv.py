"""Force over time into a CSV, with the controller's own times, and a plot of it.

    python stream_to_csv.py --port /tmp/finger --seconds 10 --rate-hz 200 --press 1.5 force.csv --plot force.svg

`--plot` needs matplotlib: pip install 'fingertip-controller[plot]'.
"""

import argparse
import csv

from fingertip import Fingertip

COLUMNS = ["time_s", "frame", "force_n", "goal_n", "indentation_mm", "travel_mm", "mode", "fault"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("file")
    parser.add_argument("--port", required=True)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--rate-hz", type=float, default=200.0)
    parser.add_argument("--press", type=float, metavar="NEWTONS", help="tare, then hold this force meanwhile")
    parser.add_argument("--plot", metavar="FILE")
    parser.add_argument("--timeout-ms", type=float, default=1000.0, help="how long to wait for an answer")
    arguments = parser.parse_args()

    rows = []
    with Fingertip(arguments.port, timeout_ms=arguments.timeout_ms) as finger:
        if arguments.press:
            finger.tare()
            finger.press(arguments.press)
        with open(arguments.file, "w", newline="") as file:
            table = csv.writer(file)
            table.writerow(COLUMNS)
            for state in finger.stream(arguments.rate_hz, arguments.seconds, pressures=False):
                row = [getattr(state, name) for name in COLUMNS]
                row[0] = f"{state.time_s:.6f}"
                table.writerow([int(cell) if isinstance(cell, int) else cell for cell in row])
                rows.append((state.time_s, state.force_n, state.goal_n))
    span_s = rows[-1][0] - rows[0][0]
    print(f"{len(rows)} states over {span_s:.3f} s of the controller's time in {arguments.file}")

    if arguments.plot:
        import matplotlib  # type: ignore[import-not-found, unused-ignore]

        matplotlib.use("Agg")
        from matplotlib import pyplot  # type: ignore[import-not-found, unused-ignore]

        times, forces, goals = zip(*rows)
        pyplot.plot(times, goals, "--", color="grey", label="goal")
        pyplot.plot(times, forces, label="force")
        pyplot.xlabel("time, s")
        pyplot.ylabel("force, N")
        pyplot.legend()
        pyplot.savefig(arguments.plot)


if __name__ == "__main__":
    main()
