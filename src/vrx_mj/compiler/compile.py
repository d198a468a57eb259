"""From a world and a fleet to a `World`: pieces are rendered, attached under their names, and saved."""

import json
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import mujoco

from vrx_mj.compiler.objects import object_mjcf
from vrx_mj.compiler.parameters import NO_WIND, float_row, sea_parameters, wind_coefficients, wind_parameters
from vrx_mj.compiler.placement import PlacedDock, PlacedObject, place_docks, place_objects
from vrx_mj.compiler.robots import hull_row, robot_mjcf, sensor_rows, thruster_rows
from vrx_mj.compiler.scene import scene_parameters, scene_values
from vrx_mj.compiler.shooters import park, parked_balls
from vrx_mj.compiler.templates import render
from vrx_mj.compiler.terrain import on_land, shoreline, terrain_mjcf
from vrx_mj.compiler.world import World, make_world
from vrx_mj.config.boats import Boat
from vrx_mj.config.build import Order, build_boat
from vrx_mj.config.fleet import BoatConfig
from vrx_mj.config.fleet_checks import load_fleet
from vrx_mj.config.poses import Pose, quaternion
from vrx_mj.config.world import WorldConfig, load_world
from vrx_mj.errors import CompileError, UnknownNameError, VrxWarning

Source = str | Path | Mapping[str, Any]


def compile_world(world: Source, *, fleet: Source | None = None, seed: int | None = None) -> World:
    """Compile a world, with a fleet in it, to MJCF and parameters.

    Args:
        world: name, path of a YAML file, or the file's contents as a mapping.
        fleet: likewise; without one there is a single boat, `wamv`, at the world's spawn pose.
        seed: replaces the world's seed, from which everything random comes.

    Raises:
        ConfigError: a file is wrong; the error lists every problem with its place.
        CompileError: MuJoCo refuses what the files describe.
    """
    config = load_world(world)
    boats = load_fleet(fleet, config)
    return _Assembly(config, boats.name, boats.resolve(config)).world(config.seed if seed is None else seed)


