import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrx_mj import compile_world
from vrx_mj.drive.pilot import HELP, KEYS, Engine, Pilot, Wheel, engine_commands, engines_of, terminal_keys, window_key
from vrx_mj.drive.session import MAX_LAG, PACES, Pacer

LEFT = Engine("left", 1.0, -1.027135, True, 1.0)
RIGHT = Engine("right", 1.0, 1.027135, True, 1.0)
TWIN = (LEFT, RIGHT)


def pilot(*keys, boats=("wamv1", "wamv2", "wamv3")):
    made = Pilot(dict.fromkeys(boats, TWIN), boats[0])
    for key in keys:
        assert made.press(key)
    return made


def thrusts(made, boat="wamv1"):
    commands = made.commands()[boat]
    return commands["left"], commands["right"]


# VRX's twist2thrust: left = speed - turn, right = speed + turn, here within full power; speed 0.5, turn 1.0
TWISTS = {
    "i": (0.5, 0.5), ",": (-0.5, -0.5), "j": (-1.0, 1.0), "l": (1.0, -1.0),
    "u": (-0.5, 1.0), "o": (1.0, -0.5), "m": (0.5, -1.0), ".": (-1.0, 0.5), "k": (0.0, 0.0),
}  # fmt: skip


@pytest.mark.parametrize("key", TWISTS)
def test_the_keys_of_vrx_command_what_they_do_there(key):
    assert thrusts(pilot("i", key)) == TWISTS[key]


@pytest.mark.parametrize(
    ("keys", "power", "turn", "angle"),
    [("q", 0.55, 1.1, 0.1), ("z", 0.45, 0.9, 0.1), ("w", 0.55, 1.0, 0.1), ("x", 0.45, 1.0, 0.1), ("e", 0.5, 1.1, 0.1),
     ("c", 0.5, 0.9, 0.1), ("r", 0.5, 1.0, 0.11), ("v", 0.5, 1.0, 0.09), ("qq", 0.605, 1.21, 0.1)],
)  # fmt: skip
def test_sizes_change_by_a_tenth_and_drive_only_at_the_next_key(keys, power, turn, angle):
    made = pilot(*keys)
    assert made.commands() == {}
    made.press("u")
    made.press(";")
    assert (made.wheel.power, made.wheel.turn) == pytest.approx((power, turn))
    assert made.wheel.angle == pytest.approx(angle)


def test_the_angle_of_the_engines_stops_at_its_limit():
    made = pilot(*";" * 30)
    assert made.commands()["wamv1"] == {"left": 0.0, "right": 0.0, "left_angle": 1.0, "right_angle": 1.0}
    made.press("h")
    assert made.wheel.angle == pytest.approx(0.9)


def test_arrow_keys_add_tenths_up_to_full_power_and_space_stops():
    made = pilot("up", "up", "left")
    assert thrusts(made) == pytest.approx((0.1, 0.3))
    for _ in range(20):
        made.press("up")
    assert made.wheel == Wheel(1.0, 0.1)
    made.press("space")
    assert made.wheel == Wheel()


@given(st.lists(st.sampled_from(sorted(KEYS)), max_size=60))
def test_whatever_is_pressed_commands_stay_within_bounds(keys):
    made = Pilot(dict.fromkeys(("a", "b"), TWIN), "a")
    for key in keys:
        made.press(key)
    for commands in made.commands().values():
        assert all(abs(value) <= 1.0 for value in commands.values())


def test_each_boat_keeps_what_it_was_told():
    made = pilot("i", "tab", "j", "3")
    assert (made.boat, made.wheel) == ("wamv3", Wheel())
    assert (thrusts(made, "wamv1"), thrusts(made, "wamv2")) == ((0.5, 0.5), (-1.0, 1.0))
    assert set(made.commands()) == {"wamv1", "wamv2"}
    assert [pilot(*"n" * count).boat for count in range(4)] == ["wamv1", "wamv2", "wamv3", "wamv1"]
    made.reset()
    assert made.commands() == {}


def test_boats_that_come_and_go_leave_the_keys_with_theirs_while_it_is_there():
    made, engines = pilot("tab", "i"), dict(pilot()._engines)
    found = []
    for boats in (("wamv2", "wamv3"), ("wamv3", "wamv1"), (), ("wamv1", "wamv3")):
        made.change_boats({boat: engines[boat] for boat in boats})
        found.append((made.boat, set(made.commands())))
    assert found == [("wamv2", {"wamv2"}), ("wamv3", set()), ("", set()), ("wamv1", set())]
    made.change_boats({})
    assert not made.press("i")


def test_keys_without_a_meaning_are_refused():
    assert [key for key in ("4", "0", "y", "escape") if pilot().press(key)] == []


@pytest.mark.parametrize(
    ("fleet", "driven"),
    [
        ("H", {"left", "right"}),
        ("T", {"left", "right"}),
        ("X", {"left_rear", "right_rear", "left_front", "right_front"}),
    ],
)
def test_every_layout_of_the_wamv_turns_left_by_more_on_the_right(fleet, driven):
    engines = engines_of(compile_world("ocean", fleet={"usv_count": 1, "thrusters": fleet}), "wamv1")
    ahead, turning = (engine_commands(engines, Wheel(0.4, turn)) for turn in (0.0, 0.4))
    assert {engine.name for engine in engines} == driven
    assert all(ahead[name] == pytest.approx(0.4) for name in driven)
    assert all((turning[name] > ahead[name]) == name.startswith("right") for name in driven)


