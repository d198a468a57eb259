"""From what a fleet orders to a boat: files, arguments, layouts, suites, sensors, messages."""

import re
import shutil
import warnings
from pathlib import Path

import pytest

import vrx_mj
from urdf_boats import BOX, joint, link, robot, thruster
from vrx_mj.config.fleet import Order
from vrx_mj.config.robots import load_robot
from vrx_mj.config.search import PACKAGE_PATH
from vrx_mj.errors import CompileError, ConfigError, UnknownNameError, VrxError, VrxWarning
from vrx_mj.formats.parts.read import example_file, wamv_urdf
from vrx_mj.mjcf.build import build_boat, robot_urdf
from vrx_mj.model.world import tree_of
from vrx_mj.packages import root

PUSHER = (link("left_propeller"), joint("shaft", "left_propeller", xyz="-2 0 0", kind="continuous"), thruster("left"))
DYNAMICS = '<plugin name="water" filename="libusv_gazebo_dynamics_plugin.so"><hullRadius>0.2</hullRadius></plugin>'
WATER = f"<gazebo>{DYNAMICS}</gazebo>"
NAVSAT = '<sensor type="gps" name="{0}"><update_rate>5</update_rate></sensor>'
SENSORS = "".join(f'<gazebo reference="base_link">{NAVSAT.format(name)}</gazebo>' for name in ("bow", "stern"))
BOAT = robot(*PUSHER, WATER, SENSORS)
XACRO = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv(PACKAGE_PATH, raising=False)
    return tmp_path


def write(folder, **files):
    """Files by their names, with '__' for '/' and a single '_' before the suffix for '.'."""
    for name, text in files.items():
        stem, _, suffix = name.replace("__", "/").rpartition("_")
        file = folder / f"{stem}.{suffix}"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")


def names(boat):
    return [sensor.name for sensor in boat.sensors]


def build(robot, **order):
    return build_boat(Order(robot, Path.cwd(), **order))


def warned(robot, **order):
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always", VrxWarning)
        boat = build(robot, **order)
    return boat, [str(item.message) for item in found]


# Files


def test_a_urdf_alone_is_a_boat(folder):
    write(folder, boat_urdf=BOAT)
    boat = build("boat.urdf")
    assert (boat.name, boat.link, names(boat)) == ("boat.urdf", "base_link", ["bow", "stern"])
    assert boat.hydrodynamics.hull_radius == 0.2


@pytest.mark.parametrize("suffix", ["yaml", "yml"])
def test_the_yaml_beside_it_has_the_last_word(folder, suffix):
    write(folder, boat_urdf=BOAT)
    (folder / f"boat.{suffix}").write_text("hydrodynamics: {hull_radius: 0.3}\nwind: [1, 2, 3]\n", encoding="utf-8")
    boat = build("boat.urdf")
    assert (boat.hydrodynamics.hull_radius, boat.hydrodynamics.boat_length, boat.wind) == (0.3, 1.35, (1, 2, 3))


def test_a_yaml_leads_to_its_urdf_and_gives_the_xacro_its_arguments(folder):
    text = BOAT.replace("<robot ", f"<robot {XACRO} ").replace('mass value="100"', 'mass value="$(arg mass)"')
    text = text.replace("\n", '\n<xacro:arg name="mass" default="90"/>', 1)
    write(folder, boats__mine_xacro=text, boats__heavy_yaml="urdf: mine.xacro\narguments: {mass: 500}\n")
    assert build("boats/heavy.yaml").parts[0].inertial.mass == 500
    assert build("boats/mine.xacro").parts[0].inertial.mass == 90


def test_problems_of_a_urdf_have_its_own_lines(folder):
    write(folder, boat_urdf="\n\n" + BOAT.replace('mass value="1"', 'mass value="one"'))
    with pytest.raises(ConfigError) as caught:
        build("boat.urdf")
    assert str(caught.value) == (
        "boat.urdf:5: link 'left_propeller' / inertial / mass / value: expected a number, got 'one'"
    )


def test_an_expression_in_a_comment_is_nothing_to_expand(folder):
    text = BOAT.replace("<robot ", "<!-- see ${name} in <xacro:hull/> -->\n\n\n<robot ")
    write(folder, boat_urdf=text.replace('mass value="1"', 'mass value="one"'))
    with pytest.raises(ConfigError) as caught:
        build("boat.urdf")
    assert str(caught.value).startswith("boat.urdf:6: link 'left_propeller'")


