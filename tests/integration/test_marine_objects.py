"""What floats in worlds of profile `marine`: it drifts, is held, leans with the surface and follows the water."""

import json
import math

import numpy as np
import pytest

from vrx_mj import Batch, Simulation, compile_world
from vrx_mj.errors import ConfigError

BUOY = {"name": "buoy", "model": "mb_marker_buoy_red", "pose": [20, 0, 0, 0, 0, 0]}
DOCK = {"name": "dock", "layout": "XX\n", "pose": [0, 30, 0, 0, 0, 0], "dynamic": True, "mooring": {}}
RAFT = """
mass: 100
inertia: [8, 8, 16]
buoyancy: {linear_drag: 2, angular_drag: 4, elements: [{type: box, size: [1, 1, 0.2]}]}
"""
SPHERE = """
mass: {mass}
inertia: [0.001, 0.001, 0.001]
buoyancy: {{linear_drag: {drag}, angular_drag: 2, fluid_density: 1025, elements: [{{type: sphere, radius: 0.05}}]}}
"""


def marine(objects=(BUOY,), **world):
    return {
        "name": "bay",
        "physics": {"profile": "marine"},
        "sea": {"model": "none"},
        "objects": list(objects),
        **world,
    }


def sailed(duration, **world):
    sim = Simulation(compile_world(marine(**world)))
    sim.step(duration=duration)
    return sim


def test_a_free_buoy_goes_with_the_current():
    sim = sailed(60.0, objects=[{**BUOY, "mooring": None}], current={"speed": 0.4, "direction": 90.0})
    buoy = sim.observe_object("buoy")
    assert sim.data.qvel[:2] == pytest.approx([0.0, 0.4], abs=1e-4)
    assert buoy.position[1] == pytest.approx(0.4 * 60.0, rel=0.05)


def test_a_moored_buoy_stays_where_its_rope_holds_it():
    """Drag against spring: k (x - L) = c m v V/V_shape."""
    sim = sailed(120.0, current={"speed": 0.4})
    line, item = sim.world.parameters.ropes[0], sim.world.parameters.floats[0]
    stretched = math.hypot(*(_center(sim) - line.anchor)) - line.length
    wet = item.mass / item.density / sim.world.parameters.elements[item.element_start].volume
    assert line.stiffness * stretched == pytest.approx(item.linear_drag * item.mass * wet * 0.4, rel=0.03)
    assert np.abs(sim.data.qvel[:6]).max() < 1e-3


def _center(sim):
    body = sim.model.body("buoy/link").id
    return sim.data.xipos[body][:2]


def test_every_object_without_a_path_has_a_rope_and_null_takes_it_away():
    course = {"name": "course", "model": "short_navigation_course_0", "pose": [50, 0, 0, 0, 0, 0]}
    world = compile_world(marine([BUOY, course]))
    assert len(world.parameters.ropes) == len(world.parameters.floats) - 1  # the ball shooter's ball is free
    free = compile_world(marine([{**course, "mooring": None}, {**BUOY, "mooring": {"length": 5, "stiffness": 7}}]))
    (rope,) = free.parameters.ropes
    assert (rope.length, rope.stiffness) == (5.0, 7.0)
    assert rope.anchor == pytest.approx((20.0, 0.0))


def test_a_rope_leaves_with_its_buoy():
    other = {**BUOY, "name": "other", "pose": [40, 0, 0, 0, 0, 0]}
    sim = Simulation(compile_world(marine([BUOY, other], current={"speed": 0.5})))
    sim.step(duration=1.0)
    sim.remove("buoy")
    sim.step(duration=60.0)
    assert len(sim.world.parameters.ropes) == 1
    assert abs(sim.observe_object("other").position[0] - 40.0) < 4.0


