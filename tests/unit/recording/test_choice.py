"""From words to the sensors that are recorded."""

import pytest

from vrx_mj.errors import CommandError, UnknownNameError
from vrx_mj.recording.session import choices_of

WAMV1 = {"front_left_camera": 30.0, "lidar_wamv": 10.0, "pinger": 1.0}
WAMV2 = {"lidar_wamv": 10.0, "gps_wamv": 15.0}
BOATS = {"wamv1": WAMV1, "wamv2": WAMV2, "raft": {}}
ONE = {"wamv1": WAMV1}
KNOWN = "known: front_left_camera, lidar_wamv, pinger"
NEEDED = "readings per second above 0 are needed, as in lidar_wamv@5"
ALL_OF = {boat: [(boat, name, rate) for name, rate in sensors.items()] for boat, sensors in BOATS.items()}


def plain(words, boats=BOATS):
    return [(*sensor, rate) for sensor, rate in choices_of(words, boats).items()]


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("wamv1:lidar_wamv", [("wamv1", "lidar_wamv", 10.0)]),
        (
            "wamv1:front_left_camera,lidar_wamv,wamv2:gps_wamv",
            [("wamv1", "front_left_camera", 30.0), ("wamv1", "lidar_wamv", 10.0), ("wamv2", "gps_wamv", 15.0)],
        ),
        (
            ["wamv1:front_left_camera", "wamv2:gps_wamv"],
            [("wamv1", "front_left_camera", 30.0), ("wamv2", "gps_wamv", 15.0)],
        ),
        ("wamv1:front_left_camera@5", [("wamv1", "front_left_camera", 5.0)]),
        (" wamv1 : lidar_wamv @ 2.5 ", [("wamv1", "lidar_wamv", 2.5)]),
        ("wamv2", ALL_OF["wamv2"]),
        ("wamv2:all", ALL_OF["wamv2"]),
        ("raft", []),
        ("all", [*ALL_OF["wamv1"], *ALL_OF["wamv2"]]),
        ("all@5", [(boat, name, min(rate, 5.0)) for boat, name, rate in [*ALL_OF["wamv1"], *ALL_OF["wamv2"]]]),
        ("wamv1@10", [(boat, name, min(rate, 10.0)) for boat, name, rate in ALL_OF["wamv1"]]),
        ("wamv2,lidar_wamv@2", [("wamv2", "lidar_wamv", 2.0), ("wamv2", "gps_wamv", 15.0)]),
        ("all,wamv2:gps_wamv@1", [*ALL_OF["wamv1"], ("wamv2", "lidar_wamv", 10.0), ("wamv2", "gps_wamv", 1.0)]),
        ("wamv1:pinger,pinger", [("wamv1", "pinger", 1.0)]),
        ([], []),
    ],
)
def test_words_mean_sensors(words, expected):
    assert plain(words) == expected


def test_with_one_boat_its_name_can_be_left_out():
    assert plain("lidar_wamv@2,pinger", ONE) == [("wamv1", "lidar_wamv", 2.0), ("wamv1", "pinger", 1.0)]
    assert plain("all", ONE)[0] == ("wamv1", "front_left_camera", 30.0)


@pytest.mark.parametrize(
    ("words", "kind", "text"),
    [
        ("wamv1:camera", UnknownNameError, f"no sensor of wamv1 named 'camera'; {KNOWN}"),
        ("wamv1:lidar_wam", UnknownNameError, "no sensor of wamv1 named 'lidar_wam'; did you mean 'lidar_wamv'?"),
        ("wamv3:lidar_wamv", UnknownNameError, "no boat named 'wamv3'; did you mean 'wamv2'?"),
        ("lidar_wamv", UnknownNameError, "no boat named 'lidar_wamv'; known: wamv1, wamv2, raft"),
        ("all,lidar_wamv", UnknownNameError, "no boat named 'lidar_wamv'; known: wamv1, wamv2, raft"),
        ("raft,lidar_wamv", UnknownNameError, "no sensor of raft named 'lidar_wamv'; known: none"),
        ("wamv2:gps_wamv,pinger", UnknownNameError, "no sensor of wamv2 named 'pinger'; known: lidar_wamv, gps_wamv"),
        ("wamv1:", UnknownNameError, f"no sensor of wamv1 named ''; {KNOWN}"),
        ("wamv1,,wamv2", UnknownNameError, f"no sensor of wamv1 named ''; {KNOWN}"),
        ("", UnknownNameError, "no boat named ''; known: wamv1, wamv2, raft"),
        ("wamv1:a:b", UnknownNameError, f"no sensor of wamv1 named 'a:b'; {KNOWN}"),
        ("wamv1:pinger@fast", CommandError, f"invalid rate 'fast' in 'wamv1:pinger@fast': {NEEDED}"),
        ("wamv1:pinger@", CommandError, f"invalid rate '' in 'wamv1:pinger@': {NEEDED}"),
        ("wamv1@0", CommandError, f"invalid rate '0' in 'wamv1@0': {NEEDED}"),
        ("wamv1@-2", CommandError, f"invalid rate '-2' in 'wamv1@-2': {NEEDED}"),
        ("all@inf", CommandError, f"invalid rate 'inf' in 'all@inf': {NEEDED}"),
        ("all@nan", CommandError, f"invalid rate 'nan' in 'all@nan': {NEEDED}"),
        ("wamv1:pinger@2", CommandError, "pinger of wamv1 measures at 1 Hz: it cannot be recorded at 2 Hz"),
    ],
)  # fmt: skip
def test_what_means_no_sensor_is_refused(words, kind, text):
    with pytest.raises(kind) as caught:
        choices_of(words, BOATS)
    assert str(caught.value) == text


@pytest.mark.parametrize("words", [3, None, ["wamv1", 3], {"wamv1"}, b"wamv1"])
def test_words_are_text(words):
    with pytest.raises(CommandError, match=r": text, or a list of it, is needed, as in wamv1:lidar_wamv@5$"):
        choices_of(words, BOATS)
