"""The water under the waves: against derivatives of its potential, and what follows from the equations of water."""

import math

import numpy as np
import pytest

from unit.physics.rows import matrix, moving, sea
from vrx_mj.model.tables import HULL
from vrx_mj.physics.kinematics import (
    Turning,
    half_step_back,
    orbital_motion,
    orbital_turning,
    reach_of,
    surface_plane,
    surface_slope,
    turned_with,
    water_pressure,
)
from vrx_mj.physics.motion import relative_motion
from vrx_mj.physics.waves import surface_height
from vrx_mj.spectra import Site, irregular_sea, jonswap, regular_wave, stokes_wave

STEP = 1e-5


def water(components, *, depth=math.inf, phases=None, **other):
    phases = np.linspace(0.0, 5.0, len(components)) if phases is None else phases
    rows = [wave._asdict() | {"steepness": 0.0, "phase": p} for wave, p in zip(components, phases, strict=True)]
    return sea(rows, depth=depth, **other)


DEEP = water(irregular_sea(jonswap(1.3), 0.8, (0.4, 6.0), (1.0, 1.0), 20, 8.0))
SHALLOW = water(irregular_sea(jonswap(1.3), 0.5, (0.4, 6.0), (1.0, 1.0), 20, 8.0, Site(3.0)), depth=3.0)
STOKES = water(stokes_wave(1.0, 5.0, (0.6, 0.8), Site(10.0)), depth=10.0, phases=np.zeros(5))
POINTS = [(0.0, 0.0, -0.7, 0.0), (3.0, -2.0, -1.9, 4.1), (-40.0, 17.0, -0.3, 31.0)]


def velocity(waves, record, x, y, z, t):
    return np.array(orbital_motion(waves, record, x, y, z, t))[:3]


def difference(function, *point):
    """Derivatives of a function along each of its arguments."""
    found = []
    for index in range(len(point)):
        before, after = list(point), list(point)
        before[index] -= STEP
        after[index] += STEP
        found.append((function(*after) - function(*before)) / (2.0 * STEP))
    return found


@pytest.mark.parametrize("point", POINTS)
@pytest.mark.parametrize("waters", [DEEP, SHALLOW, STOKES], ids=["deep", "shallow", "stokes"])
def test_the_water_is_incompressible_and_does_not_turn(waters, point):
    by_x, by_y, by_z, _ = difference(lambda *at: velocity(*waters, *at), *point)
    assert by_x[0] + by_y[1] + by_z[2] == pytest.approx(0.0, abs=1e-8)
    turning = [by_y[2] - by_z[1], by_z[0] - by_x[2], by_x[1] - by_y[0]]
    assert turning == pytest.approx([0.0, 0.0, 0.0], abs=1e-8)


@pytest.mark.parametrize("point", POINTS)
@pytest.mark.parametrize("waters", [DEEP, SHALLOW, STOKES], ids=["deep", "shallow", "stokes"])
def test_the_acceleration_is_the_velocity_s_derivative(waters, point):
    *_, by_t = difference(lambda *at: velocity(*waters, *at), *point)
    assert np.array(orbital_motion(*waters, *point))[3:] == pytest.approx(by_t, abs=1e-8)


@pytest.mark.parametrize("point", POINTS)
@pytest.mark.parametrize("waters", [DEEP, SHALLOW, STOKES], ids=["deep", "shallow", "stokes"])
def test_level_water_turns_as_its_vertical_velocity_slopes(waters, point):
    """At a point, with no waterplane to average over; and its rate."""
    by_x, by_y, _, _ = difference(lambda *at: velocity(*waters, *at), *point)
    turning = orbital_turning(*waters, (0.0, 0.0, 0.0), *point)
    assert turning[:2] == pytest.approx([by_y[2], -by_x[2]], abs=1e-8)
    *_, by_t = difference(lambda *at: np.array(orbital_turning(*waters, (0.0, 0.0, 0.0), *at)[:2]), *point)
    assert turning[2:] == pytest.approx(by_t, abs=1e-8)


@pytest.mark.parametrize("depth", [math.inf, 1.5])
def test_water_at_the_surface_drifts_as_stokes_drift(depth):
    """A particle that goes down through the mean level, over a period by Runge and Kutta's rule."""
    amplitude, period = 0.05, 2.0
    (wave,) = regular_wave(2.0 * amplitude, period, (1.0, 0.0), Site(depth))
    waves, record = water([wave], depth=depth)
    place, steps = np.zeros(3), 80
    for step in range(steps):
        t, dt = period * (0.25 + step / steps), period / steps
        a = velocity(waves, record, *place, t)
        b = velocity(waves, record, *(place + 0.5 * dt * a), t + 0.5 * dt)
        c = velocity(waves, record, *(place + 0.5 * dt * b), t + 0.5 * dt)
        d = velocity(waves, record, *(place + dt * c), t + dt)
        place += dt / 6.0 * (a + 2.0 * b + 2.0 * c + d)
    k, omega = wave.wavenumber, wave.frequency
    stokes = omega * k * amplitude**2
    if depth < math.inf:
        stokes *= math.cosh(2.0 * k * depth) / (2.0 * math.sinh(k * depth) ** 2)
    assert place[0] / period == pytest.approx(stokes, rel=0.03)  # of third order: (k a)^2


