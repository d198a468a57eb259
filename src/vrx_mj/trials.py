"""Trials of boats, as ITTC and IMO have them: turning circle, zigzag, crash stop, pull-out, spiral and free decay.

References: ITTC 7.5-04-02-01; IMO MSC.137(76). A vessel takes a power and a helm, and has a position, a heading and
speeds.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.errors import CommandError
from vrx_mj.runtime.simulation import Simulation

_FULL_HELM = math.radians(35.0)
"""Angle of rudders and turning engines at full helm [rad], unless they turn less."""
_AHEAD_COSINE = 0.7
"""Least cosine of the angle between its thrust and the bow of an engine that drives the boat."""
_SAMPLE_TIME = 0.02
"""Time between two states of a track [s]."""
_STEADY_CHANGE = 1e-3
"""Relative change of a speed over `_STEADY_TIME` below which it counts as steady."""
_STEADY_TIME = 5.0
"""Time over which a speed has to stay the same [s]."""
_STRAIGHT = math.radians(0.5)
"""Rate of turn up to which an approach counts as straight [rad/s]."""
_MAX_TIME = 600.0
"""Longest time of a part of a trial [s]."""
_CIRCLE_ANGLE = 3.0 * math.pi
"""Change of heading of a turning circle [rad]."""
_STEPS = 8
"""Helm settings of a spiral between midships and full helm."""
MODES = {"heave": 0.1, "roll": math.radians(10.0), "pitch": math.radians(5.0)}
"""Default initial displacement by mode of motion [m], [rad]; in heave at most half the mean draft."""
_NUDGE = 1e-3
"""Heave by which the slope of buoyancy is measured [m]."""
_UNITS = {"heave": "m", "roll": "rad", "pitch": "rad"}
_DECAY_STEP = 0.02
"""Time between two states [s]."""
_REST_TIME = 30.0
"""Time to come to rest before the decay, and longest time of the decay [s]."""
_MIN_EXTREME = 0.02
"""Extremes below this share of the first are left out."""


class VesselState(NamedTuple):
    """State of a vessel; horizontal axes may be any, and velocities are those of its own axes."""

    time: float
    """Time [s]."""
    x: float
    """Position along x [m]."""
    y: float
    """Position along y [m]."""
    z: float
    """Height [m]."""
    heading: float
    """Heading [rad], counter-clockwise from x."""
    roll: float
    """Roll [rad]."""
    pitch: float
    """Pitch [rad]."""
    surge: float
    """Speed ahead [m/s]."""
    sway: float
    """Speed to port [m/s]."""
    yaw_rate: float
    """Rate of turn [rad/s], counter-clockwise."""


class Vessel(Protocol):
    """Vessel of a trial: a boat of a simulation, or a model of one."""

    @property
    def state(self) -> VesselState:
        """The state now."""

    @property
    def draft(self) -> float:
        """Mean draft [m]: the displaced volume over the area of the waterplane."""

    def advance(self, power: float, helm: float, duration: float) -> None:
        """Go on for a duration [s] under power -1 to 1 and helm -1 to 1, positive to port."""

    def displace(self, mode: str, amount: float) -> None:
        """Displace it by an amount, at rest: `heave` [m], `roll` or `pitch` [rad]."""


class SimulatedVessel:
    """A boat of a simulation.

    The helm turns rudders, or engines that can be turned, by up to 35 degrees; without any of these the engines of the
    inner side give less, and none at full helm.
    """

    def __init__(self, sim: Simulation, boat: str) -> None:
        """Take a boat, which needs at least one engine that drives it ahead for anything but a decay."""
        self._sim, self._boat = sim, boat
        seen = sim.observe()[boat]
        thrusters = seen.thrusters.values()
        self._engines = [engine for engine in thrusters if engine.direction[0] > _AHEAD_COSINE]
        rudders = seen.hull.rudders.values() if seen.hull else ()
        self._rudders = {f"{rudder.name}_angle": min(rudder.max_angle, _FULL_HELM) for rudder in rudders}
        if not self._rudders:
            turning = (engine for engine in self._engines if engine.max_angle > 0.0)
            self._rudders = {f"{engine.name}_angle": min(engine.max_angle, _FULL_HELM) for engine in turning}

    @property
    def helm(self) -> str:
        """Description of the helm."""
        if self._rudders:
            degrees = math.degrees(max(self._rudders.values()))
            return f"{', '.join(sorted(self._rudders))}: up to {degrees:.3g} degrees"
        return "less thrust on the inner side: none at full helm"

    @property
    def state(self) -> VesselState:
        """The state of the boat now."""
        seen = self._sim.observe()[self._boat]
        x, y, z = (float(value) for value in seen.position)
        return VesselState(
            self._sim.time, x, y, z, seen.heading, seen.roll, seen.pitch,
            float(seen.velocity[0]), float(seen.velocity[1]), float(seen.angular_velocity[2]),
        )  # fmt: skip

    @property
    def draft(self) -> float:
        """Mean draft [m] where the boat floats, by the slope of its buoyancy, infinite without; it is put at rest."""
        lifts = []
        for amount in (_NUDGE, -2.0 * _NUDGE, _NUDGE):
            self.displace("heave", amount)
            lifts.append(float(self._sim.forces(self._boat)["hydrostatics"][2]))
        above, below, here = lifts
        return here * 2.0 * _NUDGE / (below - above) if below > above else math.inf

    def advance(self, power: float, helm: float, duration: float) -> None:
        """Go on for a duration [s].

        Raises:
            CommandError: the boat has no engine, and power is asked of it.
        """
        if power and not self._engines:
            raise CommandError(
                f"boat '{self._boat}' has no engine that drives it ahead: only the trial decay is possible"
            )
        steering = {name: -helm * most for name, most in self._rudders.items()}
        self._sim.step({self._boat: {**self._thrusts(power, helm), **steering}}, duration=duration)

    def _thrusts(self, power: float, helm: float) -> dict[str, float]:
        """Commands of the engines; astern the engines of the inner side give less, too."""
        found = {}
        for engine in self._engines:
            inner = not self._rudders and engine.position[1] * helm > 0.0
            found[engine.name] = power * engine.max_command * (1.0 - abs(helm) * inner)
        return found

    def displace(self, mode: str, amount: float) -> None:
        """Displace the boat from its pose, at rest."""
        now = self.state
        moved = {"z": now.z, "roll": now.roll, "pitch": now.pitch}
        moved["z" if mode == "heave" else mode] += amount
        pose = (now.x, now.y, moved["z"], moved["roll"], moved["pitch"], now.heading)
        self._sim.set_boat(self._boat, pose=pose, velocity=(0.0, 0.0, 0.0, 0.0, 0.0, 0.0))


@dataclass(frozen=True)
class Figure:
    """A number of a trial."""

    value: float
    """Value; NaN if the trial did not get to it."""
    unit: str
    """Unit of the value."""
    meaning: str
    """Meaning of the number, in words."""


@dataclass(frozen=True)
class Track:
    """States of a vessel over time, (n,) each, from the moment at which the trial begins.

    x points along the heading at that moment, y to its left.
    """

    time: FloatArray
    """Time [s]."""
    x: FloatArray
    """Distance ahead [m]."""
    y: FloatArray
    """Distance to port [m]."""
    heading: FloatArray
    """Change of heading [rad], positive to port, without jumps."""
    surge: FloatArray
    """Speed ahead [m/s]."""
    sway: FloatArray
    """Speed to port [m/s]."""
    yaw_rate: FloatArray
    """Rate of turn [rad/s], positive to port."""
    helm: FloatArray
    """Helm -1 to 1, positive turns to port."""


def track_of(states: Sequence[VesselState], helms: Sequence[float]) -> Track:
    """The track of states and of the helm at each, from the first of them."""
    time, x, y, _, heading, _, _, surge, sway, rate = np.array(states, np.float64).T
    cos, sin = math.cos(heading[0]), math.sin(heading[0])
    east, north = x - x[0], y - y[0]
    return Track(
        time - time[0], cos * east + sin * north, cos * north - sin * east, np.unwrap(heading) - heading[0],
        surge, sway, rate, np.array(helms, np.float64),
    )  # fmt: skip


@dataclass(frozen=True)
class Trial:
    """A trial that has been carried out."""

    name: str
    """Name of the trial."""
    figures: Mapping[str, Figure]
    """Figures of the trial by name."""
    curves: Mapping[str, tuple[FloatArray, FloatArray]]
    """Curves of its chart by name: abscissae and ordinates."""
    axes: tuple[str, str]
    """Names and units of the chart's axes."""
    track: Track
    """States of the vessel."""
    remarks: tuple[str, ...] = ()
    """Why figures are missing, or are not what they seem."""


