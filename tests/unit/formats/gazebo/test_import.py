"""`vrx-mj import`: what is written loads, compiles and sails as the original does, and nothing else is touched."""

import os
import re
import shutil
import warnings
from pathlib import Path

import pytest
import yaml

from gazebo_files import classic_text, newer_text
from sdf_boats import BOATS
from vrx_mj.cli.files import import_
from vrx_mj.config.world import load_world
from vrx_mj.errors import ConfigError, VrxError, VrxWarning
from vrx_mj.formats.gazebo.importing import HEAD, TITLE, import_files
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.model.world import joined_entries, json_entries
from vrx_mj.runtime.simulation import Simulation
from workspaces import PRACTICE, TWO_BOATS, write_workspace

pytestmark = pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
BOX = '<collision name="c"><geometry><box><size>{size} 1 1</size></box></geometry></collision>'
RAFT = '<link name="l"><inertial><mass>50</mass></inertial>' + BOX + "</link>"
STL = b"solid a\nendsolid a\n"


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def sdf(body):
    """The file of a world."""
    return f'<sdf version="1.6"><world name="bay">{body}</world></sdf>'


def model(name, body):
    """The file of a model."""
    return f'<sdf version="1.6"><model name="{name}">{body}</model></sdf>'


def written(**files):
    """Write files, whose names have `__` for a `/` and `_` for the last dot."""
    for name, text in files.items():
        path = Path(name.replace("__", "/").replace("_dot_", "."))
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


def imported(source, folder="out", arguments=None):
    """Import as the command does."""
    import_(Path(source), Path(folder), arguments)
    return Path(folder)


def same(name):
    """What a world's file says, in an order of its own."""
    said = load_world(name).model_dump(exclude={"name", "description", "folder"})
    said["objects"] = sorted(said["objects"], key=lambda thing: thing["name"])
    return said


@pytest.mark.parametrize("name", ["example_course", "wildlife_task", "vrx2019/dock", "vrx2023/gymkhana_task"])
def test_what_is_written_is_what_was_read(name):
    Path("bay.world").write_text(newer_text(name) if "2023" in name else classic_text(name), encoding="utf-8")
    imported("bay.world")
    assert same("out/bay.yaml") == same("bay.world")
    assert Path("out/bay.yaml").read_text(encoding="utf-8").startswith(f"{HEAD}bay.world\n")


def test_models_of_a_world_are_objects_of_ours():
    written(bay_dot_world=sdf(f'<model name="raft">{RAFT.format(size=1)}</model><include><uri>model://hull</uri></include>'),
            hull__model_dot_sdf=model("hull", RAFT.format(size=2)))  # fmt: skip
    imported("bay.world")
    assert sorted(path.name for path in Path("out/objects").iterdir()) == ["hull.yaml", "raft.yaml"]
    assert [thing.model for thing in load_world("out/bay.yaml").objects] == [
        "./objects/raft.yaml",
        "./objects/hull.yaml",
    ]


def test_a_composite_is_written_with_its_parts():
    written(course__model_dot_sdf=model("course", "<include><uri>model://hull</uri></include>"),
            hull__model_dot_sdf=model("hull", RAFT.format(size=2)),
            bay_dot_world=sdf("<include><uri>model://course</uri></include>"))  # fmt: skip
    imported("bay.world")
    course = yaml.safe_load(Path("out/objects/course.yaml").read_text(encoding="utf-8"))
    assert course["objects"][0]["model"] == "./hull.yaml"
    load_world("out/bay.yaml")


def test_models_of_one_name_are_numbered():
    for folder, size in (("a", 1), ("b", 2)):
        written(**{f"all__{folder}__{folder}_dot_world": sdf(f'<model name="raft">{RAFT.format(size=size)}</model>')})
    imported("all")
    sizes = [
        yaml.safe_load(Path(f"out/objects/{name}.yaml").read_text(encoding="utf-8"))["collisions"][0]["size"][0]
        for name in ("raft", "raft_2")
    ]
    assert sizes == [1, 2]
    assert load_world("out/b.yaml").objects[0].model == "./objects/raft_2.yaml"