@pytest.mark.parametrize("waters", [DEEP, SHALLOW], ids=["deep", "shallow"])
def test_above_the_mean_level_water_moves_twice_as_there_at_most(waters):
    at, low, high = (np.array(orbital_motion(*waters, 3.0, -2.0, z, 4.1)) for z in (0.0, -0.8, 0.8))
    assert high == pytest.approx(2.0 * at - low, abs=1e-12)


@pytest.mark.parametrize("dt", [0.01, -0.01])
@pytest.mark.parametrize("waters", [DEEP, SHALLOW], ids=["deep", "shallow"])
def test_velocities_are_those_of_half_a_step_ago(waters, dt):
    """Where a point of a hull was then; or will be after half a step. Accelerations are those of now."""
    body, (x, y, z, t) = moving((3.0, -2.0, -1.9), (0.0, 0.0, 0.7), (0.8, -0.5, 0.0, 0.0, 0.0, 0.3)), POINTS[1]
    past = half_step_back(body, (0.0, 0.0, 0.0), dt)
    cos, sin = math.cos(0.7), math.sin(0.7)
    assert past == pytest.approx(0.5 * dt * np.array((0.8 * cos + 0.5 * sin, 0.8 * sin - 0.5 * cos, 1.0)))
    then, reach = (x - past[0], y - past[1], z, t - past[2]), (0.0, 0.0, 0.0)
    u, gained = np.split(np.array(orbital_motion(*waters, x, y, z, t, reach, past)), 2)
    assert u == pytest.approx(velocity(*waters, *then), abs=2e-5)  # phases to their square: 0.03^3
    assert gained == pytest.approx(orbital_motion(*waters, x, y, z, t)[3:], rel=1e-12)
    turning = orbital_turning(*waters, reach, x, y, z, t, past)
    assert turning[:2] == pytest.approx(orbital_turning(*waters, reach, *then)[:2], abs=2e-5)
    assert turning[2:] == pytest.approx(orbital_turning(*waters, reach, x, y, z, t)[2:], rel=1e-12)


@pytest.mark.parametrize(("share", "bound"), [(0.1, 1e-5), (0.3, 3e-4), (0.6, 0.014)])
@pytest.mark.parametrize("heading", [0.0, 0.7, 2.0])
def test_over_a_line_it_is_the_slope_of_the_best_fit(share, bound, heading):
    """A hull as long as a share of the waves, and as narrow as a line, in each heading along them."""
    length, (cos, sin) = 10.0 * share, (math.cos(heading), math.sin(heading))
    waves, record = water(regular_wave(0.4, math.sqrt(2.0 * math.pi * 10.0 / 9.81), (cos, sin), Site()))
    hull = np.zeros(1, HULL)[0]
    hull["spread"] = length**2 / 12.0, 0.0
    turning = orbital_turning(waves, record, reach_of(hull, (cos, sin)), 1.0, 2.0, -0.1, 0.3)
    along = np.linspace(-0.5, 0.5, 2001) * length
    rise = [velocity(waves, record, 1.0 + s * cos, 2.0 + s * sin, -0.1, 0.3)[2] for s in along]
    slope = np.trapezoid(along * rise, along) / np.trapezoid(along * along, along)
    assert turning[:2] == pytest.approx([slope * sin, -slope * cos], rel=bound)


@pytest.mark.parametrize("share", [0.3, 0.9, 1.0, 1.1, 1.4])
@pytest.mark.parametrize("heading", [0.0, 0.7])
def test_a_long_hull_feels_the_mean_motion_of_the_water(share, heading):
    """Over a line as long as a share of the waves: sin a / a of the motion at its middle, a = k L / 2."""
    length, (cos, sin) = 10.0 * share, (math.cos(heading), math.sin(heading))
    waves, record = water(regular_wave(0.4, math.sqrt(2.0 * math.pi * 10.0 / 9.81), (cos, sin), Site()))
    hull = np.zeros(1, HULL)[0]
    hull["spread"] = length**2 / 12.0, 0.0
    reach, point = reach_of(hull, (cos, sin)), (1.0, 2.0, -0.1, 0.3)
    left = math.sin(math.pi * share) / (math.pi * share)
    here, mean = np.array(orbital_motion(waves, record, *point)), np.array(orbital_motion(waves, record, *point, reach))
    assert mean == pytest.approx(left * here, abs=0.005 * np.abs(here).max())
    along = np.linspace(-0.5, 0.5, 2001) * length
    heights = [surface_height(waves, record, 1.0 + d * cos, 2.0 + d * sin, 0.3) for d in along]
    assert surface_plane(waves, record, reach, 1.0, 2.0, 0.3)[0] == pytest.approx(
        np.trapezoid(heights, along) / length, abs=0.001
    )


