"""Docks of compiled worlds: trees of blocks, placards, zones, and docks that overlap."""

import mujoco
import numpy as np
import pytest

from vrx_mj.config.docks import load_dock
from vrx_mj.config.objects import load_object
from vrx_mj.config.world import load_world
from vrx_mj.errors import UnknownNameError
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.mjcf.docks import BLOCK_MODELS, block_tree, docks_overlap, find_dock
from vrx_mj.mjcf.objects import place_docks
from vrx_mj.model.world import tree_of

POSE = [40, -30, 0, 0, 0, 0.7]


def placed(**world):
    config = load_world(world)
    return list(place_docks(config.docks, config.objects))


def compiled(**world):
    made = compile_world({"sea": {"model": "none"}, "spawn": {"pose": [-50, -50, 0.1, 0, 0, 0]}, **world})
    model = mujoco.MjModel.from_xml_string(made.mjcf, dict(made.assets))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return made, model, data


@pytest.mark.parametrize(
    ("name", "blocks", "loops", "depth"), [("dock_2016", 18, 0, 7), ("dock_2018", 20, 3, 6), ("dock_2022", 22, 0, 8)]
)
def test_vrx_docks_hang_together_as_they_should(name, blocks, loops, depth):
    tree = block_tree(load_dock(name))
    assert len(tree.cells) == blocks
    assert len(tree.closures) == loops
    assert max(tree.depths) == depth


@pytest.mark.parametrize("drawing", ["X", "XX", "XXX\nXXX\nXXX", "XXX\nX X\nXXX", " X\nXXX\n X"])
def test_a_tree_reaches_every_block_once_over_shared_edges(drawing):
    cells = load_dock(drawing)
    tree = block_tree(cells)
    assert sorted(tree.cells) == sorted(cells)
    hinges = [(tree.cells[parent], cell) for cell, parent in zip(tree.cells, tree.parents, strict=True) if parent >= 0]
    assert all(parent < child for child, parent in enumerate(tree.parents))
    assert all(abs(a[0] - b[0]) + abs(a[1] - b[1]) == 1 for a, b in [*hinges, *tree.closures])
    edges = sum((i + 1, j) in cells for i, j in cells) + sum((i, j + 1) in cells for i, j in cells)
    assert len(hinges) + len(tree.closures) == edges


@pytest.mark.parametrize(
    ("name", "hinges", "connects"), [("dock_2016", 17, 0), ("dock_2018", 19, 6), ("dock_2022", 21, 0)]
)
def test_a_floating_dock_is_one_tree_of_hinges(name, hinges, connects):
    _, model, _ = compiled(objects=[{"name": "o", "model": f"{name}_dynamic", "pose": POSE}])
    joints = [model.joint(i) for i in range(model.njnt) if model.joint(i).name.startswith("o/base/")]
    assert sum(int(joint.type[0]) == mujoco.mjtJoint.mjJNT_FREE for joint in joints) == 1
    hung = [joint for joint in joints if int(joint.type[0]) == mujoco.mjtJoint.mjJNT_HINGE]
    assert len(hung) == hinges
    assert all(tuple(joint.range) == (-0.1, 0.1) and joint.damping[0] == 0.0 for joint in hung)
    assert model.neq == connects


@pytest.mark.parametrize("name", ["dock_2016", "dock_2018", "dock_2022"])
@pytest.mark.parametrize("dynamic", [False, True])
def test_blocks_and_placards_start_where_they_belong(name, dynamic):
    model_name = f"{name}_dynamic" if dynamic else name
    made, _, data = compiled(objects=[{"name": "o", "model": model_name, "pose": POSE}])
    turn = np.array([[np.cos(0.7), -np.sin(0.7), 0], [np.sin(0.7), np.cos(0.7), 0], [0, 0, 1]])
    for i, j in load_dock(name):
        there = turn @ (2 * i, 2 * j, 0.25) + (40, -30, 0)
        assert data.geom(f"o/base/dock_block_{i}_{j}").xpos == pytest.approx(there)
    (dock,) = placed(objects=[{"name": "o", "model": model_name, "pose": POSE}])
    for placard, entry in zip(dock.geometry.placards, tree_of(made.parameters)["placards"], strict=True):
        assert entry["name"] == f"o/{placard.name}"
        assert data.body(entry["body"]).xpos == pytest.approx(turn @ placard.pose[:3] + (40, -30, 0))
        assert tuple(entry["geoms"]) == placard.shapes
    assert tree_of(made.parameters)["docks"][0]["bodies"][0] == "o/base/dock"


