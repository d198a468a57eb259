"""Saved worlds, pictures in them, and saved states."""

import functools
import hashlib
import io
import json
import random
import struct
import tempfile
import xml.etree.ElementTree as ET
import zlib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from fuzz import junk, markup, raw, trees
from fuzz.kind import Files, Kind, write
from fuzz.yaml_files import json_bytes
from vrx_mj import Batch, Simulation, State, World, compile_world
from vrx_mj.mjcf.pieces import Piece, Pieces
from vrx_mj.model.world import joined_entries, json_entries

NAMES = (
    ("my_course", None),
    ("vrx2023/wildlife_task", None),
    ("vrx2023/follow_path_task", None),
    ("gymkhana", None),
    ("vrx2023/scan_dock_deliver_task", None),
    ("ocean_docks", "trio"),
    ("wayfinding_task", "usv_config"),
)
HINGED = {
    "boats": [{"name": "a", "pose": [0, 0, 0.1, 0, 0, 0]}, {"name": "b", "pose": [20, 0, 0.1, 0, 0, 0]}],
    "engines": "hinged",
}
AFLOAT = {
    "extends": "ocean",
    "docks": [{"name": "dock", "layout": "XX\nX ", "pose": [30, 0, 0, 0, 0, 0.3], "dynamic": True, "mooring": {}}],
}
STEPS = 20


@functools.cache
def worlds() -> tuple[World, ...]:
    """Worlds with every table."""
    named = (compile_world(name, fleet=fleet, nudge=True) for name, fleet in NAMES)
    return (*named, compile_world("ocean", fleet=HINGED), compile_world(AFLOAT))


@functools.cache
def saved() -> tuple[dict[str, bytes], ...]:
    """The files of those worlds, in the former format, in which the MJCF is one piece."""
    return tuple(
        {
            "scene.json": joined_entries(json_entries(replace(world.parameters, format=3))).encode(),
            "scene.xml": world.mjcf.encode(),
            **{f"assets/{name}": content for name, content in world.assets.items()},
        }
        for world in worlds()
    )


@functools.cache
def tree_of(number: int) -> Any:
    """The parameters of a saved world."""
    return json.loads(saved()[number]["scene.json"])


def mutated_world(chance: random.Random) -> Files:
    """A saved world: its parameters, its MJCF, its pieces, or one of its assets."""
    number = chance.randrange(len(saved()))
    if chance.random() < 0.25:
        return _pieces(worlds()[number], chance)
    files = saved()[number]
    draw = chance.random()
    if draw < 0.65:
        changed = {"scene.json": _json(number, chance)}
    elif draw < 0.9:
        changed = {"scene.xml": markup.mutated(files["scene.xml"], chance, most=3)}
    else:
        assets = [name for name in files if name.startswith("assets/")]
        name = chance.choice(assets or ["scene.xml"])
        changed = {name: raw.mutated(files[name], chance)}
        if assets and chance.random() < 0.8:
            files, changed = _renamed(files, name, changed[name])
    if chance.random() < 0.03:
        changed |= {"scene.xml": saved()[chance.randrange(len(saved()))]["scene.xml"]}
    return {**changed, **{name: content for name, content in files.items() if name not in changed}}


def _renamed(files: Mapping[str, bytes], name: str, content: bytes) -> tuple[dict[str, bytes], dict[str, bytes]]:
    """An asset of another content under the name that this content has; the other files, and what has changed."""
    stem, _, rest = name.rpartition("_")
    digits, suffix = rest.split(".")
    new = f"{stem}_{hashlib.sha256(content).hexdigest()[: len(digits)]}.{suffix}"
    scene = files["scene.xml"].replace(name.removeprefix("assets/").encode(), new.removeprefix("assets/").encode())
    return {key: value for key, value in files.items() if key != name}, {"scene.xml": scene, new: content}


