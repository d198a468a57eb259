"""Ten minutes of a boat's sentences: pynmea2, pyais and gpsd's own decoder, which wrote none of them, read all."""

import json
import subprocess
from collections import Counter
from datetime import datetime

import pynmea2
import pytest
from pyais import decode

from integration.sailing import ROUGH, boats
from integration.sensing import GPS, IMU, sailing
from needs import GPSDECODE, needs
from vrx_mj.config.sensors import ErrorModel
from vrx_mj.nmea import START, Instruments

NOISE = ErrorModel(noise=(0.3, 0.3, 0.3))
WESTERN = {"latitude": -33.03, "longitude": -71.62}
"""Valparaiso: south, and west."""


def nearest(times, time):
    """The time that is nearest to another."""
    return min(times, key=lambda known: abs(known - time))


@pytest.fixture(scope="module")
def streamed():
    """The lines of ten minutes of boat a, the fixes of its GPS and the places of b, by time."""
    fleet = boats((0.0, 0.0, 0.3), (60.0, 10.0, 1.0), (-60.0, 20.0, 2.0))
    fleet["boats"][2]["ais"] = "A"
    noisy = (GPS.model_copy(update={"position": NOISE, "velocity": NOISE}), IMU)
    sim = sailing({"a": noisy, "b": (), "c": ()}, fleet=fleet, sea=ROUGH, georeference=WESTERN)
    instruments, lines, fixes, places = Instruments(sim), [], {}, {}
    earth = sim.world.parameters.georeference
    for _ in range(6000):
        lines += [sentence.text for sentence in (*instruments.sentences("a"), *instruments.reports("a"))]
        fix = sim.sense("a")["gps"]
        fixes[round(fix.time, 2)] = fix.data
        places[round(sim.time, 1)] = earth.to_geodetic(*sim.observe()["b"].position)
        commands = {boat: {"left": 0.9, "right": 0.6} for boat in sim.boats}
        sim.step(commands, duration=0.1)
    return lines, fixes, places


@pytest.mark.slow
def test_pynmea2_reads_what_the_sensors_measured(streamed):
    lines, fixes, _ = streamed
    read = [pynmea2.parse(line, check=True) for line in lines if line[0] == "$"]
    counts = Counter(one.sentence_type for one in read)
    assert counts == {"GGA": 600, "RMC": 600, "VTG": 600, "HDT": 6000, "ROT": 6000, "XDR": 600}
    measured = list(fixes.values())
    for one in read:
        if one.sentence_type == "GGA":
            clock = one.timestamp
            time = 60.0 * clock.minute + clock.second + 1e-6 * clock.microsecond
            fix = fixes[nearest(fixes, time)]
            assert (one.latitude, one.longitude) == pytest.approx((fix.latitude, fix.longitude), abs=1e-7)
            assert one.altitude == pytest.approx(fix.altitude, abs=0.006)
    assert all(fix.latitude < 0.0 and fix.longitude < 0.0 for fix in measured)


@pytest.mark.slow
def test_pyais_reads_the_other_vessels(streamed):
    lines, _, places = streamed
    whole = [line for line in lines if ",1,1," in line[:15]]
    halves = [line for line in lines if line.startswith("!AIVDM,2,")]
    messages = [decode(line) for line in whole]
    messages += [decode(*pair) for pair in zip(halves[::2], halves[1::2], strict=True)]
    counts = Counter(message.msg_type for message in messages)
    assert counts[5] == 2
    assert counts[24] == 2 * 2
    assert counts[1] >= 60  # every 10 s, and more often while it turns
    assert 20 <= counts[18] <= 21  # every 30 s above 2 knots
    first = next(message for message in messages if message.msg_type == 18)
    assert (
        min(abs(first.lat - latitude) + abs(first.lon - longitude) for latitude, longitude, _ in places.values()) < 4e-6
    )


@pytest.mark.slow
@needs(GPSDECODE)
def test_gpsdecode_reads_both(streamed):
    lines, fixes, _ = streamed
    text = "".join(f"{line}\r\n" for line in lines)
    done = subprocess.run(["gpsdecode", "-j"], input=text, capture_output=True, text=True, check=True)
    assert not done.stderr
    read = [json.loads(line) for line in done.stdout.splitlines()]
    counts = Counter(one.get("type", one["class"]) for one in read)
    assert counts["TPV"] >= 598  # it needs a first one to learn which sentence ends a fix
    expected = Counter(decode(line).msg_type for line in lines if ",1,1," in line[:15])
    assert (counts[1], counts[18], counts[24], counts[5]) == (expected[1], expected[18], expected[24] / 2, 2)
    for one in read:
        if one["class"] == "TPV":
            time = (datetime.fromisoformat(one["time"]) - START).total_seconds()
            fix = fixes[nearest(fixes, time)]
            assert (one["lat"], one["lon"]) == pytest.approx((fix.latitude, fix.longitude), abs=1e-7)
            assert one["alt"] == pytest.approx(fix.altitude, abs=0.006)
