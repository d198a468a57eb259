"""What a camera sees: its geoms, its part of the sea, and the labels of its pictures.

Labels say which pixels show which boat, buoy, dock or animal, with the box around each.
"""

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, Self

import mujoco
import numpy as np

from vrx_mj.arrays import BoolArray, FloatArray, IntArray
from vrx_mj.config.sensors import CameraConfig
from vrx_mj.model.world import Parameters
from vrx_mj.physics.surface import sky_distance
from vrx_mj.sensors.readings import CameraInfo, Label, Labels

MIN_RADIUS = 0.25
"""Least radius in the picture of the geoms that are drawn [pixels]."""
_MARGIN = 0.03
"""Margin by which the sea is drawn wider than the view [rad]."""
CATEGORIES: Mapping[str, Mapping[str, Any]] = {
    row["name"]: row for row in json.loads((Path(__file__).parent / "labels.json").read_bytes())
}
"""Categories by name: number, supercategory, and the models of objects that are of it, the first that matches."""
CATEGORY_NAMES: Mapping[int, str] = {row["id"]: name for name, row in CATEGORIES.items()}
"""Names of categories by their numbers."""
_OWN_BOAT, _BOAT, _SHORE, _DOCK, _PLACARD = tuple(CATEGORIES)[:5]
_TERRAIN = "terrain"
"""Name of the shore, and what names of its geoms begin with."""


def focal_length(config: CameraConfig) -> float:
    """Focal length [pixels], equal along both axes."""
    return config.width / (2.0 * math.tan(config.horizontal_fov / 2.0))


