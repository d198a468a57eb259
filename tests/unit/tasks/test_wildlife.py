"""Animals to circle and to avoid, with scores by hand."""

import json
import math
import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from unit.tasks.streams import frame, pose, task
from vrx_mj.errors import CommandError
from vrx_mj.tasks.courses import gate_between, side_of
from vrx_mj.tasks.wildlife import AXES, GATES, Wildlife, gate_side

CROCODILE = {"name": "croc", "model": "crocodile_buoy", "goal": "avoid"}
PLATYPUS = {"name": "platy", "model": "platypus_buoy", "goal": "circumnavigate_clockwise"}
TURTLE = {"name": "turtle_0", "model": "turtle_buoy", "goal": "circumnavigate_counterclockwise"}
AT = {"croc": (-100.0, 0.0), "platy": (0.0, 100.0), "turtle_0": (0.0, 0.0)}
"""Where the animals are."""
AWAY = (50.0, 50.0)


def wildlife(*animals, **values):
    parameters = {
        "animals": list(animals or (CROCODILE, PLATYPUS, TURTLE)),
        "engagement_distance": 10.0,
        "time_bonus": 30.0,
        "publication_rate": None,
        "collision_buffer": 10.0,
    }
    row = task("wildlife", **(parameters | values))
    return Wildlife(row)


class Run:
    """A run of a boat among animals."""

    def __init__(self, referee, at=None, start=True):
        self.referee, self.at, self.time, self.lines = referee, dict(at or AT), 0.0, []
        if start:
            self.go(AWAY, 0.0).go(AWAY)
            assert referee.status.phase == "running"
            self.lines.clear()

    def go(self, boat=AWAY, seconds=0.05, touches=None, **others):
        """A frame, some time after the one before."""
        self.time += seconds
        verdict = self.referee.look(frame(self.time, boat, touches, **(self.at | others)))
        self.lines += [line for line, _ in verdict.lines if not line.startswith("wildlife: ")]
        return self

    def around(self, name, *azimuths, radius=8.0, seconds=0.05):
        """Frames with the boat at azimuths [degrees] from an animal."""
        x, y = self.at[name]
        for azimuth in azimuths:
            self.go(
                (x + radius * math.cos(math.radians(azimuth)), y + radius * math.sin(math.radians(azimuth))), seconds
            )
        return self

    def animal(self, name):
        return next(animal for animal in self.referee.progress["animals"] if animal["name"] == name)

    def circled(self, name):
        """How many gates of the circle are crossed."""
        return len(self.animal(name)["circled"])

    @property
    def score(self):
        return self.referee.status.score

    @property
    def over(self):
        return self.referee.is_over


CCW = range(-16, 325, 10)
"""35 azimuths: one at which it is engaged, one before the first gate, ..., and 9 degrees past the eighth."""
CW = range(16, -325, -10)


def test_a_perfect_run_by_hand():
    """35 frames around the turtle, 50 s of way, 35 around the platypus; a bonus for each, and for the crocodile."""
    run = Run(wildlife(time_bonus=5.0)).around("turtle_0", *CCW)
    assert run.animal("turtle_0")["status"] == "circumnavigated"
    assert (run.over, run.score) == (False, pytest.approx(0.05 + 35 * 0.05))
    run.go(seconds=50.0).around("platy", *CW[:-1])
    assert not run.over
    run.around("platy", CW[-1])
    assert (run.over, run.referee.status.timed_out) == (True, False)
    assert run.score == pytest.approx(0.05 + 70 * 0.05 + 50.0 - 15.0)
    assert run.lines[:2] == ["turtle_0 engaged", "turtle_0: 1 of 8 gates of its circle crossed"]
    assert run.lines[8:10] == ["turtle_0: 8 of 8 gates of its circle crossed", "turtle_0 circled: 5 s bonus at the end"]
    assert run.lines[-1] == "all animals circled after 53.55 s: bonus 15 s"


