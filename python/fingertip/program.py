"""The program `fingertip`, which the wheel contains: it leads through commissioning and calibration, and solves.

    from fingertip import run

    found = run("commission", "--forward", "yes", "--apply", port="/dev/ttyACM0")
    print(found["after"], found["sigma"])

It opens the port by itself: close a `Bus` or `Fingertip` on the same port before, or have `fingertip share` own it.
"""

import json
import os
import shutil
import subprocess
import sysconfig
from pathlib import Path
from typing import Any, Dict, Optional

from .bus import catch_signals, children
from .line import FingertipError

_NAME = "fingertip.exe" if os.name == "nt" else "fingertip"


def program() -> Path:
    """Path of the program: next to this Python, as the wheel installs it, or from the search path."""
    installed = Path(sysconfig.get_path("scripts")) / _NAME
    found = installed if installed.is_file() else shutil.which(_NAME)
    if not found:
        raise FingertipError("the program `fingertip` is not installed: `pip install` the wheel, or `cargo install --path tool`")
    return Path(found)


def run(*arguments: str, port: str, device_id: int = 1, within_s: Optional[float] = None) -> Dict[str, Any]:
    """Runs a command of the program to its end and returns its JSON; `docs/host.md` lists the commands.

    Raises `FingertipError` with the program's own words where it fails, and after `within_s`, with the finger stopped.
    The end of this program ends the one that it started. For SIGTERM and SIGHUP, this needs a call in the main thread, or
    a write to a finger there before: Python sets handlers in the main thread only.
    """
    catch_signals()
    command = [str(program()), "--json", "--port", port, "--id", str(device_id), *arguments]
    child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    children.add(child)
    try:
        said, complained = child.communicate(timeout=within_s)
    except BaseException as why:
        # The program stops the finger when it is asked to end.
        child.terminate()
        child.communicate()
        if isinstance(why, subprocess.TimeoutExpired):
            raise FingertipError(f"`fingertip {' '.join(arguments)}` did not end within {within_s} s: stopped") from why
        raise
    finally:
        children.discard(child)
    if child.returncode:
        raise FingertipError(_error(complained))
    try:
        found: Dict[str, Any] = json.loads(said or "{}")
    except ValueError:
        # A procedure ends with one object in one line, whatever was said before.
        found = json.loads(said.strip().splitlines()[-1])
    return found


def _error(complained: str) -> str:
    """The error that the program reported in the last line of standard error."""
    last = (complained.strip().splitlines() or ["it said nothing"])[-1]
    try:
        return str(json.loads(last)["error"])
    except (ValueError, KeyError, TypeError):
        return last