def test_a_rudder_turns_the_boat_that_has_one_propeller():
    engines = engines_of(compile_world("ocean", fleet={"usv_count": 1, "robot": "skiff"}), "wamv1")
    assert engine_commands(engines, Wheel(0.4, 0.4)) == {"propeller": 0.4, "rudder_angle": pytest.approx(-0.2)}


def test_an_engine_that_turns_steers_a_boat_without_a_pair():
    aft = Engine("motor", 1.0, 0.0, True, 0.3)
    assert engine_commands([aft], Wheel(0.5, 0.4)) == {"motor": 0.5, "motor_angle": pytest.approx(-0.2)}
    assert engine_commands([aft], Wheel(0.5, 1.0))["motor_angle"] == -0.3
    assert engine_commands([], Wheel(1.0, 1.0)) == {}


def test_an_engine_mounted_backward_pushes_forward_in_reverse():
    assert engine_commands([Engine("bow", -1.0, 0.0, False, 0.0)], Wheel(0.5)) == {"bow": -0.5}


WINDOW = {265: "up", 264: "down", 263: "left", 262: "right", 32: "space", 259: "backspace", 73: "i", 59: ";", 44: ",",
          322: "2", 333: "-", 334: "+", 61: "=", 256: None, 290: None}  # fmt: skip


@pytest.mark.parametrize("code", WINDOW)
def test_keys_of_the_window_have_names(code):
    assert window_key(code) == WINDOW[code]


def test_a_terminal_sends_sequences_for_some_keys():
    assert list(terminal_keys("iI \t\x7f\x1b[A\x1bOB\x1b[D2")) == [
        "i", "i", "space", "tab", "backspace", "up", "down", "left", "2",
    ]  # fmt: skip


@given(st.text())
def test_whatever_a_terminal_sends_gives_keys_of_ours(text):
    assert set(terminal_keys(text)) <= KEYS


def test_the_help_names_every_key():
    told = " ".join(text for _, text in HELP)
    words = {"up", "down", "left", "right", "=", "tab"} | set("23456780")
    assert [key for key in sorted(KEYS - words) if key not in told] == []


def test_time_keeps_its_pace_without_drift():
    pacer = Pacer(0.01, 1.5, 0.0)
    frames = [k * 0.0331 for k in range(1, 1001)]
    assert sum(pacer.due(now) for now in frames) == math.floor(1.5 * 33.1 / 0.01 + 1e-6)


def test_a_long_halt_is_not_made_up_for():
    pacer = Pacer(0.01, 1.0, 0.0)
    assert pacer.due(3600.0) == round(MAX_LAG / 0.01)


def test_nothing_is_due_or_owed_while_paused():
    pacer = Pacer(0.01, 1.0, 0.0)
    pacer.paused = True
    assert [pacer.due(now) for now in (0.1, 0.2)] == [0, 0]
    pacer.paused = False
    assert pacer.due(0.3) == 10


def test_the_pace_that_is_kept_is_measured_over_the_last_second():
    pacer = Pacer(0.01, 1.0, 0.0)
    assert pacer.real_pace == 0.0
    for frame in range(1, 41):
        pacer.did(5 if frame <= 20 else 10, frame / 10.0)
    assert pacer.real_pace == pytest.approx(1.0)
    pacer.restart(4.0)
    assert pacer.real_pace == 0.0
    for steps, now, pace in ((30, 4.4, 0.75), (10, 4.8, 0.5), (20, 5.2, 0.5), (60, 5.6, 0.75)):  # since 4.4 at the end
        pacer.did(steps, now)
        assert pacer.real_pace == pytest.approx(pace)


def test_the_pace_doubles_and_halves_within_bounds():
    pacer = Pacer(0.01, 1.0, 0.0)
    pacer.change(2.0)
    assert pacer.pace == 2.0
    for factor, bound in ((2.0, PACES[1]), (0.5, PACES[0])):
        for _ in range(20):
            pacer.change(factor)
        assert pacer.pace == bound


def test_where_commands_are_newtons_full_power_is_the_largest_force():
    strong = Engine("bow", 1.0, 0.0, False, 0.0, ahead=2000.0, astern=1000.0)
    assert engine_commands([strong], Wheel(0.5)) == {"bow": 1000.0}
    assert engine_commands([strong], Wheel(-0.5)) == {"bow": -500.0}


def test_the_keys_drive_a_boat_of_vrx_3_in_newtons():
    world = compile_world({"physics": {"profile": "vrx3"}, "spawn": {"thrusters": "H", "sensors": "none"}})
    found = {engine.name: (engine.ahead, engine.astern) for engine in engines_of(world, "wamv")}
    assert found == dict.fromkeys(("left", "right"), (2353.53383668, 1000.0))