def crossing(x: FloatArray, y: FloatArray, level: float) -> float:
    """Abscissa at which ordinates first reach a level from below, by a straight line; NaN if they do not."""
    beyond = np.flatnonzero(y >= level)
    if not len(beyond) or beyond[0] == 0:
        return math.nan
    i = int(beyond[0])
    return float(x[i - 1] + (level - y[i - 1]) / (y[i] - y[i - 1]) * (x[i] - x[i - 1]))


def sail_until(
    vessel: Vessel, power: float, helm: float, done: Callable[[list[VesselState]], bool], most: float = _MAX_TIME
) -> list[VesselState]:
    """States every `_SAMPLE_TIME` from now until a condition on them holds, or a time [s] is over."""
    states = [vessel.state]
    while not done(states) and len(states) < most / _SAMPLE_TIME:
        vessel.advance(power, helm, _SAMPLE_TIME)
        states.append(vessel.state)
    return states


def _is_steady(value: Callable[[VesselState], float], least: float) -> Callable[[list[VesselState]], bool]:
    """Whether a value has not changed for a while; changes below `least` count as none."""

    def steady(states: list[VesselState]) -> bool:
        count = round(_STEADY_TIME / _SAMPLE_TIME)
        if len(states) <= 2 * count:
            return False
        recent = [value(state) for state in states[-count::10]]
        return max(recent) - min(recent) <= max(_STEADY_CHANGE * abs(recent[-1]), least)

    return steady


