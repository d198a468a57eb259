"""Boats in formation, sailed: speeds and turns that are held, places that are kept."""

import math
from itertools import combinations

import numpy as np
import pytest

import vrx_mj
from vrx_mj.control.formation import Formation
from vrx_mj.control.navigation import Navigator, true_estimate
from vrx_mj.control.velocity import VelocityKeeper
from vrx_mj.errors import SensorError

GROUND_TRUTH = "ignore:navigation by ground truth"
VRX = {"profile": "vrx"}
CALM = {"physics": VRX, "sea": {"model": "none"}}
WINDY = {
    "physics": VRX,
    "sea": {"model": "pms", "gain": 0.1, "period": 5},
    "wind": {"direction": 90, "mean_velocity": 5, "objects": [{"model": "wamv", "coefficients": [0.5, 0.5, 0.33]}]},
}
LAYOUTS = ("H", "T", "X")


def sailed(world, fleet, controller, duration, seed=1):
    """The simulation and the boats' tracks (calls, boats, 2) [m] of a run."""
    sim = vrx_mj.Simulation(vrx_mj.compile_world(world, fleet=fleet), seed=seed)
    tracks = []

    def watched(obs, t):
        tracks.append([boat.position[:2] for boat in obs.values()])
        return controller(obs, t)

    vrx_mj.run(sim, duration, controller=watched)
    return sim, np.array(tracks)


def nearest(tracks):
    """The least distance of two boats at any time [m]."""
    pairs = combinations(range(tracks.shape[1]), 2)
    return min(np.linalg.norm(tracks[:, i] - tracks[:, j], axis=1).min() for i, j in pairs)


@pytest.mark.filterwarnings(GROUND_TRUTH)
@pytest.mark.parametrize(
    ("world", "surge", "turn"), [(CALM, 1.2, 0.0), (WINDY, 1.2, 0.0), (CALM, 1.0, 0.15), (CALM, 0.5, -0.3)]
)
def test_a_surge_speed_and_a_yaw_rate_are_reached_and_held(world, surge, turn):
    boats = [{"name": layout, "thrusters": layout, "pose": [0, 60 * i, 0, 0, 0, 0]} for i, layout in enumerate(LAYOUTS)]
    seen, keepers, navigators = [], {}, {layout: Navigator() for layout in LAYOUTS}

    def controller(obs, t):
        now = {name: navigators[name](boat, t) for name, boat in obs.items()}
        for name in obs.keys() - keepers.keys():
            keepers[name] = VelocityKeeper(obs[name].thrusters)
        seen.append([(now[name].surge, now[name].turn) for name in LAYOUTS])
        return {name: keepers[name](now[name], t, surge, turn) for name in LAYOUTS}

    sailed(world, {"sensors": "none", "boats": boats}, controller, 40.0)
    held = np.array(seen[300:])  # after 30 s: four times as long as a WAM-V skids on
    assert np.abs(held[:, :, 0] - surge).max() < 0.02
    assert np.abs(held[:, :, 1] - turn).max() < 0.002


@pytest.mark.parametrize(("speed", "turn"), [(1.0, 0.4), pytest.param(1.5, -0.3, marks=pytest.mark.slow), (-0.5, 0.2)])
def test_a_circle_has_the_radius_of_speed_over_yaw_rate_where_the_sway_is_held(speed, turn):
    """Engines astern push across with 100 N at most: in tight turns a sideslip is left, and the speed is held."""
    boats = [{"name": layout, "thrusters": layout, "pose": [0, 60 * i, 0, 0, 0, 0]} for i, layout in enumerate(LAYOUTS)]
    keepers, slips = {}, []

    def controller(obs, t):
        now = {name: true_estimate(boat) for name, boat in obs.items()}
        for name in obs.keys() - keepers.keys():
            keepers[name] = VelocityKeeper(obs[name].thrusters, hold_sway=True)
        slips.append([math.atan2(abs(now[name].sway), abs(now[name].surge)) for name in LAYOUTS])
        return {name: keepers[name](now[name], t, speed, turn) for name in LAYOUTS}

    _, tracks = sailed(
        CALM, {"sensors": "none", "boats": boats}, controller, math.ceil(40.0 + 2.0 * math.pi / abs(turn))
    )
    for places in tracks[400:].swapaxes(0, 1):  # a whole circle and what is left of its last step
        across = (np.ptp(places[:, 0]) + np.ptp(places[:, 1])) / 4
        assert across == pytest.approx(abs(speed / turn), rel=0.02)
    assert (np.max(slips[400:], axis=0) < [0.7, 0.4, 0.02]).all()


