"""Robots: a boat as one MuJoCo model and as rows of the runtime's tables, and a robot for MuJoCo's viewer.

A boat is one body, its base link, whose frame is that of the URDF. With fixed engines everything is part of it;
with hinged engines each thing that steers is a child body on a hinge. Propellers have no joint: their spin is only
looks. There are no actuators: the runtime's kernels thrust and steer. Boats of one kind are made once.
"""

import itertools
import math
from collections import Counter
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import chain
from pathlib import Path
from typing import Any, TypeVar

import mujoco
import numpy as np

from vrx_mj.config.base import marked_numbers
from vrx_mj.config.dynamics import ContactConfig, PropellerConfig
from vrx_mj.config.fleet import BoatConfig
from vrx_mj.config.kinds import CLASSIC, MARINE
from vrx_mj.config.robots import SailEntry
from vrx_mj.config.sensors import CameraConfig
from vrx_mj.config.weather import WindConfig
from vrx_mj.config.world import PhysicsConfig
from vrx_mj.constants import HULL_GRAVITY
from vrx_mj.formats.urdf.links import ENDLESS
from vrx_mj.formats.urdf.model import Joint, Urdf
from vrx_mj.frames import IDENTITY, ZERO, quaternion, rotation
from vrx_mj.mjcf.boats import (
    NO_INERTIA,
    SERVO_INERTIA,
    AssembledThruster,
    Boat,
    Engines,
    Part,
    axis_inertia,
    boat_mass,
    body_mass,
    check_moments,
    push_center,
    turning_mass,
)
from vrx_mj.mjcf.hulls import vessel_of
from vrx_mj.mjcf.parameters import PROFILES, Rows, boat_wind, boat_windage
from vrx_mj.mjcf.pieces import PREFIX, Piece
from vrx_mj.mjcf.templates import geoms, meshes
from vrx_mj.model.boats import (
    MJCF_FIELDS,
    AutopilotChannel,
    Battery,
    Hull,
    Inertia,
    Propeller,
    Sail,
    Station,
    Thruster,
)
from vrx_mj.model.boats import Boat as Entry
from vrx_mj.model.kinds import LONGEST_DESCRIPTION, record_from
from vrx_mj.model.tables import nested_tuples
from vrx_mj.model.water import Sea
from vrx_mj.model.world import Sensor
from vrx_mj.outputs import write_files
from vrx_mj.physics.sail import sail_curve
from vrx_mj.physics.tables import GLF, LINEAR, NEWTONS, RUDDER, SAIL
from vrx_mj.physics.thrust import normal_slope
from vrx_mj.physics.wind import AIR_DENSITY
from vrx_mj.rigid_bodies import MassProperties, rigid

_Color = tuple[float, float, float, float]

_WORLD_LINK = "world"
"""Name of a root link that is fixed where the boat is put, by Gazebo's convention."""
_MAPPINGS = {"linear": LINEAR, "glf": GLF, "newtons": NEWTONS}
"""Codes of the thrust mappings in the runtime's table."""
_MOVING_TYPES = ("revolute", "continuous", "prismatic")
"""Types of joints that can move."""
_COLLISION_COLOR = (0.6, 0.6, 0.6, 1.0)
"""Colour of a collision shape, drawn for a link without visual shapes."""


def robot_piece(
    boat: Boat, engines: Engines = "fixed", color: _Color | None = None, body: MassProperties | None = None
) -> Piece:
    """The boat as a piece of a world.

    Collision geoms are in group 3, visual ones in group 2. `color` repaints the first visual, the skin; `body` is the
    mass of the base link's body, by default that of its links.
    """
    parts = [*boat.parts, *chain.from_iterable(thruster.parts for thruster in boat.thrusters)]
    shapes = [shape for part in parts for shape in (*part.collisions, *part.visuals)]
    needed = meshes(shapes)
    # names that several shapes have are distinguished by those of their links
    shared = {name for name, count in Counter(shape.name for shape in shapes if shape.name).items() if count > 1}
    hinged, solref = engines == "hinged", _solref(boat.contact)
    thrusters = [
        {
            "body": thruster.link,
            "joint": thruster.joint,
            "pose": thruster.pose,
            "mass": turning_mass(thruster) or NO_INERTIA,
            # recordings turn what is seen of an engine with the steering angle
            "frames": _frames(thruster.parts, shared, solref, visual=f"{thruster.name}_engine"),
        }
        for thruster in boat.thrusters
        if thruster.parts
    ]
    turning = [thruster["body"] for thruster in thrusters if thruster["joint"]] if hinged else []
    values = {
        "link": boat.link,
        "is_fixed": boat.link == _WORLD_LINK,
        "meshes": needed,
        "base_mass": body or body_mass(boat, engines),
        "base": _frames(boat.parts, shared, solref, color=color),
        "thrusters": thrusters,
        "cameras": [_camera_view(sensor) for sensor in boat.sensors if isinstance(sensor, CameraConfig)],
        "hinged": hinged,
        "excluded_pairs": list(itertools.combinations(turning, 2)),
        "pi": math.pi,
    }
    return Piece.from_template("robot.xml.j2", {item.file: item.content for item in needed}, **values)


