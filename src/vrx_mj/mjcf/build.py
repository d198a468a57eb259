"""Building a boat: from what a fleet orders to a `Boat`, by xacro, URDF and the YAML beside it."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from vrx_mj.config.dynamics import HydrodynamicsConfig, MarineHullConfig
from vrx_mj.config.fleet import Order
from vrx_mj.config.kinds import MARINE, NEWER
from vrx_mj.config.robots import ProfileEntry, RobotConfig, load_robot, robot_section
from vrx_mj.config.search import display, is_path, package_paths
from vrx_mj.config.sensors import BallShooterConfig, SensorConfig
from vrx_mj.config.tree import ros_names_note
from vrx_mj.errors import ConfigError, UnknownNameError, VrxError, first_lines, ignore_warnings, warn
from vrx_mj.foreign import budget
from vrx_mj.formats.gazebo.sdf_boats import read_boat
from vrx_mj.formats.parts.read import load_parts, wamv_urdf
from vrx_mj.formats.urdf.expand import Arguments, ExpandedText, check_library, expand, own_packages
from vrx_mj.formats.urdf.model import Urdf
from vrx_mj.formats.urdf.reader import MeshFiles, in_namespace, read_urdf, with_file_uris
from vrx_mj.formats.urdf.xml_document import has_xacro, read_bytes
from vrx_mj.mjcf.boats import Boat, assemble_boat, with_places
from vrx_mj.mjcf.flotation import DENSITY, LINES, DerivedValues, derived_floats, derived_lines
from vrx_mj.packages import root

_SHOWN_NOTES = 12
"""Number of faults of a robot that a warning lists."""
_VRX, _NONE = "vrx", "none"
"""Names of the suites that a fleet can ask for whatever the robot: what it carries by default, and nothing."""
_HULL_KEYS = {"added_mass": "added_mass hydro", "drag_linear": "damping_linear", "drag_quadratic": "damping_quadratic"}
"""Fields of `HydrodynamicsConfig` that a hull of profile `marine` takes, and its own keys that give them."""


def build_boat(order: Order) -> Boat:
    """The boat of an order.

    Raises:
        ConfigError: a file is wrong; the error lists every problem with its place.
        UnknownNameError: the robot has no such layout, suite or sensor.
        VrxError: the robot takes no thruster or component file.
    """
    config = load_robot(order.robot, order.folder)
    ours = config.folder
    if ours is None or not ours.is_relative_to(root() / "assets") or order.thrusters or order.components:
        with budget():
            return _build(order, config)
    return _cached_boat(
        order if is_path(order.robot) else replace(order, folder=None), ours
    )  # a name is found from anywhere


@lru_cache(maxsize=64)
def _cached_boat(order: Order, _folder: Path | None) -> Boat:
    """A boat of the package's own files, which do not change while it runs, from one of its folders."""
    return replace(_build(order, load_robot(order.robot, order.folder)), description="")


def _build(order: Order, config: RobotConfig) -> Boat:
    profile = config.in_profile(order.profile)
    _, wanted = _equipment(order, config)
    urdf, text = _description(order, config)
    # VRX 3's thrusters take newtons, which hold until the next command
    drive = {"mapping": "newtons", "timeout": 0.0, **profile.thrusters.given_fields} if order.profile == NEWER else {}
    try:
        boat = replace(assemble_boat(urdf, config, drive), name=order.robot)
    except ConfigError as error:
        raise with_places(error, robot_section(order.robot, order.folder)) from None
    hull = config.hull if order.profile == MARINE else None
    boat, derived = _with_hydrodynamics(
        boat, {**config.hydrodynamics.given_fields, **profile.hydrodynamics.given_fields}, hull
    )
    sensors = _select_sensors(_with_shooters(boat, profile), wanted, config)
    remarks = (*boat.warnings, *derived, _sensors_note(boat, order, config))
    boat = replace(boat, contact=profile.contact or config.contact, sensors=sensors, description=text)
    names = ros_names_note("thruster", (thruster.name for thruster in boat.thrusters))
    names += ros_names_note("sensor", (sensor.name for sensor in sensors))
    if notes := [note for note in (*remarks, *names) if note]:
        warn(_notes_message(order.robot, notes), 2)
    return boat


def robot_of(order: Order) -> Urdf:
    """The links, joints, plugins and sensors of an order's robot, whether or not it is a boat; the same errors."""
    return _description(order, load_robot(order.robot, order.folder))[0]


