"""What controllers do in made-up waters, without an engine of physics: the commands and the messages of before.

Each scene is short and everyday: something is found, passed, waited for or given up in it. A controller that decides
otherwise, or commands another force at one call, has another fingerprint; tests near the code say what is right.
"""

import itertools
import math
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from fingerprints import check
from integration.scenes import CORNERS, LATERAL, STEERED, TWIN, Engine, Thing, Vessel, played
from vrx_mj.control import (
    SKIPPERS,
    BeaconFollower,
    BeaconSeeker,
    Captain,
    Channel,
    Docking,
    Gymkhana,
    Perceiver,
    StationKeeper,
    WaypointFollower,
    WildlifeCircler,
)
from vrx_mj.control.acoustics import MovingBeacon, StillBeacon, sound_bearing
from vrx_mj.control.formation import SHAPES, Formation, apart_velocity, pursuit, slots
from vrx_mj.control.guidance import Course, Spot, Track, round_corners
from vrx_mj.control.navigation import Estimate, Navigator, TangentPlane
from vrx_mj.control.pilot import Pilot
from vrx_mj.control.velocity import WAMV, Allocation, Craft, VelocityKeeper, craft_of

pytestmark = pytest.mark.filterwarnings("ignore:navigation by ground truth")
RUNNING = {"state": "running"}


def shore(y, begin, end):
    """Stones in a row, which are one bank to a lidar [m]."""
    return [Thing(0.4 * step, y, width=0.5, top=0.8) for step in range(round(begin / 0.4), round(end / 0.4))]


def check_scene(name, controller, vessel, task, seconds, *found, **options):
    sent = played(controller, vessel, task, seconds, **options)
    check("scenes", name, sent=sent, found=[look(controller) for look in found], end=(vessel.x, vessel.y))
    return sent


# Courses


@pytest.mark.parametrize(
    ("name", "thrusters"), [("lateral", LATERAL), ("corners", CORNERS), ("steered", STEERED), ("twin", TWIN)]
)
def test_a_goal_is_reached_and_held_in_wind(name, thrusters):
    goal = {"x": 14.0, "y": 5.0, "yaw": 2.0, "latitude": None, "longitude": None}
    vessel = Vessel(thrusters=thrusters, heading=0.7, wind=(-20.0, 15.0))
    check_scene(f"station {name}", StationKeeper(), vessel, RUNNING | {"goal": goal}, 45.0)


def test_a_pose_is_held_where_no_goal_is_given():
    check_scene("pose", StationKeeper(), Vessel(heading=-2.0, wind=(30.0, 0.0)), RUNNING, 15.0)


def test_waypoints_are_visited_and_the_worst_again():
    places = [(12.0, 3.0, 1.0), (20.0, -8.0, -2.0), (5.0, -9.0, 3.0)]
    waypoints = [{"x": x, "y": y, "yaw": yaw, "latitude": None} for x, y, yaw in places]
    task = RUNNING | {"waypoints": waypoints}
    check_scene("waypoints", WaypointFollower(), Vessel(wind=(25.0, -20.0)), task, 110.0, lambda c: c._least)
    check_scene("waypoints, held", WaypointFollower(), Vessel(x=12.0, y=2.0, anchored=True), task, 60.0, interval=0.75)
    assert WaypointFollower()({"wamv": Vessel().observation(0.0), "task": RUNNING}, 0.0) == {"wamv": {}}


def test_animals_are_circled_or_passed():
    kinds = [("turtle", 14.0, 4.0), ("crocodile", 25.0, -6.0), ("platypus", 36.0, 6.0), ("turtle", 32.0, -20.0)]
    animals = [{"name": name, "x": x, "y": y} for name, x, y in kinds]
    check_scene("wildlife", WildlifeCircler(), Vessel(), RUNNING | {"animals": animals}, 120.0, lambda c: c._swept)


# The channel

COURSE = [
    *[Thing(25.0, -6.0, "red"), Thing(25.0, 6.0, "white")],
    *[Thing(48.0, 2.0, "red"), Thing(44.0, 15.0, "green")],
    *[Thing(70.0, 16.0, "red"), Thing(70.0, 30.0, "blue")],
    *[Thing(36.0, 3.0, "black", 0.5, top=0.4), Thing(58.0, 14.0, "orange", 0.5, top=0.4)],
    *[Thing(38.0, 14.0, "green", 0.6, top=0.3), Thing(55.0, -6.0, "yellow")],
    *shore(-22.0, 10.0, 60.0),
]


