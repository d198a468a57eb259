"""The WAM-V against the tables of VRX's URDF, and its meshes against their script.

Figures: wamv_description and wamv_gazebo of VRX classic (commit c9b9388); composites worked out from them.
"""

import importlib.util
import math
from pathlib import Path
from types import ModuleType

import mujoco
import numpy as np
import pytest
import trimesh

from urdf_boats import assemble, joint, link, thruster
from vrx_mj.config.fleet import Order
from vrx_mj.errors import UnknownNameError
from vrx_mj.mjcf.boats import Boat, axis_inertia, boat_mass, body_mass, push_center, turning_mass
from vrx_mj.mjcf.build import build_boat
from vrx_mj.mjcf.robots import SERVO_INERTIA, drag_share, hull_row, robot_piece, thruster_rows
from vrx_mj.model.boats import Hull, Inertia
from vrx_mj.packages import root
from vrx_mj.rigid_bodies import combine, rigid, with_pose

LAYOUTS = ("H", "T", "X")
ENGINES = ("fixed", "hinged")
FOLDER = root() / "assets" / "robots" / "wamv"
HULL = ("arches", "batteries", "deck", "engine", "hulls", "propeller", "trim")
CARRIED = ("battery", "camera", "cpu_cases", "cpu_fittings", "gps", "hydrophone", "lidar", "post_arm", "shooter_base",
           "shooter_launcher")  # fmt: skip
MESHES = tuple(sorted((*HULL, *CARRIED, "water_hulls")))

# layout: mass, centre of mass (8 digits), xx, yy, zz, xz of the inertia (1 digit)
BOATS = {
    "H": (258.0, (-0.28629927, 0.0, 0.14556580), (217.0, 566.1, 682.9, 11.4)),
    "T": (273.5, (-0.27007395, -0.00050851, 0.15442034), (218.5, 568.7, 684.2, 10.7)),
    "X": (289.0, (-0.08436188, 0.0, 0.15500555), (234.5, 665.8, 795.6, 6.8)),
}

# layout, name: propeller at zero steering angle, direction of thrust
THRUST = {
    ("H", "left"): ((-2.651932, 1.027135, -0.191134), (1.0, 0.0)),
    ("H", "right"): ((-2.651932, -1.027135, -0.191134), (1.0, 0.0)),
    ("T", "left"): ((-2.651932, 1.027135, -0.191134), (1.0, 0.0)),
    ("T", "right"): ((-2.651932, -1.027135, -0.191134), (1.0, 0.0)),
    ("T", "lateral"): ((-0.000027, -0.278156, -0.191134), (0.00009633, 1.0)),
    ("X", "left_rear"): ((-2.570540, 0.830527, -0.191134), (0.70738827, 0.70682518)),
    ("X", "right_rear"): ((-2.570540, -0.830527, -0.191134), (0.70738827, -0.70682518)),
    ("X", "left_front"): ((1.403236, 0.896608, -0.259371), (0.70738827, -0.70682518)),
    ("X", "right_front"): ((1.403236, -0.896608, -0.259371), (0.70738827, 0.70682518)),
}

# name of the port shape: type, length and radius or edges, xyz, rpy; starboard has y and roll negated
PLATFORM = {
    "left_float": ("cylinder", (4.0, 0.20), (-0.40, 1.03, 0.20), (0, 1.57, 0)),
    "left_mid_float": ("cylinder", (0.5, 0.17), (1.85, 1.03, 0.30), (0, 1.38, 0)),
    "left_front_float": ("cylinder", (0.45, 0.12), (2.30, 1.03, 0.40), (0, 1.30, 0)),
    "front_left_beam_lower": ("cylinder", (0.5, 0.04), (0.90, 0.85, 1.00), (0.78, 0, 0)),
    "front_left_beam_upper": ("cylinder", (0.2, 0.04), (0.90, 0.60, 1.18), (1.35, 0, 0)),
    "mid_left_beam_lower": ("cylinder", (0.45, 0.03), (-0.65, 0.99, 0.70), (0.10, 0.25, 0)),
    "mid_left_beam_medium": ("cylinder", (0.32, 0.03), (-0.57, 0.87, 1.05), (0.75, 0.25, 0)),
    "mid_left_beam_upper": ("cylinder", (0.30, 0.03), (-0.55, 0.65, 1.17), (1.35, 0.25, 0)),
    "rear_left_beam_lower": ("cylinder", (0.45, 0.03), (-0.74, 1.03, 0.70), (0, -0.15, 0)),
    "rear_left_beam_medium": ("cylinder", (0.32, 0.03), (-0.79, 0.91, 1.05), (0.75, -0.15, 0)),
    "rear_left_beam_upper": ("cylinder", (0.30, 0.03), (-0.81, 0.67, 1.18), (1.45, -0.15, 0)),
    "left_joint": ("box", (0.65, 0.2, 0.1), (0.58, 1.03, 0.60), (0, -0.60, 0)),
}


