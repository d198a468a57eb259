"""What the table's functions may do: the simulation, and what serves it."""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from typing import Any, Literal, NamedTuple, Protocol

import mujoco
import numpy as np

from vrx_mj.arguments import check_name
from vrx_mj.arrays import FloatArray
from vrx_mj.draw.style import Rgb, boat_colors
from vrx_mj.errors import CommandError, UnknownNameError, VrxError
from vrx_mj.frames import rotation_vector
from vrx_mj.mjcf.objects import DEPTH, ball_names
from vrx_mj.model.world import Parameters
from vrx_mj.ros.diagnosis import Diagnosis
from vrx_mj.ros.interface import Input, Output
from vrx_mj.ros.messages import Message, kind, new, stamp
from vrx_mj.ros.steering import Steering
from vrx_mj.runtime.applied import AppliedForces
from vrx_mj.runtime.observation import BoatObservation, Observation
from vrx_mj.runtime.simulation import Simulation

_JOINT_SUFFIXES = frozenset({"axis", "axis2", "ball"})
"""Suffixes of the names of MuJoCo's joints of an object."""
_WORLD_FRAMES = frozenset({"", "world", "map", "/map"})
"""Names that Gazebo takes for the world's frame."""
_CARRIER = "carrier/"
"""Prefix of the name of a body that holds a boat for its task: as in Gazebo, it is no link."""
_NO_VELOCITY = (0.0,) * 6
"""Velocity at rest."""
_MIN_MOVE = 1e-9
"""A body moved by less than this [m] is left alone: a sleeping one goes on sleeping."""
_START_STEP = 10.0
"""Coordinates of the frame `start` are multiples of this [m]."""


class FrameState(NamedTuple):
    """Where a body's frame is and how it moves, in the world's axes."""

    position: FloatArray
    """Position, (3,) [m]."""
    quaternion: FloatArray
    """Quaternion (w, x, y, z), body to world."""
    velocity: FloatArray
    """Velocity of the frame's origin, (3,) [m/s]."""
    spin: FloatArray
    """Angular velocity, (3,) [rad/s]."""


class JointAxis(NamedTuple):
    """An axis of a joint, about which its child link turns, or along which it slides."""

    kind: int
    """MuJoCo's type of the joint."""
    limited: bool
    """Whether it has limits."""
    position: float
    """Position [rad], of a slide [m]."""
    rate: float
    """Rate [rad/s], of a slide [m/s]."""
    damping: float
    """Damping [N m s/rad], of a slide [N s/m]."""


