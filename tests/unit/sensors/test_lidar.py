"""Lidars: what they see, against closed forms and against MuJoCo's own test of every ray."""

import math

import mujoco
import numpy as np
import pytest
from pydantic import ValidationError

from unit.physics.rows import sea
from vrx_mj.config.sensors import LidarConfig
from vrx_mj.physics.waves import pms_components, surface_height
from vrx_mj.sensors.lidar import Lidar, Water, sea_distance

KEY = 0xFEDC_BA98_7654_3210
VLP16 = {"name": "lidar", "link": "lidar_link"}
PLANAR = {
    **VLP16,
    "output": "scan",
    "rings": 1,
    "samples": 256,
    "azimuth": (-1.0472, 1.0472),
    "elevation": (0.0, 0.0),
    "range": (0.2, 70.0),
    "resolution": 0.02,
    "noise": 0.0,
}
EXACT = {**VLP16, "noise": 0.0}
BOX = 'type="box" size="1 2 3"'
HOUSING = '<geom group="2" type="cylinder" size="0.055 0.0375"/>'


def scene(geoms, *, assets=""):
    """A sensor's body at the origin with `geoms` about it; those of group 2 are looked at."""
    text = f'<mujoco><asset>{assets}</asset><worldbody><body name="boat">{geoms}</body></worldbody></mujoco>'
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return model, data


def lidar(model, settings=EXACT, *, position=(0, 0, 0), rotation=None, **more):
    turned = np.eye(3) if rotation is None else rotation
    return Lidar(model, LidarConfig(**{**settings, **more}), 1, position, turned)


def in_every_ray(model, data, sensor, *, far):
    """What MuJoCo finds when it tests all rays against all geoms of group 2."""
    origin = data.xpos[1] + data.xmat[1].reshape(3, 3) @ sensor._position
    vectors = sensor._directions @ (data.xmat[1].reshape(3, 3) @ sensor._rotation).T
    found = np.empty(len(vectors))
    groups = np.array([0, 0, 1, 0, 0, 0], np.uint8)
    hit = np.empty(len(vectors), np.int32)
    mujoco.mj_multiRay(model, data, origin, vectors.ravel(), groups, True, -1, hit, found, None, len(vectors), far)
    found[(found < 0) | (found >= far)] = np.inf
    return found


def turn(draw):
    matrix = np.empty(9)
    quaternion = draw.normal(size=4)
    mujoco.mju_quat2Mat(matrix, quaternion / np.linalg.norm(quaternion))
    return matrix.reshape(3, 3)


def clutter(draw, count):
    """Shapes of every kind, anyhow about a sensor, near, far and round it."""
    texts = []
    for _ in range(count):
        kind = draw.choice(["sphere", "capsule", "ellipsoid", "cylinder", "box", "mesh"])
        shape = 'mesh="rock"' if kind == "mesh" else f'size="{draw.uniform(0.1, 4)} {draw.uniform(0.1, 2)} 0.3"'
        pos = " ".join(str(value) for value in draw.normal(scale=12, size=3))
        quat = " ".join(str(value) for value in draw.normal(size=4))
        texts.append(f'<geom group="2" type="{kind}" {shape} pos="{pos}" quat="{quat}"/>')
    rock = " ".join(str(value) for value in draw.normal(scale=2, size=600))
    return scene("".join(texts), assets=f'<mesh name="rock" vertex="{rock}" inertia="shell"/>')


# Rays


def test_the_rays_are_velodynes_both_ends_included_and_in_the_order_of_vrx_messages():
    model, data = scene('<geom group="2" type="sphere" size="50"/>')  # seen from its inside, all round
    cloud = lidar(model).scan(data, KEY, 0)
    azimuth = np.repeat(np.linspace(-math.pi, math.pi, 1875), 16)
    elevation = np.tile(np.linspace(math.radians(-15), math.radians(15), 16), 1875)
    expected = 50 * np.stack(
        (np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)), axis=1
    )
    assert np.abs(cloud.points - expected).max() < 1e-5  # 32 bits at 50 m are 4e-6 m
    assert (cloud.ring == np.tile(np.arange(16), 1875)).all()
    assert (cloud.points.dtype, cloud.ring.dtype, cloud.intensity.dtype) == (np.float32, np.uint16, np.float32)
    assert (cloud.intensity == np.zeros(30000)).all()


