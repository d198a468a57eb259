"""A compiled world: all that a run needs, and how it is kept in a folder."""

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path, PurePosixPath
from types import MappingProxyType

from vrx_mj.arguments import as_path
from vrx_mj.config.search import ReadingError, read_limited
from vrx_mj.errors import StateError
from vrx_mj.exits import awaited
from vrx_mj.mjcf.pieces import Pieces, pieces_of
from vrx_mj.mjcf.saved import checked
from vrx_mj.model.world import MOST_BYTES, Parameters, json_of, without_descriptions
from vrx_mj.outputs import write_files


@dataclass(frozen=True, repr=False)
class World:
    """A compiled world: its MJCF, asset files, and parameters of sea, wind, hulls and floating objects.

    `save` writes exactly this to a folder; `Simulation` and `Batch` run it.
    """

    mjcf: str
    """MJCF of the world, with every boat, dock and object attached under its name."""
    assets: Mapping[str, bytes]
    """Contents of the files that the MJCF refers to, by file name."""
    parameters: Parameters
    """What the world has besides: sea, wind, hulls, thrusters, sensors, objects, docks, task and more."""

    def __reduce__(self) -> tuple[Callable[..., "World"], tuple[str, dict[str, bytes], Parameters]]:
        """Pickle and copy it as its parts: what keeps them from being changed cannot be pickled."""
        return make_world, (self.mjcf, dict(self.assets), self.parameters)

    def __repr__(self) -> str:
        boats = f"{len(self.boats)} boat{'' if len(self.boats) == 1 else 's'}"
        return f"<World {self.name}, fleet {self.parameters.fleet}, {boats}, seed {self.seed}>"

    @cached_property
    def pieces(self) -> Pieces:
        """The pieces that the MJCF joins; those of a world that was loaded are read from it."""
        return pieces_of(self.mjcf, self.assets, self.parameters)

    @property
    def name(self) -> str:
        """Name of the world."""
        return self.parameters.name

    @property
    def seed(self) -> int:
        """Default seed of `Simulation.reset`."""
        return self.parameters.seed

    @cached_property
    def boats(self) -> tuple[str, ...]:
        """Names of the boats, in the order of the fleet."""
        return tuple(boat.name for boat in self.parameters.boats)

    @cached_property
    def sha256(self) -> str:
        """SHA-256 of the saved world, without the descriptions of its boats: these name places on this machine."""
        digest = hashlib.sha256(self.mjcf.encode())
        digest.update(json_of(without_descriptions(self.parameters)).encode())
        for name in sorted(self.assets):
            digest.update(name.encode() + b"\0" + self.assets[name])
        return digest.hexdigest()

    def save(self, target: str | Path) -> Path:
        """Write the MJCF, its parameters and `assets/` to a folder, and return the path of the MJCF.

        Plain MuJoCo can open the MJCF; `World.load` reads the whole world back.

        Args:
            target: a folder, in which the MJCF is named `scene.xml`, or the path of the MJCF, ending in `.xml`.

        Raises:
            StateError: an asset's name has a folder in it, a link is in the way, or it cannot be written.
        """
        scene = _scene(as_path("target", target))
        write_files(scene.parent, self.files(scene.stem), "the world", StateError)
        return scene

    def files(self, name: str = "scene") -> dict[str, bytes]:
        """What `save` writes, by relative path: the MJCF and its parameters have this name.

        Raises:
            StateError: an asset's name has a folder in it.
        """
        for asset in self.assets:
            if asset != PurePosixPath(asset).name or "\\" in asset or ":" in asset:
                raise StateError(f"invalid asset name '{asset}': a file name without folders is needed")
        texts = {f"{name}.json": json_of(self.parameters), f"{name}.xml": self.mjcf}
        return {
            **{f"assets/{asset}": bytes(content) for asset, content in self.assets.items()},
            **{file: text.encode() for file, text in texts.items()},
        }

    @staticmethod
    def load(source: str | Path) -> "World":
        """Read a world that `save` wrote, from the same folder or path.

        It may come from somebody else: all of it is checked, and no file outside the folder is opened.

        Raises:
            StateError: there is no saved world, or it is damaged or of another version.
        """
        scene = _scene(as_path("source", source))
        path = scene.with_suffix(".json")
        if not (path.is_file() and scene.is_file()):
            raise StateError(f"no saved world at {source}: {scene.name} and {path.name} are needed in {scene.parent}")
        assets = scene.parent / "assets"
        return world_of(_read(scene), _read(path), lambda name: _read(assets / name), path)


@awaited()
def world_of(mjcf: bytes, parameters: bytes, asset: Callable[[str], bytes], source: object) -> World:
    """The world of a saved MJCF, its parameters as JSON, and `asset`, which gives a file's content by its name.

    `source` names the parameters in messages. Nothing is written, and assets have plain names: what was saved may come
    from somebody else.

    Raises:
        StateError: it is damaged or of another version.
    """
    try:
        text = mjcf.decode()
    except UnicodeDecodeError as error:
        raise StateError(f"{source} is damaged: the MJCF beside it is not UTF-8: {error}") from None
    typed, assets = checked(text, parameters, asset, source)
    return make_world(text, assets, typed)


def _read(path: Path) -> bytes:
    """A file's content.

    Raises:
        StateError: it does not exist, is not a plain file, or is too large.
    """
    try:
        return read_limited(path, MOST_BYTES)
    except ReadingError as error:
        raise StateError(f"{path} {error}") from None


def _scene(target: Path) -> Path:
    """The MJCF's path, from it or from its folder."""
    return target if target.suffix == ".xml" else target / "scene.xml"


def make_world(mjcf: str, assets: Mapping[str, bytes], parameters: Parameters) -> World:
    """A `World` that nobody can change, its assets in the order of their names."""
    return World(mjcf, MappingProxyType(dict(sorted(assets.items()))), parameters)


def joined_world(pieces: Pieces, parameters: Parameters) -> World:
    """A `World` of pieces, whose MJCF is joined here."""
    world = make_world(pieces.text(), pieces.files, parameters)
    world.__dict__["pieces"] = pieces
    return world