@pytest.mark.parametrize("waters", [DEEP, SHALLOW], ids=["deep", "shallow"])
def test_the_plane_at_a_point_is_the_tangent_of_the_surface(waters):
    at = 3.0, -2.0, 4.1
    tangent = surface_height(*waters, *at), *surface_slope(*waters, *at)
    assert surface_plane(*waters, (0.0, 0.0, 0.0), *at) == pytest.approx(tangent, abs=1e-12)


def test_a_body_that_turns_with_the_water_has_no_motion_through_it():
    body = moving((0.0, 0.0, 0.0), (0.2, -0.1, 0.8))
    turn = matrix(body)
    turning, point, flow = Turning(0.3, -0.2, 0.0, 0.0), np.array([0.5, -0.2, -0.1]), np.array([0.4, 0.1, -0.3])
    spin = turn.T @ np.array([0.3, -0.2, 0.0])
    carried = (*(turn.T @ flow - np.cross(spin, point)), *spin)
    body = moving((0.0, 0.0, 0.0), (0.2, -0.1, 0.8), carried)
    through = turned_with(relative_motion(body, tuple(flow)), turning, point)
    assert through[12:] == pytest.approx(np.zeros(6), abs=1e-15)


@pytest.mark.parametrize("waters", [DEEP, SHALLOW], ids=["deep", "shallow"])
def test_the_surface_moves_with_the_water(waters):
    """Linear kinematic and dynamic conditions at the mean level: d eta / dt = w, and p = rho g eta."""
    x, y, t = 3.0, -2.0, 4.1
    _, _, rise = difference(lambda *at: surface_height(*waters, *at), x, y, t)
    assert velocity(*waters, x, y, 0.0, t)[2] == pytest.approx(rise, abs=1e-8)
    slope = difference(lambda *at: surface_height(*waters, *at), x, y, t)[:2]
    assert surface_slope(*waters, x, y, t) == pytest.approx(slope, abs=1e-9)


def test_nothing_flows_through_the_bed():
    assert velocity(*SHALLOW, 3.0, -2.0, -3.0, 4.1)[2] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("waters", [DEEP, SHALLOW], ids=["deep", "shallow"])
def test_the_pressure_is_the_air_s_at_the_surface_and_the_weight_of_still_water_far_below(waters):
    x, y, t = 3.0, -2.0, 4.1
    height = surface_height(*waters, x, y, t)
    assert water_pressure(*waters, x, y, height - 1e-9, t) == pytest.approx(0.0, abs=1e-4)
    assert water_pressure(*waters, x, y, height + 0.01, t) == 0.0
    if waters is DEEP:
        assert water_pressure(*waters, x, y, -900.0, t) == pytest.approx(1025.0 * 9.81 * 900.0, rel=1e-9)


def test_a_low_wave_s_pressure_drives_its_motion():
    """Euler's equation, linear: dp/dx = -rho du/dt."""
    waves, record = water(regular_wave(1e-3, 4.0, (1.0, 0.0), Site(5.0)), depth=5.0)
    x, y, z, t = 1.0, 0.0, -1.2, 0.6
    by_x, _, by_z, _ = difference(lambda *at: water_pressure(waves, record, *at), x, y, z, t)
    motion = orbital_motion(waves, record, x, y, z, t)
    assert by_x == pytest.approx(-1025.0 * motion.du, rel=2e-3)
    assert by_z == pytest.approx(-1025.0 * (9.81 + motion.dw), rel=1e-6)


def test_particles_drift_as_stokes_found():
    """The orbit's radius is a e^{kz} and the drift omega k a^2 e^{2kz}."""
    (wave,) = regular_wave(0.2, math.sqrt(2.0 * math.pi * 10.0 / 9.81), (1.0, 0.0))  # 10 m long
    waves, record = water([wave], phases=[0.0])
    for z0 in (-0.5, -2.0):
        place, dt, period = np.array([0.0, 0.0, z0]), 1e-3, 2.0 * math.pi / wave.frequency
        track = [place]
        for step in range(round(5 * period / dt)):
            middle = place + 0.5 * dt * velocity(waves, record, *place, step * dt)
            place = place + dt * velocity(waves, record, *middle, (step + 0.5) * dt)
            track.append(place)
        track = np.array(track)
        decay = math.exp(wave.wavenumber * track[:, 2].mean())
        assert np.ptp(track[:, 2]) / 2.0 == pytest.approx(wave.amplitude * decay, rel=0.02)
        drift = (track[-1, 0] - track[0, 0]) / (len(track) * dt)
        assert drift == pytest.approx(wave.frequency * wave.wavenumber * (wave.amplitude * decay) ** 2, rel=0.1)


def test_what_the_ramp_does_to_the_surface_it_does_to_the_water():
    still = sea([])
    components = regular_wave(0.5, 4.0, (1.0, 0.0))
    slow, grown = water(components, tau=2.0), water(components)
    share = 1.0 - math.exp(-1.5)
    assert velocity(*slow, 0.0, 0.0, -1.0, 3.0) == pytest.approx(share * velocity(*grown, 0.0, 0.0, -1.0, 3.0))
    assert velocity(*still, 0.0, 0.0, -1.0, 3.0).tolist() == [0.0, 0.0, 0.0]
