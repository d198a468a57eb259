"""Masses of what turns with engines, about an axis, and the stations of a hull."""

import math
import operator
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from urdf_boats import assemble, joint, link, thruster
from vrx_mj.config.dynamics import ThrusterConfig
from vrx_mj.config.fleet import Order
from vrx_mj.errors import CompileError
from vrx_mj.frames import rotation
from vrx_mj.mjcf.boats import axis_inertia, body_mass
from vrx_mj.mjcf.build import build_boat
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.mjcf.robots import station_rows, thruster_rows
from vrx_mj.rigid_bodies import combine, rigid, with_pose


def test_a_body_turns_about_an_axis_as_its_points_do():
    """Point masses, against the sum over them."""
    places, masses = np.array([[1.0, 2.0, 3.0], [-2.0, 0.5, 1.0], [0.0, -1.0, 4.0]]), np.array([1.0, 2.0, 5.0])
    whole = combine(rigid(m, place, (0.0, 0.0, 0.0)) for m, place in zip(masses, places, strict=True))
    assert axis_inertia(whole) == pytest.approx(sum(masses * (places[:, 0] ** 2 + places[:, 1] ** 2)))


def test_a_posed_part_has_the_same_bits_on_every_processor():
    """Sums of products one after the other: neither BLAS nor fused multiply-adds."""
    rng = np.random.default_rng(1)
    for _ in range(20):
        part, pose = rigid(2.0, rng.normal(size=3).tolist(), rng.normal(size=6).tolist()), rng.normal(size=6).tolist()
        turn, inertia = rotation(*pose[3:]), part.inertia.tolist()
        center = [sum(map(operator.mul, row, part.center.tolist())) + x for row, x in zip(turn, pose, strict=False)]
        pairs = [(j, k) for j in range(3) for k in range(3)]
        turned = [[sum(a[j] * inertia[j][k] * b[k] for j, k in pairs) for b in turn] for a in turn]
        posed = with_pose(part, pose)
        assert (posed.center.tolist(), posed.inertia.tolist()) == (center, turned)


def test_what_turns_with_a_hinged_engine_has_the_inertia_of_a_body():
    boat = assemble(
        '<link name="engine"><inertial><mass value="1"/><inertia ixx="0" iyy="0" izz="0"/></inertial></link>',
        joint("turn", "engine"),
        link("left_propeller", mass=0),
        joint("shaft", "left_propeller", "engine", kind="fixed"),
        thruster("left", engine="turn"),
    )
    assert body_mass(boat, "fixed").mass == 101
    with pytest.raises(CompileError, match="robot boat: what turns with 'left' has moments of inertia of 0, 0, 0 kg"):
        body_mass(boat, "hinged")


@pytest.mark.parametrize("count", [1, 2, 5])
def test_stations_stand_for_equal_pieces_of_both_hulls(count):
    water = SimpleNamespace(hulls=(), boat_length=4.9, boat_width=2.4, hull_radius=0.2, length_n=count)
    rows = station_rows(SimpleNamespace(hydrodynamics=water, name="boat"))
    x, y, _ = np.array([row.position for row in rows]).T
    assert len(rows) == 2 * count
    assert sum(row.length for row in rows) == pytest.approx(2 * 4.9)
    assert (x.mean(), y.mean()) == pytest.approx((0.0, 0.0), abs=1e-12)
    assert np.abs(y) == pytest.approx(1.2)
    assert (x.min(), x.max()) == pytest.approx((-2.45 + 2.45 / count, 2.45 - 2.45 / count))


@pytest.mark.parametrize(("ahead", "astern", "largest"), [(250.0, -100.0, 250.0), (100.0, -300.0, 300.0)])
def test_a_command_in_newtons_goes_up_to_the_larger_force(ahead, astern, largest):
    drive = ThrusterConfig(mapping="newtons", max_force_forward=ahead, max_force_reverse=astern)
    boat = build_boat(Order("wamv"))
    (row,) = thruster_rows(replace(boat, thrusters=(replace(boat.thrusters[0], drive=drive),)), "fixed", "")
    assert row.max_command == largest


def test_a_rudder_s_race_has_the_area_of_its_propeller_s_disc():
    boat = build_boat(Order("skiff"))
    rudders = {thruster.name: thruster.blade for thruster in boat.thrusters if thruster.blade}
    rows = {row.name: row for row in thruster_rows(boat, "fixed", "")}
    assert rudders
    for name, rudder in rudders.items():
        assert rows[name].race_area == pytest.approx(math.pi * (rudder.propeller_diameter / 2.0) ** 2)
        assert rows[name].race == [thruster.name for thruster in boat.thrusters].index(rudder.propeller)


def test_each_rudder_is_in_the_race_of_a_propeller_of_its_own_boat():
    places = [{"name": name, "pose": [0.0, 20.0 * n, 0.0, 0.0, 0.0, 0.0]} for n, name in enumerate("abc")]
    world = compile_world({"physics": {"profile": "marine"}}, fleet={"robot": "skiff", "boats": places})
    thrusters = world.parameters.thrusters
    raced = [(row.hull, row.name, thrusters[row.race].hull, thrusters[row.race].name) for row in thrusters]
    assert [row for row in raced if row[1] == "rudder"] == [(n, "rudder", n, "propeller") for n in range(3)]
