"""What a task's section says, resolved in its world: `World.parameters.task`."""

import re
import warnings
from collections.abc import Callable, Sequence
from typing import Any

from vrx_mj.config import tasks
from vrx_mj.config.fleet import BoatConfig
from vrx_mj.config.poses import Pose
from vrx_mj.config.tasks import AnimalConfig, ChannelConfig, ShownObject
from vrx_mj.config.world import WorldConfig
from vrx_mj.errors import UnknownNameError, VrxWarning
from vrx_mj.mjcf.docks import dock_zones
from vrx_mj.mjcf.placement import PlacedDock, PlacedObject
from vrx_mj.mjcf.shooters import ball_name
from vrx_mj.mjcf.site import Loc, Row, Site, listed, model_of

__all__ = ["Shooter", "task_parameters", "waypoints"]

Shooter = tuple[str, str]
"""Names of a boat and of one of its ball shooters."""

ANIMALS = {
    "crocodile": "avoid",
    "platypus": "circumnavigate_clockwise",
    "turtle": "circumnavigate_counterclockwise",
}
"""What VRX wants of the animals, by the first word of their model."""
POINTS = {"big": 5.0, "small": 10.0}
"""For a ball in a hole, VRX's."""
LEFT = re.compile(r"red_bound_(\d+)")
PARTNERS = ("green", "white", "blue", "black")
"""First words of the right buoys of gates; a gate has one of them."""


def task_parameters(
    config: WorldConfig,
    boats: Sequence[BoatConfig],
    objects: Sequence[PlacedObject],
    docks: Sequence[PlacedDock],
    shooters: Sequence[Shooter] = (),
) -> Row | None:
    """The task of a world, resolved; None if it has none. What the boat may touch is added by who builds it.

    Raises:
        ConfigError: it names what is not there, or leads ashore; with every place in the file.
    """
    task = config.task
    if task is None:
        return None
    site = Site(config, boats, objects, docks)
    boat = site.boat()
    row = {
        "type": "stationkeeping" if isinstance(task, tasks.StationkeepingTask) else task.type,
        "name": task.name or task.type,
        "boat": boat,
        "profile": config.physics.profile,
        "durations": [task.initial_state_duration, task.ready_state_duration, task.running_state_duration],
        "collision_buffer": task.collision_buffer,
        "locked": task.locked,
        "held": isinstance(task, tasks.PerceptionTask),
        **_RESOLVERS[type(task)](task, site),
        "fixed": _fixed(objects, docks),
    }
    if isinstance(task, tasks.DockTask):
        row["balls"] = [ball_name(*shooter) for shooter in shooters if shooter[0] == boat]
    site.check()
    return row


def _fixed(objects: Sequence[PlacedObject], docks: Sequence[PlacedDock]) -> dict[str, Pose]:
    """Where objects and docks are that never move."""
    still = {item.name: item.pose for item in objects if item.config.kind == "static"}
    return still | {dock.name: dock.pose for dock in docks if not dock.config.dynamic}


def waypoints(task: Row | None) -> list[list[float]]:
    """The task's goal or waypoints as [x, y, yaw] in world coordinates, m and rad."""
    places = ([task["goal"]] if "goal" in task else task.get("waypoints", [])) if task else []
    return [[place["x"], place["y"], place["yaw"]] for place in places]


def _stationkeeping(task: tasks.StationkeepingTask, site: Site) -> Row:
    key = "goal" if task.goal else "goal_cart"
    goal = task.goal or task.goal_cart
    assert goal is not None, "checked with the task"
    return {"goal": site.place((key,), goal, geodetic=key == "goal"), "heading": task.heading}


def _wayfinding(task: tasks.WayfindingTask, site: Site) -> Row:
    key = "waypoints" if task.waypoints else "waypoints_cart"
    places = task.waypoints or task.waypoints_cart or ()
    geodetic = key == "waypoints"
    return {"waypoints": [site.place((key, index), place, geodetic=geodetic) for index, place in enumerate(places)]}


