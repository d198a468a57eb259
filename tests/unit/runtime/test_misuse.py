"""What the public functions say when they are given something of another kind, in whole messages."""

import re

import pytest

import vrx_mj
from integration.sailing import CALM, boats, simulation
from vrx_mj.errors import CommandError, ConfigError, StateError, UnknownNameError, VrxError


@pytest.fixture(scope="module")
def sim():
    return simulation(boats((0.0, 0.0, 0.0), engines="fixed"), sea=CALM, wind=None, timestep=0.01)


TAKES = "known: left, right, left_angle, right_angle"
WRITE = "each needs its name, as in command('a', left=0.5)"
AS_IN = 'a mapping by boat is needed, as in {"wamv1": {"left": 0.5, "left_angle": 0.1}}'


def no_arguments():
    """A controller that can be none."""


def recorded(sim):
    with vrx_mj.record(sim, "unwritten.rrd"):
        pass


@pytest.mark.parametrize(
    ("ask", "error", "message"),
    [
        (
            lambda sim: sim.command("a", {"left": 1}),
            CommandError,
            f"invalid commands {{'left': 1}} for a: {WRITE}; {TAKES}",
        ),
        (lambda sim: sim.command("a", 0.5, 0.4), CommandError, f"invalid commands 0.5, 0.4 for a: {WRITE}; {TAKES}"),
        (lambda sim: sim.command("b", 0.5), UnknownNameError, "no boat named 'b'; known: a"),
        (lambda sim: sim.command({"a": {}}), CommandError, "command takes the name of a boat first, not {'a': {}}"),
        (lambda sim: sim.command_all({3: {}}), UnknownNameError, "no boat named '3'; known: a"),
        (lambda sim: sim.step(0.1), CommandError, f"invalid commands 0.1: {AS_IN}"),
        (lambda sim: sim.step(duration="1"), CommandError, "invalid duration '1': a number of seconds is needed"),
        (lambda sim: sim.advance(0.1), CommandError, "invalid number of steps 0.1: a whole number is needed"),
        (lambda sim: sim.reset(1.5), CommandError, "invalid seed 1.5: a whole number is needed"),
        (lambda sim: sim.reset("a"), CommandError, "invalid seed 'a': a whole number is needed"),
        (
            lambda sim: sim.set_state(b"abc"),
            StateError,
            "set_state takes a State, as get_state() or State.load(path) returns it, not b'abc'",
        ),
        (
            lambda _: vrx_mj.Simulation("ocean"),
            CommandError,
            "Simulation takes a World, as compile_world returns it, not 'ocean'",
        ),
        (vrx_mj.Simulation, CommandError, "Simulation takes a World, as compile_world returns it, not Simulation"),
        (
            lambda _: vrx_mj.run("ocean"),
            CommandError,
            "run takes a simulation, as Simulation(world), not 'ocean'",
        ),
        (lambda _: recorded(None), CommandError, "record takes a simulation, as Simulation(world), not None"),
        (
            lambda sim: vrx_mj.run(sim, 1.0, controller="team:Captain"),
            VrxError,
            "invalid controller 'team:Captain': a function, or a class with __call__, is needed",
        ),
        (
            lambda sim: vrx_mj.run(sim, 1.0, controller=no_arguments),
            VrxError,
            "invalid controller 'no_arguments()': two arguments are needed, the observations by boat and the time [s]",
        ),
        (
            lambda sim: vrx_mj.run(sim, 1.0, control_rate=0),
            CommandError,
            "invalid control_rate 0: a number of calls per second above 0 is needed",
        ),
        (
            lambda _: vrx_mj.compile_world(3),
            ConfigError,
            "<world>: expected a name, a path or a mapping, got 3",
        ),
        (
            lambda _: vrx_mj.compile_world("ocean", fleet=["wamv"]),
            ConfigError,
            "<fleet>: expected a name, a path or a mapping, got ['wamv']",
        ),
    ],
)
def test_what_is_given_is_told_with_what_is_possible(sim, ask, error, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    before = sim.get_state().sha256
    with pytest.raises(error, match=f"^{re.escape(message)}$"):
        ask(sim)
    assert sim.get_state().sha256 == before
    assert not list(tmp_path.iterdir())
