"""Trials of models that are integrated here: Nomoto's, a boat with linear drag, and an oscillator."""

import math

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

import vrx_mj
from vrx_mj.errors import CommandError
from vrx_mj.trials import (
    SimulatedVessel,
    VesselState,
    crash_stop,
    decay,
    decay_figures,
    pull_out,
    spiral,
    turning,
    zigzag,
)

U, K, T = 2.0, 0.2, 3.0
"""Speed [m/s], gain [1/s] and time constant [s] of Nomoto's model T r' + r = K helm."""


class Nomoto:
    """T r' + n1 r + n3 r^3 = K helm at a speed that follows power, by the midpoint rule."""

    draft = 1.0

    def __init__(self, n1=1.0, n3=0.0, drag=1.0, gain=K):
        self.n1, self.n3, self.drag, self.gain = n1, n3, drag, gain
        self.t = self.x = self.y = self.psi = self.r = self.u = 0.0

    @property
    def state(self):
        heading = math.remainder(self.psi + 2.5, 2.0 * math.pi)  # a heading that jumps
        cos, sin = math.cos(2.5), math.sin(2.5)
        x, y = cos * self.x - sin * self.y, sin * self.x + cos * self.y
        return VesselState(self.t, x, y, 0.0, heading, 0.0, 0.0, self.u, 0.0, self.r)

    def advance(self, power, helm, duration):
        dt = duration
        half = self.psi + 0.5 * dt * self.r
        before, self.u = self.u, U * power + (self.u - U * power) * math.exp(-self.drag * dt)
        self.x += dt * 0.5 * (before + self.u) * math.cos(half)
        self.y += dt * 0.5 * (before + self.u) * math.sin(half)
        rate = (self.gain * helm - self.n1 * self.r - self.n3 * self.r**3) / T
        middle = self.r + 0.5 * dt * rate
        self.psi += dt * middle
        self.r += dt * (self.gain * helm - self.n1 * middle - self.n3 * middle**3) / T
        self.t += dt


def values(trial):
    return {name: figure.value for name, figure in trial.figures.items()}


def turn(t, helm):
    """Heading after a time of a helm that is put over at once."""
    return K * helm * (t - T * (1.0 - math.exp(-t / T)))


@pytest.mark.parametrize("helm", [1.0, -0.5])
def test_a_turning_circle_is_that_of_the_model(helm):
    found = values(turning(Nomoto(), helm=helm))
    when = {angle: brentq(lambda t, a=angle: turn(t, abs(helm)) - a, 0.0, 100.0) for angle in (0.5, 1.0)}
    when = {angle: brentq(lambda t, a=angle: turn(t, abs(helm)) - a * math.pi, 0.0, 200.0) for angle in when}
    advance, transfer = (
        quad(lambda t, f=f: U * f(turn(t, abs(helm))), 0.0, when[0.5])[0] for f in (math.cos, math.sin)
    )
    diameter = quad(lambda t: U * math.sin(turn(t, abs(helm))), 0.0, when[1.0])[0]
    assert found["speed"] == pytest.approx(U, rel=1e-3)
    assert (found["advance"], found["transfer"]) == pytest.approx((advance, transfer), rel=2e-3)
    assert found["tactical_diameter"] == pytest.approx(diameter, rel=2e-3)
    assert (found["time_90"], found["time_180"]) == pytest.approx((when[0.5], when[1.0]), rel=2e-3)
    assert found["steady_radius"] == pytest.approx(U / (K * abs(helm)), rel=5e-3)
    assert found["steady_rate"] == pytest.approx(math.degrees(K * abs(helm)), rel=5e-3)
    assert (found["drift_angle"], found["speed_kept"]) == pytest.approx((0.0, 1.0), abs=2e-3)


def test_a_boat_that_turns_by_itself_has_a_steady_turn_alone_and_is_said():
    """r' T = K helm + r - 20 r^3 turns at sqrt(1 / 20) rad/s midships; the helm turns it back."""
    boat = Nomoto(n1=-1.0, n3=20.0)
    boat.r = -0.1
    trial = turning(boat)
    own = math.degrees(math.sqrt(1.0 / 20.0))
    (remark,) = trial.remarks
    begins, _, rest = remark.partition(" at ")
    assert begins == "the vessel does not keep a straight course: with the helm midships it turns to starboard"
    assert float(rest.removesuffix(" deg/s")) == pytest.approx(own, rel=0.1)  # it has not settled yet
    found = values(trial)
    known = {"speed", "steady_radius", "steady_rate", "drift_angle"}
    assert {name for name, value in found.items() if not math.isnan(value)} == known
    rate = math.radians(found["steady_rate"])
    assert K + rate - 20.0 * rate**3 == pytest.approx(0.0, abs=2e-2)


