"""Broken files and the whole message that each must give: `tests/broken/KIND/CASE.yaml` and `CASE.expected`.

`...` is the rest of a list that grows. `tests/broken/ours` stands in for the package's own assets, so that what
those hold changes no message.
"""

import re
from pathlib import Path

import pytest

from vrx_mj.config.docks import load_dock
from vrx_mj.config.fleet import load_fleet
from vrx_mj.config.objects import load_object
from vrx_mj.config.robots import load_robot
from vrx_mj.config.world import load_world
from vrx_mj.errors import VrxError

BROKEN = Path(__file__).parents[2] / "broken"
LOADERS = {
    "docks": load_dock,
    "fleets": lambda file: load_fleet(file, load_world("rough")),
    "objects": load_object,
    "robots": load_robot,
    "worlds": load_world,
}
CASES = [
    (kind, file.name)
    for kind in LOADERS
    for file in sorted((BROKEN / kind).iterdir())
    if file.suffix in {".yaml", ".txt"}
]


def message(kind, name):
    """What loading a broken file says."""
    with pytest.raises(VrxError) as caught:
        LOADERS[kind](name)
    return str(caught.value)


@pytest.mark.parametrize(("kind", "name"), CASES, ids=[f"{kind}-{Path(name).stem}" for kind, name in CASES])
@pytest.mark.usefixtures("ours")
def test_a_broken_file_says_what_and_where(kind, name, monkeypatch):
    monkeypatch.chdir(BROKEN / kind)
    expected = (BROKEN / kind / name).with_suffix(".expected").read_text(encoding="utf-8")
    pattern = re.escape(expected.rstrip("\n")).replace(re.escape(", ..., "), ", .*, ")
    assert re.fullmatch(pattern, message(kind, name)), f"{message(kind, name)}\n\n{expected}"


def test_there_are_enough_broken_files():
    assert len(CASES) >= 60


def test_no_message_speaks_of_pydantic_or_yaml_internals():
    text = "\n".join(file.read_text(encoding="utf-8") for file in BROKEN.glob("*/*.expected"))
    for word in (
        "pydantic",
        "http",
        "Input should",
        "Value error",
        "type=",
        "block mapping",
        "scalar",
        "tuple",
    ):
        assert word not in text
