import json
import re
import sys
import xml.etree.ElementTree as ET

import mujoco
import pytest

from vrx_mj.formats.parts.compliance import rule_sets
from vrx_mj.formats.parts.read import part_types
from vrx_mj.packages import needs_extra

COMPONENTS = "wamv_camera: [{name: front, x: 0.75}]\nwamv_gps: [{name: gps_wamv, x: -0.85}]\n"
THRUSTERS = "engine: [{prefix: left, position: -2.373776 1.027135 0.318237}]\n"
OUTSIDE = "wamv_camera: [{name: front, x: 0}, {name: back, x: -0.9, y: 0.6}]\n"
LAST = "VRX's own generator, which judges each file by its last part, would say"


@pytest.fixture
def files(folder):
    for name, text in {"c": COMPONENTS, "t": THRUSTERS, "out": OUTSIDE, "empty": ""}.items():
        (folder / f"{name}.yaml").write_text(text, encoding="utf-8")
    return folder


@pytest.mark.usefixtures("files")
def test_a_legal_boat_passes(cli):
    said = cli("robot", "check", "--components", "c.yaml", "--thrusters", "t.yaml")
    assert (said.code, said.err) == (0, "")
    assert "rules of VRX classic, 1.6.1 and later" in said.out
    assert said.out.endswith(f"compliant: all parts pass (3)\n{LAST} compliant; it logs no error\n")
    rows = [[cell.strip() for cell in line.strip("│").split("│")] for line in said.out.splitlines() if "│" in line]
    assert rows == [
        ["wamv_camera", "front", "0.75 0 1.5", "pass: in component_compliance_for"],
        ["wamv_gps", "gps_wamv", "-0.85 0 1.3", "pass: in component_compliance_aft"],
        ["engine", "left", "-2.373776 1.027135 0.318237", "pass: in thruster_compliance_port_aft"],
    ]


@pytest.mark.usefixtures("files")
def test_one_that_is_not_ends_with_one_and_says_where_each_part_may_go(cli):
    said = cli("robot", "check", "--components", "out.yaml")
    assert (said.code, said.err) == (1, "")
    assert "outside every box; it misses component_compliance_for by 0.3 m: 0.3 m too far aft" in said.out
    assert "nearest legal place: 0.3 0 1.5 in component_compliance_for" in said.out
    assert "nearest legal place: -0.9 0.5 1.5 in component_compliance_aft" in said.out
    assert "not compliant: 2 of 2 parts break a rule\nit can still be built and sailed\n" in said.out
    assert said.out.endswith(
        f"{LAST} not compliant; it logs errors on the way, which fails the boat in a competition\n"
    )


@pytest.mark.usefixtures("files")
def test_either_file_may_be_left_out(cli):
    assert cli("robot", "check", "--thrusters", "t.yaml").code == 0
    assert cli("robot", "check", "--components", "c.yaml").code == 0


@pytest.mark.usefixtures("files")
def test_the_component_file_has_vrx_s_older_name_too(cli):
    named = cli("robot", "check", "--components", "c.yaml")
    assert named == cli("robot", "check", "--sensor-yaml", "c.yaml")


@pytest.mark.usefixtures("files")
def test_a_file_that_cannot_be_read_ends_with_two(cli):
    said = cli("robot", "check", "--components", "t.yaml")
    assert (said.code, said.out) == (2, "")
    assert said.err == "t.yaml:1:1: engine: 'engine' belongs in the thruster file; this is the component file\n"
    assert cli("robot", "check", "--thrusters", "no.yaml").code == 2


def test_nothing_to_check(cli):
    said = cli("robot", "check")
    assert (said.code, said.out) == (2, "")
    assert said.err == "nothing to check: give --components FILE, --thrusters FILE or both\n"


@pytest.mark.usefixtures("files")
def test_an_empty_file_is_legal(cli):
    said = cli("robot", "check", "--components", "empty.yaml")
    assert said.code == 0
    assert said.out.startswith("compliant: no parts\n")


