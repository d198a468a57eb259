"""Every robot of the catalogue floats, sails and senses."""

import importlib.util
import math
import re

import numpy as np
import pytest
import trimesh

import vrx_mj
from vrx_mj.config.fleet import Order
from vrx_mj.config.robots import load_robot
from vrx_mj.config.search import catalogue
from vrx_mj.mjcf.boats import boat_mass
from vrx_mj.mjcf.build import build_boat
from vrx_mj.mjcf.flotation import hull_sheet
from vrx_mj.packages import root

ROBOTS = sorted(catalogue("robots"))
ADRIFT = ("barge_10m", "barge_4m", "cylinder", "sphere")
SAILING = [robot for robot in ROBOTS if robot not in ADRIFT]
TURNING = ("otter", "otter_hydro")
"""Robots with Munk's moment and without skegs."""
FOSSEN = {"mass": 80.0, "center": 0.153125, "added": (5.5, 82.5), "surge": 77.5544, "sway": 162.5, "yaw": 42.65137}
"""The Otter about its origin, in SI units, of otter.py: place of the centre of mass, added mass, linear damping."""
FOLDER = root() / "assets" / "robots"
SYDNEY = {"latitude": -33.724223, "longitude": 150.679736}


def calm(robot):
    """One boat in still water, at rest there."""
    world = {"physics": {"profile": "vrx"}, "sea": {"model": "none"}, "georeference": SYDNEY}
    fleet = {"robot": robot, "boats": [{"name": "a", "pose": [0, 0, 0, 0, 0, 0]}]}
    sim = vrx_mj.Simulation(vrx_mj.compile_world(world, fleet=fleet))
    sim.step({}, duration=20.0)
    return sim


def all_ahead(sim, power=0.5):
    """Commands of the thrusters that push ahead."""
    thrusters = sim.observe()["a"].thrusters.items()
    return {"a": {name: power for name, thruster in thrusters if thruster.direction[0] > 0.5}}


def test_the_robots_are_those_of_the_documents():
    page = (root() / "docs" / "robots.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (`[^|]+) \|", page.partition("### Examples")[2], re.MULTILINE)
    assert sorted({name for row in rows for name in re.findall(r"`(\w+)`", row)}) == ROBOTS


@pytest.mark.parametrize("robot", SAILING)
def test_a_robot_floats_upright_and_sails_ahead(robot):
    sim = calm(robot)
    rest = sim.observe()["a"]
    assert abs(rest.roll) < 0.02
    assert abs(rest.pitch) < 0.05
    assert -1.5 < rest.position[2] < 0.01  # the Kingfisher has the hulls of the Heron, and is lighter
    sim.step(all_ahead(sim), duration=10.0)
    sailed = sim.observe()["a"]
    assert sailed.velocity[0] > 0.5
    assert abs(sailed.heading) < 0.1


@pytest.mark.parametrize("robot", ROBOTS)
def test_every_command_of_a_robot_pushes_or_turns_something(robot):
    sim = marine(robot, {"model": "none"})
    for name in sim.command_names("a"):
        sim.reset()
        sim.step({"a": {name: 0.3}}, duration=0.1)
        pushed = bool(sim.forces("a")["thrust"].any())
        assert pushed is not name.endswith("_angle")
        assert any(sim.steering("a").values()) is name.endswith("_angle")


@pytest.mark.parametrize("robot", [robot for robot in SAILING if robot not in TURNING])
def test_a_robot_keeps_its_course_in_profile_marine(robot):
    """At equal thrust a small turn dies away, or stays as small."""
    sim = marine(robot, {"model": "none"})
    sim.set_boat("a", velocity=(0.0, 0.01, 0.0, 0.0, 0.0, 0.01))
    sim.step(all_ahead(sim, 1.0), duration=60.0)
    assert abs(sim.observe()["a"].angular_velocity[2]) < 2e-3


