"""Every type of sensor and of task has all its parts: who forgets one is told which, and where it belongs."""

import re
from collections.abc import Collection, Mapping
from dataclasses import fields, make_dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import get_args

import pytest

from unit.tasks.samples import SAMPLES
from vrx_mj.config.sensors import SensorConfig
from vrx_mj.config.tasks import TASKS
from vrx_mj.control import SKIPPERS
from vrx_mj.mjcf.tasks import _RESOLVERS
from vrx_mj.model import tasks
from vrx_mj.ros.interface import Output
from vrx_mj.ros.table.sensing import TOPICS
from vrx_mj.ros.table.world import MORE_TOPICS, MoreTopics, topics_of
from vrx_mj.sensors import SENSOR_KINDS
from vrx_mj.tasks import TASK_KINDS

DOCS = Path(__file__).resolve().parents[1] / "docs"


def rows(page: str, column: int = 0) -> set[str]:
    """Types in a column of a page's tables."""
    lines = re.findall(r"^\| (.*) \|$", (DOCS / page).read_text(encoding="utf-8"), re.MULTILINE)
    cells = [line.split(" | ") for line in lines]
    return {name.strip(" `") for row in cells if len(row) > column for name in row[column].split(",")}


def forgotten(what: str, parts: Mapping[str, Collection[str]]) -> list[str]:
    """The parts that types lack; `parts` has the types that have each."""
    known = sorted(set().union(*(types for part, types in parts.items() if not part.endswith(".md"))))
    return [f"{what} '{kind}' has no {part}" for kind in known for part, types in parts.items() if kind not in types]


SENSOR_PARTS: dict[str, Collection[str]] = {
    "configuration: SensorConfig in config/sensors.py": {
        kind.model_fields["type"].default for kind in get_args(get_args(SensorConfig)[0])
    },
    "record: SENSOR_KINDS in sensors/__init__.py": set(SENSOR_KINDS),
    "form in recordings: RecordedNumbers in its record": {
        name for name, kind in SENSOR_KINDS.items() if kind.numbers is not None or name == "camera"
    },
    "topics: TOPICS in ros/table/sensing.py": set(TOPICS),
    "topic of VRX 3: its stem in TOPICS in ros/table/sensing.py": {
        name for name, topics in TOPICS.items() if topics.vrx3_stem
    },
    "topic of VRX 3 made of readings: its name in TOPICS in ros/table/sensing.py": {
        name for name, topics in TOPICS.items() if not topics.made or any(topic.vrx3 != () for topic in topics.made)
    },
    "row in docs/sensors.md": rows("sensors.md"),
}


NO_TASK = SimpleNamespace(sim=SimpleNamespace(task=None, world=SimpleNamespace(parameters=SimpleNamespace(task=None))))
"""The host of a world without a task."""


def hears(topics):
    """Whether there is a topic or a service by which messages reach a task."""
    return any(not isinstance(entry, Output) for entry in topics.more(NO_TASK))


def classic_topics(kind):
    """Names of the topics and services of a type of task on ROS 1."""
    return {topic.name for topic in topics_of(NO_TASK, kind) if "vrx" in topic.dialects}


def listed_topics(page):
    """Names in the first column of a page's tables; what has no slash before it is beside the name before."""
    found, stem = set(), ""
    for cell in re.findall(r"^\| ([^|]*) \|", (DOCS / page).read_text(encoding="utf-8"), re.MULTILINE):
        for name in re.findall(r"`([^`]+)`", cell):
            stem = name.rpartition("/")[0] if name.startswith("/") else stem
            found.add(name if name.startswith("/") else f"{stem}/{name}")
    return found


TASK_PARTS: dict[str, Collection[str]] = {
    "configuration: Task in config/tasks.py": set(TASKS),
    "compiled form: Task in model/tasks.py": set(tasks.TASKS),
    "record: TASK_KINDS in tasks/__init__.py": set(TASK_KINDS),
    "topic or service for its message: MORE_TOPICS in ros/table/world.py": {
        name
        for name in TASK_KINDS
        if name not in SAMPLES or not SAMPLES[name].message or hears(MORE_TOPICS.get(name, MoreTopics()))
    },
    "controller: SKIPPERS in control/__init__.py": set(SKIPPERS),
    "sample: SAMPLES in tests/unit/tasks/samples.py": set(SAMPLES),
    "row in docs/tasks.md": rows("tasks.md"),
    "row in docs/controllers.md": rows("controllers.md", 1),
    "topics in docs/ros.md": {name for name in TASK_KINDS if classic_topics(name) <= listed_topics("ros.md")},
}
PARTS = {"sensor": SENSOR_PARTS, "task": TASK_PARTS}


@pytest.mark.parametrize("what", PARTS)
def test_every_type_has_all_its_parts(what):
    assert "\n".join(forgotten(what, PARTS[what])) == ""


def test_a_forgotten_part_is_named():
    parts = {"record: KINDS": {"old", "new"}, "topics: TOPICS": {"old"}, "row in docs/a.md": {"old", "new", "| type |"}}
    assert forgotten("task", parts) == ["task 'new' has no topics: TOPICS"]


@pytest.mark.parametrize("name", SENSOR_KINDS)
def test_records_are_found_by_the_type_of_their_configuration(name):
    assert SENSOR_KINDS[name].type == name == SENSOR_KINDS[name].config.model_fields["type"].default


def fields_from_nowhere(compiled, config):
    """Fields of a compiled task that are neither keys of its file nor found in the world."""
    return [own.name for own in fields(compiled) if own.name not in _RESOLVERS and not gives(config, own.name)]


def gives(config, key):
    return key in config.model_fields or hasattr(config, key)


@pytest.mark.parametrize("name", TASKS)
def test_a_field_of_a_compiled_task_is_a_key_of_its_file_or_in_the_resolvers_of_mjcf_tasks(name):
    assert fields_from_nowhere(tasks.TASKS[name], TASKS[name]) == []
    more = make_dataclass("More", ["laps"], bases=(tasks.TASKS[name],), frozen=True, kw_only=True)
    assert fields_from_nowhere(more, TASKS[name]) == ["laps"]