def wamv(layout: str = "H", *sensors: str) -> Boat:
    return build_boat(Order("wamv", layout=layout, sensors=sensors or ("none",)))


@pytest.fixture(scope="module")
def script() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_wamv_meshes", FOLDER / "make_meshes.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def compiled(boat, engines="fixed", **options):
    piece = robot_piece(boat, engines, **options)
    return mujoco.MjModel.from_xml_string(piece.document(), dict(piece.files))


def test_hull_and_batteries_are_vrxs_base_link():
    link = body_mass(wamv(), "hinged")
    assert link.mass == 227.0
    assert np.diag(link.inertia) == pytest.approx([181.419798, 408.203132, 495.036667], abs=5e-7)
    assert push_center(wamv()) == pytest.approx([0.0, 0.0, 0.12422907], abs=5e-9)


@pytest.mark.parametrize("layout", LAYOUTS)
def test_boat_weighs_what_the_table_says(layout):
    mass, center, (xx, yy, zz, xz) = BOATS[layout]
    boat = boat_mass(wamv(layout))
    assert boat.mass == mass
    assert boat.center == pytest.approx(center, abs=5e-9)
    assert boat.inertia[[0, 1, 2, 0], [0, 1, 2, 2]] == pytest.approx([xx, yy, zz, xz], abs=0.05)
    assert np.array_equal(boat.inertia, boat.inertia.T)


def test_h_boat_has_the_inertia_worked_out_by_hand():
    inertia = boat_mass(wamv()).inertia
    assert inertia == pytest.approx(
        np.array([[217.03174, 0, 11.403578], [0, 566.0832, 0], [11.403578, 0, 682.85647]]), abs=5e-5
    )


def test_engine_turns_with_its_propeller():
    engine = turning_mass(wamv().thrusters[0])
    assert engine.mass == 15.5
    assert axis_inertia(engine) == pytest.approx(0.131210, abs=5e-7)


@pytest.mark.parametrize("engines", ENGINES)
@pytest.mark.parametrize("layout", LAYOUTS)
def test_mujoco_sees_the_same_mass_and_inertia(layout, engines):
    model = compiled(wamv(layout), engines)
    base = body_mass(wamv(layout), engines)
    index = model.body("base_link").id
    turn = np.empty(9)
    mujoco.mju_quat2Mat(turn, model.body_iquat[index])
    turn = turn.reshape(3, 3)
    assert model.body_mass[index] == base.mass
    assert model.body_ipos[index] == pytest.approx(base.center, abs=1e-12)
    assert turn @ np.diag(model.body_inertia[index]) @ turn.T == pytest.approx(base.inertia, abs=1e-9)
    assert model.body_subtreemass[index] == pytest.approx(BOATS[layout][0])


@pytest.mark.parametrize("layout", LAYOUTS)
def test_hinged_boat_has_its_centre_of_mass_where_the_fixed_one_has_it(layout):
    model = compiled(wamv(layout), "hinged")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert data.subtree_com[model.body("base_link").id] == pytest.approx(BOATS[layout][1], abs=5e-9)


def test_platform_collides_as_25_shapes():
    shapes = {shape.name: shape for part in wamv().parts for shape in part.collisions if part.name == "dummy_link"}
    expected = {"top_base": ("box", (1.85, 1.0, 0.1), (0, 0, 1.25), (0, 0, 0))}
    for name, (kind, size, (x, y, z), (roll, pitch, yaw)) in PLATFORM.items():
        expected[name] = kind, size, (x, y, z), (roll, pitch, yaw)
        expected[name.replace("left", "right")] = kind, size, (x, -y, z), (-roll, pitch, yaw)
    found = {
        name: (shape.type, shape.size or (shape.length, shape.radius), shape.pose[:3], shape.pose[3:])
        for name, shape in shapes.items()
    }
    assert len(found) == 25
    assert found == expected


