"""Parts of a floating dock in a recording: they turn about their hinges."""

import numpy as np
import pytest

from vrx_mj.physics.motion import rotation_matrix
from vrx_mj.recording.motion_chunks import part_poses
from vrx_mj.recording.record_scene import RecordedPart

ANGLE = np.linspace(-1.2, 1.2, 7)
ANCHOR, AXIS = np.array([0.5, -1.0, 0.25]), np.array([0.6, 0.0, 0.8])
PART = RecordedPart("/block", (2.0, 0.5, 0.1), (1.0, 0.0, 0.0, 0.0), tuple(ANCHOR), tuple(AXIS), 7)


def test_a_part_turns_about_its_axis_counter_clockwise():
    _, turns = part_poses(PART, ANGLE)
    across = np.array([0.0, 1.0, 0.0])
    for angle, turn in zip(ANGLE, turns, strict=True):
        matrix = rotation_matrix(turn)
        assert matrix @ AXIS == pytest.approx(AXIS)
        assert matrix @ across == pytest.approx(np.cos(angle) * across + np.sin(angle) * np.cross(AXIS, across))


def test_the_hinge_stays_where_it_is():
    for position, turn in zip(*part_poses(PART, ANGLE), strict=True):
        assert position + rotation_matrix(turn) @ ANCHOR == pytest.approx(PART.position + ANCHOR)
