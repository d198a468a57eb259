"""The macros of VRX's worlds make the same in a series, in a xacro, and in what xacro expands it to."""

import warnings
from pathlib import Path

import pytest
import yaml

from macro_blocks import BLOCKS
from vrx_mj.cli.nodes import NODES
from vrx_mj.config.world import load_world
from vrx_mj.errors import VrxWarning
from vrx_mj.formats.series.worlds import macros

HEAD = (
    '<sdf version="1.6" xmlns:xacro="http://ros.org/wiki/xacro">\n<world name="bay">\n'
    '<xacro:include filename="$(find vrx_gazebo)/worlds/xacros/include_all_xacros.xacro"/><xacro:include_all_xacros/>\n'
)


@pytest.mark.parametrize("name", macros())
def test_a_macro_makes_the_same_in_a_series_and_when_xacro_expands_it(name, tmp_path, monkeypatch):
    called = macros()[name]
    base = "" if called.part == "base" else "sydneyregatta_minus_scene"
    given = {"name": "course"} if "name" in called.defaults else {}
    lit = {"light_buoy_present": "true"} if "light_buoy_present" in called.defaults else {}
    words = "".join(f' {key}="{value}"' for key, value in {**given, **lit}.items())
    blocks = "".join(f"<{key}>{BLOCKS[key]}</{key}>" for key in called.blocks)
    body = f"{base and f'<xacro:{base}/>'}<xacro:{name}{words}>{blocks}</xacro:{name}>"
    monkeypatch.chdir(tmp_path)
    Path("bay.world.xacro").write_text(f"{HEAD}{body}\n</world>\n</sdf>\n", encoding="utf-8")
    assert NODES["xacro"](["bay.world.xacro", "-o", "made.world"], Path()) == []
    values = {key: f"'{value}'" for key, value in {**given, **lit}.items()}
    call = values | {f"/**{key}": BLOCKS[key] if "<" in BLOCKS[key] else f"'{BLOCKS[key]}'" for key in called.blocks}
    calls = {**({base: [None]} if base else {}), name: [call or None]}
    Path("bay.yaml").write_text(yaml.safe_dump({"a": {"steps": 1, "macros": calls}}), encoding="utf-8")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", VrxWarning)
        first, *others = (comparable(load_world(source)) for source in ("bay.yaml#0", "bay.world.xacro", "made.world"))
    assert others == [first] * 2


def comparable(world):
    """What makes a world, its objects in order and its task named."""
    said = world.model_dump(exclude={"name", "description", "spawn", "folder"})
    said["objects"] = sorted(said["objects"], key=lambda thing: thing["name"])
    if said["task"]:
        said["task"]["name"] = said["task"]["name"] or said["task"]["type"]
    return said