def _solref(contact: ContactConfig) -> tuple[float, float]:
    """MuJoCo's time constant [s] and damping ratio of a contact of so long a duration.

    The force of x'' + 2 zeta w x' + w^2 x = 0 from rest at speed v is zero again after
    w t = atan2(2 zeta s, 2 zeta^2 - 1) / s, s = sqrt(1 - zeta^2), and the time constant is 1 / (zeta w).
    """
    zeta = contact.damping_ratio
    s = math.sqrt(1.0 - zeta * zeta)
    rate = math.atan2(2.0 * zeta * s, 2.0 * zeta * zeta - 1.0) / (s * contact.duration)
    return 1.0 / (zeta * rate), zeta


def _frames(
    parts: Iterable[Part],
    shared: Collection[str | None],
    solref: tuple[float, float],
    *,
    visual: str = "",
    color: _Color | None = None,
) -> list[dict[str, object]]:
    """Links' geoms. Names in `shared` begin with the link's; visual geoms are named `visual` and a number, if given.

    The first visual geom has the `color`, if given.
    """
    frames, number = list[dict[str, object]](), itertools.count()
    for part in parts:
        count, own = Counter[str](), []
        for item in geoms((*part.collisions, *part.visuals)):
            name = item.name
            if name in shared:
                name = f"{part.name}_{name}"
                count[name] += 1
                name = name if count[name] == 1 else f"{name}_{count[name]}"
            if item.rgba is None:
                own.append(replace(item, name=name, solref=solref))
            else:
                name = f"{visual}_{next(number)}" if visual else name
                own.append(replace(item, name=name, rgba=color or item.rgba))
                color = None
        frames.append({"pose": part.pose, "geoms": own})
    return frames


def _camera_view(sensor: CameraConfig) -> dict[str, object]:
    """A camera as MuJoCo's: it looks along -z, x to the right; `fovy` is vertical, in degrees."""
    (_, b, c), (_, e, f), (_, h, i) = rotation(*sensor.pose[3:])
    tall = math.tan(sensor.horizontal_fov / 2) * sensor.height / sensor.width
    return {
        "name": sensor.name,
        "position": sensor.pose[:3],
        "axes": (-b, -e, -h, c, f, i),
        "fovy": math.degrees(2 * math.atan(tall)),
        "size": f"{sensor.width} {sensor.height}",
    }


def hull_row(boat: Boat, engines: Engines, prefix: str) -> Hull:
    """The boat's row of the table of hulls; what the world around it decides is zero.

    `link_com` is where water and wind push; `body_com` and `mass` are those of the MuJoCo body.
    """
    water = boat.hydrodynamics
    assert water is not None, f"{boat.name} has no hydrodynamics"
    body = body_mass(boat, engines)
    return record_from(
        Hull,
        water,
        body=prefix + boat.link,
        joint=f"{prefix}free",
        density=water.water_density,
        level=water.water_level,
        link_com=nested_tuples(push_center(boat)),
        body_com=nested_tuples(body.center),
        mass=body.mass,
        inertia=Inertia(**dict(zip(Inertia.__annotations__, body.tensor(), strict=True))),
        wind=ZERO,
        profile=0,
        gravity=0.0,
        station_start=0,
        station_count=0,
        thruster_start=0,
        thruster_count=len(boat.thrusters),
    )


