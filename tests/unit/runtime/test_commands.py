"""Commands: what a boat takes, for how long, and what it does with too much."""

import math

import numpy as np
import pytest

import vrx_mj
from integration.sailing import CALM, boats, simulation
from vrx_mj.errors import CommandError, UnknownNameError, VrxError
from vrx_mj.runtime.run import load_controller

NAN, INF = math.nan, math.inf


def calm(engines="fixed", timestep=0.01, **more):
    return simulation(boats((0.0, 0.0, 0.0), engines=engines), sea=CALM, wind=None, timestep=timestep, **more)


def thrusts(sim):
    return [float(value) for value in sim._live.arrays.thruster_state["thrust"]]


def angles(sim):
    return [float(value) for value in sim._live.arrays.thruster_state["angle"]]


REST = 0.0414236
"""Thrust at no command [N]: VRX's logistic curve, thrust_map.csv."""
FULL = 242.66587
"""Thrust at full command [N]: straight_100.csv."""


def test_a_boat_tells_its_commands():
    assert calm().command_names("a") == ("left", "right", "left_angle", "right_angle")


@pytest.mark.parametrize(
    ("commands", "message"),
    [
        ({"b": {}}, "no boat named 'b'; known: a"),
        ({"a": {"port": 1.0}}, "no thruster of a named 'port'; known: left, right, left_angle, right_angle"),
        ({"a": {"lefft": 1.0}}, "no thruster of a named 'lefft'; did you mean 'left'?"),
    ],
)
def test_an_unknown_name_is_told_with_those_that_are_known(commands, message):
    sim = calm()
    for give in (sim.step, sim.command_all):
        with pytest.raises(UnknownNameError) as caught:
            give(commands)
        assert str(caught.value) == message
    assert sim.time == 0.0


@pytest.mark.parametrize(
    "ask",
    [
        lambda sim: sim.command("b"),
        lambda sim: sim.forces("b"),
        lambda sim: sim.command_names("b"),
        lambda sim: sim.set_boat("b"),
    ],
)
def test_an_unknown_boat_is_one_wherever_it_is_named(ask):
    with pytest.raises(UnknownNameError, match=r"^no boat named 'b'; known: a$"):
        ask(calm())


@pytest.mark.parametrize("ask", [lambda sim: sim.observe_object("x"), lambda sim: sim.set_object("x")])
def test_an_unknown_object_is_one_too(ask):
    with pytest.raises(UnknownNameError, match=r"^no floating object named 'x'; known: none$"):
        ask(calm())


@pytest.mark.parametrize(("name", "value"), [("left", NAN), ("right_angle", -INF), ("left", "ahead"), ("left", None)])
def test_a_command_that_is_no_number_is_refused_and_none_is_set(name, value):
    sim = calm()
    before = sim.get_state().sha256
    with pytest.raises(CommandError) as caught:
        sim.step({"a": {"right": 1.0, name: value}})
    assert str(caught.value) == f"invalid command {value!r} for {name} of a: a finite number is needed"
    assert sim.get_state().sha256 == before


@pytest.mark.parametrize("value", [1, True, np.float32(1.0), np.int64(1)])
def test_whatever_is_a_number_will_do(value):
    sim = calm()
    sim.step({"a": {"left": value}})
    assert thrusts(sim)[0] == pytest.approx(FULL)


@pytest.mark.parametrize(
    ("commands", "message"),
    [
        (0.5, "invalid commands 0.5: a mapping by boat is needed, as in "),
        ({"a": 0.5}, "invalid commands 0.5 for a: a mapping by thruster is needed, as in "),
        ({"a": [1, 1]}, r"invalid commands \[1, 1\] for a: a mapping by thruster is needed, as in "),
    ],
)
def test_commands_of_another_shape_are_shown_the_right_one(commands, message):
    example = r"\{\"wamv1\": \{\"left\": 0.5, \"left_angle\": 0.1\}\}"
    with pytest.raises(CommandError, match=f"^{message}{example}$"):
        calm().step(commands)


