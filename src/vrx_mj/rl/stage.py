"""The world of a team's problem, and what runs it."""

from typing import Any

import gymnasium

from vrx_mj.arguments import check_name
from vrx_mj.mjcf.compile import Source, compile_world
from vrx_mj.mjcf.world import World
from vrx_mj.rl.options import check_count
from vrx_mj.rl.problems import TEAMS as PROBLEMS
from vrx_mj.rl.problems.refereed import RefereedRow
from vrx_mj.rl.problems.score import Score
from vrx_mj.rl.team import TeamProblem
from vrx_mj.runtime.batch import Batch

__all__ = ["SCORE", "Stage", "staged"]

Stage = tuple[World, Batch | RefereedRow, TeamProblem]
SCORE = "Score"
"""The problem that is not of its own, but a world's task."""
SPACING = 12.0
"""Of boats where they are compiled [m]; problems but `Score` put them elsewhere."""
_MORE = {True: "many", False: "few"}


def staged(
    name: str, n: int, *, boats: Any, world: Source | None, fleet: Source | None, moving: bool, threads: int | None
) -> Stage:
    """A problem of `n` rows with its world, `moving` if boats are to come and go.

    Raises:
        UnknownNameError: there is no such problem.
        gymnasium.error.Error: it is not for such a world, or not for so many rows or boats.
        VrxError: the world or the fleet is wrong.
    """
    check_name("problem", name, (*PROBLEMS, SCORE))
    kind: type[TeamProblem] = PROBLEMS.get(name, Score)
    if name == SCORE and (n != 1 or world is None):
        needs = f"invalid num_envs {n}: a referee watches one world" if n != 1 else "give a world with a task"
        raise gymnasium.error.Error(f"{SCORE}: {needs}")
    compiled = compile_world(kind.world if world is None else world, fleet=_fleet(kind, boats, fleet))
    _check_size(name, kind, len(compiled.boats), boats, moving=moving)
    if name != SCORE:
        return compiled, Batch(compiled, n, threads=threads), PROBLEMS[name](n, len(compiled.boats))
    if not compiled.parameters.task:
        raise gymnasium.error.Error(f"{SCORE}: the world {compiled.name} has no task")
    row = RefereedRow(compiled)
    return compiled, row, Score(row)


def _fleet(kind: type[TeamProblem], boats: Any, fleet: Source | None) -> Source:
    if fleet is not None:
        return fleet
    count = kind.boats if boats is None else boats
    check_count("boats", count)
    return {"usv_count": int(count), "layout": "line", "spacing": SPACING, "origin": "spawn", "sensors": "none"}


def _check_size(name: str, kind: type[TeamProblem], size: int, boats: Any, *, moving: bool) -> None:
    if boats is not None and size != boats:
        raise gymnasium.error.Error(f"invalid boats {boats}: the fleet has {size}; give one of the two")
    if kind.fixed and size != kind.boats:
        raise gymnasium.error.Error(f"{name} needs {kind.boats} boats: {size} are too {_MORE[size > kind.boats]}")
    if kind.fixed and moving:
        raise gymnasium.error.Error(f"{name} needs {kind.boats} boats all the time: joining and leaving must be 0")
