"""A simulation and a batch under random commands, and what must hold meanwhile."""

import math
import random
from collections import Counter
from dataclasses import dataclass, field
from typing import Any

import mujoco
import numpy as np

from vrx_mj import Batch, Simulation
from vrx_mj.errors import DivergedError, VrxError

ROWS = 8
"""Of a batch."""
LONGEST = 400
"""Steps of a stretch."""
CONTACTS = 5000
"""More than boats, docks and buoys can have."""
_KINDS = mujoco.mjtWarning
SILENT = [int(kind) for kind in (_KINDS.mjWARN_BADQPOS, _KINDS.mjWARN_BADQVEL, _KINDS.mjWARN_BADQACC)]
"""MuJoCo's warnings after which it would have reset the state, with its flag `autoreset`."""


@dataclass
class Log:
    """What a trip came to."""

    world: str
    kind: str
    counts: Counter[str] = field(default_factory=Counter)
    """Boat-steps, and how often each thing was done or raised."""
    wrong: list[str] = field(default_factory=list)
    contacts: int = 0
    growth: int = 0
    """Memory at the end over that after a third [bytes]."""
    seconds: float = 0.0
    """Processor time."""

    def expect(self, condition: object, what: str) -> None:
        """Note what is wrong, the first few times."""
        if not condition and len(self.wrong) < 10:
            self.wrong.append(f"{self.world} ({self.kind}), after {self.counts['boat-steps']} boat-steps: {what}")


class Voyage:
    """A simulation and what is done to it."""

    def __init__(self, world: Any, seed: int, log: Log, chance: random.Random) -> None:
        self.sim, self.log, self.chance = Simulation(world, seed=seed), log, chance
        self.spawned = 0
        self.kept = self.sim.get_state(), self.sim.boats

    def stretch(self) -> None:
        """Do something at random, then advance under random commands."""
        for call, share in (
            (self.set_boat, 0.05),
            (self.fire, 0.05),
            (self.spawn, 0.01),
            (self.remove, 0.01),
            (self.reset, 0.003),
            (self.set_state, 0.03),
        ):
            if self.chance.random() < share:
                try:
                    call()
                    self.log.counts[call.__name__] += 1
                except VrxError as error:
                    self.log.counts[f"refused: {type(error).__name__}"] += 1
        self.advance()

    def advance(self) -> None:
        """Advance by some steps under commands."""
        sim, steps = self.sim, self.chance.randint(1, LONGEST)
        begun, boats = sim.time, len(sim.boats)
        commands = {
            boat: {name: random_command(name, self.chance) for name in sim.command_names(boat)} for boat in sim.boats
        }
        try:
            sim.step(commands, duration=round(steps * sim.timestep, 9)) if self.chance.random() < 0.5 else self._held(
                commands, steps
            )
        except DivergedError:
            self.log.counts["diverged"] += 1
            sim.reset()
            return
        self.log.counts["boat-steps"] += steps * boats
        self.check(begun + steps * sim.timestep)

    def _held(self, commands: Any, steps: int) -> None:
        self.sim.command_all(commands)
        self.sim.advance(steps)

    def check(self, expected: float) -> None:
        """What must hold after each stretch."""
        sim, log = self.sim, self.log
        finite = np.isfinite(sim.data.qpos).all() and np.isfinite(sim.data.qvel).all()
        log.expect(finite, f"a state at t = {sim.time} that is not finite, and was not raised")
        log.expect(abs(sim.time - expected) < 1e-6 * max(expected, 1.0), f"time {sim.time} instead of {expected}")
        warned = {kind: int(sim.data.warning[kind].number) for kind in SILENT if sim.data.warning[kind].number}
        log.expect(not warned, f"warnings of MuJoCo {warned}")
        log.expect(sim.data.ncon < CONTACTS, f"{sim.data.ncon} contacts")
        log.contacts = max(log.contacts, int(sim.data.ncon))

    def set_boat(self) -> None:
        """Put a boat somewhere near, moving."""
        boat = self.chance.choice(self.sim.boats)
        x, y, z = self.sim.observe()[boat].position
        pose = (
            x + self.chance.uniform(-40, 40),
            y + self.chance.uniform(-40, 40),
            z,
            *(self.chance.uniform(-0.3, 0.3) for _ in range(2)),
            self.chance.uniform(-4, 4),
        )
        self.sim.set_boat(boat, pose=pose, velocity=[self.chance.uniform(-3, 3) for _ in range(6)])

    def fire(self) -> None:
        """Shoot a ball, where there is a shooter."""
        self.sim.fire(self.chance.choice(self.sim.boats))

    def spawn(self) -> None:
        """Have another boat join."""
        x, y, z = self.sim.observe()[self.sim.boats[0]].position
        self.spawned += 1
        self.sim.spawn(
            f"guest{self.spawned}",
            pose=[x + self.chance.uniform(-60, 60), y + self.chance.uniform(-60, 60), z, 0, 0, 0],
        )

    def remove(self) -> None:
        """Have a boat leave, unless it is the last but one."""
        if len(self.sim.boats) > 2:
            self.sim.remove(self.chance.choice(self.sim.boats[1:]))

    def reset(self) -> None:
        """Begin anew with another seed."""
        self.sim.reset(self.chance.randrange(10**6))
        self.kept = self.sim.get_state(), self.sim.boats

    def set_state(self) -> None:
        """Go back to a state, or keep the present one."""
        if self.kept[1] == self.sim.boats and self.chance.random() < 0.5:
            self.sim.set_state(self.kept[0])
        else:
            self.kept = self.sim.get_state(), self.sim.boats


