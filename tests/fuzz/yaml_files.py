"""Worlds, fleets, objects, parts, axes, terrains and docks: YAML, JSON and text, compiled and sailed."""

import functools
import json
import random
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import yaml

from fuzz import raw, trees
from fuzz.kind import Files, Kind
from vrx_mj import Simulation, compile_world
from vrx_mj.config.world import load_world
from vrx_mj.formats.series.axes import read_series
from vrx_mj.formats.series.worlds import series_world
from vrx_mj.packages import root

REPO = Path(__file__).resolve().parents[2]
ASSETS, BROKEN = root() / "assets", REPO / "tests" / "broken"
AXES = REPO / "tests" / "unit" / "formats" / "series" / "axes"
STEPS = 5
PLAIN = b"sea: {gain: 0.2}\nspawn: {pose: [0, 0, 0.1, 0, 0, 0]}\n"


class Dumper(getattr(yaml, "CSafeDumper", yaml.SafeDumper)):  # type: ignore[misc]
    """Without anchors of its own: what stands twice in a mutated tree is written twice."""

    def ignore_aliases(self, data: Any) -> bool:
        """Whether a value is written in full."""
        return True


def sail(world: Any, fleet: Any = None) -> None:
    """Compile a world, and go some steps with every command that its boats take."""
    sim = Simulation(compile_world(world, fleet=fleet))
    sim.step({boat: dict.fromkeys(sim.command_names(boat), 0.7) for boat in sim.boats})
    sim.advance(STEPS)
    sim.observe()


SAILED = ("ocean", "gymkhana", "vrx2023/wildlife_task", "vrx2023/follow_path_task", "scan_dock_deliver")
"""Worlds that have every kernel of the loop, of tasks and of docks compiled."""


@functools.cache
def warm_kernels() -> None:
    """Compile what is compiled at first use: inputs are to find it in the cache."""
    for world in SAILED:
        sail(world)
    sail("ocean", {"usv_count": 1, "engines": "hinged"})
    docks = [{"name": "dock", "layout": "X", "pose": [30, 0, 0, 0, 0, 0], "dynamic": True}]
    sail({"extends": "ocean", "docks": docks})
    buoy = {"name": "buoy", "model": "mb_marker_buoy_red", "pose": [10, 5, 0, 0, 0, 0]}
    for fleet in (None, {"usv_count": 1, "engines": "hinged"}):  # in marine, which worlds have that name no profile
        sail({"docks": docks, "objects": [buoy]}, fleet)


def sail_world(folder: Path) -> None:
    """Sail the world of a folder."""
    sail(folder / "world.yaml")


def sail_fleet(folder: Path) -> None:
    """Sail the world of a folder with its fleet."""
    sail(folder / "world.yaml", folder / "fleet.yaml")


def mutated_yaml(text: bytes, tree: Any, chance: random.Random) -> bytes:
    """A YAML file with changes to its tree, its lines or its bytes."""
    draw = chance.random()
    if draw < 0.12 or tree is None:
        return raw.mutated(text, chance)
    if draw < 0.2:
        return raw.mutated_lines(text.decode("utf-8", "replace"), chance).encode("utf-8", "replace")
    try:
        done = dumped(trees.mutated(tree, chance))
    except (ValueError, RecursionError):  # too many digits
        return raw.mutated(text, chance)
    if draw < 0.3:
        return raw.mutated(done, chance)
    return _aliased(done, chance) if draw < 0.36 else done


def dumped(tree: Any) -> bytes:
    """A tree as YAML."""
    return yaml.dump(tree, Dumper=Dumper, sort_keys=False, allow_unicode=True).encode("utf-8", "surrogatepass")


