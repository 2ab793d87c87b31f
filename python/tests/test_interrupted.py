"""Ends every moving method and every moving example at instants drawn by a fixed seed, and looks at the true force.

One end of each program; `INSTANTS=10` tries ten instants of every end.
"""

import os
import random
import signal
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Dict, List

from served import PYTHON, Cable, OnServed

CHILD = """
import sys
from fingertip import Bus, registers
bus = Bus(sys.argv[1], timeout_ms=60_000)
finger = bus.finger(1)
finger.tare()
while True:
    {}
"""
METHODS = {
    "enable_torque": "finger.enable_torque(); finger.write(registers.GOAL_FORCE_MN, 800); finger.state()",
    "press": "finger.press(0.8); finger.state()",
    "press of a group": "bus.press(0.8); bus.states()",
    "release": "finger.press(0.8); list(finger.stream(100, 0.3)); finger.release()",
    "stop": "finger.press(0.8); list(finger.stream(100, 0.3)); bus.stop()",
    "a press that measures": "finger.enable_torque(); finger.write(registers.MEASURE, 3); list(finger.stream(100, 9.0)); finger.release(); finger.tare()",
}
EXAMPLES = {
    "force.py": ["--patience-ms", "60000", "--readings", "1000000"],
    "stream_to_csv.py": ["--timeout-ms", "60000", "--seconds", "1000", "--press", "1.0", str(Path(tempfile.gettempdir()) / "interrupted.csv")],
    "recovery.py": ["--timeout-ms", "60000", "--seconds", "1000"],
}
PROGRAMS: Dict[str, List[str]] = {
    **{name: ["-c", CHILD.format(call), "PORT"] for name, call in METHODS.items()},
    **{name: [str(PYTHON / "examples" / name), "--port", "PORT", *rest] for name, rest in EXAMPLES.items()},
}
# Signals, and a cable that is pulled out.
ENDS = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGKILL, None]
INSTANTS = int(os.environ.get("INSTANTS", "0"))
LATEST_S = 1.5  # between the first motion and the end


class Interrupted(OnServed):
    ARGUMENTS = (*OnServed.ARGUMENTS, "--tcp", "0")

    def begin(self, name: str, port: str, draw: random.Random) -> "subprocess.Popen[str]":
        """Starts a program, and returns at a random time after its first motion began."""
        child = self.python(*(port if argument == "PORT" else argument for argument in PROGRAMS[name]))
        while child.poll() is None and self.served.truths()[1].mode in ["Off", "Tare"]:
            time.sleep(0.005)
        time.sleep(draw.uniform(0.0, LATEST_S))
        return child

    def test_ends_leave_no_force(self) -> None:
        for number, name in enumerate(PROGRAMS):
            ends = ENDS * INSTANTS or [ENDS[number % len(ENDS)]]
            draw, most_n, running = random.Random(name), 0.0, 0
            for end in ends:
                with self.subTest(name, end=end):
                    self.served.stop()
                    self.served = self.serve(*self.ARGUMENTS)
                    cable = Cable(self.served.port)
                    child = self.begin(name, cable.port, draw)
                    running += child.poll() is None
                    if end:
                        child.send_signal(end)
                        _, told = child.communicate()
                        cable.unplug()
                    else:
                        cable.unplug()
                        _, told = child.communicate()
                    if end in [None, signal.SIGKILL]:
                        # Packets for another finger are no sign of life for this one.
                        self.pass_s(1.0)
                    most_n = max(most_n, self.served.truths()[1].force_n)
                    self.assert_released(f"{name} {end!r} {told}")
            self.assertGreater(running, 0, f"{name} never ran")
            print(f"{name}: {len(ends)} ends, {running} while it ran; at most {most_n} N left", flush=True)

    def test_every_example_tells_its_options(self) -> None:
        for path in sorted((PYTHON / "examples").glob("*.py")):
            with self.subTest(path.name):
                child = self.python(str(path), "--help")
                told, _ = child.communicate()
                self.assertEqual(child.returncode, 0)
                self.assertIn("--port", told)
