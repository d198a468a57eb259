"""Options of the command line that say more than one thing, and what a summary shows."""

import math
from types import SimpleNamespace

import pytest

from vrx_mj.cli.options import with_default_port
from vrx_mj.cli.ros import parse_lockstep, parse_rate
from vrx_mj.cli.sailing import parse_thrust
from vrx_mj.cli.screen import print_summary
from vrx_mj.errors import CommandError


def test_thrust_names_each_thruster_once():
    assert parse_thrust("left=0.5, right = -0.25") == {"left": 0.5, "right": -0.25}
    for text in ("left", "left=fast", "=1", "left=1,left=1", "left=0.5,right=1,left=0.2", ""):
        with pytest.raises(CommandError):
            parse_thrust(text)


@pytest.mark.parametrize(
    ("text", "topics"), [("A,B", ("A", "B")), ("step", ()), ("step,A", ("A",)), ("", ()), ("A,,B", ("A", "B"))]
)
def test_time_waits_for_topics_or_for_the_service_alone(text, topics):
    assert parse_lockstep(text) == topics


def test_a_rate_is_a_number_or_max():
    assert parse_rate("2.5") == 2.5
    assert parse_rate("max") is None
    with pytest.raises(CommandError):
        parse_rate("fast")


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["serve", "w", "--rosbridge"], ["serve", "w", "--rosbridge=9090"]),
        (["serve", "w", "--foxglove", "--truth"], ["serve", "w", "--foxglove=8765", "--truth"]),
        (["serve", "w", "--rosbridge", "9191"], ["serve", "w", "--rosbridge", "9191"]),
        (["serve", "--rosbridge", "w"], ["serve", "--rosbridge=9090", "w"]),
        (["campaign", "--rosbridge"], ["campaign", "--rosbridge"]),
        (["serve", "--localization", "w"], ["serve", "--localization=navigator", "w"]),
        (["serve", "w", "--localization", "truth"], ["serve", "w", "--localization", "truth"]),
        (["serve", "w", "--ardupilot", "--nmea"], ["serve", "w", "--ardupilot=9002", "--nmea=10110"]),
        (["serve", "--ardupilot", "a:7", "--nmea", "8"], ["serve", "--ardupilot", "a:7", "--nmea", "8"]),
        (["serve", "--nmea", "-a:7"], ["serve", "--nmea=10110", "-a:7"]),
        (["serve", "w", "--foxglove", "9\n"], ["serve", "w", "--foxglove=8765", "9\n"]),
        (["campaign", "--ray", "--jobs", "2"], ["campaign", "--ray=", "--jobs", "2"]),
        (["campaign", "--ray", "auto"], ["campaign", "--ray", "auto"]),
        (["campaign", "--ray", "head:10001"], ["campaign", "--ray", "head:10001"]),
        (["run", "campaign", "--ray"], ["run", "campaign", "--ray"]),
        (["teleop", "--web"], ["teleop", "--web=8090"]),
    ],
)
def test_a_value_may_be_left_out(words, expected):
    assert with_default_port(words) == expected


def test_a_summary_has_headings_in_degrees(capsys):
    boat = SimpleNamespace(robot="wamv", position=(1.0, 2.0, 0.1), heading=math.pi / 3, distance=7.5)
    boat.heading_compass, boat.course_compass = 30.0, 123.45
    summary = SimpleNamespace(
        world="bay", fleet="one", seed=3, interrupted=False, boats={"wamv": boat}, task=None, sim_time=60.0,
        wall_time=2.0, real_time_factor=30.0, steps=6000, state_sha256="abc", warnings=(), touches=(),
    )  # fmt: skip
    print_summary(summary)
    line = next(line for line in capsys.readouterr().out.splitlines() if "wamv" in line)
    assert [word for word in line.replace("│", " ").split() if word != "wamv"] == [
        "1.00",
        "2.00",
        "0.10",
        "60.0",
        "30.0",
        "123.5",
        "7.5",
    ]
