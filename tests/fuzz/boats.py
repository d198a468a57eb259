"""Robots: their YAML, xacro and URDF, and what they include."""

import functools
import random
from collections.abc import Callable

from fuzz import markup, raw
from fuzz.kind import Files, Kind
from fuzz.yaml_files import ASSETS, BROKEN, PLAIN, REPO, mutated_yaml, sail_fleet, seeds_in
from vrx_mj.config.fleet import Order
from vrx_mj.config.robots import load_robot
from vrx_mj.mjcf.build import robot_urdf

GOLDEN = REPO / "tests" / "golden" / "urdf"
ROBOTS = ASSETS / "robots"
FLEET = b"usv_count: 1\nrobot: ./%s\n"
NAMES = ("skiff", "cora")


@functools.cache
def folder_of(name: str) -> dict[str, bytes]:
    """The files of one of our robots."""
    folder = ROBOTS / name
    return {
        file.relative_to(folder).as_posix(): file.read_bytes() for file in sorted(folder.rglob("*.*")) if file.is_file()
    }


@functools.cache
def urdf_of(name: str) -> bytes:
    """One of our robots as a URDF, whose meshes lie beside it."""
    return robot_urdf(load_robot(name), Order(name)).encode()


@functools.cache
def macros() -> list[bytes]:
    """Xacro files of the WAM-V, which VRX's users edit, and those of the tests."""
    ours = [file.read_bytes() for file in sorted((ROBOTS / "wamv").rglob("*.xacro"))]
    return ours + [file.read_bytes() for file in sorted((BROKEN / "xacro").glob("*.xacro"))]


def around(name: str, first: str, content: bytes, robot: str) -> Files:
    """One file of a robot, and the others beside it."""
    return {
        first: content,
        **{key: value for key, value in folder_of(name).items() if key != first},
        "fleet.yaml": FLEET % robot.encode(),
        "world.yaml": PLAIN,
    }


def mutated_robot(chance: random.Random) -> Files:
    """A robot's YAML."""
    name = chance.choice(NAMES)
    text = folder_of(name)["robot.yaml"]
    trees = [tree for content, tree in robot_trees() if content == text] or [None]
    return around(name, "robot.yaml", mutated_yaml(text, trees[0], chance), "robot.yaml")


@functools.cache
def robot_trees() -> list[tuple[bytes, object]]:
    """The YAML files of our robots, with their trees."""
    return seeds_in(ROBOTS)


def mutated_xacro(chance: random.Random) -> Files:
    """A robot's xacro; sometimes with macros of the WAM-V beside it, or one of the tests' in its place."""
    if chance.random() < 0.25:
        text = chance.choice(macros())
        return {
            "boat.urdf.xacro": safely(markup.mutated, text, chance),
            "fleet.yaml": FLEET % b"boat.urdf.xacro",
            "world.yaml": PLAIN,
        }
    name = chance.choice(NAMES)
    file = f"{name}.urdf.xacro"
    return around(name, file, markup.mutated(folder_of(name)[file], chance), "robot.yaml")


def safely(mutate: Callable[[bytes, random.Random], bytes], text: bytes, chance: random.Random) -> bytes:
    """A seed that is no XML has its bytes mutated."""
    try:
        return mutate(text, chance)
    except (ValueError, SyntaxError):
        return raw.mutated(text, chance)


def mutated_urdf(chance: random.Random) -> Files:
    """A URDF: that of one of our robots, or VRX's own WAM-V."""
    if chance.random() < 0.3:
        return {
            "boat.urdf": markup.mutated((GOLDEN / "wamv.urdf").read_bytes(), chance),
            "fleet.yaml": FLEET % b"boat.urdf",
            "world.yaml": PLAIN,
        }
    name = chance.choice(NAMES)
    return around(name, "boat.urdf", markup.mutated(urdf_of(name), chance), "boat.urdf")


def warm() -> None:
    """Read all that is mutated."""
    for name in NAMES:
        urdf_of(name)
    macros()
    robot_trees()


KINDS = (
    Kind("robot", mutated_robot, sail_fleet, warm=warm),
    Kind("xacro", mutated_xacro, sail_fleet, warm=warm),
    Kind("urdf", mutated_urdf, sail_fleet, warm=warm),
)
