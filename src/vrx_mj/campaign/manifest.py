"""What a campaign's folder holds, and whether a plan may go on there."""

import shlex
import shutil
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from functools import cache
from hashlib import file_digest, sha256
from importlib.machinery import PathFinder
from pathlib import Path

from pydantic import TypeAdapter, ValidationError

import vrx_mj
from vrx_mj.campaign.plan import Cell, Plan, Serving
from vrx_mj.campaign.results import DATABASE, FORMAT, WHAT, Result, read_json, read_results, write_json
from vrx_mj.config.fleet import load_fleet
from vrx_mj.config.kinds import opener
from vrx_mj.config.loading import fault_text
from vrx_mj.config.search import find, is_path
from vrx_mj.config.world import load_world
from vrx_mj.constants import PHYSICS_VERSION
from vrx_mj.errors import CommandError, RecordError, UnknownNameError, VrxError, first_names, ignore_warnings
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.outputs import check_inside
from vrx_mj.packages import root
from vrx_mj.runtime.run import fingerprint, split_name

_MANIFEST = "campaign.json"
_OUTPUT_FILES = (
    "cells",
    "worlds",
    _MANIFEST,
    DATABASE,
    f"{DATABASE}-wal",
    f"{DATABASE}-shm",
    "results.csv",
    "index.html",
)
"""Names that a campaign writes in its folder."""
_PLAN = TypeAdapter(Plan)
_DATA_FOLDERS = ("assets", "templates", "fleets")
"""Folders of vrx_mj's data."""


@dataclass(frozen=True)
class Manifest:
    """Manifest of a campaign: its plan, and everything that its results depend on."""

    plan: Plan
    controllers: Mapping[str, str]
    """Digest of each controller's files."""
    code: str
    """Version and digest of vrx_mj."""
    platform: str
    began: str
    """Date and time, UTC, ISO 8601."""
    physics_version: int = PHYSICS_VERSION
    """`constants.PHYSICS_VERSION`; scores of different ones are of different boats and seas."""


@dataclass(frozen=True)
class Campaign:
    """A campaign with the results that it has so far."""

    folder: Path
    manifest: Manifest
    results: Mapping[Cell, Result]

    @property
    def remaining(self) -> tuple[Cell, ...]:
        """Cells that have no result, or a failed one."""
        return tuple(
            cell for cell in self.manifest.plan.cells if cell not in self.results or self.results[cell].has_failed
        )


def begin(folder: Path, plan: Plan, *, restart: bool = False) -> Campaign:
    """Begin a campaign in a folder, or go on with the one that is there; more of the same may be added to it.

    Args:
        folder: where the results are; it is made if need be.
        plan: what to sail.
        restart: forget the campaign that is there.

    Raises:
        CommandError: the folder holds another campaign, or other things.
        RecordError: its campaign is damaged, or of another version.
        VrxError: unknown controller.
    """
    manifest = Manifest(
        plan,
        {name: (controller_hash if plan.serving is None else _program_hash)(name) for name in plan.controllers},
        code_version(),
        fingerprint(),
        datetime.now(UTC).isoformat(timespec="seconds"),
    )
    if not (folder / _MANIFEST).is_file() and folder.is_dir() and any(folder.iterdir()):
        raise CommandError(f"the folder '{folder}' is not empty and holds no campaign: give another folder with -o")
    for name in _OUTPUT_FILES:
        check_inside(folder, name, WHAT)
    if restart:
        for name in _OUTPUT_FILES:
            if (folder / name).is_dir():
                shutil.rmtree(folder / name)
            else:
                (folder / name).unlink(missing_ok=True)
    results = read_results(folder, plan.cells)
    if (folder / _MANIFEST).is_file():
        old = _read_manifest(folder)
        _check_fits(folder, [*_differences(old, manifest), *_changed_worlds(plan, results)])
        manifest = replace(manifest, began=old.began)
    _write_manifest(folder, manifest)
    return Campaign(folder, manifest, results)


def read_campaign(folder: Path) -> Campaign:
    """A campaign with its results.

    Raises:
        RecordError: the campaign is missing, damaged or of another version.
    """
    manifest = _read_manifest(folder)
    return Campaign(folder, manifest, read_results(folder, manifest.plan.cells))


def _check_fits(folder: Path, differences: Sequence[str]) -> None:
    if differences:
        lines = "\n".join(f"  {text}" for text in differences)
        raise CommandError(
            f"the campaign in '{folder}' is a different one:\n{lines}\n"
            "give another folder with -o, or --restart to run all of it again"
        )


def _differences(old: Manifest, new: Manifest) -> Iterator[str]:
    """Why results of these two cannot be in one campaign."""
    if old.code != new.code:
        yield f"it was run by vrx_mj {old.code}, now {new.code}"
    for name, digest in new.controllers.items():
        if old.controllers.get(name, digest) != digest:
            yield f"the {'controller' if new.plan.serving is None else 'program'} {name} has changed since"
    for kind in ("controllers", "worlds", "seeds"):
        gone = [str(item) for item in getattr(old.plan, kind) if item not in getattr(new.plan, kind)]
        if gone:
            yield f"it also has the {kind} {first_names(gone)}"
    for option in ("fleet", "duration", "record", "vary"):
        was, now = getattr(old.plan, option), getattr(new.plan, option)
        if was != now:
            yield f"its --{option} was {_option_text(was)}, now {_option_text(now)}"
    if old.plan.serving != new.plan.serving:
        yield f"its trials were run by {_pilots(old.plan.serving)}, now by {_pilots(new.plan.serving)}"


