"""`vrx-mj new robot --hull`: a boat of any closed mesh, estimated by published rules."""

import math
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import typer

from vrx_mj.cli.files import new_folder, writing
from vrx_mj.cli.robot import LARGEST, coordinates, read_hull
from vrx_mj.errors import CommandError, VrxWarning
from vrx_mj.mjcf.derive import displaced, rest_notes
from vrx_mj.mjcf.hull_estimate import DENSITY, WIND, estimated_hull
from vrx_mj.mjcf.templates import render
from vrx_mj.physics.thrust import normal_slope

if TYPE_CHECKING:
    from vrx_mj.arrays import FloatArray, IntArray
    from vrx_mj.mjcf.hull_estimate import HullEstimate

__all__ = ["make_robot"]

NAMES = {
    1: ("engine",),
    2: ("left", "right"),
    3: ("left", "middle", "right"),
    4: ("left", "left_middle", "right_middle", "right"),
}
"""Names of engines by their number, from port to starboard."""
MOST_TRIANGLES = 1000
"""To which a mesh is simplified: every step looks at all, and worlds divide long ones."""
MOST_PIECES = 20
"""Parts of a mesh that have a file each, so that what is between hulls is free."""
AIR = 1.226
"""Density of air [kg/m3]."""


def make_robot(name: str, mesh: Path, mass: float, engines: int, center: str | None, scale: float) -> None:
    """Write the folder of a boat, and print how it floats and whether it keeps its course.

    Raises:
        CommandError: a number is out of its range.
        VrxError: the folder is there already, the mesh cannot be read, or it does not float.
    """
    for option, value in (("mass", mass), ("scale", scale)):
        if not 0.0 < value < LARGEST:
            raise CommandError(f"invalid --{option} {value:g}: a number above 0 is needed")
    if engines not in NAMES:
        raise CommandError(f"invalid --thrusters {engines}: 1 to {len(NAMES)} are needed")
    corners = simplified(read_hull(mesh, scale))
    boat = estimated_hull(corners, mass, engines, None if center is None else coordinates(center))
    for note in rest_notes(displaced(boat.corners, 0.0), np.array(boat.sheet.center_of_mass), "--center"):
        warnings.warn(note, VrxWarning, stacklevel=1)
    folder = new_folder(name)
    with writing("the robot", folder):
        _write(folder, boat, corners)
    for line in _lines(folder, boat):
        typer.echo(line)


def simplified(corners: "FloatArray") -> "FloatArray":
    """Closed triangles (n, 3, 3), fewer of them if there are more than `MOST_TRIANGLES`.

    All points in one cell of a grid become the one that is nearest to the planes of their triangles (Lindstrom 2000):
    flat sides and edges stay where they are, and a closed surface stays closed.
    """
    points, named = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    faces = named.reshape(-1, 3)
    if len(faces) <= MOST_TRIANGLES:
        return corners
    kept: IntArray = faces
    cell = float(np.ptp(points, axis=0).max()) / 200.0
    while len(kept) > MOST_TRIANGLES:
        cell *= 1.2
        _, inside, count = np.unique(np.round(points / cell), axis=0, return_inverse=True, return_counts=True)
        index = inside.ravel()[faces]
        kept = _without_folds(index)
    middles = np.stack([np.bincount(inside.ravel(), axis) / count for axis in points.T], axis=1)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    squares, sums = np.zeros((len(middles), 3, 3)), np.zeros((len(middles), 3))
    for corner in index.T:
        apart = np.einsum("ij,ij->i", normals, corners[:, 0] - middles[corner])
        np.add.at(squares, corner, normals[:, :, None] * normals[:, None, :])
        np.add.at(sums, corner, normals * apart[:, None])
    moves = np.einsum("ijk,ik->ij", np.linalg.pinv(squares, rcond=0.1, hermitian=True), sums)
    found: FloatArray = (middles + moves.clip(-cell, cell))[kept]
    return found


def _without_folds(faces: "IntArray") -> "IntArray":
    """Triangles (n, 3) without those that have no area, or that lie on each other back to back."""
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    a, b, c = faces.T
    side = np.sign((b - a) * (c - a) * (c - b))
    _, first, same = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_inverse=True)
    left = np.bincount(same.ravel(), side).astype(np.int64) * side[first]
    kept = np.where(left[:, None] > 0, faces[first], faces[first, ::-1])
    found: IntArray = np.repeat(kept, np.abs(left), axis=0)
    return found


