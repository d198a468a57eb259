"""Labels of a camera's picture: which pixels show which boat, buoy, dock or animal, and the box around them."""

import json
from collections.abc import Iterator, Mapping
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from vrx_mj.arrays import IntArray
from vrx_mj.model.world import Parameters
from vrx_mj.sensors.readings import Label, Labels

CATEGORIES: Mapping[str, Mapping[str, Any]] = {
    row["name"]: row for row in json.loads((Path(__file__).parent / "labels.json").read_bytes())
}
"""Categories by name: number, supercategory, and the models of objects that are of it, the first that matches."""
CATEGORY_NAMES: Mapping[int, str] = {row["id"]: name for name, row in CATEGORIES.items()}
"""Names of categories by their numbers."""
_OWN_BOAT, _BOAT, _SHORE, _DOCK, _PLACARD = tuple(CATEGORIES)[:5]
_TERRAIN = "terrain"
"""Name of the shore, and what names of its geoms begin with."""


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
