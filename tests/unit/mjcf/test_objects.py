import csv
import math
from pathlib import Path

import mujoco
import numpy as np
import pytest

from integration.sailing import object_kinds
from vrx_mj.config.objects import ObjectConfig, Placement, load_object
from vrx_mj.config.search import catalogue
from vrx_mj.config.shapes import BuoyancyElement
from vrx_mj.frames import compose, rotation
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.mjcf.objects import object_piece, place_docks, place_objects
from vrx_mj.packages import root

GOLDEN = Path(__file__).parents[2] / "golden"
OBJECTS = root() / "assets" / "objects"
MODELS = [name for name, file in catalogue("objects").items() if file.is_relative_to(OBJECTS)]
COLLISION, VISUAL = 3, 2
UNSEEN = {"moving_pinger"}


def rows(name):
    lines = (GOLDEN / name).read_text(encoding="utf-8").splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))


FLOATING = {row["model"]: row for row in rows("objects.csv")}
COURSES = {row["model"]: int(row["objects"]) for row in rows("courses.csv")}
SINGLE = [name for name in MODELS if object_kinds()[name] != "composite"]


def compiled(config):
    piece = object_piece(config)
    text, assets = piece.document(), dict(piece.files)
    return mujoco.MjSpec.from_string(text, assets=assets).compile()


def geoms_of(model, group):
    return np.flatnonzero(model.geom_group == group)


def placed(name):
    return list(place_objects((Placement(name="it", model=name),)))


def section_area(element, height):
    """Area [m2] of the upright element's cross-section at heights above its centre [m]."""
    if element.type == "sphere":
        return math.pi * np.maximum(element.radius**2 - height**2, 0.0)
    if element.type == "box":
        return np.where(np.abs(height) <= element.size[2] / 2, element.size[0] * element.size[1], 0.0)
    return np.where(np.abs(height) <= element.length / 2, math.pi * element.radius**2, 0.0)


def displaced(buoyancy, link_z):
    """Volume [m3] under z = 0 when the upright link's origin is at `link_z`."""
    z = np.linspace(-4.0, 0.0, 40_001)
    areas = sum(section_area(element, z - link_z - element.pose[2]) for element in buoyancy.elements)
    return float(np.trapezoid(areas, z))


def rest_height(config):
    low, high = -2.0, 2.0
    while high - low > 1e-6:
        middle = (low + high) / 2
        afloat = config.buoyancy.fluid_density * displaced(config.buoyancy, middle) > config.mass
        low, high = (middle, high) if afloat else (low, middle)
    return low


def element_text(element):
    sizes = element.size or tuple(value for value in (element.radius, element.length) if value is not None)
    return f"{element.type} {' '.join(f'{value:.9g}' for value in sizes)} @ {element.pose[2]:.9g}"


def half_extent(model, data, geom):
    """Half the size of a geom along the world's axes [m]."""
    turn, size = data.geom_xmat[geom].reshape(3, 3), model.geom_size[geom]
    kind = model.geom_type[geom]
    if kind in {mujoco.mjtGeom.mjGEOM_SPHERE, mujoco.mjtGeom.mjGEOM_ELLIPSOID}:
        axes = size if kind == mujoco.mjtGeom.mjGEOM_ELLIPSOID else np.full(3, size[0])
        return np.linalg.norm(turn * axes, axis=1)
    if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        return np.abs(turn[:, 2]) * size[1] + size[0]
    if kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        return np.abs(turn[:, 2]) * size[1] + size[0] * np.sqrt(np.clip(1 - turn[:, 2] ** 2, 0, 1))
    return np.abs(turn) @ model.geom_aabb[geom][3:]


def visible_size(model):
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    seen = geoms_of(model, VISUAL)
    half = np.array([half_extent(model, data, geom) for geom in seen])
    return (data.geom_xpos[seen] + half).max(axis=0) - (data.geom_xpos[seen] - half).min(axis=0)


def test_the_golden_tables_cover_the_catalogue():
    floating = {name for name in SINGLE if object_kinds()[name] == "floating"}
    assert set(FLOATING) == {name for name in floating if not name.startswith("demo_")}
    assert set(COURSES) == set(MODELS) - set(SINGLE)


@pytest.mark.parametrize("name", SINGLE)
def test_a_model_compiles_in_plain_mujoco(name):
    config = load_object(name)
    model = compiled(config)
    visuals = geoms_of(model, VISUAL)
    assert len(visuals) == len(config.visuals)
    assert config.visuals or name in UNSEEN
    assert len(geoms_of(model, COLLISION)) == len(config.collisions)
    assert not model.geom_contype[visuals].any()
    assert not model.geom_conaffinity[visuals].any()
    assert model.njnt == (config.kind == "floating")
    assert model.body(config.link).id == 1


