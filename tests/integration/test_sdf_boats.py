"""Boats written as models of Gazebo: they float, go as fast as their coefficients let them, and measure."""

import math
import warnings
from pathlib import Path

import numpy as np
import pytest

from sdf_boats import BOATS, link, sdf, spinning, thruster
from urdf_boats import joint
from urdf_boats import link as urdf_link
from vrx_mj import Simulation, VrxWarning, compile_world
from vrx_mj.formats.gazebo.importing import import_files
from vrx_mj.formats.urdf.reader import read_urdf
from vrx_mj.ros.table.boats import description

CALM = {"name": "calm", "sea": {"model": "none"}}


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def afloat(robot, pose=(0, 0, 0.05, 0, 0, 0), **world):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", VrxWarning)
        boats = [{"name": "boat", "robot": robot, "pose": list(pose)}]
        return Simulation(compile_world({**CALM, **world}, fleet={"boats": boats}))


def written(name):
    Path(f"{name}.sdf").write_text(BOATS[name](), encoding="utf-8")
    return f"{name}.sdf"


def terminal(thrust, linear, quadratic):
    """Speed [m/s] at which a drag equals the thrust [N]."""
    return (math.sqrt(linear**2 + 4.0 * quadratic * thrust) - linear) / (2.0 * quadratic)


@pytest.mark.parametrize("name", BOATS)
def test_a_boat_of_an_sdf_floats_upright(name):
    """For 5 s after 10 s its height stays within 2 cm: the lightest damped, the raft, still heaves by 1 cm."""
    sim = afloat(written(name))
    sim.step({}, duration=10.0)
    heights = []
    for _ in range(10):
        sim.step({}, duration=0.5)
        boat = sim.observe()["boat"]
        heights.append(boat.position[2])
        assert abs(boat.roll) < 0.001
        assert abs(boat.pitch) < 0.03
        assert np.hypot(*boat.position[:2]) < 0.1
    assert np.ptp(heights) < 0.02


THRUSTS = {"catamaran": 2 * 60.0, "skiff": 2 * 70.0 * 0.5, "classic": 2 * 45.0, "outboard": 80.0}
"""Largest thrust [N] of each that gives its drag: 12 N s/m and 25 N s2/m2."""


@pytest.mark.parametrize("name", THRUSTS)
def test_a_boat_of_an_sdf_goes_as_fast_as_its_coefficients_say(name):
    """Along its own way: thrust below the centre of mass trims it by up to 0.05 rad, whose cosine is 0.999."""
    sim = afloat(written(name))
    full = {name: 1.0 for name in sim.command_names("boat") if not name.endswith("_angle")}
    sim.step({"boat": full}, duration=60.0)
    boat = sim.observe()["boat"]
    assert np.hypot(*boat.velocity[[0, 2]]) == pytest.approx(terminal(THRUSTS[name], 12.0, 25.0), rel=5e-3)
    assert boat.position[0] > 50.0
    assert abs(boat.position[1]) < 1e-3


def test_commands_are_newtons_in_a_world_of_vrx_3():
    sim = afloat(written("outboard"), physics={"profile": "vrx3"})
    sim.step({"boat": {"main": 40.0}}, duration=60.0)
    assert np.hypot(*sim.observe()["boat"].velocity[[0, 2]]) == pytest.approx(terminal(40.0, 12.0, 25.0), rel=5e-3)


def test_engines_that_steer_turn_the_boat():
    """The stern goes to starboard, and the bow to port, where the thrust points to starboard."""
    for name, engines in {"outboard": ("main",), "catamaran": ("left", "right")}.items():
        turned = {}
        for angle in (-0.5, 0.5):
            sim = afloat(written(name))
            command = {key: value for one in engines for key, value in ((one, 0.5), (f"{one}_angle", angle))}
            sim.step({"boat": command}, duration=3.0)
            turned[angle] = sim.observe()["boat"].angular_velocity[2]
        assert turned[-0.5] > 0.05, name
        assert turned[0.5] == pytest.approx(-turned[-0.5], rel=1e-6), name


def test_sensors_of_an_sdf_measure():
    for name in ("catamaran", "skiff", "classic", "outboard"):
        sim = afloat(written(name))
        sim.step({}, duration=5.0)
        found = sim.observe()["boat"].sensors
        assert set(found) == {"imu", "navsat", "camera", "scan"}, name
        assert found["imu"].data.linear_acceleration[2] == pytest.approx(9.8, abs=0.3), name


def both(steered):
    """A boat as an SDF, with poses in the frames of the links above, and the same as a URDF."""
    size = "<box><size>1.4 0.8 0.3</size></box>"
    shape = f'<collision name="hull"><geometry>{size}</geometry></collision>'
    plugin = thruster("drive", 60)
    above = ' relative_to="base_link"'
    middle = "engine" if steered else "base_link"
    parts = [link("base_link", 50.0, (4.0, 8.0, 10.0), shape)]
    hull = '<collision name="hull"><geometry><box size="1.4 0.8 0.3"/></geometry></collision>'
    inertial = '<inertial><mass value="50.0"/><inertia ixx="4" iyy="8" izz="10"/></inertial>'
    urdf = [f'<link name="base_link">{inertial}{hull}</link>']
    if steered:
        limits = "<limit><lower>-1</lower><upper>1</upper><effort>7</effort><velocity>0.5</velocity></limit>"
        ends = "<parent>base_link</parent><child>engine</child>"
        parts += [
            link("engine", 1, (1, 1, 1), pose="-0.7 0 0.1 0 0.05 0", attributes=above),
            f'<joint name="steer" type="revolute">{ends}<axis><xyz>0 0 1</xyz>{limits}</axis></joint>',
        ]
        urdf += [urdf_link("engine"), joint("steer", "engine", xyz="-0.7 0 0.1", rpy="0 0.05 0", limits=(-1, 1))]
    here = f' relative_to="{middle}"'
    parts += [link("screw", 1, (1, 1, 1), pose="-0.1 0.02 -0.3 0 0 0.1", attributes=here),
              spinning("drive", middle, "screw"), plugin]  # fmt: skip
    urdf += [urdf_link("screw"), joint("drive", "screw", middle, "continuous", "-0.1 0.02 -0.3", "0 0 0.1", "1 0 0",
                                       limits=None), f"<gazebo>{plugin}</gazebo>"]  # fmt: skip
    return sdf("boat", *parts), "\n".join(['<robot name="boat">', *urdf, "</robot>"])


