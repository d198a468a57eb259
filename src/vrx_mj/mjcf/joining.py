"""A world with one boat more, or one less: its saved form changed in place, without compiling the rest again.

Who joins comes last, in the MJCF and in every table, with the ball of its shooter after it; who leaves is cut out. So
the others keep their order, and MuJoCo gives them the same numbers.
"""

import json
import re
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
from markupsafe import Markup, escape

from vrx_mj.arguments import check_name
from vrx_mj.config.fleet import BoatConfig, newcomer
from vrx_mj.config.wording import ros_names_note
from vrx_mj.config.world import PhysicsConfig, SpawnConfig, WindConfig
from vrx_mj.errors import CommandError, CompileError, StateError, UnknownNameError, VrxWarning
from vrx_mj.frames import Pose
from vrx_mj.mjcf.afloat import depth_in_land
from vrx_mj.mjcf.boats import Boat
from vrx_mj.mjcf.build import build_boat
from vrx_mj.mjcf.compile import boat_entry, object_entry
from vrx_mj.mjcf.fitting import boat_rows, fitted
from vrx_mj.mjcf.objects import object_piece
from vrx_mj.mjcf.parameters import float_row
from vrx_mj.mjcf.placement import PlacedObject
from vrx_mj.mjcf.scored import Touch
from vrx_mj.mjcf.shooters import ball_name, ball_names, spare_ball
from vrx_mj.mjcf.templates import PREFIX, Piece, render
from vrx_mj.mjcf.wind import warn_if_unpushed
from vrx_mj.mjcf.world import World, make_world
from vrx_mj.model.world import parameters_of

__all__ = ["boat_alone", "with_boat", "without_boat"]

Parameters = dict[str, Any]
AWAKE = '>\n    <flag warmstart="disable" autoreset="disable"/>'
ASLEEP = ' sleep_tolerance="0">\n    <flag warmstart="disable" autoreset="disable" sleep="enable"/>'
"""The ends of the options without and with parked balls, as `world.xml.j2` writes them."""


def with_boat(world: World, said: Mapping[str, Any], folder: Path | None = None) -> World:
    """The world with another boat; `said` is an entry of a fleet's `boats`, its pose in world axes [m, rad].

    Paths in it start in `folder`, by default the current one.

    A name that was there before begins its next life: `life` of its entry counts them.

    Raises:
        ConfigError: what is said of the boat is wrong.
        CommandError: something has the name already, or the boat would stand on land.
        CompileError: the boat cannot be built.
    """
    spawn = world.tree.get("spawn", {})
    own = {key: spawn[key] for key in ("robot", "thrusters", "sensors") if spawn.get(key) is not None}
    boat = newcomer(said, SpawnConfig.model_validate(own), folder)
    _check_name(world, boat.name)
    for note in ros_names_note("boat", [boat.name]):
        warnings.warn(note, VrxWarning, stacklevel=3)
    return _Joining(world, boat).world()


def without_boat(world: World, name: str) -> World:
    """The world without a boat.

    Raises:
        UnknownNameError: no boat has that name.
        CommandError: it is the boat that the world's task scores.
    """
    check_name("boat", name, world.boats)
    task = world.tree.get("task")
    if task and task["boat"] == name:
        raise CommandError(f"{name} cannot be removed: it is the boat that the task '{task['name']}' scores")
    parameters = _rows_without(world, name)
    return _cut(world, name, parameters)


def boat_alone(world: World, name: str) -> mujoco.MjModel:
    """A model of nothing but a boat of the world, with all that is seen of it: what else there is takes a second."""
    hull = world.tree["hulls"][world.boats.index(name)]
    block = _block(world, hull["body"])[0]
    head, _, rest = world.mjcf.partition("\n  <asset>")
    lines, used = rest.partition("\n  </asset>")[0].splitlines(), block
    for _ in ("meshes and materials", "their textures"):
        names = set(re.findall(r' (?:mesh|material|texture)="([^"]+)"', used))
        kept = [line for line in lines if names & set(re.findall(r' name="([^"]+)"', line))]
        used = "\n".join([block, *kept])
    assets = "\n".join(["", "  <asset>", *kept, "  </asset>"])
    text = f"{head}{assets}\n  <worldbody>{block}\n  </worldbody>\n</mujoco>"
    return mujoco.MjSpec.from_string(text, assets=dict(world.assets)).compile()


def _check_name(world: World, name: str) -> None:
    parameters = world.tree
    taken = {item["name"]: "a dock" for item in parameters["docks"]}
    taken |= {item["name"].partition("/")[0]: "an object" for item in parameters["objects"]}
    taken |= dict.fromkeys(world.boats, "a boat")
    taken |= dict.fromkeys(("terrain", "carrier"), "a part")
    if name in taken:
        raise CommandError(f"invalid boat name '{name}': {taken[name]} of world {world.name} has this name")


