"""Wrenches on bodies and efforts at joints that callers apply for a while, beside those of water, wind and engines."""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import mujoco
import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.constants import EARLY
from vrx_mj.errors import CommandError
from vrx_mj.runtime.simulation import Simulation

MAX_ACCELERATION = 100.0
"""Largest acceleration by all applied forces together [m/s2, rad/s2], with mass and inertia without those of water."""
MAX_SPEED = 10.0
"""Speed [m/s, rad/s] beyond which a body is not pushed on: a state that diverges would end the run."""
MAX_FORCES = 256
"""Largest number of forces that are applied or wait."""


class AppliedForce(NamedTuple):
    """A wrench on a body, or an effort at a joint, for a while."""

    title: str
    """Name of what it acts on, for people."""
    body: str
    """MuJoCo's name of a body; empty: a joint has the effort."""
    joint: str
    """MuJoCo's name of a joint with one axis, or empty."""
    values: FloatArray
    """(6,) force [N] and torque [N m] about the body's centre of mass, world axes; (1,) effort [N m, of a slide N]."""
    begins: float
    ends: float
    """Simulated times [s]."""


class AppliedForces:
    """The forces that callers apply, each at its steps; nothing of them is left in MuJoCo's state."""

    def __init__(self, sim: Simulation, report: Callable[[str, str], None]) -> None:
        """Start without forces; `report` takes a level and a line of text."""
        self._sim, self._report = sim, report
        self._forces: list[AppliedForce] = []
        self.bind()

    def bind(self) -> None:
        """Boats or objects came or went: what acts on those that left ends."""
        model = self._sim.model
        self._scratch = mujoco.MjData(model)
        bodies = {"", *(str(model.body(index).name) for index in range(model.nbody))}
        joints = {"", *(str(model.joint(index).name) for index in range(model.njnt))}
        self._end([one for one in self._forces if one.body not in bodies or one.joint not in joints], "it left")

    def add(self, force: AppliedForce) -> None:
        """Apply one from its beginning on, at the soonest from now on, for a step at least.

        Raises:
            CommandError: it is not finite, too strong, or acts on what cannot move; there are too many.
        """
        if not (np.isfinite(force.values).all() and math.isfinite(force.begins) and not math.isnan(force.ends)):
            raise CommandError(f"invalid force on {force.title}: finite numbers are needed")
        if len(self._forces) >= MAX_FORCES:
            raise CommandError(f"{MAX_FORCES} forces are already applied")
        self._refresh()
        asked = self._accelerations([*self._forces, force])
        moved = asked[-1] != 0.0
        if not moved.any() and force.values.any():
            raise CommandError(f"{force.title} cannot move")
        strongest = np.abs(asked[:, moved]).sum(axis=0).max(initial=0.0)
        if not strongest <= MAX_ACCELERATION:
            most = f"at most {MAX_ACCELERATION:g} m/s^2 or rad/s^2 are allowed"
            raise CommandError(f"the force would accelerate {force.title} by {strongest:.3g}: {most}")
        begins = max(force.begins, self._sim.time)
        ends = max(force.ends + begins - force.begins, begins + self._sim.timestep)
        self._forces.append(force._replace(begins=begins, ends=ends))

    def clear(self, *, body: str = "", joint: str = "") -> None:
        """End the wrenches on a body, or the efforts at a joint."""
        self._forces = [one for one in self._forces if (one.joint if joint else one.body) != (joint or body)]

    def begin(self) -> None:
        """Time began anew: end all."""
        self._forces.clear()

    def advance(self, steps: int) -> None:
        """Advance by a number of physics steps, as `Simulation.advance`."""
        while steps > 0 and self._forces:
            self._step()
            steps -= 1
        self._sim.advance(steps)

    def _step(self) -> None:
        time, data = self._sim.time + EARLY, self._sim.data
        self._forces = [one for one in self._forces if time < one.ends]
        self._refresh()
        push = np.zeros(self._sim.model.nv)
        for one in [one for one in self._forces if time >= one.begins]:
            own = self._generalized_force(one)
            if (np.abs(data.qvel[own != 0.0]) > MAX_SPEED).any():
                self._end([one], f"it is faster than {MAX_SPEED:g} m/s or rad/s")
            else:
                push += own
        before = data.qfrc_applied.copy()
        data.qfrc_applied += push
        try:
            self._sim.advance(1)
        finally:
            self._sim.data.qfrc_applied[push != 0.0] = before[push != 0.0]

    def _end(self, forces: Sequence[AppliedForce], why: str) -> None:
        self._forces = [one for one in self._forces if not any(one is ended for ended in forces)]
        for one in forces:
            self._report("WARN", f"the force on {one.title} ends: {why}")

    def _refresh(self) -> None:
        """Compute frames of the present moment: those of steps are one step old."""
        self._scratch.qpos[:] = self._sim.data.qpos
        mujoco.mj_kinematics(self._sim.model, self._scratch)
        mujoco.mj_comPos(self._sim.model, self._scratch)

    def _accelerations(self, forces: Sequence[AppliedForce]) -> FloatArray:
        """Accelerations by each of them alone, (n, nv)."""
        pushes = np.array([self._generalized_force(one) for one in forces])
        asked = np.empty_like(pushes)
        mujoco.mj_makeM(self._sim.model, self._scratch)
        mujoco.mj_factorM(self._sim.model, self._scratch)
        mujoco.mj_solveM(self._sim.model, self._scratch, asked, pushes)
        return asked

    def _generalized_force(self, force: AppliedForce) -> FloatArray:
        """A force as one on MuJoCo's degrees of freedom, (nv,)."""
        model, push = self._sim.model, np.zeros(self._sim.model.nv)
        if force.joint:
            push[model.jnt_dofadr[model.joint(force.joint).id]] = force.values[0]
            return push
        body = model.body(force.body).id
        center, (linear, angular) = self._scratch.xipos[body], force.values.reshape(2, 3)
        mujoco.mj_applyFT(model, self._scratch, linear, angular, center, body, push)
        return push
