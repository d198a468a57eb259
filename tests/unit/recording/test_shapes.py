"""Geoms as triangles: closed forms, and coarser copies."""

import subprocess
import sys
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from fingerprints import check
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.recording.record_scene import Surface
from vrx_mj.recording.simulation_scene import FINE_BOATS, MOST_FACES, coarser, geom_surface, scene_of
from vrx_mj.recording.static_chunks import looks_chunks
from vrx_mj.runtime.simulation import Simulation

PI = np.pi
CUBE = " ".join(f"{x} {y} {z}" for x in (-1, 1) for y in (-1, 1) for z in (-1, 1))
FAN = "0 1 3  0 3 2  4 6 7  4 7 5  0 4 5  0 5 1  2 3 7  2 7 6  0 2 6  0 6 4  1 5 7  1 7 3"


def surface(geom: str, assets: str = "") -> Surface:
    text = f"<mujoco><asset>{assets}</asset><worldbody><geom {geom}/></worldbody></mujoco>"
    return geom_surface(mujoco.MjModel.from_xml_string(text), 0)


def volume_and_area(shape: Surface) -> tuple[float, float]:
    a, b, c = np.moveaxis(shape.vertices[shape.faces].astype(np.float64), 1, 0)
    normal = np.cross(b - a, c - a) / 2.0
    return float(np.sum((a + b + c) / 3.0 * normal) / 3.0), float(np.linalg.norm(normal, axis=1).sum())


@pytest.mark.parametrize(
    ("geom", "volume", "area"),
    [
        ("type='box' size='0.5 1 1.5'", 6.0, 22.0),
        ("type='cylinder' size='0.5 1'", PI / 2, 2.5 * PI),
        ("type='capsule' size='0.5 1'", 2 * PI / 3, 3 * PI),
        ("type='sphere' size='2'", 32 * PI / 3, 16 * PI),
        ("type='ellipsoid' size='2 2 1'", 16 * PI / 3, 8 * PI + 2 * PI / np.sqrt(0.75) * np.arctanh(np.sqrt(0.75))),
    ],
)
def test_primitives_have_the_volume_and_area_of_their_formulas(geom, volume, area):
    shape = surface(f"{geom} pos='3 4 5' euler='10 20 30'")
    found = volume_and_area(shape)
    rel = 1e-6 if "box" in geom else 0.07  # 16 facets: 2.6 %, 8 rings: 5 %
    assert found == pytest.approx((volume, area), rel=rel)
    assert found[0] <= volume * (1 + 1e-6)


@pytest.mark.parametrize("kind", ["box", "cylinder", "capsule", "ellipsoid"])
def test_normals_of_primitives_are_those_of_their_faces(kind):
    shape = surface(f"type='{kind}' size='1 1.5 0.8' quat='0.5 0.5 -0.5 0.5'")
    a, b, c = np.moveaxis(shape.vertices[shape.faces].astype(np.float64), 1, 0)
    own = np.cross(b - a, c - a)
    assert np.all(np.linalg.norm(own, axis=1) > 1e-6)  # no face is a line
    cosine = np.einsum("fi,fci->fc", own / np.linalg.norm(own, axis=1, keepdims=True), shape.normals[shape.faces])
    assert cosine.min() > (1 - 1e-6 if kind == "box" else np.cos(np.radians(40)))
    assert np.linalg.norm(shape.normals, axis=1) == pytest.approx(np.ones(len(shape.normals)))


def test_a_mesh_without_normals_keeps_its_edges():
    cube = surface("type='mesh' mesh='cube'", f"<mesh name='cube' vertex='{CUBE}' face='{FAN}'/>")
    assert volume_and_area(cube) == pytest.approx((8.0, 24.0))
    assert np.sort(np.abs(cube.normals), axis=1) == pytest.approx(np.tile([0, 0, 1], (len(cube.normals), 1)), abs=1e-6)