class _Assembly:
    """One world in the making: the spec, its assets and its rows."""

    def __init__(self, config: WorldConfig, fleet: str, boats: tuple[BoatConfig, ...]) -> None:
        self.config = config
        self.fleet = fleet
        self.boats = boats
        self.objects = tuple(place_objects(config.objects))
        self.docks = tuple(place_docks(config.docks, config.objects))
        self.sea = sea_parameters(config.sea)
        self.assets: dict[str, bytes] = {}
        self.pieces: dict[Any, tuple[str, dict[str, bytes]]] = {}
        self.rows: dict[str, list[dict[str, Any]]] = {
            "hulls": [],
            "thrusters": [],
            "floats": [],
            "elements": [],
            "sensors": [],
        }
        self.kinds: dict[Order, Boat] = {}

    def world(self, seed: int) -> World:
        self._warn_of_land()
        spec = mujoco.MjSpec.from_string(self._frame())
        spec.compiler.savecompiled = spec.compiler.savecanonical = False
        if self.config.terrain:
            self._attach(spec, "terrain", terrain_mjcf(self.config.terrain, self.config.folder))
        for dock in self.docks:
            text = render("dock.xml.j2", cells=dock.layout.cells)
            self._attach(spec, dock.name, (text, {}), dock.pose)
        for item in self.objects:
            self._add_object(spec, item)
        for boat in self.boats:
            self._add_boat(spec, boat)
        self._add_balls(spec)
        return make_world(self._text(spec), self.assets, self._parameters(seed))

    def _warn_of_land(self) -> None:
        terrain = self.config.terrain
        ashore = [boat.name for boat in self.boats if terrain and on_land(terrain, *boat.pose[:2])]
        if ashore:
            text = f"on land in {self.config.name}: {', '.join(ashore)}; the shore is that of {terrain}"
            warnings.warn(text, VrxWarning, stacklevel=3)

    def _frame(self) -> str:
        config = self.config
        sea = {key: self.sea[key] for key in ("model", "significant_height", "period", "direction", "tau")}
        return render(
            "world.xml.j2",
            name=config.name,
            fleet=self.fleet,
            timestep=config.physics.timestep,
            gravity=config.physics.gravity,
            center=[*self.boats[0].pose[:2], 0.0] if self.boats else [0.0, 0.0, 0.0],
            water=config.sea.model != "none" or config.terrain is not None,
            level=self.sea["level"],
            sea=json.dumps(sea).replace('"', "'"),
            **scene_values(config),
        )

    def _add_object(self, spec: mujoco.MjSpec, item: PlacedObject) -> None:
        kind = (item.model, item.config.folder)
        if kind not in self.pieces:
            self.pieces[kind] = object_mjcf(item.config)
        self._attach(spec, item.name, self.pieces[kind], item.pose)
        if item.config.kind == "floating":
            row, elements = float_row(item, self.config.wind, self.config.physics.gravity)
            row["element_start"], row["element_count"] = len(self.rows["elements"]), len(elements)
            self.rows["floats"].append(row)
            self.rows["elements"] += elements

    def _add_boat(self, spec: mujoco.MjSpec, boat: BoatConfig) -> None:
        built = self._built(boat)
        kind = (boat.order, boat.engines, boat.color)
        if kind not in self.pieces:
            model = robot_mjcf(built, boat.engines, boat.color)
            self.pieces[kind] = (model.mjcf, model.assets)
        self._attach(spec, boat.name, self.pieces[kind], boat.pose)
        prefix = f"{boat.name}/"
        thrusters = thruster_rows(built, boat.engines, prefix)
        row = hull_row(built, boat.engines, prefix)
        row["wind"] = list(wind_coefficients(self.config.wind, boat.name, boat.robot) or built.wind or NO_WIND)
        start = len(self.rows["thrusters"])
        row["thruster_start"], row["thruster_count"] = start, len(thrusters)
        for thruster in thrusters:
            thruster["hull"] = len(self.rows["hulls"])
            thruster["race"] += start if thruster["race"] >= 0 else 0
        self.rows["hulls"].append(row)
        self.rows["thrusters"] += thrusters
        self.rows["sensors"] += sensor_rows(built, boat.name, prefix)

    def _add_balls(self, spec: mujoco.MjSpec) -> None:
        """One ball for every ball shooter, out of the way until it is fired."""
        configs = ((row["boat"], row["config"]) for row in self.rows["sensors"])
        balls = parked_balls([(boat, own["name"]) for boat, own in configs if own["type"] == "ball_shooter"])
        for ball in balls:
            self._add_object(spec, ball)
        park(spec, balls)
        self.objects = (*self.objects, *balls)

    def _built(self, boat: BoatConfig) -> Boat:
        """The boat of a fleet's entry; those of one order are built once."""
        if boat.order not in self.kinds:
            try:
                self.kinds[boat.order] = build_boat(boat.order)
            except UnknownNameError as error:
                raise CompileError(f"boat {boat.name}: {error}") from error
        return self.kinds[boat.order]

    def _attach(
        self,
        spec: mujoco.MjSpec,
        name: str,
        piece: tuple[str, dict[str, bytes]],
        pose: Pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    ) -> None:
        text, assets = piece
        child = mujoco.MjSpec.from_string(text, assets=assets)
        child.compiler.savecompiled = child.compiler.savecanonical = False
        frame = spec.worldbody.add_frame(pos=list(pose[:3]), quat=list(quaternion(*pose[3:])))
        spec.attach(child, frame=frame, prefix=f"{name}/")
        self.assets.update(assets)

    def _text(self, spec: mujoco.MjSpec) -> str:
        for mesh in spec.meshes:
            mesh.file = mesh.file.rpartition("/")[2]
        spec.assets = dict(self.assets)
        spec.dedup_assets()
        try:
            spec.compile()
        except ValueError as error:
            raise CompileError(f"MuJoCo refuses the world {self.config.name}: {error}") from error
        return str(spec.to_xml())

    def _parameters(self, seed: int) -> dict[str, Any]:
        config = self.config
        return {
            "name": config.name,
            "fleet": self.fleet,
            "description": config.description,
            "seed": seed,
            "profile": config.physics.profile,
            "timestep": config.physics.timestep,
            "gravity": config.physics.gravity,
            "sea": self.sea,
            "wind": wind_parameters(config.wind),
            **self.rows,
            "boats": [_boat_entry(boat) for boat in self.boats],
            "objects": [_object_entry(item) for item in self.objects],
            "docks": [_dock_entry(dock) for dock in self.docks],
            "waypoints": waypoints(config),
            "georeference": config.georeference.model_dump(exclude={"folder"}) if config.georeference else None,
            "terrain": config.terrain,
            "shoreline": shoreline(config.terrain) if config.terrain else [],
            "scene": scene_parameters(config),
            "camera": config.camera,
        }


def waypoints(config: WorldConfig) -> list[list[float]]:
    """The task's goal or waypoints as [x, y, yaw] in world coordinates, m and rad."""
    if config.task is None or config.georeference is None:
        return []
    places = config.task.waypoints or ((config.task.goal,) if config.task.goal else ())
    return [[*config.georeference.to_enu(lat, lon)[:2], yaw] for lat, lon, yaw in places]


def _boat_entry(boat: BoatConfig) -> dict[str, Any]:
    fields = ("name", "robot", "thrusters", "components", "sensors", "engines", "color", "pose")
    return {field: getattr(boat, field) for field in fields}


def _object_entry(item: PlacedObject) -> dict[str, Any]:
    return {
        "name": item.name,
        "model": Path(item.model).stem,
        "kind": item.config.kind,
        "body": f"{item.name}/{item.config.link}",
        "pose": item.pose,
    }


def _dock_entry(dock: PlacedDock) -> dict[str, Any]:
    return {"name": dock.name, "pose": dock.pose, "cells": dock.layout.cells}
