"""Touches in a recording: an arrow from begin to end, with names and force."""

import math

import numpy as np
import pytest

from vrx_mj.recording.task_chunks import touch_chunks
from vrx_mj.runtime.subscriptions import Touch

TOUCH = Touch("a", "quay", 4.0, 1000.0, duration=3.0, point=(6.0, 1.0, 0.25), vector=(-1000.0, 0.0, 0.0))


def values(chunks, path, component):
    """Times [s] and values of a component that changes."""
    for chunk in chunks:
        batch = chunk.to_record_batch()
        if chunk.entity_path == path and {component, "sim_time"} <= set(batch.schema.names):
            return batch.column("sim_time").to_numpy().astype(float) / 1e9, batch.column(component).to_pylist()
    return None


def test_a_touch_is_an_arrow_of_its_force_at_its_point_while_it_lasts():
    chunks = list(touch_chunks([TOUCH]))
    times, strips = values(chunks, "/world/touches/a/quay", "LineStrips3D:strips")
    assert times == pytest.approx([4.0, 7.0])
    vector = np.subtract(*strips[0][0][1::-1])
    assert vector / np.linalg.norm(vector) == pytest.approx([-1.0, 0.0, 0.0])
    assert strips[1] == []
    assert strips[0][0][0] == [6.0, 1.0, 0.25]
    assert values(chunks, "/world/forces/a/quay", "Points3D:labels")[1] == [["a touches quay, 1000 N"], []]
    assert values(chunks, "/timeline/a/quay", "StateChange:state")[1] == [["1000 N"], []]
    assert values(chunks, "/marks/contacts", "Scalars:scalars")[0] == pytest.approx([4.0])


def test_a_larger_force_has_a_longer_arrow_that_stays_in_the_picture():
    lengths = [
        math.dist(*values(touch_chunks([touch]), "/world/touches/a/b", "LineStrips3D:strips")[1][0][0][:2])
        for touch in (Touch("a", "b", 0.0, force, point=(0, 0, 0), vector=(force, 0, 0)) for force in (10.0, 1e3, 1e6))
    ]
    assert lengths == sorted(lengths)
    assert 0.0 < lengths[0] < 0.1
    assert 4.9 < lengths[-1] < 5.0