def _write(folder: Path, boat: "HullEstimate", corners: "FloatArray") -> None:
    import trimesh

    from vrx_mj.draw.hull_picture import draw_hull

    whole = trimesh.Trimesh(boat.corners.reshape(-1, 3), np.arange(boat.corners.size // 3).reshape(-1, 3))
    part = trimesh.graph.connected_component_labels(whole.edges)[whole.faces[:, 0]]
    names = np.unique(part).tolist() if len(np.unique(part)) <= MOST_PIECES else []
    pieces = [whole.submesh([part == name], append=True) for name in names] if len(names) > 1 else [whole]
    meshes = [f"hull{number}.stl" for number in range(1, len(pieces) + 1)]
    for file, piece in zip(meshes, pieces, strict=True):
        piece.export(folder / file)
    values = _values(boat, corners, name=folder.name, meshes=meshes)
    for file in ("robot.yaml", "boat.urdf"):
        text = render(f"new_robot{Path(file).suffix}.j2", **values)
        (folder / file).write_text(text, encoding="utf-8", newline="\n")
    draw_hull(boat.corners, boat.sheet.center_of_mass, boat.engines, folder / "boat.png")


def _values(boat: "HullEstimate", corners: "FloatArray", **names: object) -> dict[str, Any]:
    """What the templates write, with four digits."""
    sheet, side = boat.sheet, boat.windage[1]
    origin = corners.reshape(-1, 3)[0] - boat.corners.reshape(-1, 3)[0]
    x, _, area, aspect = boat.stern
    strip = 0.5 * DENSITY * boat.across * boat.drafts * boat.length / len(boat.drafts)
    along = np.linspace(x, x + boat.length, len(strip))
    lift = 0.5 * DENSITY * area * normal_slope(aspect) * boat.speed  # which profiles without skegs have at full thrust
    share = 0.5 * AIR * np.array([boat.windage[0], side, side * boat.length])
    engines = [(name, _short(place)) for name, place in zip(NAMES[len(boat.engines)], boat.engines, strict=True)]
    found = {
        "origin": origin, "mass": sheet.mass, "center": sheet.center_of_mass, "draft": sheet.draft, "gm": sheet.gm[0],
        "point": sheet.center_of_buoyancy, "length": boat.length, "beam": boat.beam, "inertia": boat.inertia,
        "added_mass": boat.added_mass, "diagonal": np.diag(boat.added_mass), "damping": boat.damping,
        "drag": boat.damping + np.array([0.0, lift, 0.0, 0.0, 0.0, lift * x**2]),
        "surge_drag": boat.surge_drag, "sway_drag": strip.sum(), "yaw_drag": strip @ np.abs(along) ** 3,
        "drafts": boat.drafts, "across": boat.across, "stern": boat.stern, "bow": x + boat.length,
        "speed": boat.speed, "thrust": boat.thrust, "windage": boat.windage, "wind": share * WIND,
        "top": boat.corners[:, :, 2].max() + 0.1, "skeg": boat.course.skeg, "criterion": boat.course.criterion,
    }  # fmt: skip
    return {**names, **{key: _short(value) for key, value in found.items()}, "engines": engines}


def _short(value: Any) -> Any:
    """Numbers of any shape with four digits, and 0 for what rounding left."""
    if isinstance(value, float):
        return float(f"{value:.4g}") if abs(value) > 1e-9 else 0.0
    return [_short(item) for item in np.asarray(value, np.float64).tolist()] if np.ndim(value) else _short(float(value))


def _lines(folder: Path, boat: "HullEstimate") -> Iterator[str]:
    """What is made, whether it keeps its course, what would make it, and how to sail it."""
    sheet, course, arm = boat.sheet, boat.course, abs(boat.engines[0][1] - boat.engines[-1][1]) / 2.0
    yield f"{folder}: {boat.length:.3g} x {boat.beam:.3g} m, draft {sheet.draft:.3g} m, GM {sheet.gm[0]:.3g} m"
    yield f"{len(boat.engines)} x {boat.thrust:.3g} N for {boat.speed:.3g} m/s; robot.yaml names the rules it is by"
    if course.skeg:
        each, doubling = math.radians(course.feedback), math.log(2.0) / course.growth
        yield f"it does not keep a straight course at equal thrust: C = {course.criterion:.3g}, below 0"
        yield f"  a small turn doubles in {doubling:.3g} s; it keeps its course"
        yield f"  with a skeg of {course.skeg:.3g} m2 at the stern: remove the # before its line in robot.yaml"
        what = f"differential thrust of {each / arm:.3g} N" if arm else f"its engine turned to {each:.3g} N m"
        yield f"  or with {what} for each deg/s, against the turn"
    else:
        yield f"it keeps a straight course at equal thrust: C = {course.criterion:.3g}, above 0"
    thrust = ",".join(f"{name}=1" for name in NAMES[len(boat.engines)])
    yield f"vrx-mj run ocean --fleet './{folder}' --thrust {thrust}"