@pytest.mark.parametrize(
    ("animal", "way", "done"), [(TURTLE, CCW, True), (TURTLE, CW, False), (PLATYPUS, CW, True), (PLATYPUS, CCW, False)]
)
def test_the_sense_is_the_goals(animal, way, done):
    run = Run(wildlife(animal)).around(animal["name"], *way, *way, *way)
    assert run.over is done
    if not done:
        assert run.circled(animal["name"]) == 0
        assert f"{animal['name']} passed the wrong way round" in run.lines


def test_the_eighth_gate_closes_the_circle():
    run = Run(wildlife(TURTLE)).around("turtle_0", *CCW[:-1])
    assert (run.circled("turtle_0"), run.over) == (7, False)
    assert run.animal("turtle_0")["circled"] == [0, 1, 2, 3, 4, 5, 6]
    assert run.around("turtle_0", 314.9).circled("turtle_0") == 7
    assert run.around("turtle_0", 315.1).over


@pytest.mark.parametrize("first", range(2, 360, 15))
def test_a_circle_may_begin_at_any_azimuth(first):
    """Gates are at multiples of 45 degrees; the first frame engages, the second is the first that looks."""
    run = Run(wildlife(TURTLE)).around("turtle_0", first, first + 5)
    azimuth = first + 5
    while not run.over:
        azimuth += 5
        run.around("turtle_0", azimuth)
        assert run.circled("turtle_0") == azimuth // 45 - (first + 5) // 45
    assert run.circled("turtle_0") == GATES


def test_the_wrong_sense_starts_over():
    run = Run(wildlife(TURTLE)).around("turtle_0", *range(-16, 105, 10))
    assert run.circled("turtle_0") == 3
    run.around("turtle_0", 85)
    assert run.circled("turtle_0") == 0
    assert run.lines[-1] == "turtle_0 passed the wrong way round: its circle starts over after 3 of 8 gates"
    run.around("turtle_0", 88, *range(96, 404, 10))
    assert (run.circled("turtle_0"), run.over) == (7, False)
    assert run.around("turtle_0", 406).over


def test_just_after_a_crossing_a_gate_forgets():
    """VRX's: back over the gate in the very next frame is no crossing, so there and back count twice."""
    run = Run(wildlife(TURTLE)).around("turtle_0", -5, -5, 5, -5, 5)
    assert run.animal("turtle_0")["circled"] == [0, 0]
    run.around("turtle_0", 6, -5)
    assert run.circled("turtle_0") == 0


def test_eight_crossings_need_not_be_of_eight_gates():
    """VRX's: from gate 0 straight past the animal to its far side, then over gate 6, and so on."""
    run = Run(wildlife(TURTLE)).around("turtle_0", -10, -10)
    for lap in range(1, 5):
        run.around("turtle_0", 10, 190, 350)
        assert run.animal("turtle_0")["circled"] == [0, 6] * lap
    assert run.over


def test_leaving_the_radius_starts_over():
    run = Run(wildlife(TURTLE)).around("turtle_0", *CCW[:-1])
    assert run.circled("turtle_0") == 7
    run.around("turtle_0", 320, radius=10.01)
    assert (run.circled("turtle_0"), run.animal("turtle_0")["status"]) == (0, "not_engaged")
    assert run.lines[-1] == "turtle_0 left: its circle starts over after 7 of 8 gates"
    run.around("turtle_0", 320, 324, 334)
    assert (run.circled("turtle_0"), run.over) == (1, False)


def test_a_side_is_remembered_while_the_boat_is_away():
    """VRX's: before the gate when it left, after it when it is back, is a crossing."""
    run = Run(wildlife(TURTLE)).around("turtle_0", -10, -10).around("turtle_0", -10, radius=11.0)
    run.around("turtle_0", 10)
    assert run.circled("turtle_0") == 0
    assert run.around("turtle_0", 10).animal("turtle_0")["circled"] == [0]


