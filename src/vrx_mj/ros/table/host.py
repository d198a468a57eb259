"""What the table's functions may do: the simulation, and what serves it."""

from collections.abc import Mapping, Sequence
from typing import Literal, Protocol

from vrx_mj.ros.table.bodies import Bodies
from vrx_mj.runtime.observation import Observation
from vrx_mj.runtime.simulation import Simulation

__all__ = ["CmdVel", "Host"]

CmdVel = Literal["thrust", "velocity"]
"""What `cmd_vel` commands: shares of full thrust as VRX's twist2thrust, or a velocity that a closed loop keeps."""


class Host(Protocol):
    """A simulation that is served."""

    sim: Simulation
    bodies: Bodies
    cmd_vel: CmdVel
    truth: bool
    """Whether `/tf` tells where boats really are."""
    paused: bool

    @property
    def seen(self) -> Observation:
        """What boats see at the present moment, made once for it."""

    @property
    def pace(self) -> float:
        """Simulated seconds per second, as kept lately."""

    @property
    def sensor_load(self) -> Mapping[tuple[str, str], float]:
        """Share of wall time that each sensor that is listened to takes, by boat and sensor."""

    def description(self, boat: str) -> str:
        """A boat's URDF; a VrxError where the files that it was made of are not here."""

    def command(self, boat: str, commands: Mapping[str, float]) -> None:
        """Command thrusters, as `Simulation.command`."""

    def push(self, boat: str, thruster: str, force: float) -> None:
        """Have a thruster push with a force [N] until it is told otherwise, as VRX 3's do."""

    def steer(self, boat: str, surge: float, turn: float) -> None:
        """Have a boat keep a speed ahead [m/s] and a turning rate [rad/s], for a second."""

    def form(self, text: str) -> None:
        """Have the fleet keep a formation, or go to another one."""

    def spawn(self, name: str, urdf: str, pose: Sequence[float]) -> None:
        """Put a boat of this URDF into the world, at (x, y, z, roll, pitch, yaw) [m, rad, ENU]."""

    def remove(self, name: str) -> None:
        """Take a boat out of it."""

    def moved(self) -> None:
        """Something was put somewhere."""

    def reset_world(self) -> None:
        """Put everything back where it started; time goes on."""

    def reset_simulation(self) -> None:
        """The same, and begin at time 0."""

    def step(self, duration: float) -> None:
        """Advance by a duration [s], paused or not."""
