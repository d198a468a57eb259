"""Transponders: how often they report, by the tables of ITU-R M.1371, and what pyais reads of it."""

import math

import mujoco
import numpy as np
import pytest
from pyais import decode

from vrx_mj.frames import quaternion
from vrx_mj.model.things import Georeference
from vrx_mj.nmea import FIRST, Size, Transponder, mmsi_of, size_of
from vrx_mj.runtime.observation import BoatObservation

KNOT = 1852.0 / 3600.0
SANTIAGO = Georeference(latitude=-33.45, longitude=-70.66, elevation=0.0, heading=0.0)
SIZE = Size(3, 2, 1, 2)


def seen(knots=0.0, bearing=0.0, to_starboard=0.0, position=(0.0, 0.0, 0.0)):
    """A boat at a speed [knots] on a bearing [degrees], which turns [degrees/s]."""
    return BoatObservation(
        np.array(position),
        np.array(quaternion(0.0, 0.0, math.radians(90.0 - bearing))),
        np.array([knots * KNOT, 0.0, 0.0]),
        np.array([0.0, 0.0, -math.radians(to_starboard)]),
    )


def transponder(ais_class="B", due=0.0):
    return Transponder("wamv1", 338000001, ais_class, SIZE, due, due)


def reports(ais_class, duration, moving):
    """Times of the reports of position and of the static ones, with `moving` by time."""
    own, positions, static = transponder(ais_class), [], []
    for second in range(duration):
        for text in own.sentences(float(second), moving(float(second)), SANTIAGO):
            kind = text.split(",")[5][0]
            (positions if kind in "1B" else static).append(second)
    return positions, static


@pytest.mark.parametrize(
    ("ais_class", "knots", "interval"),
    [
        ("A", 0.0, 10.0),
        ("A", 13.9, 10.0),
        ("A", 14.1, 6.0),
        ("A", 22.9, 6.0),
        ("A", 23.1, 2.0),
        ("B", 0.0, 180.0),
        ("B", 1.9, 180.0),
        ("B", 2.1, 30.0),
        ("B", 13.9, 30.0),
        ("B", 14.1, 15.0),
        ("B", 23.1, 5.0),
    ],
)
def test_reports_come_by_class_and_speed(ais_class, knots, interval):
    positions, static = reports(ais_class, 721, lambda _: seen(knots))
    assert positions == [round(interval * number) for number in range(int(720 / interval) + 1)]
    assert sorted(set(static)) == [0, 360, 720]
    assert len(static) == 3 * 2  # two fragments, or parts A and B


@pytest.mark.parametrize(("knots", "interval"), [(5.0, 10.0 / 3.0), (15.0, 2.0), (25.0, 2.0)])
def test_class_a_reports_more_often_while_it_turns(knots, interval):
    positions, _ = reports("A", 601, lambda time: seen(knots, bearing=1.0 * time))
    turning = [time for time in positions if time >= 30]
    assert len(turning) == pytest.approx(570.0 / interval, abs=1.0)
    assert max(np.diff(turning)) <= math.ceil(interval)


@pytest.mark.parametrize(("rate", "is_turning"), [(0.30, False), (0.36, True)])
def test_a_turn_is_5_degrees_from_the_mean_of_30_s(rate, is_turning):
    """At a steady rate the present heading is 14.5 s of turning from the mean of 30 looks."""
    positions, _ = reports("A", 301, lambda time: seen(5.0, bearing=rate * time))
    assert (len(positions) > 32) == is_turning
    assert (14.5 * rate > 5.0) == is_turning


def test_a_turn_ends_20_s_after_the_heading_is_steady_also_through_north():
    """Of a turn by 20 degrees in 10 s the mean is more than 5 degrees behind until 20 s: 110 / 21 > 5 = 110 / 22."""
    positions, _ = reports("A", 301, lambda time: seen(5.0, bearing=350.0 + min(20.0, 2.0 * time)))
    assert positions[:2] == [0, 6]
    assert len([time for time in positions if 6 <= time <= 40]) == 11
    assert set(np.diff([time for time in positions if time > 40])) == {10}
    straight, _ = reports("A", 301, lambda time: seen(5.0, bearing=(-1.0) ** time * 0.3))
    assert straight == [*range(0, 301, 10)]