def test_shapes_stand_in_the_model_where_the_table_puts_them():
    model = compiled(wamv())
    beam = model.geom("mid_right_beam_upper")
    cr, sr, cp, sp = math.cos(-1.35), math.sin(-1.35), math.cos(0.25), math.sin(0.25)
    turn = np.empty(9)
    mujoco.mju_quat2Mat(turn, beam.quat)
    assert beam.pos == pytest.approx([-0.55, -0.65, 1.17])
    assert turn.reshape(3, 3)[:, 2] == pytest.approx([sp * cr, -sr, cp * cr])  # Ry(pitch) Rx(roll) z
    assert beam.size == pytest.approx([0.03, 0.03, 0.15])  # of the box around its prism
    assert model.geom("top_base").size == pytest.approx([0.925, 0.5, 0.05])


@pytest.mark.parametrize("engines", ENGINES)
def test_engine_shapes_stand_at_their_mount(engines):
    model = compiled(wamv("T"), engines)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    hub = np.array(THRUST["T", "lateral"][0])
    disc = data.geom("lateral_propeller_collision").xpos
    assert disc == pytest.approx(hub - np.array([0.08 * 0.00009633, 0.08, 0.0]), abs=1e-6)
    assert data.geom("left_engine_rear_end_collision").xpos == pytest.approx([-2.713776, 1.027135, 0.438237])


@pytest.mark.parametrize("engines", ENGINES)
@pytest.mark.parametrize("layout", LAYOUTS)
def test_no_part_of_a_boat_touches_another(layout, engines):
    model = compiled(wamv(layout), engines)
    data = mujoco.MjData(model)
    for angle in np.linspace(-math.pi, math.pi, 9):
        data.qpos[7:] = angle
        mujoco.mj_forward(model, data)
        assert data.ncon == 0


@pytest.mark.parametrize("layout", LAYOUTS)
def test_engines_on_hinges_are_bodies_of_their_own(layout):
    fixed, hinged = (compiled(wamv(layout), engines) for engines in ENGINES)
    assert (fixed.nbody, fixed.nv, fixed.nu) == (2, 6, 0)
    thrusters = wamv(layout).thrusters
    count = len(thrusters)
    assert (hinged.nbody, hinged.nv, hinged.nu) == (2 + count, 6 + count, 0)
    for mount in thrusters:
        joint = hinged.joint(f"{mount.name}_chasis_engine_joint")
        assert joint.range == pytest.approx([-math.pi, math.pi])
        assert joint.axis == pytest.approx([0, 0, 1])
    assert hinged.joint("free").type == fixed.joint("free").type == mujoco.mjtJoint.mjJNT_FREE


def test_frame_of_the_free_joint_is_base_link():
    model = compiled(wamv())
    assert model.qpos0.tolist() == [0, 0, 0, 1, 0, 0, 0]
    assert model.geom("left_float").pos == pytest.approx([-0.4, 1.03, 0.2])


def test_what_is_seen_neither_collides_nor_hides_what_does():
    model = compiled(wamv())
    seen = model.geom_group == 2
    assert seen.sum() == 6 + 2 * 2
    assert not model.geom_contype[seen].any()
    assert not model.geom_conaffinity[seen].any()
    assert (model.geom_group[~seen] == 3).all()
    assert (~seen).sum() == 25 + 2 + 2 * 3


@pytest.mark.parametrize(("layout", "name"), THRUST)
def test_thrust_acts_where_the_table_says(layout, name):
    rows = {row.name: row for row in thruster_rows(wamv(layout), "fixed", "wamv1/")}
    row, (point, direction) = rows[name], THRUST[layout, name]
    turn = np.array(row.rotation)
    assert row.position + turn @ row.propeller == pytest.approx(point, abs=5e-7)
    assert turn @ row.direction == pytest.approx([*direction, 0.0], abs=5e-9)


def test_every_thruster_of_the_table_exists_and_no_other():
    found = {(layout, thruster.name) for layout in LAYOUTS for thruster in wamv(layout).thrusters}
    assert found == set(THRUST)


def test_hull_row_has_vrxs_numbers():
    assert hull_row(wamv(), "fixed", "wamv1/") == Hull(
        body="wamv1/base_link",
        joint="wamv1/free",
        density=997.8,
        level=0.0,
        added_mass=(0.0, 0.0, 0.1, 0.1, 0.1, 0.0),
        drag_linear=(51.3, 40.0, 500.0, 50.0, 50.0, 400.0),
        drag_quadratic=(72.4, 0.0, 0.0, 0.0, 0.0, 0.0),
        link_com=tuple(push_center(wamv())),
        body_com=tuple(boat_mass(wamv()).center),
        mass=258.0,
        inertia=Inertia(**dict(zip(("xx", "yy", "zz", "xy", "xz", "yz"), boat_mass(wamv()).tensor(), strict=True))),
        thruster_count=2,
        # what the world decides
        wind=(0.0, 0.0, 0.0),
        profile=0,
        gravity=0.0,
        station_start=0,
        station_count=0,
        thruster_start=0,
    )


