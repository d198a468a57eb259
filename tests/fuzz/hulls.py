"""Hulls of profile `marine`: `hull:` of a robot's YAML, and files of radiation and diffraction."""

import contextlib
import functools
import json
import random
import tempfile
from pathlib import Path
from typing import Any

import yaml

from fuzz import raw, trees
from fuzz.kind import Files, Kind, write
from fuzz.yaml_files import ASSETS, mutated_yaml, sail_fleet, seeds_in

CASES = ASSETS / "validation" / "worlds"
BOATS = ("barge", "box_boat", "iea_sphere", "kramer_sphere", "otter")
WORLD = b"""physics: {profile: marine}
sea: {model: jonswap, significant_height: 0.3, peak_period: 3.0, components: 10}
current: {speed: 0.2}
spawn: {pose: [0, 0, 0.1, 0, 0, 0]}
"""
FLEET = b"usv_count: 1\nrobot: ./robot.yaml\n"
FULL = b"""
shapes: [{type: box, size: [4, 2, 1]}, {type: sphere, radius: 0.5, pose: [0, 0, 0.6, 0, 0, 0]}]
hydrostatics: mesh
point: [0, 0, 0]
added_mass: [[900, 0, 0, 0, 10, 0], [0, 2000, 0, -9, 0, 0], [0, 0, 3000, 0, 0, 0], [0, -9, 0, 400, 0, 0],
  [10, 0, 0, 0, 2500, 0], [0, 0, 0, 0, 0, 2000]]
munk: false
damping_linear: [9, 9, 900, 90, 900, 90]
damping_quadratic: [9, 9, 9, 9, 9, 9]
crossflow: {stern: -2, bow: 2, strips: 5, draft: [0.2, 0.5], coefficient: 1}
skegs: [{x: -2, z: -0.3, area: 0.1, aspect_ratio: 0.5}]
"""
"""Keys of `hull` for the barge, of which the cases use few."""


@functools.cache
def folder_of(boat: str) -> dict[str, bytes]:
    """The files of a case's boat."""
    return {file.name: file.read_bytes() for file in sorted((CASES / boat).iterdir()) if file.is_file()}


@functools.cache
def robots() -> list[tuple[str, bytes, Any]]:
    """Boats of the cases with their YAML, and the barge with more keys."""
    found = [(boat, text, tree) for boat in BOATS for text, tree in seeds_in(CASES / boat, named="robot.yaml")]
    (_, _, barge), full = found[0], yaml.safe_load(FULL)
    tree = {**barge, "hull": full}
    return [*found, *[("barge", yaml.safe_dump(tree).encode(), tree)] * 3]


def mutated_hull(chance: random.Random) -> Files:
    """A robot's YAML, or the mesh of its hull."""
    boat, text, tree = chance.choice(robots())
    beside = folder_of(boat)
    meshes = [name for name in beside if name.endswith(".obj")]
    if meshes and chance.random() < 0.2:
        changed = {meshes[0]: raw.mutated_lines(beside[meshes[0]].decode(), chance).encode("utf-8", "replace")}
    else:
        changed = {"robot.yaml": mutated_yaml(text, tree, chance)}
    return {**changed, **{key: value for key, value in beside.items() if key not in changed}, **around()}


def around() -> Files:
    """The world and the fleet."""
    return {"fleet.yaml": FLEET, "world.yaml": WORLD}


@functools.cache
def hydro() -> Any:
    """The tree of a file of radiation and diffraction, short enough for many changes."""
    tree = json.loads(folder_of("kramer_sphere")["hydro.json"])
    for key in ("frequencies", "added_mass", "damping", "diffraction"):
        tree[key] = tree[key][::4]
    return tree


def mutated_hydro(chance: random.Random) -> Files:
    """A file of radiation and diffraction."""
    text = json.dumps(hydro()).encode()
    if chance.random() < 0.15:
        changed = raw.mutated(text, chance)
    else:
        try:
            changed = json.dumps(trees.mutated(hydro(), chance), default=str).encode("utf-8", "surrogatepass")
        except (ValueError, RecursionError, TypeError):
            changed = raw.mutated(text, chance)
    beside = {key: value for key, value in folder_of("kramer_sphere").items() if key != "hydro.json"}
    return {"hydro.json": changed, **beside, **around()}


@functools.cache
def warm() -> None:
    """Read what is mutated, and compile the kernels of hulls."""
    robots()
    for boat in ("barge", "kramer_sphere"):
        with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
            write({**folder_of(boat), **around()}, Path(folder))
            sail_fleet(Path(folder))


KINDS = (Kind("hull", mutated_hull, sail_fleet, warm=warm), Kind("hydro", mutated_hydro, sail_fleet, warm=warm))