@pytest.mark.parametrize("name", FLOATING)
def test_mass_properties_and_buoyancy_are_vrxs(name):
    row, config = FLOATING[name], load_object(name)
    body = compiled(config).body(config.link)
    assert body.mass == pytest.approx(float(row["mass"]), rel=1e-12)
    assert body.ipos == pytest.approx([float(row[key]) for key in ("com_x", "com_y", "com_z")])
    assert body.inertia == pytest.approx([float(row[key]) for key in ("ixx", "iyy", "izz")], rel=1e-12)
    assert body.iquat == pytest.approx([1, 0, 0, 0])
    buoyancy = config.buoyancy
    assert (buoyancy.fluid_density, buoyancy.fluid_level) == (1000, 0)
    assert buoyancy.linear_drag == float(row["linear_drag"])
    assert buoyancy.angular_drag == float(row["angular_drag"])
    assert "; ".join(map(element_text, buoyancy.elements)) == row["elements"]


@pytest.mark.parametrize("name", FLOATING)
def test_a_model_rests_at_vrxs_height(name):
    # 1e-3: sections are summed every 0.1 mm, and the table has three to nine digits
    assert rest_height(load_object(name)) == pytest.approx(float(FLOATING[name]["z0"]), abs=1e-3)


@pytest.mark.parametrize(
    "element",
    [*load_object("robotx_light_buoy").buoyancy.elements, *load_object("demo_sphere").buoyancy.elements],
)
def test_an_elements_volume_is_the_sum_of_its_sections(element):
    z = np.linspace(-0.5, 0.5, 100_001)
    assert element.volume == pytest.approx(np.trapezoid(section_area(element, z), z), rel=1e-3)


@pytest.mark.parametrize("name", [name for name, row in FLOATING.items() if row["size_x"]])
def test_a_model_looks_as_large_as_vrxs(name):
    row = FLOATING[name]
    # 3 cm: our shapes are not VRX's meshes
    expected = [float(row[key]) for key in ("size_x", "size_y", "size_z")]
    assert visible_size(compiled(load_object(name))) == pytest.approx(expected, abs=0.03)


@pytest.mark.parametrize("name", COURSES)
def test_a_course_has_all_its_objects(name):
    parts = placed(name)
    assert len(parts) == COURSES[name]
    assert len({part.name for part in parts}) == len(parts)
    docks = list(place_docks((), (Placement(name="it", model=name),)))
    assert len(docks) == name.startswith("dock_")


def test_gates_lead_from_white_to_black():
    parts = {part.name: part for part in placed("short_navigation_course0")}
    models = [parts[f"it/green_bound_{gate}"].model.removeprefix("mb_marker_buoy_") for gate in range(3)]
    assert models == ["white", "green", "black"]
    assert parts["it/red_bound_2"].pose == pytest.approx((-40, 0, 0, 0, 0, 0))
    assert parts["it/green_bound_2"].pose == pytest.approx((-40, -20, 0.2, 0, 0, 0))


@pytest.mark.parametrize("placard", [1, 2, 3])
def test_placards_of_2022_stand_where_vrx_composes_them(placard):
    # models/dock_2022/model.sdf.erb: the placard's pose in the dock; board and symbols in the placard
    placard_pose = (5.75, 3 + 6 * (placard - 1), 1.5, 0, 0, math.pi / 2)
    board = compose(placard_pose, (0, -0.2, 0.25, 0, 0, 3.14159))
    symbol = compose(placard_pose, (0, 0.07, 0, 0, 0, 0))
    (dock,) = place_docks((), (Placement(name="it", model="dock_2022"),))
    found = dock.geometry.placards[placard - 1]
    assert found.pose == pytest.approx(board, abs=1e-5)
    assert found.symbol_pose == pytest.approx(symbol, abs=1e-5)
    assert found.symbol == "blue_circle"