class Bodies:
    """All models and links of a simulation, at its present moment."""

    def __init__(self, sim: Simulation) -> None:
        self._sim = sim
        self.bind()

    def bind(self) -> None:
        """Boats or objects came or went, or the simulation began anew."""
        model, parameters = self._sim.model, self._sim.world.parameters
        self._data = mujoco.MjData(model)  # what steps keeps frames that are one step old
        self._then = -1.0
        boats = {name: hull.body for name, hull in zip(self._sim.boats, parameters.hulls, strict=True)}
        objects = {item.name: item.body for item in parameters.objects}
        docks = {dock.name: dock.bodies[0] for dock in parameters.docks}
        bodies = {str(model.body(index).name): index for index in range(1, model.nbody)}
        known = {name: index for name, index in bodies.items() if not name.startswith(_CARRIER)}
        singles = {name: known[body] for name, body in {**objects, **docks, **boats}.items() if body in known}
        self._balls = {singles[name] for name in ball_names(parameters)}
        self._singles = {index: name for name, index in singles.items()}
        self._models: dict[str, int] = {}
        self._parts: dict[str, list[str]] = {}
        for name, index in singles.items():
            for model_name in _model_names(name) if name.partition("/")[0] not in boats else [_gazebo(name)]:
                self._models.setdefault(model_name, index)
                self._parts.setdefault(model_name, []).append(name)
        self._links = {_link_name(body, boats): index for body, index in known.items()}
        self._joints: dict[str, list[int]] = {}
        for joint in range(model.njnt):
            if model.jnt_type[joint] != mujoco.mjtJoint.mjJNT_FREE and model.jnt_bodyid[joint] in known.values():
                self._joints.setdefault(_joint_name(str(model.joint(joint).name), boats), []).append(joint)

    @property
    def models(self) -> Sequence[str]:
        """Names of all models that are in no other: boats, objects, courses and docks."""
        return tuple(name for name in self._models if "::" not in name)

    @property
    def links(self) -> Sequence[str]:
        """Names of all links, as `wamv::wamv/base_link`."""
        return tuple(self._links)

    def model(self, name: str) -> FrameState:
        """Where a model is; one that is made of models is where the first of them is. Errors are those of `parts`."""
        self.parts(name)
        index = self._models[_gazebo(name)]
        self._refresh()
        return self._place_of(index)

    def parts(self, name: str) -> Sequence[str]:
        """The boat, object or dock that a model is, or all that it is made of, by their names in this world.

        Models in models have Gazebo's names, as `buoys::red_0`, or ours, as `buoys/red_0`.

        Raises:
            UnknownNameError: no model has that name.
        """
        if _gazebo(name) not in self._models:
            raise UnknownNameError("model", name, self._models)
        return self._parts[_gazebo(name)]

    def link(self, name: str) -> FrameState:
        """Where a link is; UnknownNameError for an unknown name."""
        check_name("link", name, self._links)
        self._refresh()
        return self._place_of(self._links[name])

    def body(self, link: str) -> str:
        """The name of a link's body in the MJCF; UnknownNameError for an unknown name."""
        check_name("link", link, self._links)
        return str(self._sim.model.body(self._links[link]).name)

    def places(self, *, links: bool) -> dict[str, FrameState]:
        """Where every link is, or every model, boats last; balls that were not fired are none."""
        self._refresh()
        return {
            name: self._place_of(index)
            for name, index in (self._links if links else self._models).items()
            if index not in self._balls or float(self._data.xpos[index, 2]) > -0.5 * DEPTH
        }

    @property
    def joints(self) -> Sequence[str]:
        """Names of all joints, as `raft::hinge` or `wamv::wamv/left_engine`."""
        return tuple(self._joints)

    def joint(self, name: str) -> Sequence[JointAxis]:
        """The axes of a joint, of whole name or, if it is the first of that, of its own; UnknownNameError without one.

        Those of a ball are the world's of its child link, where its turn is a rotation vector.
        """
        return [axis for joint in self.joint_numbers(name) for axis in self._axes(joint)]

    def joint_numbers(self, name: str) -> Sequence[int]:
        """MuJoCo's joints that a joint is, as `joint` finds it; UnknownNameError without one."""
        known = {whole.rpartition("::")[2]: numbers for whole, numbers in reversed(self._joints.items())} | self._joints
        if name not in known:
            raise UnknownNameError("joint", name, self._joints)
        return known[name]

    def _axes(self, joint: int) -> Iterator[JointAxis]:
        model, data = self._sim.model, self._sim.data
        kind, at, dof = int(model.jnt_type[joint]), int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
        if kind == mujoco.mjtJoint.mjJNT_BALL:
            for number, turn in enumerate(rotation_vector(data.qpos[at : at + 4])):
                rate, damping = data.qvel[dof + number], model.dof_damping[dof + number]
                yield JointAxis(kind, False, float(turn), float(rate), float(damping))
            return
        limited = bool(model.jnt_limited[joint])
        yield JointAxis(kind, limited, float(data.qpos[at]), float(data.qvel[dof]), float(model.dof_damping[dof]))

    def frame(self, name: str) -> FrameState | None:
        """A frame of reference: None for the world's, else a model's or a link's; UnknownNameError if it is unknown."""
        if name in _WORLD_FRAMES:
            return None
        is_model = "::" not in name or name in self._models
        return self.model(name) if is_model else self.link(name)

    def model_of_link(self, name: str) -> str:
        """The boat, object or dock whose own frame is this link; UnknownNameError or CommandError without one."""
        check_name("link", name, self._links)
        if self._links[name] not in self._singles:
            raise CommandError(f"the link '{name}' has a parent link: only a model's first link can be placed")
        return self._singles[self._links[name]]

    def _place_of(self, index: int) -> FrameState:
        data, velocity = self._data, np.empty(6)
        mujoco.mj_objectVelocity(self._sim.model, data, mujoco.mjtObj.mjOBJ_XBODY, index, velocity, 0)
        return FrameState(data.xpos[index].copy(), data.xquat[index].copy(), velocity[3:], velocity[:3])

    def _refresh(self) -> None:
        own, data, model = self._sim.data, self._data, self._sim.model
        if np.array_equal(data.qpos, own.qpos) and np.array_equal(data.qvel, own.qvel) and self._then == own.time:
            return
        data.qpos[:], data.qvel[:], self._then = own.qpos, own.qvel, own.time
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_comVel(model, data)