def _pieces(world: World, chance: random.Random) -> Files:
    """A saved world with another list of pieces, or with another piece, which its name and the MJCF fit if they can."""
    files = world.files()
    if chance.random() < 0.5:
        index = json.loads(files["scene.pieces.json"])
        return {**files, "scene.pieces.json": json_bytes(trees.mutated(index, chance, most=2))}
    at = chance.choice([world.pieces.own, *(part.piece for part in world.pieces.parts)])
    text = markup.mutated(at.text.encode(), chance, most=2)
    try:
        new = Piece(text.decode(), at.files)
        parts = tuple(replace(part, piece=new if part.piece is at else part.piece) for part in world.pieces.parts)
        return World(Pieces(new if world.pieces.own is at else world.pieces.own, parts), world.parameters).files()
    except (ValueError, ET.ParseError):
        return {**files, f"pieces/{at.file}": text}


def _json(number: int, chance: random.Random) -> bytes:
    if chance.random() < 0.08:
        return raw.mutated(saved()[number]["scene.json"], chance)
    return json_bytes(trees.mutated(tree_of(number), chance, most=2))


def run_saved(folder: Path) -> None:
    """Load a saved world, sail it alone and in rows, observe it, and save it again."""
    world = World.load(folder)
    sim = Simulation(world)
    use(sim)
    world.save(folder / "out" / "again")
    if world.parameters.task is None and len(world.mjcf) < 200_000:
        batch = Batch(world, 2)
        batch.step(np.full((2, len(batch.channels)), 0.5), duration=world.parameters.timestep * 5)


def use(sim: Simulation) -> None:
    """Sail with every command, look at everything that can be asked, and go back."""
    sim.reset(seed=3)
    state = sim.get_state()
    sim.step({boat: dict.fromkeys(sim.command_names(boat), 0.7) for boat in sim.boats})
    sim.advance(STEPS)
    sim.observe()
    for boat in sim.boats:
        sim.forces(boat)
    assert sim.visual_model.nq == sim.model.nq
    sim.sea.height(0.0, 0.0, sim.time)
    sim.wind.velocity(sim.time)
    sim.set_state(state)
    sim.advance(2)


@functools.cache
def pictured(*, high: bool) -> dict[str, bytes]:
    """A saved world with a picture: a height field, or a texture."""
    files = dict(saved()[0])
    text = files["scene.xml"].decode()
    assets = '<texture name="t" type="2d" file="t.png"/><material name="m" texture="t"/>'
    geom = '<geom type="box" size="1 1 1" pos="500 500 -5" material="m" contype="0" conaffinity="0" group="2"/>'
    if high:
        assets = '<hfield name="h" file="h.png" size="5 5 1 0.1"/>'
        geom = '<geom type="hfield" hfield="h" pos="500 500 -5"/>'
    text = text.replace("</asset>", f"{assets}</asset>", 1)
    files["scene.xml"] = text.replace("<worldbody>", f"<worldbody>{geom}", 1).encode()
    ramp = np.add.outer(np.arange(16), np.arange(16)).astype(np.uint8) * 8
    files["assets/h.png" if high else "assets/t.png"] = _png(ramp if high else np.dstack([ramp] * 3))
    return files


def _png(pixels: Any) -> bytes:
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "PNG")
    return file.getvalue()


def mutated_picture(chance: random.Random) -> Files:
    """A picture with another header, other chunks, or other bytes."""
    name = "assets/h.png" if chance.random() < 0.2 else "assets/t.png"
    files = pictured(high=name == "assets/h.png")
    content = files[name]
    draw = chance.random()
    if draw < 0.4:
        content = _with_header(content, chance)
    elif draw < 0.6:
        content = _chunked(content, chance)
    elif draw < 0.65:
        content = junk.TEXTS[chance.randrange(len(junk.TEXTS))].encode("utf-8", "replace")
    else:
        content = raw.mutated(content, chance)
    return {name: content, **{key: value for key, value in files.items() if key != name}}