def test_worlds_of_one_name_are_numbered():
    for folder, gravity in (("a", 1), ("b", 2)):
        written(**{f"all__{folder}__bay_dot_world": sdf(f"<gravity>0 0 -{gravity}</gravity>")})
    imported("all")
    assert [load_world(f"out/{name}.yaml").physics.gravity for name in ("bay", "bay_2")] == [1, 2]


def test_meshes_are_copied():
    mesh = '<visual name="v"><geometry><mesh><uri>model://hull/meshes/a.stl</uri></mesh></geometry></visual>'
    written(hull__model_dot_sdf=model("hull", f'<static>true</static><link name="l">{mesh}</link>'),
            bay_dot_world=sdf("<include><uri>model://hull</uri></include>"))  # fmt: skip
    Path("hull/meshes").mkdir()
    Path("hull/meshes/a.stl").write_bytes(STL)
    imported("bay.world")
    assert Path("out/objects/meshes/hull/meshes/a.stl").read_bytes() == STL
    found = yaml.safe_load(Path("out/objects/hull.yaml").read_text(encoding="utf-8"))
    assert found["visuals"][0]["file"] == "meshes/hull/meshes/a.stl"


@pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
def test_meshes_of_one_name_of_a_boat_are_two_files(tmp_path, monkeypatch):
    shelf, mesh = tmp_path.parent / f"{tmp_path.name}_shelf", '<visual name="{0}"><geometry><mesh><uri>package://{0}'
    for name in "ab":
        (shelf / name / "meshes").mkdir(parents=True)
        (shelf / name / "meshes/hull.obj").write_text(tetrahedron(1), encoding="utf-8")
    monkeypatch.setenv("VRX_MJ_PACKAGE_PATH", os.pathsep.join(str(shelf / name) for name in "ab"))
    shapes = "".join(f"{mesh.format(name)}/meshes/hull.obj</uri></mesh></geometry></visual>" for name in "ab")
    Path("skiff.sdf").write_text(BOATS["skiff"]().replace("</link>", f"{shapes}</link>", 1), encoding="utf-8")
    made = import_files(Path("skiff.sdf"))
    named = re.findall(r'<mesh filename="([^"]*)"', made.texts["robots/skiff.urdf"])
    assert [made.copies[f"robots/{name}"] for name in named] == [shelf / name / "meshes/hull.obj" for name in "ab"]


@pytest.mark.slow
def test_meshes_of_other_folders_are_copied_and_sail_alike(monkeypatch):
    uris = ("meshes/a.obj", "model://crate/meshes/a.obj", "../../meshes/a.obj", "package://ports/meshes/a.obj")
    mesh = '<{0} name="{1}"><geometry><mesh><uri>{2}</uri></mesh></geometry></{0}>'
    tags = ("visual", "visual", "collision", "visual")
    shapes = "".join(mesh.format(tag, index, uri) for index, (tag, uri) in enumerate(zip(tags, uris, strict=True)))
    body = f'<static>true</static><link name="l">{shapes}</link>'
    written(ws__ports__package_dot_xml="<package><name>ports</name></package>",
            ws__ports__models__hull__model_dot_sdf=model("hull", body),
            ws__ports__models__hull__meshes__a_dot_obj=tetrahedron(1), ws__ports__meshes__a_dot_obj=tetrahedron(2),
            shelf__crate__model_dot_sdf=model("crate", RAFT), shelf__crate__meshes__a_dot_obj=tetrahedron(3),
            ws__ports__bay_dot_world=sdf("<include><uri>model://hull</uri></include>"))  # fmt: skip
    monkeypatch.setenv("GAZEBO_MODEL_PATH", str(Path("shelf").absolute()))
    first = compiled("ws/ports/bay.world", "single")
    imported("ws/ports/bay.world")
    copies = {path.read_text(encoding="utf-8") for path in Path("out/objects/meshes").rglob("*.obj")}
    assert copies == {tetrahedron(size) for size in (1, 2, 3)}
    monkeypatch.delenv("GAZEBO_MODEL_PATH")
    shutil.rmtree("ws")
    shutil.rmtree("shelf")
    second = compiled("out/bay.yaml", "single")
    ends = []
    for world in (first, second):
        simulation = Simulation(world)
        simulation.reset(seed=7)
        simulation.step({world.boats[0]: {"left": 0.5, "right": 0.4}}, duration=2.0)
        sizes = sorted(simulation.model.mesh_vertnum.tolist())
        ends.append((simulation.data.qpos.tobytes(), sizes, simulation.model.geom_size.sum()))
    assert ends[0] == ends[1]