def test_problems_of_a_xacro_have_their_lines_in_the_files_that_they_come_from(folder):
    text = BOAT.replace("<robot ", f"<robot {XACRO} ").replace('mass value="1"', 'mass value="one"')
    macros = f'<robot {XACRO}>\n<xacro:macro name="weight">\n\n<mass value="one"/></xacro:macro></robot>'
    start = text.index(">") + 1
    other = f'{text[:start]}<xacro:include filename="macros.xacro"/>{text[start:]}'
    other = other.replace('<mass value="one"/>', "<xacro:weight/>")
    write(folder, boat_xacro=text, other_xacro=other, macros_xacro=macros)
    problem = "link 'left_propeller' / inertial / mass / value: expected a number, got 'one'"
    line = text[: text.index("one")].count("\n") + 1
    for name, place in (("boat", f"boat.xacro:{line}"), ("other", "macros.xacro:4")):
        with pytest.raises(ConfigError) as caught:
            build(f"{name}.xacro")
        assert str(caught.value).splitlines()[0] == f"{place}: {problem}"


def test_an_expression_in_a_urdf_is_expanded_as_vrxs_launch_files_do(folder):
    write(folder, boat_urdf=BOAT.replace('mass value="100"', 'mass value="${40 + 2}"'))
    assert build("boat.urdf").parts[0].inertial.mass == 42


def test_a_yaml_that_names_no_file_is_told(folder):
    write(folder, boat_yaml="urdf: ship.urdf\n")
    with pytest.raises(VrxError) as caught:
        build("boat.yaml")
    assert str(caught.value).startswith("boat.yaml:1:7: urdf: no file 'ship.urdf'")


# Packages


def shelf(folder, package, mass):
    """A package with a hull of this mass in it."""
    hull = link("base_link", mass, BOX)
    text = f'<robot {XACRO}><xacro:macro name="hull" params="">{hull}</xacro:macro></robot>'
    write(folder, **{f"{package}__package_xml": f"<package><name>{package}</name></package>"})
    write(folder, **{f"{package}__urdf__battery_xacro": text})


MAIN = robot(
    *PUSHER, WATER, hull='<xacro:include filename="$(find wamv_description)/urdf/battery.xacro"/><xacro:hull/>'
)
MAIN = MAIN.replace("<robot ", f"<robot {XACRO} ")


def test_a_users_package_goes_before_ours_of_the_same_name(folder, monkeypatch):
    shelf(folder / "vrx", "wamv_description", 77)
    write(folder, boat_xacro=MAIN)
    monkeypatch.setenv(PACKAGE_PATH, str(folder / "vrx"))
    assert build("boat.xacro").parts[0].inertial.mass == 77


def test_our_robots_are_made_of_our_packages_whatever_the_package_path_has(folder, monkeypatch):
    shelf(folder / "vrx", "wamv_description", 77)
    expected = wamv_urdf()
    monkeypatch.setenv(PACKAGE_PATH, str(folder / "vrx"))
    assert robot_urdf(load_robot("wamv"), Order("wamv")) == expected


def test_a_package_that_nobody_has_is_told(folder):
    write(folder, boat_xacro=MAIN.replace("wamv_description", "our_boat"))
    with pytest.raises(ConfigError) as caught:
        build("boat.xacro")
    assert "no package named 'our_boat'; known: " in str(caught.value)
    assert str(caught.value).endswith("(or add its folder to the package paths, or --missing ignore)")


# Layouts, suites, sensors


@pytest.mark.parametrize(
    ("sensors", "expected"),
    [(None, ["bow", "stern"]), (("none",), []), ((), []), (("stern",), ["stern"])],
)
def test_sensors_of_a_robot_without_suites_are_all_none_or_some(folder, sensors, expected):
    write(folder, boat_urdf=BOAT)
    assert names(build("boat.urdf", sensors=sensors)) == expected


def test_vrx_s_sensors_are_those_of_the_robot_where_it_has_no_suites_with_a_warning(folder):
    write(folder, boat_urdf=BOAT)
    text = "robot boat.urdf: `sensors: vrx` adds no sensors: its own files define them, bow, stern"
    with pytest.warns(VrxWarning, match=f"^{text}$"):
        assert names(build("boat.urdf", sensors=("vrx",))) == ["bow", "stern"]


VRX_SUITE = ["front_left_camera", "front_right_camera", "middle_right_camera", "gps_wamv", "imu_wamv", "lidar_wamv",
             "pinger", "ball_shooter"]  # fmt: skip