def _description(order: Order, config: RobotConfig) -> tuple[Urdf, str]:
    """Links, joints and plugins of a robot's file, and the text of a URDF with the places of its meshes."""
    if config.is_sdf:
        return _sdf_boat(order, config)
    text, file = robot_urdf(config, order, arguments=_equipment(order, config)[0]), config.description_file
    known = isinstance(text, ExpandedText) or text == _plain_urdf(file)
    parts = " and ".join(display(part) for part in (order.thrusters, order.components) if part)
    label = display(file) if known else f"{display(file)} (expanded with {parts})"
    return read_urdf(text, file, _mesh_files(file), label=label), with_file_uris(text, _mesh_files(file))


def _mesh_files(file: Path) -> MeshFiles:
    return MeshFiles(file.absolute().parent, own_packages(), package_paths())


def _sdf_boat(order: Order, config: RobotConfig) -> tuple[Urdf, str]:
    """Links and joints of a model of Gazebo, which takes nothing of VRX's, and the text of a URDF of it."""
    if order.thrusters or order.components:
        raise VrxError(f"robot {order.robot} takes no thruster or component file: it is a Gazebo model")
    if order.arguments:
        raise VrxError(f"robot {order.robot} takes no arguments: it is a Gazebo model")
    urdf = read_boat(config.description_file)
    return urdf, urdf.text


def _with_shooters(boat: Boat, profile: ProfileEntry) -> Boat:
    """The boat with the ball shooters that its profile gives it."""
    if profile.shot_impulse is None:
        return boat
    update = {"impulse": profile.shot_impulse}
    sensors = (item.model_copy(update=update) if isinstance(item, BallShooterConfig) else item for item in boat.sensors)
    return replace(boat, sensors=tuple(sensors))


def robot_urdf(
    config: RobotConfig,
    order: Order,
    *,
    namespace: str | None = None,
    arguments: Arguments | None = None,
) -> str:
    """The URDF of a robot: its xacro expanded, with the thrusters and components of an order."""
    own = {**config.arguments, **config.in_profile(order.profile).arguments}
    given = {**own, **_layout(order, config), **(arguments or {}), **dict(order.arguments)}
    file = config.description_file
    if not (order.thrusters or order.components):
        named = {**given, **({"namespace": namespace} if namespace else {})}
        plain = _plain_urdf(file)
        if plain is not None and order.arguments:
            raise VrxError(f"robot {order.robot} takes no arguments: its URDF has nothing to expand")
        needed = dict(order.arguments)
        text = plain or expand(file, arguments=named, needed=needed, package_paths=package_paths())
        if "<link" not in text:
            check_library(file)
        return text
    if not config.vrx_parts:
        raise VrxError(f"robot {order.robot} takes no thruster or component file: its YAML sets no `vrx_parts`")
    return wamv_urdf(
        thrusters=load_parts(order.thrusters, "thrusters") if order.thrusters else None,
        components=load_parts(order.components, "components") if order.components else None,
        namespace=namespace or "wamv",
        arguments=given,
        file=None if file.resolve().is_relative_to((root() / "assets").resolve()) else file,
        package_paths=package_paths(),
    )


def boat_urdf(order: Order, namespace: str) -> str:
    """The URDF of the boat that `build_boat` makes of an order, for programs that read it elsewhere; the same errors.

    Its names are in a namespace, and its meshes are named by where their files are.
    """
    config = load_robot(order.robot, order.folder)
    if config.is_sdf:
        with ignore_warnings():  # who builds the boat has them
            return in_namespace(_sdf_boat(order, config)[1], namespace)
    arguments, _ = _equipment(order, config)
    text = in_namespace(robot_urdf(config, order, namespace=namespace, arguments=arguments), namespace)
    return with_file_uris(text, _mesh_files(config.description_file))


def _plain_urdf(file: Path) -> str | None:
    """The text of a URDF in which nothing is to be expanded: its lines are those of the file."""
    if not file.name.lower().endswith(".urdf"):
        return None
    try:
        text = read_bytes(file).decode("utf-8")
    except (ConfigError, UnicodeDecodeError):
        return None  # `expand` reports what is wrong
    first, *rest = text.split("<!--")  # VRX's macros leave comments with expressions in them
    bare = first + "".join(piece.partition("-->")[2] for piece in rest)
    return None if has_xacro(bare) else text


def _layout(order: Order, config: RobotConfig) -> Mapping[str, str]:
    if order.layout is None:
        return next(iter(config.layouts.values()), {})
    return config.layout(order.layout, order.robot)