@pytest.mark.parametrize(("duration", "near"), [(0.015, "0.01 or 0.02"), (1.004, "1 or 1.01")])
def test_a_duration_is_a_multiple_of_the_timestep(duration, near):
    assert refused(duration) == (
        f"invalid duration {duration:g} s: a multiple of the timestep 0.01 s is needed, such as {near} s"
    )


@pytest.mark.parametrize("duration", [0.0, NAN, INF, 0.009])
def test_a_duration_is_a_timestep_at_least(duration):
    assert refused(duration) == f"invalid duration {duration:g} s: at least one timestep, 0.01 s, is needed"


def refused(duration):
    sim = calm()
    with pytest.raises(CommandError) as caught:
        sim.step({"a": {"left": 1.0}}, duration=duration)
    assert sim.get_state().sha256 == calm().get_state().sha256
    return str(caught.value)


@pytest.mark.parametrize(("timestep", "duration"), [(0.01, 0.07), (0.01, 1.1), (0.003, 0.3), (0.001, 12.345)])
def test_a_duration_that_is_one_in_decimals_is_one(timestep, duration):
    sim = calm(timestep=timestep)
    sim.step(duration=duration)
    assert sim.time == pytest.approx(duration, abs=1e-9)


# How long a command holds


def test_a_command_times_out_after_a_second():
    sim = calm()
    sim.command("a", left=1.0)
    sim.advance(99)
    assert thrusts(sim) == pytest.approx([FULL, REST])
    sim.advance(2)
    assert thrusts(sim) == pytest.approx([REST, REST])


def test_a_command_that_is_renewed_goes_on():
    sim = calm()
    for _ in range(5):
        sim.command("a", left=1.0)
        sim.advance(90)
        assert thrusts(sim)[0] == pytest.approx(FULL)


def test_a_command_of_a_step_holds_for_all_of_it_and_a_second_at_least():
    sim = calm()
    sim.step({"a": {"left": 1.0}}, duration=3.0)
    assert thrusts(sim)[0] == pytest.approx(FULL)
    sim.step()
    assert thrusts(sim)[0] == pytest.approx(REST)
    sim.step({"a": {"left": 1.0}}, duration=0.1)
    sim.step(duration=0.89)
    assert thrusts(sim)[0] == pytest.approx(FULL)
    sim.step(duration=0.03)
    assert thrusts(sim)[0] == pytest.approx(REST)


def test_only_the_thrusters_that_are_named_are_commanded():
    sim = calm()
    sim.command("a", left=1.0)
    sim.advance(50)
    sim.command("a", right=-1.0)
    sim.advance(51)
    assert thrusts(sim) == pytest.approx([REST, -100.0])


@pytest.mark.parametrize("timeout", [0.0, -1.0])
def test_a_thruster_without_timeout_goes_on_for_ever(timeout):
    sim = calm(edit=lambda tree: [row.update(timeout=timeout) for row in tree["thrusters"]])
    sim.command("a", left=1.0)
    sim.advance(1000)
    assert thrusts(sim)[0] == pytest.approx(FULL)


@pytest.mark.parametrize(
    ("command", "force"), [(1.0, FULL), (1.5, 250.0), (100.0, 250.0), (-1.0, -100.0), (-3.0, -100.0)]
)
def test_beyond_full_power_the_force_is_the_mappings_up_to_its_limit(command, force):
    sim = calm()
    sim.step({"a": {"left": command}})
    assert thrusts(sim)[0] == pytest.approx(force, abs=0.2)


# Steering


@pytest.mark.parametrize("engines", ["fixed", "hinged"])
@pytest.mark.parametrize("command", [0.4, -math.pi])
def test_an_angle_is_clamped_and_does_not_time_out(engines, command):
    sim = calm(engines)
    sim.command("a", left_angle=command)
    sim.advance(500)
    limit = math.pi / 2
    assert angles(sim) == pytest.approx([min(max(command, -limit), limit), 0.0], abs=2e-3)