class InitialPoses:
    """Poses by name, each from when its body was first seen."""

    def __init__(self, sim: Simulation) -> None:
        self._sim = sim
        self._boats: dict[str, FloatArray] = {}
        self._objects: dict[str, FloatArray] = {}
        self.bind()

    def bind(self) -> None:
        """Boats came or went."""
        seen = self._sim.observe()
        self._boats = {name: self._boats.get(name, _pose(seen[name])) for name in self._sim.boats}
        names = [item.name for item in self._sim.world.parameters.objects if item.kind != "static"]
        afloat = {name: place for name in names if (place := self._object(name)) is not None}
        self._objects = {name: self._objects.get(name, place) for name, place in afloat.items()}

    def put_back(self) -> None:
        """Put everything that moved where it started, at rest; boats that their task holds stay where it does."""
        task = self._sim.task
        held = {task["boat"]} if task is not None and task["state"] == "initial" else set()
        for name, pose in self._boats.items():
            if name not in held:
                self._sim.set_boat(name, pose=pose.tolist(), velocity=_NO_VELOCITY)
        for name, pose in self._objects.items():
            now = self._object(name)
            if now is not None and np.abs(now - pose).max() > _MIN_MOVE:
                self._sim.set_object(name, pose=pose.tolist(), velocity=_NO_VELOCITY)

    def _object(self, name: str) -> FloatArray | None:
        try:
            return _pose(self._sim.observe_object(name))
        except VrxError:
            return None


def _pose(seen: BoatObservation) -> FloatArray:
    return np.array([*seen.position, seen.roll, seen.pitch, seen.heading])


def _joint_name(name: str, boats: Collection[str]) -> str:
    """Gazebo's name of a joint: `raft::hinge` for its axis `raft/hinge/axis` in the MJCF."""
    whole, _, last = name.rpartition("/")
    return _link_name(whole if last in _JOINT_SUFFIXES else name, boats)


def _gazebo(name: str) -> str:
    """A name of ours, as `buoys/red_0`, as Gazebo has it."""
    return name.replace("/", "::")


def _model_names(name: str) -> Iterator[str]:
    """Gazebo's names of the models in which an object is, from the outermost on, and of itself."""
    steps = name.split("/")
    return ("::".join(steps[: count + 1]) for count in range(len(steps)))


def _link_name(body: str, boats: Collection[str]) -> str:
    """`wamv::wamv/base_link` for a boat's link, `gate::red::link` for the others."""
    owner = body.partition("/")[0]
    return f"{owner}::{body}" if owner in boats else body.replace("/", "::")


def collision_name(model: mujoco.MjModel, geom: int, boats: Collection[str]) -> str:
    """Gazebo's name of a shape, as `wamv::wamv/base_link::collision`."""
    link = _link_name(model.body(int(model.geom_bodyid[geom])).name, boats)
    return f"{link}::{model.geom(geom).name.rpartition('/')[2] or 'collision'}"


def pose_message(placed: FrameState) -> Message:
    """Message geometry_msgs/Pose of a frame."""
    position = kind("geometry_msgs/Point")(*placed.position.tolist())
    w, x, y, z = placed.quaternion.tolist()
    return kind("geometry_msgs/Pose")(position, kind("geometry_msgs/Quaternion")(x, y, z, w))


def twist_message(placed: FrameState) -> Message:
    """geometry_msgs/Twist, in the world's axes as Gazebo's."""
    three = kind("geometry_msgs/Vector3")
    return kind("geometry_msgs/Twist")(three(*placed.velocity.tolist()), three(*placed.spin.tolist()))


