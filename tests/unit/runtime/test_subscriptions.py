"""Readings handed over as they fall due: how many, when, and that nothing else changes."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from integration.sailing import AHEAD
from integration.sensing import GPS, GUN, IMU, P3D, PINGER, sailing
from vrx_mj.errors import CommandError, UnknownNameError
from vrx_mj.runtime import proximity, subscriptions
from vrx_mj.runtime.subscriptions import ContactSampler, ContactWatch, Subscription, Subscriptions

FAST = P3D.model_copy(update={"name": "fast", "rate": 250.0})


@pytest.fixture(scope="module")
def sim():
    return sailing((GPS, IMU, P3D, PINGER, GUN, FAST))


@pytest.fixture(autouse=True)
def _at_the_start(sim):
    sim.reset(5)
    yield
    for subscription in list(sim._subscriptions._all):
        sim.unsubscribe(subscription)


def taken(sim, sensor, rate=None):
    """A list that fills with (number, time of the reading, time of the simulation)."""
    found = []
    sim.subscribe("a", sensor, lambda reading: found.append((reading.sequence, reading.time, sim.time)), rate=rate)
    return found


def first_step_at(k, rate, timestep=0.01):
    """The first step whose time reaches k / rate [s], in whole numbers."""
    return math.ceil(round(k / (rate * timestep), 6))


def test_15_hz_on_10_ms_are_15_a_second_without_drift(sim):
    found = taken(sim, "imu")
    for second in range(1, 21):
        sim.advance(100)
        assert len(found) == 15 * second + 1  # and that of time 0
    assert [number for number, _, _ in found] == list(range(301))
    assert [round(time / 0.01) for _, time, _ in found] == [first_step_at(k, 15.0) for k in range(301)]
    assert all(measured == now for _, measured, now in found)


@pytest.mark.parametrize("steps", [1, 3, 7, 1000])
def test_the_length_of_calls_does_not_matter(sim, steps):
    found = taken(sim, "imu")
    for _ in range(1000 // steps):
        sim.advance(steps)
    reached = 1000 // steps * steps
    assert [number for number, _, _ in found] == [k for k in range(200) if first_step_at(k, 15.0) <= reached]


@pytest.mark.parametrize(
    ("rate", "numbers"),
    [
        (5.0, [0, 3, 6, 9, 12, 15]),
        (7.5, [0, 2, 4, 6, 8, 10, 12, 14]),
        (10.0, [0, 2, 3, 5, 6, 8, 9, 11, 12, 14, 15]),
        (1.0, [0, 15]),
        (0.5, [0]),
    ],
)
def test_a_lower_rate_takes_every_nth_measurement(sim, rate, numbers):
    found = taken(sim, "imu", rate)
    sim.advance(100)
    assert [number for number, _, _ in found] == numbers


def test_a_rate_above_that_of_the_steps_gives_one_at_every_step(sim):
    found = taken(sim, "fast")
    sim.advance(50)
    assert [round(time / 0.01) for _, time, _ in found] == list(range(51))
    slower = taken(sim, "fast", 50.0)
    sim.advance(100)
    assert len(slower) == 50 + 1


def test_motion_is_the_same_to_the_last_bit(sim):
    sim.step({"a": AHEAD}, duration=5.0)
    alone = sim.get_state().mujoco
    sim.reset(5)
    for name in ("gps", "imu", "fast", "pinger"):
        taken(sim, name)
    sim.step({"a": AHEAD}, duration=5.0)
    assert sim.get_state().mujoco.tobytes() == alone.tobytes()


def test_readings_are_those_that_are_sensed(sim):
    found = []
    sim.subscribe("a", "imu", found.append)
    sim.advance(100)
    sim.reset(5)
    sensed = {}
    for _ in range(101):
        reading = sim.sense("a")["imu"]
        sensed[reading.sequence] = reading
        sim.advance(1)
    for reading in found[:15]:
        assert reading.time == sensed[reading.sequence].time
        assert np.array_equal(reading.data.linear_acceleration, sensed[reading.sequence].data.linear_acceleration)


def test_a_reset_begins_anew(sim):
    found = taken(sim, "imu")
    sim.advance(33)
    sim.reset(5)
    assert len(found) == 5  # none is handed over by a reset itself
    sim.advance(33)
    assert [number for number, _, _ in found] == [0, 1, 2, 3, 4] * 2


def test_a_state_that_is_set_goes_on_with_what_is_due_there(sim):
    found = taken(sim, "imu")
    sim.advance(20)
    state = sim.get_state()
    sim.advance(40)
    first = list(found)
    found.clear()
    sim.set_state(state)
    sim.advance(40)
    assert found == [one for one in first if one[2] >= state.time]


def test_nothing_that_is_due_at_once_comes_twice(sim):
    sim.advance(20)
    found = taken(sim, "imu")
    assert found == []
    sim.advance(1)
    sim.advance(1)
    assert [number for number, _, _ in found] == [3]


def test_a_subscription_between_two_measurements_waits_for_the_next(sim):
    sim.advance(3)
    found = taken(sim, "imu")
    sim.advance(4)
    assert [(number, round(time, 9)) for number, time, _ in found] == [(1, 0.07)]


def test_who_unsubscribes_gets_no_more_and_may_do_so_meanwhile(sim):
    found = []
    once = sim.subscribe("a", "imu", lambda reading: (found.append(reading.sequence), sim.unsubscribe(once)))
    later = sim.subscribe("a", "imu", lambda reading: (found.append("later"), sim.unsubscribe(later)))
    sim.advance(100)
    assert found == [0, "later"]
    sim.unsubscribe(once)


def test_a_callback_may_command_and_fire(sim):
    def shoot(reading):
        sim.command("a", left=1.0)
        sim.fire("a")

    sim.subscribe("a", "pinger", shoot)
    sim.advance(250)
    assert sim.sense("a")["gun"].data.shots_left == 1  # of 4: at 0, 1 and 2 s


@pytest.mark.parametrize(
    ("call", "name"),
    [
        (lambda sim, state: sim.advance(1), "advance"),
        (lambda sim, state: sim.step(), "step"),
        (lambda sim, state: sim.reset(), "reset"),
        (lambda sim, state: sim.set_state(state), "set_state"),
    ],
)
def test_callbacks_do_not_reenter(sim, call, name):
    state = sim.get_state()
    subscription = sim.subscribe("a", "imu", lambda reading: call(sim, state))
    with pytest.raises(CommandError) as caught:
        sim.advance(10)
    text = f"{name} cannot be called from the callback of a subscription: call it afterwards"
    assert str(caught.value) == text
    sim.unsubscribe(subscription)
    sim.advance(10)


def test_what_cannot_be_subscribed_is_refused(sim):
    def refused(kind, *words, **rate):
        with pytest.raises(kind) as caught:
            sim.subscribe(*words, print, **rate)
        return str(caught.value)

    assert refused(UnknownNameError, "c", "imu") == "no boat named 'c'; known: a"
    assert refused(UnknownNameError, "a", "sonar") == (
        "no sensor of a named 'sonar'; known: gps, imu, p3d, pinger, gun, fast"
    )
    for rate in (0.0, -1.0, 15.1, math.inf, math.nan):
        assert refused(CommandError, "a", "imu", rate=rate) == (
            f"invalid rate {rate:g} Hz for imu of a: above 0, and at most the sensor's 15 Hz"
        )


@given(
    own=st.floats(0.01, 1000.0),
    share=st.floats(0.01, 1.0),
    timestep=st.sampled_from([0.001, 0.01, 0.02, 1 / 3]),
    start=st.integers(0, 10**6),
)
def test_a_slice_never_passes_a_step_where_a_reading_is_due(own, share, timestep, start):
    """Also far into a run, and with times that are sums of steps."""
    one = Subscription("a", "s", own * share, print, own)
    time = start * timestep
    steps = one.steps(time, timestep)
    for between in {1, steps // 2, steps - 1} - {0}:
        if between < steps:
            assert one.number(time + between * timestep) == one.number(time)


@given(own=st.floats(0.1, 100.0), share=st.floats(0.05, 1.0))
def test_counts_follow_the_rate(own, share):
    """Stops of the slices find every reading that is due by the rule, one after another."""
    sensor = SimpleNamespace(boat="a", name="s", config=SimpleNamespace(rate=own))
    times = []
    subscriptions = Subscriptions([sensor], lambda boat, name: None, 0.01, None)
    clock = SimpleNamespace(step=0)
    subscriptions.add("a", "s", lambda _: times.append(clock.step), own * share, 0.0)
    while clock.step <= 2000:
        subscriptions.deliver(clock.step * 0.01)
        clock.step += subscriptions.steps(clock.step * 0.01)
    assert len(set(times)) == len(times)
    assert abs(len(times) - (20.0 * own * share + 1)) <= 2.0  # one at either end


# Contacts

PAIR, OTHER = ("a", "buoy"), ("a", "dock")
POINT = (1.0, 2.0, 3.0)


def watched(samples, *, ended=False):
    """Touches that a watch tells at times [s]; `samples` are times and forces [N] by pairs."""
    told, now = [], 0.0
    watch = ContactWatch(
        lambda touch: told.append((now, touch.other, touch.time, touch.force, touch.duration)), ended=ended
    )
    for now, forces in samples:
        watch.take({pair: ((force, 0.0, 0.0), POINT) for pair, force in forces.items()}, now)
        assert watch.waiting == bool(watch._waiting)
    return watch, told


def test_a_touch_is_told_half_a_second_after_it_began_with_the_largest_force_until_then():
    samples = [
        (1.0, {PAIR: 5.0}),
        (1.25, {PAIR: 9.0}),
        (1.5, {PAIR: 7.0}),
        (1.53125, {PAIR: 20.0}),
        (1.75, {PAIR: 30.0}),
    ]
    assert watched(samples)[1] == [(1.53125, "buoy", 1.0, 20.0, 0.53125)]


def test_a_pair_that_was_apart_for_a_second_touches_anew():
    apart = [(1.0, {PAIR: 5.0}), (1.984375, {PAIR: 6.0}), (2.984375, {PAIR: 1.0}), (4.0, {})]
    assert [(time, force) for _, _, time, force, _ in watched(apart)[1]] == [(1.0, 6.0), (2.984375, 1.0)]
    together = [(1.0, {PAIR: 5.0}), (1.984375, {PAIR: 6.0}), (2.96875, {PAIR: 1.0}), (4.0, {})]
    assert [(time, force) for _, _, time, force, _ in watched(together)[1]] == [(1.0, 6.0)]


def test_ended_touches_are_told_a_second_after_their_last_contact_by_their_names():
    samples = [(1.0, {OTHER: 5.0, PAIR: 4.0}), (1.5, {OTHER: 2.0, PAIR: 8.0}), (2.484375, {}), (2.5, {}), (4.0, {})]
    told = watched(samples, ended=True)[1]
    assert told == [(2.5, "buoy", 1.0, 8.0, 0.5), (2.5, "dock", 1.0, 5.0, 0.5)]


def test_what_was_not_told_yet_is_told_at_the_end_and_all_is_new_after_a_state_was_set():
    watch, told = watched([(1.0, {PAIR: 5.0})])
    assert (watch.waiting, told) == (True, [])
    watch.end()
    assert (watch.waiting, len(told)) == (False, 1)
    watch.begin()
    watch.take({PAIR: ((1.0, 0.0, 0.0), POINT)}, 0.5)
    watch.begin()
    assert [time for _, _, time, _, _ in told] == [1.0, 0.5]


class Loop(SimpleNamespace):
    """What a sampler of contacts looks at."""

    def __init__(self):
        look = np.zeros(1, proximity.BROADPHASE)
        super().__init__(timestep=0.01, broadphase=look, data=SimpleNamespace(ncon=0))
        self.flags = look[0]


@pytest.fixture
def sampled(monkeypatch):
    """A sampler, what it looks at, and what touches."""
    loop, touching = Loop(), {}
    monkeypatch.setattr(subscriptions, "forces_of_pairs", lambda _arrays, _boats: dict(touching))
    sampler = ContactSampler(lambda: ("a",), lambda: loop)
    sampler.begin()
    return sampler, loop, touching


def test_contacts_are_sampled_every_50_ms_while_there_are_some(sampled):
    sampler, loop, touching = sampled
    loop.data.ncon, touching[PAIR] = 1, ((1.0, 0.0, 0.0), POINT)
    taken = [step for step in range(40) if sampler.look(0.01 * step, waiting=False)]
    assert taken == list(range(0, 40, 5))
    assert [sampler.steps(0.01 * step) for step in (35, 36, 39, 40, 41)] == [5, 4, 1, 1, 1]
    assert not loop.flags["armed"]


def test_without_any_the_loop_is_armed_and_the_next_look_is_far_away_unless_a_touch_waits(sampled):
    sampler, loop, _ = sampled
    assert sampler.look(0.03, waiting=False) == {}
    assert loop.flags["armed"]
    assert sampler.steps(0.03) == 10**11 - 3
    assert sampler.look(5.0, waiting=False) is None
    sampler.begin()
    assert sampler.look(0.03, waiting=True) == {}
    assert sampler.steps(0.03) == 47
    assert sampler.look(0.49, waiting=True) is None
    assert sampler.look(0.50, waiting=True) == {}


def test_a_loop_that_stopped_is_looked_at_at_once_and_again_soon(sampled):
    sampler, loop, touching = sampled
    sampler.look(0.0, waiting=False)
    loop.flags["armed"], loop.data.ncon, touching[PAIR] = 0, 1, ((1.0, 0.0, 0.0), POINT)
    assert sampler.look(0.17, waiting=False) == touching
    assert sampler.look(0.19, waiting=False) is None
    assert sampler.look(0.20, waiting=False) == touching
    touching.clear()
    assert sampler.look(0.25, waiting=False) == {}
    loop.flags["armed"] = 0  # by what holds a boat
    assert sampler.look(0.26, waiting=False) == {}
    assert sampler.look(0.30, waiting=False) == {}


def test_a_list_of_contacts_of_an_earlier_step_is_not_read(sampled):
    sampler, loop, touching = sampled
    loop.data.ncon, touching[PAIR] = 1, ((1.0, 0.0, 0.0), POINT)
    loop.flags["clearance"] = 0.1
    assert sampler.look(0.0, waiting=False) == {}
    sampler.begin()
    loop.flags["wait"] = 3
    assert sampler.look(0.0, waiting=False) == touching
