"""One boat, written as a URDF, as a xacro and as a model of Gazebo: it weighs, lies and floats alike."""

import warnings
from pathlib import Path

import numpy as np
import pytest

from vrx_mj import Simulation, VrxWarning, compile_world
from vrx_mj.config.fleet import Order
from vrx_mj.frames import compose
from vrx_mj.mjcf.boats import boat_mass, push_center
from vrx_mj.mjcf.build import build_boat

HULL = (2.0, 1.0, 0.4)
"""Size [m] of the box that floats."""
ARM = (-0.3, 0.2, 0.4, 0.3, -0.2, 1.0)
"""Pose of a mast in the hull, and that of a motor in the mast: neither lies along the hull's axes."""
MOTOR = (-0.1, -0.05, -0.6, 0.2, 0.1, -0.7)
MOMENTS = {"base_link": (120.0, 12.0, 30.0, 36.0), "mast": (8.0, 1.0, 1.2, 0.5), "motor": (3.0, 0.02, 0.03, 0.015)}
"""Mass [kg] and moments of inertia [kg m2] of each link."""


def words(values):
    return " ".join(map(repr, values))


def urdf(size):
    parts = []
    for name, (mass, *moments) in MOMENTS.items():
        box = f'<collision><geometry><box size="{size}"/></geometry></collision>' if name == "base_link" else ""
        tensor = " ".join(f'i{axis}{axis}="{value}"' for axis, value in zip("xyz", moments, strict=True))
        inertial = (
            f'<inertial><origin xyz="0.1 0 0" rpy="0 0.3 0"/><mass value="{mass}"/><inertia {tensor}/></inertial>'
        )
        parts.append(f'<link name="{name}">{inertial}{box}</link>')
    for (parent, child), pose in {("base_link", "mast"): ARM, ("mast", "motor"): MOTOR}.items():
        origin = f'<origin xyz="{words(pose[:3])}" rpy="{words(pose[3:])}"/>'
        ends = f'<parent link="{parent}"/><child link="{child}"/>'
        parts.append(f'<joint name="{child}_joint" type="fixed">{origin}{ends}</joint>')
    return "".join(parts)


def model():
    """As SDF has it: all poses in the model's frame, and the motor's joint with a pose of its own."""
    parts = []
    places = {"base_link": (0.0,) * 6, "mast": ARM, "motor": compose(ARM, MOTOR)}
    for name, (mass, *moments) in MOMENTS.items():
        tensor = "".join(f"<i{axis}{axis}>{value}</i{axis}{axis}>" for axis, value in zip("xyz", moments, strict=True))
        shape = f'<collision name="box"><geometry><box><size>{words(HULL)}</size></box></geometry></collision>'
        parts.append(
            f'<link name="{name}"><pose>{words(places[name])}</pose><inertial><pose>0.1 0 0 0 0.3 0</pose>'
            f"<mass>{mass}</mass><inertia>{tensor}</inertia></inertial>{shape if name == 'base_link' else ''}</link>"
        )
    for parent, child in (("base_link", "mast"), ("mast", "motor")):
        pose = "<pose>0.1 0.2 0.3 0.4 0.5 0.6</pose>" if child == "motor" else ""
        parts.append(
            f'<joint name="{child}_joint" type="fixed">{pose}<parent>{parent}</parent><child>{child}</child></joint>'
        )
    return f'<sdf version="1.9"><model name="boat">{"".join(parts)}</model></sdf>'


@pytest.fixture
def files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    xacro = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
    size = f'<xacro:property name="beam" value="{HULL[1]}"/>'
    texts = {
        "boat.urdf": f'<robot name="boat">{urdf(words(HULL))}</robot>',
        "boat.urdf.xacro": (
            f'<robot name="boat" {xacro}>{size}{urdf(f"{HULL[0]} ${{beam}} {HULL[2]}")}</robot>'
        ),
        "boat.sdf": model(),
    }  # fmt: skip
    for name, text in texts.items():
        Path(name).write_text(text, encoding="utf-8")
    return texts


def numbers(config):
    """All numbers of the floats and drags that were derived, in one list."""
    points = [point for hull in config.hulls for point in hull.points]
    values = config.model_dump(exclude={"hulls"}).values()
    return np.concatenate([np.ravel(value).astype(float) for value in (*values, points)])


@pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
def test_one_boat_in_three_formats_weighs_and_floats_alike(files):
    boats = {name: build_boat(Order(robot=f"./{name}", folder=Path.cwd())) for name in files}
    one, *others = boats.values()
    assert boat_mass(one).mass == sum(mass for mass, *_ in MOMENTS.values())
    for other in others:
        for name in ("mass", "center", "inertia"):
            assert getattr(boat_mass(other), name) == pytest.approx(getattr(boat_mass(one), name), rel=1e-9, abs=1e-9)
        assert push_center(other) == pytest.approx(push_center(one), abs=1e-9)
        for part, same in zip(other.parts, one.parts, strict=True):
            assert part.pose == pytest.approx(same.pose, abs=1e-9)
        assert numbers(other.hydrodynamics) == pytest.approx(numbers(one.hydrodynamics), rel=1e-9, abs=1e-12)


def test_one_boat_in_three_formats_lies_alike_after_a_while(files):
    """Its mast and motor make it heel."""
    states = []
    for name in files:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", VrxWarning)
            boats = [{"name": "boat", "robot": f"./{name}", "pose": [0, 0, 0.15, 0, 0, 0]}]
            sim = Simulation(compile_world({"name": "calm", "sea": {"model": "none"}}, fleet={"boats": boats}))
        sim.step({}, duration=20.0)
        boat = sim.observe()["boat"]
        states.append([*boat.position, boat.roll, boat.pitch])
    assert abs(states[0][3]) > 0.01
    assert states[1] == pytest.approx(states[0], abs=1e-9)
    assert states[2] == pytest.approx(states[0], abs=1e-9)