@pytest.mark.usefixtures("files")
def test_what_vrx_would_stop_at_is_said(cli, folder):
    (folder / "odd.yaml").write_text("wamv_gps: {name: gps}\n", encoding="utf-8")
    said = cli("robot", "check", "--components", "odd.yaml")
    assert said.code == 0
    assert said.out.endswith(
        "compliant: all parts pass (1)\nVRX's own generator would stop without a result, at:\n"
        "  odd.yaml:1:11: wamv_gps: one instance that is not in a list\n"
    )


@pytest.mark.usefixtures("files")
def test_other_rules(cli, folder):
    (folder / "p3d.yaml").write_text("wamv_p3d: [{name: p3d_wamv}]\n", encoding="utf-8")
    assert cli("robot", "check", "--components", "p3d.yaml").code == 1
    assert cli("robot", "check", "--components", "p3d.yaml", "--rules", "2019").code == 0
    said = cli("robot", "check", "--components", "p3d.yaml", "--rules", "clasic")
    assert (said.code, said.err) == (2, "no set of rules named 'clasic'; did you mean 'classic'?\n")


@pytest.mark.usefixtures("files")
def test_a_picture_of_it(cli, folder):
    said = cli("robot", "check", "--components", "out.yaml", "--thrusters", "t.yaml", "--picture", "boat.png")
    assert said.code == 1
    assert said.out.endswith("picture: boat.png\n")
    assert (folder / "boat.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.usefixtures("files")
def test_a_picture_that_cannot_be_written(cli):
    said = cli("robot", "check", "--components", "c.yaml", "--picture", "no/boat.png")
    assert (said.code, said.err) == (2, "cannot write the picture 'no/boat.png': No such file or directory\n")
    said = cli("robot", "check", "--components", "c.yaml", "--picture", "boat.gif")
    assert (said.code, said.err) == (
        2,
        "invalid file name 'boat.gif' for a picture: it must end in .png, .pdf, .svg\n",
    )


def test_parts_shows_every_type_with_its_parameters_and_boxes(cli):
    said = cli("robot", "parts")
    assert (said.code, said.err) == (0, "")
    for part in part_types().values():
        assert f"{part.name}: {part.meaning}" in said.out
    assert "at most 3 by the rules of VRX classic, 1.6.1 and later\n" in said.out
    assert "  in component_compliance_for: x 0.3 to 1.3, y -0.5 to 0.5, z 1.3 to 2.3 m; any number\n" in said.out
    assert "  in thruster_compliance_middle: x -1 to 1.5, y -0.5 to 0.5, z -0.6 to 0.6 m; 1 part\n" in said.out


def test_parts_shows_one_type(cli):
    said = cli("robot", "parts", "wamv_gps")
    rows = [[cell.strip() for cell in line.strip("│").split("│")] for line in said.out.splitlines() if "│" in line]
    assert rows[0][:4] == ["name", "gps", "", "yes"]
    assert rows[1][:4] == ["x", "0.3", "m", "yes"]
    assert rows[-1][:4] == ["update_rate", "15", "Hz", "no"]
    assert [row[0] for row in rows] == [each.name for each in part_types()["wamv_gps"].parameters]


def test_parts_by_other_rules(cli):
    assert "not in the rules of VRX 1.2.6, of 2019\n" in cli("robot", "parts", "wamv_pinger", "--rules", "2019").out


def test_parts_of_no_type(cli):
    said = cli("robot", "parts", "wamv_gsp")
    assert (said.code, said.err) == (2, "no type of part named 'wamv_gsp'; did you mean 'wamv_gps'?\n")


@pytest.mark.parametrize("command", ["check", "parts"])
def test_help_names_every_set_of_rules(cli, command):
    said = cli("robot", command, "--help").out
    assert all(name in said for name in rule_sets())


def test_new_robot_copies_files_that_pass(cli, folder):
    said = cli("new", "robot", "mine")
    assert (said.code, said.err) == (0, "")
    assert said.out == (
        "mine: edit its robot.yaml, thruster_config.yaml, component_config.yaml, then\n"
        "vrx-mj robot check --thrusters 'mine/thruster_config.yaml' --components 'mine/component_config.yaml'\n"
        "vrx-mj run ocean --fleet './mine'\n"
    )
    assert sorted(file.name for file in (folder / "mine").iterdir()) == [
        "component_config.yaml",
        "robot.yaml",
        "thruster_config.yaml",
    ]
    files = ("--thrusters", "mine/thruster_config.yaml", "--components", "mine/component_config.yaml")
    assert cli("robot", "check", *files).code == 0


def test_new_robot_overwrites_nothing(cli, folder):
    (folder / "mine").mkdir()
    said = cli("new", "robot", "mine")
    assert (said.code, said.err) == (2, "mine exists: choose another name, or remove it\n")
    said = cli("new", "robot", "no/mine")
    assert (said.code, said.err) == (2, "cannot write the folder 'no/mine': No such file or directory\n")
    assert cli("new", "robot", "").err == "the new robot needs a name, as in vrx-mj new robot my_robot\n"


# test_robot_build


def links(file):
    return {link.get("name") for link in ET.parse(file).findall("link")}


def test_build_makes_vrxs_example_where_no_file_is_named(cli, folder):
    said = cli("robot", "build", "-o", "my_wamv.urdf")
    assert (said.code, said.err) == (0, "")
    assert said.out.startswith("my_wamv.urdf: wamv, built from ")
    assert {"wamv/far_left_camera_link", "wamv/left_engine_link"} <= links(folder / "my_wamv.urdf")


def test_build_reads_both_files_and_takes_a_namespace(cli, folder):
    (folder / "t.yaml").write_text("engine: [{prefix: e, position: '-2.3 1 0.3'}]", encoding="utf-8")
    (folder / "c.yaml").write_text("wamv_gps: [{name: g}]", encoding="utf-8")
    said = cli(
        "robot", "build", "--thrusters", "t.yaml", "--components", "c.yaml", "--namespace", "b2", "-o", "b2.urdf"
    )
    assert (said.code, said.out, said.err) == (0, "b2.urdf: b2, built from t.yaml and c.yaml\n", "")
    assert {"b2/g_link", "b2/e_engine_link", "b2/cpu_cases_link"} <= links(folder / "b2.urdf")
    older = cli(
        "robot", "build", "--thrusters", "t.yaml", "--sensor-yaml", "c.yaml", "--namespace", "b2", "-o", "c.urdf"
    )
    assert older.code == 0
    assert (folder / "b2.urdf").read_bytes() == (folder / "c.urdf").read_bytes()


@pytest.mark.parametrize(("layout", "engine"), [("T", "lateral"), ("X", "left_front")])
def test_build_knows_vrxs_layouts(cli, folder, layout, engine):
    said = cli("robot", "build", "--layout", layout, "--locked", "-o", "w.urdf")
    assert said.code == 0
    assert said.out.startswith(f"w.urdf: wamv, built from layout {layout} and ")
    assert f"wamv/{engine}_engine_link" in links(folder / "w.urdf")
    assert "wamv_external_riser" in (folder / "w.urdf").read_text(encoding="utf-8")


def test_build_makes_mjcf_that_plain_mujoco_opens(cli, folder):
    said = cli("robot", "build", "--namespace", "b2", "-o", "w.urdf", "--mjcf", "out/w.xml")
    assert (said.code, said.err) == (0, "")
    model = mujoco.MjModel.from_xml_path(str(folder / "out" / "w.xml"))
    assert model.body_mass.sum() == pytest.approx(283.2847)  # VRX's example
    assert model.names.startswith(b"b2\0")
    assert {model.joint(i).name for i in range(model.njnt)} >= {"left_chasis_engine_joint", "right_chasis_engine_joint"}


@pytest.mark.filterwarnings("always")
def test_build_warns_of_a_boat_that_breaks_the_rules_and_makes_it(cli, folder):
    (folder / "c.yaml").write_text("wamv_gps: [{name: g, x: 9}, {name: h}]", encoding="utf-8")
    said = cli("robot", "build", "--components", "c.yaml", "-o", "w.urdf")
    assert said.code == 0
    assert said.err.startswith("warning: not compliant with VRX's rules: ")
    assert said.err.endswith(", and 1 more; vrx-mj robot check lists all\n")
    assert "wamv/h_link" in links(folder / "w.urdf")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            ["--thrusters", "t.yaml", "--layout", "H"],
            "--thrusters and --layout both define the engines: give one of them",
        ),
        (["--layout", "Q"], "no thruster layout named 'Q'; known: H, T, X"),
        (["--namespace", "a/b"], "namespace 'a/b': expected up to 64 letters A-Z, digits, '_', '-' or '.'"),
    ],
)
def test_build_says_what_is_wrong(cli, words, message):
    said = cli("robot", "build", "-o", "w.urdf", *words)
    assert (said.code, said.err) == (2, f"{message}\n")