def _perception(task: tasks.PerceptionTask, site: Site) -> Row:
    shown = [_shown(site, ("objects", index, "name"), item) for index, item in enumerate(task.objects)]
    return {"objects": shown, "loop_forever": task.loop_forever}


def _shown(site: Site, loc: Loc, item: ShownObject) -> Row:
    thing = site.object(loc, item.name, floating=True)
    kind = item.type or (model_of(thing) if thing else "")
    stash = thing.pose if thing else item.pose
    return {**item.model_dump(), "type": kind, "stash": stash}


def _navigation(task: tasks.NavigationTask, site: Site) -> Row:
    return {"gates": _gates(site, (), task), "obstacle_penalty": task.obstacle_penalty}


def _follow_path(task: tasks.FollowPathTask, site: Site) -> Row:
    keys = {"points_per_gate_crossed", "bonus", "obstacle_penalty"}
    return {"gates": _gates(site, (), task), **task.model_dump(include=keys)}


def _gates(site: Site, at: Loc, channel: ChannelConfig) -> list[Row]:
    """The gates of a channel, whose section is at `at`, by the full names of their buoys."""
    course = channel.course
    parts = site.parts(course)
    if course is not None and not parts:
        site.fault((*at, "course"), str(UnknownNameError("course", course, site.courses())))
        return []
    owner = f"course '{course}'" if course else "the world"
    for index, gate in enumerate(channel.gates):
        for name in (side for side in gate if side not in parts):
            site.fault((*at, "gates", index), f"{owner} has no buoy '{name}'; known: {listed(parts)}")
    pairs = channel.gates or _red_right(parts)
    if not pairs:
        text = f"{owner} has no red_bound_i with a partner i, one of {', '.join(PARTNERS)}; known: {listed(parts)}"
        site.fault((*at, "gates"), text)
    lone = [name for name in parts if LEFT.fullmatch(name) and all(name != left for left, _ in pairs)]
    if lone and not channel.gates:
        warnings.warn(f"{owner}: no gate at {listed(lone)}, without a partner", VrxWarning, stacklevel=2)
    prefix = f"{course}/" if course else ""
    return [{"left": prefix + left, "right": prefix + right} for left, right in pairs]


def _red_right(parts: Sequence[str]) -> list[tuple[str, str]]:
    """Pairs of red buoys and their partners, in the order of their numbers."""
    numbers = sorted((int(match[1]), match[1]) for match in map(LEFT.fullmatch, parts) if match)
    partners = {i: [name for color in PARTNERS if (name := f"{color}_bound_{i}") in parts] for _, i in numbers}
    return [(f"red_bound_{i}", partners[i][0]) for _, i in numbers if partners[i]]


def _dock(task: tasks.DockTask, site: Site) -> Row:
    dock = site.dock(("dock",), task.dock)
    zones: Row = dock_zones(dock) if dock else {"anchor": "", "bays": [], "holes": []}
    if task.light_buoy is not None:
        buoy = site.object(("light_buoy",), task.light_buoy)
        if buoy and buoy.config.light is None:
            site.fault(("light_buoy",), f"'{task.light_buoy}' has no `light`")
    keys = {"light_buoy", "color_sequence", "color_bonus_points", "dock_bonus_points", "correct_dock_bonus_points"}
    keys |= {"enable_color_checker", "min_dock_time"}
    return {
        "dock": task.dock,
        "anchor": zones["anchor"],
        "bays": _bays(task, site, zones["bays"]) if dock else [],
        "holes": _holes(task, site, zones) if dock else [],
        **task.model_dump(include=keys),
    }


