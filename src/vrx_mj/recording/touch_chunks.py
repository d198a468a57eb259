"""Touches of boats in a recording: an arrow of the force at its point, and marks in the plots."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import rerun as rr
from rerun.chunk import Chunk

from vrx_mj.draw.colors import shade
from vrx_mj.recording.task_chunks import STEPS, mark_chunks
from vrx_mj.recording.timeline import NAMED, changes, static
from vrx_mj.runtime.subscriptions import Touch

TOUCH_WORDS = "/world/forces"
"""Entities of names and forces."""
COLOR = shade((1.0, 0.0, 0.45))
LONGEST, TYPICAL = 5.0, 1000.0
"""Length of an arrow [m] that no force reaches, and the force [N] whose arrow has half of it."""
SHORTEST = 1.0
"""Simulated time for which an arrow is seen, at least [s]."""


def touch_chunks(touches: Sequence[Touch]) -> Iterator[Chunk]:
    """Touches, each seen from its begin to its end: where the largest force acts, with names and force."""
    yield from mark_chunks([(touch.time, "contacts") for touch in touches])
    for touch in touches:
        if touch.point is None or touch.vector is None:
            continue
        path = f"/world/touches/{touch.boat}/{touch.other}"
        time = [touch.time, touch.time + max(touch.duration, SHORTEST)]
        vector = np.array(touch.vector) * LONGEST / (touch.force + TYPICAL)
        yield static(path, rr.Arrows3D.from_fields(colors=[COLOR], radii=[0.16]))
        yield changes(path, time, rr.Arrows3D, vectors=[[vector], []], origins=[[touch.point], []])
        said = f"{TOUCH_WORDS}/{touch.boat}/{touch.other}"
        yield static(said, rr.Points3D.from_fields(**NAMED))
        label = f"{touch.boat} touches {touch.other}, {touch.force:.0f} N"
        yield changes(said, time, rr.Points3D, positions=[[touch.point + vector], []], labels=[[label], []])
        steps = f"{STEPS}/{touch.boat}/{touch.other}"
        yield changes(steps, time, rr.StateChange, state=[[f"{touch.force:.0f} N"], []])
