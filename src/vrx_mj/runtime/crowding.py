"""Bodies that overlap in more contacts than MuJoCo has memory for: it ends the process, so they are refused before."""

from collections.abc import Iterator
from contextlib import contextmanager

import mujoco
import numpy as np
import numpy.typing as npt

from vrx_mj.errors import CommandError

__all__ = ["arena_bytes", "check_room", "crowded", "fitting", "most_contacts"]

PER_THING, MOST = 4 << 20, 1 << 30
"""Address space for contacts and solver for each thing that was placed in a world, and at most [bytes]; memory is used
as it is needed."""
LEAST = 32 << 20
"""Where it would be less [bytes], MuJoCo's own choice is kept."""
PER_CONTACT = 6000
"""Memory that a contact needs with its constraints [bytes]: 2800 with 20 boats on one spot, and as much to spare."""

CLOSE, FEW = 10.0, 4
"""Where more boats than these few are so near to each other [m], their contacts are counted when one is placed."""


def arena_bytes(things: int) -> int:
    """Memory for contacts and solver of a world in which so many things were placed; -1: what MuJoCo chooses."""
    wanted = min(MOST, PER_THING * things)
    return wanted if wanted > LEAST else -1


def most_contacts(model: mujoco.MjModel) -> int:
    """Contacts with which a run goes on."""
    return int(model.narena) // PER_CONTACT


def crowded(contacts: int) -> str:
    """Message for bodies with so many contacts."""
    return f"too many contacts at one place, {contacts}: place the bodies further apart"


@contextmanager
def fitting(data: mujoco.MjData) -> Iterator[None]:
    """Around functions of MuJoCo's that find contacts.

    Raises:
        CommandError: there are more contacts than fit into the memory.
    """
    try:
        yield
    except mujoco.FatalError as error:
        raise CommandError(crowded(int(data.ncon))) from error


def check_room(model: mujoco.MjModel, qpos: npt.NDArray[np.float64], starts: npt.NDArray[np.int64]) -> None:
    """Refuse positions (rows, nq), in which boats' places are from these columns on, with too many contacts.

    Raises:
        CommandError: there are more contacts than fit into the memory.
    """
    if len(starts) <= FEW:
        return
    scratch = mujoco.MjData(model)
    for row in qpos:
        x, y = row[starts], row[starts + 1]
        if (np.hypot(x[:, None] - x, y[:, None] - y) < CLOSE).sum(axis=0).max() <= FEW:
            continue
        scratch.qpos[:] = row
        with fitting(scratch):
            mujoco.mj_fwdPosition(model, scratch)
        if scratch.ncon > most_contacts(model):
            raise CommandError(crowded(scratch.ncon))
