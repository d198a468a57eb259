"""Worlds of profile vrx3: VRX 3's boat, commands, wind, objects and shots, and what stays as in classic worlds."""

import math
import warnings

import numpy as np
import pytest
import yaml

import vrx_mj
from integration.sailing import CALM, boats, object_kinds, same_bits
from integration.vrx3_worlds import BREEZE, MOST, sailing
from vrx_mj.config.world import load_world
from vrx_mj.errors import VrxWarning
from vrx_mj.frames import rotation_matrix
from vrx_mj.model.world import tree_of
from vrx_mj.packages import root

JAGGED = {"gain": 2.0, "period": 2.0, "direction": [1.0, 0.0]}
"""The roughest sea of VRX 2023."""

TUB = """<robot name="raft"><link name="base_link">
  <inertial><mass value="15"/><inertia ixx="0.4" iyy="1" izz="1.3" ixy="0" ixz="0" iyz="0"/></inertial>
  <collision><geometry><box size="0.9 0.45 0.3"/></geometry></collision>
</link></robot>"""

# Defaults


def test_a_world_of_the_profile_has_vrx_3s_defaults():
    world = load_world({"physics": {"profile": "vrx3"}})
    assert (world.physics.timestep, world.physics.gravity, world.sea.scale) == (0.004, 9.8, 1.1)
    assert world.physics.at_base_link == ("pinger",)


def test_what_a_world_says_counts_more():
    physics = {"profile": "vrx3", "timestep": 0.002, "at_base_link": []}
    world = load_world({"physics": physics, "sea": {"scale": 1.4, "gain": 0.2}})
    assert (world.physics.timestep, world.physics.at_base_link, world.sea.scale) == (0.002, (), 1.4)


def test_classic_worlds_keep_theirs():
    world = load_world({"physics": {"profile": "vrx"}})
    assert (world.physics.timestep, world.sea.scale) == (0.01, 1.5)
    assert world.physics.at_base_link == ("pinger",)


# Commands


@pytest.mark.parametrize(("command", "force"), [(200.0, 200.0), (5000.0, MOST), (-5000.0, -1000.0), (0.0, 0.0)])
def test_a_command_is_newtons_within_the_limits(command, force):
    sim = sailing(fleet=boats((0.0, 0.0, 0.0)))
    sim.command("a", left=command, right=command)
    sim.advance(1)
    assert list(sim._live.arrays.thruster_state["thrust"]) == [force, force]
    assert np.linalg.norm(sim.forces("a")["thrust"][:3]) == pytest.approx(2 * abs(force))


def test_a_command_holds_until_the_next():
    sim = sailing()
    sim.command("a", left=300.0, right=300.0)
    sim.advance(250 * 30)
    assert np.linalg.norm(sim.forces("a")["thrust"][:3]) == pytest.approx(600.0)
    sim.command("a", left=0.0)
    sim.advance(1)
    assert np.linalg.norm(sim.forces("a")["thrust"][:3]) == pytest.approx(300.0)


def test_without_a_command_nothing_pushes():
    sim = sailing()
    sim.advance(10)
    assert not sim.forces("a")["thrust"].any()


@pytest.mark.parametrize("profile", ["vrx", "vrx3", "marine"])
def test_a_robot_of_any_profile_may_take_newtons(profile, tmp_path):
    (tmp_path / "raft.urdf").write_text(TUB, encoding="utf-8")
    engine = {"propeller": "base_link", "mapping": "newtons", "max_force_forward": 6, "max_force_reverse": -4}
    raft = {"urdf": str(tmp_path / "raft.urdf"), "thrusters": {"screw": engine}}
    (tmp_path / "raft.yaml").write_text(yaml.safe_dump(raft), encoding="utf-8")
    fleet = {"boats": [{"name": "a", "robot": str(tmp_path / "raft.yaml"), "pose": [0, 0, 0, 0, 0, 0]}]}
    with warnings.catch_warnings(action="ignore", category=VrxWarning):  # of what the sheet of the hull is derived from
        world = vrx_mj.compile_world({"sea": CALM, "physics": {"profile": profile}}, fleet=fleet)
    assert world.parameters.thrusters[0].command_limits == (-4.0, 6.0)
    sim = vrx_mj.Simulation(world)
    for command, force in ((3.0, 3.0), (20.0, 6.0), (-20.0, -4.0)):
        sim.command("a", screw=command)
        sim.advance(1)
        assert sim.forces("a")["thrust"][0] == pytest.approx(force, rel=1e-6)


