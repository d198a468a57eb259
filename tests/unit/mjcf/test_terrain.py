import json
import math

import mujoco
import numpy as np
import pytest

from vrx_mj.errors import ConfigError, UnknownNameError
from vrx_mj.mjcf.terrain import bank_blocks, on_land, shoreline, terrain_piece

TERRAINS = ("sydney_regatta", "sand_island")
SPAWN = {"sydney_regatta": (-532.0, 162.0), "sand_island": (158.0, 108.0)}

# Feet of VRX's fixed props: x, y, z (VRX classic, sydneyregatta.xacro and sandisland.xacro).
PROPS = {
    "sydney_regatta": [
        (-535.917, 154.363, 0.676),
        (-527.490, 153.855, 0.426),
        (-544.833, 156.672, 0.499),
        (-531.064, 147.669, 1.595),
        (-540.796, 146.494, 1.671),
        (-534.551, 144.910, 1.720),
    ],
    "sand_island": [
        (169.220, 112.060, 0.47),
        (173.558, 100.809, 0.42),
        (177.640, 90.860, 0.30),
        (175.690, 114.290, 1.37),
        (177.610, 117.200, 1.55),
        (188.170, 92.450, 1.55),
    ],
}
SQUARE = [np.array([[0.0, 0.0], [40.0, 0.0], [40.0, 40.0], [0.0, 40.0]])]


def waterline_distance(name, x, y):
    point, least = np.array([x, y]), math.inf
    for ring in map(np.array, shoreline(name)):
        along = np.roll(ring, -1, axis=0) - ring
        share = np.clip(np.sum((point - ring) * along, axis=1) / np.sum(along**2, axis=1), 0.0, 1.0)
        least = min(least, np.min(np.hypot(*(point - ring - share[:, None] * along).T)))
    return least


def document(*where):
    piece = terrain_piece(*where)
    return piece.document(), dict(piece.files)


def compiled(name, body=""):
    text, assets = document(name)
    text = text.replace("</worldbody>", f"{body}</worldbody>")
    text = text.replace("<asset>", '<option timestep="0.01" gravity="0 0 0"/><asset>', 1)
    model = mujoco.MjModel.from_xml_string(text, assets=assets)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def height_of_ground(model, data, x, y, group):
    """What a ray from above meets first in a geom group [m]."""
    groups = np.zeros(6, dtype=np.uint8)
    groups[group] = 1
    start, down = np.array([x, y, 50.0]), np.array([0.0, 0.0, -1.0])
    args = (start, down, groups, 1, -1, np.zeros(1, dtype=np.int32))
    drop = mujoco.mj_ray(model, data, *args, None)
    return 50.0 - drop if drop >= 0.0 else -math.inf


@pytest.mark.parametrize("name", TERRAINS)
def test_boats_spawn_in_clear_water(name):
    assert not on_land(name, *SPAWN[name])
    assert waterline_distance(name, *SPAWN[name]) > 2.45 + 1.0 + 0.5  # half a boat, the bank's foot, and room to turn


@pytest.mark.parametrize("name", TERRAINS)
def test_props_stand_on_the_bank(name):
    model, data = compiled(name)
    for x, y, z in PROPS[name]:
        assert on_land(name, x, y)
        seen = height_of_ground(model, data, x, y, group=2)
        assert seen == pytest.approx(z, abs=0.35)  # one slope everywhere against VRX's uneven ground
        if math.isfinite(hit := height_of_ground(model, data, x, y, group=3)):
            assert hit == pytest.approx(seen, abs=0.05)  # 1.5 m of sand cut straight between corners


@pytest.mark.parametrize("name", TERRAINS)
def test_the_bank_has_no_gap_along_the_waterline(name):
    model, data = compiled(name)
    for ring in map(np.array, shoreline(name)):
        for a, b in zip(ring, np.roll(ring, -1, axis=0), strict=True):
            for share in (0.003, 0.5, 0.997):
                assert height_of_ground(model, data, *(a + share * (b - a)), group=3) > -0.05


def test_blocks_share_faces_at_the_corners():
    blocks = bank_blocks(SQUARE)
    assert blocks.shape == (4, 10, 3)
    np.testing.assert_allclose(blocks[:, 1::2], np.roll(blocks, -1, axis=0)[:, 0::2], atol=1e-12)


