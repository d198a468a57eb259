"""Every floating object of the catalogue, a new one included: stable, at rest where Archimedes says, alike at any step.

They share a world, far from each other; a run that diverges names the object.
"""

import functools
import math

import numpy as np
import pytest

import vrx_mj
from integration.sailing import CALM, object_kinds, water
from vrx_mj.cli.files import copy_start_file
from vrx_mj.config.objects import load_object
from vrx_mj.runtime.observation import rotation_matrix

FLOATING = [name for name, kind in object_kinds().items() if kind == "floating"]
WAVES = {"model": "pms", "gain": 0.3, "period": 5.0, "scale": 1.5, "direction": [1.0, 0.0], "tau": 2.0}
SPACING = 25.0


def raft(*, z=0.0, sea=CALM, timestep=0.01, tilt=0.0):
    """A simulation with one of each, in a square."""
    side = math.ceil(math.sqrt(len(FLOATING)))
    places = [(SPACING * (n % side), SPACING * (n // side)) for n in range(len(FLOATING))]
    items = [
        {"name": name, "model": name, "pose": [x, y, z, tilt, -0.5 * tilt, 0.0], "path": None}  # animals swim else
        for name, (x, y) in zip(FLOATING, places, strict=True)
    ]
    spawn = {"pose": [-100, -100, 0, 0, 0, 0]}
    world = water(sea=sea, wind=None, timestep=timestep, objects=items, spawn=spawn)
    return vrx_mj.Simulation(vrx_mj.compile_world(world))


def places(sim):
    """(objects, 3): where they are [m]."""
    return np.array([sim.observe_object(name).position for name in FLOATING])


def way(sim, seconds, every=0.1):
    """(samples, objects, 3): where they are [m] over a time [s]."""
    out = [places(sim)]
    for _ in range(round(seconds / every)):
        sim.step(duration=every)
        out.append(places(sim))
    return np.array(out)


@pytest.fixture(scope="module")
def rest():
    """Dropped from 1 m, let up from 1 m under water, and laid on it: after a minute, at the coarsest step."""
    rafts = {"dropped": raft(z=1.0, timestep=0.02), "let up": raft(z=-1.0, timestep=0.02), "laid": raft(timestep=0.02)}
    for sim in rafts.values():
        sim.step(duration=60.0)
    return rafts


@pytest.mark.parametrize("how", ["dropped", "let up", "laid"])
def test_it_comes_to_rest(rest, how):
    def motion(name):
        item = rest[how].observe_object(name)
        return np.abs([item.velocity, item.angular_velocity]).max()

    assert {name: moves for name in FLOATING if not (moves := motion(name)) < 2e-3} == {}


@pytest.mark.slow
@pytest.mark.parametrize("how", ["dropped", "let up", "laid"])
def test_at_rest_it_displaces_its_weight_under_its_centre_of_mass(rest, how):
    """Archimedes, with the wet volume counted on 60^3 points, one at random in each cell of a box around each shape.

    It is right within 1 %, and its centre within a few mm.
    """
    for name in FLOATING:
        config, item = load_object(name), rest[how].observe_object(name)
        mass, center = displaced(config, item)
        assert mass == pytest.approx(config.mass, rel=0.01), name
        expected = item.position + rotation_matrix(item.quaternion) @ config.center_of_mass
        assert center[:2] == pytest.approx(expected[:2], abs=5e-3), name


def displaced(config, item):
    """Mass of the water that an object displaces [kg], and the centre of it [m]."""
    turn = rotation_matrix(item.quaternion)
    wet, moment = 0.0, np.zeros(3)
    for element in config.buoyancy.elements:
        points, volume = grid(element)
        under = (item.position[2] + points @ turn[2] < config.buoyancy.fluid_level).astype(float)
        wet += volume * under.sum()
        moment += volume * (under.sum() * item.position + turn @ (under @ points))
    return config.buoyancy.fluid_density * wet, moment / wet


@functools.cache
def grid(element, count=60):
    """Points in a buoyancy element, link axes [m], and the volume [m3] of each; cylinders are VRX's 20-gons."""
    axis = np.arange(count) / count - 0.5
    cells = np.stack(np.meshgrid(axis, axis, axis, indexing="ij")).reshape(3, -1)
    x, y, z = cells + np.random.default_rng(1).uniform(0.0, 1.0 / count, cells.shape)
    if element.type == "box":
        size, keep = np.array(element.size), np.ones(x.size, bool)
    elif element.type == "sphere":
        size, keep = np.full(3, 2.0 * element.radius), x * x + y * y + z * z < 0.25
    else:
        size = np.array([2.0 * element.radius, 2.0 * element.radius, element.length])
        sector = math.pi / 10.0
        off = (np.arctan2(y, x) % sector) - 0.5 * sector
        keep = np.hypot(x, y) * np.cos(off) < 0.5 * math.cos(0.5 * sector)
    points = np.column_stack([x, y, z])[keep] * size
    roll, pitch, yaw = element.pose[3:]
    cr, sr, cp, sp, cy, sy = (f(a) for a in (roll, pitch, yaw) for f in (math.cos, math.sin))
    turn = np.array(
        [[cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
         [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
         [-sp, cp * sr, cp * cr]]
    )  # fmt: skip
    return points @ turn.T + np.array(element.pose[:3]), float(np.prod(size)) / count**3


@pytest.mark.parametrize("timestep", [0.001, 0.02])
def test_a_ball_floats_at_its_waterline(timestep):
    """Closed form: the cap's height h solves pi h^2 (3 r - h) / 3 = m / rho."""
    name = "polyform_a5"
    config = load_object(name)
    radius = config.buoyancy.elements[0].radius
    roots = np.roots([-math.pi / 3, math.pi * radius, 0.0, -config.mass / 1000.0])
    (height,) = (root.real for root in roots if abs(root.imag) < 1e-12 and 0 < root.real < 2 * radius)
    sim = raft(timestep=timestep) if timestep > 0.01 else single(name, timestep)
    sim.step(duration=40.0)  # it bobs for long: damping ratio 0.04
    assert sim.observe_object(name).position[2] == pytest.approx(radius - height, abs=1e-6)


def single(name, timestep, sea=CALM):
    world = water(sea=sea, wind=None, timestep=timestep, objects=[{"name": name, "model": name}])
    return vrx_mj.Simulation(vrx_mj.compile_world({**world, "spawn": {"pose": [-50, 0, 0, 0, 0, 0]}}))


@pytest.fixture(scope="module")
def steps():
    """Ways in waves over 10 s, laid on the water with a tilt of 0.2 rad, at 20, 10 and 1 ms."""
    return {step: way(raft(sea=WAVES, timestep=step, tilt=0.2), 10.0) for step in (0.02, 0.01, 0.001)}


@pytest.mark.parametrize(("step", "allowed"), [pytest.param(0.01, 0.06, marks=pytest.mark.slow), (0.02, 0.1)])
def test_its_motion_in_waves_hardly_depends_on_the_step(steps, step, allowed):
    """The largest distance between the ways of its origin.

    Integration is of first order: the A7 ball, let go half under water, leaps out at 3 m/s and falls back, and a step
    of 10 ms is 3 cm of that.
    """
    apart = np.linalg.norm(steps[step] - steps[0.001], axis=2).max(axis=0)
    assert {name: most for name, most in zip(FLOATING, apart, strict=True) if not most < allowed} == {}


@pytest.fixture(scope="module")
def voyage():
    """Two minutes in waves: times [s], places [m], and heights of the water there [m]."""
    sim = raft(sea=WAVES)
    times, rows, heights = [], [], []
    for _ in range(600):
        sim.step(duration=0.2)
        here = places(sim)
        times.append(sim.time)
        rows.append(here)
        heights.append(sim.sea.height(here[:, 0], here[:, 1], sim.time))
    return np.array(times), np.array(rows), np.array(heights)


def test_it_follows_the_waves_and_does_not_wander(voyage):
    """Heights over the water stay as they are after a minute, and it goes nowhere: drag is on velocity over ground.

    A minute, because a `dock_block_2x2` by itself capsizes first: its mass sits beside its buoyancy.
    """
    times, rows, heights = voyage
    over = rows[:, :, 2] - heights
    early, late = over[(times > 60) & (times < 90)], over[times > 90]
    drift = np.linalg.norm(rows[-1, :, :2] - rows[299, :, :2], axis=1)
    for index, name in enumerate(FLOATING):
        assert np.ptp(late[:, index]) < 1.2 * np.ptp(early[:, index]) + 0.01, name
        assert late[:, index].mean() == pytest.approx(early[:, index].mean(), abs=0.01), name
        assert drift[index] < 0.05, name


def test_drag_is_over_mass_and_velocity(tmp_path, monkeypatch):
    """The start file's figures: 25 1/s of 20 kg are 500 N at 1 m/s, 2 1/s and 0.6 m are 14.4 N m at 1 rad/s."""
    monkeypatch.chdir(tmp_path)
    copy_start_file("object", "ball")
    thing, step, pose = load_object("./ball.yaml"), 1e-5, [30, 0, -9, 0, 0, 0]
    at = {"name": "ball", "model": "./ball.yaml", "pose": pose}
    sim = vrx_mj.Simulation(vrx_mj.compile_world(water(sea=CALM, wind=None, timestep=step, objects=[at])))

    def acceleration(sink, turn):
        sim.set_object("ball", pose=pose, velocity=(0, 0, -sink, 0, 0, turn))
        sim.advance(1)
        after = sim.observe_object("ball")
        return np.array([after.velocity[2] + sink, after.angular_velocity[2] - turn]) / step

    rest = acceleration(0, 0)
    assert thing.mass * (acceleration(1, 0) - rest)[0] == pytest.approx(500.0, rel=1e-3)
    assert thing.inertia[2] * (acceleration(0, 1) - rest)[1] == pytest.approx(-14.4, rel=1e-3)
