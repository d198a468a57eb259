"""From a simulation to the scene of its recording: bodies, their surfaces, thrusters, sensors, displays.

What is seen of a body is triangles: MuJoCo's geoms, and coarser copies for fleets of many boats.
"""

import functools
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any, Literal

import mujoco
import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import FloatArray, IntArray
from vrx_mj.constants import PHYSICS_VERSION
from vrx_mj.errors import RecordError
from vrx_mj.frames import matrix_quaternion
from vrx_mj.mjcf.objects import ball_name
from vrx_mj.mjcf.pieces import Detail
from vrx_mj.mjcf.scene import MARKER, add_markers, marker_names
from vrx_mj.mjcf.world import World
from vrx_mj.model.boats import Thruster
from vrx_mj.model.world import Parameters, tree_of
from vrx_mj.recording.boat_sets import BoatSet
from vrx_mj.recording.record_scene import (
    MovingBody,
    RecordedBody,
    RecordedDisplay,
    RecordedJoint,
    RecordedPart,
    RecordedSensor,
    RecordedThruster,
    RecordScene,
    Surface,
)
from vrx_mj.runtime.run import fingerprint
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.sensors.displays import displays_of

_Looks = dict[str, list[Surface]]
"""Surfaces by the name of the body that carries them."""
FINE_BOATS, MOST_FACES = 10, 1200
"""Largest number of boats that are drawn in full detail, and largest number of triangles of a boat in a larger
fleet."""
_JOINTS: dict[int, Literal["hinge", "slide", "ball"]] = {3: "hinge", 2: "slide", 1: "ball"}
"""Kinds of joints by `mjtJoint`."""
_BASE_MOUNT = (0.0, 0.0, 0.0), ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
"""Place and rotation of a sensor at its boat's `base_link`."""


Choices = Mapping[tuple[str, str], float]
"""Readings per simulated second of sensors to record, by boat and sensor."""
_SHARP_COSINE = math.cos(math.radians(40.0))
"""Cosine between a face and MuJoCo's normal at its corner below which the face has an edge there."""
_CYLINDER_SIDES, _SPHERE_SIDES, _SPHERE_RINGS = 24, 16, 9
"""Facets around cylinders, around spheres and capsules, and rings of vertices from pole to pole."""
_LATITUDES = np.linspace(-0.5 * np.pi, 0.5 * np.pi, _SPHERE_RINGS)
_ARC = np.stack([np.cos(_LATITUDES), np.sin(_LATITUDES)], axis=-1)
_COARSENING = 1.1
"""Factor by which cells grow until a surface has few enough triangles."""


def scene_of(
    sim: Simulation, choices: Choices = MappingProxyType({}), *, looks_of: Sequence[str] | None = None
) -> RecordScene:
    """Scene that a recording of this simulation and of some of its sensors begins with.

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
            "physics_version": PHYSICS_VERSION,
            "platform": fingerprint(),
            "sea": {key: sea[key] for key in ("model", "significant_height", "period", "direction")},
            "wind": tree_of(parameters.wind),
        },
        files=dict(sorted(world.files().items())),
        sea_height=sim.sea.height,
        sensors=tuple(_recorded_sensors(world, choices)),
    )


def _still_scene(world: World, model: mujoco.MjModel, qpos: FloatArray, looks: _Looks) -> RecordScene:
    """Scene of a world with these positions, without a run."""
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
        body, free = data.body(body_name), None
        if model.body_jntnum[body.id]:
            joint = model.body_jntadr[body.id]
            free = MovingBody(name, kind, int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint]))
        pose, surfaces = (*body.xpos.tolist(), *body.xquat.tolist()), tuple(looks.get(body_name, ()))
        yield RecordedBody(name, _path(kind, name), kind if free else "fixed", pose, free, surfaces)
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
        mount = tuple(matrix_quaternion(np.array(engine.rotation)).tolist())
        surfaces = tuple(looks.get(f"{boat}/{engine.name}", ()))
        yield RecordedThruster(engine.name, boat, engine.position, mount, engine.direction, surfaces)


def _looks(world: World, names: Sequence[str] | None) -> _Looks:
    """Looks of a world, or of some of its boats, objects and docks."""
    looks: _Looks = {}
    specs = [world.pieces.spec(Detail.VISUALS)] if names is None else [world.pieces.spec_of(name) for name in names]
    if names is None:
        add_markers(specs[0], world.parameters)
    for spec in specs:
        looks |= _model_looks(world, spec.compile())
    return looks | _coarser_boats(world.parameters, looks) if len(world.boats) > FINE_BOATS else looks


def _model_looks(world: World, model: mujoco.MjModel) -> _Looks:
    """Looks of every body, in its frame, and of every engine, `boat/thruster`, in the frame of its hinge.

    What lights and placards show goes by the names of their geoms, all markers by the one of markers.
    """
    shown = {name for display in displays_of(world.parameters) for names in display.parts.values() for name in names}
    named = {name: name for name in shown} | dict.fromkeys(marker_names(world.parameters), MARKER)
    engines = {f"{world.boats[engine.hull]}/{engine.name}": engine for engine in world.parameters.thrusters}
    visual = (model.geom_contype == 0) & (model.geom_conaffinity == 0)
    tables = model.geom_type, model.geom_dataid, model.geom_size, model.geom_pos, model.geom_quat, model.geom_rgba
    surfaces: dict[Any, Surface] = {}
    seen: _Looks = {}
    for geom, key in enumerate(np.column_stack(tables).tolist()):
        if not visual[geom] or model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE:
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
    vertices, normals = (surface.vertices - engine.position) @ turn, surface.normals @ turn
    return replace(surface, vertices=vertices.astype(np.float32), normals=normals.astype(np.float32))


def _coarser_boats(parameters: Parameters, looks: _Looks) -> _Looks:
    """Looks of the boats and their engines with few triangles; boats of a kind share them."""
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


def _recorded_sensors(world: World, choices: Choices) -> Iterator[RecordedSensor]:
    """The chosen sensors; a receiver of sound that measures at the boat's `base_link` is drawn there."""
    sensors = {(sensor.boat, sensor.name): sensor for sensor in world.parameters.sensors}
    for (boat, name), rate in choices.items():
        sensor = sensors[boat, name]
        moved = sensor.type == "pinger" and "pinger" in world.parameters.at_base_link
        place = _BASE_MOUNT if moved else (sensor.position, sensor.rotation)
        yield RecordedSensor(boat, name, sensor.type, sensor.frame, rate, *place, sensor.config)


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
        pose=(*model.body_pos[body].tolist(), *model.body_quat[body].tolist()),
        joints=tuple(joints),
        surfaces=tuple(surfaces),
    )