@pytest.mark.parametrize(
    ("boat", "engaged"),
    [
        (pose(10.0, 0.0), True),
        (pose(10.001, 0.0), False),
        (pose(8.0, 0.0, z=5.9), True),
        (pose(8.0, 0.0, z=6.1), False),
        (pose(9.99, 0.0, z=1.0), False),
    ],
)
def test_the_radius_is_in_space(boat, engaged):
    run = Run(wildlife(TURTLE)).go(boat)
    assert run.animal("turtle_0")["status"] == ("engaged" if engaged else "never_engaged")


def test_the_gates_go_with_the_animal():
    """The boat is at rest, and the turtle swims clockwise around it: so does the boat around the turtle."""
    run = Run(wildlife(PLATYPUS), at={"platy": (0.0, 0.0)})
    for azimuth in range(196, -145, -10):
        at = (8.0 * math.cos(math.radians(azimuth)), 8.0 * math.sin(math.radians(azimuth)))
        run.go((0.0, 0.0), platy=at)
    assert run.over


# Collisions


@pytest.mark.parametrize(("profile", "counted"), [("vrx", 0), ("vrx3", 1)])
@pytest.mark.parametrize("other", ["turtle_0", "croc", "pier"])
def test_any_collision_starts_over_all_circles(profile, counted, other):
    second = {**TURTLE, "name": "turtle_1"}
    run = Run(wildlife(TURTLE, second, profile=profile), at={"turtle_0": (0.0, 0.0), "turtle_1": (1.0, 0.0)})
    run.around("turtle_0", -10, -10, 10, seconds=5.0)
    assert (run.circled("turtle_0"), run.circled("turtle_1")) == (1, 1)
    run.go((8.0, 1.5), touches={other: run.time})
    assert (run.circled("turtle_0"), run.circled("turtle_1")) == (0, 0)
    assert run.referee.status.collisions == counted
    assert run.lines[-2:] == [
        f"the circle around turtle_{number} starts over: collision with {other}" for number in (0, 1)
    ]


@pytest.mark.parametrize(("touch", "left"), [(9.9, 1), (10.1, 0)])
def test_a_hit_within_the_buffer_starts_nothing_over(touch, left):
    """The buffer of 10 s begins at 0 s, in VRX."""
    run = Run(wildlife(TURTLE)).around("turtle_0", -10, -10, 10, seconds=3.0)
    assert run.circled("turtle_0") == 1
    assert run.go((8.0, 1.5), 2.0, touches={"croc": touch}).circled("turtle_0") == left


def test_what_is_circled_stays_circled():
    run = Run(wildlife(TURTLE, PLATYPUS)).go(seconds=11.0).around("turtle_0", *CCW)
    run.go(touches={"turtle_0": run.time}).around("platy", *CW)
    assert run.over
    assert run.circled("turtle_0") == GATES


# Scores


@pytest.mark.parametrize(("profile", "score"), [("vrx", 0.0), ("vrx3", 1.8 - 60.0)])
def test_a_score_is_negative_in_vrx3_only(profile, score):
    """A frame at 0.05 s, then 35: 1.8 s; a bonus of 60 s."""
    run = Run(wildlife(TURTLE, CROCODILE, profile=profile)).around("turtle_0", *CCW)
    assert (run.over, run.score) == (True, pytest.approx(score))


@pytest.mark.parametrize("profile", ["vrx", "vrx3"])
@pytest.mark.parametrize(
    ("bonus", "engaged", "score"),
    [(30.0, False, 270.0), (30.0, True, 300.0), (299.0, False, 1.0), (300.0, False, 300.0), (400.0, False, 300.0)],
)
def test_out_of_time(profile, bonus, engaged, score):
    """The crocodile's bonus; a score that would not be above 0 is not written, and the full time poses."""
    run = Run(wildlife(CROCODILE, TURTLE, time_bonus=bonus, profile=profile)).go((-95.0, 0.0) if engaged else AWAY)
    run.go(seconds=100.0)
    assert run.score == pytest.approx(100.1)
    run.go(seconds=200.0)
    assert (run.over, run.referee.status.timed_out, run.score) == (True, True, score)