def _aliased(text: bytes, chance: random.Random) -> bytes:
    """With an anchor at one value, and an alias of it, or a merge, at another."""
    lines = text.decode("utf-8", "replace").split("\n")
    marked = [i for i, line in enumerate(lines) if ": " in line or line.endswith(":")]
    if len(marked) < 2:
        return text
    first, second = sorted(chance.sample(marked, 2))
    key, _, value = lines[first].partition(":")
    lines[first] = f"{key}: &a{value or ' '}"
    other = lines[second].partition(":")[0]
    lines[second] = chance.choice(
        [f"{other}: *a", f"{other}: [*a, *a, *a]", other.rpartition(" ")[0] + " <<: *a", f"{other}: *b"]
    )
    return "\n".join(lines).encode("utf-8", "replace")


def seeds_in(*folders: Path, named: str = "*.yaml") -> list[tuple[bytes, Any]]:
    """Files with their trees; None for those that are no YAML."""
    files = sorted(file for folder in folders for file in folder.rglob(named))
    return [(file.read_bytes(), _tree(file)) for file in files]


def _tree(file: Path) -> Any:
    """The tree of a file; None if it has none, or aliases, which can make it endless."""
    try:
        text = file.read_text("utf-8")
        if file.suffix == ".json":
            return json.loads(text)
        return None if re.search(r"(?<!\w)\*\w", text) else yaml.safe_load(text)
    except (yaml.YAMLError, ValueError, RecursionError):
        return None


Seeds = list[tuple[bytes, Any]]
"""Texts with their trees."""


def yaml_kind(
    name: str, seeds: Callable[[], Seeds], around: Mapping[str, bytes], tried: Callable[[Path], None]
) -> Kind:
    """A kind whose file is `NAME.yaml`, with some files `around` it; one in eight is a broken one of the tests."""

    @functools.cache
    def pools() -> tuple[Seeds, Seeds]:
        good = seeds()
        return good, [*(seeds_in(folder) if (folder := BROKEN / f"{name.rstrip('s')}s").is_dir() else ())] or good

    def mutated(chance: random.Random) -> Files:
        text, tree = chance.choice(pools()[chance.random() < 0.125])
        return {f"{name}.yaml": mutated_yaml(text, tree, chance), **around}

    return Kind(name, mutated, tried, warm=pools)


ODD_CELLS = ("X" * 60, "x", "\t", "#", " " * 300, "\n" * 50, "\u0425", "\r", "\0")


def mutated_dock(chance: random.Random) -> Files:
    """A drawing with letters changed."""
    text, _ = chance.choice(dock_seeds())
    world = DOCK_WORLD.replace(b"}]", b", dynamic: true}]") if chance.random() < 0.3 else DOCK_WORLD
    if chance.random() < 0.2:
        return {"dock.txt": raw.mutated(text, chance), "world.yaml": world}
    letters = list(text.decode("utf-8", "replace"))
    for _ in range(raw.few(chance, 12)):
        at = chance.randrange(len(letters) + 1)
        odd = chance.choice(ODD_CELLS) if chance.random() < 0.2 else chance.choice(["X", " ", "\n", "XX\nXX", "X\n"])
        letters[at : at + chance.choice([0, 1, 1, 5])] = odd
    return {"dock.txt": "".join(letters).encode("utf-8", "replace"), "world.yaml": world}


@functools.cache
def dock_seeds() -> list[tuple[bytes, Any]]:
    """Drawings of docks."""
    return seeds_in(ASSETS / "docks", ASSETS / "start", named="*.txt") * 3 + seeds_in(BROKEN / "docks", named="*.txt")


def started(name: str) -> Seeds:
    """Files of one kind that `vrx-mj new` copies, and the WAM-V's."""
    return [
        (text, tree)
        for text, tree in seeds_in(ASSETS / "start", ASSETS / "robots" / "wamv" / "config", named=f"{name}.yaml")
    ]


