"""A boat's MJCF as files of its own, without a world."""

from pathlib import Path

from vrx_mj.mjcf.boats import Boat
from vrx_mj.mjcf.robots import robot_piece

__all__ = ["save_robot"]


def save_robot(boat: Boat, target: Path, *, name: str) -> None:
    """Write a boat's MJCF to `target`, with its meshes in `assets` beside it, for plain MuJoCo.

    It is the rigid boat on a free joint, with engines that turn on their hinges; water, wind and thrust are what a
    world adds. `name` is the model's: names inside have no prefix, and MuJoCo's `attach` gives them one.
    """
    robot = robot_piece(boat, "hinged")
    text = robot.document(name)
    folder = target.parent / "assets"
    folder.mkdir(exist_ok=True)
    for file, content in robot.files.items():
        (folder / file).write_bytes(content)
        text = text.replace(f'file="{file}"', f'file="assets/{file}"')
    target.write_text(text, encoding="utf-8", newline="\n")
