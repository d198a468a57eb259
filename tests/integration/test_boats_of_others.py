"""Boats of which a URDF alone is known float where Archimedes says, and stay there."""

import warnings

import numpy as np
import pytest
import trimesh

from urdf_boats import joint, link
from vrx_mj import Simulation, VrxWarning, compile_world

RHO = 997.8
CALM = {"name": "calm", "sea": {"model": "none"}}
V_SHAPE = [[-2, -0.5, 0.6], [-2, 0.5, 0.6], [-2, -0.4, 0], [-2, 0.4, 0], [1, -0.5, 0.6], [1, 0.5, 0.6], [1, -0.3, 0],
           [1, 0.3, 0], [2.2, 0, 0.7], [1.8, 0, 0.2]]  # fmt: skip


def hull(kind):
    if kind == "catamaran":
        pair = [trimesh.creation.box((3, 0.25, 0.5)) for _ in "12"]
        pair[0].apply_translation((0, 0.7, 0))
        pair[1].apply_translation((0, -0.7, 0))
        return trimesh.util.concatenate(pair)
    if kind == "v-shaped":
        return trimesh.convex.convex_hull(np.array(V_SHAPE))
    return trimesh.creation.box((4, 1, 0.6))


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def inertial(mass, center, beam, length):
    x, y, z = center
    moments = f'<inertia ixx="{mass * beam**2 / 8}" iyy="{mass * length**2 / 12}" izz="{mass * length**2 / 12}"/>'
    return f'<inertial><origin xyz="{x} {y} {z}"/><mass value="{mass}"/>{moments}</inertial>'


def floating(folder, boats, seconds=25.0):
    """What is seen of boats, each a URDF and the height at which it is put into the water."""
    entries = []
    for index, (name, (text, height)) in enumerate(boats.items()):
        (folder / f"{name}.urdf").write_text(text, encoding="utf-8")
        entries.append({"name": name, "robot": f"{name}.urdf", "pose": [8 * index, 0, height, 0, 0, 0]})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", VrxWarning)
        sim = Simulation(compile_world(CALM, fleet={"boats": entries}))
    sim.step({}, duration=seconds)
    return sim.observe()


@pytest.mark.slow
def test_closed_meshes_float_at_archimedes_draft_wherever_their_base_link_is(folder):
    """Against the level that trimesh cuts; the lift's g is 0.15 % too large, and some heave is left."""
    boats, expected = {}, {}
    for kind in ("barge", "catamaran", "v-shaped"):
        for place in ("keel", "deck"):
            name, made = f"{kind}_{place}".replace("-", "_"), hull(kind)
            low, high = made.bounds[:, 2]
            made.apply_translation((0, 0, -low if place == "keel" else -high))
            made.export(folder / f"{name}.stl")
            low, high = made.bounds[:, 2]
            mass, level = 0.4 * RHO * made.volume, level_of(made, 0.4)
            wet = made.slice_plane([0, 0, level], [0, 0, -1], cap=True)
            shape = f'<collision><geometry><mesh filename="{name}.stl"/></geometry></collision>'
            beam, length = np.ptp(made.vertices[:, 1]), np.ptp(made.vertices[:, 0])
            text = f"{inertial(mass, wet.center_mass, beam, length)}{shape}"
            boats[name] = f'<robot name="b"><link name="base_link">{text}</link></robot>', 0.05 - level
            expected[name] = -level, high - low
    seen = floating(folder, boats)
    for name, (height, tall) in expected.items():
        assert seen[name].position[2] == pytest.approx(height, abs=0.01 * tall), name
        assert max(abs(seen[name].roll), abs(seen[name].pitch)) < 0.03, name


def level_of(made, share):
    low, high = made.bounds[:, 2]
    for _ in range(40):
        middle = (low + high) / 2
        cut = made.slice_plane([0, 0, middle], [0, 0, -1], cap=True)
        low, high = (middle, high) if cut.volume < share * made.volume else (low, middle)
    return low


def test_a_hull_in_pieces_on_joints_that_are_held_floats_upright(folder):
    """As usv_sim's sailboat is made: pieces on revolute joints from 0 to 0, a deep keel, a sail that nothing steers."""
    box = '<collision><origin xyz="{0}"/><geometry><box size="{1}"/></geometry></collision>'

    def piece(mass, at, size):
        return inertial(mass, [float(value) for value in at.split()], 0.8, 1.5) + box.format(at, size)

    def made(kind):
        held = {"kind": kind, "limits": (0, 0) if kind == "revolute" else None}
        return "".join([
            '<robot name="b"><link name="base_link">', piece(5, "0.1 0.13 -0.06", "0.54 0.24 0.3"), "</link>",
            '<link name="right">', piece(5, "0.1 -0.13 -0.06", "0.54 0.24 0.3"), "</link>", joint("a", "right", **held),
            '<link name="stern">', piece(10, "0 0 -0.06", "0.4 0.48 0.3"), "</link>",
            joint("b", "stern", xyz="-0.35 0 0", **held),
            link("keel", 30), joint("c", "keel", xyz="0 0 -0.35", **held), "</robot>",
        ])  # fmt: skip

    seen = floating(folder, {kind: (made(kind), 0.1) for kind in ("revolute", "fixed")})
    assert seen["revolute"].position[2] == pytest.approx(seen["fixed"].position[2], abs=1e-12)
    for boat in seen.values():
        assert np.linalg.norm(boat.angular_velocity) < 0.5  # it still pitches a little
        assert abs(boat.roll) < 0.01
        assert abs(boat.pitch) < 0.15