def approach(vessel: Vessel, power: float) -> list[VesselState]:
    """States of sailing straight ahead until the speed is steady."""
    return sail_until(vessel, power, 0.0, _is_steady(lambda state: state.surge, 1e-4))


def approach_remarks(states: list[VesselState]) -> tuple[str, ...]:
    """Remarks about an approach at whose end the vessel turns with its helm midships."""
    rate = float(np.mean([state.yaw_rate for state in states[-round(_STEADY_TIME / _SAMPLE_TIME) :]]))
    if abs(rate) <= _STRAIGHT:
        return ()
    turns = f"turns to {'port' if rate > 0.0 else 'starboard'} at {math.degrees(abs(rate)):.3g} deg/s"
    return (f"the vessel does not keep a straight course: with the helm midships it {turns}",)


def turning(vessel: Vessel, *, power: float = 1.0, helm: float = 1.0) -> Trial:
    """Turning circle: helm over at steady speed until the heading has changed by 540 degrees to its side.

    After an approach that was not straight there are figures of the steady turn alone, and none of it before that.

    Args:
        vessel: what is tried.
        power: of the approach, 0 to 1, kept in the turn.
        helm: -1 to 1, positive to port.
    """
    begun, side, turned = approach(vessel, power), math.copysign(1.0, helm), _HeadingChange()
    states = sail_until(vessel, power, helm, lambda seen: side * turned.update(seen[-1]) >= _CIRCLE_ANGLE)
    track, remarks = track_of(states, [helm] * len(states)), approach_remarks(begun)
    speed, heading, across = begun[-1].surge, side * track.heading, side * track.y
    last = track.heading * side >= heading[-1] - math.tau
    straight, steady = math.nan if remarks else 1.0, 1.0 if side * turned.angle >= _CIRCLE_ANGLE else math.nan
    if math.isnan(steady):
        remarks += (f"no steady turn: {math.degrees(heading[-1]):.3g} degrees with the helm in {track.time[-1]:.4g} s",)
    rate = steady * float(np.mean(side * track.yaw_rate[last]))
    velocity = steady * float(np.mean(np.hypot(track.surge, track.sway)[last]))
    drift = steady * float(np.mean(np.arctan2(-side * track.sway, track.surge)[last]))

    def at(values: FloatArray, angle: float) -> float:
        return straight * crossing(values, heading, angle)

    figures = {
        "speed": Figure(speed, "m/s", "speed of the approach"),
        "advance": Figure(at(track.x, 0.5 * math.pi), "m", "advance at 90 degrees of heading"),
        "transfer": Figure(at(across, 0.5 * math.pi), "m", "transfer at 90 degrees of heading"),
        "tactical_diameter": Figure(at(across, math.pi), "m", "transfer at 180 degrees of heading"),
        "time_90": Figure(at(track.time, 0.5 * math.pi), "s", "time to 90 degrees of heading"),
        "time_180": Figure(at(track.time, math.pi), "s", "time to 180 degrees of heading"),
        "steady_radius": Figure(velocity / rate if rate > 0.0 else math.nan, "m", "radius of the last full turn"),
        "steady_rate": Figure(math.degrees(rate), "deg/s", "rate of turn in the last full turn"),
        "drift_angle": Figure(
            math.degrees(drift), "deg", "angle of the bow inside the track, at the vessel's origin"
        ),
        "speed_kept": Figure(straight * velocity / speed, "", "speed in the turn over that of the approach"),
    }  # fmt: skip
    curves, axes = {"track": (track.x, track.y)}, ("advance [m]", "transfer to port [m]")
    return Trial("turning", figures, curves, axes, track, remarks)


