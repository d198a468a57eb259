"""What robot_localization gives, of a served world: by the truth, and by sensors."""

import math

import numpy as np
import pytest

import vrx_mj
from ros_scene import answer, call, run, served
from vrx_mj.errors import CommandError
from vrx_mj.frames import rotation_matrix
from vrx_mj.ros import cdr
from vrx_mj.ros.serve import ServeOptions

STEM = "/wamv/robot_localization"
FILTERED, GPS, FIX = f"{STEM}/odometry/filtered", f"{STEM}/odometry/gps", f"{STEM}/gps/filtered"
THERE = {"latitude": -33.7225, "longitude": 150.674}
BARE = ("/fromLL", "/toLL", "/datum")
SOURCES = ("truth", "navigator")
FLEET = {"sensors": ["gps", "imu"], "boats": [{"name": "wamv", "pose": [-532, 162, 0, 0, 0, 1]}]}


def world(*, fleet=FLEET, heading=None, **more):
    if heading is not None:
        more["georeference"] = {"latitude": -33.724223, "longitude": 150.679736, "elevation": 0.0, "heading": heading}
    return vrx_mj.compile_world({"extends": "sydney_regatta", **more}, fleet=fleet)


@pytest.fixture(scope="module")
def sydney():
    return world()


def last(scene, topic):
    return scene.network.got[topic][-1].message


def xyz(point):
    return np.array([point.x, point.y, point.z])


def turn_of(quaternion):
    return rotation_matrix((quaternion.w, quaternion.x, quaternion.y, quaternion.z))


def chained(scene, *children):
    """Position and rotation in `map` of the last of some frames, each of which is in the one before it."""
    frames = {one.child_frame_id: one for one in last(scene, "/tf").transforms}
    place, turn, parent = np.zeros(3), np.eye(3), "map"
    for child in children:
        assert frames[child].header.frame_id == parent
        step, parent = frames[child].transform, child
        place, turn = place + turn @ xyz(step.translation), turn @ turn_of(step.rotation)
    return place, turn


def set_datum(scene, position, **orientation):
    return call(
        scene,
        f"{STEM}/datum",
        "robot_localization/SetDatum",
        geo_pose={"position": position, "orientation": orientation},
    )


@pytest.mark.parametrize("source", SOURCES)
@pytest.mark.parametrize("heading", [None, 25.0])
def test_the_boat_is_where_it_is_by_frames_odometry_and_fix(source, heading):
    scene = served(world(heading=heading), wanted=[FILTERED, GPS, FIX, "/tf"], localization=source)
    set_datum(scene, THERE, z=math.sin(0.4), w=math.cos(0.4))
    run(scene, 2.0)
    true = scene.server.bodies.model("wamv")
    place, turn = chained(scene, "wamv/odom", "wamv/base_link")
    assert place == pytest.approx(true.position, abs=0.01)
    assert turn == pytest.approx(rotation_matrix(true.quaternion), abs=0.01)
    origin, axes = chained(scene, "wamv/odom")
    odometry = last(scene, FILTERED)
    assert (odometry.header.frame_id, odometry.child_frame_id) == ("wamv/odom", "wamv/base_link")
    assert origin + axes @ xyz(odometry.pose.pose.position) == pytest.approx(true.position, abs=0.01)
    assert axes @ turn_of(odometry.pose.pose.orientation) == pytest.approx(turn, abs=1e-6)
    assert turn @ xyz(odometry.twist.twist.linear) == pytest.approx(true.velocity, abs=0.05)
    assert origin + axes @ xyz(last(scene, GPS).pose.pose.position) == pytest.approx(true.position, abs=0.02)
    fix, earth = last(scene, FIX), scene.sim.world.parameters.georeference
    assert earth.to_enu(fix.latitude, fix.longitude, fix.altitude) == pytest.approx(true.position, abs=0.01)
    assert (fix.status.status, fix.position_covariance_type) == (fix.status.STATUS_GBAS_FIX, fix.COVARIANCE_TYPE_KNOWN)
    for covariance in (odometry.pose.covariance, odometry.twist.covariance):
        assert np.linalg.eigvalsh(covariance.reshape(6, 6)).min() > 0.0