def test_a_boat_that_does_not_follow_its_helm_has_no_circle():
    boat = Nomoto(n1=-1.0, n3=20.0, gain=0.01)
    boat.r = -0.1
    trial = turning(boat)
    assert trial.remarks[-1].startswith("no steady turn: -")
    assert all(math.isnan(value) for name, value in values(trial).items() if name != "speed")


def test_a_straight_boat_has_no_remarks():
    assert (turning(Nomoto()).remarks, zigzag(Nomoto()).remarks) == ((), ())


def zigzag_by_events(helm, angle):
    """Overshoots, and times of the turnings of the helm, by integration that stops at events."""
    t, state, side, overshoots, times = 0.0, [0.0, 0.0], 1.0, [], []
    for _ in range(4):

        def reached(_t, y, side=side):
            return side * y[0] - angle

        reached.terminal = True
        part = solve_ivp(
            lambda _t, y, side=side: [y[1], (K * side * helm - y[1]) / T], (t, t + 200.0), state,
            events=reached, rtol=1e-10, atol=1e-12, max_step=0.05,
        )  # fmt: skip
        if times:
            overshoots.append(np.max(-side * part.y[0]) - angle)
        t, state, side = part.t[-1], part.y[:, -1], -side
        times.append(t)
    return overshoots, times


def test_a_zigzag_is_that_of_the_model():
    found = values(zigzag(Nomoto(), helm=0.5, angle=20.0))
    overshoots, times = zigzag_by_events(0.5, math.radians(20.0))
    assert found["initial_turning_time"] == pytest.approx(times[0], abs=0.03)
    assert found["period"] == pytest.approx(times[2] - times[0], abs=0.05)
    assert (found["first_overshoot"], found["second_overshoot"]) == pytest.approx(np.degrees(overshoots[:2]), abs=0.15)
    assert times[0] < found["reach"] < times[1]


def test_a_boat_that_never_turns_has_no_zigzag():
    found = values(zigzag(Nomoto(gain=0.0), helm=0.5))
    assert all(math.isnan(value) for value in found.values())


def test_a_stable_boat_has_no_residual_rate_and_no_loop():
    found = values(pull_out(Nomoto()))
    assert found["rate_port"] == pytest.approx(math.degrees(K), rel=5e-3)
    assert (found["residual_port"], found["residual_starboard"]) == pytest.approx((0.0, 0.0), abs=1e-3)
    found = values(spiral(Nomoto()))
    assert found["loop_width"] == 0.0
    assert found["loop_height"] == pytest.approx(0.0, abs=0.02)
    assert found["rate_port"] == pytest.approx(math.degrees(K), rel=5e-3)


def test_an_unstable_boat_turns_on_and_has_a_loop():
    """Norrbin's model: midships it turns with +- sqrt(-n1 / n3); the loop ends at the extremes of n1 r + n3 r^3."""
    n1, n3 = -0.5, 10.0
    rate = math.degrees(math.sqrt(-n1 / n3))
    found = values(pull_out(Nomoto(n1, n3)))
    assert (found["residual_port"], found["residual_starboard"]) == pytest.approx((rate, -rate), rel=0.01)
    found = values(spiral(Nomoto(n1, n3)))
    assert found["loop_height"] == pytest.approx(2.0 * rate, rel=0.01)
    bound = 2.0 / (3.0 * math.sqrt(3.0)) * math.sqrt(-(n1**3) / n3) / K  # 0.215 of full helm
    assert 0.0 < found["loop_width"] <= 2.0 * bound
    assert found["loop_width"] > 2.0 * bound - 2.0 / 8.0  # in eighths of full helm


def test_a_crash_stop_is_that_of_linear_drag():
    """u' = -d (u + U): dead in the water after ln(2) / d, U (1 - ln(2)) / d ahead."""
    drag = 0.2
    found = values(crash_stop(Nomoto(drag=drag)))
    assert found["stopping_time"] == pytest.approx(math.log(2.0) / drag, rel=5e-3)
    assert found["head_reach"] == pytest.approx(U * (1.0 - math.log(2.0)) / drag, rel=5e-3)
    assert found["track_reach"] == pytest.approx(found["head_reach"], rel=1e-4)
    assert found["lateral_deviation"] == pytest.approx(0.0, abs=1e-9)