def test_one_ray_is_one_ray():
    model, data = scene(f'<geom group="2" {BOX} pos="5 0 0"/>')
    cloud = lidar(model, rings=1, samples=1, azimuth=(0, 1), elevation=(0, 0.2)).scan(data, KEY, 0)
    assert cloud.points.tolist() == [[4.0, 0.0, 0.0]]


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("samples", "rings", "least"), [(401, 20, 200), (90, 30, 50)], ids=["dense", "sparse"])
def test_distances_are_those_of_every_ray_tested_against_every_shape(seed, samples, rings, least):
    draw = np.random.default_rng(seed)
    model, data = clutter(draw, 40)
    near = 1e-6  # rays that begin inside a shape meet its far side, wherever in it they begin
    sensor = lidar(
        model, position=draw.normal(size=3), rotation=turn(draw), range=(near, 30.0), samples=samples, rings=rings,
        elevation=tuple(draw.uniform(-1.6, 1.6, 2).clip(-1.57, 1.57)), azimuth=tuple(draw.uniform(-7, 7, 2)),
    )  # fmt: skip
    expected = in_every_ray(model, data, sensor, far=30.0)
    found = sensor.ranges(data)
    assert (np.isfinite(found) == np.isfinite(expected)).all()
    hit = np.isfinite(found)
    assert hit.sum() > least
    assert found[hit] == pytest.approx(expected[hit], abs=1e-9)  # grazing rays multiply the rounding, 1e-15 m


def test_a_plane_has_no_end():
    model, data = scene('<geom group="2" type="plane" size="0 0 1" pos="0 0 -2"/>')
    found = lidar(model, elevation=(-0.5, -0.5), rings=1, samples=8).ranges(data)
    assert found == pytest.approx(np.full(8, 2 / math.sin(0.5)), rel=1e-12)


def test_a_height_field_is_seen():
    heights = " ".join("1" for _ in range(9))
    field = f'<hfield name="shoal" nrow="3" ncol="3" size="9 9 1 1" elevation="{heights}"/>'
    model, data = scene('<geom group="2" type="hfield" hfield="shoal" pos="0 0 -3"/>', assets=field)
    found = lidar(model, elevation=(-0.5, -0.5), rings=1, samples=8).ranges(data)
    top = data.geom_xpos[0, 2] + model.hfield_data[0] * model.hfield_size[0, 2]
    assert found == pytest.approx(np.full(8, -top / math.sin(0.5)), rel=1e-6)  # heights have 32 bits


# What is seen


def ahead(model, data, **more):
    """The distance along x."""
    return lidar(model, rings=1, samples=1, azimuth=(0, 0), elevation=(0, 0), **more).ranges(data)[0]


@pytest.mark.parametrize(
    ("geoms", "distance"),
    [
        (f'<geom group="2" {BOX} pos="5 0 0"/>', 4.0),
        (f'<geom group="2" {BOX} pos="5 0 0" rgba="1 1 1 0"/>', math.inf),
        (f'<geom group="3" {BOX} pos="5 0 0"/>', 4.0),
        (f'<geom group="3" {BOX} pos="5 0 0"/><geom group="2" {BOX} pos="6 0 0"/>', 5.0),
        ('<geom name="water" group="1" type="plane" size="9 9 1" pos="3 0 0" zaxis="-1 0 0"/>', math.inf),
    ],
    ids=["looked at", "transparent", "only collides", "collides and is looked at", "water"],
)
def test_what_reflects(geoms, distance):
    assert ahead(*scene(geoms)) == distance


def test_nothing_nearer_than_the_range_begins_stands_in_the_way():
    wall = f'<geom group="2" {BOX} pos="5 0 0"/>'
    model, data = scene(HOUSING + wall)
    assert ahead(model, data) == 4.0
    assert ahead(model, data, range=(0.01, 9.0)) == pytest.approx(0.055)
    post = '<geom group="2" type="cylinder" size="0.01 1" pos="0.2 0 0"/>'
    model, data = scene(HOUSING + post + wall)
    assert ahead(model, data) == pytest.approx(0.19)