def test_a_mesh_that_is_a_link_out_of_the_folder_is_not_copied(tmp_path):
    mesh = '<visual name="v"><geometry><mesh><uri>a.stl</uri></mesh></geometry></visual>'
    written(ws__hull__model_dot_sdf=model("hull", f'<static>true</static><link name="l">{mesh}</link>'),
            ws__bay_dot_world=sdf("<include><uri>model://hull</uri></include>"))  # fmt: skip
    Path("secret.stl").write_bytes(STL)
    Path("ws/hull/a.stl").symlink_to(tmp_path / "secret.stl")
    made = import_files(Path("ws/bay.world"))
    assert made.copies == {}
    (note,) = [note for note in dict.fromkeys(made.notes) if note.fate == "ignored"]
    assert (
        note.ours
        == "'a.stl' is outside the folders that may be read: ws/hull; add its folder with --allow FOLDER or VRX_MJ_PATH"
    )


def test_links_in_a_folder_lead_nowhere_else(tmp_path):
    written(ws__bay_dot_world=sdf(""), other_dot_world=sdf(""))
    Path("ws/other.world").symlink_to(tmp_path / "other.world")
    assert list(import_files(Path("ws")).texts) == ["bay.yaml"]


def test_a_launch_file_is_a_world_and_a_fleet(capsys):
    node = (
        '<node pkg="gazebo_ros" type="spawn_model" name="s{n}" args="-urdf -param d -model cat{n} -x {n} -y 0 -Y 1"/>'
    )
    body = (
        '<include file="$(find gazebo_ros)/launch/empty_world.launch">'
        '<arg name="world_name" value="$(dirname)/bay.world"/></include>'
        '<param name="d" command="$(find xacro)/xacro $(find wamv_gazebo)/urdf/wamv_gazebo.urdf.xacro"/>'
    )
    written(bay_dot_world=sdf(""), cats_dot_launch=f"<launch>{body}{node.format(n=1)}{node.format(n=9)}</launch>")
    imported("cats.launch")
    fleet = yaml.safe_load(Path("out/cats_fleet.yaml").read_text(encoding="utf-8"))
    assert [(boat["name"], boat["pose"][0]) for boat in fleet["boats"]] == [("cat1", 1.0), ("cat9", 9.0)]
    said = capsys.readouterr().out.splitlines()
    assert said[-1] == f"to sail: vrx-mj run {Path('out/bay.yaml')} --fleet {Path('out/cats_fleet.yaml')}"


def test_robots_of_one_name_of_several_launch_files_are_numbered():
    urdf = '<robot name="raft"><link name="base_link"><inertial><mass value="{}"/></inertial></link></robot>'
    launch = (
        '<launch><param name="d" textfile="boat.urdf"/>'
        '<node pkg="gazebo_ros" type="spawn_model" name="s" args="-urdf -model raft -param d"/></launch>'
    )
    for folder, mass in (("one", 10), ("two", 20), ("copy", 20)):
        written(**{f"teams__{folder}__boat_dot_urdf": urdf.format(mass)})
        written(**{f"teams__{folder}__{folder}_dot_launch": launch})
    imported("teams")
    texts = {path.name: path.read_text(encoding="utf-8") for path in Path("out/robots").iterdir()}
    assert texts == {"raft.urdf": urdf.format(20), "raft_2.urdf": urdf.format(10)}
    robots = {name: yaml.safe_load(Path(f"out/{name}_fleet.yaml").read_text(encoding="utf-8"))["boats"][0]["robot"]
              for name in ("one", "two", "copy")}  # fmt: skip
    assert robots == {"one": "./robots/raft_2.urdf", "two": "./robots/raft.urdf", "copy": "./robots/raft.urdf"}