@pytest.mark.parametrize("heading", [0.0, 25.0])
def test_the_frame_is_east_north_up_at_the_worlds_origin_until_it_has_a_datum(heading):
    scene = served(world(heading=heading), wanted=["/tf"], localization="truth")
    run(scene, 0.1)
    east = scene.sim.world.parameters.georeference.from_east_north_up(1.0, 0.0, 0.0)
    origin, axes = chained(scene, "wamv/odom")
    assert origin == pytest.approx(np.zeros(3))
    assert axes[:, 0] == pytest.approx(np.array(east))
    set_datum(scene, THERE)
    run(scene, 0.1)
    origin, axes = chained(scene, "wamv/odom")
    there = scene.sim.world.parameters.georeference.to_enu(THERE["latitude"], THERE["longitude"], 0.0)
    assert origin == pytest.approx(np.array(there))
    assert axes[:, 0] == pytest.approx(np.array(east))  # no heading given: it is 0, east


def test_places_go_from_degrees_and_back(sydney):
    scene = served(sydney, localization="truth")
    point = call(scene, "/fromLL", "robot_localization/FromLL", ll_point=THERE).map_point
    assert xyz(point) == pytest.approx(scene.sim.world.parameters.georeference.to_enu(-33.7225, 150.674, 0.0))
    back = call(
        scene, "/toLL", "robot_localization/ToLL", map_point={"x": point.x, "y": point.y, "z": point.z}
    ).ll_point
    assert (back.latitude, back.longitude) == pytest.approx((-33.7225, 150.674), abs=1e-9)
    set_datum(scene, THERE)
    assert xyz(call(scene, "/fromLL", "robot_localization/FromLL", ll_point=THERE).map_point) == pytest.approx(
        np.zeros(3)
    )
    unspecified = call(scene, "/fromLL", "robot_localization/FromLL", ll_point=THERE | {"altitude": math.nan})
    assert xyz(unspecified.map_point) == pytest.approx(np.zeros(3), abs=0.1)


def test_a_datum_that_moves_is_told_once(sydney):
    scene = served(sydney, localization="navigator")
    for number in range(20):
        assert not isinstance(set_datum(scene, {"latitude": -33.7225 + 1e-4 * number, "longitude": 150.674}), str)
        run(scene, 0.02)
    assert [line.partition(" by ")[0] for line in scene.told] == ["wamv/odom moves"]


@pytest.mark.parametrize(
    "wrong",
    [{"latitude": math.nan}, {"latitude": 91.0}, {"longitude": math.inf}, {"altitude": 1e300}],
)  # fmt: skip
def test_a_datum_that_is_nowhere_is_refused_and_told_once(sydney, wrong):
    scene = served(sydney, wanted=["/tf"], localization="truth")
    for _ in range(3):
        assert set_datum(scene, THERE | wrong).startswith("invalid place")
        assert call(scene, "/fromLL", "robot_localization/FromLL", ll_point=THERE | wrong).startswith("invalid place")
    run(scene, 0.1)
    assert len(scene.told) == 2
    assert chained(scene, "wamv/odom")[0] == pytest.approx(np.zeros(3))


def test_a_datum_without_a_heading_or_a_point_that_is_none_is_refused(sydney):
    scene = served(sydney, localization="truth")
    assert set_datum(scene, THERE, w=math.nan) == "invalid orientation of the datum of wamv: finite numbers are needed"
    point = {"x": math.nan, "y": 0.0, "z": 0.0}
    assert call(scene, "/toLL", "robot_localization/ToLL", map_point=point).startswith("invalid point [nan")


def test_without_it_nothing_is_there(sydney):
    scene = served(sydney)
    assert not [name for name in (*scene.server.table.outputs, *scene.server.table.services) if "localization" in name]
    assert not set(BARE) & set(scene.server.table.services)


def test_each_boat_has_its_own_and_names_without_a_namespace_are_those_of_one(bay):
    scene = served(bay, localization="navigator")
    names = {name for name in scene.server.table.services if "robot_localization" in name}
    assert len(names) == 6
    assert not set(BARE) & set(scene.server.table.services)
    scene.server.remove("wamv2")
    assert set(BARE) < set(scene.server.table.services)


