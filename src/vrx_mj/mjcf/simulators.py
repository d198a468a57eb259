"""MJCF for other simulators that read it, without what they refuse."""

import re
from collections.abc import Mapping
from dataclasses import dataclass

from vrx_mj.arguments import check_name


@dataclass(frozen=True)
class _Omission:
    """A part of our MJCF that a simulator refuses."""

    pattern: str
    """Regular expression of its text."""
    consequence: str
    """What is different without it, as the MJCF's header says it."""


_SLEEP = _Omission(
    r' (?:sleep|sleep_tolerance)="[^"]*"', "sleep: the balls of shooters fall from their places under the ground"
)
_AUTORESET = _Omission(r' autoreset="[^"]*"', "autoreset: a run that diverges may start again")
_TOUCHES = _Omission(r'\s*<contact name="[^"]*"[^<>]*/>', "contact sensors: what the boat of a task touches")


@dataclass(frozen=True)
class Simulator:
    """A program that reads our MJCF."""

    title: str
    """Its name for people."""
    omissions: tuple[_Omission, ...] = ()
    """What is left out for it."""


SIMULATORS: Mapping[str, Simulator] = {
    "mujoco": Simulator("MuJoCo"),
    "warp": Simulator("MuJoCo Warp", (_SLEEP, _AUTORESET)),
    "mjx": Simulator("MJX", (_SLEEP, _AUTORESET, _TOUCHES)),
}
"""By the names that `World.save` takes; omissions are those that MuJoCo Warp 4.0.0 and MJX 3.17.0 with JAX need."""
_HEADER = re.compile(r"(<mujoco [^<>]*>\s*<!-- [^\n]*compiled by vrx_mj)\.\n.*?-->", re.DOTALL)
_ABOUT = re.compile(r'\s*<text name="vrx_mj/about"[^<>]*/>')


def mjcf_for(mjcf: str, simulator: str) -> str:
    """The MJCF of a compiled world as a simulator takes it; its header says what was left out.

    Raises:
        UnknownNameError: `SIMULATORS` has no such name.
    """
    check_name("simulator", simulator, SIMULATORS)
    title, omissions = SIMULATORS[simulator].title, SIMULATORS[simulator].omissions
    if not omissions:
        return mjcf
    for omission in omissions:
        mjcf = re.sub(omission.pattern, "", mjcf)
    lines = "".join(f"\n         {omission.consequence}" for omission in omissions)
    header = f"""\\1 for {title}.

       There is no sea here, no wind and no thrust: these come from vrx_mj's loop alone, and boats fall. Masses, joints,
       shapes and contacts are those of vrx_mj. Left out, since {title} refuses it:
{lines}
  -->"""
    return _HEADER.sub(header, _ABOUT.sub("", mjcf))