FLEETS: Seeds = [
    (dumped(tree), tree)
    for tree in (
        {"usv_count": 3, "layout": "circle", "radius": 20, "heading": "outward", "robot": "wamv", "sensors": "none"},
        {
            "usv_count": 4,
            "layout": "grid",
            "spacing": 12,
            "origin": [5, 5, 0.3],
            "robot": "skiff",
            "boats": [{"name": "guard", "pose": [80, 0, 0.1, 0, 0, 0]}],
        },
        {
            "usv_count": 2,
            "positions": [{"x": 0, "y": 20, "z": 0.1, "Y": 0}, {"x": 17, "y": -10, "z": 0.1, "Y": 120}],
            "engines": "hinged",
            "thrusters": "T",
        },
        {
            "boats": [
                {"name": "a", "pose": [0, 0, 0.1, 0, 0, 0], "robot": "cora", "color": "orange"},
                {"name": "b", "pose": [30, 0, 0.1, 0, 0, 1], "sensors": ["gps_wamv"]},
            ]
        },
    )
]
DOCK_WORLD = b"docks: [{name: dock, layout: ./dock.txt, pose: [60, 0, 0, 0, 0, 0.3]}]\n" + PLAIN
OBJECT_WORLD = b"objects: [{name: thing, model: ./object.yaml, pose: [40, 0, 0.2, 0, 0, 0]}]\n" + PLAIN
TERRAIN_WORLD = b"terrain: shore\nspawn: {pose: [100000, 0, 0.1, 0, 0, 0]}\n"
TRIANGLE = (ASSETS / "objects" / "meshes" / "triangle.obj").read_bytes()


def _parts_fleet(key: str) -> bytes:
    return f"usv_count: 1\nrobot: wamv\n{key}: {key}.yaml\n".encode()


def _series(folder: Path) -> None:
    """Read an axes file and the first worlds of it."""
    series = read_series(folder / "axes.yaml")
    for number in range(min(series.count, 5)):
        load_world(series_world(series, number).section)


def mutated_terrain(chance: random.Random) -> Files:
    """Rings of points, changed."""
    text, tree = chance.choice(terrain_seeds())
    done = raw.mutated(text, chance) if chance.random() < 0.2 else json_bytes(trees.mutated(tree, chance))
    return {"assets/terrain/shore.json": done, "world.yaml": TERRAIN_WORLD}


@functools.cache
def terrain_seeds() -> list[tuple[bytes, Any]]:
    """Shores."""
    hole = [[10.0, 10.0], [10.0, 20.0], [20.0, 20.0]]
    tree = {
        "land": [
            {"exterior": [[0, 0], [50, 0], [50, 40], [0, 40]], "holes": [hole]},
            {"exterior": [[80, 0], [120, 5], [100, 60]]},
        ]
    }
    own = (json.dumps(tree).encode(), tree)
    return [*seeds_in(ASSETS / "terrain", named="*.json"), *[own] * 4]


def json_bytes(tree: Any) -> bytes:
    """A tree as JSON, with NaN and infinities as Python writes them."""
    try:
        return json.dumps(tree).encode("utf-8", "surrogatepass")
    except ValueError:
        return b'{"n": 1' + b"0" * 5000 + b"}"


SHARED = {"world.yaml": PLAIN}
KINDS = (
    yaml_kind("world", lambda: seeds_in(ASSETS / "worlds"), {}, sail_world),
    yaml_kind("fleet", lambda: started("fleet") + FLEETS, SHARED, sail_fleet),
    yaml_kind(
        "object", lambda: seeds_in(ASSETS / "objects") + started("object") * 10,
        {"world.yaml": OBJECT_WORLD, "meshes/triangle.obj": TRIANGLE}, sail_world,
    ),
    *(
        yaml_kind(
            f"{key}s", functools.partial(started, f"{key}_config"),
            {"fleet.yaml": _parts_fleet(f"{key}s"), **SHARED}, sail_fleet,
        )
        for key in ("thruster", "component")
    ),
    yaml_kind("axes", lambda: seeds_in(AXES), {}, _series),
    Kind("terrain", mutated_terrain, sail_world, warm=terrain_seeds),
    Kind("dock", mutated_dock, sail_world, warm=dock_seeds),
)  # fmt: skip