def test_a_straight_shore_rises_one_in_four_to_a_crest():
    south = bank_blocks(SQUARE)[0]
    np.testing.assert_allclose(south[2], [-1.0, -1.0, -0.6], atol=1e-12)
    np.testing.assert_allclose(south[4], [0.0, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(south[6], [6.0, 6.0, 1.5], atol=1e-12)


def test_both_sides_of_a_spit_meet_in_a_ridge():
    spit = [np.array([[0.0, 0.0], [60.0, 0.0], [60.0, 6.0], [0.0, 6.0]])]
    south, _, north, _ = bank_blocks(spit)
    assert south[6, 1] == pytest.approx(3.0, abs=0.76)  # in steps of 0.75 m
    assert north[6, 1] == pytest.approx(3.0, abs=0.76)
    assert south[6, 2] >= 0.55


def test_land_lies_left_of_every_ring():
    for name in TERRAINS:
        for ring in map(np.array, shoreline(name)):
            along = ring[1] - ring[0]
            left = np.array([-along[1], along[0]]) / np.hypot(*along)
            middle = (ring[0] + ring[1]) / 2
            assert on_land(name, *(middle + 0.05 * left))
            assert not on_land(name, *(middle - 0.05 * left))


def test_open_water_is_not_land():
    assert not on_land("sand_island", 0.0, 0.0)
    assert not on_land("sand_island", 5000.0, 0.0)


@pytest.mark.parametrize("heading", [-1.2, -1.9, -2.6])
def test_a_boat_driven_at_the_bank_stops_on_it(heading):
    x, y = SPAWN["sydney_regatta"]
    model, data = compiled(
        "sydney_regatta",
        f'<body name="boat" pos="{x} {y} 0.2" quat="{math.cos(heading / 2)} 0 0 {math.sin(heading / 2)}">'
        '<freejoint/><geom type="box" size="2.4 1.2 0.3" mass="180"/></body>',
    )
    boat = model.body("boat").id
    forward = np.array([math.cos(heading), math.sin(heading), 0.0])
    for _ in range(2000):
        up = data.xmat[boat].reshape(3, 3)[:, 2]
        data.xfrc_applied[boat, :3] = 300.0 * forward - 60.0 * data.qvel[:3]
        data.xfrc_applied[boat, 2] -= 3500.0 * min(data.qpos[2] - 0.1, 0.5) + 300.0 * data.qvel[2]  # it floats
        data.xfrc_applied[boat, 3:] = 1500.0 * np.cross(up, [0.0, 0.0, 1.0]) - 400.0 * data.qvel[3:]
        mujoco.mj_step(model, data)
    assert data.ncon > 0
    assert abs(data.qpos[2]) < 0.6
    assert np.hypot(*data.qvel[:2]) < 0.05
    assert math.dist(data.qpos[:2], (x, y)) < 25.0


@pytest.mark.parametrize("name", TERRAINS)
def test_terrain_is_static_and_the_same_every_time(name):
    text, assets = document(name)
    model, _ = compiled(name)
    assert (model.nbody, model.nv) == (1, 0)
    assert model.ngeom <= 330  # each static geom costs some 25 ns a step
    terrain_piece.__globals__["_build"].cache_clear()
    assert document(name) == (text, assets)


def test_six_digits_hold_the_blocks():
    """The saved world is written with six digits: nothing may move by that."""
    text, _ = document("sydney_regatta")
    for line in text.splitlines():
        if 'vertex="' in line:
            for number in line.split('vertex="')[1].split('"')[0].split():
                assert float(f"{float(number):.6g}") == float(number)


def test_an_unknown_terrain_names_the_nearest():
    with pytest.raises(UnknownNameError, match=r"^no terrain named 'sydney_regata'; did you mean 'sydney_regatta'\?$"):
        document("sydney_regata")


def test_a_terrain_beside_the_world_is_found(tmp_path):
    (tmp_path / "terrain").mkdir()
    island = {"land": [{"exterior": [[0, 0], [30, 0], [30, 30], [0, 30], [0, 0]]}]}
    (tmp_path / "terrain" / "小岛.json").write_text(json.dumps(island), encoding="utf-8-sig")
    assert shoreline("小岛", tmp_path) == (((0, 0), (30, 0), (30, 30), (0, 30)),)
    text, assets = document("小岛", tmp_path)
    assert mujoco.MjModel.from_xml_string(text, assets=assets).ngeom == 6


def test_a_shore_that_changes_is_read_anew(tmp_path):
    (tmp_path / "terrain").mkdir()
    for size in (30, 300, 3000):
        island = {"land": [{"exterior": [[0, 0], [size, 0], [size, size], [0, size]]}]}
        (tmp_path / "terrain" / "isle.json").write_text(json.dumps(island), encoding="utf-8")
        assert shoreline("isle", tmp_path) == (((0, 0), (size, 0), (size, size), (0, size)),)
        assert on_land("isle", size - 1.0, 1.0, tmp_path)


BEYOND = "a coordinate of 2.5e+07 m; at most 1e+06 m is allowed"


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("{", "Expecting property name enclosed in double quotes: line 1 column 2 (char 1)"),
        ("[]", "list indices must be integers or slices, not str"),
        ('{"land": [{}]}', "'exterior'"),
        ('{"land": [{"exterior": [[0, 0], [1, 0]]}]}', "a ring must have at least three points"),
        ('{"land": [{"exterior": [[0, 0], [1, NaN], [2, 1]]}]}', "a ring must be a list of points [x, y] in m"),
        ('{"land": [{"exterior": [0, 1, 2]}]}', "a ring must be a list of points [x, y] in m"),
        ('{"land": []}', "0 points; 3 to 5000 are allowed"),
        (f'{{"land": [{{"exterior": {[[n, n * n] for n in range(5001)]}}}]}}', BEYOND),
        (f'{{"land": [{{"exterior": {[[n, n % 2] for n in range(5001)]}}}]}}', "5001 points; 3 to 5000 are allowed"),
        (f'{{"land": [{{"exterior": [[1, 0], [0, {10**400}], [0, 0]]}}]}}', "int too large to convert to float"),
        ('{"land": ' + "[" * 100_000, "nested too deeply"),
    ],
)  # fmt: skip
def test_a_broken_shoreline_is_named(tmp_path, text, reason):
    (tmp_path / "terrain").mkdir()
    path = tmp_path / "terrain" / "bad.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        shoreline("bad", tmp_path)
    wanted = "expected {land: [{exterior: [[x, y], ...], holes: [...]}]}"
    assert str(caught.value) == f"{path}: land: invalid shoreline: {reason}; {wanted}"