@pytest.mark.parametrize("robot", TURNING)
@pytest.mark.parametrize("over", [0.8, 1.2])
def test_the_otter_keeps_its_course_below_the_speed_of_its_coefficients(robot, over):
    """Yv (Nr + m xg U) = (m + A11) (A22 - A11) U2 there, with Munk's moment: 1.19 m/s."""
    mass, (surge, sway) = FOSSEN["mass"], FOSSEN["added"]
    square, once = (mass + surge) * (sway - surge), FOSSEN["sway"] * mass * FOSSEN["center"]
    critical = max(np.roots([square, -once, -FOSSEN["sway"] * FOSSEN["yaw"]]))
    assert critical == pytest.approx(1.188, abs=1e-3)
    sim = marine(robot, {"model": "none"})
    sim.set_boat("a", velocity=(over * critical, 0.0, 0.0, 0.0, 0.0, 0.001))
    sim.step(all_ahead(sim, over * critical * FOSSEN["surge"] / (2.0 * 119.682)), duration=40.0)
    turn = abs(sim.observe()["a"].angular_velocity[2])
    assert turn > 2e-3 if over > 1.0 else turn < 2e-4


@pytest.mark.parametrize("robot", ROBOTS)
def test_every_sensor_of_a_robot_reads(robot):
    sim = calm(robot)
    sensors = build_boat(Order(robot)).sensors
    assert sim.sensors("a") == tuple(sensor.name for sensor in sensors)
    for sensor in sensors:
        if sensor.type == "camera":
            continue  # needs a picture: tests/unit/sensors/test_camera.py
        reading = sim.sense("a")[sensor.name]
        assert (reading.type, reading.time) == (sensor.type, pytest.approx(20.0))
        if sensor.type == "imu":
            assert reading.data.linear_acceleration[2] == pytest.approx(9.8, abs=0.05)


def test_the_mast_stands_on_the_skiff_and_its_engine_pushes_it():
    boat = build_boat(Order("skiff"))
    assert [thruster.name for thruster in boat.thrusters] == ["propeller", "rudder"]
    assert math.fsum(part.inertial.mass for part in boat.parts if part.inertial) == 59.0  # and the rudder, 1 kg


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_skiff_s_rudder_turns_the_bow_to_starboard_when_positive(side):
    sim = calm("skiff")
    sim.step({"a": {"propeller": 0.8, "rudder_angle": 0.0}}, duration=5.0)
    sim.step({"a": {"propeller": 0.8, "rudder_angle": 0.3 * side}}, duration=3.0)
    seen = sim.observe()["a"]
    assert np.sign(seen.angular_velocity[2]) == -side
    assert abs(seen.angular_velocity[2]) > 0.1


def test_cora_weighs_what_vrx_s_weighs():
    sim = calm("cora")
    assert sim.model.body_subtreemass[sim.model.body("a/base_link").id] == pytest.approx(33004.65, abs=0.01)


def marine(robot, sea, pose=(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)):
    """One boat in a sea of profile `marine`, without wind."""
    world = {"physics": {"profile": "marine"}, "sea": sea, "wind": {"objects": []}}
    fleet = {"robot": robot, "boats": [{"name": "a", "pose": list(pose)}], "sensors": "none"}
    return vrx_mj.Simulation(vrx_mj.compile_world(world, fleet=fleet))


STILL = {"model": "none"}


def afloat(robot, profile, sea=STILL, n=1, **varied):
    """Rows with a boat put afloat, and its poses."""
    world = {"physics": {"profile": profile}, "sea": sea, "wind": {"objects": []}}
    fleet = {"robot": robot, "boats": [{"name": "a", "pose": [0] * 6}], "sensors": "none"}
    batch = vrx_mj.Batch(vrx_mj.compile_world(world, fleet=fleet), n, threads=1)
    batch.vary(**varied)
    batch.reset()
    poses, velocities = batch.afloat("a", (1.0, -2.0, 0.3))
    batch.set_boat("a", pose=poses, velocity=velocities)
    return batch, poses


