"""Every type of sensor has all of its parts: who adds one and forgets a part is told which, and where it belongs."""

import re
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import get_args

import pytest

from vrx_mj.config.sensors import SensorConfig
from vrx_mj.ros.table.sensing import TOPICS
from vrx_mj.sensors.registry import SENSOR_KINDS

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
    "row in docs/sensors.md": rows("sensors.md"),
}


def test_every_type_of_sensor_has_all_its_parts():
    assert forgotten("sensor", SENSOR_PARTS) == []


@pytest.mark.parametrize("part", SENSOR_PARTS)
def test_whoever_forgets_a_part_of_a_sensor_is_told_which(part):
    incomplete = {name: set(types) | ({"sonar"} if name != part else set()) for name, types in SENSOR_PARTS.items()}
    assert forgotten("sensor", incomplete) == [f"sensor 'sonar' has no {part}"]


@pytest.mark.parametrize("name", SENSOR_KINDS)
def test_records_are_found_by_the_type_of_their_configuration(name):
    assert SENSOR_KINDS[name].type == name == SENSOR_KINDS[name].config.model_fields["type"].default
