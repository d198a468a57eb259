"""Saved worlds that somebody else may have written: all of one is checked before anything of it runs."""

import copy
import dataclasses
import hashlib
import json
import os
import random
import re
from pathlib import Path

import pytest

from trees import make_world
from vrx_mj import Simulation
from vrx_mj.errors import StateError, VrxWarning
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.mjcf.pieces import Piece, Pieces
from vrx_mj.mjcf.saved import ATTRIBUTES, contents_of
from vrx_mj.mjcf.world import World, world_of
from vrx_mj.model.world import joined_entries, json_entries, tree_of
from vrx_mj.packages import root

RAFT = {"name": "raft", "pose": [20, 0, 0, 0, 0, 0.3], "dynamic": True, "layout": "X  X\nX  X\nXXXX\n"}
WORLDS = {
    "docking": ("scan_dock_deliver", None),
    "swimmers": ("wildlife_task", None),
    "rafts": ({"extends": "ocean_buoys", "docks": [RAFT]}, {"usv_count": 2, "engines": "hinged", "thrusters": "X"}),
    "gates": ("gymkhana", None),
}
SPANS = ("station", "thruster", "element", "waypoint")
NUMBERS = {f"{kind}_{end}" for kind in SPANS for end in ("start", "count")}
NUMBERS |= {"follower", "hull", "race", "block", "parent", "depth", "profile", "mapping", "shape"}


@pytest.fixture(scope="module")
def worlds():
    return {name: compile_world(world, fleet=fleet) for name, (world, fleet) in WORLDS.items()}


def loaded(world, tree=None, mjcf=None, assets=None, files=None):
    """The world again, through its saved form, of which a part is another."""
    files = dict(world.files() if files is None else files)
    if tree is not None:
        files["scene.json"] = json.dumps(tree).encode()
    if mjcf is not None:
        files["scene.xml"] = mjcf.encode()
    files |= {f"assets/{name}": content for name, content in (assets or {}).items()}
    return world_of(files.__getitem__, "scene", "")


def former(world, mjcf=None):
    """The files of a world as they were without pieces."""
    parameters = joined_entries(json_entries(dataclasses.replace(world.parameters, format=3)))
    files = {"scene.json": parameters.encode(), "scene.xml": (mjcf or world.mjcf).encode()}
    return files | {f"assets/{name}": content for name, content in world.assets.items()}


def forged(world, old, new):
    """The files of a world with another text in one of its pieces, which are named and joined as they should be."""
    pieces = world.pieces
    kinds = {part.piece.file: part.piece for part in pieces.parts} | {pieces.own.file: pieces.own}
    at = next(file for file, piece in kinds.items() if old in piece.text)
    kinds[at] = Piece(kinds[at].text.replace(old, new, 1), kinds[at].files)
    parts = tuple(dataclasses.replace(part, piece=kinds[part.piece.file]) for part in pieces.parts)
    return World(Pieces(kinds[pieces.own.file], parts), world.parameters).files()


def refusal(*args, **kwargs):
    with pytest.raises(StateError) as refused:
        loaded(*args, **kwargs)
    return str(refused.value)


def changed(world, *path, to):
    """The parameters of a world with another value at a path."""
    return replaced(dict(tree_of(world.parameters)), path, to)


def replaced(tree, path, to):
    """A tree with another value at a path; the parts beside it are the same ones."""
    tree = owner = copy.copy(tree)
    for step in path[:-1]:
        owner[step] = copy.copy(owner[step])
        owner = owner[step]
    owner[path[-1]] = to
    return tree


@pytest.mark.parametrize("name", WORLDS)
def test_a_world_that_we_wrote_is_accepted_whole(worlds, name):
    world = worlds[name]
    for again in (loaded(world), loaded(world, files=former(world))):
        assert (again.sha256, again.mjcf, again.assets) == (world.sha256, world.mjcf, world.assets)
        assert again.parameters == world.parameters


