"""From a simulation to the scene of its recording: bodies, their surfaces, thrusters, sensors, displays."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import mujoco
import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.errors import RecordError
from vrx_mj.frames import matrix_quaternion
from vrx_mj.mjcf.drawing import signed_spec
from vrx_mj.mjcf.markers import MARKER, marker_names
from vrx_mj.mjcf.objects import ball_name
from vrx_mj.mjcf.world import World
from vrx_mj.model.boats import Thruster
from vrx_mj.model.world import Parameters, tree_of
from vrx_mj.recording.boat_sets import BoatSet
from vrx_mj.recording.record_scene import (
    RecordedBody,
    RecordedDisplay,
    RecordedJoint,
    RecordedPart,
    RecordedSensor,
    RecordedThruster,
    RecordScene,
    Surface,
)
from vrx_mj.recording.shapes import coarser, geom_surface
from vrx_mj.runtime.run import fingerprint
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.sensors.displays import displays_of

_Looks = dict[str, list[Surface]]
"""Surfaces by the name of the body that carries them."""
FINE_BOATS, MOST_FACES = 10, 1200
"""Boats up to which each is drawn as it is; most triangles of a boat in a larger fleet."""
_JOINTS: dict[int, Literal["hinge", "slide", "ball"]] = {3: "hinge", 2: "slide", 1: "ball"}
"""Kinds of joints by `mjtJoint`."""


@dataclass(frozen=True)
class Choice:
    """A sensor to record."""

    boat: str
    sensor: str
    rate: float
    """Readings per simulated second."""


def scene_of(sim: Simulation, choices: Sequence[Choice] = (), *, looks_of: Sequence[str] | None = None) -> RecordScene:
    """What a recording of this simulation and of some of its sensors holds before its first row.

    With `looks_of` only these boats, objects and docks have surfaces: looking at all the world again takes seconds.
    """
    world, parameters = sim.world, sim.world.parameters
    sea = tree_of(parameters.sea)
    return replace(
        _still_scene(world, sim.model, sim.data.qpos, _looks(world, looks_of)),
        properties={
            "world": world.name,
            "fleet": parameters.fleet,
            "seed": sim.seed,
            "profile": parameters.profile,
            "world_sha256": world.sha256,
            "platform": fingerprint(),
            "sea": {key: sea[key] for key in ("model", "significant_height", "period", "direction")},
            "wind": tree_of(parameters.wind),
        },
        files=dict(sorted(world.files().items())),
        sea_height=sim.sea.height,
        sensors=tuple(_recorded_sensors(world, choices)),
    )


def _still_scene(world: World, model: mujoco.MjModel, qpos: FloatArray, looks: _Looks) -> RecordScene:
    """What a recording holds of a world with these positions, without the run."""
    return RecordScene(
        properties={},
        timestep=float(model.opt.timestep),
        nq=int(model.nq),
        nv=int(model.nv),
        bodies=tuple(_bodies(world, looks, model, qpos)),
        thrusters=tuple(_thrusters(world, looks)),
        displays=tuple(_displays(world, looks, _part_paths(world, model))),
        parts=tuple(_parts_of(world, model, looks)),
        parameters=world.parameters,
    )


def check_columns(boat_set: BoatSet, model: mujoco.MjModel) -> None:
    """Check that the rows of a boat set have the columns of its world, whose model this is.

    Raises:
        RecordError: they have not.
    """
    if boat_set.layout != _still_scene(boat_set.world, model, model.qpos0, {}).layout():
        raise RecordError("the recording is damaged: the columns of its rows are not those of its world")


def _bodies(world: World, looks: _Looks, model: mujoco.MjModel, qpos: FloatArray) -> Iterator[RecordedBody]:
    """Boats, objects, balls and docks, each with what is seen of it; then the shore."""
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    mujoco.mj_kinematics(model, data)
    for kind, name, body_name in _entries(world):
        body = model.body(body_name).id
        joint = int(model.body_jntadr[body]) if model.body_jntnum[body] else None
        pose = (*data.xpos[body], *data.xquat[body])
        yield RecordedBody(
            name=name,
            path=_path(kind, name),
            kind=kind if joint is not None else "fixed",
            pose=tuple(float(value) for value in pose),
            qpos=None if joint is None else int(model.jnt_qposadr[joint]),
            dof=None if joint is None else int(model.jnt_dofadr[joint]),
            surfaces=tuple(looks.get(body_name, ())),
        )
    if MARKER in looks:
        yield RecordedBody("markers", "/world/markers", "fixed", surfaces=tuple(looks[MARKER]))
    if world.parameters.terrain:
        yield RecordedBody("terrain", "/world/terrain", "fixed", surfaces=tuple(looks.get("world", ())))


def _entries(world: World) -> Iterator[tuple[str, str, str]]:
    """Kind, name and MuJoCo's body of everything that has an entity of its own."""
    balls = {ball_name(sensor.boat, sensor.name) for sensor in world.parameters.sensors}
    for boat, hull in zip(world.parameters.boats, world.parameters.hulls, strict=True):
        yield "boat", boat.name, hull.body
    for item in world.parameters.objects:
        yield "ball" if item.name in balls else "object", item.name, item.body
    for dock in world.parameters.docks:
        yield "dock" if dock.dynamic else "fixed", dock.name, dock.bodies[0]
        if not dock.dynamic:
            yield from (("fixed", body.rpartition("/")[0], body) for body in dock.placards)