def known(controller):
    """The buoys on the map, and the gates that were crossed."""
    buoys = [(one.x, one.y, one.z, one.seen, one.looks, one.tried, one.kind) for one in controller.lookout.map.buoys]
    return buoys, controller._done, controller.lookout.banks


def phases(t, told):
    return {"state": "ready" if t < 2.0 else "running"}


def test_a_channel_is_crossed_gate_by_gate():
    check_scene("channel", Channel(), Vessel(COURSE, heading=0.2), phases, 66.0, known)


def test_a_channel_is_searched_beyond_a_buoy_without_a_partner():
    things = [Thing(30.0, -4.0, "red"), Thing(42.0, 9.0, "green", 0.6, top=0.3), *shore(20.0, 20.0, 40.0)]
    check_scene("channel, half", Channel(), Vessel(things), phases, 56.0, known)


def test_a_boat_that_gets_nowhere_gives_up_gate_by_gate_and_buoy_by_buoy():
    held = partial(Vessel, x=10.0, y=2.0, anchored=True)
    check_scene("channel, held", Channel(), held(COURSE), phases, 105.0, known, interval=2.0)
    few = [Thing(21.0, -4.0, "red"), Thing(30.0, 5.0, "green", 0.6, top=0.3), Thing(45.0, -5.0, "green", 0.6, top=0.3)]
    check_scene("channel, few, held", Channel(), held(few), phases, 110.0, known, interval=2.0)


def test_who_is_past_a_gate_goes_around_it_and_a_chart_needs_no_camera():
    pairs = [COURSE[:2], COURSE[2:4]]
    chart = [({"x": red.x, "y": red.y}, {"x": other.x, "y": other.y}) for red, other in pairs]
    check_scene("channel, chart", Channel(chart=chart), Vessel(COURSE, x=29.0, y=2.0), phases, 25.0, known)
    held = Vessel(COURSE[:6], x=10.0, y=2.0, anchored=True)
    check_scene("channel, chart, held", Channel(chart=chart), held, phases, 160.0, known, interval=1.5)


def test_a_gymkhana_goes_to_its_goal_past_what_floats_there():
    things = [
        Thing(15.0, 0.5, "red"),
        Thing(20.0, 5.0, "green"),
        Thing(24.0, -3.0, "black", 0.5),
        *shore(9.0, 5.0, 30.0),
    ]
    task = RUNNING | {"channel": {"state": "finished"}, "goal": {"x": 32.0, "y": 1.0}}
    check_scene("gymkhana", Gymkhana(), Vessel(things, wind=(0.0, 10.0)), task, 45.0, known)


# The dock


def dock(*symbols, x=45.0, facing=math.pi):
    """Panels side by side, and the float that they stand on."""
    return [
        *[Thing(x, 8.0 * row - 8.0, "grey", 2.0, 0.3, 3.2, facing, symbol) for row, symbol in enumerate(symbols)],
        *[Thing(x + 1.5, y, width=1.0, top=0.5) for y in range(-12, 13)],
    ]


TOWER = Thing(24.0, -22.0, "grey", 0.7, top=2.4, lamps=("red", "green", "blue"))
SIGNS = ("green_triangle", "red_cross", "blue_circle")


def charted(controller):
    """What is known of the dock and of the towers."""
    faces = [(one.x, one.y, one.facing, one.seen, one.looks, one.tried, one.symbol) for one in controller.lookout.faces]
    towers = [
        (one.place, one.seen, one.looks, sorted(one.colors), one.shows, one.rejected)
        for one in controller.lookout.towers
    ]
    return faces, towers, controller.lookout.banks, controller._stage, controller._stuck_on


def lights(t, told):
    """A task that wants the colours of the lights first."""
    return RUNNING | {"color_sequence_open": "color_sequence" not in told, "remaining_time": 215.0 - t}


def test_the_bay_of_the_symbol_is_found_and_left_again():
    task = RUNNING | {"symbol": "blue_circle"}
    check_scene("dock", Docking(), Vessel(dock(*SIGNS), y=3.0, heading=0.3, wind=(0.0, 6.0)), task, 62.0, charted)


def test_lights_are_read_before_the_bay_is_chosen():
    sent = check_scene("lights", Docking(), Vessel([*dock(*SIGNS), TOWER], heading=-0.4), lights, 40.0, charted)
    assert [one["task"] for one in sent if "task" in one] == [{"color_sequence": ["red", "green", "blue"]}]