def station_rows(boat: Boat) -> list[Station]:
    """The boat's rows of the table of stations: VRX 3's points, or classic's two lines, starboard first."""
    water = boat.hydrodynamics
    assert water is not None, f"{boat.name} has no hydrodynamics"
    if water.hulls:
        return [
            Station(position=point, radius=hull.radius, length=hull.length / len(hull.points))
            for hull in water.hulls
            for point in hull.points
        ]
    spacing = water.boat_length / water.length_n
    return [
        Station(
            position=((number + 0.5) * spacing - 0.5 * water.boat_length, side * water.boat_width, 0.0),
            radius=water.hull_radius,
            length=spacing,
        )
        for side in (-0.5, 0.5)
        for number in range(water.length_n)
    ]


def drag_share(boat: Boat, timestep: float) -> float:
    """Largest share of its velocity along or about any axis that linear drag takes from the boat in a `timestep` [s].

    Beyond 2 the explicit step of the drag diverges.
    """
    water, body = boat.hydrodynamics, boat_mass(boat)
    assert water is not None, f"{boat.name} has no hydrodynamics"
    own = [body.mass] * 3 + np.diag(body.inertia).tolist()
    shares = (drag * timestep / (m + a) for drag, m, a in zip(water.drag_linear, own, water.added_mass, strict=True))
    return float(max(shares))


def thruster_rows(boat: Boat, engines: Engines, prefix: str) -> list[Thruster]:
    """The boat's rows of the table of thrusters, as if its hull were the first and they were the only ones."""
    names = [thruster.name for thruster in boat.thrusters]
    whole = boat_mass(boat)
    rows = []
    for item in boat.thrusters:
        turning = turning_mass(item) or NO_INERTIA
        hinged = engines == "hinged" and item.joint is not None
        drive = item.drive
        strongest = max(drive.max_force_forward, -drive.max_force_reverse)
        rows.append(
            record_from(
                Thruster,
                item.drive,
                item.servo,
                name=item.name,
                hull=0,
                body=prefix + (item.link if hinged else boat.link),
                joint=f"{prefix}{item.joint}" if hinged else None,
                position=item.pose[:3],
                rotation=rotation(*item.pose[3:]),
                propeller=item.center,
                direction=item.direction,
                body_com=nested_tuples((turning if hinged else whole).center),
                inertia=max(axis_inertia(turning), SERVO_INERTIA),
                max_command=strongest if drive.mapping == "newtons" else drive.max_command,
                max_forward=drive.max_force_forward,
                max_reverse=drive.max_force_reverse,
                **_force_fields(item, names, boat),
            )
        )
    return rows


def _force_fields(item: AssembledThruster, names: Sequence[str], boat: Boat) -> dict[str, Any]:
    """Fields of a row about the force and a blade; `names` are those of the boat's thrusters."""
    rudder = item.blade
    none = {"area": 0.0, "slope": 0.0, "density": 0.0, "race": -1, "race_area": 0.0, "race_share": 0.0}
    if rudder is None:
        return {**none, "mapping": _MAPPINGS[item.drive.mapping]}
    if isinstance(rudder, SailEntry):
        given = [(math.radians(angle), lift, drag) for angle, lift, drag in rudder.coefficients]
        sail = Sail(curve=tuple(given or sail_curve(rudder.aspect_ratio)), sheet=rudder.sheet)
        return {**none, "mapping": SAIL, "area": rudder.area, "density": AIR_DENSITY, "sail": sail}
    assert boat.hydrodynamics is not None, f"{boat.name} has no hydrodynamics"
    return {
        "mapping": RUDDER,
        "area": rudder.area,
        "slope": normal_slope(rudder.aspect_ratio),
        "density": boat.hydrodynamics.water_density,
        "race": names.index(rudder.propeller) if rudder.propeller in names else -1,
        "race_area": math.pi / 4 * (rudder.propeller_diameter or 0.0) ** 2,
        "race_share": rudder.race_share,
    }