def check_rest(robot, profile):
    """A boat put afloat on flat water, laden too, stays: without thrust, as VRX's is not 0 at command 0."""
    batch, _ = afloat(robot, profile, n=2, mass=[1.0, 1.3], thrust=0.0)
    began = batch.features.copy()
    for _ in range(10):
        batch.advance(round(1.0 / batch.timestep))
        np.testing.assert_allclose(batch.features[:, 0, :7], began[:, 0, :7], atol=1e-4)


@pytest.mark.parametrize("robot", ["heron", "otter"])
def test_a_boat_put_afloat_by_a_hull_of_its_own_does_not_move_by_itself(robot):
    check_rest(robot, "marine")


@pytest.mark.slow
def test_nor_does_any_robot_in_either_profile(subtests):
    for profile in ("vrx", "marine"):
        for robot in ROBOTS:
            with subtests.test(profile=profile, robot=robot):
                check_rest(robot, profile)


@pytest.mark.parametrize(("profile", "robot"), [("vrx", "skiff"), ("marine", "skiff"), ("marine", "otter")])
def test_a_boat_put_afloat_rides_its_row_s_sea(profile, robot):
    """On waves far longer than itself it floats as on flat water, as much higher as they are there."""
    sea = {"model": "regular", "height": 1.0, "period": 15.0}
    _, flat = afloat(robot, profile)
    batch, poses = afloat(robot, profile, sea, n=3, wave_phases=[[0.0], [2.0], [4.0]])
    heights = batch.sea_height(*poses[:, :2].T[..., None])[:, 0]
    assert np.ptp(heights) > 0.5
    np.testing.assert_allclose(poses[:, 2] - flat[0, 2], heights, atol=5e-3)


@pytest.mark.parametrize("robot", ["cora", "wamv"])
def test_up_to_its_greatest_mass_a_boat_with_a_hull_of_its_own_floats_and_beyond_it_does_not(robot):
    """The hull that floats is the one that is asked: of a WAM-V, 4.2 times the weight, and of VRX's floats, 2.2."""
    most = afloat(robot, "marine")[0].largest_masses[0]
    batch, poses = afloat(robot, "marine", n=2, mass=[0.98 * most, 1.02 * most])
    batch.advance(round(10.0 / batch.timestep))
    assert batch.features[0, 0, 2] == pytest.approx(poses[0, 2], abs=2e-3)
    assert batch.features[1, 0, 2] < batch.features[0, 0, 2] - 0.3


@pytest.mark.parametrize("robot", ["barge_10m", "barge_4m", "blueboat", "cylinder", "heron", "otter"])
def test_a_robot_floats_at_its_waterline_in_every_profile(robot):
    """Its origin is there, and the hull's keel as far below as its script says, within 2 mm."""
    for profile in ("vrx", "vrx3", "marine"):
        world = {"physics": {"profile": profile}, "sea": {"model": "none"}}
        sim = vrx_mj.Simulation(vrx_mj.compile_world(world, fleet={"robot": robot, "usv_count": 1}))
        sim.step({}, duration=60.0)
        assert sim.data.qpos[2] == pytest.approx(0.0, abs=2e-3), profile
        assert abs(sim.observe()["wamv1"].pitch) < 1e-3, profile