def test_holes_of_the_2022_placard_are_open_and_where_the_ball_must_go():
    model = compiled(load_object("placard_2022"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    collide = np.array([0, 0, 0, 1, 0, 0], np.uint8)
    geom = np.zeros(1, np.int32)

    def blocked(x, z):
        start, along = np.array([x, -1.0, z]), np.array([0.0, 1.0, 0.0])
        return mujoco.mj_ray(model, data, start, along, collide, 1, -1, geom, None) >= 0

    large = [(-0.6 + a, 1.077 + b) for a in (-0.24, 0, 0.24) for b in (-0.24, 0, 0.24)]
    small = [(0.613 + a, 1.077 + b) for a in (-0.12, 0, 0.12) for b in (-0.12, 0, 0.12)]
    assert not any(blocked(x, z) for x, z in large + small)
    beside = [
        (-0.9, 1.077),
        (-0.3, 1.077),
        (0.45, 1.077),
        (0.8, 1.077),
        (-0.6, 1.4),
        (-0.6, 0.75),
        (0.613, 0.9),
    ]
    assert all(blocked(x, z) for x, z in beside)


def test_angles_turn_about_fixed_axes_roll_first():
    angles = (0.3, -0.7, 1.9)
    box = {"type": "box", "size": (1.0, 2.0, 3.0), "pose": (0.1, 0.2, 0.3, *angles)}
    model = compiled(ObjectConfig.model_validate({"static": True, "collisions": (box,)}))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert data.geom_xmat[0].reshape(3, 3) == pytest.approx(np.array(rotation(*angles)), abs=1e-12)
    assert model.geom_size[0] == pytest.approx([0.5, 1.0, 1.5])
    assert model.geom_pos[0] == pytest.approx([0.1, 0.2, 0.3])


def test_one_mesh_file_serves_several_scales():
    mesh = {"type": "mesh", "file": "meshes/triangle.obj", "folder": OBJECTS}
    config = ObjectConfig.model_validate({"static": True, "visuals": (mesh, {**mesh, "scale": 2.0}, mesh)})
    piece = object_piece(config)
    text, assets = piece.document(), dict(piece.files)
    model = compiled(config)
    assert [name.partition("_")[0] for name in assets] == ["mesh"]
    assert len(assets) == 1
    assert model.nmesh == 2
    assert (OBJECTS / "meshes" / "triangle.obj").read_bytes() in assets.values()
    assert text == object_piece(config).document()


def test_a_mesh_stays_where_its_file_puts_it():
    # MuJoCo moves a mesh to its centre of mass and the geom the other way
    model = compiled(load_object("symbol_red_triangle"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    corners = data.geom_xpos[0] + model.mesh_vert @ data.geom_xmat[0].reshape(3, 3).T
    assert corners.min(axis=0) == pytest.approx([-0.5, -0.0005, -0.5], abs=1e-6)
    assert corners.max(axis=0) == pytest.approx([0.5, 0.0005, 0.3660254], abs=1e-6)


def test_a_joined_body_is_the_sum_of_its_parts():
    """The demo's cylinder (5 kg) and box (10 kg), by the file's rounded formulas, at their common centre."""
    parts = [
        (5, (0, 0, 0), 0.0833333 * 5 * np.array([0.12, 0.12, 0]) + [0, 0, 0.5 * 5 * 0.01]),
        (10, (0, 0.2, 0.15), 0.83 * np.array([0.09 + 0.171**2, 2 * 0.171**2, 0.09 + 0.171**2])),
    ]
    center = sum(mass * np.array(at) for mass, at, _ in parts) / 15
    inertia = sum(
        np.diag(own) + mass * ((d := np.array(at) - center) @ d * np.eye(3) - np.outer(d, d)) for mass, at, own in parts
    )
    config, turn = load_object("demo_joined"), np.array(rotation(0.587087348, 0, 0))
    assert config.mass == 15
    assert turn @ config.center_of_mass == pytest.approx(center, abs=1e-8)
    assert turn @ np.diag(config.inertia[:3]) @ turn.T == pytest.approx(inertia, abs=1e-8)


def test_an_element_is_a_shape():
    assert BuoyancyElement(type="box", size=(1.0, 2.0, 3.0)).volume == 6


def test_a_rope_ends_under_the_centre_of_mass_and_stops_what_it_holds_without_a_swing():
    """At the start a rope without slack does not pull, wherever a thing's mass is and however it is turned."""
    models = ["surmark46104", "robotx_light_buoy", "crocodile_static", "mb_round_buoy_black"]
    things = [
        {"name": model, "model": model, "pose": [40 * n, 5, 0, 0.1, 0.2, 0.5 + n], "mooring": {"length": 0.0}}
        for n, model in enumerate(models)
    ]
    made = compile_world({"physics": {"profile": "marine"}, "objects": things}, fleet="none")
    model = mujoco.MjModel.from_xml_string(made.mjcf, dict(made.assets))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    rows, off = made.parameters.floats, []
    assert len(made.parameters.ropes) == len(models)
    for rope in made.parameters.ropes:
        body = model.body(rows[rope.float].body).id
        assert data.subtree_com[body][:2] == pytest.approx(rope.anchor, abs=1e-9)
        assert rope.damping == pytest.approx(2.0 * math.sqrt(rope.stiffness * model.body_subtreemass[body]))  # critical
        off.append(np.linalg.norm(data.subtree_com[body][:2] - data.xpos[body][:2]))
    assert max(off) > 0.01  # or the place of the mass would not matter
