"""What viewers draw: markers against the map of the world, meshes in URDFs against the files, the frame of both."""

import base64
import io
import re
import xml.etree.ElementTree as ET
from pathlib import Path
from urllib.parse import unquote, urlsplit

import mujoco
import numpy as np
import pytest
import trimesh
from trimesh.transformations import quaternion_matrix

import vrx_mj
from ros_scene import served
from vrx_mj.draw.course import map_of
from vrx_mj.formats.urdf.reader import read_mesh
from vrx_mj.mjcf.templates import mesh_of_file
from vrx_mj.ros.table.boats import description
from vrx_mj.ros.table.viewers import CUBE, DELETE_ALL, MARKERS, START, TRIANGLES, with_meshes_inside
from vrx_mj.sensors.displays import displays_of

CELL = 0.3
"""Distance from the centre of a dock's cell at which its float is drawn, at most [m]."""
LAND = 6.0
"""Distance from a point of the shoreline at which the land begins, at most [m]: its mesh has slopes of that width."""


def latched(scene, name):
    return scene.network.got[name][-1].message


def places(markers, start):
    """(n, 3) of markers in the world [m]."""
    found = [(one.pose.position.x, one.pose.position.y, one.pose.position.z) for one in markers]
    return np.array(found).reshape(-1, 3) + start


def triangles(marker, start):
    """(n, 3) corners of a marker in the world [m]."""
    turn, at = marker.pose.orientation, places([marker], start)
    points = np.array([(point.x, point.y, point.z) for point in marker.points])
    return points @ quaternion_matrix([turn.w, turn.x, turn.y, turn.z])[:3, :3].T + at


@pytest.fixture(scope="module")
def docks():
    return vrx_mj.compile_world("scan_dock_deliver")


def split(scene):
    """Markers by namespace, after the one that removes those of before."""
    clear, *markers = latched(scene, MARKERS).markers
    assert clear.action == DELETE_ALL
    assert {one.header.frame_id for one in markers} == {START}
    return {space: [one for one in markers if one.ns == space] for space in ("shore", "docks", "objects")}


def test_markers_are_the_docks_objects_and_shore_of_the_map(docks):
    scene = served(docks)
    scene.server.announce()
    found, start, drawn = split(scene), scene.server.scenery.start, map_of(docks)
    cubes = places([one for one in found["docks"] if one.type == CUBE], start)
    for cell in np.concatenate([dock.cells for dock in drawn.docks]):
        assert np.linalg.norm(cubes[:, :2] - cell, axis=1).min() < CELL
    at = places(found["objects"], start)
    colors = np.array([(one.color.r, one.color.g, one.color.b) for one in found["objects"]])
    for item in drawn.objects:
        near = np.linalg.norm(at[:, :2] - (item.x, item.y), axis=1) < item.size
        assert np.abs(colors[near] - item.color).max(axis=1).min() < 1e-6, item.name
    corners = np.concatenate([triangles(one, start)[:, :2] for one in found["shore"]])
    for point in np.concatenate(drawn.shore):
        assert np.linalg.norm(corners - point, axis=1).min() < LAND
    assert {one.type for one in found["shore"]} == {TRIANGLES}


def test_markers_are_the_same_by_the_names_of_vrx_and_of_vrx_3(docks):
    ros1, ros2 = served(docks), served(docks, dialect="vrx3")
    for scene in (ros1, ros2):
        scene.server.announce()
    output = ros2.network.table.outputs[MARKERS]
    assert (output.type, output.latched) == ("visualization_msgs/MarkerArray", True)
    assert output.make() == latched(ros1, MARKERS) == latched(ros2, MARKERS)


def test_what_a_light_or_placard_shows_is_left_to_cameras(docks):
    scene = served(docks)
    scene.server.announce()
    model = mujoco.MjModel.from_xml_string(docks.mjcf, assets=dict(docks.assets))
    shown = {name for one in displays_of(docks.parameters) for names in one.parts.values() for name in names}
    numbers = {model.geom(name).id for name in shown}
    assert len(numbers) > 10
    assert not numbers & {one.id for one in latched(scene, MARKERS).markers}


def test_markers_are_sent_again_when_an_object_comes_and_not_before(bay):
    scene = served(bay)
    scene.server.announce()
    scene.server.advance(200)
    assert len(scene.network.got[MARKERS]) == 1
    before = len(latched(scene, MARKERS).markers)
    scene.sim.spawn_object("red", model="mb_marker_buoy_red", pose=(-480, 210, 0, 0, 0, 0))
    scene.server._update()
    scene.server.advance(200)
    assert len(scene.network.got[MARKERS]) == 2
    assert len(latched(scene, MARKERS).markers) > before


def test_the_frame_start_is_in_map_near_the_boats(scene):
    scene.server.announce()
    start = scene.server.scenery.start
    near = next(one for one in latched(scene, "/tf_static").transforms if one.child_frame_id == START)
    shift = near.transform.translation
    assert near.header.frame_id == "map"
    assert [shift.x, shift.y, shift.z] == start.tolist()
    for boat in scene.sim.boats:
        assert np.linalg.norm(scene.sim.observe()[boat].position[:2] - start[:2]) < 20.0
    scene.sim.spawn("guest", pose=(*start[:2] + 900.0, 0.1, 0.0, 0.0, 0.0))
    scene.server._update()
    assert latched(scene, "/tf_static").transforms[0] == near


def meshes(text):
    return [one.get("filename") for one in ET.fromstring(text).iter("mesh")]


def test_meshes_inside_are_those_of_the_files(course):
    text = description(course, "wamv")
    whole = with_meshes_inside(text, course.assets)
    files, inside = meshes(text), meshes(whole)
    assert len(files) == len(inside) > 10
    for file, url in set(zip(files, inside, strict=True)):
        head, content = url.split(",")
        assert head == "data:model/gltf-binary;base64"
        mesh = trimesh.load(io.BytesIO(base64.b64decode(content)), file_type="glb", force="mesh", process=False)
        read = read_mesh(Path(unquote(urlsplit(file).path)))
        turned = np.column_stack([mesh.vertices[:, 0], -mesh.vertices[:, 2], mesh.vertices[:, 1]])  # z up again
        assert np.allclose(turned[mesh.faces], read.points[read.triangles], atol=1e-6)
    assert re.sub(r'filename="[^"]*"', "", text) == re.sub(r'filename="[^"]*"', "", whole)


@pytest.mark.parametrize("name", ["package://nowhere/a.stl", "file:///nowhere/a.stl", "http://localhost/a.stl"])
def test_a_mesh_that_is_not_there_stays_as_it_is(course, name):
    text = f'<robot><link name="a"><visual><geometry><mesh filename="{name}"/></geometry></visual></link></robot>'
    assert with_meshes_inside(text, course.assets) == text


def test_a_urdf_from_elsewhere_gets_no_file_that_its_world_does_not_have(course, tmp_path):
    secret = tmp_path / "secret.stl"
    trimesh.creation.box().export(secret)
    text = f'<robot><mesh filename="{secret.as_uri()}"/></robot>'
    assert with_meshes_inside(text, course.assets) == text
    assert with_meshes_inside(text, [mesh_of_file(secret).file]) != text


def test_every_boat_has_its_description_as_a_topic_with_its_meshes_inside(scene):
    scene.server.announce()
    for boat in scene.sim.boats:
        text = latched(scene, f"/{boat}/robot_description").data
        assert text == with_meshes_inside(description(scene.sim.world, boat), scene.sim.world.assets)
        assert not [name for name in meshes(text) if not name.startswith("data:")]