def test_a_folder_that_a_former_version_wrote_loads(tmp_path):
    """Written by `World.save` of format 3: two skiffs, a moored floating dock, a buoy and a task."""
    with pytest.warns(VrxWarning, match=r"^the world .+ is of physics version 1, and this is \d+: equal runs"):
        world = World.load(Path(__file__).parents[2] / "golden" / "world_3")
    assert world.sha256 == "7d2328e38d6acc71e0c72bad0f99e051f1c50043be97135a885820814deb77f6"
    world.save(tmp_path)
    assert json.loads((tmp_path / "scene.json").read_text("utf-8"))["format"] == 4
    ends = []
    with pytest.warns(VrxWarning, match="is of physics version 1"):
        again = World.load(tmp_path)
    for sim in (Simulation(world), Simulation(again)):
        sim.remove("b")
        sim.spawn("c", robot="skiff", pose=[0, 15, 0.1, 0, 0, 0])
        sim.step({}, duration=0.5)
        ends.append(sim.get_state().sha256)
    assert ends[0] == ends[1]


def numbers_of(tree, path=()):
    """Paths of all whole numbers by which rows point at others."""
    for key, value in tree.items() if isinstance(tree, dict) else enumerate(tree):
        if isinstance(value, dict | list):
            yield from numbers_of(value, (*path, key))
        elif key in NUMBERS and isinstance(value, int):
            yield (*path, key), value


@pytest.mark.parametrize("name", WORLDS)
def test_no_number_can_point_at_a_row_that_is_not_meant(worlds, name):
    tree = dict(tree_of(worlds[name].parameters))
    paths = list(numbers_of(tree))
    chance = random.Random(1)
    seen = {path[-1] for path, _ in paths}
    assert seen >= {"station_start", "thruster_count", "element_start", "hull", "race"}
    for column in dict.fromkeys((path[0], path[-1]) for path, _ in paths):
        path, value = chance.choice([pair for pair in paths if (pair[0][0], pair[0][-1]) == column])
        for wrong in (-2 if path[-1] == "race" else -1, value + 1000, 2**63):  # a race of -1 is none
            if wrong != value:
                assert "scene.json is damaged: " in refusal(worlds[name], replaced(tree, path, wrong)), path


@pytest.mark.parametrize(
    ("path", "to", "message"),
    [
        (("hulls", 0, "thruster_count"), 9, "hulls[0].thruster_start: there is no row 8 among 2 thrusters"),
        (("hulls", 0, "thruster_start"), 5, "hulls[0].thruster_start: there is no row 6 among 2 thrusters"),
        (("thrusters", 1, "hull"), 7, "thrusters[1].hull: there is no row 7 among 1 hulls"),
        (("thrusters", 0, "race"), 2, "thrusters[0].race: there is no row 2 among 2 thrusters"),
        (("thrusters", 0, "body"), "world", "thrusters[0].body: 'world' is not the hull or a body on its own hinge"),
        (("floats", 0, "element_start"), 10**6, "floats[0].element_start: there is no row 1000000 among 4 elements"),
        (("floats", 0, "mass"), -1.0, "floats[0].mass: must be above 0, got -1"),
        (("floats", 0, "body"), "wamv/base_link",
         "floats[0].body: 'wamv/base_link' is not 'blue_projectile/link', the body of the object 'blue_projectile'"),
        (("sea", "waves", 0, "amplitude"), "high",
         "sea.waves[0].amplitude: expected a number, got 'high'"),
        (("sea", "waves"), {}, "sea.waves: expected a list, got no keys"),
        (("task", "boat"), "nobody", "task.boat: there is no boat 'nobody'"),
        (("task", "anchor"), "pier", "task.anchor: there is no object or dock 'pier'"),
        (("task", "type"), "regatta", "task.type: expected stationkeeping, "),
        (("task", "rivals", 0), "sun", "task.rivals: they are not those of the contact sensors in the MJCF"),
        (("boats", 0, "name"), "../wamv", "boats[0].name: string should match pattern "),
        (("sensors", 0, "config", "rate"), 1e9, "sensors[0].config.camera.rate: must be at most 10000, got "),
        (("sensors", 0, "body"), "world", "sensors[0].body: 'world' is not the hull of wamv"),
        (("sensors", 0, "rotation", 0), [0.0, 0.0, 0.0], "sensors[0].rotation: expected the rows of a rotation, got "),
        (("thrusters", 0, "rotation", 2, 2), -1.0, "thrusters[0].rotation: expected the rows of a rotation, got "),
        (("lights", 0, "pattern", 0), "pink", "lights[0].pattern: no colour 'pink'"),
        (("placards", 0, "symbol"), "red_heart", "placards[0].symbol: no symbol 'red_heart'"),
        (("placards", 0, "body"), "x", "placards[0].body: the MJCF has no body 'x'"),
        (("placards", 0, "geoms", "circle"), ["x"], "placards[0].geoms: the MJCF has no geom 'x'"),
        (("task", "color_sequence", 0), "pink", "task.color_sequence: no colour 'pink'"),
        (("task", "fixed"), {"x": [0.0] * 6}, "task.fixed: 'x' is not an object or dock that never moves"),
        (("timestep",), 0.005, "timestep: 0.005 s, and 0.01 s in the MJCF"),
        (("seed",), -1, "seed: must be at least 0, got -1"),
        (("extra",), 1, "extra: unknown key"),
    ],
)  # fmt: skip
def test_the_message_names_the_place_and_the_value(worlds, path, to, message):
    said = refusal(worlds["docking"], changed(worlds["docking"], *path, to=to))
    assert said.startswith(f"scene.json is damaged: {message}")
    assert len(said) < 400