@pytest.mark.parametrize(
    ("sensors", "expected"),
    [
        (None, VRX_SUITE),
        (("vrx",), VRX_SUITE),
        (("none",), []),
        (("gps",), ["gps_wamv"]),
        (("gps", "ground_truth"), ["p3d_wamv", "gps_wamv"]),
        (("vrx", "ground_truth"), ["p3d_wamv", *VRX_SUITE]),
        (("lidar_wamv", "pinger"), ["lidar_wamv", "pinger"]),
    ],
)
def test_sensors_of_the_wam_v_are_suites_or_names(sensors, expected):
    found = names(build_boat(Order("wamv", sensors=sensors)))
    assert sorted(found) == sorted(expected)


KNOWN = ", ".join(VRX_SUITE)


@pytest.mark.parametrize(
    ("sensors", "message"),
    [
        (("sonar",), f"no sensor or suite named 'sonar'; known: {KNOWN}, none, vrx, camera, gps and 9 more"),
        (("gps_wamw",), "no sensor or suite named 'gps_wamw'; did you mean 'gps_wamv'?"),
        (("vrx", "gps_wamv"), "expected either a suite or names of sensors, got the suite 'vrx' among names"),
    ],
)  # fmt: skip
def test_sensors_that_the_wam_v_does_not_have_are_told(sensors, message):
    with pytest.raises(VrxError) as caught:
        build_boat(Order("wamv", sensors=sensors))
    assert str(caught.value) == message


def test_a_layout_that_a_robot_does_not_have_is_told():
    with pytest.raises(UnknownNameError) as caught:
        build_boat(Order("wamv", layout="Q"))
    assert str(caught.value) == "no thruster layout named 'Q'; known: H, T, X"


@pytest.mark.parametrize(("layout", "count"), [(None, 2), ("H", 2), ("T", 3), ("X", 4)])
def test_a_layout_is_arguments_of_the_xacro(layout, count):
    assert len(build_boat(Order("wamv", layout=layout, sensors=("none",))).thrusters) == count


# Thruster and component files


def test_thruster_and_component_files_furnish_a_robot_that_takes_them():
    order = Order("wamv", thrusters=example_file("thrusters"), components=example_file("components"))
    boat = build_boat(order)
    assert [thruster.name for thruster in boat.thrusters] == ["left", "right"]
    assert "far_left_camera" in names(boat)
    picked = Order(order.robot, None, None, order.thrusters, order.components, ("far_left_camera",))
    assert names(build_boat(picked)) == ["far_left_camera"]


def test_a_thruster_file_alone_leaves_a_robot_its_own_sensors():
    boat = build_boat(Order("wamv", thrusters=example_file("thrusters")))
    assert names(boat) == names(build_boat(Order("wamv")))
    assert len(names(boat)) == 8


def test_a_switch_of_a_yaml_reaches_the_xacro_as_vrx_writes_it(folder):
    write(folder, boat_urdf=BOAT, boat_yaml="arguments: {locked: true, size: 2, name: Bob}\nlayouts: {H: {a: false}}\n")
    config = load_robot("boat.urdf")
    assert config.arguments == {"locked": "true", "size": "2", "name": "Bob"}
    assert config.layouts == {"H": {"a": "false"}}


def test_a_robot_that_takes_no_files_says_so(folder):
    write(folder, boat_urdf=BOAT)
    with pytest.raises(VrxError) as caught:
        build("boat.urdf", components=example_file("components"))
    assert str(caught.value) == ("robot boat.urdf takes no thruster or component file: its YAML sets no `vrx_parts`")


def test_what_a_component_file_makes_wrong_names_that_file(folder):
    """The post of a camera 65 km up has moments of inertia beyond all limits."""
    text = example_file("components").read_text("utf-8").replace("z: 1.5", "z: 65536", 1)
    (folder / "high.yaml").write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError, match=r"\(expanded with high.yaml\):\d+: link 'wamv/front_left_camera_post_link'"):
        build("wamv", components=folder / "high.yaml")


SINGLE = '<link name="base_link"><inertial><mass value="{}"/><inertia ixx="{}" iyy="1" izz="1"/></inertial></link>'


@pytest.mark.parametrize(
    ("mass", "moment", "says"),
    [
        ("5e-324", 1, ": no link has a mass of 1e-12 kg or more"),
        (2, 0, " has moments of inertia of 0, 1, 1 kg m2; each must be at least 1e-12"),
    ],
)
def test_a_robot_without_the_mass_or_inertia_of_a_body_is_refused_by_its_file(folder, mass, moment, says):
    write(folder, boat_urdf=robot(WATER, hull=SINGLE.format(mass, moment)))
    with warnings.catch_warnings(action="ignore"), pytest.raises(CompileError, match=f"robot boat.urdf{says}"):
        vrx_mj.compile_world("ocean", fleet="boat.urdf")