@pytest.mark.parametrize("steered", [False, True])
@pytest.mark.parametrize("engines", ["fixed", "hinged"])
def test_a_boat_is_the_same_in_an_sdf_and_in_a_urdf(steered, engines):
    """The MJCF is the same to the letter, and so are the bits of a run."""
    seen = []
    for name, text in zip(("boat.sdf", "boat.urdf"), both(steered), strict=True):
        Path(name).write_text(text, encoding="utf-8")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", VrxWarning)
            fleet = {"boats": [{"name": "boat", "robot": name, "pose": [1, 2, 0.1, 0, 0, 0.3]}], "engines": engines}
            world = compile_world("ocean", fleet=fleet, seed=3)
        sim = Simulation(world)
        sim.step({"boat": {"screw": 0.7} | ({"screw_angle": 0.4} if steered else {})}, duration=5.0)
        seen.append((world.mjcf.replace(name, "boat"), sim.data.qpos.tobytes(), sim.data.qvel.tobytes()))
    assert seen[0] == seen[1]


@pytest.mark.parametrize("name", BOATS)
def test_an_imported_boat_moves_as_the_one_that_it_is_made_of(name):
    """The URDF that the import writes has every number to the last bit."""
    texts = import_files(Path(written(name))).texts
    for path, text in texts.items():
        Path(path).parent.mkdir(parents=True, exist_ok=True)
        Path(path).write_text(text, encoding="utf-8")
    seen = []
    for robot in (f"{name}.sdf", f"robots/{name}.urdf"):
        sim = afloat(robot)
        command = dict.fromkeys(sim.command_names("boat"), 0.3)
        sim.step({"boat": command}, duration=5.0)
        seen.append((sim.data.qpos.tobytes(), sim.data.qvel.tobytes(), list(sim.observe()["boat"].sensors)))
    assert seen[0] == seen[1]
    assert texts[f"{name}_fleet.yaml"].endswith(f'robot: "./robots/{name}.urdf"\n')


WORLD = """<sdf version="1.9"><world name="bay">
<include><uri>model://skiff</uri><name>alpha</name><pose>1 2 0.1 0 0 0.5</pose></include>
{inline}
</world></sdf>"""


def test_boats_in_a_world_of_gazebo_are_its_fleet():
    """One is included and one is written into the world; a fleet that is given takes their place."""
    Path("skiff").mkdir()
    Path("skiff/model.sdf").write_text(BOATS["skiff"](), encoding="utf-8")
    model = "\n".join(BOATS["outboard"]().splitlines()[1:-1]).replace(">", "><pose>-5 0 0.1 0 0 0</pose>", 1)
    Path("bay.sdf").write_text(WORLD.format(inline=model), encoding="utf-8")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", VrxWarning)
        world, other = compile_world("bay.sdf"), compile_world("bay.sdf", fleet="usv_config")
    assert list(other.boats) == ["wamv1", "wamv2", "wamv3"]
    sim = Simulation(world)
    seen = sim.observe()
    assert seen["alpha"].position == pytest.approx((1.0, 2.0, 0.1))
    assert seen["outboard"].position == pytest.approx((-5.0, 0.0, 0.1))
    assert sim.command_names("alpha")[:2] == ("motor_port", "motor_stbd")
    before = seen["outboard"].position[0]
    sim.step({"outboard": {"main": 60.0}}, duration=5.0)
    assert sim.observe()["outboard"].position[0] > before + 3.0


LAUNCH = """<launch>
<include file="$(find gazebo_ros)/launch/empty_world.launch">
<arg name="world_name" value="$(find vrx_gazebo)/worlds/example_course.world"/></include>
<node name="s" pkg="gazebo_ros" type="spawn_model" args="-sdf -file skiff.sdf -model alpha -x -500 -y 180 -z 0.1"/>
</launch>"""


def test_a_launch_file_spawns_a_boat_of_an_sdf_and_programs_get_its_urdf():
    written("skiff")
    Path("a.launch").write_text(LAUNCH, encoding="utf-8")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", VrxWarning)
        world = compile_world("a.launch")
        made = import_files(Path("a.launch")).texts
    assert list(world.boats) == ["alpha"]
    assert made.keys() == {"robots/skiff.urdf", "a_fleet.yaml"}
    robot = read_urdf(description(world, "alpha"), Path("alpha.urdf"))
    assert list(robot.links) == ["base_link", "motor_port_link", "motor_stbd_link"]
    assert Simulation(world).observe()["alpha"].position == pytest.approx((-500.0, 180.0, 0.1))