def test_a_block_cannot_hang_on_one_that_comes_later(worlds):
    tree = changed(worlds["rafts"], "blocks", 1, "parent", to=2)
    said = refusal(worlds["rafts"], tree)
    assert said == "scene.json is damaged: blocks[1].parent: 2 is not a block of its dock that comes before"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (b"", "scene.json is damaged: not JSON: EOF while parsing a value at line 1 column 0"),
        (b"[]", "scene.json is damaged: expected keys and values, got []"),
        (b'{"format": true}', "scene.json has format true; this version reads 3 and 4"),
        (b'{"format": 3, "format": 3}', "scene.json is damaged: name: required, but missing"),
        (b"[" * 100_000, "scene.json is damaged: not JSON: recursion limit exceeded at line 1 column 202"),
    ],
)
def test_what_is_no_world_at_all_is_said_in_one_line(worlds, text, message):
    world = worlds["gates"]
    with pytest.raises(StateError) as refused:
        world_of({**world.files(), "scene.json": text}.__getitem__, "scene", "")
    assert str(refused.value) == message


def test_an_engine_turns_on_its_own_hinge(worlds):
    first, second = tree_of(worlds["rafts"].parameters)["thrusters"][:2]
    said = refusal(worlds["rafts"], changed(worlds["rafts"], "thrusters", 0, "joint", to=second["joint"]))
    place = f"thrusters[0].body: '{first['body']}'"
    assert said == f"scene.json is damaged: {place} is not the hull or a body on its own hinge"


# The MJCF


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('<mesh name="', '<mesh file="/etc/passwd" content_type="x" name="', "invalid file '/etc/passwd' of <mesh>"),
        ('file="mesh_', 'file="../../mesh_', "invalid file '../../mesh_"),
        ('meshdir="assets"', 'meshdir="/etc"', "invalid meshdir '/etc' of <compiler>"),
        ("<asset>", '<include file="/etc/passwd"/><asset>', "invalid element <include>: not part of a world"),
        ("<asset>", '<extension><plugin plugin="x"/></extension><asset>', "invalid element <extension>: not part of"),
        ("<asset>", '<size memory="900G"/><asset>', "invalid element <size>: not part of a world"),
        ("<asset>", "<!-- <mesh/> --><asset>", "line "),
        ("<asset>", "<![CDATA[<mesh/>]]><asset>", "line "),
        ("<mujoco", '<!DOCTYPE x [<!ENTITY a "b">]><mujoco', "line 1: a tag is needed, got '<!DOCTYPE x "),
        ('width="256"', 'width="99999"', "invalid width '99999' of <texture>"),
        ('timestep="0.01"', 'timestep="1e-300"', "invalid timestep '1e-300' of <option>"),
        ('znear="0.005"', 'znear="nan"', "invalid znear 'nan' of <map>"),
        ('gravity="0 0 -9.8"', 'gravity="0 0 1e308"', "invalid gravity '0 0 1e308' of <option>"),
        ('gravity="0 0 -9.8"', 'gravity="0 0 -1e308"', "invalid gravity '0 0 -1e308' of <option>"),
        ('<flag warmstart="disable"', '<flag warmstart="disable" multiccd="enable"', "invalid attribute multiccd"),
        ('autoreset="disable"', 'autoreset="enable"', "invalid autoreset 'enable' of <flag>"),
        ("</mujoco>", "", "no element found: "),
    ],
)
def test_an_mjcf_that_we_did_not_write_is_refused(worlds, old, new, message):
    world = worlds["docking"]
    assert old in world.mjcf
    for files in (former(world, world.mjcf.replace(old, new, 1)), forged(world, old, new)):
        said = refusal(world, files=files)
        assert re.match(r"(scene|pieces/piece_[0-9a-f]{16})\.xml is damaged: " + re.escape(message), said)
        assert "\n" not in said