def test_boats_in_sdf_of_one_name_are_numbered():
    boat = BOATS["raft"]()
    mass = re.search(r"<mass>(.+?)</mass>", boat)[1]
    for folder, text in (("one", boat), ("two", boat.replace(f"<mass>{mass}<", "<mass>77<", 1))):
        written(**{f"teams__{folder}__raft__model_dot_sdf": text})
    imported("teams")
    masses = {}
    for name in ("raft", "raft_2"):
        robot = yaml.safe_load(Path(f"out/{name}_fleet.yaml").read_text(encoding="utf-8"))["robot"]
        assert robot == f"./robots/{name}.urdf"
        text = Path(f"out/robots/{name}.urdf").read_text(encoding="utf-8")
        masses[name] = {float(value) for value in re.findall(r'<mass value="(.+?)"', text)}
    assert 77.0 not in masses["raft"]
    assert 77.0 in masses["raft_2"]


def test_the_command_to_sail_with_can_be_pasted_into_a_shell(capsys):
    written(bay_dot_world=sdf(""))
    imported("bay.world", "my course")
    assert capsys.readouterr().out.splitlines()[-1] == (
        f'to sail: vrx-mj run "{Path("my course/bay.yaml")}" --fleet none'
    )


def test_a_folder_says_what_it_could_not_read(capsys):
    written(all__good_dot_world=sdf(""), all__bad_dot_world="<sdf>", all__build__old_dot_world="<sdf>")
    out = imported("all")
    said = "not read: all/bad.world:1:6: the file ends before </sdf>, which ends the <sdf> of line 1\n"
    assert capsys.readouterr().err == said
    assert said.removeprefix("not read: ") in (out / "import.md").read_text(encoding="utf-8")
    assert (out / "good.yaml").exists()


def test_the_table_shows_tags_as_they_are():
    written(bay_dot_world=sdf('<road name="a|b&lt;script&gt;"/>'))
    table = (imported("bay.world") / "import.md").read_text(encoding="utf-8")
    assert table.startswith(TITLE)
    assert "| bay.world:1 | &lt;road&gt; 'a\\|b&lt;script&gt;' | ignored | roads are not drawn |" in table


def test_the_name_of_a_file_cannot_add_keys():
    Path("a\nsea: 5.world").write_text(sdf(""), encoding="utf-8")
    (text,) = import_files(Path("a\nsea: 5.world")).texts.values()
    assert text.splitlines()[0] == f"{HEAD}a\\nsea: 5.world"


def test_an_import_may_be_done_again():
    written(bay_dot_world=sdf(""))
    imported("bay.world")
    written(bay_dot_world=sdf("<gravity>0 0 -5</gravity>"))
    imported("bay.world")
    assert load_world("out/bay.yaml").physics.gravity == 5


@pytest.mark.parametrize("name", ["bay.yaml", "import.md", "objects/raft.yaml"])
def test_files_of_others_are_not_written_over(name):
    written(bay_dot_world=sdf(f'<model name="raft">{RAFT.format(size=1)}</model>'))
    path = Path("out") / name
    path.parent.mkdir(parents=True)
    path.write_text("mine", encoding="utf-8")
    with pytest.raises(VrxError) as caught:
        imported("bay.world")
    assert str(caught.value) == f"{path} exists and is not of an import: choose another folder"
    assert [one for one in Path("out").rglob("*") if one.is_file()] == [path]


def test_a_pipe_in_the_folder_is_not_waited_for():
    written(bay_dot_world=sdf(""))
    Path("out").mkdir()
    os.mkfifo("out/bay.yaml")
    with pytest.raises(VrxError) as caught:
        imported("bay.world")
    assert str(caught.value) == f"{Path('out/bay.yaml')} exists and is not of an import: choose another folder"


def test_a_file_in_the_place_of_the_folder():
    written(bay_dot_world=sdf(""), out="mine")
    with pytest.raises(VrxError) as caught:
        imported("bay.world")
    assert str(caught.value).startswith("cannot write the import 'out/bay.yaml': ")


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_that_may_not_be_written():
    written(bay_dot_world=sdf(""))
    Path("out").mkdir(mode=0o500)
    with pytest.raises(VrxError) as caught:
        imported("bay.world")
    assert str(caught.value) == "cannot write the import 'out/bay.yaml': Permission denied"


