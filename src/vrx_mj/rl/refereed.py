"""One world with a referee, as a batch of one row, run by a `Simulation`."""

import numpy as np

from vrx_mj.arrays import BoolArray, FloatArray, IntArray
from vrx_mj.errors import DivergedError
from vrx_mj.mjcf.world import World
from vrx_mj.model.boats import Thruster
from vrx_mj.physics.tables import Table
from vrx_mj.runtime.batch import Batch
from vrx_mj.runtime.commands import ANGLE
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.sensors.sea import wave_table

_HEIGHT = 0.1
"""Height of a boat's origin over the water where it joins [m]."""


class RefereedRow:
    """A row whose boats are scored. Names and meanings are those of `vrx_mj.Batch`; there is no row but 0."""

    n = 1

    def __init__(self, world: World) -> None:
        self.world, self.sim = world, Simulation(world)
        self.diverged: BoolArray = np.zeros(1, np.bool_)
        known = {(world.boats[each.hull], each.name): each for each in world.parameters.thrusters}
        given = [(boat, name) for boat in self.boats for name in self.sim.command_names(boat)]
        limits = {channel: _limits(known, *channel) for channel in given}
        useful = [channel for channel in given if any(limits[channel])]  # a fixed thruster's angle changes nothing
        self.channels = tuple(sorted(useful, key=lambda channel: channel[1].endswith(ANGLE)))
        self.largest = np.array([limits[channel] for channel in self.channels])

    @property
    def boats(self) -> tuple[str, ...]:
        """Names of the boats."""
        return self.sim.boats

    @property
    def features(self) -> FloatArray:
        """(1, boats, 13): position, quaternion, velocity and angular velocity of every boat."""
        seen = self.sim.observe()
        parts = (
            (seen[boat].position, seen[boat].quaternion, seen[boat].velocity, seen[boat].angular_velocity)
            for boat in self.boats
        )
        return np.array([[np.concatenate(part) for part in parts]])

    @property
    def wind(self) -> FloatArray:
        """(1, 2): the wind's velocity [m/s], along x and y."""
        return np.asarray(self.sim.wind.velocity(self.sim.time))[None, :2]

    @property
    def time(self) -> FloatArray:
        """(1,) [s]."""
        return np.array([self.sim.time])

    @property
    def qpos(self) -> FloatArray:
        """(1, nq): the positions of MuJoCo's model."""
        return np.asarray(self.sim.data.qpos)[None]

    def waves(self, row: int) -> Table:
        """Waves of the world's sea, `tables.WAVE`."""
        return wave_table(self.world.parameters.sea, self.sim.seed)

    def sea_height(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Height [m] of the sea at points x, y, (1, points) [m], now."""
        return np.asarray(self.sim.sea.height(x, y, self.sim.time))

    def afloat(self, boat: str, places: FloatArray, rows: IntArray) -> tuple[FloatArray, FloatArray]:
        """Poses and velocities, (rows, 6), of a boat at x, y and yaw, (rows, 3), as high as VRX spawns it."""
        x, y, yaw = places.T
        none, height = np.zeros_like(x), self.sim.sea.height(x, y, self.sim.time) + _HEIGHT
        return np.stack((x, y, height, none, none, yaw), axis=1), np.zeros((len(x), 6))

    def reset(self, rows: IntArray, *, seed: list[int]) -> None:
        """Go back to the start."""
        if len(rows):
            self.diverged[:] = False
            self.sim.reset(seed[0])

    def step(self, values: FloatArray, *, duration: float, rows: IntArray) -> None:
        """Advance under commands (rows, channels)."""
        if not len(rows):
            return
        commands: dict[str, dict[str, float]] = {boat: {} for boat in self.boats}
        for (boat, name), value in zip(self.channels, values[0].tolist(), strict=True):
            commands[boat][name] = value
        try:
            self.sim.step(commands, duration=duration)
        except DivergedError:
            self.diverged[:] = True
            raise

    def set_boat(self, boat: str, *, pose: FloatArray, velocity: FloatArray, rows: IntArray) -> None:
        """Put a boat somewhere, moving."""
        if len(rows):
            self.sim.set_boat(boat, pose=pose[0].tolist(), velocity=velocity[0].tolist())


def _limits(known: dict[tuple[str, str], Thruster], boat: str, name: str) -> tuple[float, float]:
    """The least and the greatest command that changes anything."""
    thruster = known.get((boat, name))
    if thruster is None:
        greatest = known[boat, name.removesuffix(ANGLE)].max_angle
        return -greatest, greatest
    return thruster.command_limits


Rows = Batch | RefereedRow
"""What an environment advances."""