def test_without_lights_or_symbols_a_dock_is_explored_and_in_time_any_bay_is_taken():
    dark = Thing(20.0, 8.0, "grey", 0.7, top=2.4)
    held = Vessel([*dock("green_triangle", "", "blue_circle"), dark], x=8.0, anchored=True)
    check_scene(
        "dock, held",
        Docking(),
        held,
        lambda t, _: RUNNING | {"symbol": "green_cross", "remaining_time": 165.0 - t},
        85.0,
        charted,
        interval=0.75,
    )
    found = Vessel(dock("red_cross", ""), x=14.0, y=-8.0, anchored=True)
    there = {"symbol": "red_cross"}
    check_scene(
        "dock, found, held", Docking(), found, lambda t, told: lights(t, told) | there, 150.0, charted, interval=2.0
    )
    behind = Vessel(dock("", "", facing=0.0), x=4.0, y=-6.0)
    check_scene("dock, from behind", Docking(), behind, RUNNING | {"symbol": "red_cross"}, 36.0, charted)


def test_a_boat_that_is_stuck_goes_astern_and_another_way():
    task = RUNNING | {"symbol": "blue_circle"}
    check_scene("dock, stuck", Docking(), Vessel(dock(*SIGNS), anchored=True), task, 34.0, charted)


# What is heard


def test_a_beacon_that_lies_still_is_reached():
    vessel = Vessel(beacon=lambda t: (30.0, 14.0, -2.0), heading=1.5)
    check_scene("seeker", BeaconSeeker(), vessel, phases, 30.0, lambda c: c._beacon.place)


def test_a_beacon_that_swims_is_followed_past_buoys():
    things = [Thing(14.0, 3.0, "red"), Thing(20.0, 9.0, "green"), Thing(17.0, 15.0, "red")]
    swims = Vessel(things, beacon=lambda t: (12.0 + 0.5 * t, 8.0 * math.sin(0.1 * t), -2.0))
    check_scene("follower", BeaconFollower(), swims, phases, 50.0, lambda c: c._beacon.at(50.0))


# What is seen


ROUND = {"2022": [("orange", 0.51, 0.5), ("black", 0.51, 0.45)], "2019": [("black", 0.99, 0.9), ("black", 0.43, 0.42)]}
TALL = {
    "2022": [("red", 0.65, 0.9), ("white", 0.65, 0.9), ("green", 0.65, 0.9)],
    "2019": [("red", 0.28, 0.9), ("yellow", 0.28, 0.9), ("blue", 0.28, 0.9)],
}


@pytest.mark.parametrize("year", TALL)
def test_landmarks_are_reported_once_by_kind_and_place(year):
    """Each is up for some seconds, one or two at a time, near and far."""
    things = [
        Thing(7.0 + 3.0 * n % 17, 1.5 * (n % 3) - 1.5, *look[:2], 0.0, look[2], since=2.0 * n, until=2.0 * n + 3.0)
        for n, look in enumerate(TALL[year] + ROUND[year])
    ]
    vessel = Vessel([*things, Thing(31.0, 2.0, "red", 0.7)], x=0.5, y=-0.3, heading=0.1, anchored=True)
    sent = check_scene(f"perception {year}", Perceiver(year), vessel, phases, 13.0, lambda c: c._sights, interval=0.5)
    assert len([one for one in sent if "task" in one]) > 2


# Fleets


def sailed(formation, vessels, seconds, *, orders=()):
    """All that a formation commands and says of boats that follow it, with orders at times."""
    orders, found = dict(orders), []
    for number in range(round(seconds / 0.3)):
        t = 0.3 * number
        if number in orders:
            orders[number](formation, vessels)
        sent = formation({name: vessel.observation(t) for name, vessel in vessels.items()}, t)
        found.append((sent, formation.off, formation.off_shape, formation.leader.along, formation.leader.speed))
        for name, vessel in vessels.items():
            vessel.move(sent.get(name, {"left": 60.0, "right": 75.0} if number < 110 else {}), 0.3)
    return found


def fleet():
    return {
        "a": Vessel(),
        "b": Vessel(x=-9.0, y=6.0, heading=0.4),
        "c": Vessel(x=-12.0, y=-8.0, heading=-1.0, thrusters=TWIN),
    }


def test_a_fleet_keeps_its_shape_along_a_path_and_takes_another():
    formation = Formation([(0.0, 0.0), (30.0, 0.0), (34.0, 30.0)], shape="wedge", spacing=9.0, radius=12.0)
    orders = {
        60: lambda formation, _: formation.change("line"),
        110: lambda one, _: one.change("column", 8.0, reassign=True),
    }
    check("scenes", "fleet", found=sailed(formation, fleet(), 60.0, orders=orders.items()))


