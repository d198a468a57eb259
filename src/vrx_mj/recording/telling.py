"""How a task goes, in words: phase, score, collisions and parts, in Markdown."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from vrx_mj.tasks.referee import Referee
from vrx_mj.tasks.registry import TASK_KINDS

__all__ = ["words"]

MARKS = {"ahead": "·", "crossed": "✓", "missed": "–", "backwards": "✗"}
"""Of gates."""


def words(task: Mapping[str, Any], referee: Referee) -> str:
    """Phase, score, collisions and parts of a task, in Markdown."""
    status, meaning = referee.status, TASK_KINDS[task["type"]]
    clock = {
        "initial": f"ready at {status.ready_time:g} s",
        "ready": f"runs from {status.running_time:g} s",
        "running": f"{status.remaining:.0f} s left",
        "finished": ("time is up" if status.timed_out else "done") + f" after {status.elapsed:.1f} s",
    }[status.phase]
    hits = f"collisions **{status.collisions}**"
    lines = [
        f"**{referee.name}: {status.phase}**, {clock}",
        f"score **{status.score:.2f} {meaning.unit}**, the {meaning.better} the better; {hits}",
        *_parts(referee.progress),
    ]
    return "\n\n".join(lines)


def _parts(progress: Mapping[str, Any]) -> Iterator[str]:
    """How far the parts of a task are."""
    if "gates" in progress:
        yield "gates " + " ".join(f"{number}{MARKS[fate]}" for number, fate in enumerate(progress["gates"], 1))
    if progress.get("waypoints"):
        yield "least errors [m] " + ", ".join(f"{error:.2f}" for error in progress["waypoints"])
    if "animals" in progress:
        yield "\n".join(f"- {_animal(animal)}" for animal in progress["animals"])
    if "bay" in progress:
        yield ", ".join(_in_dock(progress))
    if "up" in progress:
        yield "before the boat: " + (
            ", ".join(name for name, up in zip(progress["objects"], progress["up"], strict=True) if up) or "nothing"
        )


def _animal(animal: Mapping[str, Any]) -> str:
    """What the boat does with an animal, and how many of its eight gates it has crossed."""
    status = f"{animal['name']} {animal['status'].replace('_', ' ')}"
    return status if animal["goal"] == "avoid" else f"{status}, {len(animal['circled'])} of 8"


def _in_dock(progress: Mapping[str, Any]) -> Iterator[str]:
    yield f"in {progress['bay']} for {progress['time_in_bay']:.0f} s" if progress["bay"] else "in no bay"
    yield from (f"docked in {bay}" for bay in progress["docked"])
    if progress["hits"]:
        yield f"balls in holes {len(progress['hits'])}"
    if progress["colors"]:
        yield "colours sent " + " ".join(progress["colors"])
