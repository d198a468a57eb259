"""Every learning problem has all its parts, and the first one that lacks a part is named."""

import importlib
import inspect
import pkgutil
from collections.abc import Iterator
from pathlib import Path

import gymnasium
import pytest

import vrx_mj.rl.problems
from exploits import EXPLOITS, HONEST, TOLD
from vrx_mj.rl import TeamVectorEnv, VectorEnv
from vrx_mj.rl.options import VARIED
from vrx_mj.rl.problem import Problem
from vrx_mj.rl.problems import ALONE, PROBLEMS, SCORE, TEAMS

PAGE = (Path(__file__).parents[4] / "docs" / "learning.md").read_text(encoding="utf-8")
TAKEN = ("acted", "present", "diverged", "sunk", "capsized", "final_obs", "final_info", "wind_direction")
"""What `info` has of every problem, beside what is varied."""


def written() -> Iterator[type[Problem]]:
    """Every problem that a module of the package defines."""
    for module in pkgutil.iter_modules(vrx_mj.rl.problems.__path__):
        content = vars(importlib.import_module(f"vrx_mj.rl.problems.{module.name}")).values()
        for kind in content:
            whole = isinstance(kind, type) and issubclass(kind, Problem) and not inspect.isabstract(kind)
            if whole and kind.__module__.endswith(f".{module.name}"):
                yield kind


def lacking(name: str) -> list[str]:
    """The parts that a registered problem lacks."""
    kind = PROBLEMS[name]
    parts = {
        "a docstring with its reward": "Reward" in (kind.__doc__ or ""),
        "entries": bool(kind.entries),
        f"`{name}` in docs/learning.md": f"`{name}`" in PAGE,
        "an id of Gymnasium, or a team": f"vrx_mj/{name}-v0" in gymnasium.registry or name in {*TEAMS, SCORE},
    }
    if name != SCORE:  # whose worlds have tasks, with controllers
        parts |= {
            "an honest policy in tests/exploits.py": name in HONEST,
            "its own exploits in tests/exploits.py": len(EXPLOITS.get(name, {})) >= 4,
            "facts that tests/exploits.py shows": name in TOLD,
        }
    return [part for part, there in parts.items() if not there]


@pytest.mark.parametrize("name", PROBLEMS)
def test_a_problem_has_all_its_parts(name):
    assert lacking(name) == []


@pytest.mark.parametrize("name", [*ALONE, *TEAMS])
def test_every_fact_is_in_the_docstring_and_of_a_step_or_of_a_start_alone(name):
    """A fact of both would be overwritten with 0 in the rows that go on, while another row begins."""
    core = (VectorEnv if name in ALONE else TeamVectorEnv)(name, 2)._core
    of_start, of_step = core.problem.episode_facts(), core.problem.facts()
    assert of_start
    assert [fact for fact in (*of_start, *of_step) if f"`{fact}`" not in PROBLEMS[name].__doc__] == []
    assert of_start.keys() & of_step.keys() == set()
    assert (of_start.keys() | of_step.keys()) & {*TAKEN, *VARIED} == set()


def test_every_problem_that_is_written_has_a_row():
    assert [kind.__name__ for kind in written() if PROBLEMS.get(kind.__name__) is not kind] == []


def test_every_problem_is_for_one_boat_a_team_or_a_referee():
    assert sorted([*ALONE, *TEAMS, SCORE]) == sorted(PROBLEMS)