def test_build_cannot_write_into_what_is_no_folder(cli, folder):
    (folder / "notes").write_text("", encoding="utf-8")
    said = cli("robot", "build", "-o", "notes/w.urdf")
    assert (said.code, said.err) == (2, "cannot write the URDF 'notes/w.urdf': File exists\n")


def test_build_names_a_file_that_is_not_there(cli, folder):
    said = cli("robot", "build", "--components", "gone.yaml", "-o", "w.urdf")
    assert said.code == 2
    assert said.err.startswith("gone.yaml: ")
    assert not (folder / "w.urdf").exists()


BARGE = "\n".join(
    [f"v {x} {y} {z}" for x in (-2, 2) for y in (-1, 1) for z in (0, 1.5)]
    + ["f 1 2 4", "f 1 4 3", "f 5 7 8", "f 5 8 6", "f 1 5 6", "f 1 6 2", "f 3 4 8", "f 3 8 7", "f 1 3 7", "f 1 7 5",
       "f 2 6 8", "f 2 8 4"]
)  # fmt: skip


def test_the_sheet_of_a_hull(cli, folder):
    (folder / "barge.obj").write_text(BARGE, encoding="utf-8")
    said = cli("robot", "hydro", "barge.obj", "--mass", "4100", "--center", "0,0,0.5", "-o", "sheet.json")
    assert (said.code, said.err) == (0, "")
    assert "displacement        4100 kg, 4 m3 at 1025 kg/m3\ndraft               0.5000 m; the water is at" in said.out
    assert "metacentric height  GM 0.4167 m, longitudinal 2.4167 m\n" in said.out
    assert "  0:  0.0000    10:  0.0742    20:  0.1576" in said.out
    assert json.loads((folder / "sheet.json").read_text(encoding="utf-8"))["draft"] == pytest.approx(0.5)


