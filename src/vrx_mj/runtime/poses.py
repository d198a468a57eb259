"""Poses and velocities of the boats and objects of a `Simulation`, and the forces on them."""

import contextlib
from collections.abc import Iterator, Sequence

from vrx_mj.arguments import check_name
from vrx_mj.errors import CommandError
from vrx_mj.mjcf.world import World
from vrx_mj.runtime.bodies import FreeBodies
from vrx_mj.runtime.forces import Forces, boat_forces
from vrx_mj.runtime.observation import BoatObservation
from vrx_mj.runtime.rig import Rig
from vrx_mj.runtime.state import State
from vrx_mj.runtime.turns import Turn, in_turn
from vrx_mj.runtime.weather import Sea

__all__ = ["Poses"]


class Poses:
    """The part of a simulation that sets and returns poses and velocities of boats and objects."""

    _world: World
    _rig: Rig
    _sea: Sea
    _bodies: FreeBodies
    _turn: Turn

    @in_turn
    def set_boat(
        self,
        name: str,
        *,
        pose: Sequence[float] | None = None,
        velocity: Sequence[float] | None = None,
    ) -> None:
        """Set the pose or the velocity of a boat; what is not given is kept.

        Args:
            name: name of the boat.
            pose: (x, y, z, roll, pitch, yaw) of its `base_link` origin [m, rad, ENU].
            velocity: (u, v, w, p, q, r) of that origin [m/s, rad/s], body axes.

        Raises:
            UnknownNameError: no boat has that name.
            CommandError: the pose or the velocity is not six finite numbers, or there are too many contacts there.
        """
        check_name("boat", name, self._world.boats)
        with self._unless_crowded():
            self._bodies.put(name, pose, velocity)
            if pose is not None:
                self.release(name)
            self._derive()

    @in_turn
    def release(self, boat: str) -> None:
        """Release a boat that its task holds, as `set_boat` with a pose does; a free boat is not changed."""
        check_name("boat", boat, self._world.boats)
        self._rig.release(boat)

    @in_turn
    def set_object(
        self,
        name: str,
        *,
        pose: Sequence[float] | None = None,
        velocity: Sequence[float] | None = None,
    ) -> None:
        """Set the pose or the velocity of a floating object or of the frame of a floating dock, as `set_boat` does.

        Raises:
            UnknownNameError: no floating object or dock has that name.
            CommandError: the pose or the velocity is not six finite numbers, or there are too many contacts there.
        """
        check_name("floating object", name, self._bodies.afloat)
        with self._unless_crowded():
            self._bodies.put(name, pose, velocity)
            self._derive()
        self._bodies.set_afloat(name, lambda x, y: float(self._sea.height(x, y, self._rig.data.time)))

    def observe_object(self, name: str) -> BoatObservation:
        """Pose and velocity of a floating object's link, or of the frame of a floating dock's drawing.

        UnknownNameError if no floating object or dock has that name.
        """
        with self._turn.crew:
            check_name("floating object", name, self._bodies.afloat)
            return self._bodies.observe(name)

    @in_turn
    def forces(self, boat: str) -> Forces:
        """Forces on a boat in the next step, by name of the effect: force and torque, (6,).

        Forces [N] and torques [N m] are in world axes, about the boat's centre of mass. Their sum is all
        external loads except contacts; inertial effects are in `.inertial`. UnknownNameError if no
        boat has that name.
        """
        check_name("boat", boat, self._world.boats)
        return boat_forces(self._rig, self._world.boats.index(boat), float(self._rig.data.time))

    @contextlib.contextmanager
    def _unless_crowded(self) -> Iterator[None]:
        """Around what moves bodies by hand: it is undone if they cannot be there."""
        before = self._moment()
        try:
            yield
        except CommandError:
            self._restore(before)
            raise

    def _moment(self) -> State:
        """The present state."""
        raise NotImplementedError

    def _restore(self, state: State) -> None:
        """Go back to a state."""
        raise NotImplementedError

    def _derive(self) -> None:
        """Make what follows from the state follow it."""
        raise NotImplementedError