@pytest.mark.parametrize("timestep", [0.002, 0.01, 0.02])
@pytest.mark.parametrize("engines", ["fixed", "hinged"])
def test_a_servo_slews_at_10_rad_a_second_at_most(engines, timestep):
    sim = calm(engines, timestep)
    sim.command("a", left_angle=1.5, right_angle=-1.5)
    way = [np.zeros(2)]
    for _ in range(round(1.0 / timestep)):
        sim.advance(1)
        way.append(np.array(angles(sim)))
    fastest = np.abs(np.diff(way, axis=0)).max() / timestep
    assert 5.0 < fastest <= 10.0 + 1e-6
    assert way[-1] == pytest.approx([1.5, -1.5], abs=0.01)


def test_fixed_and_hinged_engines_steer_alike():
    fixed, hinged = (calm(engines) for engines in ("fixed", "hinged"))
    for sim in (fixed, hinged):
        sim.command("a", left_angle=0.8)
    for _ in range(100):
        for sim in (fixed, hinged):
            sim.advance(1)
        assert angles(fixed)[0] == pytest.approx(sim.data.joint("a/left_chasis_engine_joint").qpos[0], abs=0.15)
    assert angles(fixed)[0] == pytest.approx(0.8, abs=1e-3)


def test_a_turned_engine_pushes_where_it_points():
    """Both engines turned to port by a right angle push the stern to port, and so the bow to starboard."""
    sim = calm()
    sim.command("a", left_angle=math.pi / 2, right_angle=math.pi / 2)
    sim.advance(200)
    sim.step({"a": {"left": 1.0, "right": 1.0}})
    thrust = sim.forces("a")["thrust"]
    assert thrust[:3] == pytest.approx([0.0, 2 * FULL, 0.0], abs=25.0)
    assert thrust[5] < -900.0  # an arm of 2.37 m aft


# Poses


@pytest.mark.parametrize(
    ("what", "values"),
    [("pose", (0, 0, 0)), ("velocity", (0, 0, 0, 0, 0, NAN)), ("pose", (1e7, 0, 0, 0, 0, 0)), ("velocity", "sixsix"),
     ("pose", 3.0), ("velocity", (0,) * 7), ("pose", [[0] * 6])],
)  # fmt: skip
def test_a_pose_is_six_numbers_that_are_not_huge(what, values):
    sim = calm()
    before = sim.get_state().sha256
    with pytest.raises(CommandError) as caught:
        sim.set_boat("a", **{what: values})
    assert str(caught.value) == f"invalid {what} of a {values!r}: six numbers below 1e+07 are needed"
    assert sim.get_state().sha256 == before


def test_a_bad_velocity_leaves_the_pose_as_it_was():
    sim = calm()
    before = sim.get_state().sha256
    with pytest.raises(CommandError):
        sim.set_boat("a", pose=(1, 2, 3, 0, 0, 0), velocity=(NAN,) * 6)
    assert sim.get_state().sha256 == before


def test_a_boat_is_where_it_was_put_and_moves_as_it_was_told():
    sim = calm()
    pose, velocity = (10.0, -5.0, 0.2, 0.1, -0.2, 2.5), (1.0, 0.5, -0.2, 0.1, 0.2, -0.3)
    sim.set_boat("a", pose=pose, velocity=velocity)
    boat = sim.observe()["a"]
    assert [*boat.position, boat.roll, boat.pitch, boat.heading] == pytest.approx(pose)
    assert [*boat.velocity, *boat.angular_velocity] == pytest.approx(velocity)
    sim.set_boat("a", velocity=(0,) * 6)
    assert sim.observe()["a"].position == pytest.approx(pose[:3])


