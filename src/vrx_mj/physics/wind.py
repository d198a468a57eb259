"""Wind: gusts about a mean, in one direction, and what it does to what floats."""

import math

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.motion import Motion, Wrench, from_origin, rotate, rotated_wrench, unrotate_level, velocity_of
from vrx_mj.physics.noise import normal
from vrx_mj.physics.tables import MARINE, VRX3, Record, Table
from vrx_mj.physics.windage import windage_load


@kernel
def gust_step(wind: Record, state: Record, dt: float) -> float:
    """Advance the gust in `state` by `dt` [s] and return the wind's speed [m/s].

    VRX's first-order Gauss-Markov process, one normal number a step:
    g += dt / tau (-g + gain sqrt(2 tau / dt) xi). Its standard deviation is `gain` / sqrt(1 - dt / (2 tau)).
    The speed may become negative: the wind then blows backwards. VRX 3 takes its first step for one of 1 ms
    (`wind.first_step`), however long it is.
    """
    if wind.gain != 0.0:
        tau = wind.time_constant
        if wind.first_step > 0.0 and state.counter == 0:
            dt = wind.first_step
        kick = wind.gain * math.sqrt(2.0 * tau / dt) * normal(wind.key, state.counter)
        state.gust += dt / tau * (kick - state.gust)
        state.counter += np.uint64(1)
    state.speed = wind.mean + state.gust
    return float(state.speed)


@kernel
def wind_velocity(wind: Record, state: Record) -> tuple[float, float]:
    """Return the wind's velocity [m/s] east and north, where it blows toward."""
    return state.speed * wind.direction[0], state.speed * wind.direction[1]


@kernel
def wind_step(wind: Record, state: Record, bands: Table, air: Table, air_state: Table, dt: float) -> None:
    """Advance gusts and direction by `dt` [s]; without `air`, of 0 or 1 rows, it is `gust_step`.

    Gusts of a spectrum are gain sqrt(2 / N) sum cos(omega_i t + phase_i) over the N `bands`, whose standard deviation
    is `wind.gain`. The direction is off by turning t + v, where v is an exact Gauss-Markov process:
    v' = v exp(-dt / tau) + spread sqrt(1 - exp(-2 dt / tau)) xi.
    """
    for i in range(air.size):
        own, now = air[i], air_state[i]
        if own.spread > 0.0:
            keep = math.exp(-dt / own.time_constant)
            now.deviation = keep * now.deviation + own.spread * math.sqrt(1.0 - keep * keep) * normal(
                own.key, now.counter
            )
        now.counter += np.uint64(1)
        t = float(now.counter) * dt
        now.angle = own.turning * t + now.deviation
        if bands.size > 0:
            state.gust = wind.gain * _harmonics(bands, t)
            state.speed = wind.mean + state.gust
    if bands.size == 0:
        gust_step(wind, state, dt)


@kernel
def _harmonics(bands: Table, t: float) -> float:
    """Return the sum of the bands' harmonics at a time [s], of variance 1."""
    total = 0.0
    for i in range(bands.size):
        total += math.cos(bands[i].frequency * t + bands[i].phase)
    return total * math.sqrt(2.0 / bands.size)


@kernel
def air_velocity(wind: Record, state: Record, air_state: Table) -> tuple[float, float]:
    """Return `wind_velocity`, turned by the angle in `air_state` if there is one."""
    east, north = wind_velocity(wind, state)
    for i in range(air_state.size):
        cos, sin = math.cos(air_state[i].angle), math.sin(air_state[i].angle)
        east, north = cos * east - sin * north, sin * east + cos * north
    return east, north


@kernel
def wind_series(
    wind: Record, state: Record, bands: Table, air: Table, air_state: Table, dt: float, out: FloatArray
) -> None:
    """Advance by steps of `dt` [s], and write the velocity [m/s] east and north after each into `out`, (steps, 2)."""
    for n in range(out.shape[0]):
        wind_step(wind, state, bands, air, air_state, dt)
        out[n, 0], out[n, 1] = air_velocity(wind, state, air_state)