def test_a_boat_that_makes_no_way_stops_where_it_is():
    found = values(crash_stop(Nomoto(), power=0.0))
    assert [found[name] for name in ("speed", "stopping_time", "track_reach", "head_reach")] == pytest.approx([0.0] * 4)


def oscillation(alpha, beta, omega, start):
    time = np.arange(0.0, 40.0, 0.02)
    part = solve_ivp(
        lambda _t, y: [y[1], -2 * alpha * y[1] - beta * abs(y[1]) * y[1] - omega**2 * y[0]],
        (0.0, 40.0), [start, 0.0], t_eval=time, rtol=1e-10, atol=1e-12,
    )  # fmt: skip
    return decay_figures(time, part.y[0], "rad")


@pytest.mark.parametrize(("alpha", "extremes"), [(0.91, 3), (1.5, 2)])
def test_three_extremes_give_linear_damping_and_fewer_nothing(alpha, extremes):
    found = oscillation(alpha, 0.0, 2.0, 0.2)
    assert found["extremes"].value == extremes
    if extremes < 3:
        assert all(math.isnan(found[name].value) for name in found.keys() - {"extremes"})
    else:
        assert found["linear_damping"].value == pytest.approx(alpha, rel=0.03)
        assert found["damping_ratio"].value == pytest.approx(alpha / math.sqrt(4.0 - alpha**2), rel=0.03)
        assert found["quadratic_damping"].value == 0.0


@pytest.mark.parametrize(("alpha", "beta", "omega", "start"), [(0.05, 0.0, 2.0, 0.2), (0.02, 0.5, 1.5, -0.3)])
def test_a_decay_gives_its_damping_back(alpha, beta, omega, start):
    found = oscillation(alpha, beta, omega, start)
    assert found["period"].value == pytest.approx(2.0 * math.pi / math.sqrt(omega**2 - alpha**2), rel=5e-3)
    assert found["linear_damping"].value == pytest.approx(alpha, rel=0.03)
    assert found["quadratic_damping"].value == pytest.approx(beta, rel=0.05, abs=2e-3)
    assert found["quadratic_damping"].unit == "1/rad"


def test_what_does_not_swing_has_no_period():
    found = oscillation(3.0, 0.0, 1.0, 0.2)
    assert math.isnan(found["period"].value)
    assert math.isnan(found["linear_damping"].value)


def test_a_mode_that_is_not_there():
    with pytest.raises(CommandError) as error:
        decay(Nomoto(), mode="yaw")
    assert str(error.value) == "invalid mode 'yaw': heave, roll or pitch is needed"


@pytest.mark.parametrize("robot", ["cylinder", "blueboat"])
def test_a_boat_is_not_lifted_out_of_the_water_by_default(robot):
    """The heave is 0.1 m, or half the mean draft: m / (rho A) of the upright cylinder is 0.5 m."""
    fleet = {"robot": robot, "sensors": "none", "boats": [{"name": "a", "pose": [0.0] * 6}]}
    world = {"physics": {"profile": "marine"}, "sea": {"model": "none"}, "wind": {"objects": []}}
    sim = vrx_mj.Simulation(vrx_mj.compile_world(world, fleet=fleet))
    sim.step({}, duration=10.0)
    vessel = SimulatedVessel(sim, "a")
    weight = -sim.forces("a")["gravity"][2]
    if robot == "cylinder":
        assert vessel.draft == pytest.approx(0.5, rel=1e-3)
    vessel.displace("heave", min(0.1, 0.5 * vessel.draft))
    assert 0.4 < sim.forces("a")["hydrostatics"][2] / weight < 0.9


def test_a_boat_in_the_air_has_no_draft():
    world = {"physics": {"profile": "marine"}, "sea": {"model": "none"}}
    sim = vrx_mj.Simulation(vrx_mj.compile_world(world, fleet={"robot": "cylinder", "sensors": "none"}))
    sim.set_boat("wamv", pose=[0.0, 0.0, 50.0, 0.0, 0.0, 0.0])
    assert SimulatedVessel(sim, "wamv").draft == math.inf