class _Joining:
    """A boat on its way into a world."""

    def __init__(self, world: World, boat: BoatConfig) -> None:
        self._world, self._boat = world, boat
        self._old = world.tree
        self._mjcf, self._assets = world.mjcf, dict(world.assets)
        self._rows: dict[str, list[Any]] = {}

    def world(self) -> World:
        old, boat = self._old, self._boat
        spawn = old.get("spawn", {})
        blowing = {"mean_velocity": abs(old["wind"]["mean"]), "var_gain": old["wind"]["gain"]}
        self._wind = WindConfig.model_validate({"objects": spawn.get("wind"), **blowing})
        physics = {"profile": old["profile"], "gravity": old["gravity"], "quirks": spawn.get("quirks", ())}
        self._physics = PhysicsConfig.model_validate(physics)
        fit = fitted(_built(boat, old["profile"]), boat.engines, boat.color)
        if old["shoreline"] and (depth := depth_in_land(fit.outline, boat.pose, old["shoreline"])):
            x, y, *_ = boat.pose
            shore = f"{depth:.2f} m inside the shore of {old['terrain']}"
            raise CommandError(f"no place for {boat.name} at ({x:g}, {y:g}): it would be on land, {shore}")
        self._place(boat.name, fit.piece, boat.pose)
        self._rows = boat_rows(fit, boat, old, self._wind, self._physics)
        warn_if_unpushed(old["name"], self._wind, self._physics, [(boat, fit.boat.wind)])
        self._add_balls()
        return self._joined()

    def _place(self, name: str, piece: Piece, pose: Pose) -> None:
        prefix = escape(f"{name}/")
        lines = [item.replace(PREFIX, prefix) for item in piece.assets]
        new = [f"\n    {line}" for line in lines if line not in self._mjcf]
        self._mjcf = _before("\n  </asset>", "".join(new), self._mjcf)
        placed = {"pose": pose, "bodies": Markup(piece.bodies.replace(PREFIX, prefix))}
        self._mjcf = _before("\n  </worldbody>", "\n    " + render("placed.xml.j2", piece=placed), self._mjcf)
        self._mjcf = _into("contact", piece.contacts.replace(PREFIX, prefix), self._mjcf)
        self._assets |= piece.files

    def _add_balls(self) -> None:
        """A ball for each of its ball shooters, and leave to sleep for them."""
        names = [row["config"]["name"] for row in self._rows["sensors"] if row["config"]["type"] == "ball_shooter"]
        balls: list[PlacedObject] = []
        for name in names:
            balls.append(spare_ball(self._boat.name, name, [*self._old["objects"], *map(object_entry, balls)]))
        self._rows |= {"floats": [], "elements": [], "objects": [object_entry(ball) for ball in balls]}
        for ball in balls:
            self._place(ball.name, object_piece(ball.config, asleep=True), ball.pose)
            row, elements = float_row(ball, self._wind, self._physics)
            start = len(self._old["elements"]) + len(self._rows["elements"])
            row["element_start"], row["element_count"] = start, len(elements)
            self._rows["floats"].append(row)
            self._rows["elements"] += elements
        if balls and ASLEEP not in self._mjcf:
            self._mjcf = self._mjcf.replace(AWAKE, ASLEEP, 1)

    def _joined(self) -> World:
        old, name = self._old, self._boat.name
        entry, life = boat_entry(self._boat), old.get("lives", {}).get(name, 0)
        self._rows["boats"] = [{**entry, "life": life} if life else entry]
        rows: dict[str, list[Any]] = json.loads(json.dumps(self._rows))  # as those of a world that was loaded
        new: dict[str, Any] = {table: [*old[table], *own] for table, own in rows.items()}
        task = old.get("task")
        if task:
            new["task"] = {**task, "rivals": [*task["rivals"], name]}
            scored = old["hulls"][self._world.boats.index(task["boat"])]["body"]
            touch = Touch(name, self._rows["hulls"][0]["body"])
            self._mjcf = _into("sensor", "\n    " + render("touch.xml.j2", touch=touch, scored=scored), self._mjcf)
        return _world(self._mjcf, self._assets, {**old, **new})


def _built(boat: BoatConfig, profile: str) -> Boat:
    try:
        return build_boat(replace(boat.order, profile=profile))
    except UnknownNameError as error:
        raise CompileError(f"boat {boat.name}: {error}") from error