@pytest.mark.parametrize(("robot", "draft", "gm"), [
    ("barge_4m", 0.5, (2**2 / (12 * 0.5) - 0.25, 4**2 / (12 * 0.5) - 0.25)),
    ("barge_10m", 1.0, (4**2 / (12 * 1.0) - 1.0, 10**2 / (12 * 1.0) - 1.0)),
    ("cylinder", 0.5, (0.5**2 / (4 * 0.5) + 0.05, 0.5**2 / (4 * 0.5) + 0.05)),
])  # fmt: skip
def test_what_drifts_has_the_stiffness_of_its_closed_form(robot, draft, gm):
    """BM of a box: b^2 / 12 d; of a cylinder: r^2 / 4 d. Roll and pitch in a run, by the torque of a small angle."""
    sim, angle = marine(robot, STILL), 1e-3
    weight = 9.81 * float(sim.model.body_subtreemass[sim.model.body("a/base_link").id])
    for axis, arm in enumerate(gm):
        pose = [0.0] * 6
        pose[3 + axis] = angle
        sim.reset()
        sim.set_boat("a", pose=tuple(pose))
        sim.advance(1)
        own = sim.forces("a")["hydrostatics"][3 + axis]
        assert own == pytest.approx(-weight * arm * angle, rel=0.01), axis
    sim.reset()
    sim.step({}, duration=20.0)
    assert draft - sim.data.qpos[2] == pytest.approx(draft, abs=1e-3)


@pytest.mark.parametrize("robot", ADRIFT)
@pytest.mark.filterwarnings("ignore:robot sphere. 1.67 % of the sea's energy is in waves beyond 3.59 rad/s")
def test_what_drifts_rides_a_sea_of_state_3(robot):
    sim = marine(robot, {"model": "jonswap", "sea_state": 3, "components": 60})
    assert sim.command_names("a") == ()
    for _ in range(60):
        sim.step({}, duration=1.0)
        seen = sim.observe()["a"]
        assert max(abs(seen.roll), abs(seen.pitch)) < 0.6
        assert abs(sim.data.qpos[2]) < 1.5


@pytest.mark.parametrize(("robot", "draft"), [("heron", 0.12), ("blueboat", 0.0884)])
def test_the_sheet_of_a_hull_shows_a_stable_boat(robot, draft):
    """By the shapes and masses of the shipped files, in water of 1025 kg/m3."""
    boat = build_boat(Order(robot, profile="marine"))
    body = boat_mass(boat)
    triangles = []
    for shape in boat.hull.shapes:
        mesh = trimesh.load(FOLDER / robot / shape.file, process=False)
        assert mesh.is_watertight
        assert 100 <= len(mesh.faces) <= 350
        moved = np.array(mesh.triangles) * shape.scale + shape.pose[:3]
        triangles.append(moved if shape.scale[1] > 0 else moved[:, ::-1])
    sheet = hull_sheet(np.concatenate(triangles), body.mass, tuple(body.center), 1025.0, 9.81)
    assert sheet.draft == pytest.approx(draft, abs=1e-3)
    assert sheet.center_of_buoyancy[:2] == pytest.approx(body.center[:2], abs=1e-3)  # it floats level
    assert min(sheet.gm) > 1.0
    assert all(arm > 0.0 for heel, arm in sheet.righting_arms if 0.0 < heel < 80.0)


@pytest.mark.parametrize("robot", ["blueboat", "heron", "otter"])
def test_a_robot_turns_to_both_sides_alike_and_rides_a_sea_of_state_3(robot):
    rates = []
    for inner, outer in (("left", "right"), ("right", "left")):
        sim = marine(robot, STILL)
        sim.step({"a": {inner: 0.5, outer: 0.9}}, duration=10.0)
        seen = sim.observe()["a"]
        rates.append((seen.velocity[0], *seen.velocity[1:2], seen.angular_velocity[2]))
    (surge, sway, rate), (surge_other, sway_other, rate_other) = rates
    assert rate > 0.05  # more thrust on starboard turns to port
    assert (surge, -sway, -rate) == pytest.approx((surge_other, sway_other, rate_other), abs=1e-9)
    sim = marine(robot, {"model": "jonswap", "sea_state": 3, "components": 60})
    for _ in range(60):
        sim.step({"a": {"left": 0.6, "right": 0.6}}, duration=1.0)
        seen = sim.observe()["a"]
        assert max(abs(seen.roll), abs(seen.pitch)) < 0.8


