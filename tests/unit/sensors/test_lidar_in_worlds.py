"""A boat's lidar in compiled worlds: its returns lie on what is there."""

import math

import mujoco
import numpy as np
import pytest

from vrx_mj.config.sensors import LidarConfig
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.mjcf.scene import drawing_model
from vrx_mj.sensors.lidar import Lidar
from vrx_mj.sensors.rays import reflecting

MAST = (0.7, 0.0, 1.8)
"""Where VRX mounts its lidar, in base_link [m]."""
CONFIG = LidarConfig(name="lidar_wamv", link="lidar_wamv_link", noise=0.0)
BERTH = {
    "docks": [{"name": "dock", "pose": [8, -3, 0, 0, 0, 0.3], "layout": "X X\nX X\nXXX\n"}],
    "objects": [
        {"name": "red", "model": "mb_marker_buoy_red", "pose": [6, 5, 0, 0, 0, 0.5]},
        {"name": "round", "model": "mb_round_buoy_orange", "pose": [-4, -5, 0, 0, 0.1, 0]},
        {"name": "black", "model": "polyform_a3", "pose": [-3, 6, 0.1, 0, 0, 0]},
        {"name": "far", "model": "polyform_a7", "pose": [-14, 3, 0.2, 0, 0.4, 0]},
        {"name": "mark", "model": "surmark46104", "pose": [3, 7, 0.3, 0.1, 0, 0]},
        {"name": "light", "model": "robotx_light_buoy", "pose": [2, -9, 0.2, 0.05, 0, 1]},
    ],
}
"""Open water, a dock ahead, and buoys round the boat."""


def sights(world, fleet=None):
    """The drawn model of a world, its data at the start, and the first boat's body."""
    world = compile_world(world, fleet=fleet)
    model = drawing_model(world)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return model, data, model.body(f"{world.boats[0]}/base_link").id


@pytest.fixture(scope="module")
def berth():
    return sights(BERTH)


def outside_box(point, half):
    apart = np.abs(point) - half
    return np.linalg.norm(np.maximum(apart, 0), axis=1) + np.minimum(apart.max(axis=1), 0)


def outside_cylinder(point, size):
    apart = np.stack((np.hypot(point[:, 0], point[:, 1]) - size[0], np.abs(point[:, 2]) - size[1]), axis=1)
    return np.linalg.norm(np.maximum(apart, 0), axis=1) + np.minimum(apart.max(axis=1), 0)


def outside_capsule(point, size):
    axis = np.clip(point[:, 2], -size[1], size[1])
    return np.linalg.norm(point - axis[:, None] * (0, 0, 1), axis=1) - size[0]


OUTSIDE = {
    mujoco.mjtGeom.mjGEOM_SPHERE: lambda point, size: np.linalg.norm(point, axis=1) - size[0],
    mujoco.mjtGeom.mjGEOM_BOX: outside_box,
    mujoco.mjtGeom.mjGEOM_CYLINDER: outside_cylinder,
    mujoco.mjtGeom.mjGEOM_CAPSULE: outside_capsule,
}
"""Distance of points (n, 3) in a shape's frame from its surface, negative inside [m]."""


def nearest_surface(model, data, points):
    """How far each point is from the nearest surface [m], and to which body that belongs."""
    best, body = np.full(len(points), np.inf), np.zeros(len(points), int)
    for geom in reflecting(model):
        kind = mujoco.mjtGeom(int(model.geom_type[geom]))
        if kind not in OUTSIDE:
            continue
        local = (points - data.geom_xpos[geom]) @ data.geom_xmat[geom].reshape(3, 3)
        away = np.abs(OUTSIDE[kind](local, model.geom_size[geom]))
        nearer = away < best
        best[nearer], body[nearer] = away[nearer], model.geom_bodyid[geom]
    return best, body


