import math
from dataclasses import dataclass, replace

import numpy as np
import pytest

from vrx_mj.control.navigation import Estimate
from vrx_mj.control.pilot import Pilot
from vrx_mj.control.velocity import WAMV, WAMV_VRX3, wamv_of
from vrx_mj.errors import CommandError


@dataclass
class Engine:
    """A thruster whose command is its force."""

    position: tuple[float, float, float]
    direction: tuple[float, float, float] = (1.0, 0.0, 0.0)
    max_angle: float = math.pi / 2
    max_forward: float = 250.0
    max_reverse: float = -100.0
    in_newtons: bool = False

    def command(self, force):
        return force


PAIR = {"left": Engine((-2.65, 1.03, 0)), "right": Engine((-2.65, -1.03, 0))}
TRIO = {**PAIR, "lateral": Engine((0, -0.28, 0), (0, 1, 0))}


class Hull:
    """The model of the laws, integrated: mass, drag, thrusters, and a steady wind."""

    def __init__(self, engines, x=0.0, y=0.0, heading=0.0, wind=(0.0, 0.0, 0.0)):
        self.engines, self.wind = engines, wind
        self.x, self.y, self.heading = x, y, heading
        self.vx = self.vy = self.turn = self.t = 0.0

    @property
    def seen(self):
        c, s = math.cos(self.heading), math.sin(self.heading)
        turned = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        return Estimate(self.x, self.y, 0.0, self.heading, self.vx, self.vy, self.turn, turned)

    def go(self, commands, duration=0.1, step=0.01):
        for _ in range(round(duration / step)):
            surge, sway, yaw = self.forces(commands)
            seen = self.seen
            drag = WAMV.drag(seen.surge, seen.sway)
            c, s = math.cos(self.heading), math.sin(self.heading)
            ahead, left = surge - drag[0], sway - drag[1]
            self.vx += step * (ahead * c - left * s + self.wind[0]) / WAMV.mass
            self.vy += step * (ahead * s + left * c + self.wind[1]) / WAMV.mass
            moment = yaw - WAMV.centre * sway - WAMV.turning_drag(self.turn) + self.wind[2]
            self.turn += step * moment / WAMV.inertia
            self.x, self.y = self.x + step * self.vx, self.y + step * self.vy
            self.heading += step * self.turn
        self.t += duration

    def forces(self, commands):
        total = np.zeros(3)
        for name, engine in self.engines.items():
            angle = math.atan2(engine.direction[1], engine.direction[0]) + commands.get(f"{name}_angle", 0.0)
            fx, fy = commands[name] * math.cos(angle), commands[name] * math.sin(angle)
            total += fx, fy, engine.position[0] * fy - engine.position[1] * fx
        return total


def kept(hull, place, heading, duration):
    pilot = Pilot(hull.engines)
    for _ in range(round(duration * 10)):
        hull.go(pilot.hold(hull.seen, hull.t, *place, heading))
    return math.dist((hull.x, hull.y), place), abs(math.remainder(hull.heading - heading, math.tau))


@pytest.mark.parametrize("engines", [PAIR, TRIO], ids="HT")
@pytest.mark.parametrize("place", [(3.0, 0.0), (-3.0, 0.0), (0.0, 3.0), (0.0, -3.0)])
@pytest.mark.parametrize("heading", [-2.0, 0.0, 1.0, 3.1])
def test_every_pose_near_by_is_reached_and_kept(engines, place, heading):
    off, turned = kept(Hull(engines), place, heading, 40.0)
    assert off < 0.05
    assert turned < 0.05


@pytest.mark.parametrize("engines", [PAIR, TRIO], ids="HT")
def test_a_steady_wind_leaves_no_offset(engines):
    off, turned = kept(Hull(engines, wind=(30.0, -30.0, 15.0)), (0.0, 0.0), 0.5, 60.0)
    assert off < 0.01  # a law without the observer stands off by 30 N / (m 1.8 0.7) = 0.08 m
    assert turned < 0.01


@pytest.mark.parametrize(
    ("place", "heading", "sign"),
    [
        ((5.0, 0.0), 0.0, (1, 0, 0)),
        ((-5.0, 0.0), 0.0, (-1, 0, 0)),
        ((0.0, 5.0), 0.0, (0, 1, 0)),
        ((0, 0), 1.0, (0, 0, 1)),
    ],
)
def test_the_signs_of_the_forces(place, heading, sign):
    commands = Pilot(TRIO).hold(Hull(TRIO).seen, 0.0, *place, heading)
    surge, sway, yaw = Hull(TRIO).forces(commands)
    found = (surge, sway, yaw - WAMV.centre * sway)
    assert [int(np.sign(round(value, 6))) for value in found] == list(sign)


def test_a_velocity_is_kept_without_error():
    hull, pilot = Hull(TRIO, wind=(-20.0, 0.0, 0.0)), Pilot(TRIO)
    for _ in range(300):
        hull.go(pilot.sail(hull.seen, hull.t, 1.2, 0.5, math.atan2(0.5, 1.2)))
    assert (hull.vx, hull.vy) == pytest.approx((1.2, 0.5), abs=0.01)


def test_top_speed_is_where_drag_is_the_thrust():
    top = Pilot(PAIR).top_speed
    assert WAMV.drag(top, 0.0)[0] == pytest.approx(500.0)
    assert Pilot(PAIR).braking < 200.0 / WAMV.mass


def test_the_unit_of_commands_tells_the_craft():
    assert wamv_of(PAIR) is WAMV
    for strongest in (2353.5, 8.0):  # however weak they are
        newtons = {name: replace(engine, max_forward=strongest, in_newtons=True) for name, engine in PAIR.items()}
        assert wamv_of(newtons) is WAMV_VRX3


def test_linear_drag_alone_has_a_top_speed():
    assert replace(WAMV, surge_drag=(50.0, 0.0)).top_speed(100.0) == 2.0


@pytest.mark.parametrize("heading", [3.1, -3.1, 0.3])
def test_a_heading_is_the_same_however_many_turns_it_is_given_with(heading):
    seen = replace(Hull(TRIO).seen, heading=3.0)
    given = [Pilot(TRIO).sail(seen, 0.0, 0.5, 0.0, heading + turns * math.tau) for turns in (-1, 0, 1)]
    assert given[0] == pytest.approx(given[1])
    assert given[2] == pytest.approx(given[1])


def test_what_turns_the_boat_all_the_time_does_not_turn_it_off_its_heading():
    hull, pilot = Hull(TRIO, wind=(0.0, 0.0, 60.0)), Pilot(TRIO)
    for _ in range(400):
        hull.go(pilot.hold(hull.seen, hull.t, 0.0, 0.0, 0.0))
    assert abs(hull.heading) < 0.01


def test_a_boat_that_nothing_turns_is_refused():
    engine = Engine((-1.2, 0.0, 0.0), max_angle=0.0)
    message = r"^this boat cannot turn with middle: a second engine, a rudder or an angle of 60 degrees is needed$"
    with pytest.raises(CommandError, match=message):
        Pilot({"middle": engine})
