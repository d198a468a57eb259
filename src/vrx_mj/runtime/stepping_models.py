"""The models that step: a world without visuals, and its contact-free twin, which steps while nothing can touch.

Where contacts need more memory than there is, MuJoCo ends the process, so bodies that overlap that much are refused. A
`Simulation` has memory for heaps of bodies. Rows of a batch, of which there are thousands, have it for the contacts of
each two things that can touch, and at most what MuJoCo chooses, which is 13 MB of address space and more.
"""

import copy
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache

import mujoco
import numpy as np

from vrx_mj.arrays import BoolArray, FloatArray, IntArray
from vrx_mj.errors import CommandError, CompileError
from vrx_mj.mjcf.pieces import Detail, Pieces
from vrx_mj.mjcf.world import World

_PER_THING, _MAX_MEMORY = 4 << 20, 1 << 30
"""Address space for contacts and solver for each thing that was placed in a world, and at most [bytes]; memory is used
as it is needed."""
_MIN_MEMORY = 32 << 20
"""Below this size [bytes] MuJoCo's own choice is kept."""
PER_CONTACT = 6000
"""Memory that a contact needs with its constraints [bytes]: 2800 with 20 boats on one spot, and as much to spare."""

IDLE, PER_DOF_PAIR = 256 << 10, 128
"""Memory of a world in which nothing touches, and for each pair of degrees of freedom [bytes]: MuJoCo uses 216 bytes
with one boat and 3,700 with twenty, which have 120 degrees of freedom."""
_PAIR_CONTACTS, _SHAPE_CONTACTS = 8, 16
"""Contacts of two shapes, boxes at most, and in mean of each shape of two things within each other. Two WAM-Vs of 33
shapes each on one spot make 149 contacts at most, of 20,000 positions, and one within the 22 blocks of a dock 87."""
_COUNTED_SHAPES = [
    int(kind)
    for kind in (
        mujoco.mjtGeom.mjGEOM_SPHERE, mujoco.mjtGeom.mjGEOM_CAPSULE, mujoco.mjtGeom.mjGEOM_ELLIPSOID,
        mujoco.mjtGeom.mjGEOM_CYLINDER, mujoco.mjtGeom.mjGEOM_BOX, mujoco.mjtGeom.mjGEOM_MESH,
    )
]  # fmt: skip
"""Shapes of which it is known how many contacts two make, of a mesh at most four; others keep MuJoCo's own choice."""

_CLOSE_DISTANCE, FEW_BOATS = 10.0, 4
"""Where more boats than this number are within this distance of each other [m], their contacts are counted when one is
placed."""
_DETAILS = (Detail.WITHOUT_VISUALS, Detail.CONTACT_FREE)
"""Details of the two models of a run."""
_MAX_CACHED = 4 << 20
"""Size of a model [bytes] above which it is not kept for the next run of its world."""


def arena_bytes(things: int) -> int:
    """Memory for contacts and solver of a world in which so many things were placed; -1: what MuJoCo chooses."""
    wanted = min(_MAX_MEMORY, _PER_THING * things)
    return wanted if wanted > _MIN_MEMORY else -1


def row_arena_bytes(model: mujoco.MjModel) -> int:
    """Memory for contacts and solver of a world as a row of a batch: several times what was ever seen to be needed.

    It is at most what its model has now, and that where shapes have contacts that are not bounded.
    """
    touching = (model.geom_contype | model.geom_conaffinity) != 0
    if model.npair or model.nflex or not np.isin(model.geom_type[touching], _COUNTED_SHAPES).all():
        return int(model.narena)
    contacts = sum(_pair_contacts(model, one, other) for one, other in _pairs(model, touching))
    wanted = IDLE + PER_DOF_PAIR * model.nv**2 + PER_CONTACT * contacts
    return min(int(wanted), int(model.narena))


def _pairs(model: mujoco.MjModel, touching: BoolArray) -> Iterator[tuple[BoolArray, BoolArray]]:
    """Shapes of each two things, moving trees or what is fixed, and of each tree with parts that may touch."""
    welded = model.body_weldid[model.geom_bodyid]
    thing = np.where(welded == 0, 0, model.body_rootid[model.geom_bodyid])
    things = [touching & (thing == root) for root in np.unique(thing[touching])]
    for number, one in enumerate(things):
        if len(np.unique(welded[one])) > 1:
            yield one, one
        for other in things[:number]:
            yield one, other