def test_velocities_are_those_of_the_origin_in_body_axes():
    """u, v, w against the way over ground in a step, turned into the boat's axes by hand."""
    sim = simulation()
    sim.step({"a": {"left": 1.0, "right": 0.3}}, duration=3.0)
    before = sim.observe()["a"]
    sim.advance(1)
    after = sim.observe()["a"]
    way = (after.position - before.position) / 0.01
    cos, sin = math.cos(after.heading), math.sin(after.heading)
    level = [cos * way[0] + sin * way[1], cos * way[1] - sin * way[0]]
    assert after.velocity[:2] == pytest.approx(level, abs=0.01)  # tilt of 0.02 rad, and the turn in a step
    assert after.speed == pytest.approx(math.hypot(*way[:2]), abs=1e-6)


def test_an_object_that_is_moved_to_other_water_is_not_kicked():
    world = {
        "sea": {"gain": 0.5, "period": 4, "scale": 2.5},
        "objects": [{"name": "ball", "model": "polyform_a5", "pose": [0, 0, 0.2, 0, 0, 0]}],
    }
    sim = vrx_mj.Simulation(vrx_mj.compile_world(world, fleet={"usv_count": 1, "positions": [{"x": 30, "y": 0}]}))
    sim.step(duration=10.0)
    level = float(sim.sea.height(9.0, 0.0, sim.time))
    sim.set_object("ball", pose=(9, 0, level + 0.247, 0, 0, 0), velocity=(0,) * 6)
    sim.step()
    assert abs(sim.observe_object("ball").velocity[2]) < 0.02  # the water itself moves by up to 0.5 m/s


def test_two_listeners_get_rows_at_their_own_rates():
    class Ear:
        __hash__ = None  # it equals others, too

        def __init__(self):
            self.times = []

        def __eq__(self, _other):
            return True

        def rows(self, block):
            self.times += block[:, 0].tolist()

        def state(self, time, blob):
            pass

        def event(self, time, text, level):
            pass

    sim = vrx_mj.Simulation(vrx_mj.compile_world({}))
    slow, fast = Ear(), Ear()
    sim.attach(slow, rate=10)
    sim.attach(fast, rate=20)
    with pytest.raises(CommandError, match=r"^invalid listener .*: it is already attached$"):
        sim.attach(fast, rate=5)
    sim.step(duration=1.0)
    sim.detach(fast)
    sim.step(duration=1.0)
    sim.detach(slow)
    assert fast.times == pytest.approx([0.05 * i for i in range(21)])  # the last is where it ended
    assert slow.times == pytest.approx([0.1 * i for i in range(21)])


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("json", "invalid controller 'json': module:function is needed, as in my_boat:controller"),
        (":f", "invalid controller ':f': module:function is needed, as in my_boat:controller"),
        ("./my.py:f", "invalid controller './my.py:f': module:function is needed, as in my_boat:controller"),
        ("no_such_boat:f", "no module named 'no_such_boat' for the controller 'no_such_boat:f'"),
        ("json:loda", "no controller in the module json named 'loda'; did you mean 'load'?"),
        ("json:decoder", "invalid controller 'json:decoder': a function, or a class with __call__, is needed"),
    ],
)
def test_what_is_no_controller_is_refused(name, message):
    with pytest.raises(VrxError) as caught:
        load_controller(name, 0)
    assert str(caught.value) == message


@pytest.mark.parametrize(("text", "takes"), [("def f(sim): ...", "(sim)"), ("def f(): ...", "()")])
def test_a_controller_that_takes_other_arguments_is_refused(text, takes, tmp_path, monkeypatch):
    (tmp_path / f"odd_{len(takes)}.py").write_text(text, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    name = f"odd_{len(takes)}:f"
    with pytest.raises(VrxError) as caught:
        load_controller(name, 0)
    assert str(caught.value) == (
        f"invalid controller '{name}{takes}': two arguments are needed, the observations by boat and the time [s]"
    )