def test_arguments_choose_what_a_xacro_makes():
    text = sdf("<gravity>0 0 ${-float(xacro.arg('g'))}</gravity>").replace(
        "<world ", '<xacro:arg name="g" default="9"/><world '
    )
    written(bay_dot_world_dot_xacro=text.replace("<sdf ", '<sdf xmlns:xacro="http://ros.org/wiki/xacro" '))
    imported("bay.world.xacro", arguments=["g:=3"])
    assert load_world("out/bay.yaml").physics.gravity == 3


def compiled(name, fleet=None):
    """What a world compiles to: MJCF and parameters, without its name."""
    from vrx_mj.mjcf.compile import compile_world

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", VrxWarning)
        return compile_world(name, fleet=fleet)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["stationkeeping_task", "vrx2019/dock"])
def test_both_compile_to_the_same_and_sail_alike(name):
    from vrx_mj import Simulation

    Path("bay.world").write_text(classic_text(name), encoding="utf-8")
    imported("bay.world")
    first, second = compiled("bay.world"), compiled("out/bay.yaml")
    texts = [joined_entries(json_entries(one.parameters)) for one in (first, second)]
    assert texts[0].replace("robotx_example_course", "bay") == texts[1]
    ends = []
    for world in (first, second):
        simulation = Simulation(world)
        simulation.reset(seed=7)
        for _ in range(10):
            seen = simulation.step({world.boats[0]: {"left": 0.6, "right": 0.4}}, duration=1.0)
        ends.append(seen[world.boats[0]].position.tolist())
    assert ends[0] == ends[1]


@pytest.mark.slow
def test_a_workspace_sails_as_it_is_and_imported_alike():
    write_workspace(Path("ws"))
    made = imported("ws")
    for name in (PRACTICE, TWO_BOATS):
        ends = []
        for world, fleet in (
            (f"ws/src/team_gazebo/launch/{name}", None),
            (made / "practice.yaml", made / f"{name.removesuffix('.launch')}_fleet.yaml"),
        ):
            sim = Simulation(compile_world(world, fleet=fleet))
            sim.reset(seed=3)
            boats = sim.step({key: {"left": 0.5, "right": 0.2} for key in sim.world.boats}, duration=2.0)
            ends.append({name: boats[name].position.tolist() for name in sim.world.boats})
        assert ends[0] == ends[1]
        assert not Path("owned").exists()


BOAT = """<robot name="tug" xmlns:xacro="http://ros.org/wiki/xacro">
  <xacro:include filename="parts.xacro"/>
  <xacro:hull length="$(arg length)"/>
</robot>"""
PARTS = """<robot xmlns:xacro="http://ros.org/wiki/xacro">
  <xacro:arg name="length" default="2"/>
  <xacro:macro name="hull" params="length">
    <link name="base_link">
      <inertial><mass value="60"/><inertia ixx="10" iyy="20" izz="25" ixy="0" ixz="0" iyz="0"/></inertial>
      <collision><geometry><box size="${length} 1 0.4"/></geometry></collision>
      <visual><geometry><mesh filename="package://tugs/meshes/deck.obj"/></geometry></visual>
      <visual><geometry><mesh filename="../others/meshes/deck.obj"/></geometry></visual>
    </link>
  </xacro:macro>
</robot>"""
LAUNCH = """<launch>
  <include file="$(find gazebo_ros)/launch/empty_world.launch">
    <arg name="world_name" value="$(find wave_gazebo)/worlds/ocean.world"/></include>
  <param name="one" command="xacro $(find tugs)/urdf/tug.urdf.xacro length:=4 namespace:=a"/>
  <param name="two" command="xacro $(find tugs)/urdf/tug.urdf.xacro"/>
  <node name="s1" pkg="gazebo_ros" type="spawn_model" args="-y 0 -urdf -param one -model a"/>
  <node name="s2" pkg="gazebo_ros" type="spawn_model" args="-y 9 -urdf -param two -model b"/>
</launch>"""