def _path(kind: str, name: str) -> str:
    return f"/world/{'docks' if kind == 'fixed' else kind + 's'}/{name}"


def _displays(world: World, looks: _Looks, paths: Mapping[str, str]) -> Iterator[RecordedDisplay]:
    """Lights and placards, each on the entity of the body that carries it, by `paths`."""
    for display in displays_of(world.parameters):
        parts = {
            part: tuple(surface for name in names for surface in looks.get(name, ()))
            for part, names in display.parts.items()
        }
        if display.body in paths:
            yield RecordedDisplay(display, paths[display.body], parts)


def _thrusters(world: World, looks: _Looks) -> Iterator[RecordedThruster]:
    for engine in world.parameters.thrusters:
        boat = world.boats[engine.hull]
        yield RecordedThruster(
            name=engine.name,
            boat=boat,
            position=engine.position,
            mount=tuple(matrix_quaternion(np.array(engine.rotation)).tolist()),
            direction=engine.direction,
            surfaces=tuple(looks.get(f"{boat}/{engine.name}", ())),
        )


def _looks(world: World, names: Sequence[str] | None) -> _Looks:
    """What is seen of a world, or of some of its boats, objects and docks."""
    looks: _Looks = {}
    alone = (world.pieces.spec_of(name) for name in names or ())
    for spec in [signed_spec(world)] if names is None else alone:
        looks |= _model_looks(world, spec.compile())
    many = len(world.boats) > FINE_BOATS
    return looks | _coarser_boats(world.parameters, looks) if many else looks


def _model_looks(world: World, model: mujoco.MjModel) -> _Looks:
    """What is seen of every body, in its frame, and of every engine, `boat/thruster`, in the frame of its hinge.

    What lights and placards show goes by the names of their geoms, all markers by the one of markers.
    """
    shown = {name for display in displays_of(world.parameters) for names in display.parts.values() for name in names}
    named = {name: name for name in shown} | dict.fromkeys(marker_names(world.parameters), MARKER)
    engines = {f"{world.boats[engine.hull]}/{engine.name}": engine for engine in world.parameters.thrusters}
    visual = (model.geom_contype == 0) & (model.geom_conaffinity == 0)
    keys = zip(
        model.geom_type.tolist(),
        model.geom_dataid.tolist(),
        *(map(tuple, part.tolist()) for part in (model.geom_size, model.geom_pos, model.geom_quat, model.geom_rgba)),
        strict=True,
    )
    surfaces: dict[Any, Surface] = {}
    seen: _Looks = {}
    for geom, key in enumerate(keys):
        if not visual[geom] or key[0] == mujoco.mjtGeom.mjGEOM_PLANE:
            continue
        name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_GEOM, geom) or ""
        owner = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, model.geom_bodyid[geom])
        part = re.sub(r"_(engine|propeller)_\w+$", "", name)
        engine = engines.get(part)
        still = engine if engine is not None and owner == engine.body and engine.joint is None else None
        kind = (*key, *((still.position, still.rotation) if still else ()))
        if kind not in surfaces:
            surface = geom_surface(model, geom)
            surfaces[kind] = _at_hinge(surface, still) if still else surface
        seen.setdefault(named.get(name, part if engine else owner), []).append(surfaces[kind])
    return seen


