import xml.etree.ElementTree as ET

import mujoco
import pytest


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
        (
            ["--components", "c.yaml", "--sensor-yaml", "c.yaml"],
            "--components and --sensor-yaml are two names of one option: give one of them",
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
