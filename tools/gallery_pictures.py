"""Pictures of the gallery: tiles drawn by our own camera, small maps, and sheets of tiles with names under them."""

import dataclasses
import io
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import mujoco
import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw, ImageFont

import vrx_mj
from vrx_mj.config.docks import SYMBOLS
from vrx_mj.config.sensors import CameraConfig
from vrx_mj.draw.course import MapScene, map_of
from vrx_mj.draw.map import map_png
from vrx_mj.frames import rotation
from vrx_mj.mjcf.scene import drawing_model
from vrx_mj.sensors.camera import Cameras
from vrx_mj.sensors.displays import CODES, displays_of

__all__ = [
    "COLUMNS", "WIDE", "Tile", "course_tile", "draw_sheet", "large_map", "map_tile", "sheet_size", "stage_tiles",
    "view_tile",
]  # fmt: skip

FloatArray = npt.NDArray[np.float64]
Tile = Image.Image

TILE = (300, 225)
"""Width and height of a tile [px]."""
WIDE = (450, 330)
"""The same, of robots and views, two in a row."""
COLUMNS = 3
LINES = 2
"""Lines of a name under a tile."""
LINE, GAP = 24, 8
"""Height of a line of a name, and the space around a tile [px]."""
FINER = 3
"""Tiles are drawn so many times larger, and then reduced: edges come out smooth."""
QUALITY = 80

SPACING = 150.0
"""Distance between the things on the stage [m]: none comes into the picture of another."""
SETTLED = 10.0
"""Time for things to come to rest in the water [s]."""
COLORS = {"r": "red", "g": "green", "b": "blue", "y": "yellow"}
LENS = 0.6
"""Horizontal field of view [rad]."""
ASHORE = ("post", "antenna", "tent", "table", "chair")
"""What models of things ashore begin with."""
HEIGHTS = {"dock": 0.25, "placard": 1.6, "symbol": 0.8}
"""Where things of these names are placed above the water [m], the others at 0."""
ROOM = 1.12
"""A picture is so many times as wide as the thing in it."""

LAND, SHORE, WATER, DOCK, GATE, GOAL, BOAT = "#e5dcc3", "#a89a75", "#dcebf3", "#6f7681", "#2a7f3f", "#6a4c93", "#d1495b"


# Sheets


def sheet_size(count: int, columns: int = COLUMNS, tile: tuple[int, int] = TILE) -> tuple[int, int]:
    """Width and height [px] of a sheet of `count` tiles."""
    rows = math.ceil(count / columns)
    return columns * (tile[0] + GAP) + GAP, rows * (tile[1] + LINES * LINE + GAP) + GAP


def draw_sheet(tiles: Mapping[str, Tile], path: Path, columns: int = COLUMNS) -> None:
    """Write a sheet of named tiles of one size, `columns` in a row."""
    size = next(iter(tiles.values())).size
    sheet = Image.new("RGB", sheet_size(len(tiles), columns, size), "white")
    pen = ImageDraw.Draw(sheet)
    for index, (name, tile) in enumerate(tiles.items()):
        x = GAP + index % columns * (size[0] + GAP)
        y = GAP + index // columns * (size[1] + LINES * LINE + GAP)
        sheet.paste(tile, (x, y))
        for row, (text, points) in enumerate(_lines(name, size[0])):
            pen.text((x + size[0] / 2, y + size[1] + LINE * (row + 0.5)), text, "black", _font(points), anchor="mm")
    path.parent.mkdir(parents=True, exist_ok=True)
    sheet.save(path, quality=QUALITY, method=6)


