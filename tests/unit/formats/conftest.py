"""Files are read in this process where tests are about what they mean, not about the sandboxed process."""

import json
import os
from unittest.mock import patch

import pytest
import xacro

from vrx_mj.foreign import confinement
from vrx_mj.foreign.asking import READER
from vrx_mj.foreign.confinement import AccessLog

CONFINED = {
    "test_allowed.py", "test_hostile_folders.py", "test_mesh_bombs.py", "test_meshes.py", "test_outside.py",
    "test_read.py", "test_xacro_bombs.py", "test_xacro_escapes.py",
}  # fmt: skip
"""Files with tests of that process, of its limits, or of files that need them."""
WALLS = ("outside", "upwards", "absolute_path", "environment", "eval_", "many_threads")
"""Parts of the names of such tests in other files: the process is what refuses it, or what has one job at a time.

Slow tests have it, too: what never ends is ended there."""


class _NoLog(AccessLog):
    """The log of a reader whose answers are not kept: nobody looks at what it reads."""

    def is_unchanged(self):
        return False


def _answer(job, _):
    """The answer to a job; what it changes of `xacro` is put back."""
    with patch.dict(vars(xacro)):
        return confinement.answer(json.loads(json.dumps(job, default=os.fspath)), [])


@pytest.fixture
def in_this_process(monkeypatch):
    """Readers run in this process: each in a copy of another takes ten times as long."""
    for name, stand_in in (("lock_files", id), ("lock_calls", bool), ("confine", lambda *_: _NoLog())):
        monkeypatch.setattr(confinement, name, stand_in)
    monkeypatch.setattr(READER, "answer", _answer)


@pytest.fixture(autouse=True)
def _as_the_file_needs_it(request):
    walled = request.path.name in CONFINED or any(word in request.node.name for word in WALLS)
    if not walled and request.node.get_closest_marker("slow") is None:
        request.getfixturevalue("in_this_process")
