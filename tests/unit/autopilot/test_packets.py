"""Packets as bytes, typed from the page of the protocol."""

import json

import pytest

from fake_sitl import packet
from vrx_mj.autopilot.ardupilot import answer, servos_of

SIXTEEN = bytes.fromhex("1a48 9001 07000000" + "dc05" * 15 + "6c07")
"""Magic 18458 = 0x481a, rate 400 = 0x0190, frame 7, fifteen channels of 1500 = 0x05dc us and one of 1900 = 0x076c."""
THIRTY_TWO = bytes.fromhex("8173 3200 ffffffff" + "e803" * 31 + "0000")
"""Magic 29569 = 0x7381, rate 50, frame 2^32 - 1, channels of 1000 us and one without output."""


def test_sixteen_channels():
    servos = servos_of(SIXTEEN)
    assert (servos.rate, servos.number, servos.pulses) == (400, 7, (1500,) * 15 + (1900,))


def test_thirty_two_channels():
    servos = servos_of(THIRTY_TWO)
    assert (servos.rate, servos.number, servos.pulses) == (50, 2**32 - 1, (1000,) * 31 + (0,))


def test_the_stand_in_speaks_as_the_page_does():
    assert packet(7, (1500,) * 15 + (1900,), rate=400) == SIXTEEN
    assert packet(2**32 - 1, (1000,) * 31 + (0,), rate=50) == THIRTY_TWO


@pytest.mark.parametrize(
    "data", [b"", b"\x1a", SIXTEEN[:-1], SIXTEEN + b"\0", b"\x1b" + SIXTEEN[1:], SIXTEEN[:2] + THIRTY_TWO[2:]]
)
def test_what_is_cut_or_foreign_is_no_packet(data):
    assert servos_of(data) is None


def test_an_answer_is_one_line_between_two_newlines():
    line = answer({"timestamp": 0.02, "imu": {"gyro": [0.0, 1.5e-17, -1.0]}}).decode()
    assert line[0] == line[-1] == "\n"
    assert "\n" not in line[1:-1]
    assert json.loads(line) == {"timestamp": 0.02, "imu": {"gyro": [0.0, 1.5e-17, -1.0]}}


def test_there_is_no_blank_in_an_answer():
    """As in the page's example: ArduPilot's sscanf finds no list behind a blank."""
    state = {"timestamp": 2500, "imu": {"gyro": [0, 0, 0], "accel_body": [0, 0, 0]}, "position": [0, 0, 0]}
    example = b'\n{"timestamp":2500,"imu":{"gyro":[0,0,0],"accel_body":[0,0,0]},"position":[0,0,0]}\n'
    assert answer(state) == example


def test_a_number_that_json_has_not_is_never_sent():
    with pytest.raises(ValueError, match="JSON compliant"):
        answer({"timestamp": float("nan")})