def test_a_mesh_nearer_than_the_range_begins_does_not_stand_in_the_way_either():
    corners = " ".join(f"{x} {y} {z}" for x in (-0.05, 0.05) for y in (-0.05, 0.05) for z in (-0.05, 0.05))
    mesh = f'<mesh name="housing" vertex="{corners}"/>'
    model, data = scene(f'<geom group="2" type="mesh" mesh="housing"/><geom group="2" {BOX} pos="5 0 0"/>', assets=mesh)
    assert ahead(model, data) == 4.0
    assert ahead(model, data, range=(0.01, 9.0)) == pytest.approx(0.05)
    plain = scene(f'<geom group="2" {BOX} pos="5 0 0"/>')
    assert lidar(model).ranges(data).tobytes() == lidar(plain[0]).ranges(plain[1]).tobytes()


def test_of_a_mesh_that_begins_too_near_the_rest_is_seen():
    corners = " ".join(f"{x} {y} {z}" for x in (0.05, 0.06) for y in (-1, 1) for z in (-1, 1))
    model, data = scene('<geom group="2" type="mesh" mesh="plate"/>', assets=f'<mesh name="plate" vertex="{corners}"/>')
    found = lidar(model).ranges(data)
    along = lidar(model)._directions[:, 0]
    expected = np.where(along > 0.5, np.where(along > 0.6, np.inf, 0.06 / along), 0.05 / along)
    seen = (along > 0.06) & (np.abs(np.abs(along - 0.55) - 0.05) > 1e-6)  # the plate's edges, and the range's, apart
    assert found[seen] == pytest.approx(expected[seen], rel=1e-6)  # a mesh's corners have 32 bits


def test_the_range_ends():
    model, data = scene(f'<geom group="2" {BOX} pos="5 0 0"/>')
    assert ahead(model, data, range=(0.1, 3.99)) == math.inf


# Noise


def walled(*more):
    return scene('<geom group="2" type="sphere" size="50"/>' + "".join(more))


def test_the_same_key_and_number_give_the_same_bits_and_others_do_not():
    model, data = walled()
    one, same = (lidar(model, VLP16).scan(data, KEY, 3).points for _ in range(2))
    assert one.tobytes() == same.tobytes()
    for key, index in ((KEY + 1, 3), (KEY, 4)):
        other = lidar(model, VLP16).scan(data, key, index).points
        assert (np.linalg.norm(other - one, axis=1) > 1e-5).mean() > 0.99


def test_noise_is_normal_along_the_ray():
    model, data = walled()
    points = lidar(model, VLP16).scan(data, KEY, 0).points.astype(float)
    length = np.linalg.norm(points, axis=1)
    noise = (length - 50) / 0.01
    assert abs(noise.mean()) < 4 / math.sqrt(30000)
    assert noise.std() == pytest.approx(1, abs=4 / math.sqrt(60000))
    assert (np.abs(noise) < 1).mean() == pytest.approx(0.6827, abs=0.011)
    exact = lidar(model).scan(data, KEY, 0).points / 50
    assert np.abs(points / length[:, None] - exact).max() < 1e-6


def test_noise_goes_on_from_scan_to_scan_without_repeating():
    model, data = walled()
    sensor = lidar(model, VLP16, rings=1, elevation=(0, 0), samples=10)
    noise = np.concatenate([np.linalg.norm(sensor.scan(data, KEY, i).points, axis=1) for i in range(20)])
    assert len(np.unique(noise)) > 190  # of 200: some lengths of 32 bits are equal by chance


def test_what_is_hit_elsewhere_changes_no_rays_noise():
    clouds = []
    for more in ("", f'<geom group="2" {BOX} pos="9 0 0"/>'):
        model, data = walled(more)
        clouds.append(lidar(model, VLP16).scan(data, KEY, 1).points)
    differ = (clouds[0] != clouds[1]).any(axis=1)
    assert 0 < differ.sum() < 30000
    assert (clouds[1][differ, 0] < 10.5).all()
    assert (np.linalg.norm(clouds[1][~differ], axis=1) > 49).all()