def elsewhere(data, body, points, rotation):
    """Of points in the sensor's frame those that are not on its own boat, in the world."""
    local = np.array(MAST) + points.astype(float) @ rotation.T
    own = (np.abs(local[:, 0]) < 3.0) & (np.abs(local[:, 1]) < 1.5)
    return data.xpos[body] + local[~own] @ data.xmat[body].reshape(3, 3).T


@pytest.mark.parametrize("tilt", [0.0, 0.12])
def test_points_lie_on_dock_and_buoys(berth, tilt):
    model, data, body = berth
    rotation = np.array([[math.cos(tilt), 0, math.sin(tilt)], [0, 1, 0], [-math.sin(tilt), 0, math.cos(tilt)]])
    cloud = Lidar(model, CONFIG, body, MAST, rotation).scan(data, 1, 0)
    points = elsewhere(data, body, cloud.points, rotation)
    away, on = nearest_surface(model, data, points)
    assert away.max() < 1e-5  # 32 bits at 20 m; 5 cm are promised
    assert len(points) > 1000
    if not tilt:
        hit = {model.body(number).name.split("/")[0] for number in np.unique(on)}
        assert hit >= {"dock", "red", "round", "black", "mark", "light"}


def test_with_noise_points_lie_within_five_centimetres(berth):
    model, data, body = berth
    noisy = LidarConfig(name="lidar_wamv", link="lidar_wamv_link")
    cloud = Lidar(model, noisy, body, MAST, np.eye(3)).scan(data, 1, 0)
    away, _ = nearest_surface(model, data, elsewhere(data, body, cloud.points, np.eye(3)))
    assert away.mean() > 0.002
    assert away.max() < 0.05  # five standard deviations


def test_the_boats_own_deck_is_seen_and_its_water_is_not(berth):
    model, data, body = berth
    down = CONFIG.model_copy(update={"elevation": (-1.4, -0.9)})
    cloud = Lidar(model, down, body, MAST, np.eye(3)).scan(data, 1, 0)
    height = cloud.points[:, 2].astype(float) + MAST[2]
    assert 5000 < len(cloud.points) < 30000
    assert height.min() > -0.5
    assert np.median(height) == pytest.approx(1.25, abs=0.08)  # the deck's top is at 1.3 m


def test_the_other_boat_is_seen():
    model, data, body = sights({}, {"usv_count": 2, "positions": [{"x": 0, "y": 0}, {"x": 8, "y": 0}]})
    low = (2.5, 0.0, 0.8)
    points = Lidar(model, CONFIG, body, low, np.eye(3)).scan(data, 1, 0).points.astype(float)
    ahead = points[points[:, 0] > 1.0]
    assert len(ahead) > 200
    assert ((ahead[:, 0] > 2.0) & (ahead[:, 0] < 8.5)).all()  # its hull is 5.5 m long, its bow beyond its origin
    assert np.abs(ahead[:, 1]).max() < 1.3


@pytest.mark.parametrize("boat", ["wamv1", "wamv3"])
def test_the_example_course_looks_as_mujoco_sees_it_ray_by_ray(boat):
    model, data, _ = sights("example_course", "trio")
    body = model.body(f"{boat}/base_link").id
    sensor = Lidar(model, CONFIG, body, MAST, np.eye(3))
    found = sensor.ranges(data)[::5]
    turned, (near, far) = data.xmat[body].reshape(3, 3), CONFIG.range
    groups, hit = np.array([0, 0, 1, 0, 0, 0], np.uint8), np.empty(1, np.int32)
    expected = np.full(len(found), np.inf)
    for number, along in enumerate(sensor._directions[::5] @ turned.T):
        beyond = mujoco.mj_ray(
            model, data, data.xpos[body] + turned @ MAST + near * along, along, groups, True, -1, hit
        )
        if 0 <= beyond < far - near:
            expected[number] = near + beyond
    seen = np.isfinite(found)
    assert (seen == np.isfinite(expected)).all()
    assert found[seen] == pytest.approx(expected[seen], abs=1e-8)  # grazing rays, 600 m from the origin
    assert seen.sum() > 200