def test_a_boat_that_gets_faster_is_not_waited_for():
    positions, _ = reports("B", 121, lambda time: seen(0.0 if time < 50.0 else 3.0))
    assert positions == [0, 50, 80, 110]


@pytest.mark.parametrize("ais_class", ["A", "B"])
def test_a_report_has_place_course_speed_and_heading(ais_class):
    own, moving = transponder(ais_class), seen(7.26, 359.7, to_starboard=1.0, position=(-1234.5, -678.9, 0.4))
    position = decode(own.sentences(75.0, moving, SANTIAGO)[0])
    latitude, longitude, _ = SANTIAGO.to_geodetic(-1234.5, -678.9, 0.4)
    assert latitude < SANTIAGO.latitude
    assert longitude < SANTIAGO.longitude
    assert position.msg_type == (1 if ais_class == "A" else 18)
    assert (position.lat, position.lon) == pytest.approx((latitude, longitude), abs=0.5e-4 / 60.0 + 1e-6)
    assert (position.mmsi, position.speed, position.course, position.heading) == (338000001, 7.3, 359.7, 0)
    assert position.second == 15
    if ais_class == "A":
        assert position.turn == pytest.approx(60.0, abs=2.0)  # degrees per minute, to starboard
        to_port = decode(transponder("A").sentences(0.0, seen(5.0, to_starboard=-1.0), SANTIAGO)[0])
        assert to_port.turn == pytest.approx(-60.0, abs=2.0)


def test_what_a_report_cannot_hold_is_its_largest():
    report = decode(transponder("A").sentences(0.0, seen(200.0, to_starboard=90.0), SANTIAGO)[0])
    assert (report.speed, report.turn) == (102.2, pytest.approx(708.0, abs=2.0))


@pytest.mark.parametrize("ais_class", ["A", "B"])
def test_static_reports_have_name_and_size(ais_class):
    _, *static = transponder(ais_class).sentences(0.0, seen(), SANTIAGO)
    parts = [decode(*static)] if ais_class == "A" else [decode(text) for text in static]
    found = {key: value for part in parts for key, value in part.asdict().items() if value not in {None, ""}}
    assert (found["shipname"], found["mmsi"], int(found["ship_type"])) == ("WAMV1", 338000001, 90)
    assert Size(*(found[key] for key in Size._fields)) == SIZE


def test_names_are_capitals_and_at_most_20():
    own = Transponder("a_Boat-with.a_longer-name", 338000001, "B", SIZE, 0.0, 0.0)
    assert decode(own.sentences(0.0, seen(), SANTIAGO)[1]).shipname == "A_BOAT-WITH.A_LONGER"


def test_numbers_are_by_name_and_never_shared():
    boats = [f"boat{number}" for number in (66, 428, 1)]  # the first two have the same checksum
    found = mmsi_of(boats)
    assert len(set(found.values())) == 3
    assert found["boat428"] == found["boat66"] + 1
    assert mmsi_of(["boat66"]) == {"boat66": found["boat66"]}
    assert all(338_000_000 <= number < 339_000_000 for number in found.values())
    assert FIRST == 10


def test_the_size_is_that_of_the_shapes_on_the_body():
    xml = """<mujoco><worldbody><body name="b"><freejoint/>
      <geom type="box" size="2.5 .2 .2" pos=".5 1.3 0"/>
      <geom type="cylinder" size=".2 2" euler="0 90 0" pos="-.4 -1 0"/>
    </body></worldbody></mujoco>"""
    assert size_of(mujoco.MjModel.from_xml_string(xml), "b") == Size(3, 2, 2, 1)