def test_a_circle_has_its_bonus_when_time_is_up():
    run = Run(wildlife()).around("turtle_0", *CCW).go(seconds=300.0)
    assert (run.referee.status.timed_out, run.score) == (True, 240.0)


def test_a_crocodile_engaged_once_has_lost_its_bonus():
    run = Run(wildlife(CROCODILE, TURTLE, time_bonus=1.0)).go((-95.0, 0.0)).go().go((-95.0, 0.0)).go(seconds=20.0)
    assert run.animal("croc")["status"] == "not_engaged"
    assert run.lines == ["croc engaged: its bonus is lost", "croc left", "croc engaged", "croc left"]
    run.around("turtle_0", *CCW)
    assert run.score == pytest.approx(run.referee.status.elapsed - 1.0)


@pytest.mark.parametrize(("profile", "score"), [("vrx", 0.0), ("vrx3", -30.0)])
def test_without_an_animal_to_circle_the_task_ends_as_it_begins(profile, score):
    run = Run(wildlife(CROCODILE, profile=profile), start=False).go(AWAY, 0.0).go(AWAY)
    assert (run.over, run.score) == (True, score)


def test_nothing_counts_before_it_runs():
    run = Run(wildlife(durations=[1.0, 1.0, 300.0]), start=False)
    run.go((-95.0, 0.0), 0.0).go((-95.0, 0.0), 1.0).around("turtle_0", *CCW, seconds=0.01)
    assert run.referee.outputs == {}
    assert {animal["status"] for animal in run.referee.progress["animals"]} == {"never_engaged"}


def test_only_the_tasks_boat_circles():
    run = Run(wildlife())
    for azimuth in CCW:
        place = (8.0 * math.cos(math.radians(azimuth)), 8.0 * math.sin(math.radians(azimuth)))
        run.go(AWAY, wamv2=place)
    assert {animal["status"] for animal in run.referee.progress["animals"]} == {"never_engaged"}
    assert run.lines == []


# What the team sees


def test_animals_are_told_by_their_goal():
    """VRX names them by what is to be done, whatever they look like."""
    wrong = {"name": "croc", "model": "crocodile_buoy", "goal": "circumnavigate_clockwise"}
    run = Run(wildlife(wrong, TURTLE, {**PLATYPUS, "goal": "avoid"}))
    run.go(AWAY, croc=(-101.0, 2.0, 0.5))
    nowhere = {"z": 0.0, "latitude": None, "longitude": None}
    assert run.referee.outputs == {
        "animals": [
            {"name": "platypus", "x": -101.0, "y": 2.0, "yaw": pytest.approx(0.5)} | nowhere,
            {"name": "turtle", "x": 0.0, "y": 0.0, "yaw": 0.0} | nowhere,
            {"name": "crocodile", "x": 0.0, "y": 100.0, "yaw": 0.0} | nowhere,
        ]
    }
    run.referee.outputs["animals"][0]["x"] = 9.0  # what was handed out is nobody else's
    assert run.referee.outputs["animals"][0]["x"] == -101.0


@pytest.mark.parametrize(("rate", "times"), [(None, 241), (1.0, 13), (0.33, 4), (0.1, 2), (100.0, 241)])
def test_animals_are_announced_at_their_rate(rate, times):
    """Over 12 s from running on, 241 frames: at 0, 1/rate, 2/rate, ..."""
    referee = wildlife(TURTLE, publication_rate=rate, durations=[0.0, 1.0, 300.0])
    told = set()
    for step in range(20 * 13 + 1):
        referee.look(frame(step / 20, AWAY, turtle_0=(step, 0.0)))
        if referee.outputs:
            told.add(referee.outputs["animals"][0]["x"])
    first = [20, 40, 60] if rate == 1.0 else [20]
    assert sorted(told)[: len(first)] == first
    assert len(told) == times