def _equipment(order: Order, config: RobotConfig) -> tuple[dict[str, str], tuple[str, ...] | None]:
    """Xacro arguments for the sensors of an order, and the names of those to keep; None: all of them."""
    asked, suites = order.sensors, config.suites
    if order.components or not suites:
        return {}, None if asked in {None, (_VRX,)} else () if asked == (_NONE,) else asked
    if asked is None:
        return dict(suites.get(_VRX, {})), None
    if all(name in suites for name in asked):
        return {key: value for name in asked for key, value in suites[name].items()}, None
    return dict(suites.get(_VRX, {})), asked


def _select_sensors(boat: Boat, wanted: tuple[str, ...] | None, config: RobotConfig) -> tuple[SensorConfig, ...]:
    if wanted is None:
        return boat.sensors
    known = {sensor.name: sensor for sensor in boat.sensors}
    for name in wanted:
        if name in config.suites and name not in known:
            raise VrxError(f"expected either a suite or names of sensors, got the suite '{name}' among names")
        if name not in known:
            raise UnknownNameError("sensor or suite" if config.suites else "sensor", name, [*known, *config.suites])
    return tuple(known[name] for name in wanted)


def _sensors_note(boat: Boat, order: Order, config: RobotConfig) -> str:
    """A note where VRX's sensors are asked for, and the boat's own files list which it carries."""
    if order.sensors != (_VRX,) or (config.suites and not order.components):
        return ""
    carried = ", ".join(sensor.name for sensor in boat.sensors) or "none"
    return f"`sensors: vrx` adds no sensors: its own files define them, {carried}"


def _with_hydrodynamics(
    boat: Boat, given: dict[str, Any], hull: MarineHullConfig | None
) -> tuple[Boat, tuple[str, ...]]:
    """The boat with what the YAML gives, then the plugin, then the shapes; with notes about what was derived.

    `hull` is the one that it has in its world in the place of floats.
    """
    whole = {key: value for key, value in boat.water.items() if not (isinstance(value, tuple) and None in value)}
    if boat.hydrodynamics is not None:
        return replace(boat, hydrodynamics=boat.hydrodynamics.model_copy(update=given)), ()
    given = {**whole, **given}
    if LINES & given.keys():
        guess = derived_lines(boat)
    else:
        guess = derived_floats(boat, given.get("water_density", DENSITY), given.get("length_n", 2))
    for key, six in boat.water.items():
        if isinstance(six, tuple) and None in six:  # of which a file gives a part
            rest: Any = guess.values[key]
            guess.values[key] = tuple(b if a is None else a for a, b in zip(six, rest, strict=True))
    values = HydrodynamicsConfig.model_validate({**guess.values, **given})
    boat = replace(boat, hydrodynamics=values, pushed=None if hull else guess.pushed)
    return boat, (*guess.notes, *_derivation_notes(guess, given, boat.water, hull))


def _derivation_notes(
    guess: DerivedValues, given: Mapping[str, Any], known: Collection[str], hull: MarineHullConfig | None
) -> list[str]:
    """Text of a warning about what was derived; the waterline and the draft represent the floats.

    Floats alone, with the lift of the shapes, are no guess.
    """
    of_hull = {key for key, own in _HULL_KEYS.items() if any(getattr(hull, name, ()) for name in own.split())}
    guessed = _HULL_KEYS.keys() - of_hull - given.keys()
    floats = set() if hull else guess.values.keys() - _HULL_KEYS.keys() - {"hulls", *given}
    missing = [
        f"{key} {_short(value)}{' (in part that of its file)' if key in known else ''}"
        for key, value in guess.values.items()
        if key in guessed | floats
    ]
    rest = [guess.rest] if guess.rest else []
    if not missing or (rest and not guessed):
        return []
    if hull:
        return [f"missing from its `hull`, so scaled from the WAM-V by Froude's law: {', '.join(missing)}"]
    return [f"derived from its shapes and mass: {', '.join([*rest, *missing])}; set them in the YAML beside it"]


def _notes_message(robot: str, notes: Sequence[str]) -> str:
    """Text of the remarks about a robot: in the same line if it is one thing, else one a line."""
    if len(notes) == 1:
        return f"robot {robot}: {notes[0]}"
    return "\n".join([f"robot {robot}:", *first_lines(notes, _SHOWN_NOTES)])


def _short(value: object) -> str:
    if isinstance(value, tuple):
        return "[" + ", ".join(f"{item:.3g}" for item in value) + "]"
    return f"{value:.3g}"