@pytest.mark.filterwarnings("always")
def test_a_weight_beside_the_buoyancy_trims_and_leaves_the_metacentres(cli, folder):
    (folder / "barge.obj").write_text(BARGE, encoding="utf-8")
    level, ahead = (cli("robot", "hydro", "barge.obj", "--mass", "4100", "--center", f"{x},0,0.5") for x in (0, 0.7))
    assert (level.err, ahead.err) == (
        "",
        (
            "warning: mesh barge.obj: it floats about 16 degrees down at the bow: its centre of mass is 0.7 m from its "
            "centre of buoyancy; check --center\n"
        ),
    )
    assert cli("robot", "hydro", "barge.obj", "--mass", "4100", "--center", "0,0,1.2").err == (
        "warning: mesh barge.obj: its centre of mass is 0.95 m above its centre of buoyancy: the metacentric height is "
        "-0.283 m, and it capsizes\n"
    )
    assert [re.findall(r"^metacentric .*", said.out, re.MULTILINE) for said in (level, ahead)] == 2 * [
        [
            f"metacentric {name} m"
            for name in ("radius  BM 0.6667 m, longitudinal 2.6667", "height  GM 0.4167 m, longitudinal 2.4167")
        ]
    ]


@pytest.mark.filterwarnings("always")
def test_a_mesh_that_is_open_or_inside_out_is_mended_and_said(cli, folder):
    (folder / "open.obj").write_text(BARGE.rpartition("\n")[0], encoding="utf-8")
    said = cli("robot", "hydro", "open.obj", "--mass", "4100")
    assert said.code == 0
    assert "mesh open.obj is open (3 edges without a second triangle): its convex hull is used" in said.err


