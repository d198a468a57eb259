"""What manoeuvres measure, instruments send, memories are fitted by and films look at: the numbers of before."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

import vrx_mj
from fingerprints import check, numbers_in
from integration.test_fingerprints_worlds import SEA, compiled
from unit.trials.test_trials import Nomoto
from vrx_mj.adapters.pole_fit import fitted_memory
from vrx_mj.nmea import Instruments
from vrx_mj.recording.video import Film, Shot
from vrx_mj.recording.video.stage import Above, Chase, Footage
from vrx_mj.trials import SimulatedVessel, VesselState, crash_stop, decay, pull_out, spiral, turning, zigzag

QUICK, OTHERS = {"turning": turning}, {"zigzag": zigzag, "crash_stop": crash_stop, "pull_out": pull_out,
                                       "spiral": spiral, "decay": decay}  # fmt: skip
PIXELS = 1e-2
"""Share of a fingerprint that another renderer's pixels may change."""


def check_trial(name, trial, robot):
    world = compiled({"physics": {"profile": "marine"}, "sea": {"model": "none"}},
                     fleet={"boats": [{"robot": robot, "name": "a", "pose": [0] * 6}], "sensors": "none"})  # fmt: skip
    found = trial(SimulatedVessel(vrx_mj.Simulation(world), "a"))
    figures = {key: [one.value, one.unit] for key, one in found.figures.items()}
    check("trials", f"{name} of {robot}", figures=figures, track=found.track)


@pytest.mark.parametrize("name", QUICK)
def test_a_manoeuvre_measures_what_it_did(name):
    check_trial(name, QUICK[name], "skiff")


class Hull(Nomoto):
    """Nomoto's model with a skid, and with heave, roll and pitch that die out by linear and quadratic damping."""

    def __init__(self, **model):
        super().__init__(**model)
        self.aside = dict.fromkeys(("heave", "roll", "pitch"), (0.0, 0.0))

    @property
    def state(self):
        (z, _), (roll, _), (pitch, _) = self.aside.values()
        return super().state._replace(z=0.3 + z, roll=0.01 + roll, pitch=pitch - 0.02, sway=-0.4 * self.r)

    def advance(self, power, helm, duration):
        if duration > 1.0:
            return
        super().advance(power, helm, duration)
        for number, (mode, (place, rate)) in enumerate(self.aside.items()):
            omega = 2.0 + 0.5 * number
            pull = omega**2 * place + (0.1 + 0.1 * number + (2.0 - number) * abs(rate)) * rate
            after = rate - duration * pull
            self.aside[mode] = place + duration * after, after

    def displace(self, mode, amount):
        self.aside[mode] = self.aside[mode][0] + amount, 0.0


def all_of(trial):
    """What a trial found, as a report and a chart have it."""
    figures = {key: [one.value, one.unit] for key, one in trial.figures.items()}
    return [trial.name, figures, trial.curves, trial.axes, trial.remarks, vars(trial.track)]


MODELS = {"steady": {}, "unsteady": {"n1": -0.5, "n3": 10.0}, "deaf": {"gain": 0.0}}


@pytest.mark.parametrize("model", MODELS)
def test_a_model_measures_what_it_did_in_every_manoeuvre(model):
    """Of a boat that keeps its course, one that does not, and one without a helm."""
    manoeuvres = (turning,) if model == "deaf" else (turning, zigzag, crash_stop, pull_out, spiral)
    found = [all_of(trial(Hull(**MODELS[model]))) for trial in manoeuvres]
    if model == "steady":
        found.append(all_of(zigzag(Hull(gain=0.6, drag=0.4), power=0.7, helm=0.9, angle=10.0)))
    found.append(all_of(crash_stop(Hull(**MODELS[model]), power=0.8, astern=0.5)))
    check("trials", f"all of {model}", found=found)


def test_a_model_decays_as_it_did_in_every_mode():
    modes = [("heave", None), ("roll", None), ("pitch", None), ("roll", -0.3), ("pitch", 1e-3)]
    check("trials", "decays", found=[all_of(decay(Hull(), mode=mode, amount=amount)) for mode, amount in modes])


def vessel(*, rudder=None, max_angle=0.0):
    """A boat of a simulation that notes what it is commanded, with engines ahead, aside and one across."""
    places = {"port": (0.5, 1.0), "starboard": (-0.5, 1.0), "cross": (0.0, 0.5)}
    engines = {
        name: SimpleNamespace(
            name=name, position=(-2.0, y, 0.0), direction=(ahead, 0.0, 0.0), max_angle=max_angle, max_command=80.0
        )
        for name, (y, ahead) in places.items()
    }
    hull = SimpleNamespace(rudders={"r": rudder} if rudder else {})
    seen = SimpleNamespace(
        thrusters=engines, hull=hull, position=np.array([3.0, 4.0, 0.2]), velocity=np.array([1.0, 0.5, 0.0]),
        angular_velocity=np.array([0.1, 0.2, 0.3]), heading=0.7, roll=0.02, pitch=-0.03,
    )  # fmt: skip
    noted = []
    sim = SimpleNamespace(
        time=7.0,
        observe=lambda: {"boat": seen},
        step=lambda commands, duration: noted.append((commands, duration)),
        set_boat=lambda boat, pose, velocity: noted.append((boat, pose, velocity)),
    )
    return SimulatedVessel(sim, "boat"), noted