def test_a_boat_keeps_its_datum_when_another_one_leaves(bay):
    scene = served(bay, wanted=["/tf"], localization="truth")
    call(scene, "/wamv1/robot_localization/datum", "robot_localization/SetDatum", geo_pose={"position": THERE})
    scene.server.remove("wamv2")
    run(scene, 0.1)
    frames = {one.child_frame_id: one.transform.translation for one in last(scene, "/tf").transforms}
    assert abs(frames["wamv1/odom"].x) > 100.0


def test_a_boat_without_the_sensors_is_left_out_and_named():
    boats = [FLEET["boats"][0], {"name": "blind", "sensors": ["gps"], "pose": [-560, 190, 0, 0, 0, 1]}]
    scene = served(world(fleet=FLEET | {"boats": boats}), localization="navigator")
    assert scene.told == ["blind has no IMU: blind is not localized by its sensors; use --localization truth"]
    assert "/blind/robot_localization/odometry/filtered" not in scene.server.table.outputs
    assert FILTERED in scene.server.table.outputs


def test_a_world_that_is_nowhere_has_the_truth_without_fixes():
    fleet = FLEET | {"boats": [{"name": "wamv", "pose": [0, 0, 0, 0, 0, 1]}]}
    nowhere = vrx_mj.compile_world("ocean", fleet=fleet)
    scene = served(nowhere, localization="truth")
    assert FILTERED in scene.server.table.outputs
    assert not {GPS, FIX} & set(scene.server.table.outputs)
    assert not set(BARE) & set(scene.server.table.services)
    assert "the world has no georeference" in served(nowhere, localization="navigator").told[-1]


def test_ros_2_has_the_topics_and_frames(sydney):
    scene = served(sydney, wanted=[FILTERED, "/wamv/pose"], dialect="vrx3", localization="navigator")
    run(scene, 0.2)
    assert last(scene, FILTERED).child_frame_id == "wamv/base_link"
    assert {"wamv/odom", "wamv/base_link"} < {one.child_frame_id for one in last(scene, "/wamv/pose").transforms}


def test_ros_2_has_the_services_as_bytes_of_its_own_types(sydney):
    """robot_localization has no wheel: what its types of ROS 2 have is written and read in CDR."""
    scene = served(sydney, dialect="vrx3", localization="truth")

    def asked(name, kind, **fields):
        asks, answers = (f"robot_localization/{kind}{half}" for half in ("Request", "Response"))
        request = cdr.decode(cdr.encode(cdr.kind(asks)(**fields), asks), asks)
        raw = cdr.encode(answer(scene, name, request), answers)
        return raw, cdr.decode(raw, answers)

    place = cdr.kind("geographic_msgs/GeoPoint")(**THERE, altitude=0.0)
    point = asked(f"{STEM}/fromLL", "FromLL", ll_point=place)[1].map_point
    back = asked("/toLL", "ToLL", map_point=point)[1].ll_point
    assert (back.latitude, back.longitude) == pytest.approx((THERE["latitude"], THERE["longitude"]), abs=1e-9)
    turn = cdr.kind("geometry_msgs/Quaternion")(x=0.0, y=0.0, z=0.0, w=1.0)
    pose = cdr.kind("geographic_msgs/GeoPose")(position=place, orientation=turn)
    assert asked("/datum", "SetDatum", geo_pose=pose)[0] == bytes((0, 1, 0, 0, 0))
    assert xyz(asked("/fromLL", "FromLL", ll_point=place)[1].map_point) == pytest.approx(np.zeros(3), abs=1e-6)


def test_time_that_begins_anew_is_no_time_that_goes_back(sydney):
    scene = served(sydney, wanted=[FILTERED], localization="navigator")
    run(scene, 1.0)
    scene.server.reset_simulation()
    run(scene, 1.0)
    true = scene.server.bodies.model("wamv").position
    assert xyz(last(scene, FILTERED).pose.pose.position) == pytest.approx(true, abs=0.01)


def test_the_boat_is_placed_once():
    with pytest.raises(CommandError, match="--truth and --localization both place the boats in /tf: give one of them"):
        ServeOptions(ros1=True, truth=True, localization="truth")