def _rows_without(world: World, name: str) -> Parameters:
    """The parameters of a world without a boat and its balls."""
    old, index = world.tree, world.boats.index(name)
    hull = old["hulls"][index]
    balls = {row["config"]["name"] for row in old["sensors"] if row["boat"] == name}
    balls = {ball_name(name, shooter) for shooter in balls} & ball_names(old)
    floating = [item["name"] for item in old["objects"] if item["kind"] == "floating"]
    lost = [row for item, row in zip(floating, old["floats"], strict=True) if item in balls]
    new = {
        "boats": [row for row in old["boats"] if row["name"] != name],
        "sensors": [row for row in old["sensors"] if row["boat"] != name],
        "objects": [row for row in old["objects"] if row["name"] not in balls],
        "stations": _without(old["stations"], [(hull["station_start"], hull["station_count"])]),
        "elements": _without(old["elements"], [(row["element_start"], row["element_count"]) for row in lost]),
        "lives": {**old.get("lives", {}), name: old["boats"][index].get("life", 0) + 1},
    }
    thrusters = hull["thruster_start"], hull["thruster_count"]
    hulls = [_shifted(row, "station", hull["station_start"], hull["station_count"]) for row in old["hulls"]]
    new["hulls"] = [_shifted(row, "thruster", *thrusters) for row in hulls if row["body"] != hull["body"]]
    new["thrusters"] = [
        {**row, "hull": row["hull"] - (row["hull"] > index), "race": _down(row["race"], *thrusters)}
        for row in _without(old["thrusters"], [thrusters])
    ]
    for table, gone in (("floats", lost), ("blocks", ())):
        rows = [row for row in old[table] if row not in gone]
        for row in reversed(lost):
            rows = [_shifted(other, "element", row["element_start"], row["element_count"]) for other in rows]
        new[table] = rows
    if task := old.get("task"):
        new["task"] = {**task, "rivals": [rival for rival in task["rivals"] if rival != name]}
    return {**old, **new}


def _without(rows: Sequence[Any], spans: Iterable[tuple[int, int]]) -> list[Any]:
    """The rows but for those of spans, each a start and a count."""
    gone = {row for start, count in spans for row in range(start, start + count)}
    return [row for number, row in enumerate(rows) if number not in gone]


def _shifted(row: Mapping[str, Any], table: str, start: int, count: int) -> dict[str, Any]:
    """A row whose own span in another table begins earlier by `count` if that many rows are gone before it."""
    key = f"{table}_start"
    return {**row, key: _down(row[key], start, count)}


def _down(number: int, start: int, count: int) -> int:
    return number - count if number >= start + count else number


def _cut(world: World, name: str, parameters: Parameters) -> World:
    """The world with new parameters, a boat and its balls cut out of its MJCF."""
    old = world.tree
    links = {row["body"] for row in old["hulls"]} - {row["body"] for row in parameters["hulls"]}
    links |= {row["body"] for row in old["objects"]} - {row["body"] for row in parameters["objects"]}
    mjcf, meshes = world.mjcf, set[str]()
    for link in links:
        block = _block(world, link)[0]
        mjcf = mjcf.replace(block, "", 1)
        meshes |= set(re.findall(r' mesh="([^"]+)"', block))
    mjcf = re.sub(rf'\n    <exclude body1="{re.escape(name)}/[^\n]*', "", mjcf)
    mjcf = re.sub(rf'\n    <contact name="touch/{re.escape(name)}" [^\n]*', "", mjcf)
    mjcf = re.sub(r"\n  <(contact|sensor)>\n  </\1>", "", mjcf)
    for mesh in meshes - set(re.findall(r' mesh="([^"]+)"', mjcf)):
        mjcf = re.sub(rf'\n    <mesh name="{re.escape(mesh)}" [^\n]*', "", mjcf)
    files = set(re.findall(r' file="([^"]+)"', mjcf))
    return _world(mjcf, {file: content for file, content in world.assets.items() if file in files}, parameters)


def _block(world: World, link: str) -> re.Match[str]:
    """Where in the MJCF a thing is that was placed there, by its root."""
    found = re.search(
        rf'\n    <frame [^\n]*\n    <body name="{re.escape(link)}".*?\n    </frame>', world.mjcf, re.DOTALL
    )
    if found is None:
        raise StateError(f"the MJCF of {world.name} is not laid out as vrx_mj writes it: no frame around '{link}'")
    return found


def _world(mjcf: str, assets: Mapping[str, bytes], parameters: Parameters) -> World:
    return make_world(mjcf, assets, parameters_of(json.dumps(parameters).encode()))


def _before(mark: str, text: str, mjcf: str) -> str:
    """The MJCF with a text before the only place where `mark` stands."""
    head, found, tail = mjcf.partition(mark)
    if not found:
        raise StateError(f"the MJCF is not laid out as vrx_mj writes it: no line '{mark.strip()}'")
    return head + text + found + tail


def _into(section: str, text: str, mjcf: str) -> str:
    """The MJCF with a text at the end of a section, which is made if there is none yet."""
    if not text:
        return mjcf
    if f"\n  <{section}>" in mjcf:
        return _before(f"\n  </{section}>", text, mjcf)
    after = "\n  </worldbody>" if section == "contact" else "\n  <custom>"
    whole = f"\n  <{section}>{text}\n  </{section}>"
    if section == "contact":
        return mjcf.replace(after, after + whole, 1)
    return _before(after, whole, mjcf)
