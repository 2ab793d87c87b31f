"""The package as a whole: its types, and its wheel. Nothing is fetched: `cargo xtask test` has installed what it takes."""

import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path
from typing import Optional

from served import PYTHON, OnServed


class Package(OnServed):
    ARGUMENTS = ("wall",)

    def done(self, *command: "str | Path", cwd: Optional[Path] = None) -> str:
        """What a program says that runs without the package's source in its path."""
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
            source, python = folder / "source", folder / "venv" / "bin" / "python"
            # `setuptools` builds beside the source.
            shutil.copytree(PYTHON, source, ignore=shutil.ignore_patterns("__pycache__"))
            pip, offline = [sys.executable, "-m", "pip"], ["--quiet", "--no-index", "--no-deps"]
            self.done(*pip, "wheel", *offline, "--no-build-isolation", "--wheel-dir", folder, source)
            self.done(sys.executable, "-m", "venv", "--without-pip", folder / "venv")
            self.done(*pip, "--python", python, "install", *offline, "--no-compile", *folder.glob("*.whl"))
            [installed] = folder.glob("venv/lib/*/site-packages/fingertip")
            files = [sorted(path.name for path in place.iterdir()) for place in [source / "fingertip", installed]]
            self.assertEqual(files[0], files[1])
            shown = self.done(python, PYTHON / "examples" / "parameters.py", "--port", self.served.port)
            self.assertIn("modulus_pa", shown)
