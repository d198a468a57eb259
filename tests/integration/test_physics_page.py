"""The figures that docs/physics.md states for VRX's drift, sway and pitch: measured once more, and their closed forms.

A swell is one wave of deep water, which travels east past a bare WAM-V without a command.
"""

import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import vrx_mj

PAGE = (Path(__file__).parents[2] / "docs" / "physics.md").read_text(encoding="utf-8")
AMPLITUDE, PERIOD = 2.48, 20.0
OMEGA = math.tau / PERIOD
WAVENUMBER = OMEGA**2 / 9.8
SETTLED, SAMPLE = 100.0, 0.5  # [s]: five waves until the motion repeats
INTO, ACROSS, WITH = math.pi, math.pi / 2, 0.0  # headings [rad] as the swell travels to heading 0


@cache
def swell(profile, heading, period=PERIOD):
    """Mean velocity along the swell [m/s] over ten waves, and the amplitude of the tilt over that of the wave's slope.

    The tilt is that in phase with the slope: of pitch, or with the swell abeam, of roll.
    """
    sea = {"model": "cwr", "number": 1, "amplitude": AMPLITUDE * (period / PERIOD) ** 2, "period": period}
    boat = {"name": "a", "pose": [0.0, 0.0, 0.0, 0.0, 0.0, heading]}
    world = {"physics": {"profile": profile}, "sea": sea}
    sim = vrx_mj.Simulation(vrx_mj.compile_world(world, fleet={"sensors": "none", "boats": [boat]}))
    begun = sim.step(duration=SETTLED)["a"].position[0]
    rows = []
    for _ in range(round(10 * period / SAMPLE)):
        seen = sim.step(duration=SAMPLE)["a"]
        rows.append((sim.time, seen.position[0], seen.pitch, seen.roll))
    t, x, pitch, roll = np.array(rows).T
    omega = math.tau / period
    k = omega**2 / 9.8
    slope = -sea["amplitude"] * k * np.sin(k * x - omega * t)  # of the surface, upward to the east
    tilt = roll if heading == ACROSS else -math.cos(heading) * pitch  # positive: the east side is up
    sign = -1.0 if heading == ACROSS else 1.0
    basis = np.stack([slope, np.gradient(slope), np.ones_like(t)], 1)
    ratio = sign * np.linalg.lstsq(basis, tilt, rcond=None)[0][0]
    return (x[-1] - begun) / (t[-1] - SETTLED), ratio


def table_after(words):
    """The first table behind some words of the page, as rows of cells, without its head."""
    lines = PAGE[PAGE.index(words) :].splitlines()
    start = next(number for number, line in enumerate(lines) if line.startswith("|"))
    rows = []
    for line in lines[start + 2 :]:
        if not line.startswith("|"):
            return rows
        rows.append([cell.strip().strip("`") for cell in line.strip("|").split("|")])
    return rows


DRIFTS = [
    (profile, heading, float(cell.removesuffix(" m/s")))
    for profile, *cells in table_after("**It drifts against a long swell.**")
    for heading, cell in zip((INTO, ACROSS, WITH), cells, strict=True)
]
PITCHES = [
    (profile, heading, float(period), float(cell))
    for profile, period, *cells in table_after("**It pitches more or less than the surface.**")
    for heading, cell in zip((INTO, WITH), cells, strict=True)
]


@pytest.mark.parametrize(("profile", "heading", "stated"), DRIFTS)
def test_a_boat_drifts_against_a_swell_as_the_page_states(profile, heading, stated):
    velocity, _ = swell(profile, heading)
    assert velocity == pytest.approx(-stated, abs=0.0006)  # three decimals, and other machines' last bits


DRAG = {  # surge and sway: linear and quadratic [N s/m, N s2/m2]
    "vrx": {INTO: (51.3, 72.4), WITH: (51.3, 72.4), ACROSS: (40.0, 0.0)},
    "vrx3": {INTO: (100.0, 150.0), WITH: (100.0, 150.0), ACROSS: (100.0, 100.0)},
}