class _HeadingChange:
    """Change of a vessel's heading since the first state [rad], positive to port, without jumps."""

    def __init__(self) -> None:
        self._last: float | None = None
        self.angle = 0.0

    def update(self, state: VesselState) -> float:
        """Take the next state, and return the change."""
        if self._last is not None:
            self.angle += math.remainder(state.heading - self._last, math.tau)
        self._last = state.heading
        return self.angle


def zigzag(vessel: Vessel, *, power: float = 1.0, helm: float = 0.5, angle: float = 20.0) -> Trial:
    """Zigzag: helm to port until the heading has changed by an angle, to starboard until as much beyond, and so on.

    Args:
        vessel: what is tried.
        power: of the approach, 0 to 1.
        helm: share of full helm, above 0 to 1.
        angle: change of heading at which the helm is turned over [degrees].
    """
    begun = approach(vessel, power)
    bound, states, helms = math.radians(angle), [vessel.state], [helm]
    turns: list[int] = []
    side, turned = 1.0, _HeadingChange()
    turned.update(states[0])
    while len(turns) < 4 and len(states) < _MAX_TIME / _SAMPLE_TIME:
        vessel.advance(power, side * helm, _SAMPLE_TIME)
        states.append(vessel.state)
        helms.append(side * helm)
        turned.update(states[-1])
        if side * turned.angle >= bound:
            turns.append(len(states) - 1)
            side = -side
    track = track_of(states, helms)
    degrees = np.degrees(track.heading)
    overshoots = []
    for number, (first, last) in enumerate(zip(turns, [*turns[1:], len(states)], strict=False)):
        peak = float(np.max((1.0 if number % 2 == 0 else -1.0) * degrees[first:last]))
        overshoots.append(peak - angle)
    overshoots += [math.nan] * (2 - len(overshoots))
    times = [float(track.time[turn]) for turn in turns] + [math.nan] * (4 - len(turns))
    figures = {
        "first_overshoot": Figure(overshoots[0], "deg", "heading beyond the angle after the helm's first reversal"),
        "second_overshoot": Figure(overshoots[1], "deg", "heading beyond the angle after its second reversal"),
        "initial_turning_time": Figure(times[0], "s", "time until the heading has changed by the angle"),
        "reach": Figure(_reach(track, turns), "s", "time until the heading is that of the approach again"),
        "period": Figure(times[2] - times[0], "s", "time between the helm's first and third reversals"),
    }
    curves = {"heading": (track.time, degrees), "helm, full is 35": (track.time, 35.0 * track.helm)}
    axes = "time [s]", "angle [degrees]"
    return Trial("zigzag", figures, curves, axes, track, approach_remarks(begun))


def _reach(track: Track, turns: list[int]) -> float:
    """Time at which the heading comes back to that of the approach [s]."""
    if not turns:
        return math.nan
    after = slice(turns[0], None)
    return crossing(track.time[after], -track.heading[after], 0.0)


