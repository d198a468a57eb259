"""`vrx-mj new robot --hull`: a boat of any closed mesh, estimated by published rules."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from typer import echo

from vrx_mj.arrays import FloatArray
from vrx_mj.cli.files import new_folder
from vrx_mj.cli.robot import coordinates, read_hull
from vrx_mj.errors import warn
from vrx_mj.mjcf.flotation import flotation_at
from vrx_mj.mjcf.hull_estimate import DENSITY, WIND_COEFFICIENTS, HullEstimate, estimated_hull
from vrx_mj.mjcf.templates import render
from vrx_mj.outputs import Content, write_files
from vrx_mj.physics.thrust import normal_slope

_NAMES = (
    (),
    ("engine",),
    ("left", "right"),
    ("left", "middle", "right"),
    ("left", "left_middle", "right_middle", "right"),
)
"""Names of engines by their number, from port to starboard."""
_MOST_TRIANGLES = 1000
"""Triangles to which a mesh is simplified: every step looks at all, and worlds divide long ones."""
_MOST_PIECES = 20
"""Parts of a mesh that have a file each, so that what is between hulls is free."""
_AIR = 1.226
"""Density of air [kg/m3]."""


def make_robot(name: str, mesh: Path, mass: float, engines: int, center: str | None, scale: float) -> None:
    """Write the folder of a boat, and print how it floats and whether it keeps its course.

    Raises:
        CommandError: the centre is not three numbers.
        VrxError: the folder is there already, the mesh cannot be read, or it does not float.
    """
    boat = estimated_hull(simplify(read_hull(mesh, scale)), mass, engines, coordinates(center) if center else None)
    for note in flotation_at(boat.corners, 0.0).remarks(np.array(boat.sheet.center_of_mass), "--center"):
        warn(note)
    folder = new_folder(name)
    _write(folder, boat)
    for line in _lines(folder, boat):
        echo(line)


def simplify(corners: FloatArray) -> FloatArray:
    """Closed triangles (n, 3, 3), fewer of the same volume if there are more than `_MOST_TRIANGLES`.

    Of the points in one cell of a grid the outermost stands for all: a closed surface stays closed.
    """
    if len(corners) <= _MOST_TRIANGLES:
        return corners
    points, named = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    size, middle, found, share = np.ptp(points, axis=0), points.mean(axis=0), corners, 1.0 / 200.0
    order = np.argsort(-np.linalg.norm((points - middle) / size, axis=1), kind="stable")
    points, faces = points[order], np.argsort(order, kind="stable")[named.reshape(-1, 3)]
    while len(found) > _MOST_TRIANGLES:
        share *= 1.2
        cells = np.round(points / (share * size))
        _, first, inside = np.unique(cells, axis=0, return_index=True, return_inverse=True)
        index = inside.ravel()[faces]
        found = points[first][index[(index != np.roll(index, 1, axis=1)).all(axis=1)]]
    before, after = (flotation_at(each, float(points[:, 2].max()) + 1.0).volume for each in (corners, found))
    same: FloatArray = middle + (found - middle) * np.cbrt(before / after)
    return same


def _write(folder: Path, boat: HullEstimate) -> None:
    import trimesh

    from vrx_mj.draw.boat_pictures import draw_hull

    whole = trimesh.Trimesh(boat.corners.reshape(-1, 3), np.arange(boat.corners.size // 3).reshape(-1, 3))
    part = trimesh.graph.connected_component_labels(whole.edges)[whole.faces[:, 0]]
    names = np.unique(part).tolist() if len(np.unique(part)) <= _MOST_PIECES else []
    pieces = [whole.submesh([part == name], append=True) for name in names] if len(names) > 1 else [whole]
    files: dict[str, Content] = {f"hull{i}.stl": piece.export(file_type="stl") for i, piece in enumerate(pieces, 1)}
    values = _values(boat)
    named = list(zip(_NAMES[len(boat.engines)], values["engines"], strict=True))
    values |= {"name": folder.name, "meshes": list(files), "engines": named}
    files |= {file: render(f"new_robot{Path(file).suffix}.j2", **values) for file in ("robot.yaml", "boat.urdf")}
    write_files(folder, files, "the robot")
    draw_hull(boat.corners, boat.sheet.center_of_mass, boat.engines, folder / "boat.png")


def _values(boat: HullEstimate) -> dict[str, Any]:
    """Values of the templates beside the names of files, with four digits."""
    sheet, (x, _, area, aspect), side = boat.sheet, boat.stern, boat.windage[1]
    lift = 0.5 * DENSITY * area * normal_slope(aspect) * boat.speed  # which profiles without skegs have at full thrust
    found = vars(boat) | {
        "mass": sheet.mass, "center": sheet.center_of_mass, "draft": sheet.draft, "gm": sheet.gm[0],
        "point": sheet.center_of_buoyancy, "diagonal": np.diag(boat.added_mass), "bow": x + boat.length,
        "drag": boat.damping + np.array([0.0, lift, 0.0, 0.0, 0.0, lift * x**2]),
        "across_drag": 0.5 * DENSITY * boat.across * boat.drafts.mean() * boat.length,
        "wind": 0.5 * _AIR * np.array([boat.windage[0], side, side * boat.length]) * WIND_COEFFICIENTS,
        "top": boat.corners[:, :, 2].max() + 0.1,
    }  # fmt: skip
    return {key: _short(value) for key, value in found.items() if key not in {"corners", "sheet"}}


def _short(value: Any) -> Any:
    """Numbers of any shape with four digits, and 0 for what rounding left."""
    if isinstance(value, float):
        return float(f"{value:.4g}") if abs(value) > 1e-9 else 0.0
    return [_short(item) for item in np.asarray(value, np.float64).tolist()] if np.ndim(value) else _short(float(value))


def _lines(folder: Path, boat: HullEstimate) -> Iterator[str]:
    """Lines about the boat: its size, whether it keeps its course, what would help, and how to sail it."""
    sheet, arm = boat.sheet, abs(boat.engines[0][1] - boat.engines[-1][1]) / 2.0
    criterion, growth, feedback, skeg = boat.course
    yield f"{folder}: {boat.length:.3g} x {boat.beam:.3g} m, draft {sheet.draft:.3g} m, GM {sheet.gm[0]:.3g} m"
    yield f"{len(boat.engines)} x {boat.thrust:.3g} N for {boat.speed:.3g} m/s; robot.yaml names the rules used"
    if skeg:
        yield f"it does not keep a straight course at equal thrust: C = {criterion:.3g}, below 0"
        yield f"  a small turn doubles in {math.log(2.0) / growth:.3g} s; it keeps its course"
        yield f"  with a skeg of {skeg:.3g} m2 at the stern: remove the # before its line in robot.yaml"
        each = math.radians(feedback)
        what = f"differential thrust of {each / arm:.3g} N" if arm else f"its engine turned to {each:.3g} N m"
        yield f"  or with {what} for each deg/s, against the turn"
    else:
        yield f"it keeps a straight course at equal thrust: C = {criterion:.3g}, above 0"
    thrust = ",".join(f"{name}=1" for name in _NAMES[len(boat.engines)])
    yield f"vrx-mj run ocean --fleet './{folder}' --thrust {thrust}"
