"""roslibjs, installed once for this user by npm."""

import fcntl
import os
import subprocess
from pathlib import Path

import pytest

from needs import NODE, require

FOLDER = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "vrx_mj_roslibjs"
CLASSIC = FOLDER / "node_modules/roslib-classic/build/roslib.min.js"
"""For pages, in one file, which defines ROSLIB."""
NPM = [
    "npm", "install", "--no-audit", "--no-fund", "--ignore-scripts", "--prefix", str(FOLDER), "roslib@2.1.0",
    "roslib-classic@npm:roslib@1.4.1", "ws@8",
]  # fmt: skip


def installed() -> Path:
    """The folder; the running test is skipped where it cannot be had."""
    require(NODE)
    FOLDER.mkdir(parents=True, exist_ok=True)
    with (FOLDER / "lock").open("w", encoding="utf-8") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not CLASSIC.is_file():
            done = subprocess.run(NPM, capture_output=True, encoding="utf-8", timeout=120.0, check=False)
            if done.returncode != 0:
                pytest.skip(f"{' '.join(NPM)}: {done.stderr[-300:]}")
    return FOLDER