def test_hinged_boat_pushes_through_its_engines():
    rows = thruster_rows(wamv("T"), "hinged", "wamv1/")
    lateral = rows[2]
    assert lateral.body == "wamv1/lateral_engine_link"
    assert lateral.joint == "wamv1/lateral_chasis_engine_joint"
    assert lateral.body_com == pytest.approx([-0.278156 * 0.5 / 15.5, 0.0, -0.509371 * 0.5 / 15.5])
    hull = hull_row(wamv("T"), "hinged", "wamv1/")
    assert (hull.mass, hull.body_com) == (227.0, hull.link_com)


def test_thruster_row_has_vrxs_numbers():
    row = thruster_rows(wamv(), "fixed", "wamv1/")[0]
    assert row.joint is None
    assert row.body == "wamv1/base_link"
    numbers = (
        "mapping",
        "max_command",
        "max_forward",
        "max_reverse",
        "timeout",
        "kp",
        "kd",
        "effort",
        "velocity",
    )
    assert [getattr(row, key) for key in numbers] == [1, 1, 250, -100, 1, 300, 20, 10, 10]
    assert row.max_angle == math.pi / 2
    assert row.inertia == pytest.approx(0.131210, abs=5e-7)


@pytest.mark.parametrize("engines", ENGINES)
@pytest.mark.parametrize("layout", LAYOUTS)
def test_rows_have_names_that_the_model_has(layout, engines):
    model = compiled(wamv(layout), engines)
    rows = [hull_row(wamv(layout), engines, ""), *thruster_rows(wamv(layout), engines, "")]
    for row in rows:
        assert model.body(row.body).ipos == pytest.approx(row.body_com, abs=1e-12)
        if row.joint is not None:
            assert model.jnt_bodyid[model.joint(row.joint).id] == model.body(row.body).id


def test_unknown_layout_is_named():
    with pytest.raises(UnknownNameError) as caught:
        wamv("Z")
    assert str(caught.value) == "no thruster layout named 'Z'; known: H, T, X"


def test_colour_paints_the_hulls_only():
    plain, red = compiled(wamv()), compiled(wamv(), color=(0.9, 0.1, 0.1, 1.0))
    changed = np.flatnonzero((plain.geom_rgba != red.geom_rgba).any(axis=1))
    assert len(changed) == 1
    assert red.geom_rgba[changed[0]] == pytest.approx([0.9, 0.1, 0.1, 1.0])
    assert next(shape for part in wamv().parts for shape in part.visuals).file == "meshes/hulls.obj"


def test_same_boat_same_text():
    assert robot_piece(wamv("X"), "hinged").document() == robot_piece(wamv("X"), "hinged").document()


def test_the_largest_share_of_a_velocity_that_drag_takes_in_a_step():
    drag, inertia = (51.3, 40.0, 500.0, 50.0, 50.0, 400.0), (258.0, 258.0, 258.0, 217.031744, 566.083204, 682.856474)
    added = (0.0, 0.0, 0.1, 0.1, 0.1, 0.0)
    shares = [d * 0.01 / (m + a) for d, m, a in zip(drag, inertia, added, strict=True)]
    assert drag_share(wamv(), 0.01) == pytest.approx(max(shares), rel=1e-6)


def test_two_balls_on_a_stick_have_the_inertia_of_a_dumbbell():
    balls = [rigid(2.0, (0, y, 0), (0.1, 0.1, 0.1)) for y in (-1.5, 1.5)]
    both = combine(balls)
    assert both.inertia == pytest.approx(np.diag([0.2 + 2 * 2.0 * 1.5**2, 0.2, 0.2 + 2 * 2.0 * 1.5**2]))
    assert axis_inertia(both) == pytest.approx(9.2)


def test_mounting_turns_a_part_with_its_inertia():
    part = with_pose(rigid(3.0, (1.0, 0.0, 0.0), (1.0, 2.0, 3.0)), (0.0, 0.0, 5.0, 0.0, 0.0, math.pi / 2))
    assert part.center == pytest.approx([0.0, 1.0, 5.0])
    assert part.inertia == pytest.approx(np.diag([2.0, 1.0, 3.0]))