@pytest.mark.filterwarnings(GROUND_TRUTH)
def test_boats_change_from_a_line_to_a_column_behind_a_virtual_leader():
    formation = Formation([(0, 0), (200, 0)], shape="line", spacing=10.0)
    changed = []

    def controller(obs, t):
        if t >= 25.0 and not changed:
            changed.append(dict(formation.off))
            formation.change("column")
        return formation(obs, t)

    fleet = {"usv_count": 3, "layout": "line", "spacing": 12, "sensors": "none"}
    sim, tracks = sailed(WINDY, fleet, controller, 70.0)
    assert max(changed[0].values()) < 0.7  # no boat can push across its hull: 5 m/s of wind set it off by 0.5 m
    assert max(formation.off.values()) < 0.7
    assert nearest(tracks) > 7.0  # what boats keep apart
    along = {name: boat.position[0] for name, boat in sim.observe().items()}
    assert [along["wamv2"] - along[name] for name in ("wamv1", "wamv3")] == pytest.approx([10.0, 20.0], abs=1.0)


@pytest.mark.filterwarnings(GROUND_TRUTH)
def test_boats_lie_still_in_their_places_where_the_path_ends_and_change_there_too():
    """Bow first a boat would go round its place for ever."""
    formation = Formation([(0, 0), (20, 0)], shape="column", spacing=10.0)
    ends = []

    def controller(obs, t):
        if t >= 50.0 and not ends:
            ends.append(dict(formation.off))
            formation.change("line")
        return formation(obs, t)

    boats = [
        {"name": layout, "thrusters": layout, "pose": [-11 * i, 0, 0, 0, 0, 0]} for i, layout in enumerate(LAYOUTS)
    ]
    sim, tracks = sailed(WINDY, {"sensors": "none", "boats": boats}, controller, 110.0)
    for off in (ends[0], formation.off):
        assert max(off.values()) < 0.3
    for boat in sim.observe().values():
        assert abs(boat.heading) < 0.1
        assert boat.speed < 0.1
    assert nearest(tracks) > 7.0


@pytest.mark.filterwarnings(GROUND_TRUTH)
def test_boats_follow_one_of_them_round_a_turn_on_its_own_track():
    formation = Formation(leader="wamv1", shape="column", spacing=10.0)
    ahead = {"left": 0.32, "right": 0.35}  # a wide turn to port

    def controller(obs, t):
        return {**formation(obs, t), "wamv1": ahead}

    fleet = {"usv_count": 3, "layout": "column", "spacing": 10, "sensors": "none"}
    _, tracks = sailed(CALM, fleet, controller, 60.0)
    led, end = tracks[:, 0], tracks[-1]
    assert set(formation.off) == {"wamv2", "wamv3"}
    assert max(formation.off.values()) < 1.0
    assert max(np.linalg.norm(led - place, axis=1).min() for place in end[1:]) < 0.5  # where the leader was
    assert nearest(tracks) > 7.0


@pytest.mark.filterwarnings(GROUND_TRUTH)
def test_boats_follow_one_that_moves_sideways_and_the_error_is_the_distance_from_their_places():
    formation = Formation(leader="wamv1", shape="column", spacing=10.0)

    def controller(obs, t):
        return {**formation(obs, t), "wamv1": {"lateral": 0.25}}

    fleet = {"usv_count": 3, "layout": "column", "spacing": 10, "sensors": "none", "thrusters": "T"}
    sim, tracks = sailed(CALM, fleet, controller, 70.0)
    place, *others = tracks[-1]
    assert abs(place[1]) > 20.0
    assert abs(math.sin(sim.observe()["wamv1"].heading)) < 0.3  # sideways, for its bow stays in the east
    gaps = [float(np.linalg.norm(place - other)) for other in others]
    assert gaps == pytest.approx([10.0, 20.0], abs=max(formation.off.values()) + 1.5)  # the track is bent
    assert max(formation.off.values()) < 2.0
    for name, other in zip(("wamv2", "wamv3"), others, strict=True):
        goal = formation.goals[name]
        assert formation.off[name] == pytest.approx(math.dist(other, (goal.x, goal.y)), abs=0.01)


@pytest.mark.filterwarnings(GROUND_TRUTH)
def test_boats_without_a_frame_in_common_are_told():
    fleet = {"boats": [{"name": "seeing", "pose": [0, 0, 0, 0, 0, 0], "sensors": ["gps", "imu"]},
                       {"name": "blind", "pose": [0, 20, 0, 0, 0, 0], "sensors": "none"}]}  # fmt: skip
    world = {"georeference": {"latitude": -33.72, "longitude": 150.68, "elevation": 0, "heading": 0}, **CALM}
    with pytest.raises(SensorError) as caught:
        sailed(world, fleet, Formation([(0, 0), (9, 0)]), 1.0)
    assert str(caught.value) == "no GPS receiver or no IMU: blind; the other boats of the fleet have both"