def test_the_helm_turns_rudders_or_engines_or_takes_thrust_from_the_inner_side():
    found, words = [], []
    rudder = SimpleNamespace(name="rudder", max_angle=0.5)
    for kind in ({}, {"rudder": rudder}, {"max_angle": 0.3}, {"max_angle": 2.0}, {"max_angle": 0.3, "rudder": rudder}):
        boat, noted = vessel(**kind)
        for power, helm in ((1.0, 0.0), (0.5, 1.0), (0.5, -0.25), (-0.8, 0.5)):
            boat.advance(power, helm, 0.02)
        for mode in ("heave", "roll", "pitch"):
            boat.displace(mode, 0.1)
        found.append((noted, boat.state))
        words.append(boat.helm)
    check("trials", "helms", found=found)
    assert words == [
        "less thrust on the inner side: none at full helm", "rudder_angle: up to 28.6 degrees",
        "port_angle, starboard_angle: up to 17.2 degrees", "port_angle, starboard_angle: up to 35 degrees",
        "rudder_angle: up to 28.6 degrees",
    ]  # fmt: skip
    assert boat.state == VesselState(7.0, 3.0, 4.0, 0.2, 0.7, 0.02, -0.03, 1.0, 0.5, 0.3)
    assert math.isclose(noted[0][0]["boat"]["port"], 80.0)


@pytest.mark.slow
@pytest.mark.nightly
def test_so_do_the_others():
    for name, trial in OTHERS.items():
        check_trial(name, trial, "skiff")


def test_instruments_send_what_they_sent():
    sim = vrx_mj.Simulation(compiled({"extends": "sydney_regatta", "sea": SEA}, fleet="trio"), seed=3)
    instruments, sent = Instruments(sim), []
    for _ in range(30):
        sent += [line for boat in sim.boats for line in (*instruments.sentences(boat), *instruments.reports(boat))]
        sim.step({boat: {"left": 0.8, "right": 0.6} for boat in sim.boats}, duration=0.1)
    check("trials", "instruments", sentences=[numbers_in(str(line)) for line in sent])


@pytest.mark.slow
@pytest.mark.nightly
def test_a_memory_is_fitted_by_the_poles_that_it_was():
    """Of a hump of damping in three modes that are coupled, with noise."""
    frequencies, random = np.linspace(0.1, 6.0, 40), np.random.default_rng(2)
    shape = random.normal(size=(6, 6))
    whole = np.eye(6) + 0.05 * (shape + shape.T)
    hump = frequencies**3 * np.exp(-1.2 * frequencies) * (1.0 + 0.01 * random.normal(size=40))
    added = whole * (5.0 + np.cos(frequencies) * np.exp(-frequencies))[:, None, None]
    memory = fitted_memory(frequencies, added, whole * hump[:, None, None], 5.0 * whole)
    order = np.lexsort((memory.poles.imag, memory.poles.real))
    found = [[part.real, part.imag] for part in (memory.poles[order], memory.residues[order])]
    check("trials", "memory", rounding=1e-6, found=found, error=memory.error)


def eyes_of(recorded):
    """Where boats were, and where the eyes that follow them look from, at moments between the rows."""
    footage, times = Footage(recorded), (0.0, 0.513, 7.217)
    paths = {boat: footage.path(boat) for boat in recorded.boats}
    eyes = [Chase(paths["wamv1"], footage.level), Above([*paths.values()], footage.level, 1.6)]
    return [paths, [eye.eye(time) for eye in eyes for time in times], [footage.places(footage.at(t)) for t in times]]


@pytest.mark.slow
@pytest.mark.nightly
@pytest.mark.render
def test_films_show_what_they_showed(tmp_path):
    sim = vrx_mj.Simulation(compiled("example_course", fleet="trio"), seed=3)
    with vrx_mj.record(sim, tmp_path / "run.rrd"):
        sim.step({boat: {"left": 0.8, "right": 0.7} for boat in sim.boats}, duration=8.0)
    recorded = vrx_mj.read_record(tmp_path / "run.rrd")
    check("trials", "eyes", eyes=eyes_of(recorded))
    for view in ("both", "chase", "above"):
        film = Film(recorded, Shot(view=view, fps=5.0), size=(320, 180), fps=5.0)
        try:
            pictures = [film.picture(time) for time in (0.0, 4.0, 7.9)]
        finally:
            film.close()
        blocks = [picture.reshape(18, 10, 32, 10, 3).mean(axis=(1, 3)) for picture in pictures]
        check("trials", f"film {view}", rounding=PIXELS, blocks=blocks)
