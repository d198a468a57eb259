"""Steering of a boat: joints that turn thrusters, rudders and sails, and the links that turn with them."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from vrx_mj.config.loading import problem_at
from vrx_mj.config.robots import YAML_OF, RobotConfig
from vrx_mj.config.tree import Section
from vrx_mj.errors import ConfigError, Problem, UnknownNameError
from vrx_mj.formats.urdf.model import Joint, Urdf, UrdfThruster

_TURNING = ("revolute", "continuous")
"""Types of joints that can steer."""
_FREE = "free"
"""Name of the joint on which a boat floats."""


@dataclass(frozen=True)
class Hinges:
    """The joints that steer."""

    by_name: Mapping[str, Joint]
    """Joints by the name of the thruster, rudder or sail that they steer."""
    turning: Mapping[str, tuple[str, ...]]
    """Links that turn with each thruster, rudder or sail."""
    notes: tuple[str, ...] = ()
    """Remarks about what is legal and unusual."""


def read_hinges(urdf: Urdf, thrusters: Mapping[str, UrdfThruster], config: RobotConfig) -> Hinges:
    """The hinges of thrusters, rudders and sails. A joint that is fixed, or that cannot leave zero, steers nothing.

    Raises:
        ConfigError: a joint cannot steer, or steers two things, or hangs on another that steers; a rudder or sail has
            the name of a thruster, or is in the race of one that does not exist; a propeller is that of none.
    """
    wanted = _steering_joints(urdf, thrusters, config)
    hinges: dict[str, Joint] = {}
    notes: list[str] = []
    for name, joint in ((name, urdf.joints[joint]) for name, joint in wanted.items() if joint is not None):
        if joint.type != "fixed" and not joint.is_locked:
            _check_hinge(urdf, name, joint, hinges)
            notes += _limit_notes(name, joint)
            if room(joint) > 0:
                hinges[name] = joint
    turning = {name: urdf.below(joint.child) for name, joint in hinges.items()}
    _check_nesting(thrusters, hinges, turning)
    return Hinges(hinges, turning, tuple(notes))


def _steering_joints(
    urdf: Urdf, thrusters: Mapping[str, UrdfThruster], config: RobotConfig
) -> dict[str, str | None]:  # fmt: skip
    """The joint that turns each thruster, rudder and sail; None for what is fixed."""
    wanted = {name: item.engine_joint for name, item in thrusters.items()}
    for kind, blades in (("rudders", config.rudders), ("sails", config.sails)):
        for name, entry in blades.items():
            if name in thrusters:
                raise own_problem(urdf, f"{kind}.{name}", "duplicate name: it is the name of a thruster")
            wanted[name] = entry.joint and urdf_name(urdf, "joint", entry.joint, f"{kind}.{name}.joint")
    for name, rudder in config.rudders.items():
        if rudder.propeller is not None and rudder.propeller not in thrusters:
            error = UnknownNameError("thruster", rudder.propeller, thrusters)
            raise own_problem(urdf, f"rudders.{name}.propeller", str(error))
    for name in config.propellers:
        if name not in thrusters and not config.layouts:
            raise own_problem(urdf, f"propellers.{name}", str(UnknownNameError("thruster", name, thrusters)))
    for name in wanted:
        if f"{name}_angle" in wanted:
            message = f"duplicate name '{name}_angle': a thruster, and the command that steers the thruster '{name}'"
            raise ConfigError([Problem(urdf.label, None, None, "", message)])
    return wanted


def room(joint: Joint) -> float:
    """Largest angle [rad] that a hinge reaches either way; 0 if its limits leave no room on one side."""
    if joint.type == "continuous" or joint.limits is None:
        return float("inf")
    return max(0.0, min(-joint.limits.lower, joint.limits.upper))


def urdf_name(urdf: Urdf, kind: str, name: str, path: str) -> str:
    """The URDF's name of a link or joint that the YAML gives with or without the namespace."""
    names = urdf.links if kind == "link" else urdf.joints
    for candidate in (name, f"{urdf.namespace}/{name}"):
        if candidate in names:
            return candidate
    error = UnknownNameError(kind, name, [urdf.local(item) for item in names])
    raise own_problem(urdf, path, str(error))


def own_problem(urdf: Urdf, path: str, message: str) -> ConfigError:
    """A problem with the YAML beside a URDF, at a key of it; the reader of that file adds the line."""
    return ConfigError([Problem(f"{YAML_OF} {urdf.file.name}", None, None, path, message)])


def with_places(error: ConfigError, section: Section) -> ConfigError:
    """The error with the file and line of its problems in the YAML beside a URDF, whose content is `section`."""
    if section.place.line is None:
        return error
    return ConfigError(
        problem_at(section, _steps(problem.key), problem.message) if problem.file.startswith(YAML_OF) else problem
        for problem in error.problems
    )


def _steps(key: str) -> tuple[str | int, ...]:
    """`sensors[0].link` as `("sensors", 0, "link")`."""
    return tuple(int(number) if number else name for number, name in re.findall(r"\[(\d+)\]|([^.\[\]]+)", key))


def _problem(joint: Joint, message: str) -> ConfigError:
    return ConfigError([joint.place.problem(f"joint '{joint.name}'", message)])


def _check_hinge(urdf: Urdf, name: str, joint: Joint, hinges: Mapping[str, Joint]) -> None:
    if joint.type not in _TURNING:
        raise _problem(joint, f"is {joint.type} and cannot steer '{name}'; expected {' or '.join(_TURNING)}")
    if urdf.local(joint.name) == _FREE:
        raise _problem(joint, f"cannot be named '{_FREE}', the name of the boat's free joint")
    for other, hinge in hinges.items():
        if hinge is joint:
            raise _problem(joint, f"steers both '{other}' and '{name}'; each needs a joint of its own")
        if urdf.local(hinge.name) == urdf.local(joint.name):
            raise _problem(joint, f"has the same name as '{hinge.name}' without the namespace '{urdf.namespace}'")


def _check_nesting(
    thrusters: Mapping[str, UrdfThruster], hinges: Mapping[str, Joint], turning: Mapping[str, tuple[str, ...]]
) -> None:
    """A propeller hangs on the joint that steers its thruster, and neither it nor a joint on another that steers."""
    for other, links in turning.items():
        carrier = hinges[other]
        for name, hinge in hinges.items():
            if name != other and hinge.child in links:
                raise _problem(
                    hinge,
                    f"steers '{name}' and moves with '{carrier.name}', which steers '{other}': "
                    "no steering joint may move with another one",
                )
        for name, item in thrusters.items():
            link = item.propeller_link
            if name == other and link not in links:
                raise _problem(carrier, f"steers '{name}', whose propeller '{link}' does not move with it")
            if name != other and link in links:
                raise _problem(
                    carrier,
                    f"steers '{other}', and the propeller '{link}' of '{name}', which it does not steer, moves with it",
                )


def _limit_notes(name: str, joint: Joint) -> Iterator[str]:
    """Remarks about unequal limits of a steering joint."""
    limits = joint.limits
    if joint.type == "continuous" or limits is None or abs(limits.lower + limits.upper) < 1e-9:
        return
    reach = f"turns {room(joint):g} rad either way at most" if room(joint) > 0 else "does not steer"
    yield f"joint '{joint.name}' has limits {limits.lower:g} and {limits.upper:g} rad: '{name}' {reach}"