def test_script_writes_the_meshes_that_are_shipped(script, tmp_path):
    script.write_meshes(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == [f"{name}.obj" for name in MESHES]
    for name in MESHES:
        shipped = FOLDER / "meshes" / f"{name}.obj"
        assert (tmp_path / shipped.name).read_bytes() == shipped.read_bytes(), name
    assert {path.stem for path in (FOLDER / "meshes").glob("*.obj")} == set(MESHES)


def welded(name: str) -> trimesh.Trimesh:
    mesh = trimesh.load(FOLDER / "meshes" / f"{name}.obj", force="mesh")
    mesh.merge_vertices(merge_norm=True, merge_tex=True)
    return mesh


@pytest.mark.parametrize("name", MESHES)
def test_meshes_are_closed_and_look_outward(name):
    mesh = welded(name)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert all(part.volume > 0 for part in mesh.split())
    assert mesh.area_faces.min() > 0


def test_the_hulls_for_water_pressure_are_those_that_are_seen():
    seen, pressed = welded("hulls"), welded("water_hulls")
    assert len(pressed.faces) <= 700
    assert pressed.volume == pytest.approx(seen.volume, rel=0.03)
    assert pressed.center_mass == pytest.approx(seen.center_mass, abs=0.02)
    assert pressed.bounds == pytest.approx(seen.bounds, abs=0.015)


def test_a_boat_is_cheap_to_draw():
    faces = {name: len(welded(name).faces) for name in MESHES}
    assert sum(faces[name] for name in HULL) + faces["engine"] + faces["propeller"] < 12_000  # two engines
    assert sum(faces[name] for name in CARRIED) < 6_000
    assert sum(Path(FOLDER / "meshes" / f"{name}.obj").stat().st_size for name in MESHES) < 1_000_000


@pytest.mark.parametrize(
    ("names", "low", "high", "tolerance"),
    [
        (("hulls", "trim", "arches", "deck"), (-2.456, -1.244, 0.006), (2.555, 1.244, 1.297), 0.002),
        (("engine",), (-0.411, -0.078, -0.720), (0.032, 0.078, 0.186), 0.002),
        (("propeller",), (-0.167, -0.210, -0.164), (0.0, 0.213, 0.231), 0.03),  # blades of another shape
        (("batteries",), (-0.338, -1.231, 0.439), (0.287, 1.231, 0.767), 0.002),
        (("gps",), (-0.156, -0.156, 0.0), (0.156, 0.156, 0.166), 0.005),
        (("lidar",), (-0.052, -0.052, -0.035), (0.052, 0.052, 0.037), 0.011),  # the socket of its cable
        (("camera",), (-0.038, -0.015, -0.015), (0.039, 0.015, 0.015), 0.005),  # ribs and foot
        (("cpu_cases",), (-0.489, -0.415, -0.233), (0.483, 0.415, 0.230), 0.008),
        (("shooter_base",), (-0.048, -0.060, 0.0), (0.026, 0.060, 0.121), 0.003),
        (("shooter_launcher",), (-0.091, -0.053, -0.063), (0.106, 0.054, 0.060), 0.02),
    ],
)
def test_meshes_fill_the_boxes_of_vrxs(names, low, high, tolerance):
    bounds = np.array([welded(name).bounds for name in names])
    assert bounds[:, 0].min(axis=0) == pytest.approx(low, abs=tolerance)
    assert bounds[:, 1].max(axis=0) == pytest.approx(high, abs=tolerance)


# Engines of which a URDF does not say how hard they are to turn


WEIGHTLESS_TURN = '<inertial><mass value="1"/><inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial>'


@pytest.mark.parametrize("engines", ["fixed", "hinged"])
@pytest.mark.parametrize("inertial", ["", WEIGHTLESS_TURN], ids=["no mass", "no inertia"])
def test_an_engine_that_a_urdf_gives_no_inertia_has_a_servo_that_turns_it(engines, inertial):
    """Its hinge is 2 m aft of a hull whose centre of mass is elsewhere: forces act where the hinge is."""
    stern = f'<link name="stern">{inertial}</link>'
    hull = link("base_link", mass=100).replace("<inertial>", '<inertial><origin xyz="0.5 0 0.4"/>')
    tiller = joint("tiller", "stern", xyz="-2 0 0")
    shaft = joint("shaft", "stern_propeller", parent="stern", kind="continuous")
    parts = (stern, tiller, link("stern_propeller", mass=0), shaft, thruster("stern", "tiller"))
    (row,) = thruster_rows(assemble(*parts, hull=hull), engines, "")
    assert row.inertia == SERVO_INERTIA
    if engines == "hinged":
        assert row.body_com == (0.0, 0.0, 0.0)
