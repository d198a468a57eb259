"""The controllers that a fleet names, as one."""

from types import SimpleNamespace

import pytest

from trees import partial
from vrx_mj.errors import CommandError, VrxError
from vrx_mj.runtime.run import fleet_controller, names_controllers

MODULE = """
calls = []

def all_ahead(obs, t):
    calls.append(t)
    return {**{boat: {"left": 1.0} for boat in obs}, "task": {"ping": 1}}

class Turner:
    def reset(self, seed):
        self.seed = seed

    def __call__(self, obs, t):
        return {boat: {"right": self.seed} for boat in obs}

def silent(obs, t):
    return None

def nonsense(obs, t):
    return 0.5
"""


@pytest.fixture
def crew(tmp_path, monkeypatch):
    (tmp_path / "some_crew.py").write_text(MODULE, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)


def steered(*names, task=None):
    """What the fleet's controller commands four boats, the first of which have these controllers."""
    boats = [{"name": f"wamv{i + 1}", "controller": name} for i, name in enumerate(names)]
    world = SimpleNamespace(parameters=partial({"boats": boats, "task": task}))
    controller = fleet_controller(SimpleNamespace(world=world, seed=5))
    return controller(dict.fromkeys(["wamv1", "wamv2", "wamv3", "wamv4"]), 2.0)


@pytest.mark.usefixtures("crew")
def test_each_controller_commands_its_own_boats_and_is_called_once():
    commands = steered("some_crew:all_ahead", "some_crew:Turner", "some_crew:all_ahead", None)
    assert commands == {"wamv1": {"left": 1.0}, "wamv3": {"left": 1.0}, "wamv2": {"right": 5}}
    import some_crew

    assert some_crew.calls == [2.0]


@pytest.mark.usefixtures("crew")
@pytest.mark.parametrize(("scored", "told"), [("wamv1", True), ("wamv2", False)])
def test_messages_to_the_task_come_from_the_controller_of_the_scored_boat(scored, told):
    commands = steered("some_crew:all_ahead", "some_crew:silent", task={"boat": scored})
    assert ("task" in commands) == told


def test_a_fleet_that_names_no_controller_has_none():
    sim = SimpleNamespace(world=SimpleNamespace(parameters=partial({"boats": [{"name": "old"}], "task": None})), seed=0)
    assert fleet_controller(sim) is None
    assert not names_controllers(sim)


@pytest.mark.usefixtures("crew")
def test_what_cannot_be_used_is_told_with_its_boats():
    with pytest.raises(VrxError) as caught:
        steered(*["some_crew:nobody"] * 5)
    assert str(caught.value) == (
        "controller of wamv1, wamv2, wamv3 and 2 more: the module 'some_crew' has no attribute 'nobody'"
    )
    with pytest.raises(CommandError) as caught:
        steered("some_crew:nonsense")
    assert str(caught.value) == (
        "the controller some_crew:nonsense returned 0.5: a mapping by boat, or None, is needed"
    )