def tetrahedron(size):
    """A mesh."""
    corners = ["v 0 0 0", f"v {size} 0 0", f"v 0 {size} 0", f"v 0 0 {size}"]
    return "\n".join([*corners, "f 1 3 2", "f 1 2 4", "f 2 3 4", "f 1 4 3", ""])


def write_tugs():
    """A package with a boat, its macros, its YAML, and a mesh in each of two folders."""
    package = "<package><name>tugs</name></package>"
    files = {"package.xml": package, "urdf/tug.urdf.xacro": BOAT, "urdf/parts.xacro": PARTS,
             "launch/two.launch": LAUNCH,
             "urdf/tug.yaml": "hydrodynamics: {drag_linear: [50, 60, 70, 80, 90, 100]}\narguments: {length: 3}\n",
             "meshes/deck.obj": tetrahedron(1), "others/meshes/deck.obj": tetrahedron(2)}  # fmt: skip
    for name, text in files.items():
        path = Path("tugs") / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


def moved(folder):
    """The folder elsewhere, without what it was made from."""
    shutil.move(folder, "elsewhere")
    shutil.rmtree("tugs")
    return Path("elsewhere")


def test_an_imported_boat_brings_its_macros_meshes_and_yaml_and_needs_nothing_else():
    write_tugs()
    before = compile_world("ocean", fleet="tugs/urdf/tug.urdf.xacro", arguments={"length": "4"})
    imported("tugs/urdf/tug.urdf.xacro", arguments=["length:=4"])
    after = compile_world("ocean", fleet=str(moved("out") / "tug_fleet.yaml"))
    assert (after.parameters.hulls, after.parameters.stations) == (before.parameters.hulls, before.parameters.stations)
    assert after.parameters.hulls[0].drag_linear == (50, 60, 70, 80, 90, 100)
    meshes = {path.relative_to("elsewhere").as_posix() for path in Path("elsewhere").rglob("*.obj")}
    assert meshes == {"robots/meshes/tug/meshes/deck.obj", "robots/meshes/tug/others/meshes/deck.obj"}
    positions = [_sailed(world) for world in (before, after)]
    assert positions[0] == positions[1]


def _sailed(world):
    """Where a boat is after 10 s, by every digit."""
    sim = Simulation(world)
    sim.reset()
    return sim.step(duration=10.0)["wamv"].position.tolist()


def test_two_boats_of_a_launch_file_of_one_xacro_are_two_urdfs():
    write_tugs()
    before = compile_world("ocean", fleet="tugs/launch/two.launch")
    folder = imported("tugs")
    assert sorted(path.name for path in (folder / "robots").iterdir()) == [
        "a.urdf",
        "a.yaml",
        "b.urdf",
        "b.yaml",
        "meshes",
    ]
    table = (folder / "import.md").read_text(encoding="utf-8")
    assert "namespace" not in table
    after = compile_world("ocean", fleet=str(moved("out") / "two_fleet.yaml"))
    assert after.parameters.stations == before.parameters.stations
    assert not any(boat.arguments for boat in after.parameters.boats)


def test_arguments_that_an_imported_boat_does_not_declare_are_refused():
    write_tugs()
    with pytest.raises(ConfigError) as raised:
        import_files(Path("tugs/urdf/tug.urdf.xacro"), {"lenght": "4"})
    assert str(raised.value) == (
        "tugs/urdf/tug.urdf.xacro: lenght:=: no argument named 'lenght'; did you mean 'length'?"
    )


def test_a_file_of_macros_alone_is_no_boat():
    write_tugs()
    with pytest.raises(ConfigError) as raised:
        import_files(Path("tugs/urdf/parts.xacro"))
    message = "only defines macros: 'hull'; name the file that uses them"
    assert str(raised.value) == f"tugs/urdf/parts.xacro: robot: {message}"
    Path("tugs/urdf/parts.xacro").rename("tugs/urdf/parts.urdf.xacro")
    Path("tugs/urdf/tug.urdf.xacro").unlink()
    Path("tugs/launch/two.launch").unlink()
    with pytest.raises(VrxError) as raised:
        import_files(Path("tugs"))
    assert str(raised.value) == "no file to import in tugs: its xacro files only define macros"
