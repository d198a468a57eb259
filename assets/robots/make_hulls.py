"""Writes the meshes of our boats' hulls: lofts through parametric sections, closed at the stern.

Run it with `python assets/robots/make_hulls.py`.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh

STATIONS, POINTS = 25, 13


@dataclass(frozen=True)
class Hull:
    """A round-bilged hull with a transom; lengths in m, heights over the keel."""

    length: float
    beam: float
    depth: float
    keel: float
    """Height of the keel in the mesh's frame."""
    bottom: float
    """Height up to which the bottom paint goes; above it the mesh `hull` is seen."""
    water: bool = False
    """Whether there is a closed, coarser mesh `water` for the water's pressure."""
    mirrored: bool = False
    """Whether the triangles of `water` are the same on both sides; those of two hulls are each other's mirror image."""
    powers: tuple[float, float] | None = None
    """a and b of a mesh `water` alone, whose breadth at the height h over a level keel is beam (1 - |2 x / L|^a)
    (h / draft)^b up to the water: waterplane coefficient a / (a + 1), block coefficient that over 1 + b."""


HULLS = {
    "skiff": Hull(length=2.4, beam=0.72, depth=0.42, keel=0.0, bottom=0.12, water=True, mirrored=True),
    "otter": Hull(length=2.0, beam=0.25, depth=0.4, keel=-0.195, bottom=0.2),  # one of two
    "otter_hydro": Hull(length=2.0, beam=0.25, depth=0.4, keel=-0.195, bottom=0.2, powers=(3.0, 0.875)),
    "heron": Hull(length=1.35, beam=0.193, depth=0.32, keel=-0.12, bottom=0.12, water=True),  # one of two
    "blueboat": Hull(length=1.2, beam=0.16, depth=0.3, keel=-0.09, bottom=0.09, water=True),  # one of two
    "cora": Hull(length=12.21, beam=3.58, depth=2.3, keel=-1.42, bottom=0.75),
}


def section(hull: Hull, share: float, points: int = POINTS) -> np.ndarray:
    """(points, 3): one section from the port sheer round the keel to starboard; `share` is 0 aft and 1 at the bow."""
    fullness = 1.0 - max(0.0, (share - 0.45) / 0.55) ** 2.2  # of the breadth: full aft, fine at the bow
    half = hull.beam / 2 * max(fullness, 0.03) * (0.92 + 0.08 * min(1.0, share / 0.3))
    foot = hull.depth * 0.75 * max(0.0, (share - 0.8) / 0.2) ** 2  # the forefoot rises
    sheer = hull.depth * (1.0 + 0.24 * share**2)
    angle = np.linspace(0.0, np.pi, points)
    y = half * np.sign(np.cos(angle)) * np.abs(np.cos(angle)) ** 0.6
    z = foot + (sheer - foot) * (1.0 - np.sin(angle) ** 0.75)
    return np.column_stack([np.full(points, hull.length * (share - 0.5)), y, z + hull.keel])


def lofted(sections: list[np.ndarray]) -> trimesh.Trimesh:
    """A skin through sections, closed at the stern."""
    n, faces = POINTS, []
    for k in range(len(sections) - 1):
        for i in range(n - 1):
            a, b = k * n + i, k * n + i + 1
            faces += [(a, a + n, b), (b, a + n, b + n)]
    faces += [(0, i, i + 1) for i in range(1, n - 1)]
    return trimesh.Trimesh(np.concatenate(sections), faces, process=False)


def decked(sections: list[np.ndarray], drop: float) -> trimesh.Trimesh:
    """A deck from sheer to sheer, `drop` below it."""
    rail = [np.stack([own[0], own[-1]]) - (0.0, 0.0, drop) for own in sections]
    pairs = range(0, 2 * (len(sections) - 1), 2)
    faces = [face for a in pairs for face in ((a, a + 1, a + 2), (a + 1, a + 3, a + 2))]
    return trimesh.Trimesh(np.concatenate(rail), faces, process=False)