@pytest.mark.parametrize("period", [15.0, 25.0])
def test_a_long_wave_tilts_a_float_with_its_surface(period, tmp_path):
    """A flat box on a swell: its deck is the surface's slope, within a tenth."""
    (tmp_path / "raft.yaml").write_text(RAFT, encoding="utf-8")
    raft = {"name": "raft", "model": "./raft.yaml", "pose": [20, 0, 0, 0, 0, 0], "mooring": None}
    swell = {"model": "regular", "height": 0.02 * period**2, "period": period}
    (tmp_path / "bay.yaml").write_text(json.dumps(marine([raft], sea=swell)), encoding="utf-8")
    sim, leans = Simulation(compile_world(tmp_path / "bay.yaml")), []
    sim.step(duration=2.0 * period)
    for _ in range(200):
        sim.step(duration=period / 100.0)
        raft = sim.observe_object("raft")
        w, x, y, z = raft.quaternion
        slope = sim.sea.slope(*raft.position[:2], sim.time)[0]
        leans.append((-2.0 * (x * z + w * y), slope, raft.position[2] - sim.sea.height(*raft.position[:2], sim.time)))
    leans = np.array(leans)
    steepest = np.abs(leans[:, 1]).max()
    assert np.abs(leans[:, 0] - np.sin(np.arctan(leans[:, 1]))).max() < 0.1 * steepest
    assert np.ptp(leans[:, 2]) < 0.01 * swell["height"]


@pytest.mark.filterwarnings("ignore:.*sinks")
@pytest.mark.parametrize("drag", [0.5, 20.0])
def test_a_neutral_sphere_is_a_particle_of_water(drag, tmp_path):
    """Its orbit is a e^{kz}, and it drifts with Stokes' omega k a^2 e^{2kz}."""
    mass = 1025.0 * 4.0 / 3.0 * math.pi * 0.05**3
    (tmp_path / "sphere.yaml").write_text(SPHERE.format(mass=repr(mass), drag=drag), encoding="utf-8")
    ball = {"name": "ball", "model": "./sphere.yaml", "pose": [20, 0, -1.0, 0, 0, 0], "mooring": None}
    period = math.sqrt(2.0 * math.pi * 10.0 / 9.80665)
    swell = {"model": "regular", "height": 0.2, "period": period}
    (tmp_path / "bay.yaml").write_text(json.dumps(marine([ball], sea=swell)), encoding="utf-8")
    sim, track = Simulation(compile_world(tmp_path / "bay.yaml")), []
    sim.step(duration=20.0)
    steps = 800
    for _ in range(steps):
        sim.advance(round(period * 4 / steps / sim.timestep))
        track.append((sim.time, *sim.observe_object("ball").position))
    track = np.array(track)
    k, omega = 2.0 * math.pi / 10.0, 2.0 * math.pi / period
    radius = 0.1 * math.exp(k * track[:, 3].mean())
    phase = np.column_stack([np.cos(omega * track[:, 0]), np.sin(omega * track[:, 0]), np.ones(steps), track[:, 0]])
    up, along = (np.linalg.lstsq(phase, track[:, column], rcond=None)[0] for column in (3, 1))
    assert math.hypot(*up[:2]) == pytest.approx(radius, rel=0.02)
    assert math.hypot(*along[:2]) == pytest.approx(radius, rel=0.02)
    assert along[3] == pytest.approx(omega * k * radius**2, rel=0.1)


def test_a_moored_dock_feels_the_current():
    sim = sailed(60.0, objects=[], docks=[DOCK], current={"speed": 0.3})
    still = sailed(60.0, objects=[], docks=[DOCK])
    moved = [run.data.body("dock/dock").xpos[0] for run in (sim, still)]
    assert moved[0] - moved[1] > 0.01


def test_rows_and_seeds_have_the_same_bits():
    world = compile_world(
        marine([BUOY], docks=[DOCK], sea={"model": "jonswap", "sea_state": 2}, current={"speed": 0.2, "var_gain": 0.1})
    )
    batch, single = Batch(world, 2), Simulation(world)
    batch.reset(seed=3)
    batch.step(duration=3.0)
    for row in range(2):
        single.reset(3 + row)
        single.step(duration=3.0)
        assert batch.get_state(row).sha256 == single.get_state().sha256


def test_a_mooring_needs_water_that_moves():
    with pytest.raises(ConfigError) as error:
        compile_world({"name": "bay", "physics": {"profile": "vrx"}, "objects": [{**BUOY, "mooring": {"length": 1}}]})
    assert str(error.value) == "<world>: objects[0].mooring: a mooring needs `physics: {profile: marine}`, got vrx"