def test_a_robot_that_extends_another_takes_the_hydro_file_of_that_one():
    file = root() / "assets" / "validation" / "worlds" / "iea_sphere" / "relative.yaml"
    found, base = load_robot(file.name, file.parent).hull, load_robot("sphere").hull
    assert (found.folder, found.hydro, found.diffraction) == (base.folder, "hydro.json", False)


def test_the_heron_is_as_fast_as_published():
    """22 and 24 N a side: 1.597 and 1.667 m/s, less 0.1 % of the drag in heave, by which it moves a little aslant."""
    for command, speed in ((0.9, 1.597), (1.0, 1.667)):
        sim = marine("heron", STILL)
        sim.step({"a": {"left": command, "right": command}}, duration=20.0)
        assert sim.observe()["a"].velocity[0] == pytest.approx(speed, rel=2e-3)


def test_the_blueboat_reaches_its_speed_and_keeps_its_course():
    sim = marine("blueboat", STILL, pose=(0, 0, 0, 0.01, 0, 0))
    sim.set_boat("a", velocity=(0.0, 0.1, 0.0, 0.0, 0.0, 0.05))
    sim.step({"a": {"left": 1.0, "right": 1.0}}, duration=40.0)
    seen = sim.observe()["a"]
    assert seen.velocity[0] == pytest.approx(3.0, rel=0.02)
    assert abs(seen.angular_velocity[2]) < 1e-4


def test_the_wamv_of_marine_floats_level_and_keeps_its_course():
    """Its hulls carry 298.8 kg with 0.135 m of draft, 0.48 deg by the bow: their volume is farther aft."""
    world = {"physics": {"profile": "marine"}, "sea": {"model": "none"}}
    fleet = {"robot": "wamv", "boats": [{"name": "a", "pose": [0, 0, -0.14, 0, 0, 0]}]}
    sim = vrx_mj.Simulation(vrx_mj.compile_world(world, fleet=fleet))
    sim.step({}, duration=20.0)
    rest = sim.observe()["a"]
    assert (sim.data.qpos[2], rest.pitch) == pytest.approx((-0.151, 0.0083), abs=5e-4)
    assert abs(rest.roll) < 1e-3
    sim.step({"a": {"left": 1.0, "right": 1.0}}, duration=30.0)
    sailed = sim.observe()["a"]
    assert sailed.velocity[0] == pytest.approx(2.24, abs=0.02)
    assert abs(sailed.angular_velocity[2]) < 1e-3
    assert sim.energy("a") == pytest.approx(2.0 * 2000.0 * 30.0)


def test_the_wamv_of_marine_rides_a_rough_sea():
    sea = {"model": "jonswap", "significant_height": 0.9, "peak_period": 4.5, "components": 60}
    world = {"physics": {"profile": "marine"}, "sea": sea}
    sim = vrx_mj.Simulation(vrx_mj.compile_world(world, fleet={"robot": "wamv", "usv_count": 1}))
    (boat,) = sim.boats
    heights, rolls = [], []
    for _ in range(600):
        sim.step({}, duration=0.1)
        seen = sim.observe()[boat]
        heights.append(sim.data.qpos[2] - sim.sea.height(seen.position[0], seen.position[1], sim.time))
        rolls.append(seen.roll)
    assert np.std(heights) < 0.1  # it follows waves that are long against it
    assert np.abs(rolls).max() < 0.6


@pytest.mark.parametrize("robot", ["blueboat", "cora", "heron", "otter", "skiff"])
def test_the_script_writes_the_hulls_that_are_shipped(robot, tmp_path):
    spec = importlib.util.spec_from_file_location("make_hulls", FOLDER / "make_hulls.py")
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    script.write_meshes(robot, tmp_path)
    written = sorted(tmp_path.iterdir())
    assert [path.name for path in written] == sorted(path.name for path in (FOLDER / robot / "meshes").glob("*.obj"))
    for path in written:
        assert path.read_bytes() == (FOLDER / robot / "meshes" / path.name).read_bytes()