def pull_out(vessel: Vessel, *, power: float = 1.0, helm: float = 1.0) -> Trial:
    """Pull-out: a steady turn, then helm midships: a boat that keeps its course stops turning.

    Args:
        vessel: what is tried.
        power: 0 to 1.
        helm: of the turns before, above 0 to 1; one is to port, one to starboard.
    """
    figures, curves, tracks = {}, {}, []
    for name, side in (("port", 1.0), ("starboard", -1.0)):
        approach(vessel, power)
        steady = sail_until(vessel, power, side * helm, _is_steady(lambda state: state.yaw_rate, 1e-5))
        before = steady[-1].yaw_rate
        states = sail_until(vessel, power, 0.0, lambda _: False, 60.0)
        track = track_of(states, [0.0] * len(states))
        residual = float(np.mean(track.yaw_rate[-round(_STEADY_TIME / _SAMPLE_TIME) :]))
        figures[f"rate_{name}"] = Figure(math.degrees(before), "deg/s", f"rate of the turn to {name}")
        meaning = f"rate of turn that is left 60 s after the turn to {name}"
        figures[f"residual_{name}"] = Figure(math.degrees(residual), "deg/s", meaning)
        curves[f"after a turn to {name}"] = (track.time, np.degrees(track.yaw_rate))
        tracks.append(track)
    return Trial("pull-out", figures, curves, ("time [s]", "rate of turn [deg/s]"), tracks[0])


def spiral(vessel: Vessel, *, power: float = 1.0, helm: float = 1.0) -> Trial:
    """Direct spiral (Dieudonne): steady rates of turn from full helm to port to starboard and back.

    Where a boat does not keep its course, the ways there and back differ: a loop, whose height and width are figures.

    Args:
        vessel: what is tried.
        power: 0 to 1.
        helm: largest helm, above 0 to 1.
    """
    approach(vessel, power)
    down = [helm * number / _STEPS for number in range(_STEPS, -_STEPS - 1, -1)]
    branches, states, helms = [], [vessel.state], [0.0]
    for settings in (down, down[::-1]):
        rates = []
        for setting in settings:
            part = sail_until(vessel, power, setting, _is_steady(lambda state: state.yaw_rate, 1e-5), 120.0)
            rates.append(math.degrees(part[-1].yaw_rate))
            states += part[1:]
            helms += [setting] * (len(part) - 1)
        branches.append(np.array(rates, np.float64))
    at, there, back = np.array(down, np.float64), branches[0], branches[1][::-1]
    apart = np.abs(there - back)
    noticed = at[apart > max(0.02 * float(np.ptp(there)), 1e-6)]
    figures = {
        "loop_height": Figure(float(apart[_STEPS]), "deg/s", "difference of the rates midships, there and back"),
        "loop_width": Figure(float(np.ptp(noticed)) if len(noticed) else 0.0, "", "helm between the loop's ends"),
        "rate_port": Figure(float(there[0]), "deg/s", "rate at the largest helm to port"),
        "rate_starboard": Figure(float(there[-1]), "deg/s", "rate at the largest helm to starboard"),
    }
    curves = {"port to starboard": (at, there), "and back": (at, back)}
    axes = ("helm, positive to port", "rate of turn [deg/s]")
    return Trial("spiral", figures, curves, axes, track_of(states, helms))


def crash_stop(vessel: Vessel, *, power: float = 1.0, astern: float = 1.0) -> Trial:
    """Crash stop: engines astern at steady speed, until the vessel is dead in the water.

    Args:
        vessel: what is tried.
        power: of the approach, 0 to 1.
        astern: power astern, 0 to 1.
    """
    begun = approach(vessel, power)
    states = sail_until(vessel, -astern, 0.0, lambda seen: len(seen) > 1 and seen[-1].surge <= 0.0)
    track = track_of(states, [0.0] * len(states))
    before, after = max(states[-2].surge, 0.0), states[-1].surge
    share = before / (before - after) if after < 0.0 else 1.0  # of the last piece, up to speed 0
    pieces = np.hypot(np.diff(track.x), np.diff(track.y))
    stopped = states[-1].surge <= 0.0
    end = [float(values[-2] + share * (values[-1] - values[-2])) for values in (track.time, track.x, track.y)]
    way = float(pieces[:-1].sum() + share * pieces[-1])
    figures = {
        "speed": Figure(begun[-1].surge, "m/s", "speed of the approach"),
        "stopping_time": Figure(end[0] if stopped else math.nan, "s", "time until it is dead in the water"),
        "track_reach": Figure(way if stopped else math.nan, "m", "distance along the track"),
        "head_reach": Figure(end[1] if stopped else math.nan, "m", "distance along the line of approach"),
        "lateral_deviation": Figure(end[2] if stopped else math.nan, "m", "distance to port of the line of approach"),
    }
    curves, axes = {"speed": (track.time, track.surge)}, ("time [s]", "speed ahead [m/s]")
    return Trial("crash-stop", figures, curves, axes, track, approach_remarks(begun))


