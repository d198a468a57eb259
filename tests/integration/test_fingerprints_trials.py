"""What manoeuvres measure, instruments send, memories are fitted by and films look at: the numbers of before."""

import numpy as np
import pytest

import vrx_mj
from fingerprints import check, numbers_in
from integration.test_fingerprints_worlds import SEA, compiled
from vrx_mj.adapters.pole_fit import fitted_memory
from vrx_mj.nmea import Instruments
from vrx_mj.recording.video import Film, Shot
from vrx_mj.recording.video.stage import Above, Chase, Footage
from vrx_mj.trials import SimulatedVessel, crash_stop, decay, pull_out, spiral, turning, zigzag

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
