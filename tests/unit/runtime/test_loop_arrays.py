"""What a simulation starts with, and what a thing knows of the water where it is put."""

import pytest

import hydro_boats
import vrx_mj
from integration.sailing import GUSTY, boats, simulation

BUOY = {"name": "buoy", "model": "mb_marker_buoy_red", "pose": [0, 30, 0, 0, 0, 0]}
SWELL = {"model": "pms", "gain": 1.0, "period": 6.0, "scale": 2.5, "tau": 0.0}


def test_at_the_start_the_wind_has_its_mean_speed():
    sim = simulation(wind=GUSTY)
    assert sim.row()[1] == 6.0
    sim.advance(200)
    assert sim.row()[1] != 6.0
    sim.reset()
    assert sim.row()[1] == 6.0


@pytest.mark.parametrize("profile", ["vrx", "vrx3"])
def test_a_thing_that_is_put_somewhere_does_not_take_the_water_there_for_rising(profile):
    """The waves are more than a metre high: water that rose so much within a step would fling it up."""
    sim = simulation(boats((0.0, 0.0, 0.0)), sea=SWELL, wind=None, objects=[BUOY], physics={"profile": profile})
    sim.advance(200)
    heights = [(x, float(sim.sea.height(x, 30.0, sim.time))) for x in range(60)]
    for x, height in (min(heights, key=lambda pair: pair[1]), max(heights, key=lambda pair: pair[1])):
        sim.set_object("buoy", pose=(x, 30.0, height, 0.0, 0.0, 0.0), velocity=[0.0] * 6)
        before = sim.observe_object("buoy").velocity[2]
        sim.advance(1)
        assert abs(sim.observe_object("buoy").velocity[2] - before) < 1.0


def tables_of(robots):
    """Tables of a world of profile `marine` with such boats."""
    entries = [{"name": f"b{i}", "robot": robot, "pose": [40 * i, 0, 0, 0, 0, 0]} for i, robot in enumerate(robots)]
    world = {"physics": {"profile": "marine"}, "sea": {"model": "none"}}
    made = vrx_mj.compile_world(world, fleet={"boats": entries, "sensors": "none"})
    return vrx_mj.Simulation(made)._live.arrays


def led_to(arrays, row):
    """All that a hull's row leads to in other tables, in the numbers of no table."""
    hull = arrays.hulls[row]
    vessel = arrays.vessels[hull["vessel"]]
    spans = {"points": ("point", 3), "shares": ("point", 6), "pairs": ("pair", 1), "corner_shares": ("pair", 1),
             "parts": ("part", 1), "strips": ("strip", 1), "memory": ("memory", 1)}  # fmt: skip
    found = {}
    for name, (part, width) in spans.items():
        start = width * vessel[f"{part}_start"]
        found[name] = getattr(arrays, name)[start : start + width * vessel[f"{part}_count"]].tobytes()
    first, entries = vessel["diffraction_start"], vessel["diffraction_frequencies"] * vessel["diffraction_angles"]
    found["diffraction"] = arrays.diffraction[first : first + entries].tobytes()
    found["windage"] = arrays.windage[hull["windage_start"] :][: hull["windage_count"]].tobytes()
    engines = arrays.thrusters[hull["thruster_start"] :][: hull["thruster_count"]]
    for number, engine in enumerate(engines[engines["measured"] >= 0]):
        own = arrays.propellers[engine["measured"]]
        found[f"propeller {number}"] = arrays.propeller_points[own["point_start"] :][: own["point_count"]].tobytes()
    found["vessel"] = [vessel[name].tobytes() for name in vessel.dtype.names if not name.endswith("_start")]
    return found


@pytest.mark.filterwarnings("ignore::vrx_mj.VrxWarning")
def test_each_hull_is_led_to_what_is_its_own_by_its_row(tmp_path):
    """Boats of several kinds, two of them alike: each has what it has in a world of its own."""
    kinds = [hydro_boats.barge(tmp_path, kind) for kind in range(hydro_boats.KINDS)]
    robots = ["heron", *kinds, "wamv", kinds[1]]
    arrays, alone = tables_of(robots), {robot: tables_of([robot]) for robot in set(robots)}
    for row, robot in enumerate(robots):
        assert led_to(arrays, row) == led_to(alone[robot], 0), robot
    remembered = [arrays.state_of_waves(row)["memory_state"] for row in range(len(robots))]
    assert [rows.start for rows in remembered] == arrays.hulls["memory_start"].tolist()
    numbers = [number for rows in remembered for number in range(rows.start, rows.stop)]
    assert numbers == list(range(len(arrays.memory_state)))
