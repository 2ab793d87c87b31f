"""The package as a whole: its types, and its wheel. Nothing is downloaded: `cargo xtask package` installs the tools."""

import os
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path
from typing import Optional

from served import PATIENT_MS, PYTHON, OnServed

PATIENT = ["--timeout-ms", str(int(PATIENT_MS))]  # on a busy machine an answer takes longer than by default


class Package(OnServed):
    ARGUMENTS = ("wall",)

    def done(self, *command: "str | Path", cwd: Optional[Path] = None) -> str:
        """Output of a program that runs without the package's source in its path."""
        environment = {**os.environ, "PYTHONPATH": sysconfig.get_path("purelib")}
        done = subprocess.run(command, cwd=cwd, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.assertEqual(done.returncode, 0, done.stdout)
        return done.stdout

    def test_types(self) -> None:
        mypy = [sys.executable, "-m", "mypy", "--strict", "--cache-dir", os.devnull]
        self.done(*mypy, "fingertip", "examples", "tests", cwd=PYTHON)

    def test_wheel(self) -> None:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            python = folder / "venv" / "bin" / "python"
            pip, offline = [sys.executable, "-m", "pip"], ["--quiet", "--no-index", "--no-deps"]
            # With the profile of the other tests, so that little is compiled.
            maturin = [sys.executable, "-m", "maturin", "build", "--quiet", "--profile", "dev", "--offline", "--locked"]
            self.done(*maturin, "--out", folder, cwd=PYTHON)
            self.done(sys.executable, "-m", "venv", "--without-pip", folder / "venv")
            self.done(*pip, "--python", python, "install", *offline, "--no-compile", *folder.glob("*.whl"))
            [installed] = folder.glob("venv/lib/*/site-packages/fingertip")
            files = [sorted(path.name for path in place.glob("*.*")) for place in [PYTHON / "fingertip", installed]]
            self.assertEqual(files[0], files[1])
            shown = self.done(python, PYTHON / "examples" / "parameters.py", "--port", self.served.port, *PATIENT)
            self.assertIn("modulus_pa", shown)
            # The program of the wheel, run by the package of the wheel.
            asks = f"from fingertip import run; print(run('info', *{PATIENT}, port={self.served.port!r})['model_number'])"
            self.assertEqual("21574", self.done(python, "-c", asks).strip())
            wrong = f"from fingertip import run; run('press', '99', *{PATIENT}, port={self.served.port!r})"
            told = subprocess.run([python, "-c", wrong], env={**os.environ, "PYTHONPATH": sysconfig.get_path("purelib")}, stderr=subprocess.PIPE, text=True)
            self.assertIn("FingertipError", told.stderr)