def test_nesting_is_limited(worlds):
    world = worlds["gates"]
    deep = "".join(f'<body name="d{number}">' for number in range(600)) + "</body>" * 600
    said = refusal(world, mjcf=world.mjcf.replace("<worldbody>", f"<worldbody>{deep}", 1))
    assert said == "scene.xml is damaged: elements are nested too deeply; at most 500"


def test_a_hull_is_a_body_of_its_own_boat(worlds):
    first, second = worlds["rafts"].parameters.hulls
    said = refusal(worlds["rafts"], changed(worlds["rafts"], "hulls", 0, "body", to=second.body))
    owner = first.body.partition("/")[0]
    assert said == f"scene.json is damaged: hulls[0].body: '{second.body}' is not a free body of {owner}"


def test_a_body_of_a_table_has_to_be_in_the_mjcf(worlds):
    world = worlds["docking"]
    said = refusal(world, mjcf=world.mjcf.replace('<freejoint name="wamv/free" align="false"/>', "", 1))
    assert said == "scene.json is damaged: hulls[0].body: 'wamv/base_link' is not a free body of wamv"


def test_what_floats_is_free_and_blocks_hang_on_hinges(worlds):
    world = worlds["rafts"]
    neither = "neither a free body nor on a hinge of the one it hangs on"
    for table, said in (("floats", "not a free body"), ("blocks", neither)):
        body = getattr(world.parameters, table)[0].body
        held = re.sub(rf'(<body name="{body}"[^>]*>)\s*<freejoint[^>]*/>', r"\1", world.mjcf, count=1)
        assert refusal(world, mjcf=held) == f"scene.json is damaged: {table}[0].body: '{body}' is {said}"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<worldbody/>", "<mujoco> is needed, got <worldbody>"),
        ("<mujoco><worldbody><body/></worldbody></mujoco>", "invalid name '' of <body>: a unique one is needed"),
        ('<mujoco><worldbody><body name="a"><body name="a"/></body></worldbody></mujoco>',
         "invalid name 'a' of <body>: a unique one is needed"),
        ('<mujoco><worldbody><joint name="j"/></worldbody></mujoco>', "invalid <joint> 'j': it is in no body"),
    ],
)  # fmt: skip
def test_bodies_have_names_and_joints_have_bodies(text, message):
    with pytest.raises(StateError) as refused:
        contents_of(text, "scene.xml")
    assert str(refused.value) == f"scene.xml is damaged: {message}"


def test_the_templates_write_nothing_that_is_not_accepted():
    """Not one element or attribute more than the templates write is accepted, nor less."""
    written = {}
    for file in (root() / "templates").glob("*.xml.j2"):
        text = re.sub(r"{#.*?#}|<!--.*?-->", "", file.read_text("utf-8"), flags=re.DOTALL)
        text = re.sub(r"""{{[^}]*'subtree2' if [^}]*}}=""", 'subtree2="" body2=', text)
        for tag, rest in re.findall(r"<([a-z]+)((?:[^<>]|{[{%][^}]*[%}]})*)", re.sub(r"{{.*?}}", "@", text)):
            written.setdefault(tag, set()).update(re.findall(r"([a-z_0-9]+)=\"", rest))
    assert {tag: set(checks) for tag, checks in ATTRIBUTES.items()} == written


def test_a_long_list_of_digits_takes_no_time_to_refuse():
    contents_of(f'<mujoco><asset><mesh name="a" vertex="{"1 " * 100_000}"/></asset></mujoco>', "scene.xml")
    with pytest.raises(StateError):
        contents_of(f'<mujoco><asset><mesh name="a" vertex="{"1" * 100_000}x"/></asset></mujoco>', "scene.xml")


# Pieces