def intrinsics(config: CameraConfig) -> CameraInfo:
    """Intrinsics of a camera as gazebo_ros's camera plugin computes it.

    Its principal point is (width + 1) / 2, (height + 1) / 2, which counts pixels from 1: with rows and columns from 0
    the axis of view passes through ((width - 1) / 2, (height - 1) / 2), which `info: centered` gives; gz sim's, which
    `vrx3` gives, is (width / 2, height / 2). P[3] is -f times the plugin's `hackBaseline`, on left and right cameras
    alike.
    """
    f = focal_length(config)
    first = {"centered": 0.0, "vrx3": 0.5, "vrx": 1.0}[config.info]  # number of the first row and column
    cx, cy = first + (config.width - 1) / 2.0, first + (config.height - 1) / 2.0
    return CameraInfo(
        width=config.width,
        height=config.height,
        K=(f, 0.0, cx, 0.0, f, cy, 0.0, 0.0, 1.0),
        R=(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
        P=(f, 0.0, cx, -f * config.baseline, 0.0, f, cy, 0.0, 0.0, 0.0, 1.0, 0.0),
    )


@dataclass(frozen=True)
class View:
    """A pinhole camera in the world."""

    position: FloatArray
    """Position, (3,) [m]."""
    rotation: FloatArray
    """Rotation (3, 3), camera to world axes; x forward, y left, z up."""
    half_width: float
    """Half width of the picture at distance 1."""
    half_height: float
    near: float
    """Least distance that is drawn [m]."""
    far: float
    """Greatest distance at which geoms are drawn [m]."""
    focal_length: float
    """Focal length [pixels]."""
    end: float = 6000.0
    """Where land and sea end [m]."""
    smallest: float = MIN_RADIUS
    """Geoms of a smaller radius [pixels] are not drawn."""

    @classmethod
    def of_camera(
        cls,
        position: FloatArray,
        rotation: FloatArray,
        field: float,
        size: tuple[int, int],
        reach: tuple[float, float],
        smallest: float = MIN_RADIUS,
    ) -> Self:
        """The view of a horizontal field [rad], for pictures of a width and height [pixels]; `reach`: near and far."""
        half, (width, height) = math.tan(field / 2.0), size
        edges, end = (half, half * height / width), sky_distance(float(position[2]))
        return cls(position, rotation, *edges, *reach, width / (2.0 * half), end, smallest)

    def shows(self, centers: FloatArray, radii: FloatArray) -> BoolArray:
        """Whether spheres (n, 3), (n,) [m] may be seen: neither behind, beside, too far away, nor too small.

        A sphere is too far when all of it is beyond `far`. A radius of 0 means without end.
        """
        ahead, left, up = ((centers - self.position) @ self.rotation).T
        seen = (ahead > self.near - radii) & (ahead < self.far + radii)
        for across, half in ((left, self.half_width), (up, self.half_height)):
            # distance beyond the plane through the eye and the picture's edge
            seen &= np.abs(across) - half * ahead <= radii * math.hypot(1.0, half)
        seen &= radii * self.focal_length >= self.smallest * np.maximum(ahead, self.near)
        return np.asarray(seen | (radii <= 0.0))

    def horizontal_range(self) -> tuple[float, float]:
        """The middle of what is seen of the sea and half its width [rad], counter-clockwise from x.

        Half is pi when the camera looks so far down, or up, or lies on its side, that its picture holds all directions.
        """
        ahead = self.rotation[:, 0]
        course = math.atan2(ahead[1], ahead[0])
        corners = np.array([[1.0, self.half_width * y, self.half_height * z] for y in (-1, 1) for z in (-1, 1)])
        east, north, _ = (corners @ self.rotation.T).T
        along = east * math.cos(course) + north * math.sin(course)
        beside = north * math.cos(course) - east * math.sin(course)
        if np.any(along <= 0.05 * np.hypot(1.0, beside)):
            return course, math.pi
        angles = np.arctan2(beside, along)
        return course + float(angles.max() + angles.min()) / 2.0, float(np.ptp(angles)) / 2.0 + _MARGIN

    def elevations(self) -> tuple[float, float]:
        """The lowest and the highest direction in the picture, from the horizon [rad]."""
        across, up = self.half_width * np.linspace(-1.0, 1.0, 17), self.half_height * np.linspace(-1.0, 1.0, 17)
        rays = np.stack(np.broadcast_arrays(1.0, across[:, None], up), axis=-1).reshape(-1, 3) @ self.rotation[2]
        sines = rays / np.sqrt(1.0 + (across**2)[:, None] + up**2).reshape(-1)
        low, high = math.asin(max(float(sines.min()), -1.0)), math.asin(min(float(sines.max()), 1.0))
        ahead, left, above = self.rotation[2]  # of the zenith
        if abs(left) <= self.half_width * abs(ahead) and abs(above) <= self.half_height * abs(ahead):
            low, high = (low, 0.5 * math.pi) if ahead > 0.0 else (-0.5 * math.pi, high)
        return max(low - _MARGIN, -0.5 * math.pi), high + _MARGIN


class Labeller:
    """Makes labels of what a model's pictures show."""

    def __init__(self, model: mujoco.MjModel, world: Parameters) -> None:
        """Take a drawing model and the parameters of its world."""
        self._names: list[tuple[str, str]] = [("", ""), (_TERRAIN, _SHORE)]
        numbers: dict[str, int] = {}
        for name, category, bodies in _things(world):
            numbers |= dict.fromkeys(bodies, len(self._names))
            self._names.append((name, category))
        of_body = np.zeros(model.nbody, np.uint16)
        for body in range(1, model.nbody):
            of_body[body] = numbers.get(model.body(body).name, of_body[model.body_parentid[body]])
        self._numbers = np.append(of_body[model.geom_bodyid], np.uint16(0))  # the last is that of no geom
        for geom in np.flatnonzero(model.geom_bodyid == 0):
            self._numbers[geom] = model.geom(geom).name.startswith(f"{_TERRAIN}/")

    def __call__(self, geoms: IntArray, own: str) -> Labels:
        """Labels of a picture.

        Args:
            geoms: (height, width) number of the geom that each pixel shows, -1: none; the first row is the highest.
            own: name of the boat that carries the camera.
        """
        mask = self._numbers[geoms]
        rows, columns = np.nonzero(mask)
        numbers = mask[rows, columns]
        tall, wide = (np.zeros((len(self._names), side), bool) for side in mask.shape)
        tall[numbers, rows] = wide[numbers, columns] = True
        areas = np.bincount(numbers, minlength=len(self._names))
        found = []
        for number in np.flatnonzero(areas).tolist():
            name, category = self._names[number]
            (top, *_, bottom), (left, *_, right) = (np.flatnonzero(each[number])[[0, -1]] for each in (tall, wide))
            box = int(left), int(top), int(right - left) + 1, int(bottom - top) + 1
            kind = _OWN_BOAT if (name, category) == (own, _BOAT) else category
            found.append(Label(name, kind, int(CATEGORIES[kind]["id"]), number, box, int(areas[number])))
        return Labels(tuple(found), mask)


def category_of(model: str) -> str:
    """The category of an object's model."""
    return next(name for name, row in CATEGORIES.items() if any(fnmatchcase(model, each) for each in row["models"]))


def _things(world: Parameters) -> Iterator[tuple[str, str, tuple[str, ...]]]:
    """Name, category and bodies of all that has a label besides the shore; of a body that is named twice the last."""
    for item in world.objects:
        yield item.name, category_of(item.model), (item.body,)
    for dock in world.docks:
        yield dock.name, _DOCK, dock.bodies
    for placard in world.placards:
        yield placard.name, _PLACARD, (placard.body,)
    for boat, hull in zip(world.boats, world.hulls, strict=True):
        yield boat.name, _BOAT, (hull.body,)
