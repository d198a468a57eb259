"""Whether a saved world is one that we wrote: checked before anything of it runs, as it may come from somebody else."""

import hashlib
import re
from collections.abc import Callable, Iterator, Mapping
from itertools import chain

from pydantic import ValidationError

from vrx_mj.config.bays import LIGHT_COLORS, OFF, SHAPES, SYMBOLS
from vrx_mj.config.loading import fault_text
from vrx_mj.config.sensors import sensor_config
from vrx_mj.config.urdf.mesh_sizes import sized_obj, sized_stl
from vrx_mj.config.wording import shown
from vrx_mj.errors import StateError, VrxError
from vrx_mj.mjcf.mjcf_form import Contents, contents_of
from vrx_mj.model.references import broken_references
from vrx_mj.model.world import FORMAT, Parameters, format_of, parameters_of

__all__ = ["checked"]

MOST_ASSETS = 10_000
LARGEST_ASSET, LARGEST_ASSETS = 100_000_000, 500_000_000
"""Bytes of one file that an MJCF names, and of all together."""
_HASH = re.compile(r"_([0-9a-f]{12,16})\.(?:obj|stl)$")
"""End of an asset's name: the first digits of its content's SHA-256."""
TOUCH = "touch"
"""Contact sensors are called by this and the name of the rival."""


def checked(
    mjcf: str, parameters: bytes, asset: Callable[[str], bytes], source: object
) -> tuple[Parameters, dict[str, bytes]]:
    """The parameters of a saved world, and its assets by name.

    Args:
        mjcf: the MJCF.
        parameters: the JSON beside it.
        asset: gives a file's content by its name, which has no folders.
        source: what messages call the JSON.

    Raises:
        StateError: a part is damaged or of another version, or the parts do not belong together.
    """
    typed = _read(parameters, source)
    scene = str(source).removesuffix(".json") + ".xml"
    contents = contents_of(mjcf, scene)
    faults = chain(broken_references(typed), _signs(typed), _sensors(typed), _unlike(typed, contents))
    if fault := next(faults, None):  # what comes later trusts what came before
        raise StateError(f"{source} is damaged: {fault}")
    return typed, _assets(contents.files, asset, scene)


def _read(text: bytes, source: object) -> Parameters:
    try:
        if (version := format_of(text)) != FORMAT:
            raise StateError(f"{source} has format {shown(version)}; this version reads {FORMAT}")
        return parameters_of(text)
    except ValidationError as error:
        raise StateError(f"{source} is damaged: {fault_text(error)}") from None
    except ValueError as error:
        raise StateError(f"{source} is damaged: {error}") from None


def _assets(files: Mapping[str, None], asset: Callable[[str], bytes], source: object) -> dict[str, bytes]:
    """The files that an MJCF names, each of the content that its name is made of."""
    if len(files) > MOST_ASSETS:
        raise StateError(f"{source} names {len(files):,} files; at most {MOST_ASSETS:,} are read")
    found: dict[str, bytes] = {}
    size = 0
    for name in sorted(files):
        content = found[name] = asset(name)
        size += len(content)
        if len(content) > LARGEST_ASSET or size > LARGEST_ASSETS:
            raise StateError(f"{source} names files of {size:,} bytes, down to '{name}': too many are read")
        digits = _HASH.search(name)
        if digits is None or not hashlib.sha256(content).hexdigest().startswith(digits[1]):
            raise StateError(f"{source} is damaged: '{name}' has another content than its name says")
        try:
            (sized_obj if name.endswith(".obj") else sized_stl)(name, content)
        except VrxError as error:
            raise StateError(f"{source} is damaged: {error}") from None
    return found


def _unlike(world: Parameters, contents: Contents) -> Iterator[str]:
    """Where the tables do not fit the MJCF."""
    if world.timestep != contents.timestep:
        yield f"timestep: {world.timestep:g} s, and {contents.timestep:g} s in the MJCF"
    free = {body for body, joints in contents.joints.items() if [kind for kind, _ in joints] == ["free"]}
    yield from _boats(world, contents, free)
    for number, row in enumerate(world.floats):
        if row.body not in free:
            yield f"floats[{number}].body: '{row.body}' is no free body"
    yield from _blocks(world, contents, free)
    for kind, named, known in (("body", _bodies(world), contents.joints), ("geom", _geoms(world), contents.geoms)):
        yield from (f"{place}: the MJCF has no {kind} '{name}'" for place, name in named if name not in known)
    rivals = [f"{TOUCH}/{rival}" for rival in (world.task.rivals if world.task else ())]
    if rivals != contents.touches:
        yield "task.rivals: they are not those of the contact sensors in the MJCF"