def test_noise_that_carries_a_return_out_of_the_range_drops_it_from_a_cloud():
    model, data = walled()
    cloud = lidar(model, VLP16, range=(0.1, 50.000001), noise=0.5).scan(data, KEY, 0)
    assert len(cloud.points) == pytest.approx(15000, abs=400)
    assert np.linalg.norm(cloud.points, axis=1).max() < 50.00001
    assert len(cloud.ring) == len(cloud.intensity) == len(cloud.points)


def test_noise_that_carries_a_return_before_the_range_drops_it_from_a_cloud():
    model, data = walled()
    cloud = lidar(model, VLP16, range=(49.999999, 60.0), noise=0.5).scan(data, KEY, 0)
    assert len(cloud.points) == pytest.approx(15000, abs=400)
    assert np.linalg.norm(cloud.points, axis=1).min() > 49.9999


# Planar lidars


def test_a_planar_scan():
    model, data = scene(f'<geom group="2" {BOX} pos="5 0 0"/>')
    scan = lidar(model, PLANAR).scan(data, KEY, 0)
    angle = np.linspace(-1.0472, 1.0472, 256)
    seen = np.abs(np.tan(angle)) <= 2.0 / 4.0
    assert scan.ranges.dtype == np.float32
    assert (np.isfinite(scan.ranges) == seen).all()
    assert np.isposinf(scan.ranges[~seen]).all()
    exact = 4 / np.cos(angle[seen])
    assert scan.ranges[seen] == pytest.approx(np.round(exact / 0.02) * 0.02, rel=1e-6)
    assert (scan.angle_min, scan.range_min, scan.range_max) == (-1.0472, 0.2, 70.0)
    assert scan.angle_max == pytest.approx(1.0472)
    assert scan.angle_increment == pytest.approx(2 * 1.0472 / 255)


def test_noise_carries_no_planar_return_out_of_the_range():
    model, data = walled()
    scan = lidar(model, PLANAR, range=(0.2, 50.01), noise=0.5, resolution=0.0).scan(data, KEY, 0)
    assert scan.ranges.max() == np.float32(50.01)
    assert (scan.ranges < 50).sum() == pytest.approx(128, abs=40)


# The sea


def water(*waves, time=10.0):
    rows, surface = sea(waves, level=-1.5)
    return Water(rows, surface.reshape(1), time)


def test_only_a_lidar_with_sea_returns_sees_the_sea():
    model, data = scene(f'<geom group="2" {BOX} pos="5 0 0"/>')
    without = lidar(model).scan(data, KEY, 0, water()).points
    assert 0 < len(without) == np.isfinite(lidar(model).ranges(data)).sum()
    found = lidar(model, sea_returns=True).ranges(data, water()).reshape(1875, 16)
    behind = np.full(16, np.inf)
    behind[:8] = 1.5 / np.sin(np.radians(15 - 2 * np.arange(8)))
    assert found[0] == pytest.approx(behind, rel=1e-9)  # astern is water alone
    assert found[937] == pytest.approx(4 / np.cos(np.radians(-15 + 2 * np.arange(16))), rel=1e-9)  # the box is nearer


def test_returns_lie_on_the_waves():
    wave = {"amplitude": 0.5, "wavenumber": 0.4, "frequency": 2.0, "direction": (0.6, 0.8), "steepness": 0.0}
    model, data = scene(f'<geom group="2" {BOX} pos="500 0 0"/>')
    points = lidar(model, sea_returns=True).scan(data, KEY, 0, water(wave)).points.astype(float)
    phase = 0.4 * (0.6 * points[:, 0] + 0.8 * points[:, 1]) - 2.0 * 10.0
    assert len(points) > 10000
    assert points[:, 2] == pytest.approx(-1.5 + 0.5 * np.cos(phase), abs=2e-5)  # 32 bits at 130 m


# Bad input


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"range": (5, 1)}, "the nearest must be below the farthest, got [5, 1]"),
        ({"range": (-1, 1)}, "Input should be greater than or equal to 0"),
        ({"elevation": (0, 2)}, "invalid elevation [0.0, 2.0] rad: from -pi/2 to pi/2 is needed"),
        ({"output": "scan"}, "a scan has one ring, got 16; write `output: points` for several"),
        ({"rings": 32, "samples": 99_999}, "32 rings of 99999 samples: at most 1000000 rays"),
    ],
)
def test_a_lidar_that_cannot_be(wrong, message):
    with pytest.raises(ValidationError) as caught:
        LidarConfig(**{**VLP16, **wrong})
    assert [error["msg"] for error in caught.value.errors()] == [message]


