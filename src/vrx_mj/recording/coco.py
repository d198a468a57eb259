"""Pictures with labels as a data set in COCO's form: a folder with `images/` and `annotations.json`."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any, Self

import numpy as np

from vrx_mj.arguments import as_number, as_path, as_text, check_name
from vrx_mj.arrays import BoolArray
from vrx_mj.bar import Bar
from vrx_mj.errors import CommandError, RecordError, shown
from vrx_mj.outputs import write_files
from vrx_mj.recording.reader import read_record
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.runtime.state import State
from vrx_mj.sensors.labels import CATEGORIES
from vrx_mj.sensors.readings import Labels, Reading

_JPEG_QUALITY = 95


class CocoWriter:
    """Writes a data set; as a context it is complete at its end, also at that of an exception.

    The same pictures give the same bytes.
    """

    def __init__(self, folder: str | Path, description: str = "vrx_mj") -> None:
        """Begin a data set.

        Args:
            folder: is made if need be; an older data set in it is replaced.
            description: of the data set, in its `info`.
        """
        self._folder = as_path("folder", folder)
        self._description = as_text("description", description)
        self._images: list[dict[str, Any]] = []
        self._annotations: list[dict[str, Any]] = []

    def __enter__(self) -> Self:
        return self

    def __len__(self) -> int:
        """How many pictures there are."""
        return len(self._images)

    def __exit__(self, *_: object) -> None:
        whole = {"info": {"description": self._description}, "images": self._images, "annotations": self._annotations}
        whole |= {"categories": [*CATEGORIES.values()]}
        write_files(self._folder, {"annotations.json": json.dumps(whole) + "\n"}, "the data set", RecordError)

    def add(self, reading: Reading) -> None:
        """Add a camera's picture.

        Args:
            reading: with labels, as `Simulation.labelled` gives it.

        Raises:
            CommandError: it has none.
            RecordError: it cannot be written.
        """
        labels = getattr(getattr(reading, "data", None), "labels", None)
        if not isinstance(labels, Labels):
            raise CommandError(f"invalid reading {shown(reading)}: one with labels is needed, as sim.labelled gives it")
        number, boat = len(self._images) + 1, reading.frame.partition("/")[0]
        name = f"{number:06}_{boat}_{reading.name}.jpg"
        write_files(self._folder, {f"images/{name}": reading.data.jpeg(_JPEG_QUALITY)}, "the data set", RecordError)
        height, width = labels.mask.shape
        self._images.append({"id": number, "file_name": name, "width": width, "height": height, "time": reading.time})
        for one in labels.objects:
            own = {"id": len(self._annotations) + 1, "image_id": number, "category_id": one.category_id}
            seen = {"name": one.name, "bbox": one.box, "area": one.area, "iscrowd": 0}
            runs = {"size": [height, width], "counts": run_lengths(labels.mask == one.number)}
            self._annotations.append({**own, **seen, "segmentation": runs})


def run_lengths(mask: BoolArray) -> list[int]:
    """COCO's uncompressed run lengths of a mask (height, width): down its columns, of 0 first, then of 1, in turn."""
    flat = np.concatenate([[False], mask.ravel(order="F")])
    changes = np.flatnonzero(flat[1:] != flat[:-1])
    return [int(length) for length in np.diff([0, *changes, mask.size])]


def write_coco(
    source: str | Path, folder: str | Path, *, boat: str | None = None, begin: float | None = None,
    end: float | None = None,
) -> int:  # fmt: skip
    """Write what cameras saw at every second of a recording, whether or not they were recorded; returns the pictures.

    Args:
        source: a recording.
        folder: of the data set.
        boat: whose cameras; None: those of all boats.
        begin: first simulated time [s]; None: that of the recording.
        end: last simulated time [s]; None: that of the recording.

    Raises:
        RecordError: the file is not a recording, or has no camera or no state in that span, or nothing can be written.
        UnknownNameError: no boat of that name has a camera.
        RenderError: nothing can draw here; the message names what to install.
    """
    recorded = read_record(source)
    worlds = {one.world_sha256: one for one in recorded.companies}
    carriers = {row.boat for one in worlds.values() for row in one.parameters.sensors if row.type == "camera"}
    if not carriers:
        raise RecordError(f"'{recorded.path}' has no boat with a camera")
    if boat is not None:
        check_name("boat with a camera", boat, sorted(carriers))
    low, high = -math.inf if begin is None else as_number(begin), math.inf if end is None else as_number(end)
    seconds = {round(saved.time, 6): saved for saved in recorded.states}  # the end may be saved twice
    states = [saved for time, saved in seconds.items() if low <= time <= high]
    if not states:
        span = f"invalid begin {shown(begin)} or end {shown(end)}"
        raise RecordError(f"{span}: '{recorded.path}' has no state in that span; one is saved every second")
    about = f"{recorded.properties.get('world')}, seed {recorded.properties.get('seed')}"
    with CocoWriter(folder, about) as coco, Bar("drawing", len(states), "seconds") as bar:
        sim = Simulation(recorded.companies[0].world)
        for number, saved in enumerate(states, 1):
            state = State.from_bytes(saved.blob)
            if state.world in worlds and state.world != sim.world.sha256:
                sim = Simulation(worlds[state.world].world)
            sim.set_state(state)
            for name in sim.boats:
                for camera in sim.mounted(name) if boat in (None, name) else ():
                    if camera.config.type == "camera":
                        coco.add(sim.labelled(name, camera.name))
            bar.update(number)
    return len(coco)