_Floats = npt.NDArray[np.floating]
_Triangles = tuple[FloatArray, npt.NDArray[np.int32], FloatArray]
"""Vertices (n, 3) [m], faces (m, 3) as indices of them, counter-clockwise from outside, and the vertices' normals."""

_ARC[[0, -1], 0] = 0.0
"""From pole to pole of a sphere of radius 1: radius and height (rings, 2)."""


def geom_surface(model: mujoco.MjModel, geom: int) -> Surface:
    """A geom that is no plane in the frame of its body; flat faces keep their edges."""
    kind, size = int(model.geom_type[geom]), model.geom_size[geom].tolist()
    mesh = kind == mujoco.mjtGeom.mjGEOM_MESH
    vertices, faces, normals = _mesh(model, int(model.geom_dataid[geom])) if mesh else _primitive(kind, size)
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, model.geom_quat[geom])
    turn = matrix.reshape(3, 3).T
    return Surface(
        np.asarray(vertices @ turn + model.geom_pos[geom], np.float32),
        faces,
        np.asarray(normals @ turn, np.float32),
        tuple(model.geom_rgba[geom].tolist()),
    )


def _primitive(kind: int, size: Sequence[float]) -> _Triangles:
    shapes, (x, y, _) = mujoco.mjtGeom, size
    if kind == shapes.mjGEOM_CAPSULE:
        halves = np.concatenate([_ARC[: _SPHERE_RINGS // 2 + 1], _ARC[_SPHERE_RINGS // 2 :]])
        lift = np.outer(np.repeat([-y, y], len(halves) // 2), [0.0, 1.0])
        return _revolution(x * halves + lift, halves, _SPHERE_SIDES)
    vertices, faces, normals = _unit_shape(kind)
    scale = np.array({shapes.mjGEOM_CYLINDER: (x, x, y), shapes.mjGEOM_SPHERE: (x, x, x)}.get(kind, size))
    normals = normals / scale
    return vertices * scale, faces, normals / np.linalg.norm(normals, axis=1, keepdims=True)


@functools.cache
def _unit_shape(kind: int) -> _Triangles:
    """A box, a cylinder, or a sphere, whose half edges, half height and radius are 1."""
    if kind == mujoco.mjtGeom.mjGEOM_BOX:  # four corners for each face
        outward = np.concatenate([np.eye(3), -np.eye(3)])[:, None]
        along = np.roll(outward, 1, axis=-1)
        across = np.cross(outward, along)
        corners = outward + np.array([[-1], [1], [1], [-1]]) * along + np.array([[-1], [-1], [1], [1]]) * across
        faces = 4 * np.arange(6, dtype=np.int32)[:, None] + np.array([0, 1, 2, 0, 2, 3], np.int32)
        return corners.reshape(-1, 3), faces.reshape(-1, 3), np.repeat(outward[:, 0], 4, axis=0)
    if kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        profile = np.array([[0.0, -1.0], [1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [1.0, 1.0], [0.0, 1.0]])
        normals = np.array([[0.0, -1.0], [0.0, -1.0], [1.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.0, 1.0]])
        return _revolution(profile, normals, _CYLINDER_SIDES)
    return _revolution(_ARC, _ARC, _SPHERE_SIDES)


def _revolution(profile: FloatArray, normals: FloatArray, facets: int) -> _Triangles:
    """A profile (n, 2) of radius and height from bottom to top, and its normals likewise, turned around z."""
    angle = np.linspace(0.0, 2.0 * np.pi, facets, endpoint=False)
    ring = np.stack([np.cos(angle), np.sin(angle), np.ones(facets)], axis=-1)
    index = np.arange(len(profile) * facets, dtype=np.int32).reshape(-1, facets)
    a, b = index[:-1], index[1:]
    c, d = np.roll(a, -1, axis=1), np.roll(b, -1, axis=1)
    apart = np.any(profile[:-1] != profile[1:], axis=1)
    lower = np.stack([a, c, b], axis=-1)[apart & (profile[:-1, 0] > 0.0)]
    upper = np.stack([c, d, b], axis=-1)[apart & (profile[1:, 0] > 0.0)]
    vertices, directions = (ring * line[:, None, [0, 0, 1]] for line in (profile, normals))
    return vertices.reshape(-1, 3), np.concatenate([lower, upper]).reshape(-1, 3), directions.reshape(-1, 3)


def _mesh(model: mujoco.MjModel, mesh: int) -> _Triangles:
    """A mesh with MuJoCo's normals, but for corners where these lie far from the face's own: there it has an edge."""
    points = model.mesh_vert[model.mesh_vertadr[mesh] :][: model.mesh_vertnum[mesh]]
    normals = model.mesh_normal[model.mesh_normaladr[mesh] :][: model.mesh_normalnum[mesh]]
    first, count = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
    faces, index = model.mesh_face[first:][:count], model.mesh_facenormal[first:][:count]
    a, b, c = (points[faces[:, corner]].astype(np.float64) for corner in range(3))
    own = np.cross(b - a, c - a)
    own /= np.maximum(np.linalg.norm(own, axis=1, keepdims=True), 1e-12)
    sharp = np.einsum("fi,fci->fc", own, normals[index]) < _SHARP_COSINE
    index = np.where(sharp, len(normals) + np.arange(len(faces))[:, None], index)
    pairs = faces.astype(np.int64) * (len(normals) + len(faces)) + index
    kept, corners = np.unique(pairs, return_inverse=True)
    vertex, normal = np.divmod(kept, len(normals) + len(faces))
    return points[vertex], corners.reshape(-1, 3).astype(np.int32), np.concatenate([normals, own])[normal]


def coarser(surfaces: Sequence[Surface], most: int) -> tuple[Surface, ...]:
    """The surfaces with at most so many faces in all, their vertices gathered in cells; each stays two cells thick.

    What is too much even so is left empty, the smallest surfaces first.
    """
    sizes = [float(np.max(np.ptp(surface.vertices, axis=0))) for surface in surfaces]
    cell, coarse = max(sizes, default=0.0) / 64.0, tuple(surfaces)
    while sum(len(surface.faces) for surface in coarse) > most and cell < 2.0 * max(sizes):
        coarse = tuple(_gather(surface, cell) for surface in surfaces)
        cell *= _COARSENING
    for index in np.argsort(sizes, kind="stable"):
        if sum(len(surface.faces) for surface in coarse) <= most:
            break
        empty = replace(coarse[index], faces=np.empty((0, 3), np.int32))
        coarse = (*coarse[:index], empty, *coarse[index + 1 :])
    return coarse


def _gather(surface: Surface, cell: float) -> Surface:
    """A surface whose vertices that face one way in one cell [m] are one."""
    whole = coarser_faces(surface.vertices, surface.normals, surface.faces, cell)
    used, corners = np.unique(whole, return_inverse=True)
    faces = corners.reshape(-1, 3).astype(np.int32)
    return replace(surface, vertices=surface.vertices[used], faces=faces, normals=surface.normals[used])


def coarser_faces(points: _Floats, normals: _Floats, faces: IntArray, cell: float) -> IntArray:
    """Fewer triangles (m, 3) than `faces` (n, 3), of the outermost of the points that face one way in one cell [m]."""
    points = np.asarray(points, np.float64)
    size = np.maximum(np.ptp(points, axis=0), 1e-9)
    place = (points - points.min(axis=0)) / size
    count = np.maximum(np.ceil(size / cell), 2.0)
    index = np.minimum(place * count, count - 1.0).astype(np.int64) @ [1, int(count[0]), int(count[0] * count[1])]
    axis = np.argmax(np.abs(normals), axis=1)
    below = np.take_along_axis(normals, axis[:, None], axis=1)[:, 0] < 0.0
    _, owner = np.unique(6 * index + 2 * axis + below, return_inverse=True)
    outward = np.argsort(np.linalg.norm(place - 0.5, axis=1), kind="stable")
    outermost = np.empty(owner.max() + 1, np.int64)
    outermost[owner[outward]] = outward  # the last one stays
    ordered = np.sort(owner[faces], axis=1)
    wide = np.flatnonzero((ordered[:, 0] < ordered[:, 1]) & (ordered[:, 1] < ordered[:, 2]))
    _, once = np.unique(ordered[wide], axis=0, return_index=True)
    return np.asarray(outermost[owner[faces[np.sort(wide[once])]]])