def test_only_the_symbol_to_show_is_seen():
    keys = {"name": "o", "model": "dock_2018", "symbols": ["red_cross", "green_triangle"]}
    made, model, data = compiled(objects=[keys])
    for entry, shape, color in zip(
        tree_of(made.parameters)["placards"], ("cross", "triangle"), ((1, 0, 0), (0, 1, 0)), strict=True
    ):
        for name, geoms in entry["geoms"].items():
            for geom in geoms:
                assert tuple(model.geom(geom).rgba) == pytest.approx((*color, float(name == shape)))
    cross = data.geom("o/dock_2018_placard1/cross1").xpos
    assert cross == pytest.approx((7.6, 3, 2.35))
    assert data.geom("o/dock_2018_placard2/circle1").xpos == pytest.approx((6.4, 3, 2.35))


@pytest.mark.parametrize("edge", sorted(BLOCK_MODELS))
def test_a_block_of_any_size_weighs_what_vrx_gives_it(edge):
    made, model, data = compiled(docks=[{"name": "d", "layout": "XX", "dynamic": True, "block": edge}])
    block = load_object(BLOCK_MODELS[edge])
    for body, x in (("d/dock", 0.0), ("d/dock_block_0_1", edge)):
        assert model.body(body).mass == pytest.approx(block.mass)
        assert (*model.body(body).inertia, 0.0, 0.0, 0.0) == pytest.approx(block.inertia)
        assert data.body(body).xipos == pytest.approx((0.0, x, 0.25))
    assert model.geom("d/dock_block_0_1").size == pytest.approx((edge / 2, edge / 2, 0.2))
    assert [row["mass"] for row in tree_of(made.parameters)["blocks"]] == [block.mass] * 2
    assert all(element["position"][:2] == [0.0, 0.0] for element in tree_of(made.parameters)["elements"])


def test_blocks_of_one_dock_never_touch_each_other():
    objects = [{"name": "o", "model": f"dock_{year}_dynamic", "pose": [30, 40 * k, 0, 0, 0, 0]} | {"name": f"o{k}"}
               for k, year in enumerate((2016, 2018, 2022))]  # fmt: skip
    _, model, data = compiled(objects=objects)
    hinges = [i for i in range(model.njnt) if model.joint(i).name.endswith("/hinge")]
    rng = np.random.default_rng(3)
    for _ in range(5):
        data.qpos[model.jnt_qposadr[hinges]] = rng.uniform(-0.1, 0.1, len(hinges))
        mujoco.mj_forward(model, data)
        assert [c for c in data.contact if model.geom(c.geom1).name and model.geom(c.geom2).name] == []


def test_a_dock_is_known_by_its_own_name_or_by_its_object():
    docks = placed(
        docks=[{"name": "mine", "layout": "XX"}],
        objects=[{"name": "o", "model": "dock_2022", "pose": POSE}],
    )
    assert [find_dock(docks, name).name for name in ("mine", "o", "o/base")] == ["mine", "o/base", "o/base"]
    with pytest.raises(UnknownNameError) as caught:
        find_dock(docks, "minr")
    assert str(caught.value) == "no dock named 'minr'; did you mean 'mine'?"


@pytest.mark.parametrize(
    ("pose", "meet"),
    [
        ([0, 8, 0, 0, 0, 0], False),  # edge to edge
        ([0, 7.9, 0, 0, 0, 0], True),
        ([0, 2.2, 0, 0, 0, 0], False),  # inside the bay
        ([0, 2.2, 0, 0, 0, 0.785], True),  # its corners reach the sides
        ([100, 3, 0, 0, 0, 0.3], False),
    ],
)
def test_docks_overlap_where_their_blocks_do(pose, meet):
    bay, other = placed(
        docks=[{"name": "a", "layout": "X  X\nX  X\nXXXX"}, {"name": "b", "layout": "X", "pose": pose}],
    )
    assert docks_overlap(bay, other) == meet
    assert docks_overlap(other, bay) == meet


def test_lines_hold_each_dock_where_its_own_corners_are():
    """At the start no line pulls, whichever dock it is of."""
    docks = [
        {
            "name": f"d{n}",
            "layout": "X X\nXXX",
            "dynamic": True,
            "mooring": {},
            "pose": [20 + 40 * n, 9, 0, 0, 0, 0.4 + n],
        }
        for n in range(3)
    ]
    made, model, data = compiled(docks=docks)
    lines, blocks = made.parameters.moorings, made.parameters.blocks
    assert [blocks[line.block].body.partition("/")[0] for line in lines] == [
        f"d{n}" for n in range(3) for _ in range(4)
    ]
    for line in lines:
        body = model.body(blocks[line.block].body).id
        end = data.xpos[body] + data.xmat[body].reshape(3, 3) @ line.point
        assert end[:2] == pytest.approx(line.anchor, abs=1e-9)
