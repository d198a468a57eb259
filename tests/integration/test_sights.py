"""Cameras and lidars through `sim.sense`: they see the moment that their clock caught."""

import numpy as np
import pytest

from integration.sailing import CALM, boats
from integration.sensing import P3D, sailing
from vrx_mj.config.sensors import CameraConfig, LidarConfig
from vrx_mj.errors import UnknownNameError

LIDAR = LidarConfig(name="lidar", link="lidar_link", pose=(0.7, 0.0, 1.8, 0.0, 0.0, 0.0), noise=0.0)
CAMERA = CameraConfig(name="camera", link="camera_link", pose=(0.75, 0, 1.5, 0, 0, 0), width=64, height=36)
TOTEM = {"name": "totem", "model": "red_totem", "pose": [20.0, 0.0, 0.0, 0.0, 0.0, 0.0]}
HERE = boats((0.0, 0.0, 0.0))


def nearest_ahead(cloud):
    """The least distance [m] along x of the returns of what stands ahead."""
    ahead = cloud.points[(cloud.points[:, 0] > 3.0) & (np.abs(cloud.points[:, 1]) < 1.0)]
    return float(ahead[:, 0].min())


def test_a_lidar_sees_the_moment_that_was_caught_and_not_the_present():
    sim = sailing((LIDAR, P3D), sea=CALM, wind=None, fleet=HERE, objects=[TOTEM])
    first = nearest_ahead(sim.sense("a")["lidar"].data)
    assert first == pytest.approx(20.0 - 0.7, abs=0.6)
    sim.set_boat("a", pose=(5.0, 0.0, -0.1, 0.0, 0.0, 0.0))
    assert nearest_ahead(sim.sense("a")["lidar"].data) == pytest.approx(first - 5.0, abs=0.3)
    sim.advance(5)
    sim.set_boat("a", pose=(9.0, 0.0, -0.1, 0.0, 0.0, 0.0))
    assert nearest_ahead(sim.sense("a")["lidar"].data) == pytest.approx(first - 5.0, abs=0.3)
    sim.advance(5)
    reading = sim.sense("a")["lidar"]
    assert (reading.sequence, reading.time) == (1, sim.time)
    assert nearest_ahead(reading.data) == pytest.approx(first - 9.0, abs=0.3)


def test_scans_are_the_same_bits_in_another_run_and_differ_from_each_other():
    noisy = LIDAR.model_copy(update={"noise": 0.01})
    scans = []
    for _ in range(2):
        sim = sailing((noisy,), fleet=HERE, objects=[TOTEM], seed=3)
        sim.sense("a")["lidar"]
        sim.advance(50)
        scans.append(sim.sense("a")["lidar"].data.points)
    assert scans[0].tobytes() == scans[1].tobytes()
    sim.advance(10)
    assert sim.sense("a")["lidar"].data.points.tobytes() != scans[0].tobytes()


@pytest.mark.render
def test_a_camera_takes_pictures_at_its_rate_and_keeps_them_between():
    sim = sailing((CAMERA,), fleet=HERE, objects=[TOTEM], seed=3)
    first = sim.sense("a")["camera"]
    assert first.data.rgb.shape == (36, 64, 3)
    sim.advance(3)
    assert sim.sense("a")["camera"] is first
    sim.advance(1)
    second = sim.sense("a")["camera"]
    assert (second.sequence, second.time) == (1, pytest.approx(0.04))
    assert second.data.rgb.tobytes() != first.data.rgb.tobytes()


@pytest.mark.slow
@pytest.mark.render
def test_labels_come_with_pictures_and_change_neither_them_nor_the_motion():
    def run(camera, read):
        sim = sailing((camera,), fleet=HERE, objects=[TOTEM], seed=3)
        for _ in range(3):
            sim.advance(20)
            reading = read(sim)
        return reading, sim.get_state().sha256

    camera = CAMERA.model_copy(update={"width": 640, "height": 360})
    plain = run(camera, lambda sim: sim.sense("a")["camera"])
    asked = run(camera, lambda sim: sim.labelled("a", "camera"))
    always = run(camera.model_copy(update={"labels": True}), lambda sim: sim.sense("a")["camera"])
    assert plain[0].data.labels is None
    assert plain[1] == asked[1]
    for reading, _ in (asked, always):
        assert reading.data.rgb.tobytes() == plain[0].data.rgb.tobytes()
        assert (reading.time, reading.sequence) == (plain[0].time, plain[0].sequence)
        assert [one.category for one in reading.data.labels.objects if one.name == "totem"] == ["red_totem"]


def test_a_boat_has_labels_of_cameras_alone():
    sim = sailing((CAMERA, P3D), fleet=HERE, seed=3)
    with pytest.raises(UnknownNameError, match="camera of a"):
        sim.labelled("a", "p3d")