def test_a_coarser_surface_has_at_most_so_many_faces_and_stays_where_it_was():
    ball, rod = surface("type='sphere' size='1'"), surface("type='cylinder' size='0.02 1' euler='0 90 0'")
    for most in (400, 200, 100):
        found = coarser([ball, rod], most)
        assert sum(len(one.faces) for one in found) <= most
        assert all(len(one.faces) >= 12 for one in found)
        for before, after in zip((ball, rod), found, strict=True):
            corners = {tuple(row) for row in before.vertices}
            assert {tuple(row) for row in after.vertices} <= corners
            assert np.ptp(after.vertices, axis=0) == pytest.approx(np.ptp(before.vertices, axis=0), rel=0.35)
    assert [len(one.faces) for one in coarser([ball, rod], 30)].count(0) == 1


def test_a_coarser_plate_keeps_both_its_sides():
    """Two round plates, far apart: vertices of either side of each are in one cell."""
    low, high = (surface(f"type='cylinder' size='1 0.001 1' pos='0 0 {z}'") for z in (0, 1))
    faces = np.concatenate([low.faces, high.faces + len(low.vertices)])
    both = Surface(
        np.concatenate([low.vertices, high.vertices]), faces, np.concatenate([low.normals, high.normals]), low.rgba
    )
    (found,) = coarser([both], len(faces) - 1)
    a, b, c = np.moveaxis(found.vertices[found.faces].astype(np.float64), 1, 0)
    up = np.cross(b - a, c - a)[:, 2] / 2.0
    assert [up[up > 0.0].sum(), -up[up < 0.0].sum()] == pytest.approx([2.0 * PI] * 2, rel=0.35)


def test_shapes_are_what_they_were():
    kinds = ("box", "cylinder", "capsule", "sphere", "ellipsoid")
    shapes = [surface(f"type='{kind}' size='1 1.5 0.8' pos='3 4 5' quat='0.5 0.1 -0.5 0.6'") for kind in kinds]
    cube = surface("type='mesh' mesh='cube'", f"<mesh name='cube' vertex='{CUBE}' face='{FAN}'/>")
    coarse = [coarser([*shapes, cube], most) for most in (900, 300, 60, 20)]
    check("shapes", "all kinds", shapes=[*shapes, cube], coarse=coarse)


def test_a_surface_with_few_faces_is_left_alone():
    box = surface("type='box' size='1 1 1'")
    assert coarser([box], 12)[0] is box


def test_boats_of_a_large_fleet_have_few_triangles_and_share_them():
    many = FINE_BOATS + 1
    sim = Simulation(compile_world({"sea": {"model": "none"}}, fleet={"usv_count": many, "layout": "grid"}))
    scene = scene_of(sim)
    boats = scene.boats()
    for boat in boats:
        own = [
            *boat.surfaces,
            *(one for engine in scene.thrusters if engine.boat == boat.name for one in engine.surfaces),
        ]
        assert 500 < sum(len(one.faces) for one in own) <= MOST_FACES
    assert all(one is first for one, first in zip(boats[-1].surfaces, boats[0].surfaces, strict=True))
    check("shapes", "a boat of many", boat=boats[0].surfaces, engines=[one.surfaces for one in scene.thrusters[:2]])


@pytest.mark.slow
def test_making_a_scene_loads_neither_rerun_nor_a_library_of_meshes():
    code = """
import sys, vrx_mj, vrx_mj.recording.session, vrx_mj.recording.record_scene
from vrx_mj.recording.simulation_scene import scene_of
scene_of(vrx_mj.Simulation(vrx_mj.compile_world("example_course")))
print({"trimesh", "pandas", "rerun", "rerun_bindings", "scipy.spatial", "pyarrow"} & set(sys.modules))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"


def test_vertices_have_the_colour_of_their_surface_or_the_nearest_that_there_is():
    box = surface("type='box' size='1 1 1'")
    shapes = [replace(box, rgba=rgba) for rgba in ((0.2, 0.4, 0.6, 1.0), (1.5, -0.2, 1.0, 0.8))]
    (chunk,) = looks_chunks("/world/a", None, shapes, None)
    batch = chunk.to_record_batch()
    (colors,) = batch.column(next(name for name in batch.schema.names if "vertex_colors" in name)).to_pylist()
    assert colors == [0x336699FF] * len(box.vertices) + [0xFF00FFCC] * len(box.vertices)