@kernel
def wind_share(air: Table, z: float) -> float:
    """Return the wind's speed at a height `z` [m] above the water over that at `air.height`: 1 without `air`.

    Power law (z / h)^exponent, or the logarithmic profile ln(z / z0) / ln(h / z0), which is 0 up to the roughness
    length z0 (DNV-RP-C205, 2.3.2).
    """
    share = 1.0
    for i in range(air.size):
        own = air[i]
        if own.roughness > 0.0:
            share = math.log(max(z, own.roughness) / own.roughness) / math.log(own.height / own.roughness)
        elif own.exponent > 0.0:
            share = (max(z, 0.0) / own.height) ** own.exponent
    return share


@kernel
def wind_at_hull(hull: Record, air: Table, wind_vector: tuple[float, float]) -> tuple[float, float]:
    """Return the wind [m/s] at the height at which it acts on a hull; on one without windage, at its own height."""
    if hull.windage_count == 0:
        return wind_vector
    share = wind_share(air, hull.windage_height)
    return share * wind_vector[0], share * wind_vector[1]


@kernel
def wind_load(coefficients: FloatArray, motion: Motion, wind_vector: tuple[float, float]) -> Wrench:
    """Return the wind's wrench: world axes, about the link's centre of mass.

    In body axes X = cx u |u|, Y = cy v |v|, N = -2 cz u v, with (u, v) the wind [m/s] and `coefficients`
    (cx, cy [N s2/m2], cz [N m s2/m2]). VRX's quirk is kept: it is the *true* wind, so the link's own velocity
    changes nothing and the wind damps nothing.
    """
    u, v, _ = unrotate_level(motion, wind_vector[0], wind_vector[1])
    fx = coefficients[0] * u * abs(u)
    fy = coefficients[1] * v * abs(v)
    turning = -2.0 * coefficients[2] * u * v
    return rotated_wrench(motion, Wrench(fx, fy, 0.0, 0.0, 0.0, turning))


@kernel
def apparent_wind_load(coefficients: FloatArray, motion: Motion, wind_vector: tuple[float, float]) -> Wrench:
    """Return the wind's wrench as VRX 3 has it: world axes, about the link's *origin*.

    With (rx, ry) the wind less the velocity of the link's origin over ground [m/s], in *world* axes: force
    (cx rx |rx|, cy ry |ry|), torque -2 cz rx ry about the vertical. VRX 3's quirk is kept: the coefficients belong to
    east and north, so that the force on a boat depends on where the wind comes from and not on the boat's heading.
    """
    rx, ry = _apparent_wind(wind_vector, motion)
    fx = coefficients[0] * rx * abs(rx)
    fy = coefficients[1] * ry * abs(ry)
    return Wrench(fx, fy, 0.0, 0.0, 0.0, -2.0 * coefficients[2] * rx * ry)


@kernel
def _apparent_wind(wind_vector: tuple[float, float], motion: Motion) -> tuple[float, float]:
    """Return the wind less the velocity of the link's origin [m/s, world]: the apparent wind."""
    vx, vy, _ = rotate(motion, velocity_of(motion))
    return wind_vector[0] - vx, wind_vector[1] - vy


@kernel
def wind_on_hull(hull: Record, windage: Table | None, motion: Motion, wind_vector: tuple[float, float]) -> Wrench:
    """Return what the wind does to a hull by the profile of its row: world axes, about `hull.link_com`.

    `windage` is `tables.WINDAGE`; None where no hull has any.
    """
    if windage is not None and hull.windage_count > 0:
        return windage_load(hull, windage, motion, wind_vector)
    return _wind_by_profile(hull, hull.link_com, motion, wind_vector)


@kernel
def _wind_by_profile(row: Record, com: FloatArray, motion: Motion, wind_vector: tuple[float, float]) -> Wrench:
    """Return the wind's wrench by the profile and coefficients of a row: world axes, about `com` [m], body axes."""
    if row.profile == MARINE:
        return wind_load(row.wind, motion, _apparent_wind(wind_vector, motion))
    if row.profile == VRX3:
        return from_origin(apparent_wind_load(row.wind, motion, wind_vector), motion, com)
    return wind_load(row.wind, motion, wind_vector)


@kernel
def wind_on_float(item: Record, motion: Motion, wind_vector: tuple[float, float]) -> Wrench:
    """Return what the wind does to a floating object: world axes, about its centre of mass."""
    return _wind_by_profile(item, item.com, motion, wind_vector)