def scene(*boxes):
    """An OBJ of boxes, each from one corner to another."""
    points, faces = [], []
    for (a, b, c), (d, e, f) in boxes:
        faces += [[int(word) + len(points) for word in line.split()[1:]] for line in BARGE.split("\n")[8:]]
        points += [(x, y, z) for x in (a, d) for y in (b, e) for z in (c, f)]
    lines = [f"v {x} {y} {z}" for x, y, z in points] + [f"f {i} {j} {k}" for i, j, k in faces]
    return "\n".join(lines)


@pytest.mark.filterwarnings("always")
def test_parts_of_a_hull_that_overlap_are_said(cli, folder):
    (folder / "two.obj").write_text(scene(((-2, -1, 0), (2, 0.5, 1)), ((-2, -0.5, 0), (2, 1, 1))), encoding="utf-8")
    said = cli("robot", "hydro", "two.obj", "--mass", "4100")
    assert (said.code, said.err) == (
        0,
        (
            "warning: mesh two.obj: its surfaces overlap: 4 of 8 m3 count twice and add buoyancy; join them to "
            "one, for "
            "example with Blender's Boolean union\n"
        ),
    )


TWISTED = re.sub(r"v 2 (-?)1", lambda found: "v 2 1" if found[1] else "v 2 -1", BARGE)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            TWISTED,
            (
                "mesh odd.obj: its surface intersects itself: 3 m3 of 6 m3 are inside out; 2 pairs of triangles "
                "cross, the first at (0, 0, 0.375) m; repair it, for example with Blender's 3D-Print Toolbox"
            ),
        ),
        (
            scene(((-2000, -1000, 0), (2000, 1000, 1000))),
            (
                "it hardly touches the water: its mass is 4100 kg, but its hull's 8e+09 m3 carry 8.2e+12 kg; "
                "check the mesh's "
                "unit (m; --scale 0.001 takes one in mm)"
            ),
        ),
    ],
)
def test_hulls_without_a_sheet(cli, folder, text, message):
    (folder / "odd.obj").write_text(text, encoding="utf-8")
    said = cli("robot", "hydro", "odd.obj", "--mass", "4100")
    assert (said.code, said.out, said.err) == (2, "", f"{message}\n")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            ["--mass", "41000"],
            (
                "it sinks: its mass is 41000 kg, but its hull's 12 m3 carry 1.23e+04 kg; check the mesh's unit (m), "
                "or its --scale"
            ),
        ),
        (["--mass", "-1"], "invalid --mass '-1': a number above 0 is needed"),
        (["--mass", "nan"], "invalid --mass 'nan': a number above 0 is needed"),
        (["--mass", "9", "--center", "a,b"], "invalid --center 'a,b': x,y,z [m] are needed, as 0,0,0.15"),
        (["--mass", "9", "--center", "0,0,nan"], "invalid --center '0,0,nan': numbers are needed"),
        (["--mass", "9", "--frequencies", "5"], "invalid --frequencies '5': 10 to 500 is needed"),
        (["--mass", "9", "--panels", "9000"], "invalid --panels '9000': 50 to 2000 is needed"),
    ],
)
def test_sheets_that_cannot_be(cli, folder, words, message):
    (folder / "barge.obj").write_text(BARGE, encoding="utf-8")
    said = cli("robot", "hydro", "barge.obj", *words)
    assert (said.code, said.out, said.err) == (2, "", f"{message}\n")


def test_radiation_without_its_extra_names_it_in_one_line(cli, folder, monkeypatch):
    monkeypatch.setitem(sys.modules, "capytaine", None)
    (folder / "barge.obj").write_text(BARGE, encoding="utf-8")
    said = cli("robot", "hydro", "barge.obj", "--mass", "4100", "--center", "0,0,0.5", "--bem", "hull.json")
    assert (said.code, said.err) == (2, needs_extra("the radiation of a hull", "Capytaine", "hydro") + "\n")
    assert not (folder / "hull.json").exists()


def test_a_mesh_that_is_none(cli, folder):
    (folder / "boat.txt").write_text("v", encoding="utf-8")
    said = cli("robot", "hydro", "boat.txt", "--mass", "9")
    assert (said.code, said.err) == (
        2, "expected a mesh that ends in .obj, .stl, .dae, .ply or .glb, got 'boat.txt'\n"
    )  # fmt: skip
