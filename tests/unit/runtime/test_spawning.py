"""Boats that come and go: what the others have touched, hear and measure stays theirs."""

import pytest

import vrx_mj
from integration.sailing import AFLOAT, CALM, boats, water
from integration.sensing import GPS, QUIET_PINGER, sailing

TASK = {"type": "stationkeeping", "goal_cart": [0.0, 0.0, 0.0], "collision_buffer": 5.0}
NO_DELAY = {"initial_state_duration": 0.0, "ready_state_duration": 0.0}
BESIDE = (0.4, 2.2, AFLOAT, 0.0, 0.0, 0.1)
AWAY = (0.0, 60.0, AFLOAT, 0.0, 0.0, 0.0)


def test_a_touch_is_counted_once_though_a_boat_joins_meanwhile():
    world = water(sea=CALM, wind=None, task={**TASK, **NO_DELAY})
    sim = vrx_mj.Simulation(vrx_mj.compile_world(world, fleet=boats((0.0, 0.0, 0.0), (0.0, 60.0, 0.0))))
    sim.advance(600)
    sim.set_boat("b", pose=BESIDE)
    sim.advance(2)
    sim.set_boat("b", pose=AWAY)
    before = sim._live.arrays.touches.copy()
    assert before.max() > 6.0 - 1e-9
    sim.spawn("late", pose=[-80, 0, AFLOAT, 0, 0, 0], sensors="none")
    assert sim._live.arrays.touches[: len(before)].tolist() == before.tolist()
    assert sim._live.arrays.touches[-1] < 0.0  # the new boat was not touched
    sim.advance(20)
    assert sim.task["num_collisions"] == 1
    sim.remove("late")
    assert sim._live.arrays.touches.tolist() == before.tolist()


def test_a_newcomer_has_all_settings_of_a_fleet_s_boats():
    sim = vrx_mj.Simulation(vrx_mj.compile_world(water(), fleet=boats((0.0, 0.0, 0.0))))
    given = {"ais": "A", "arguments": {"locked": "false"}, "controller": "my_boat:controller"}
    sim.spawn("late", pose=[40, 0, AFLOAT, 0, 0, 0], robot="wamv", sensors="none", **given)
    late = next(boat for boat in sim.world.parameters.boats if boat.name == "late")
    assert {key: getattr(late, key) for key in given} == given
    with pytest.raises(vrx_mj.VrxError, match=r"^<boat>: aiz: unknown key 'aiz'; allowed: .*ais"):
        sim.spawn("later", pose=[80, 0, AFLOAT, 0, 0, 0], aiz="A")


def test_beacons_stay_with_their_boats():
    sensors = {"a": (QUIET_PINGER, GPS), "b": (QUIET_PINGER,), "c": (QUIET_PINGER,)}
    sim = sailing(sensors, fleet=boats((0.0, 0.0, 0.3), (30.0, 0.0, 0.0), (60.0, 0.0, 0.0)), sea=CALM)
    for k, boat in enumerate("abc"):
        sim.set_pinger(boat, "pinger", (100.0 * k, 5.0, -1.0))
    sim.remove("a")
    assert sim.pinger("b", "pinger") == (100.0, 5.0, -1.0)
    assert sim.pinger("c", "pinger") == (200.0, 5.0, -1.0)
    assert sim.sense("c")["pinger"].data.range == pytest.approx(139.2, abs=1.0)


def test_time_and_gusts_go_on_and_the_newcomer_starts_afresh():
    sim = vrx_mj.Simulation(vrx_mj.compile_world(water(), fleet=boats((0.0, 0.0, 0.0))))
    sim.advance(150)
    wind, time = sim.wind.speed, sim.time
    sim.spawn("late", pose=[40, 0, AFLOAT, 0, 0, 1.0], sensors="none")
    assert (sim.wind.speed, sim.time) == (wind, time)
    late = sim.observe()["late"]
    assert late.position == pytest.approx([40, 0, AFLOAT])
    assert not late.velocity.any()


@pytest.mark.filterwarnings("ignore::vrx_mj.VrxWarning")
def test_propellers_of_the_others_turn_on_when_a_boat_leaves():
    """Boats with measured propellers beside one without: what is left are the rows of those that stay."""
    kinds = {"a": "skiff", "b": "heron", "c": "blueboat", "d": "wamv"}
    places = enumerate(kinds.items())
    entries = [{"name": name, "robot": kind, "pose": [40 * n, 0, 0, 0, 0, 0]} for n, (name, kind) in places]
    world = {"physics": {"profile": "marine"}, "sea": {"model": "none"}}
    sim = vrx_mj.Simulation(vrx_mj.compile_world(world, fleet={"boats": entries, "sensors": "none"}))

    def turning():
        """The state of every propeller, by boat."""
        arrays, found = sim._live.arrays, {}
        for name, hull in zip(sim.boats, arrays.hulls, strict=True):
            own = arrays.thrusters["measured"][hull["thruster_start"] :][: hull["thruster_count"]]
            found[name] = arrays.propeller_state[own[own >= 0]].tolist()
        return found

    sim.step({name: {"left": 0.3 + 0.1 * n, "right": 0.5} for n, name in enumerate("bcd")}, duration=0.2)
    whole = turning()
    assert [len(own) for own in whole.values()] == [0, 2, 2, 3]
    for gone in "abc":
        sim.remove(gone)
        del whole[gone]
        assert turning() == whole