CROSSING, TWICE, FLAT = (
    [[0, 0], [9, 9], [9, 0], [0, 9]],
    [[0, 0], [9, 0], [0, 0], [9, 0], [3, 0]],
    [[0, 0], [1, 0], [2, 0]],
)
ISLAND = [[0, 0], [9, 0], [9, 9], [0, 9]]


@pytest.mark.parametrize(
    ("land", "reason"),
    [
        ([{"exterior": ISLAND}, {"exterior": CROSSING}], "land[1] is not a polygon: Self-intersection[4.5 4.5]"),
        ([{"exterior": TWICE}], "land[0] is not a polygon: Self-intersection[3 0]"),
        ([{"exterior": FLAT}], "land[0] is not a polygon: Self-intersection[1 0]"),
        (
            [{"exterior": ISLAND, "holes": [[[20, 20], [21, 20], [21, 21]]]}],
            "land[0] is not a polygon: Hole lies outside shell[20 20]",
        ),
        ([{"exterior": ISLAND, "holes": [CROSSING]}], "land[0] is not a polygon: Self-intersection[4.5 4.5]"),
    ],
)
@pytest.mark.parametrize("use", [shoreline, terrain_piece])
def test_rings_that_cross_themselves_are_refused_wherever_they_are_read(tmp_path, land, reason, use):
    (tmp_path / "terrain").mkdir()
    path = tmp_path / "terrain" / "bad.json"
    path.write_text(json.dumps({"land": land}), encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        use("bad", tmp_path)
    wanted = "expected {land: [{exterior: [[x, y], ...], holes: [...]}]}"
    assert str(caught.value) == f"{path}: land: invalid shoreline: {reason}; {wanted}"


def test_an_edge_without_length_is_left_out(tmp_path, monkeypatch):
    ring = [[0, 0], [0, 1e-200], [40, 0], [40, 30], [0, 30], [0, 0]]
    (tmp_path / "terrain").mkdir()
    (tmp_path / "terrain" / "isle.json").write_text(json.dumps({"land": [{"exterior": ring}]}), "utf-8")
    monkeypatch.chdir(tmp_path)
    assert len(shoreline("isle")[0]) == 4
    assert len(terrain_piece("isle").hulls) == 4