# Where rays meet the sea, against a fine march along them


T = 30.0
FAR = 130.0
STEP = 0.002


def rough_sea(gain, *, tau=0.0, level=0.0):
    rows = pms_components(3, 2.5, 0.4, 0.0, gain, 5.0, (1.0, 0.3)) if gain else []
    waves, surface = sea(rows, tau=tau, level=level)
    return waves, surface.reshape(1)


def unit(azimuth, elevation):
    level = math.cos(elevation)
    return np.array([level * math.cos(azimuth), level * math.sin(azimuth), math.sin(elevation)])


def gap(waves, rough, origin, along, s):
    x, y, z = origin + s * along
    return z - surface_height(waves, rough[0], x, y, T)


def marched(waves, rough, origin, along, begin):
    """The first point under water in steps of 2 mm, then halved."""
    s = np.arange(begin, FAR, STEP)
    x, y, z = origin[:, None] + along[:, None] * s
    height = np.full_like(s, rough["level"][0])
    share = 1.0 if rough["tau"][0] <= 0 else 1.0 - math.exp(-T / rough["tau"][0])
    for wave in waves:
        phase = wave["wavenumber"] * (wave["direction"] @ (x, y)) - wave["frequency"] * T
        height += share * wave["amplitude"] * np.cos(phase)
    under = np.flatnonzero(z < height)
    if not len(under):
        return math.inf
    low, high = s[under[0] - 1], s[under[0]]
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if gap(waves, rough, origin, along, middle) > 0 else (low, middle)
    return high


@pytest.mark.parametrize(("gain", "tau", "level"), [(0.3, 0.0, 0.0), (1.0, 20.0, -0.4), (2.0, 0.0, 1.0)])
def test_rays_meet_the_waves_where_a_fine_march_does(gain, tau, level):
    waves, rough = rough_sea(gain, tau=tau, level=level)
    draw = np.random.default_rng(int(10 * gain))
    hits = 0
    for _ in range(60):
        origin = np.array([*draw.uniform(-50, 50, 2), level + draw.uniform(0.5, 6)])
        along = unit(draw.uniform(-3, 3), draw.uniform(-0.6, 0.05))
        if gap(waves, rough, origin, along, 0.1) <= 0.01:
            continue
        expected = marched(waves, rough, origin, along, 0.1)
        found = sea_distance(waves, rough[0], T, origin, along, 0.1, FAR)
        # a ray stops 1e-9 m over the water, and grazing ones go far in that height
        assert found == pytest.approx(expected, abs=1e-6)
        hits += math.isfinite(found)
    assert hits > 30


@pytest.mark.parametrize("elevation", [-1.5, -0.5, -0.1])
def test_calm_water_is_a_plane(elevation):
    waves, calm = rough_sea(0.0, level=0.5)
    found = sea_distance(waves, calm[0], T, np.array([3.0, 4.0, 2.5]), unit(1.0, elevation), 0.1, FAR)
    assert found == pytest.approx(2.0 / math.sin(-elevation), rel=1e-12)


def test_the_sea_grows_with_its_ramp():
    waves, rough = rough_sea(1.0, tau=1e9)
    found = sea_distance(waves, rough[0], T, np.array([0.0, 0.0, 2.0]), unit(0.0, -0.5), 0.1, FAR)
    assert found == pytest.approx(2.0 / math.sin(0.5), rel=1e-6)


@pytest.mark.parametrize("gain", [0.0, 1.0])
def test_rays_upward_beyond_the_range_or_from_under_water_do_not_return(gain):
    waves, rough = rough_sea(gain)
    for height, elevation in ((2.0, 0.5), (5.0, -0.001), (-3.0, -0.5), (-3.0, 0.5)):
        origin = np.array([0.0, 0.0, height])
        assert sea_distance(waves, rough[0], T, origin, unit(0.5, elevation), 0.1, FAR) == math.inf