def test_a_users_own_xacro_is_furnished_itself_not_ours_in_its_place(folder):
    main = f"""<robot {XACRO} name="mine">
      <xacro:arg name="yaml_component_generation" default="false"/><xacro:arg name="component_xacro_file" default=""/>
      <xacro:arg name="namespace" default="wamv"/>
      <xacro:property name="namespace" value="$(arg namespace)" scope="global"/>
      <link name="${{namespace}}/base_link"><inertial><mass value="321"/>
        <inertia ixx="9" iyy="9" izz="9"/></inertial>{BOX}</link>{WATER}
      <xacro:macro name="wamv_gps" params="name"><gazebo reference="${{namespace}}/base_link">
        <sensor type="gps" name="${{name}}"><update_rate>4</update_rate></sensor></gazebo></xacro:macro>
      <xacro:if value="$(arg yaml_component_generation)">
        <xacro:include filename="$(arg component_xacro_file)"/><xacro:yaml_components/></xacro:if></robot>"""
    parts = "wamv_gps:\n  - {name: masthead}\n"
    write(folder, mine_xacro=main, mine_yaml="urdf: mine.xacro\nvrx_parts: true\n", parts_yaml=parts)
    boat, said = warned("mine.yaml", components=folder / "parts.yaml")
    assert (boat.parts[0].inertial.mass, names(boat)) == (321, ["masthead"])
    assert len(said) == 1  # no thruster


FLEET = """\
boats:
  - {name: alpha, robot: wamv, pose: [0, 0, 0.1, 0, 0, 0], thrusters: alpha_thrusters.yaml, components: alpha.yaml}
  - {name: bravo, robot: wamv, pose: [0, 9, 0.1, 0, 0, 0], thrusters: T, components: bravo.yaml}
"""


def test_boats_of_a_fleet_have_their_own_files_and_namespaces(folder):
    engine = "engine:\n  - {prefix: single, position: '-2.3 0 0.3', orientation: '0 0 0'}\n"
    (folder / "alpha_thrusters.yaml").write_text(engine, encoding="utf-8")
    for boat, z in (("alpha", 1.4), ("bravo", 1.6)):
        (folder / f"{boat}.yaml").write_text(f"wamv_imu:\n  - {{name: imu_{boat}, x: 0.3, y: 0, z: {z}}}\n", "utf-8")
    (folder / "fleet.yaml").write_text(FLEET, encoding="utf-8")
    world = tree_of(vrx_mj.compile_world("ocean", fleet="fleet.yaml").parameters)
    assert [(row["boat"], row["frame"], row["body"]) for row in world["sensors"]] == [
        ("alpha", "alpha/imu_alpha_link", "alpha/base_link"),
        ("bravo", "bravo/imu_bravo_link", "bravo/base_link"),
    ]
    assert [row["name"] for row in world["thrusters"]] == ["single", "left", "right", "lateral"]
    assert [(hull["body"], hull["thruster_start"], hull["thruster_count"]) for hull in world["hulls"]] == [
        ("alpha/base_link", 0, 1),
        ("bravo/base_link", 1, 3),
    ]


# Warnings


def test_what_is_odd_about_a_boat_is_one_warning(folder):
    write(folder, boat_urdf=robot(WATER))
    boat, said = warned("boat.urdf")
    assert boat.thrusters == ()
    assert said == ["robot boat.urdf: no thruster, so the boat drifts; add `thrusters` to the YAML beside it"]


def test_several_oddities_stand_one_a_line(folder):
    write(folder, boat_urdf=robot(*PUSHER, link("dish"), joint("turntable", "dish", kind="continuous")))
    _, said = warned("boat.urdf")
    (text,) = said
    assert text == (
        "robot boat.urdf:\n"
        "joint 'turntable' (continuous) is not simulated: it stays at zero\n"
        "derived from its shapes and mass: waterline at z = -0.224 m, draft 0.0256 m, hull_radius 0.193, "
        "boat_width 0.577, boat_length 4, "
        "added_mass [0, 0, 0, 0, 0, 0], drag_linear [30.9, 24.1, 301, 20.1, 20.1, 160], "
        "drag_quadratic [48.2, 0, 0, 0, 0, 0]; set them in the YAML beside it"
    )