def _changed_worlds(plan: Plan, results: Mapping[Cell, Result]) -> Iterator[str]:
    """Which worlds and fleets of the user's own are not what results were sailed in: each is compiled."""
    own_fleet = plan.fleet is not None and not _is_shipped("fleets", plan.fleet)
    sailed = {cell.world: result.world_sha256 for cell, result in results.items() if result.world_sha256}
    for world, before in sailed.items():
        if own_fleet or not _is_shipped("worlds", world):
            try:
                same = compile_world(world, fleet=plan.fleet).sha256 == before
            except VrxError:
                same = False
            if not same:
                yield f"the world {world}{f', or the fleet {plan.fleet},' if own_fleet else ''} has changed since"


def _option_text(value: object) -> str:
    if isinstance(value, tuple):
        value = " ".join(map(str, value)) or None
    return "not given" if value is None else ("off", "on")[value] if isinstance(value, bool) else f"{value}"


def _pilots(serving: Serving | None) -> str:
    if serving is None:
        return "controllers"
    rate = "max" if serving.rate is None else f"{serving.rate:g}"
    waits = "" if serving.lockstep is None else f" --lockstep {','.join(serving.lockstep) or 'step'}"
    others = [f" --{name}" for name in ("rosbridge", "ardupilot") if getattr(serving, name)]
    return f"--exec --rate {rate}{waits}{''.join(others)}"


def _write_manifest(folder: Path, manifest: Manifest) -> None:
    tree = asdict(manifest)
    plan = tree.pop("plan")
    write_json(folder / _MANIFEST, {"format": FORMAT, **plan, **tree})


def _read_manifest(folder: Path) -> Manifest:
    file = folder / _MANIFEST
    if not file.is_file():
        raise RecordError(f"no campaign in '{folder}': it has no {_MANIFEST}")
    try:
        tree = read_json(file)
        plan = _PLAN.validate_python({**tree, "controllers": list(tree["controllers"])})
        physics = tree.get("physics_version", 1)
        return Manifest(plan, tree["controllers"], tree["code"], tree["platform"], tree["began"], physics)
    except ValidationError as error:
        raise RecordError(f"{file} is damaged: {fault_text(error)}") from error
    except (ValueError, KeyError, TypeError) as error:
        raise RecordError(f"{file} is damaged: {error}") from error


@cache
def code_version() -> str:
    """The version of vrx_mj with a digest of its modules and data: what changes a score without a new one shows too."""
    folder = Path(vrx_mj.__file__).resolve().parent
    digest = sha256(_digest(folder, sorted(folder.rglob("*.py"))).encode())
    for name in _DATA_FOLDERS:
        files = sorted(file for file in (root() / name).rglob("*") if file.is_file() and file.suffix != ".pyc")
        digest.update(_digest(root(), files).encode())
    return f"{vrx_mj.__version__} {digest.hexdigest()[:12]}"


def controller_hash(name: str) -> str:
    """Digest of the files of a controller `module:function`: its module, or all modules of the package that holds it.

    Nothing of it is run. Looked for in the current folder first.

    Raises:
        VrxError: the name is not of that form, or the module is missing.
    """
    module, _ = split_name(name)
    found = _sources(module)
    if found is None:
        raise VrxError(f"no module named '{module}' for the controller '{name}'")
    return _digest(*found)


def _is_shipped(kind: str, name: str) -> bool:
    """Whether a world or fleet (`kind`: worlds, fleets) comes with vrx_mj, so that `code_version` covers it."""
    if is_path(name.partition("#")[0]):
        return False
    with suppress(UnknownNameError):  # it may be a folder
        return find(kind, name).is_relative_to(root())
    return False


def check_files(plan: Plan) -> None:
    """Refuse worlds and a fleet of the user's own that cannot be read, once, before every trial would fail by them.

    Raises:
        VrxError: one of them cannot.
    """
    own_fleet = plan.fleet is not None and not _is_shipped("fleets", plan.fleet)
    for index, world in enumerate(plan.worlds):
        if (own_fleet and index == 0) or not _is_shipped("worlds", world):
            with ignore_warnings():  # in the logs of the trials
                opened = opener(world, {})
                source, fleet = opened(world, plan.fleet, {}) if opened else (world, plan.fleet)
                load_fleet(fleet, load_world(source))


def _program_hash(line: str) -> str:
    try:
        words = shlex.split(line)
    except ValueError:  # the shell reports what is wrong with it
        words = line.split()
    digest = sha256(line.encode())
    for file in dict.fromkeys(map(Path, words)):
        with suppress(OSError), file.open("rb") as content:  # most words name no file
            digest.update(b"\0" + str(file).encode() + b"\0" + file_digest(content, "sha256").digest())
    return digest.hexdigest()


def _sources(module: str) -> tuple[Path, list[Path]] | None:
    """A folder and the files in it that a module is made of, without importing it; None where it is not found."""
    top, *inner = module.split(".")
    PathFinder.invalidate_caches()
    spec = PathFinder.find_spec(top, [str(Path.cwd()), *sys.path])
    if spec is None:
        return None
    for place in map(Path, spec.submodule_search_locations or ()):
        if not inner or _within(place, inner):
            return place, sorted(place.rglob("*.py"))
    if inner or spec.origin is None:
        return None
    return Path(spec.origin).parent, [Path(spec.origin)]


def _within(package: Path, inner: list[str]) -> bool:
    """Whether a package's folder has this module, as a file or as a package."""
    place = package.joinpath(*inner)
    return place.is_dir() or place.with_suffix(".py").is_file()


def _digest(folder: Path, files: list[Path]) -> str:
    digest = sha256()
    for file in files:
        digest.update(file.relative_to(folder).as_posix().encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()