def test_no_message_is_taken():
    with pytest.raises(CommandError) as caught:
        wildlife().accept("animals", [])
    assert str(caught.value) == "wildlife takes no message 'animals'; known: none"


# State


def wandering(seed):
    """A stream of frames in which circles are begun, broken and closed."""
    draw = random.Random(seed)
    azimuth, radius, step, about = 0.0, 8.0, 20.0, "turtle_0"
    for number in range(600):
        about = draw.choice(list(AT)) if draw.random() < 0.01 else about
        step = {"turtle_0": 20.0, "platy": -20.0, "croc": 0.0}[about]
        azimuth += step if draw.random() < 0.98 else -step
        radius = draw.choice((8.0, 11.0)) if draw.random() < 0.03 else radius
        x, y = AT[about]
        boat = (x + radius * math.cos(math.radians(azimuth)), y + radius * math.sin(math.radians(azimuth)))
        touches = {"pier": number / 20} if draw.random() < 0.02 else {}
        yield frame(number / 20, boat, touches, **AT)


@pytest.mark.parametrize("profile", ["vrx", "vrx3"])
@pytest.mark.parametrize("seed", range(6))
def test_a_run_cut_anywhere_goes_on_exactly(seed, profile):
    stream = list(wandering(seed))
    values = {"profile": profile, "publication_rate": 0.7, "durations": [1.0, 1.0, 25.0], "collision_buffer": 3.0}
    whole = wildlife(**values)
    said = [whole.look(each) for each in stream]
    assert any("circled" in text for verdict in said for text, _ in verdict.lines)
    for cut in random.Random(seed).sample(range(len(stream)), 8):
        first, second = wildlife(**values), wildlife(**values)
        before = [first.look(each) for each in stream[:cut]]
        second.load(json.loads(json.dumps(first.dump())))
        assert before + [second.look(each) for each in stream[cut:]] == said
        assert second.dump() == whole.dump()


def test_two_referees_share_nothing():
    one, other = wildlife(), wildlife()
    Run(one).around("turtle_0", *CCW)
    assert other.dump() == wildlife().dump()


# Geometry


@given(x=st.floats(-12, 12), y=st.floats(-12, 12), gate=st.integers(0, GATES - 1))
def test_a_gate_is_one_of_two_buoys(x, y, gate):
    """Against the gates of the navigation channel, the end of the radius being the red buoy: to starboard."""
    axis = AXES[gate]
    along, across = x * axis[0] + y * axis[1], y * axis[0] - x * axis[1]
    if min(abs(along), abs(along - 10.0), abs(across)) < 1e-9:
        return
    between = gate_between(pose(10.0 * axis[0], 10.0 * axis[1]), pose())
    assert gate_side(x, y, axis, 10.0) == side_of(between, x, y)


@pytest.mark.parametrize(
    ("azimuth", "sides"),
    [
        (0.0, ["after", "before", "outside", "outside", "outside", "outside", "after", "after"]),
        (22.5, ["after", "before", "before", "outside", "outside", "outside", "outside", "after"]),
    ],
)
def test_the_gates_stand_at_every_45_degrees(azimuth, sides):
    """By hand, at 5 m: up to 90 degrees ahead of a gate is before it, up to 90 degrees past it is after it."""
    x, y = 5.0 * math.cos(math.radians(azimuth)), 5.0 * math.sin(math.radians(azimuth))
    found = [gate_side(x, y, axis, 10.0) for axis in AXES]
    neither = {2, 6} if azimuth == 0.0 else set()  # at right angles rounding decides
    assert [side for gate, side in enumerate(found) if gate not in neither] == [
        side for gate, side in enumerate(sides) if gate not in neither
    ]
