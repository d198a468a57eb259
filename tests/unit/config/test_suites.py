"""Suites of sensors beyond VRX's: errors of real parts, and cameras whose pixels count from 0."""

import math

import numpy as np
import pytest

from vrx_mj.config.fleet import Order
from vrx_mj.errors import VrxError
from vrx_mj.formats.parts.read import example_file
from vrx_mj.mjcf.build import build_boat
from vrx_mj.sensors.instruments import variances


def named(boat):
    return [one.name for one in boat.sensors]


def sensor(boat, kind):
    return next(one for one in boat.sensors if one.type == kind)


CEP, R50 = math.sqrt(2.0 * math.log(2.0)), 0.6745
"""Of what is normally distributed, in standard deviations: radius of half of the fixes, and half of the heights."""


@pytest.mark.parametrize(("suite", "across", "up"), [("standalone", 1.5, 2.0), ("rtk", 0.01, 0.01)])
def test_suites_with_errors_have_those_of_data_sheets(suite, across, up):
    """u-blox ZED-F9P: 1.5 m CEP and 2.0 m R50, with RTK 0.01 m. Xsens MTi-3, at 15 Hz."""
    boat = build_boat(Order("wamv", sensors=(suite,)))
    assert named(boat) == named(build_boat(Order("wamv")))
    gps, imu = sensor(boat, "gps"), sensor(boat, "imu")
    east, north, height = np.sqrt(variances(gps.position))
    assert [east * CEP, north * CEP, height * R50] == pytest.approx([across, across, up], rel=0.01)
    assert np.sqrt(variances(gps.velocity)) == pytest.approx([0.05 / CEP, 0.05 / CEP, 0.05 / R50], rel=0.01)
    assert imu.angular_velocity.noise == pytest.approx([math.radians(0.007) * math.sqrt(15.0)] * 3)
    assert imu.angular_velocity.drift == pytest.approx([math.radians(10.0 / 3600.0)] * 3)
    assert imu.acceleration.noise == pytest.approx([120e-6 * 9.80665 * math.sqrt(15.0)] * 3)
    assert imu.acceleration.drift == pytest.approx([30e-6 * 9.80665] * 3)
    assert (imu.heading.drift[2], imu.tilt.drift[0]) == pytest.approx((math.radians(2.0), math.radians(0.5)))


def test_vrxs_own_suite_has_no_errors():
    boat = build_boat(Order("wamv"))
    assert not variances(sensor(boat, "gps").position).any()
    imu = sensor(boat, "imu")
    assert not any(
        variances(getattr(imu, key)).any() for key in ("acceleration", "angular_velocity", "heading", "tilt")
    )


def test_a_component_file_has_errors_by_a_robot_with_that_argument(tmp_path):
    file = example_file("components")
    robot = tmp_path / "accurate.yaml"
    robot.write_text("extends: wamv\narguments: {sensor_errors: rtk, camera_info: centered}\n", encoding="utf-8")
    boat = build_boat(Order("./accurate.yaml", tmp_path, components=file))
    assert variances(sensor(boat, "gps").position)[0] == pytest.approx((0.01 / CEP) ** 2, rel=0.02)
    assert sensor(boat, "camera").info == "centered"


def test_in_worlds_of_vrx_3_the_boat_has_its_sensors():
    """Rates, errors and frames of VRX 3's own xacro, and those of a suite where it gives some."""
    boat, exact = (build_boat(Order("wamv", profile="vrx3", sensors=(suite,))) for suite in ("vrx", "rtk"))
    assert (sensor(boat, "gps").rate, sensor(boat, "imu").rate, sensor(exact, "imu").rate) == (20, 100, 100)
    imu, camera = sensor(boat, "imu"), sensor(boat, "camera")
    assert (imu.acceleration.noise[0], imu.acceleration.offset[0]) == (0.021, 0.05)
    assert (imu.angular_velocity.noise[0], imu.angular_velocity.offset[0]) == (0.009, 0.00075)
    assert sensor(exact, "imu").angular_velocity.noise[0] == pytest.approx(math.radians(0.07))  # 0.007 deg/s/sqrt(Hz)
    assert (camera.far, camera.baseline, camera.info) == (400, 0, "vrx3")
    assert (sensor(boat, "pinger").beacon, sensor(boat, "pinger").pose[:3]) == ((-528, 191, -2), (0, 0, 0))
    parts = build_boat(Order("wamv", profile="vrx3", components=example_file("components")))
    assert (sensor(parts, "gps").rate, sensor(parts, "imu").acceleration) == (20, imu.acceleration)


def test_suites_can_be_combined():
    boat = build_boat(Order("wamv", sensors=("rtk", "centered", "ground_truth")))
    assert sensor(boat, "camera").info == "centered"
    assert variances(sensor(boat, "gps").position).all()
    assert "p3d_wamv" in named(boat)


def test_errors_of_no_part_are_refused(tmp_path):
    (tmp_path / "mine.yaml").write_text("extends: wamv\narguments: {sensor_errors: gps}\n", encoding="utf-8")
    with pytest.raises(VrxError) as refused:
        build_boat(Order("./mine.yaml", tmp_path, components=example_file("components")))
    assert str(refused.value) == "argument sensor_errors: expected none, standalone or rtk, got 'gps'"


def test_a_suite_has_cameras_with_labels():
    plain, labelled = (build_boat(Order("wamv", sensors=(suite,))) for suite in ("vrx", "labelled"))
    assert named(plain) == named(labelled)
    for boat, wanted in ((plain, False), (labelled, True)):
        assert {one.labels for one in boat.sensors if one.type == "camera"} == {wanted}
    assert "labels" not in sensor(plain, "camera").model_dump()