def _pair_contacts(model: mujoco.MjModel, one: BoolArray, other: BoolArray) -> int:
    """Contacts of two things for which there is room, by the numbers of their shapes."""
    kinds, masks = (np.bitwise_or.reduce(values[one]) for values in (model.geom_contype, model.geom_conaffinity))
    if not ((kinds & model.geom_conaffinity[other]) | (masks & model.geom_contype[other])).any():
        return 0
    here, there = int(one.sum()), int(other.sum())
    return min(_PAIR_CONTACTS * here * there, _SHAPE_CONTACTS * (here + there))


def most_contacts(model: mujoco.MjModel) -> int:
    """Contacts with which a run goes on."""
    return int(model.narena) // PER_CONTACT


def crowding_message(contacts: int) -> str:
    """Message for bodies with so many contacts."""
    return f"too many contacts at one place, {contacts}: place the bodies farther apart"


@contextmanager
def fitting(data: mujoco.MjData) -> Iterator[None]:
    """Context for functions of MuJoCo's that find contacts.

    Raises:
        CommandError: there are more contacts than fit into the memory.
    """
    try:
        yield
    except mujoco.FatalError as error:
        raise CommandError(crowding_message(int(data.ncon))) from error


def check_room(model: mujoco.MjModel, qpos: FloatArray, starts: IntArray) -> None:
    """Refuse positions (rows, nq), in which boats' places are from these columns on, with too many contacts.

    Raises:
        CommandError: there are more contacts than fit into the memory.
    """
    if len(starts) <= FEW_BOATS:
        return
    scratch = mujoco.MjData(model)
    for row in qpos:
        x, y = row[starts], row[starts + 1]
        if (np.hypot(x[:, None] - x, y[:, None] - y) < _CLOSE_DISTANCE).sum(axis=0).max() <= FEW_BOATS:
            continue
        scratch.qpos[:] = row
        with fitting(scratch):
            mujoco.mj_fwdPosition(model, scratch)
        if scratch.ncon > most_contacts(model):
            raise CommandError(crowding_message(scratch.ncon))


@lru_cache(maxsize=16)
def _shared_models(digest: str, roomy: bool) -> list[mujoco.MjModel]:
    """A place for the stepping models of a world, by its pieces' digest."""
    return []


def stepping_models(world: World) -> tuple[mujoco.MjModel, mujoco.MjModel]:
    """The model that steps, without anything that is only seen, and its contact-free twin, which has no shapes.

    The twin steps the same data while nothing can touch anything. The models have the memory for contacts that their
    shapes can need (`row_arena_bytes`): thousands of rows may have data of them.

    Raises:
        CompileError: MuJoCo cannot compile the saved world.
    """
    return PhysicsModels(roomy=False).models(world)


class PhysicsModels:
    """The stepping models of a world, and of those that it becomes as boats come and go.

    The specs are kept: attaching a boat to them is faster than reading all the rest again. Deleting one is not.
    """

    def __init__(self, *, roomy: bool = True) -> None:
        """`roomy`: whether there is memory for heaps of what was placed, as a `Simulation` has it but no row."""
        self._roomy = roomy
        self._kept: tuple[Pieces, list[mujoco.MjSpec]] | None = None

    def models(self, world: World) -> tuple[mujoco.MjModel, mujoco.MjModel]:
        """The models of `stepping_models`, sooner if the world only has something more than the one before.

        Raises:
            CompileError: MuJoCo cannot compile the saved world.
        """
        known, first = _shared_models(world.pieces.digest, self._roomy), self._kept is None
        if known and first:
            return copy.copy(known[0]), copy.copy(known[1])
        try:
            specs = self._specs(world.pieces)
            collision, contact_free = (self._compile(spec, len(world.pieces.parts)) for spec in specs)
        except ValueError as error:
            raise CompileError(f"MuJoCo cannot compile the saved world {world.name}: {error}") from error
        self._kept = world.pieces, specs
        if first and collision.nbuffer < _MAX_CACHED:
            known[:] = copy.copy(collision), copy.copy(contact_free)
        return collision, contact_free

    def _specs(self, pieces: Pieces) -> list[mujoco.MjSpec]:
        kept, self._kept = self._kept, None
        if kept and all(
            pieces.grow_spec(spec, kept[0], detail) for spec, detail in zip(kept[1], _DETAILS, strict=True)
        ):
            return kept[1]
        return [pieces.spec(detail) for detail in _DETAILS]

    def _compile(self, spec: mujoco.MjSpec, parts: int) -> mujoco.MjModel:
        spec.memory = arena_bytes(parts) if self._roomy else -1
        if not self._roomy:
            spec.memory = row_arena_bytes(spec.compile())
        return spec.compile()