def decay(vessel: Vessel, *, mode: str = "roll", amount: float | None = None) -> Trial:
    """Free decay: displaced in heave, roll or pitch at rest, and released.

    The figures are those of z'' + 2 alpha z' + beta |z'| z' + omega^2 z = 0: over half a period of amplitude a, the
    logarithm of the ratio of extremes is pi alpha / omega + 4/3 beta a (ITTC 7.5-02-07-04.5).

    Args:
        vessel: what is tried.
        mode: heave, roll or pitch.
        amount: initial displacement [m] or [rad]; by default 0.1 m, but at most half the mean draft, 10 degrees of
            roll or 5 of pitch.

    Raises:
        CommandError: unknown mode.
    """
    if mode not in MODES:
        raise CommandError(f"invalid mode '{mode}': heave, roll or pitch is needed")
    vessel.advance(0.0, 0.0, _REST_TIME)
    still = _value(vessel.state, mode)
    if amount is None:
        amount = min(MODES[mode], 0.5 * vessel.draft) if mode == "heave" else MODES[mode]
    vessel.displace(mode, amount)
    states = [vessel.state]
    for _ in range(round(_REST_TIME / _DECAY_STEP)):
        vessel.advance(0.0, 0.0, _DECAY_STEP)
        states.append(vessel.state)
    time: FloatArray = np.arange(len(states), dtype=np.float64) * _DECAY_STEP
    values = np.array([_value(state, mode) for state in states]) - still
    figures = decay_figures(time, values, _UNITS[mode])
    curves = {mode: (time, values)}
    axes = ("time [s]", f"{mode} from rest [{_UNITS[mode]}]")
    return Trial("decay", figures, curves, axes, track_of(states, [0.0] * len(states)))


def _value(state: VesselState, mode: str) -> float:
    return {"heave": state.z, "roll": state.roll, "pitch": state.pitch}[mode]


def decay_figures(time: FloatArray, values: FloatArray, unit: str) -> dict[str, Figure]:
    """Period and damping of a decay about 0; NaN with fewer than three extremes."""
    moments, sizes = _extremes(time, values)
    kept = sizes >= _MIN_EXTREME * sizes[0]
    count = int(np.argmin(kept)) if not kept.all() else len(kept)
    moments, sizes = moments[:count], sizes[:count]
    period = alpha = beta = math.nan
    if count >= 3:
        period = 2.0 * float(np.mean(np.diff(moments)))
        omega, ratios = math.tau / period, np.log(sizes[:-1] / sizes[1:])
        middles = 0.5 * (sizes[:-1] + sizes[1:])
        if count >= 4:
            slope, start = np.polyfit(middles, ratios, 1)
            alpha, beta = float(start) * omega / math.pi, 0.75 * float(slope)
        else:
            alpha, beta = float(ratios.mean()) * omega / math.pi, 0.0
    ratio = alpha * period / math.tau
    return {
        "period": Figure(period, "s", "period, between extremes"),
        "linear_damping": Figure(alpha, "1/s", "alpha of 2 alpha z'"),
        "damping_ratio": Figure(ratio, "", "alpha over the frequency"),
        "quadratic_damping": Figure(beta, f"1/{unit}", "beta of beta |z'| z'"),
        "extremes": Figure(float(count), "", "number of extremes used"),
    }


def _extremes(time: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Times and sizes of the extremes, by parabolas through three points; the start is the first."""
    found = [(float(time[0]), abs(float(values[0])))]
    for i in range(1, len(values) - 1):
        before, here, after = (float(values[k]) for k in (i - 1, i, i + 1))
        last = math.copysign(1.0, float(values[0])) * (-1.0) ** (len(found) - 1)  # extremes alternate
        if abs(here) > abs(before) and abs(here) >= abs(after) and here * last < 0.0:
            curve = before - 2.0 * here + after
            shift = 0.5 * (before - after) / curve if curve else 0.0
            found.append((float(time[i] + shift * (time[1] - time[0])), abs(here - 0.25 * (before - after) * shift)))
    moments, sizes = np.array(found).T
    return moments, sizes


TRIALS: Mapping[str, Callable[..., Trial]] = {
    "turning": turning,
    "zigzag": zigzag,
    "crash-stop": crash_stop,
    "pull-out": pull_out,
    "spiral": spiral,
    "decay": decay,
}
"""The trials by name, each a function of a vessel."""