def with_index(world, change):
    """The files of a world with another list of its pieces."""
    files = world.files()
    index = json.loads(files["scene.pieces.json"])
    change(index)
    return {**files, "scene.pieces.json": json.dumps(index).encode()}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda index: index.update(own="../../piece_0123456789abcdef.xml"), "scene.pieces.json is damaged: own: str"),
        (lambda index: index["parts"][0].update(piece="/etc/passwd"), "scene.pieces.json is damaged: parts[0].piece: "),
        (lambda index: index["parts"][0].update(name=""), "scene.pieces.json is damaged: parts[0].name: string should"),
        (lambda index: index["parts"][0].update(pose=[1e999] * 6), "scene.pieces.json is damaged: parts[0].pose"),
        (lambda index: index["parts"][0].update(extra=1), "scene.pieces.json is damaged: parts[0].extra: unknown key"),
    ],
)
def test_the_list_of_pieces_has_one_form(worlds, change, message):
    world = worlds["rafts"]
    assert refusal(world, files=with_index(world, change)).startswith(message)


@pytest.mark.parametrize(
    "change",
    [lambda parts: parts.pop(), lambda parts: parts[0]["pose"].__setitem__(0, 1.0), lambda parts: parts.clear()],
)
def test_other_pieces_than_those_of_the_mjcf_do_not_count(worlds, change):
    world = worlds["rafts"]
    again = loaded(world, files=with_index(world, lambda index: change(index["parts"])))
    assert again.sha256 == world.sha256
    assert again.pieces.parts == ()


def test_an_mjcf_may_be_edited(worlds):
    edited = worlds["rafts"].mjcf.replace('gravity="0 0 -9.8"', 'gravity="0 0 -9.7"')
    again = loaded(worlds["rafts"], mjcf=edited)
    assert (again.mjcf, loaded(again).mjcf) == (edited, edited)
    assert Simulation(again).model.opt.gravity[2] == -9.7


def test_a_part_has_its_own_bodies_alone(worlds):
    pieces = worlds["rafts"].pieces
    parts = (dataclasses.replace(part, name="a/x") if part.name == "raft" else part for part in pieces.parts)
    files = World(Pieces(pieces.own, tuple(parts)), worlds["rafts"].parameters).files()
    assert refusal(worlds["rafts"], files=files) == "scene.pieces.json is damaged: a/x has bodies of other parts"


@pytest.mark.parametrize(
    ("more", "said"), [(0, "scene is damaged: "), (1, "scene has 1,001 characters; at most 1,000 ")]
)
def test_a_text_has_so_many_characters(more, said, monkeypatch):
    monkeypatch.setattr("vrx_mj.mjcf.saved._MOST_CHARACTERS", 1000)
    with pytest.raises(StateError) as caught:
        contents_of("<" * (1000 + more), "scene")
    assert str(caught.value).startswith(said)


def test_pieces_are_not_joined_without_end(worlds, monkeypatch):
    world = worlds["rafts"]
    monkeypatch.setattr("vrx_mj.mjcf.saved._MOST_CHARACTERS", 2 * len(world.mjcf))
    said = refusal(world, files=with_index(world, lambda index: index["parts"].extend(index["parts"] * 3)))
    assert re.fullmatch(r"scene\.pieces\.json has pieces of [0-9,]+ characters; at most [0-9,]+ are read", said)


def test_each_block_of_a_piece_is_whole(worlds):
    """Blocks that are only well formed once they are joined could hide what a model without visuals has."""
    world = worlds["gates"]
    own = world.pieces.own
    first = next(part for part in world.pieces.parts if "<body " in part.piece.text)
    torn = first.piece.with_blocks(bodies=first.piece.blocks["bodies"].rstrip().removesuffix("</body>"))
    parts = tuple(dataclasses.replace(part, piece=torn) if part is first else part for part in world.pieces.parts)
    index = {
        "own": own.file,
        "parts": [{"name": part.name, "piece": part.piece.file, "pose": part.pose} for part in parts],
    }
    files = {
        **world.files(),
        f"pieces/{torn.file}": torn.text.encode(),
        "scene.pieces.json": json.dumps(index).encode(),
    }
    assert refusal(world, files=files).startswith(f"pieces/{torn.file} is damaged: mismatched tag: ")


def test_a_piece_has_the_content_that_its_name_says(worlds):
    files = worlds["gates"].files()
    name = next(name for name in files if name.startswith("pieces/"))
    said = refusal(worlds["gates"], files={**files, name: files[name].replace(b"0", b"1", 1)})
    digits = f"the content of '{name.removeprefix('pieces/')}' does not match the hash in its name"
    assert said == f"{name} is damaged: {digits}"