def closed(hull: Hull) -> trimesh.Trimesh:
    """The hull with a deck, a closed surface of 13 sections of 9 points that keep the areas of the round ones."""
    stations, n = 13, 9
    rings = [
        _of_area(section(hull, share, n), section(hull, share, 65)) if hull.powers is None else _sharp(hull, share)
        for share in np.linspace(0.0, 1.0, stations)
    ]
    faces = [(0, i, i + 1) for i in range(1, n - 1)]
    for a in range(0, (stations - 1) * n, n):
        for i in range(n):
            own, k = a + i, a + (i + 1) % n
            if hull.mirrored and n // 2 <= i < n - 1:
                faces += [(own, own + n, k + n), (own, k + n, k)]
            else:
                faces += [(own, own + n, k), (k, own + n, k + n)]
    last = (stations - 1) * n
    faces += [(last, last + i + 1, last + i) for i in range(1, n - 1)]
    return trimesh.Trimesh(np.concatenate(rings), faces, process=False)


def _sharp(hull: Hull, share: float) -> np.ndarray:
    """(9, 3): a section as `section` has it, of the powers of a hull."""
    along, up = hull.powers
    z = np.concatenate([[hull.keel + hull.depth], hull.keel * np.arange(4.0) / 3.0])
    half = hull.beam / 2 * max(1.0 - abs(2.0 * share - 1.0) ** along, 0.03) * np.minimum(1.0 - z / hull.keel, 1.0) ** up
    y, z = np.concatenate([half, -half[-2::-1]]), np.concatenate([z, z[-2::-1]])
    return np.column_stack([np.full(9, hull.length * (share - 0.5)), y, z])


def _of_area(coarse: np.ndarray, fine: np.ndarray) -> np.ndarray:
    """A coarse section as much broader as it takes to have the area of the fine one."""
    coarse[:, 1] *= _area(fine) / _area(coarse)
    return coarse


def _area(own: np.ndarray) -> float:
    """Area of a section."""
    y, z = own[:, 1], own[:, 2]
    return 0.5 * abs(float(np.sum(y * np.roll(z, -1) - z * np.roll(y, -1))))


def painted(sections: list[np.ndarray], top: float) -> list[np.ndarray]:
    """The part of the sections under the height `top`, a coat of paint further out; none where the bow rises."""
    wet = [own for own in sections if own[:, 2].min() < top]
    return [np.column_stack([_at(own, top), np.minimum(own[:, 2], top)]) for own in wet]


def _at(own: np.ndarray, top: float) -> np.ndarray:
    """(n, 2): x and y of a section's points; those over `top` go to where the section crosses it."""
    middle = POINTS // 2
    half = np.interp(np.minimum(own[: middle + 1, 2], top), own[middle::-1, 2], own[middle::-1, 1])
    y = np.concatenate([half, -half[-2::-1]])
    return np.column_stack([own[:, 0], y * 1.006])


def write_meshes(name: str, folder: Path) -> None:
    """Write `hull.obj`, `deck.obj`, `bottom.obj` and, if it is to have one, `water.obj` of a hull."""
    hull = HULLS[name]
    sections = [section(hull, share) for share in np.linspace(0.0, 1.0, STATIONS)]
    parts = {
        "hull": lofted(sections),
        "deck": decked(sections, 0.12 * hull.depth),
        "bottom": lofted(painted(sections, hull.keel + hull.bottom)),
    }
    if hull.water:
        parts["water"] = closed(hull)
    if hull.powers:
        parts = {"water": closed(hull)}
    for part, mesh in parts.items():
        lines = [f"mtllib {name}.mtl", f"usemtl {part}"] if part != "water" else []  # the colours, for RViz
        lines += [f"v {x:.4f} {y:.4f} {z:.4f}" for x, y, z in mesh.vertices]
        lines += [f"f {a} {b} {c}" for a, b, c in mesh.faces + 1]
        (folder / f"{part}.obj").write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")


if __name__ == "__main__":
    for robot in HULLS:
        write_meshes(robot, Path(__file__).parent / robot / "meshes")
