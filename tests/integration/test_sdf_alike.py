"""One hull as a URDF, as an SDF boat and as an SDF object: it weighs the same and floats as deep."""

import warnings
from pathlib import Path

import mujoco
import numpy as np
import pytest

import vrx_mj
from vrx_mj.errors import VrxWarning
from vrx_mj.formats.gazebo.sdf_boats import read_boat

DENSITY = 997.8
"""Of the water around boats of VRX [kg/m3]."""
HULL = (
    '<link name="hull"><inertial><mass>100</mass><inertia><ixx>10</ixx><iyy>30</iyy><izz>30</izz><ixz>0.5</ixz>'
    '<ixy>0.2</ixy></inertia></inertial><collision name="c"><geometry><box><size>2 1 0.4</size></box></geometry>'
    "</collision></link>"
)
SCREW = (
    '<link name="screw"><pose>0 0 -0.1 0.1 0 0</pose><inertial><mass>0.5</mass><inertia><ixx>0.01</ixx>'
    "<iyy>0.02</iyy><izz>0.01</izz></inertia></inertial></link>"
)
JOINT = '<joint name="drive" type="{}"><parent>hull</parent><child>screw</child><axis><xyz>1 0 0</xyz></axis></joint>'
THRUSTER = '<plugin filename="gz-sim-thruster-system" name="t"><joint_name>drive</joint_name></plugin>'
WATER = (
    f'<plugin filename="libbuoyancy_gazebo_plugin.so"><fluid_density>{DENSITY}</fluid_density><linear_drag>5'
    "</linear_drag><angular_drag>2</angular_drag><buoyancy><link_name>hull</link_name><geometry><box><size>2 1 0.4"
    "</size></box></geometry></buoyancy></plugin>"
)


def write(name, *parts):
    Path(name).mkdir()
    text = f'<sdf version="1.9"><model name="{name}">{"".join(parts)}</model></sdf>'
    Path(name, "model.sdf").write_text(text, encoding="utf-8")


def tensor(model, body):
    """Inertia of a body about its centre of mass, along its axes."""
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.body_iquat[body])
    axes = turn.reshape(3, 3)
    return axes @ np.diag(model.body_inertia[body]) @ axes.T


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
def test_a_hull_floats_alike_as_urdf_as_boat_and_as_object(tmp_path, monkeypatch):
    """The draft is m / (rho A) of a box: 0.2 m are above its middle."""
    monkeypatch.chdir(tmp_path)
    write("boat", HULL, SCREW, JOINT.format("continuous"), THRUSTER)
    write("thing", HULL, SCREW, JOINT.format("fixed"), WATER)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", VrxWarning)
        Path("boat.urdf").write_text(read_boat(Path("boat/model.sdf")).text, encoding="utf-8")
    boats = [{"name": "sdf", "robot": "./boat/model.sdf", "pose": [0, 0, 0, 0, 0, 0]},
             {"name": "urdf", "robot": "./boat.urdf", "pose": [0, 30, 0, 0, 0, 0]}]  # fmt: skip
    things = [{"name": "thing", "model": "./thing/model.sdf", "pose": [0, 60, 0, 0, 0, 0]}]
    world = {"sea": {"model": "none"}, "objects": things}
    sim = vrx_mj.Simulation(vrx_mj.compile_world(world, fleet={"boats": boats}))
    sim.step({}, duration=90.0)
    model = sim.model
    bodies = [model.body(name).id for name in ("sdf/hull", "urdf/hull", "thing/hull")]
    first = tensor(model, bodies[0])
    for body in bodies:
        assert model.body_mass[body] == pytest.approx(100.5, abs=1e-9)
        assert tensor(model, body) == pytest.approx(first, abs=1e-9)
        assert model.body_ipos[body] == pytest.approx(model.body_ipos[bodies[0]], abs=1e-12)
    depths = [float(sim.data.xpos[body][2]) for body in bodies]
    assert depths == pytest.approx([0.2 - 100.5 / (DENSITY * 2.0)] * 3, abs=1e-9)
