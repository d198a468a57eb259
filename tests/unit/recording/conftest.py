import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

import recorded_run
from trees import partial
from vrx_mj.recording import read_record
from vrx_mj.recording.session import RecordWriter


def made_up(tmp_path):
    """A recording that is read, but never drawn."""
    recorded = read_record(tmp_path / "run.rrd")
    files = {**recorded.files, "scene.json": b'{"sea": {"level": 0.0}, "task": null}'}
    world = SimpleNamespace(parameters=partial({"sea": {"level": 0.0}, "task": None, "boats": []}))
    boat_set = SimpleNamespace(files=files, world=world, layout=recorded.layout)
    return dataclasses.replace(recorded, companies=(boat_set,))


@pytest.fixture(scope="module")
def two_seconds(tmp_path_factory):
    """A recording of 2 s, which tests leave as it is."""
    folder = tmp_path_factory.mktemp("two_seconds")
    with RecordWriter(folder / "run.rrd", recorded_run.scene()) as writer:
        writer.rows(np.array([recorded_run.row_at(t) for t in np.arange(0.0, 2.01, 0.05)]))
    return made_up(folder)