def test_a_long_list_of_oddities_ends(folder):
    spares = [part for i in range(20) for part in (link(f"l{i}"), joint(f"j{i}", f"l{i}", kind="continuous"))]
    write(folder, boat_urdf=robot(*PUSHER, WATER, *spares))
    _, (text,) = warned("boat.urdf")
    assert text.splitlines()[-1] == "and 8 more"
    assert len(text.splitlines()) == 14


def test_what_the_yaml_says_about_the_water_is_not_derived(folder):
    write(folder, boat_urdf=robot(*PUSHER), boat_yaml="hydrodynamics: {hull_radius: 0.5, boat_length: 3}\n")
    boat, (text,) = warned("boat.urdf")
    assert (boat.hydrodynamics.hull_radius, boat.hydrodynamics.boat_length) == (0.5, 3)
    assert text.startswith("robot boat.urdf: derived from its shapes and mass: boat_width 0.577, added_mass")


@pytest.mark.parametrize(
    ("hull", "guessed"),
    [
        (
            "added_mass: [1, 2, 3, 4, 5, 6], damping_linear: [1, 2, 3, 4, 5, 6], damping_quadratic: [1, 2, 3, 4, 5, 6]",
            (),
        ),
        ("hydro: hydro.json, damping_linear: [1, 2, 3, 4, 5, 6]", ("drag_quadratic",)),
        ("hydro: hydro.json", ("drag_linear", "drag_quadratic")),
        ("munk: true", ("added_mass", "drag_linear", "drag_quadratic")),
    ],
)
def test_what_a_hull_gives_is_not_said_to_be_derived(folder, hull, guessed):
    shutil.copy(root() / "assets" / "robots" / "sphere" / "hydro.json", folder)
    write(folder, boat_urdf=robot(*PUSHER), boat_yaml=f"hull: {{{hull}}}\n")
    _, said = warned("boat.urdf", profile="marine")
    assert len(said) == bool(guessed)
    for text in said:
        begins, _, listed = text.partition("Froude's law: ")
        assert begins == "robot boat.urdf: missing from its `hull`, so scaled from the WAM-V by "
        assert tuple(re.findall(r"[a-z_]+(?= \[)", listed)) == guessed
    assert "derived from its shapes" in warned("boat.urdf")[1][0]


def test_floats_of_the_shapes_are_no_guess_where_the_drag_is_given(folder):
    drag = "added_mass: [1, 2, 3, 4, 5, 6], drag_linear: [1, 2, 3, 4, 5, 6], drag_quadratic: [1, 2, 3, 4, 5, 6]"
    write(folder, boat_urdf=robot(*PUSHER), boat_yaml=f"hydrodynamics: {{{drag}}}\n")
    assert warned("boat.urdf")[1] == []


def test_equal_orders_of_a_users_file_are_read_anew(folder):
    write(folder, boat_urdf=BOAT)
    before = build("boat.urdf")
    write(folder, boat_urdf=BOAT.replace('mass value="100"', 'mass value="200"'))
    assert (before.parts[0].inertial.mass, build("boat.urdf").parts[0].inertial.mass) == (100, 200)


def test_a_users_file_beside_our_assets_is_read_anew(folder, monkeypatch):
    """In an editable install our assets lie in the folder of the whole project."""
    monkeypatch.setattr("vrx_mj.mjcf.build.root", lambda: folder)
    write(folder, boat_urdf=BOAT)
    assert names(build("boat.urdf")) == ["bow", "stern"]
    write(folder, boat_urdf=BOAT.replace("stern", "mast"))
    assert names(build("boat.urdf")) == ["bow", "mast"]


def test_a_wrong_name_in_the_yaml_beside_a_urdf_is_told_with_its_line(tmp_path):
    (tmp_path / "tub.urdf").write_text(
        '<robot name="tub"><link name="base_link"><inertial><mass value="5"/>'
        '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>',
        encoding="utf-8",
    )
    (tmp_path / "tub.yaml").write_text("thrusters:\n  screw: {propeller: hub, mapping: linear}\n", encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        build_boat(Order("tub.urdf", tmp_path))
    assert str(caught.value).endswith("tub.yaml:2:22: thrusters.screw.propeller: no link named 'hub'; known: base_link")


def test_in_the_other_profile_commands_are_newtons_and_hold_for_ever():
    classic, other = (build_boat(Order("wamv", layout="H", profile=profile)) for profile in ("vrx", "vrx3"))
    assert {(item.drive.mapping, item.drive.timeout) for item in classic.thrusters} == {("glf", 1.0)}
    assert {(item.drive.mapping, item.drive.timeout) for item in other.thrusters} == {("newtons", 0.0)}