def odometry(
    time: float, child: str, position: FloatArray, quaternion: FloatArray, velocity: FloatArray, spin: FloatArray,
    variance: float = 0.0,
) -> Message:  # fmt: skip
    """nav_msgs/Odometry of the frame `child` in `map`; `variance` is that of the twist [m2/s2, rad2/s2]."""
    return new(
        "nav_msgs/Odometry",
        header=header(time, "map"),
        child_frame_id=child,
        pose={"pose": {"position": position, "orientation": quaternion}},
        twist={"twist": {"linear": velocity, "angular": spin}, "covariance": variance * np.eye(6)},
    )


def header(time: float, frame: str = "") -> Message:
    """std_msgs/Header of a moment [s]."""
    return new("std_msgs/Header", stamp=stamp(time), frame_id=frame)


class Scenery:
    """Scenery of a world for viewers, kept while boats, objects and docks come and go."""

    def __init__(self, first: Parameters, boats: Collection[str] = ()) -> None:
        """Begin in a world; `boats`: those that are known already, in the order in which they came."""
        places = [(*boat.pose[:2], 0.0) for boat in first.boats] or [(0.0, 0.0, 0.0)]
        self.start: FloatArray = _START_STEP * np.round(np.mean(places, axis=0) / _START_STEP)
        """Position (3,) of the frame `start` in `map` [m]: amid the boats that there were at first."""
        self.markers: tuple[Sequence[str], Message] | None = None
        """Names of the objects and docks that were drawn, and what of them."""
        self.ground: Mapping[str, Any] | None = None
        """Shore, docks and objects of the chart."""
        self._roster = dict.fromkeys(boats)

    def colors(self, now: Parameters) -> Mapping[str, Rgb]:
        """The colours of the boats that there have been until now."""
        self._roster |= dict.fromkeys(boat.name for boat in now.boats)
        return boat_colors(self._roster, now.boats)


CmdVel = Literal["thrust", "velocity", "off"]
"""Meaning of `cmd_vel`: shares of full thrust as VRX's twist2thrust, a velocity that a loop keeps, or nothing."""


BoatOutputs = Callable[[str], Iterable[Output]]
"""Gives topics of a boat."""


class Host(Protocol):
    """A simulation that is served."""

    sim: Simulation
    bodies: Bodies
    scenery: Scenery
    applied: AppliedForces
    steering: Steering
    diagnosis: Diagnosis
    further: BoatOutputs
    """Gives topics of a boat that not every host has."""
    update_rate: float
    """Physics steps per second of wall time that are asked for; 0: as many as possible."""
    cmd_vel: CmdVel
    truth: bool
    """Whether `/tf` has the true poses of boats."""
    paused: bool

    @property
    def observation(self) -> Observation:
        """Observation of the boats at the present moment, made once for it."""

    @property
    def pace(self) -> float:
        """Simulated seconds per second, as kept lately."""

    @property
    def sensor_load(self) -> Mapping[tuple[str, str], float]:
        """Share of wall time that each sensor that is listened to takes, by boat and sensor."""

    def description(self, boat: str) -> str:
        """A boat's URDF; a VrxError where the files that it was made of are not here."""

    def is_published(self, thrusters: Sequence[Input], cmd_vel: str) -> bool:
        """Whether somebody publishes one of a boat's thrusters' topics; told once, as its `cmd_vel` is left alone."""

    def command(self, boat: str, commands: Mapping[str, float]) -> None:
        """Command thrusters, as `Simulation.command`."""

    def push(self, boat: str, thruster: str, force: float) -> None:
        """Command a thruster to push with a force [N] until its next command, as VRX 3's do."""

    def spawn(self, name: str, urdf: str, pose: Sequence[float]) -> None:
        """Put a boat of this URDF into the world, at (x, y, z, roll, pitch, yaw) [m, rad, ENU]."""

    def spawn_object(self, name: str, sdf: str, pose: Sequence[float]) -> str:
        """Put the model of an SDF text into the world, likewise; what it is here, in words."""

    def remove(self, name: str) -> None:
        """Take a boat, an object or a dock out of it."""

    def note_move(self) -> None:
        """Take note that something was put somewhere."""

    def reset_world(self) -> None:
        """Put everything back where it started; time goes on."""

    def reset_simulation(self) -> None:
        """Begin again at time 0."""

    def step(self, duration: float) -> None:
        """Advance by a duration [s], paused or not."""