def reweighed_piece(kind: "BoatKind", engines: Engines, color: _Color | None, hull: Hull) -> Piece:
    """The piece of a boat whose hull has the mass, centre of mass and inertia of a row; the kind's if they are its own.

    Raises:
        CompileError: no body has them.
    """
    if all(getattr(hull, name) == getattr(kind.hull, name) for name in MJCF_FIELDS):
        return kind.piece
    assert hull.inertia is not None, "a hull that was just compiled"
    body = rigid(hull.mass, hull.body_com, tuple(vars(hull.inertia).values()))
    return robot_piece(kind.boat, engines, color, check_moments(body, f"robot {kind.boat.name}"))


def save_robot(boat: Boat, target: Path, *, name: str) -> None:
    """Write a boat's MJCF to `target`, with its meshes in `assets` beside it, for plain MuJoCo.

    It is the rigid boat on a free joint, with engines that turn on their hinges; water, wind and thrust are what a
    world adds. `name` is the model's: names inside have no prefix, and MuJoCo's `attach` gives them one.
    """
    robot = robot_piece(boat, "hinged")
    text = robot.document(name)
    for file in robot.files:
        text = text.replace(f'file="{file}"', f'file="assets/{file}"')
    files = {f"assets/{file}": content for file, content in robot.files.items()}
    write_files(target.parent, {**files, target.name: text}, "the MJCF")


_Named = TypeVar("_Named", Hull, Thruster, Sensor)


@dataclass(frozen=True, eq=False)
class BoatKind:
    """Piece and rows that all boats of a kind share; names start with `PREFIX`."""

    boat: Boat
    piece: Piece
    hull: Hull
    stations: Sequence[Station]
    thrusters: Sequence[Thruster]
    sensors: Sequence[Sensor]


@lru_cache(maxsize=64)
def boat_kind(boat: Boat, engines: Engines, color: _Color | None) -> BoatKind:
    """The kind of a boat, which takes 0.1 s to make; one object for each boat, engines and color."""
    sensors = [
        Sensor(
            boat="",
            body=PREFIX + boat.link,
            position=sensor.pose[:3],
            rotation=rotation(*sensor.pose[3:]),
            frame=sensor.frame if sensor.frame == "map" else PREFIX + sensor.frame,
            config=sensor,
        )
        for sensor in boat.sensors
    ]
    return BoatKind(
        boat,
        robot_piece(boat, engines, color),
        hull_row(boat, engines, PREFIX),
        station_rows(boat),
        thruster_rows(boat, engines, PREFIX),
        sensors,
    )


def boat_rows(
    kind: BoatKind, boat: BoatConfig, tables: Rows, wind: WindConfig | None, physics: PhysicsConfig, sea: Sea,
    life: int = 0,
) -> Rows:  # fmt: skip
    """The rows that a boat adds at the ends of a world's tables.

    `life` is the number of boats of its name before.
    """
    hull, start = len(tables.hulls), len(tables.thrusters)
    by_fleet = {mark.name: getattr(boat, key) for key, mark in marked_numbers(BoatConfig) if mark.record is Hull}
    is_marine = physics.profile == MARINE
    vessel = vessel_of(kind.boat, sea.density, physics.gravity, in_waves=bool(sea.waves)) if is_marine else None
    own = replace(
        _with_names(kind.hull, boat.name),
        wind=boat_wind(wind, physics, boat.name, boat.robot, own=kind.boat.wind),
        windage=boat_windage(wind, physics, (boat.name, boat.robot), kind.boat.windage),
        vessel=vessel,
        level=0.0 if vessel else kind.hull.level,  # of `hydrodynamics`
        profile=PROFILES[physics.profile],
        # VRX 3's water weighs what the world's gravity makes it weigh
        gravity=HULL_GRAVITY if physics.profile == CLASSIC else physics.gravity,
        station_start=len(tables.stations),
        station_count=len(kind.stations),
        thruster_start=start,
        **{name: value for name, value in by_fleet.items() if value is not None},
    )
    return Rows(
        hulls=[own],
        stations=[*kind.stations],
        thrusters=[
            replace(
                _with_names(row, boat.name),
                hull=hull,
                race=row.race + start if row.race >= 0 else -1,
                **_propeller_fields(item.measured if is_marine else None),
            )
            for row, item in zip(kind.thrusters, kind.boat.thrusters, strict=True)
        ],
        sensors=[replace(_with_names(sensor, boat.name), boat=boat.name) for sensor in kind.sensors],
        boats=[_entry(kind.boat, boat, life)],
    )