def test_engines_steer_as_far_as_their_joints():
    sim = sailing()
    sim.command("a", left_angle=3.5)
    sim.advance(500)
    assert sim._live.arrays.thruster_state["angle"][0] == pytest.approx(3.14159, abs=1e-4)


@pytest.mark.parametrize("profile", ["vrx", "vrx3"])
def test_a_teams_own_files_work_in_both_profiles(profile, monkeypatch):
    monkeypatch.chdir(root() / "assets" / "start")
    fleet = {"thrusters": "./thruster_config.yaml", "components": "./component_config.yaml"}
    fleet["boats"] = [{"name": "a", "pose": [0, 0, 0, 0, 0, 0]}]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", VrxWarning)
        sim = vrx_mj.Simulation(vrx_mj.compile_world({"physics": {"profile": profile}, "sea": CALM}, fleet=fleet))
    full = 1.0 if profile == "vrx" else MOST
    sim.step({"a": {name: full for name in sim.command_names("a") if not name.endswith("_angle")}}, duration=10.0)
    assert sim.observe()["a"].speed > (1.5 if profile == "vrx" else 4.0)


@pytest.mark.parametrize(("robot", "limits"), [("skiff", (120, -60)), ("cora", (120000, -50000))])
def test_a_robot_that_says_nothing_pushes_with_its_own_limits(robot, limits):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", VrxWarning)
        sim = sailing(fleet={"robot": robot, "sensors": "none", "boats": [{"name": "a", "pose": [0, 0, 0, 0, 0, 0]}]})
    name = sim.command_names("a")[0]
    for command, force in ((1e9, limits[0]), (-1e9, limits[1]), (7.0, 7.0)):
        sim.step({"a": {name: command}})
        assert sim._live.arrays.thruster_state["thrust"][0] == force


def test_a_rudder_still_steers():
    sim = sailing(fleet={"robot": "skiff", "sensors": "none", "boats": [{"name": "a", "pose": [0, 0, 0, 0, 0, 0]}]})
    sim.step({"a": {"propeller": 60.0, "rudder_angle": 0.3}}, duration=10.0)
    assert sim.observe()["a"].heading < -0.2


# Wind


def test_the_wind_pushes_a_boat_that_lies_across_as_one_that_heads_up():
    first, second = (sailing(CALM, BREEZE, boats((0.0, 0.0, yaw))).forces("a")["wind"][:3] for yaw in (0.0, 1.3))
    assert first == pytest.approx(second, rel=1e-12)
    assert first == pytest.approx((-0.5 * 3.5**2, 0.5 * (7 * math.sin(math.radians(120))) ** 2, 0))


def test_gusts_are_the_same_when_asked_for_and_when_sailed():
    sim = sailing(CALM, {**BREEZE, "var_gain": 2.0})
    speeds = []
    for _ in range(50):
        sim.advance(1)
        speeds.append(sim._live.arrays.wind_state["speed"][0])
    told = sim.wind.velocity(0.004 * np.arange(1, 51))
    assert np.hypot(told[:, 0], told[:, 1]) == pytest.approx(speeds)


# Objects

FLOATING = [name for name, kind in object_kinds().items() if kind == "floating"]
SPACING = 25.0


def afloat(profile, sea, timestep=0.004, **more):
    """Every floating object of the catalogue in one world, somewhat heeled; none swims."""
    things = [
        {"name": f"item{k}", "model": name, "pose": [SPACING * k, 40.0, 0.2, 0.2, -0.1, 0.3], "path": None}
        for k, name in enumerate(FLOATING)
    ]
    text = {"physics": {"profile": profile, "timestep": timestep}, "sea": sea, "objects": things, **more}
    return vrx_mj.Simulation(vrx_mj.compile_world(text, fleet=boats((0.0, 0.0, 0.3), (0.0, -40.0, 2.0))))


@pytest.mark.slow
def test_everything_that_floats_is_stable_in_the_roughest_sea():
    sim = afloat("vrx3", JAGGED, wind=BREEZE)
    highest = 0.0
    for _ in range(60):
        sim.step({"a": {"left": MOST, "right": MOST}, "b": {"left": -1000.0, "right": MOST}}, duration=1.0)
        for k, name in enumerate(FLOATING):
            item = sim.observe_object(f"item{k}")
            assert abs(item.position[2]) < 2.0, name
            assert np.abs(item.velocity).max() < 5.0, name
            assert np.abs(item.angular_velocity).max() < 10.0, name
            highest = max(highest, abs(item.position[2]))
        for boat in sim.boats:
            seen = sim.observe()[boat]
            assert max(abs(seen.roll), abs(seen.pitch)) < 0.6, boat
            assert abs(seen.position[2]) < 1.0, boat
    assert highest > 0.2