def _at_hinge(surface: Surface, engine: Thruster) -> Surface:
    """A surface in the frame of the engine's hinge."""
    turn = np.array(engine.rotation)
    return replace(
        surface,
        vertices=np.asarray((surface.vertices - engine.position) @ turn, np.float32),
        normals=np.asarray(surface.normals @ turn, np.float32),
    )


def _coarser_boats(parameters: Parameters, looks: _Looks) -> _Looks:
    """What is seen of the boats and their engines, with few triangles; boats of a kind share it."""
    made: dict[tuple[int, ...], tuple[Surface, ...]] = {}
    found: _Looks = {}
    for boat, hull in zip(parameters.boats, parameters.hulls, strict=True):
        owners = [hull.body, *(f"{boat.name}/{engine.name}" for engine in parameters.thrusters_of(boat.name))]
        whole = [(owner, surface) for owner in owners for surface in looks.get(owner, ())]
        kind = tuple(id(surface) for _, surface in whole)
        if kind not in made:
            made[kind] = coarser([surface for _, surface in whole], MOST_FACES)
        found |= {owner: [] for owner in owners}
        for (owner, _), surface in zip(whole, made[kind], strict=True):
            found[owner] += [surface] if len(surface.faces) else []
    return found


def _recorded_sensors(world: World, choices: Sequence[Choice]) -> Iterator[RecordedSensor]:
    """The chosen sensors; a receiver of sound that measures at the boat's `base_link` is drawn there."""
    sensors = {(sensor.boat, sensor.name): sensor for sensor in world.parameters.sensors}
    at_base = world.parameters.at_base_link
    for choice in choices:
        sensor = sensors[choice.boat, choice.sensor]
        moved = sensor.type == "pinger" and "pinger" in at_base
        yield RecordedSensor(
            boat=choice.boat,
            name=choice.sensor,
            type=sensor.type,
            frame=sensor.frame,
            rate=choice.rate,
            position=(0.0, 0.0, 0.0) if moved else sensor.position,
            rotation=((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)) if moved else sensor.rotation,
            config=sensor.config,
        )


def _part_paths(world: World, model: mujoco.MjModel) -> dict[str, str]:
    """Entities by MuJoCo's bodies: of links, blocks and placards that move, each under the one that it hangs on."""
    paths = {body: _path(kind, name) for kind, name, body in _entries(world)}
    hung = {body: f"links/{body.rpartition('/')[2]}" for item in world.parameters.objects for body in item.links}
    for dock in (dock for dock in world.parameters.docks if dock.dynamic):
        parts = (*dock.bodies[1:], *dock.placards)
        hung |= {body: body.removesuffix("/link").rpartition("/")[2] for body in parts}
    for body, own in hung.items():
        paths[body] = f"{paths[model.body(model.body_parentid[model.body(body).id]).name]}/{own}"
    return paths


def _parts_of(world: World, model: mujoco.MjModel, looks: Mapping[str, Sequence[Surface]]) -> Iterator[RecordedPart]:
    """The links, blocks and placards of objects that have joints and of floating docks, but for the roots."""
    roots = {body for _, _, body in _entries(world)}
    for name, path in _part_paths(world, model).items():
        if name not in roots:
            yield hanging_part(model, model.body(name).id, path, looks.get(name, ()))


def hanging_part(model: mujoco.MjModel, body: int, path: str, surfaces: Iterable[Surface]) -> RecordedPart:
    """A body of a model as what hangs on another one, with its joints."""
    first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
    joints = (
        RecordedJoint(
            kind=_JOINTS[int(model.jnt_type[joint])],
            anchor=tuple(model.jnt_pos[joint].tolist()),
            axis=tuple(model.jnt_axis[joint].tolist()),
            qpos=int(model.jnt_qposadr[joint]),
        )
        for joint in range(first, first + count)
    )
    return RecordedPart(
        path=path,
        position=tuple(model.body_pos[body].tolist()),
        quaternion=tuple(model.body_quat[body].tolist()),
        joints=tuple(joints),
        surfaces=tuple(surfaces),
    )