def _entry(robot: Boat, boat: BoatConfig, life: int) -> Entry:
    """The record of a boat of a fleet."""
    return record_from(
        Entry,
        boat,
        life=life,
        description=robot.description if len(robot.description) <= LONGEST_DESCRIPTION else "",
        autopilot=tuple(
            record_from(AutopilotChannel, one, number=int(number), command=one.thruster)
            for number, one in robot.autopilot.items()
        ),
        battery=None if robot.battery is None else record_from(Battery, robot.battery),
    )


def _propeller_fields(config: PropellerConfig | None) -> dict[str, Any]:
    """Fields of a thruster's row from a measured propeller."""
    if config is None:
        return {}
    own = record_from(Propeller, config)
    return {"measured": own, "max_forward": own.full_ahead, "max_reverse": own.full_astern}


def _with_names(row: _Named, boat: str) -> _Named:
    """A row in which names begin with the boat's."""
    texts = ((key, value) for key, value in vars(row).items() if isinstance(value, str))
    named: dict[str, Any] = {key: value.replace(PREFIX, f"{boat}/") for key, value in texts}
    return replace(row, **named)


def jointed_model(robot: Urdf) -> mujoco.MjModel:
    """The model of a robot with its joints at rest; links without visuals show what collides.

    Raises:
        CompileError: MuJoCo cannot use a mesh.
    """
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    spec.modelname = robot.name
    spec.visual.headlight.ambient, spec.visual.headlight.diffuse = (0.5,) * 3, (0.5,) * 3
    sky = spec.add_texture(name="sky", type=mujoco.mjtTexture.mjTEXTURE_SKYBOX, width=64, height=384)
    sky.builtin, sky.rgb1, sky.rgb2 = mujoco.mjtBuiltin.mjBUILTIN_GRADIENT, (0.8, 0.85, 0.9), (0.4, 0.45, 0.5)
    shapes = {name: link.visuals or link.collisions for name, link in robot.links.items()}
    for mesh in meshes(shape for seen in shapes.values() for shape in seen):
        spec.assets[mesh.file] = mesh.content
        inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
        spec.add_mesh(name=mesh.name, file=mesh.file, scale=mesh.scale, inertia=inertia)
    bodies: dict[str, mujoco.MjsBody] = {}
    for link in robot.below(robot.root):
        joint = robot.above.get(link)
        outer, pose = (bodies[joint.parent], joint.pose) if joint else (spec.worldbody, IDENTITY)
        body = outer.add_body(name=link, pos=pose[:3], quat=quaternion(*pose[3:]), mass=1.0, inertia=(1.0, 1.0, 1.0))
        body.explicitinertial = True
        bodies[link] = body
        if joint and joint.type in _MOVING_TYPES and not joint.is_locked:
            own = robot.local(joint.name)
            _add_joint(spec, body, joint, joint.name if own in robot.joints else own)
        for geom in geoms(shapes[link]):
            seen = body.add_geom(pos=geom.pos, quat=quaternion(*geom.euler), rgba=geom.rgba or _COLLISION_COLOR)
            seen.type = getattr(mujoco.mjtGeom, f"mjGEOM_{geom.type.upper()}")
            seen.size[: len(geom.size)] = geom.size
            seen.meshname = geom.mesh or ""
            seen.contype = seen.conaffinity = 0
    return spec.compile()


def _add_joint(spec: mujoco.MjSpec, body: mujoco.MjsBody, joint: Joint, label: str) -> None:
    """A joint, and the control that is its slider; one without limits has half a turn, or a metre, either way."""
    limits, turns = joint.limits, joint.type != "prismatic"
    low, high = (-math.pi, math.pi) if turns else (-1.0, 1.0)
    if joint.type != "continuous" and limits and max(-limits.lower, limits.upper) < ENDLESS:
        low, high = limits.lower, limits.upper
    kind = mujoco.mjtJoint.mjJNT_HINGE if turns else mujoco.mjtJoint.mjJNT_SLIDE
    body.add_joint(name=joint.name, type=kind, axis=joint.axis, ref=joint.rest)
    slider = spec.add_actuator(name=label, target=joint.name, ctrllimited=True, ctrlrange=(low, high))
    slider.trntype = mujoco.mjtTrn.mjTRN_JOINT