def test_in_calm_water_objects_move_as_in_classic_worlds():
    """One flat plane, whoever looks at it where: to the last bit."""
    one, other = (afloat(profile, CALM) for profile in ("vrx", "vrx3"))
    for sim in (one, other):
        sim.advance(2000)
    for number, name in enumerate(FLOATING):
        first, second = (sim.observe_object(f"item{number}") for sim in (one, other))
        for field in ("position", "quaternion", "velocity", "angular_velocity"):
            assert same_bits(getattr(first, field), getattr(second, field)), name


RAFT = """
mass: 300
inertia: [100, 2000, 2000]
buoyancy:
  linear_drag: 5
  angular_drag: 2
  elements:
    - {type: sphere, radius: 0.5, pose: [-5, 0, 0, 0, 0, 0]}
    - {type: sphere, radius: 0.5, pose: [5, 0, 0, 0, 0, 0]}
"""


def test_a_raft_leans_with_waves_that_one_of_classic_worlds_does_not_feel(tmp_path, monkeypatch):
    """Two floats 10 m apart in head waves: VRX 3 lifts each by the water above it."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "raft.yaml").write_text(RAFT, encoding="utf-8")
    leaning = {}
    for profile in ("vrx", "vrx3"):
        thing = {"name": "raft", "model": "./raft.yaml", "pose": [0, 0, 0, 0, 0, 0]}
        text = {"physics": {"profile": profile}, "sea": {"gain": 0.5, "period": 5.0}, "objects": [thing]}
        sim = vrx_mj.Simulation(vrx_mj.compile_world(text, fleet=boats((0.0, 60.0, 0.0))))
        sim.advance(round(30 / sim.timestep))
        pitch = []
        for _ in range(40):
            sim.advance(round(0.4 / sim.timestep))
            pitch.append(abs(sim.observe_object("raft").pitch))
        leaning[profile] = max(pitch)
    assert leaning["vrx3"] > 5 * leaning["vrx"]
    assert leaning["vrx3"] > 0.005


@pytest.mark.parametrize(("profile", "density"), [("vrx", 1000.0), ("vrx3", 997.0)])
def test_water_has_the_profiles_density_where_an_object_does_not_say(tmp_path, monkeypatch, profile, density):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "silent.yaml").write_text(RAFT, encoding="utf-8")
    (tmp_path / "salty.yaml").write_text(f"{RAFT}  fluid_density: 1025\n", encoding="utf-8")
    things = [{"name": name, "model": f"./{name}.yaml", "pose": [9, 9, 0, 0, 0, 0]} for name in ("silent", "salty")]
    world = vrx_mj.compile_world({"physics": {"profile": profile}, "objects": things})
    assert [row["density"] for row in tree_of(world.parameters)["floats"][:2]] == [density, 1025.0]


def test_a_run_goes_on_from_a_state_bit_for_bit():
    """The water that each element remembers is part of the state."""
    thing = {"name": "light", "model": "robotx_light_buoy", "pose": [9, 9, 0.3, 0, 0, 0]}
    sim = sailing(JAGGED, {**BREEZE, "var_gain": 1.0}, objects=[thing])
    sim.command("a", left=300.0, right=200.0)
    sim.advance(500)
    state = sim.get_state()
    sim.advance(500)
    whole = sim.get_state().sha256
    sim.advance(123)
    sim.set_state(state)
    sim.advance(500)
    assert sim.get_state().sha256 == whole


# Shots


def test_a_ball_leaves_with_six_and_a_half_metres_per_second_and_without_the_boats():
    fleet = {"boats": [{"name": "a", "pose": [0, 0, 0, 0, 0, 0]}], "sensors": ["ball_shooter"]}
    sim = sailing(fleet=fleet)
    sim.set_boat("a", velocity=(3.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    assert sim.fire("a")
    ball = sim.observe_object(sim._live.bodies.objects[0])
    half_a_step = 0.5 * sim.timestep * sim.model.opt.gravity
    velocity = rotation_matrix(ball.quaternion) @ ball.velocity + half_a_step
    assert np.linalg.norm(velocity) == pytest.approx(6.5)