def random_command(name: str, chance: random.Random) -> float:
    """A command: legal, at a limit, or far beyond."""
    if name.endswith("_angle"):
        return chance.choice([0.0, math.pi, -math.pi, chance.uniform(-1, 1), 100.0])
    return chance.choice([-1.0, 1.0, 0.0, chance.uniform(-1, 1), chance.uniform(-1, 1), 10.0, -10.0, 1e6])


class Rows:
    """A batch and what is done to it."""

    def __init__(self, world: Any, seed: int, log: Log, chance: random.Random) -> None:
        self.batch, self.log, self.chance = Batch(world, ROWS, seed=seed, threads=1), log, chance
        self.numbers = np.random.default_rng(seed)

    def stretch(self) -> None:
        """Change some rows, then advance all under random commands."""
        for call, share in ((self.set_boat, 0.05), (self.vary, 0.05), (self.reset, 0.05)):
            if self.chance.random() < share:
                call()
                self.log.counts[call.__name__] += 1
        batch, steps = self.batch, self.chance.randint(1, LONGEST)
        begun, stopped = batch.time, batch.diverged
        commands = np.array([[random_command(name, self.chance) for _, name in batch.channels] for _ in range(ROWS)])
        try:
            batch.step(commands, duration=round(steps * batch.timestep, 9))
            raised = False
        except DivergedError:
            self.log.counts["diverged"] += 1
            raised = True
        going = ~(stopped | batch.diverged)
        self.log.counts["boat-steps"] += steps * len(batch.boats) * int(going.sum())
        self.log.expect(raised or not (batch.diverged & ~stopped).any(), "rows that diverged, and were not raised")
        self.check(going, begun + steps * batch.timestep)
        if batch.diverged.any():
            batch.reset(np.flatnonzero(batch.diverged))

    def check(self, going: Any, expected: Any) -> None:
        """What must hold after each stretch, of the rows that go on."""
        batch, log = self.batch, self.log
        log.expect(
            np.isfinite(batch.qpos[going]).all() and np.isfinite(batch.features[going]).all(),
            "a state that is not finite, and was not raised",
        )
        log.expect(
            (np.abs(batch.time - expected)[going] < 1e-6 * np.maximum(expected[going], 1.0)).all(),
            f"times {batch.time} instead of {expected}",
        )
        for data in (batch._rows._data[row] for row in np.flatnonzero(going)):
            warned = {kind: int(data.warning[kind].number) for kind in SILENT if data.warning[kind].number}
            log.expect(not warned, f"warnings of MuJoCo {warned}")
            log.expect(data.ncon < CONTACTS, f"{data.ncon} contacts")
            log.contacts = max(log.contacts, int(data.ncon))

    def some(self) -> Any:
        """Numbers of some rows."""
        return np.flatnonzero(self.numbers.random(ROWS) < 0.4)

    def set_boat(self) -> None:
        """Put a boat of some rows near where it is."""
        rows, number = self.some(), self.chance.randrange(len(self.batch.boats))
        pose = np.zeros((len(rows), 6))
        pose[:, :3] = self.batch.features[rows, number, :3]
        pose[:, :2] += self.numbers.uniform(-40, 40, (len(rows), 2))
        pose[:, 5] = self.numbers.uniform(-4, 4, len(rows))
        if np.isfinite(pose).all():
            self.batch.set_boat(
                self.batch.boats[number], pose=pose, velocity=self.numbers.uniform(-3, 3, (len(rows), 6)), rows=rows
            )

    def vary(self) -> None:
        """Give some rows another world, from their next reset on."""
        rows = self.some()
        size = len(rows)
        draw = self.numbers.uniform
        self.batch.vary(
            rows,
            wind_speed=draw(0, 15, size),
            wind_direction=draw(-4, 4, size),
            waves=draw(0, 2, size),
            mass=draw(0.7, 1.5, size),
            thrust=draw(0.5, 1.5, size),
        )
        self.batch.reset(rows)

    def reset(self) -> None:
        """Begin some rows anew."""
        rows = self.some()
        self.batch.reset(rows, seed=self.numbers.integers(0, 10**6, len(rows)))