def test_a_fleet_follows_a_boat_that_turns_stops_and_is_left_by_another():
    orders = {90: lambda _, vessels: vessels.pop("b")}
    check(
        "scenes",
        "followers",
        found=sailed(Formation(leader="a", spacing=8.0), fleet(), 50.0, orders=orders.items()),
    )


def seen(x=0.0, y=0.0, heading=0.0, vx=0.0, vy=0.0, turn=0.0):
    c, s = math.cos(heading), math.sin(heading)
    return Estimate(x, y, 0.1, heading, vx, vy, turn, np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]))


def test_places_tracks_and_velocities_of_fleets_are_what_they_were():
    random, found = np.random.default_rng(3), [slots(shape, n, 9.0) for shape in SHAPES for n in (1, 2, 3, 7)]
    for _ in range(30):
        x, y, vx, vy, course, bend, left = random.uniform(-6.0, 6.0, 7).tolist()
        others = [seen(*random.uniform(-9.0, 9.0, 2), 0.0, *random.uniform(-1.0, 1.0, 2)) for _ in range(3)]
        found.append(apart_velocity(seen(x, y), (0.3 * vx, 0.3 * vy), others, 7.0))
        found.append(pursuit(seen(x, y), Spot(vx, vy, course, 0.02 * bend, left), 1.4, drift=(0.1, -0.2)))
        way = round_corners([tuple(place) for place in random.uniform(-30.0, 30.0, (5, 2)).tolist()], 6.0 + bend)
        track = Track(way)
        track.shift(1.0, 2.0)
        track.extend((70.0 + x, 7.0))
        found += [way, track.length, [track.spot(along, left) for along in (-3.0, 0.0, 11.7, 40.0, track.length + 5.0)]]
    check("scenes", "places", found=found)


# Laws


RUDDER = SimpleNamespace(
    position=(-1.4, 0.0, 0.0), max_angle=0.6, force_slope=lambda speed, thrust: 30.0 * speed + 0.2 * thrust
)
CRAFTS = {
    "wamv": WAMV,
    "measured": Craft(
        200.0, 300.0, 0.3, (10.0, 5.0), (40.0, 30.0), (90.0, 60.0), 3.0,
        resistance=lambda speed: 3.0 * speed**3, thrust_share=lambda speed: max(0.0, 1.0 - 0.1 * speed),
    ),
    "rudders": Craft(
        200.0, 300.0, -0.3, (10.0, 0.0), (40.0, 0.0), (90.0, 0.0), 3.0, rudders={"port": RUDDER, "starboard": RUDDER}
    ),
}  # fmt: skip
ENGINES = {"lateral": LATERAL, "corners": CORNERS, "steered": STEERED, "twin": TWIN}


@pytest.mark.parametrize("name", CRAFTS)
def test_laws_command_for_any_motion_what_they_did(name):
    """Pilots, keepers and allocations, of every layout, call by call."""
    craft, random, found = CRAFTS[name], np.random.default_rng(4), []
    for engines, hold in itertools.product(ENGINES.values(), (False, True)):
        keeper, pilot, share = (
            VelocityKeeper(engines, craft, hold_sway=hold),
            Pilot(engines, craft),
            Allocation(engines),
        )
        found += [keeper.top_speed, pilot.top_speed, pilot.braking, share.every_way]
        for number in range(25):
            t = 0.4 * number + (2.0 if number > 17 else 0.0)
            now = seen(*random.uniform(-5.0, 5.0, 2), *random.uniform(-3.0, 3.0, 1), *random.uniform(-1.5, 1.5, 2), 0.2)
            vx, vy, heading, turn = random.uniform(-2.0, 2.0, 4).tolist()
            found += [keeper(now, t, vx, 0.3 * turn), share(300.0 * vx, 150.0 * vy, 200.0 * turn)]
            if number % 3:
                found.append(pilot.sail(now, t, vx, vy, heading, turn=0.1 * turn, acceleration=(0.1 * vy, 0.2)))
            else:
                found.append(pilot.hold(now, t, 4.0 * vx, 3.0 * vy, heading, speed=1.0 + vy if vy > 0.0 else math.inf))
    check("scenes", f"laws of {name}".replace(" ", "_"), found=found)


