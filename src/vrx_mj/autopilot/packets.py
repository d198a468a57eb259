"""ArduPilot's JSON interface: packets of servo outputs, and the lines of JSON that answer them.

Source: libraries/SITL/examples/JSON/readme.md of ArduPilot. A packet is little-endian: a magic number (16 bits) that
says how many channels there are, the rate of frames [Hz] (16 bits), the number of the frame (32 bits), and the width of
each channel's pulse [us] (16 bits each). An answer is one JSON object between two newlines.
"""

import json
import struct
from typing import Any, NamedTuple

FORMATS = {18458: struct.Struct("<HHI16H"), 29569: struct.Struct("<HHI32H")}
"""Packets of 16 and of 32 channels, by their magic numbers."""
LARGEST = 256
"""Bytes of a packet that are read, more than any packet has."""


class Servos(NamedTuple):
    """What an autopilot commands in one frame."""

    rate: int
    """Frames per simulated second [Hz]: time goes on by 1 / rate."""
    number: int
    """Number of the frame since the autopilot started."""
    pulses: tuple[int, ...]
    """Widths of the pulses of channels 1, 2, ... [us]; 0: the channel has no output."""


def servos_of(packet: bytes) -> Servos | None:
    """The servo outputs in a packet; None if it is no packet of ArduPilot."""
    form = FORMATS.get(int.from_bytes(packet[:2], "little"))
    if form is None or form.size != len(packet):
        return None
    _, rate, count, *pulses = form.unpack(packet)
    return Servos(rate, count, tuple(pulses))


def answer(state: dict[str, Any]) -> bytes:
    """The line that ArduPilot reads: `timestamp` [s], `imu`, `position`, `velocity`, `quaternion` and what is optional.

    ArduPilot looks for the first place of a key in the line, and two characters after it for the value: no key may
    stand before another that it begins with, and no blank before a list.
    """
    return f"\n{json.dumps(state, allow_nan=False, separators=(',', ':'))}\n".encode()