def _with_header(content: bytes, chance: random.Random) -> bytes:
    """Another width, height, depth or kind of colour, with its right checksum."""
    sizes = (0, 1, 15, 17, 1000, 30_000, 65_536, 2**31 - 1, 2**32 - 1)
    width, height = (chance.choice(sizes) if chance.random() < 0.6 else 16 for _ in range(2))
    rest = bytes(chance.choice([old, old, chance.randrange(256)]) for old in content[24:29])
    head = b"IHDR" + struct.pack(">II", width, height) + rest
    return content[:12] + head + struct.pack(">I", zlib.crc32(head)) + content[33:]


def _chunked(content: bytes, chance: random.Random) -> bytes:
    """Pixels that unpack to another length."""
    head = content[:33]
    body = zlib.compress(bytes(chance.choice([0, 10, 300, 10**5, 10**7])))
    chunk = b"IDAT" + body
    end = b"\0\0\0\0IEND\xaeB`\x82" if chance.random() < 0.8 else b""
    return head + struct.pack(">I", len(body)) + chunk + struct.pack(">I", zlib.crc32(chunk)) + end


@functools.cache
def states() -> tuple[bytes, ...]:
    """A state of each world after some steps."""
    found = []
    for world in worlds():
        sim = Simulation(world)
        sim.step({boat: dict.fromkeys(sim.command_names(boat), 0.5) for boat in sim.boats}, duration=100 * sim.timestep)
        found.append(sim.get_state().to_bytes())
    return tuple(found)


@functools.lru_cache(maxsize=8)
def running(number: int) -> Simulation:
    """A simulation of one of the worlds, which goes on from state to state."""
    return Simulation(worlds()[number])


def mutated_state(chance: random.Random) -> Files:
    """A state with another header, other numbers of MuJoCo's, or other bytes of ours."""
    number = chance.randrange(len(states()))
    head, _, body = states()[number].partition(b"\n")
    header = json.loads(head)
    size = 8 * header["mujoco"]
    draw = chance.random()
    if draw < 0.35:
        head = json_bytes(trees.mutated(header, chance))
    elif draw < 0.45 and header["task"]:
        head = json_bytes(header | {"task": json_bytes(trees.mutated(json.loads(header["task"]), chance)).decode()})
    elif draw < 0.65:
        body = _numbers(body, 0, size, chance)
    elif draw < 0.9:
        body = _numbers(body, size, len(body), chance)
    else:
        body = raw.mutated(body, chance)
    return {f"{number}.state": head + b"\n" + body}


def _numbers(body: bytes, start: int, end: int, chance: random.Random) -> bytes:
    """Numbers between two places of a block replaced."""
    data = bytearray(body)
    floats = (float("nan"), float("inf"), 1e308, -1e308, 1e9, -1.0, 0.0, 5e-324, 1e20, 1e5)
    whole = (-1, 0, 1, 2**31, 2**63 - 1, -(2**63), 1000, 255)
    for _ in range(chance.randint(1, 6)):
        at = start + 8 * chance.randrange(max((end - start) // 8, 1))
        new = (
            struct.pack("<d", chance.choice(floats))
            if chance.random() < 0.6
            else struct.pack("<q", chance.choice(whole))
        )
        data[at : at + 8] = new
    return bytes(data)


def go_on(folder: Path) -> None:
    """Load a state, set it, and go on from there."""
    (file,) = folder.glob("*.state")
    state = State.load(file)
    sim = running(int(file.stem))
    try:
        sim.set_state(state)
        sim.step({boat: dict.fromkeys(sim.command_names(boat), 0.7) for boat in sim.boats})
        sim.advance(STEPS)
        sim.observe()
    finally:
        sim.reset()


def warm() -> None:
    """Compile what is compiled at first use."""
    for files in saved():
        with tempfile.TemporaryDirectory() as folder:
            write(files, Path(folder))
            run_saved(Path(folder))
    for high in (False, True):
        pictured(high=high)


KINDS = (
    Kind("saved world", mutated_world, run_saved, warm=warm, names_its_file=False),
    Kind("picture", mutated_picture, run_saved, warm=warm, names_its_file=False),
    Kind("state", mutated_state, go_on, warm=states, names_its_file=False),
)