@pytest.mark.parametrize(("profile", "heading"), [(name, heading) for name in DRAG for heading in DRAG[name]])
def test_the_drift_is_that_of_the_mean_of_the_heave_drag(profile, heading):
    linear, quadratic = DRAG[profile][heading]
    push = (500.0 - linear) * AMPLITUDE**2 * OMEGA * WAVENUMBER / 2.0
    speed = push / linear
    for _ in range(50):
        speed = push / (linear + quadratic * speed)
    velocity, ratio = swell(profile, heading)
    assert velocity == pytest.approx(-speed * ratio, rel=0.08)  # the deck is tilted by the ratio; second order in slope


@pytest.mark.parametrize(("profile", "heading", "period", "stated"), PITCHES)
def test_a_boat_pitches_as_the_page_states(profile, heading, period, stated):
    assert swell(profile, heading, period)[1] == pytest.approx(stated, abs=0.006)


@pytest.mark.parametrize(("heading", "sign"), [(INTO, -1.0), (WITH, 1.0)])
def test_the_pitch_off_the_slope_is_the_lift_against_heave_drag_behind_the_origin(heading, sign):
    stiffness, lever = 34_900.0, 0.4  # [N m/rad] of four stations 1 m from their middle, and that middle [m]
    extra = 500.0 * OMEGA * lever / stiffness / WAVENUMBER
    assert swell("vrx3", heading)[1] == pytest.approx(1.0 + sign * extra, abs=0.03)


@pytest.mark.parametrize("profile", ["vrx", "vrx3"])
def test_a_boat_rolls_with_the_slope(profile):
    assert swell(profile, ACROSS)[1] == pytest.approx(1.0, abs=0.005)


def test_the_roughest_sea_of_the_competitions_drifts_a_boat_as_the_page_states():
    found = []
    for heading in (INTO, ACROSS, WITH):
        boat = {"name": "a", "pose": [0.0, 0.0, 0.0, 0.0, 0.0, heading]}
        sea = {"model": "pms", "gain": 0.7, "period": 6.0, "scale": 2.5, "number": 2}
        sim = vrx_mj.Simulation(
            vrx_mj.compile_world(
                {"physics": {"profile": "vrx"}, "sea": sea}, fleet={"sensors": "none", "boats": [boat]}
            )
        )
        begun = sim.step(duration=60.0)["a"].position[0]
        found.append(begun - sim.step(duration=60.0)["a"].position[0])
    assert [speed / 60.0 for speed in (min(found), max(found))] == pytest.approx([0.084, 0.130], abs=0.0006)
    assert "at 0.084 to 0.13 m/s in `vrx`" in PAGE


@pytest.mark.parametrize(
    ("profile", "across", "ahead", "words"),
    [("vrx", 6.07, 1.51, "reaches 6.07 m/s"), ("vrx3", 1.14, 0.98, "1.14 m/s to the side and 0.98 m/s ahead")],
)
def test_a_boat_goes_sideways_faster_than_ahead_as_the_page_states(profile, across, ahead, words):
    world = {"physics": {"profile": profile}, "spawn": {"sensors": "none", "thrusters": "T"}}
    sim = vrx_mj.Simulation(vrx_mj.compile_world(world))
    thrusters = sim.observe()["wamv"].thrusters
    force = 242.67
    commands = {name: thrusters[name].command(share * force) for name, share in (("left", 0.5), ("right", 0.5))}
    lateral = {"lateral": thrusters["lateral"].command(force)}
    assert sim.step({"wamv": lateral}, duration=120.0)["wamv"].velocity[1] == pytest.approx(across, abs=0.006)
    sim.reset()
    assert sim.step({"wamv": commands}, duration=120.0)["wamv"].velocity[0] == pytest.approx(ahead, abs=0.006)
    assert words in PAGE