def _boats(world: Parameters, contents: Contents, free: set[str]) -> Iterator[str]:
    for number, (boat, hull) in enumerate(zip(world.boats, world.hulls, strict=True)):
        if hull.body not in free or not hull.body.startswith(f"{boat.name}/"):
            yield f"hulls[{number}].body: '{hull.body}' is no free body of {boat.name}"
    for number, thruster in enumerate(world.thrusters):
        if not _turns(thruster.body, thruster.joint, world.hulls[thruster.hull].body, contents):
            yield f"thrusters[{number}].body: '{thruster.body}' is not the hull or a body on its own hinge"
    links = {boat.name: hull.body for boat, hull in zip(world.boats, world.hulls, strict=True)}
    for number, sensor in enumerate(world.sensors):
        if sensor.body != links[sensor.boat]:
            yield f"sensors[{number}].body: '{sensor.body}' is not the hull of {sensor.boat}"


def _turns(body: str, joint: str | None, hull: str, contents: Contents) -> bool:
    """Whether an engine is its hull, or hangs on it by a hinge."""
    if joint is None:
        return body == hull
    return contents.parents.get(body) == hull and contents.joints[body] == (("hinge", joint),)


def _blocks(world: Parameters, contents: Contents, free: set[str]) -> Iterator[str]:
    for number, block in enumerate(world.blocks):
        if block.parent < 0:
            right = block.body in free
        else:
            hinges = [kind for kind, _ in contents.joints.get(block.body, ())]
            right = hinges == ["hinge"] and contents.parents[block.body] == world.blocks[block.parent].body
        if not right:
            yield f"blocks[{number}].body: '{block.body}' is no free body, or on no hinge of the one it hangs on"


def _bodies(world: Parameters) -> Iterator[tuple[str, str]]:
    for table in ("objects", "lights", "placards"):
        for number, row in enumerate(getattr(world, table)):
            yield f"{table}[{number}].body", row.body
    for number, dock in enumerate(world.docks):
        yield from ((f"docks[{number}]", body) for body in (*dock.bodies, *dock.placards))


def _geoms(world: Parameters) -> Iterator[tuple[str, str]]:
    for number, light in enumerate(world.lights):
        yield from ((f"lights[{number}].geoms", geom) for geom in light.geoms)
    for number, placard in enumerate(world.placards):
        yield from ((f"placards[{number}].geoms", geom) for geoms in placard.geoms.values() for geom in geoms)


def _signs(world: Parameters) -> Iterator[str]:
    """Colours and symbols that nobody can show."""
    for number, light in enumerate(world.lights):
        for color in light.pattern:
            if color not in {*LIGHT_COLORS, OFF}:
                yield f"lights[{number}].pattern: no colour '{color}'"
    shown = [(f"placards[{number}].symbol", placard.symbol) for number, placard in enumerate(world.placards)]
    shown += [(f"task.bays[{number}].symbol", bay.symbol) for number, bay in enumerate(getattr(world.task, "bays", ()))]
    yield from (f"{place}: no symbol '{symbol}'" for place, symbol in shown if symbol not in SYMBOLS)
    for number, placard in enumerate(world.placards):
        yield from (f"placards[{number}].geoms: no shape '{shape}'" for shape in placard.geoms if shape not in SHAPES)
    for color in getattr(world.task, "color_sequence", ()):
        if color not in LIGHT_COLORS:
            yield f"task.color_sequence: no colour '{color}'"


def _sensors(world: Parameters) -> Iterator[str]:
    for number, sensor in enumerate(world.sensors):
        try:
            sensor_config({"config": sensor.config})
        except ValidationError as error:
            yield f"sensors[{number}].config: {fault_text(error)}"