def _font(points: int) -> ImageFont.FreeTypeFont:
    return ImageFont.truetype(str(Path(mpl.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"), points)


def _lines(name: str, width: int) -> list[tuple[str, int]]:
    """A name in one line or, cut after an underscore or slash, in two, each with the size of its letters."""
    for points in (20, 18, 16, 14):
        font = _font(points)
        if font.getlength(name) <= width:
            return [(name, points)]
        cuts = [i + 1 for i, letter in enumerate(name) if letter in "_/ "]
        for cut in sorted(cuts, key=lambda i: abs(i - len(name) / 2)):
            if max(font.getlength(name[:cut]), font.getlength(name[cut:])) <= width:
                return [(name[:cut], points), (name[cut:], points)]
    raise ValueError(f"'{name}' is too long for a tile of {width} px")


# Things on the water


def stage_tiles(
    things: Mapping[str, str],
    azimuth: Mapping[str, float],
    elevation: Mapping[str, float],
    tile: tuple[int, int] = TILE,
) -> dict[str, Tile]:
    """Draw each thing alone on a slight sea, after it has come to rest.

    Args:
        things: name -> "object", "dock" (a drawing of the catalogue) or "robot".
        azimuth: where the camera is as seen from it [degrees, counter-clockwise from its x axis].
        elevation: how far above the water it is [degrees].
        tile: width and height [px].
    """
    places = {name: SPACING * np.array([i % 12, i // 12, 0.0]) for i, name in enumerate(things)}
    sim = vrx_mj.Simulation(_stage(things, places))
    sim.reset(seed=1)
    sim.step(duration=SETTLED)
    _switch_on(sim)
    stage = _Stage(sim)
    return {name: stage.tile(place, azimuth[name], elevation[name], tile) for name, place in places.items()}


def _stage(things: Mapping[str, str], places: Mapping[str, FloatArray]) -> Any:
    """The world of the things; there is always a boat, and where none is asked for it is far away."""
    world: dict[str, Any] = {"extends": "ocean", "sea": {"gain": 0.03, "tau": 0.1}, "objects": [], "docks": []}
    boats = []
    for name, kind in things.items():
        x, y, _ = places[name].tolist()
        if kind == "object":
            height = next((z for stem, z in HEIGHTS.items() if name.startswith(stem)), 0.0)
            yaw = math.pi if name.startswith("dock_20") else 0.0  # their bays open to the sun
            world["objects"].append({"name": f"the_{name}", "model": name, "pose": [x, y, height, 0, 0, yaw]})
        elif kind == "dock":
            world["docks"].append({"name": f"the_{name}", "layout": name, "pose": [x, y, 0.25, 0, 0, math.pi]})
        else:
            boats.append({"name": f"the_{name}", "robot": name, "pose": [x, y, 0.1, 0, 0, 0]})
    boats = boats or [{"name": "away", "robot": "wamv", "pose": [-SPACING, -SPACING, 0.1, 0, 0, 0], "sensors": "none"}]
    return vrx_mj.compile_world(world, fleet={"boats": boats})


def _switch_on(sim: vrx_mj.Simulation) -> None:
    """Let each light buoy that is named after its colours show the first of them."""
    for name in sim.lights:
        letters = name.rpartition("_")[2]
        if len(letters) == 3 and set(letters) <= COLORS.keys():
            sim.set_light(name, [COLORS[letter] for letter in letters])
    sim.step(duration=1.5)  # it begins after a second


class _Stage:
    """A simulation as a camera sees it at its present time."""

    def __init__(self, sim: vrx_mj.Simulation) -> None:
        self._model = drawing_model(sim.world)
        self._data = mujoco.MjData(self._model)
        self._data.qpos[:] = sim.data.qpos
        mujoco.mj_kinematics(self._model, self._data)
        self._cameras = Cameras(self._model, sim.world.parameters)
        for display in displays_of(sim.world.parameters):
            codes = CODES if display.kind == "light" else SYMBOLS
            colors = display.colors(codes.index(sim.showing(display.name)))
            self._cameras.paint(
                {self._model.geom(geom).id: rgba for part, rgba in colors.items() for geom in display.parts[part]}
            )
        self._time = float(sim.data.time)

    def tile(self, place: FloatArray, azimuth: float, elevation: float, size: tuple[int, int]) -> Tile:
        """Draw what is at a place [m], all of it, from a direction [degrees]."""
        axes = np.array(rotation(0.0, math.radians(elevation), math.radians(azimuth + 180.0)))
        return self.picture(self._eye(self._corners(place), axes, size), axes, size, LENS)

    def reach(self, place: FloatArray) -> float:
        """How far from a boat's origin [m] its own geoms are."""
        root = int(self._model.body_rootid[self._nearest(place)])
        geoms = np.flatnonzero(self._model.body_rootid[self._model.geom_bodyid] == root)
        return float(np.max(np.hypot(*(self._data.geom_xpos[geoms] - place)[:, :2].T) + self._model.geom_rbound[geoms]))

    def _nearest(self, place: FloatArray) -> int:
        """The moving body whose origin is at a place."""
        return int(np.argmin(np.linalg.norm(self._data.xpos - place, axis=1)))

    def picture(self, eye: FloatArray, axes: FloatArray, size: tuple[int, int], lens: float) -> Tile:
        """Draw what a camera at `eye` [m] with axes (3, 3) sees."""
        width, height = FINER * size[0], FINER * size[1]
        camera = CameraConfig(
            name="gallery", link="base_link", width=width, height=height, noise=0.0,
            horizontal_fov=lens, near=0.01, far=2000.0,
        )  # fmt: skip
        rgb = self._cameras.image(camera, self._data, eye, axes, self._time).rgb
        return Image.fromarray(rgb).resize(size, Image.Resampling.LANCZOS)

    def _corners(self, place: FloatArray) -> FloatArray:
        """Corners (n, 3) [m] of the boxes around all that is seen near a place."""
        model, data = self._model, self._data
        near = np.hypot(*(data.geom_xpos - place)[:, :2].T) < SPACING / 2
        chosen = np.flatnonzero(near & (model.geom_rgba[:, 3] > 0.0) & (model.geom_group < 3))
        signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8)
        boxes = []
        for geom in chosen:
            middle, half = model.geom_aabb[geom, :3], model.geom_aabb[geom, 3:]
            local = middle[:, None] + half[:, None] * signs
            boxes.append((data.geom_xmat[geom].reshape(3, 3) @ local).T + data.geom_xpos[geom])
        corners = np.concatenate(boxes) if boxes else place + 0.3 * signs.T
        corners[:, 2] = np.maximum(corners[:, 2], -0.02)  # what is under water is not seen
        return corners

    @staticmethod
    def _eye(corners: FloatArray, axes: FloatArray, size: tuple[int, int]) -> FloatArray:
        """Where the camera must be [m] so that all corners are in its picture, and in the middle of it."""
        half = np.array([math.tan(LENS / 2), math.tan(LENS / 2) * size[1] / size[0]]) / ROOM
        ahead, *across = (corners @ axes).T
        distance = -math.inf
        for offset, slope in zip(across, half, strict=True):
            # |offset - c| <= slope (ahead + distance) for all corners and the best c
            high, low = np.max(offset - slope * ahead), np.max(-offset - slope * ahead)
            distance = max(distance, float(high + low) / (2.0 * slope))
        return axes @ np.array([-distance, *(_middle(offset, ahead + distance) for offset in across)])


def _middle(offset: FloatArray, depth: FloatArray) -> float:
    """Where an eye must be across its view [m] for points at `depth` [m] to be as far to one side as to the other."""
    low, high = float(offset.min()), float(offset.max())
    for _ in range(40):
        middle = (low + high) / 2.0
        slopes = (offset - middle) / depth
        low, high = (middle, high) if slopes.max() > -slopes.min() else (low, middle)
    return (low + high) / 2.0


# Worlds


def view_tile(world: Any, size: tuple[int, int] = TILE) -> Tile:
    """Draw a world 5 s after its start, from behind and above its first boat, toward what is afloat nearby."""
    sim = vrx_mj.Simulation(world)
    sim.reset(seed=1)
    sim.step(duration=5.0)
    boat = next(iter(sim.observe().values()))
    stage, place = _Stage(sim), np.asarray(boat.position)
    yaw = _bearing(map_of(world), place, boat.heading)
    reach = stage.reach(place)
    ahead = np.array([math.cos(yaw), math.sin(yaw), 0.0])
    eye = place + reach * (-2.6 * ahead + [0.0, 0.0, 1.1]) + 0.7 * reach * np.array([-ahead[1], ahead[0], 0.0])
    axes = np.array(rotation(0.0, 0.24, yaw - 0.12))
    return stage.picture(eye, axes, size, 1.1)


def _bearing(scene: MapScene, place: FloatArray, heading: float) -> float:
    """Direction from a place to the nearest five things of the course [rad], or else a boat's heading."""
    things = [(thing.x, thing.y) for thing in scene.objects if not thing.model.startswith(ASHORE)]
    spots = np.array([*things, *(spot[:2] for spot in scene.waypoints), *(d.cells.mean(axis=0) for d in scene.docks)])
    if not len(spots):
        return heading
    away = spots - place[:2]
    nearest = away[np.argsort(np.hypot(*away.T))[:5]].mean(axis=0)
    return math.atan2(nearest[1], nearest[0])


def large_map(world: Any, path: Path, size: tuple[int, int] = (1100, 760)) -> None:
    """Write the map of a compiled world, as `vrx-mj map` draws it."""
    picture = Image.open(io.BytesIO(map_png(map_of(world), size))).convert("RGB")
    path.parent.mkdir(parents=True, exist_ok=True)
    picture.save(path, quality=QUALITY, method=6)


def course_tile(model: str) -> Tile:
    """Draw a small map of an object that consists of other objects."""
    away = {"pose": [-400, -400, 0.1, 0, 0, 0]}
    item = {"name": "course", "model": model, "pose": [0, 0, 0, 0, 0, 0]}
    scene = map_of(vrx_mj.compile_world({"extends": "ocean", "spawn": away, "objects": [item]}))
    return _Map(dataclasses.replace(scene, boats=()), TILE, 30.0).draw()


def map_tile(world: Any) -> Tile:
    """Draw a small map of a compiled world's boats, course, docks and objects."""
    return _Map(map_of(world), TILE, 30.0).draw()


def _area(ring: FloatArray) -> float:
    """Area [m2] that a ring (n, 2) encloses, negative where it goes round clockwise."""
    x, y = ring.T
    return float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) / 2.0)


class _Map:
    """A small map: north is up."""

    def __init__(self, scene: MapScene, size: tuple[int, int], span: float) -> None:
        self._scene, self._size = scene, (FINER * size[0], FINER * size[1])
        self._final = size
        spots = np.array(list(self._spots()) or [(0.0, 0.0)])
        low, high = spots.min(axis=0), spots.max(axis=0)
        needed = np.maximum((high - low) * 1.16, [span * size[0] / size[1], span])
        self._scale = float(min(self._size[0] / needed[0], self._size[1] / needed[1]))
        self._middle = (low + high) / 2.0

    def _spots(self) -> Any:
        scene = self._scene
        yield from ((boat.x, boat.y) for boat in scene.boats)
        yield from ((thing.x, thing.y) for thing in scene.objects)
        yield from ((x, y) for x, y, _ in scene.waypoints)
        yield from scene.course.spots()
        for dock in scene.docks:
            yield from dock.cells.tolist()

    def _at(self, x: float, y: float) -> tuple[float, float]:
        return (
            self._size[0] / 2 + (x - self._middle[0]) * self._scale,
            self._size[1] / 2 - (y - self._middle[1]) * self._scale,
        )

    def draw(self) -> Tile:
        """The map."""
        picture = Image.new("RGB", self._size, WATER)
        pen = ImageDraw.Draw(picture)
        scene, mark = self._scene, 3.2 * FINER
        self._ground(pen)
        for dock in scene.docks:
            for x, y in dock.cells.tolist():
                self._square(pen, x, y, dock.block, dock.yaw)
        for gate in scene.course.gates:
            pen.line([self._at(*gate.left), self._at(*gate.right)], GATE, FINER)
        for place in (*scene.course.animals, *scene.course.beacons):
            self._ring(pen, place.x, place.y, max(place.radius * self._scale, 2 * mark), GOAL)
        for thing in scene.objects:
            radius = max(thing.size / 2 * self._scale, mark)
            self._disc(pen, thing.x, thing.y, radius, tuple(int(255 * share) for share in thing.color))
        for x, y, _ in scene.waypoints:
            self._ring(pen, x, y, 2 * mark, GOAL)
        for boat in scene.boats:
            self._arrow(pen, boat.x, boat.y, boat.yaw)
        self._bar(pen)
        return picture.resize(self._final, Image.Resampling.LANCZOS)

    def _ground(self, pen: ImageDraw.ImageDraw) -> None:
        """Land is on the left of a ring: inside of those that go round counter-clockwise, outside of the others."""
        rings = sorted(self._scene.shore, key=lambda ring: -abs(_area(ring)))
        if rings and _area(rings[0]) < 0.0:
            pen.rectangle((0, 0, *self._size), LAND)
        for ring in rings:
            outline = [self._at(x, y) for x, y in ring.tolist()]
            pen.polygon(outline, LAND if _area(ring) > 0.0 else WATER, SHORE, FINER)

    def _square(self, pen: ImageDraw.ImageDraw, x: float, y: float, edge: float, yaw: float) -> None:
        turns = [yaw + math.pi / 4 * k for k in (1, 3, 5, 7)]
        reach = edge / math.sqrt(2.0)
        pen.polygon([self._at(x + reach * math.cos(a), y + reach * math.sin(a)) for a in turns], DOCK)

    def _disc(self, pen: ImageDraw.ImageDraw, x: float, y: float, radius: float, color: Sequence[int]) -> None:
        px, py = self._at(x, y)
        pen.ellipse((px - radius, py - radius, px + radius, py + radius), tuple(color), "#444444", 1)

    def _ring(self, pen: ImageDraw.ImageDraw, x: float, y: float, radius: float, color: str) -> None:
        px, py = self._at(x, y)
        pen.ellipse((px - radius, py - radius, px + radius, py + radius), None, color, FINER)

    def _arrow(self, pen: ImageDraw.ImageDraw, x: float, y: float, yaw: float) -> None:
        px, py = self._at(x, y)
        reach = 7.0 * FINER
        corners = [(yaw, 1.0), (yaw + 2.6, 0.8), (yaw + math.pi, 0.35), (yaw - 2.6, 0.8)]
        pen.polygon([(px + r * reach * math.cos(a), py - r * reach * math.sin(a)) for a, r in corners], BOAT, "white")

    def _bar(self, pen: ImageDraw.ImageDraw) -> None:
        """A bar of a round length, a sixth to a third of the map's width."""
        widest = self._size[0] / self._scale / 3.0
        power = 10.0 ** math.floor(math.log10(widest))
        length = max(step * power for step in (1, 2, 5) if step * power <= widest)
        x, y = 8 * FINER, self._size[1] - 8 * FINER
        pen.line([(x, y), (x + length * self._scale, y)], "black", FINER)
        pen.text((x, y - 3 * FINER), f"{length:g} m", "black", _font(13 * FINER), anchor="ls")