def test_a_boat_with_a_rudder_is_steered_by_its_bow_as_it_was():
    screw = {"screw": Engine((-2.0, 0.0, 0.0))}
    course, random, found = Course(screw, CRAFTS["rudders"], Allocation(screw)), np.random.default_rng(5), []
    for scale in (0.01, 0.2, 1.5):
        for _ in range(15):
            now = seen(0.0, 0.0, *random.uniform(-3.0, 3.0, 1), *random.uniform(-scale, scale, 2), 0.1)
            vx, vy, heading = random.uniform(-scale, scale, 3).tolist()
            found += [
                course.sail(now, vx, vy, heading),
                course.hold(now, 6.0 * vx, 6.0 * vy, heading, speed=1.5, braking=0.2),
            ]
    check("scenes", "rudder", found=found)


def test_a_hull_gives_its_craft():
    hull = SimpleNamespace(
        mass=100.0, inertia=50.0, added_mass=(5.0, 1.0, 1.0, 1.0, 1.0, 7.0), centre=(0.2, 0.0, 0.0), length=2.0,
        rudders={},
        drag_linear=(1.0, 2.0, 3.0, 4.0, 5.0, 6.0), drag_quadratic=(7.0, 8.0, 9.0, 10.0, 11.0, 12.0), resistance=(),
    )  # fmt: skip
    engine = SimpleNamespace(
        direction=(1.0, 0.0, 0.0), max_forward=80.0, thrust_at=lambda speed, force: force - 4.0 * speed
    )
    craft = craft_of(SimpleNamespace(hull=hull, thrusters={"one": engine}))
    found = [craft.mass, craft.inertia, craft.centre, craft.surge_drag, craft.sway_drag, craft.yaw_drag, craft.length]
    check("scenes", "craft", found=found, share=[craft.thrust_share(speed) for speed in (0.0, 1.0, 3.0)])


def test_beacons_are_where_they_were_sound_by_sound():
    random, found = np.random.default_rng(6), []
    still, moving = StillBeacon(), MovingBeacon()
    for number in range(30):
        sound = SimpleNamespace(
            range=float(random.uniform(-1.0, 30.0)), bearing=float(random.uniform(-3.0, 3.0)),
            elevation=float(random.uniform(-0.5, 0.5)) * (number % 4 > 0),
        )  # fmt: skip
        heard = sound_bearing(sound, seen(0.4 * number, 1.0, 0.1 * number, 0.5, -0.3), 0.05 * (number % 3))
        still.update(heard)
        moving.update(heard, 1.0 * number)
        found += [vars(heard), still.place, moving.at(number + 0.4)]
    check("scenes", "beacons", found=found)


def test_a_boat_with_a_gps_is_where_it_was():
    random, navigator, found = np.random.default_rng(7), Navigator(), []
    for number in range(12):
        angle = 0.3 * number
        place = {"latitude": -33.7 + 1e-5 * number, "longitude": 150.6 + 2e-5 * number}
        fix = SimpleNamespace(**place, altitude=1.3, velocity=random.normal(size=3))
        turned = np.array([math.cos(angle), 0.02, -0.01, math.sin(angle)])
        inertia = SimpleNamespace(orientation=turned, angular_velocity=random.normal(size=3))
        mount = SimpleNamespace(position=(-0.85, 0.1, 1.3))
        gps = SimpleNamespace(data=fix, time=number - 0.05, mount=mount)
        boat = SimpleNamespace(sensors={"gps": gps, "imu": SimpleNamespace(data=inertia, time=number - 0.01)})
        found += [navigator(boat, float(number)), navigator.report(3.0 * number, -2.0)]
        found.append(navigator.place({"latitude": fix.latitude, "longitude": 150.601}))
        found.append(navigator.direction({"yaw": 0.3, "yaw_from_east": 4.0 + number}))
    planes = [TangentPlane(latitude, 179.9).geodetic(3000.0, -2000.0) for latitude in (-59.0, 0.0, 33.0)]
    check("scenes", "navigation", found=found, planes=planes)


def test_the_captain_hands_on_the_seed_of_the_run(monkeypatch):
    class Seeded(StationKeeper):
        def reset(self, seed):
            super().reset(seed)
            self.seed = seed

    monkeypatch.setitem(SKIPPERS, "seeded", Seeded)
    captain = Captain()
    captain.reset(7)
    captain({"wamv": Vessel().observation(0.0), "task": {"state": "initial", "type": "seeded"}}, 0.0)
    assert captain._skipper.seed == 7
