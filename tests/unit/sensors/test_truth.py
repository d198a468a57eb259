"""The truth, and the noise that one may add to it."""

import numpy as np
import pytest

from vrx_mj.config.sensors import P3dConfig
from vrx_mj.sensors.errors import Draw
from vrx_mj.sensors.places import Place
from vrx_mj.sensors.registry import truth

PLACE = Place(
    np.array([1.0, 2.0, 3.0]), np.eye(3), np.array([1.0, 0, 0, 0]), np.array([4.0, 5.0, 6.0]), np.array([0.1, 0.2, 0.3])
)


def test_without_noise_it_is_the_truth_in_world_axes():
    found = truth(P3dConfig(name="p3d", link="base_link"), PLACE, Draw(1, "a", "p3d", 0, 10.0))
    assert found.position.tolist() == [1.0, 2.0, 3.0]
    assert found.velocity.tolist() == [4.0, 5.0, 6.0]
    assert found.angular_velocity.tolist() == [0.1, 0.2, 0.3]


def test_noise_is_on_the_twist_alone():
    config = P3dConfig(name="p3d", link="base_link", noise=0.5)
    found = [truth(config, PLACE, Draw(1, "a", "p3d", k, 10.0)) for k in range(3000)]
    assert {tuple(one.position) for one in found} == {(1.0, 2.0, 3.0)}
    assert {tuple(one.orientation) for one in found} == {(1.0, 0.0, 0.0, 0.0)}
    twists = np.array([(*one.velocity, *one.angular_velocity) for one in found])
    assert twists.std(axis=0) == pytest.approx([0.5] * 6, rel=0.07)
    assert np.corrcoef(twists.T) == pytest.approx(np.eye(6), abs=0.09)