@pytest.mark.parametrize("text", [b"", b"\xff", b'<!DOCTYPE x [<!ENTITY a "b">]><mujoco/>', b"<a><a>"])
def test_a_piece_that_we_did_not_write_is_refused(worlds, text):
    name = f"piece_{hashlib.sha256(text).hexdigest()[:16]}.xml"
    files = with_index(worlds["gates"], lambda index: index["parts"][0].update(piece=name))
    said = refusal(worlds["gates"], files={**files, f"pieces/{name}": text})
    assert " is damaged: " in said
    assert "\n" not in said


# Files


def test_an_asset_has_the_content_that_its_name_says(worlds):
    world = worlds["docking"]
    name = sorted(world.assets)[0]
    said = refusal(world, assets={**world.assets, name: b"v 0 0 0\n"})
    assert said == f"scene.xml is damaged: the content of '{name}' does not match the hash in its name"
    digits = name.rpartition("_")[2].partition(".")[0]
    assert hashlib.sha256(world.assets[name]).hexdigest().startswith(digits)


@pytest.mark.parametrize(
    ("limit", "said"),
    [("_MOST_ASSETS", r"scene names \d+ files; at most 1 are read"),
     ("_LARGEST_ASSETS", r"scene names files of [0-9,]+ bytes up to '[a-z0-9_]+\.\w+': too many")],
)  # fmt: skip
def test_assets_are_few_and_small_enough(worlds, limit, said, monkeypatch):
    monkeypatch.setattr(f"vrx_mj.mjcf.saved.{limit}", 1)
    assert re.fullmatch(said.replace("scene", r"scene\.xml"), refusal(worlds["docking"]))


def test_a_mesh_is_as_large_as_its_header_says(worlds):
    """An STL file of 84 bytes that says it has four thousand million triangles."""
    world = worlds["docking"]
    name = next(name for name in sorted(world.assets) if name.endswith(".stl"))
    content = b"\0" * 80 + b"\xff" * 4
    evil = f"land_sand_{hashlib.sha256(content).hexdigest()[:12]}.stl"
    said = refusal(world, mjcf=world.mjcf.replace(name, evil), assets={**world.assets, evil: content})
    assert said == f"scene.xml is damaged: mesh {evil} has more or fewer triangles than its header says"


def test_a_mesh_has_few_enough_triangles(worlds):
    """MuJoCo takes 1.2 GB for an OBJ of 50 MB with triangles alone."""
    world = worlds["docking"]
    name = next(name for name in sorted(world.assets) if name.endswith(".obj"))
    content = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf" + b" 1 2 3" * 70_000
    evil = f"land_sand_{hashlib.sha256(content).hexdigest()[:12]}.obj"
    said = refusal(world, mjcf=world.mjcf.replace(name, evil), assets={**world.assets, evil: content})
    assert said == f"scene.xml is damaged: mesh {evil} has more than 200,000 triangles"


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with names on this system")
def test_a_pipe_in_the_place_of_a_file_is_not_waited_for(worlds, tmp_path):
    worlds["gates"].save(tmp_path)
    name = sorted(worlds["gates"].assets)[0]
    (tmp_path / "assets" / name).unlink()
    os.mkfifo(tmp_path / "assets" / name)
    with pytest.raises(StateError) as refused:
        World.load(tmp_path)
    assert str(refused.value) == f"{tmp_path / 'assets' / name} cannot be read: it is a pipe, not a file"


def test_a_missing_asset_is_named(worlds, tmp_path):
    worlds["gates"].save(tmp_path)
    name = sorted(worlds["gates"].assets)[0]
    (tmp_path / "assets" / name).unlink()
    with pytest.raises(StateError) as refused:
        World.load(tmp_path)
    assert str(refused.value) == f"{tmp_path / 'assets' / name} cannot be read: No such file or directory"


def test_a_world_made_by_hand_is_not_written_outside_its_folder(worlds, tmp_path):
    world = worlds["gates"]
    evil = make_world(world.mjcf, {"../../evil.obj": b"v 0 0 0"}, world.parameters)
    with pytest.raises(StateError) as refused:
        evil.save(tmp_path / "a" / "b")
    assert str(refused.value) == "invalid asset name '../../evil.obj': a file name without folders is needed"
    assert list(tmp_path.rglob("*.obj")) == []