def _bays(task: tasks.DockTask, site: Site, known: Sequence[Row]) -> list[Row]:
    """The dock's bays with what the task says of them, in their order."""
    if len(task.bays) != len(known):
        names = listed(str(bay["name"]) for bay in known)
        site.fault(("bays",), f"'{task.dock}' has {len(known)} bays, {names}; got {len(task.bays)}")
        return []
    for index, (bay, its) in enumerate(zip(task.bays, known, strict=True)):
        if bay.name is not None and bay.name != its["name"]:
            site.fault(("bays", index, "name"), f"this bay of '{task.dock}' is '{its['name']}', not '{bay.name}'")
    return [
        {**its, "symbol": bay.symbol, "dock_allowed": bay.dock_allowed}
        for bay, its in zip(task.bays, known, strict=True)
    ]


def _holes(task: tasks.DockTask, site: Site, zones: Row) -> list[Row]:
    """The holes that count, with their points."""
    known, names = (
        {(hole["bay"], hole["size"]): hole for hole in zones["holes"]},
        [bay["name"] for bay in zones["bays"]],
    )
    if task.targets is None:
        counts = task.type == "scan_dock_deliver"
        return [{**hole, "points": POINTS[hole["size"]]} for hole in zones["holes"]] if counts else []
    rows = []
    for index, target in enumerate(task.targets):
        hole = known.get((names[target.bay - 1], target.size)) if target.bay <= len(names) else None
        if hole:
            rows.append({**hole, "points": target.points})
        else:
            site.fault(("targets", index), f"bay {target.bay} of '{task.dock}' has no {target.size} hole")
    return rows


def _wildlife(task: tasks.WildlifeTask, site: Site) -> Row:
    all_of_them = [AnimalConfig(name=name) for name, item in site.objects.items() if _habit(model_of(item))]
    animals = [_animal(site, index, animal) for index, animal in enumerate(task.animals or all_of_them)]
    if not animals:
        site.fault(("animals",), f"the world has no animals; models of animals start with {', '.join(ANIMALS)}")
    return {"animals": animals, **task.model_dump(include={"engagement_distance", "time_bonus", "publication_rate"})}


def _animal(site: Site, index: int, animal: AnimalConfig) -> Row:
    thing = site.object(("animals", index, "name"), animal.name, floating=True)
    model = model_of(thing) if thing else ""
    goal = animal.goal or _habit(model)
    if thing and goal is None:
        text = f"required for the model {model}; only {', '.join(ANIMALS)} have goals of their own"
        site.fault(("animals", index, "goal"), text)
    return {"name": animal.name, "model": model, "goal": goal}


def _habit(model: str) -> str | None:
    """The goal of an animal's model."""
    return ANIMALS.get(model.partition("_")[0])


def _gymkhana(task: tasks.GymkhanaTask, site: Site) -> Row:
    channel = task.channel
    gates = _gates(site, ("channel",), channel)
    return {
        "channel": {"gates": gates, **channel.model_dump(include={"obstacle_penalty", "collision_buffer"})},
        "pinger": site.point(("pinger",), task.pinger),
        "obstacle_penalty": task.obstacle_penalty,
    }


def _acoustic_perception(task: tasks.AcousticPerceptionTask, site: Site) -> Row:
    return {"pinger": site.point(("pinger",), task.pinger), "goal_tolerance": task.goal_tolerance}


def _acoustic_tracking(task: tasks.AcousticTrackingTask, site: Site) -> Row:
    site.object(("pinger",), task.pinger, floating=True)
    return task.model_dump(include={"pinger", "pinger_depth", "obstacle_penalty"})


_RESOLVERS: dict[type[tasks.TaskConfig], Callable[[Any, Site], Row]] = {
    tasks.StationkeepingTask: _stationkeeping,
    tasks.WayfindingTask: _wayfinding,
    tasks.PerceptionTask: _perception,
    tasks.NavigationTask: _navigation,
    tasks.FollowPathTask: _follow_path,
    tasks.DockTask: _dock,
    tasks.WildlifeTask: _wildlife,
    tasks.GymkhanaTask: _gymkhana,
    tasks.AcousticPerceptionTask: _acoustic_perception,
    tasks.AcousticTrackingTask: _acoustic_tracking,
}
