"""The sensors of a world, from its rows: what they are, what carries them, and where their marks are."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import mujoco

from vrx_mj.arrays import FloatArray
from vrx_mj.mjcf.objects import ball_name
from vrx_mj.mjcf.world import World
from vrx_mj.sensors import SENSOR_KINDS
from vrx_mj.sensors.instruments import SensorKind
from vrx_mj.sensors.readings import Mount, Place, place_of_mount


@dataclass(frozen=True)
class Mounted:
    """A sensor on a boat."""

    boat: str
    """Name of the boat."""
    life: int
    """How many boats of that name there were before."""
    config: Any
    """Its configuration, of the class that its kind has."""
    frame: str
    """Name of the frame of its readings."""
    mount: Mount
    """Place and axes on the body that carries it."""
    body: str
    """MuJoCo's name of the body that carries it."""
    qpos: int
    """Address of that body's free joint in `qpos`."""
    dof: int
    """Address of that joint in `qvel`."""
    mark: int
    """Where its marks begin."""
    ball: int | None
    """Row of its ball among what floats."""

    @property
    def kind(self) -> SensorKind:
        """Record of the sensor's type."""
        return SENSOR_KINDS[self.config.type]

    @property
    def name(self) -> str:
        """Name of the sensor on its boat."""
        return str(self.config.name)

    def place(self, qpos: FloatArray, qvel: FloatArray, mount: Mount | None = None) -> Place:
        """Where it is and how it moves in a state of the world, or another frame on the same body."""
        return place_of_mount(qpos[self.qpos : self.qpos + 7], qvel[self.dof : self.dof + 6], mount or self.mount)

    @property
    def marks(self) -> slice:
        """Where its marks are."""
        return slice(self.mark, self.mark + len(self.kind.start_marks(self.config)))


def mounted_sensors(world: World, model: mujoco.MjModel, known: Sequence[Mounted] = ()) -> tuple[Mounted, ...]:
    """The sensors of a world's boats, in its order; those of boats that were there before are `known`."""
    rows = world.parameters.sensors
    before = {(sensor.boat, sensor.life, sensor.name): sensor for sensor in known}
    lives = {boat.name: boat.life for boat in world.parameters.boats}
    floating = [item.name for item in world.parameters.objects if item.kind == "floating"]
    joints = {body: int(model.body(body).jntadr[0]) for body in {row.body for row in rows}}
    found: list[Mounted] = []
    mark = 0
    for row in rows:
        boat, life = row.boat, lives[row.boat]
        same = before.get((boat, life, row.name))
        joint = joints[row.body]
        name = ball_name(boat, row.name)
        found.append(
            Mounted(
                boat=boat,
                life=life,
                config=row.config,
                frame=row.frame,
                mount=same.mount if same else Mount.of(row.position, row.rotation),
                body=row.body,
                qpos=int(model.jnt_qposadr[joint]),
                dof=int(model.jnt_dofadr[joint]),
                mark=mark,
                ball=floating.index(name) if name in floating else None,
            )
        )
        mark = found[-1].marks.stop
    return tuple(found)


def start_marks(sensors: tuple[Mounted, ...]) -> list[float]:
    """The marks of all sensors at the start of a run."""
    return [mark for sensor in sensors for mark in sensor.kind.start_marks(sensor.config)]
