"""Every type of sensor and of task has all its parts: who forgets one is told which, and where it belongs."""

import re
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import get_args

import pytest

from vrx_mj.config.sensors import SensorConfig
from vrx_mj.config.tasks import TASKS
from vrx_mj.control.captain import SKIPPERS
from vrx_mj.mjcf.tasks import _RESOLVERS
from vrx_mj.model.tasks import Task
from vrx_mj.ros.table.sensing import TOPICS
from vrx_mj.ros.table.tasks import TASK_TOPICS
from vrx_mj.sensors.registry import SENSOR_KINDS
from vrx_mj.tasks.registry import TASK_KINDS

DOCS = Path(__file__).resolve().parents[1] / "docs"


def rows(page: str) -> set[str]:
    """Types in the first column of a page's tables."""
    lines = re.findall(r"^\| ([^|]*) \|", (DOCS / page).read_text(encoding="utf-8"), re.MULTILINE)
    return {name.strip(" `") for line in lines for name in line.split(",")}


def forgotten(what: str, parts: Mapping[str, Collection[str]]) -> list[str]:
    """The parts that types lack; `parts` has the types that have each."""
    known = sorted(set().union(*(types for part, types in parts.items() if not part.endswith(".md"))))
    return [f"{what} '{kind}' has no {part}" for kind in known for part, types in parts.items() if kind not in types]


SENSOR_PARTS: dict[str, Collection[str]] = {
    "configuration: SensorConfig in config/sensors.py": {
        kind.model_fields["type"].default for kind in get_args(get_args(SensorConfig)[0])
    },
    "record: SENSOR_KINDS in sensors/registry.py": set(SENSOR_KINDS),
    "form in recordings: RecordedNumbers in its record": {
        name for name, kind in SENSOR_KINDS.items() if kind.numbers is not None or name == "camera"
    },
    "topics: TOPICS in ros/table/sensing.py": set(TOPICS),
    "topic of VRX 3: its stem in TOPICS in ros/table/sensing.py": {
        name for name, topics in TOPICS.items() if topics.vrx3_stem
    },
    "topic of VRX 3 made of readings: its name in TOPICS in ros/table/sensing.py": {
        name for name, topics in TOPICS.items() if not topics.made or any(topic.vrx3 for topic in topics.made)
    },
    "row in docs/sensors.md": rows("sensors.md"),
}
TASK_PARTS: dict[str, Collection[str]] = {
    "configuration: AnyTask in config/tasks.py": set(TASKS),
    "parameters: _RESOLVERS in mjcf/tasks.py": {name for name, config in TASKS.items() if config in _RESOLVERS},
    "compiled form: Task in model/tasks.py": {
        name for kind in get_args(get_args(Task)[0]) for name in get_args(kind.__annotations__["type"])
    },
    "record: TASK_KINDS in tasks/registry.py": set(TASK_KINDS),
    "controller: SKIPPERS in control/captain.py": set(SKIPPERS),
    "topics: TASK_TOPICS in ros/table/tasks.py": set(TASK_TOPICS),
    "row in docs/tasks.md": rows("tasks.md"),
}
PARTS = {"sensor": SENSOR_PARTS, "task": TASK_PARTS}


@pytest.mark.parametrize("what", PARTS)
def test_every_type_has_all_its_parts(what):
    assert forgotten(what, PARTS[what]) == []


@pytest.mark.parametrize(("what", "part"), [(what, part) for what, parts in PARTS.items() for part in parts])
def test_who_forgets_a_part_is_told_which(what, part):
    incomplete = {name: set(types) | ({"new"} if name != part else set()) for name, types in PARTS[what].items()}
    assert forgotten(what, incomplete) == [f"{what} 'new' has no {part}"]


@pytest.mark.parametrize("name", SENSOR_KINDS)
def test_records_are_found_by_the_type_of_their_configuration(name):
    assert SENSOR_KINDS[name].type == name == SENSOR_KINDS[name].config.model_fields["type"].default
