"""What figures were made with: the date, versions, and the machine, as one line."""

import datetime as dt
import importlib.metadata
import os
import platform
import re
import subprocess
from pathlib import Path

PACKAGES = ("mujoco", "numba", "numpy", "rerun-sdk", "trimesh", "pydantic")
REPO = Path(__file__).resolve().parents[2]


def made_with() -> str:
    """Date, revision, versions and machine."""
    versions = ", ".join(f"{name} {importlib.metadata.version(name)}" for name in PACKAGES)
    day = dt.datetime.now(dt.UTC).date().isoformat()
    machine = f"{os.cpu_count()} cores of {processor()}, {platform.system()}"
    return f"{day}, revision {revision()}; Python {platform.python_version()}, {versions}; {machine}"


def revision() -> str:
    """The commit of the checkout, `+` if something was changed."""
    try:
        return _git("rev-parse", "--short", "HEAD") + ("+" if _git("status", "--porcelain", "src") else "")
    except (OSError, subprocess.CalledProcessError):
        return "unknown"


def _git(*arguments: str) -> str:
    command = ["git", *arguments]
    return subprocess.run(command, cwd=REPO, capture_output=True, encoding="utf-8", check=True).stdout.strip()


def processor() -> str:
    """Name of the processor."""
    try:
        found = re.search(r"^model name\s*:\s*(.+)$", Path("/proc/cpuinfo").read_text(encoding="utf-8"), re.M)
    except OSError:
        found = None
    return found[1].strip() if found else platform.machine()
