"""Bays, placards and holes of docks: those of a drawing, and VRX's own."""

import math
import re

import pytest

from vrx_mj.config.docks import Bay, dock_geometry, find_bays, load_dock
from vrx_mj.config.objects import load_object
from vrx_mj.config.world import load_world
from vrx_mj.errors import ConfigError

# VRX's scan_dock_deliver.xacro and dock.xacro: centre and size [m] of the zones, dock frame.
BAYS_2022 = [((1.45, 3 + 6 * i, 0.25), (4, 1.5, 2), (-3.55, 3 + 6 * i, 0.25), (1.5, 5.5, 2)) for i in range(3)]
BAYS_2023 = [((1.5, 3 + 6 * i, 0.25), (4, 1.5, 2), (-3.5, 3 + 6 * i, 0.25), (1.5, 5.5, 2)) for i in range(3)]
BAYS_2018 = [
    ((12.5, 3, 0.35), (1.5, 4, 2), (17.5, 3, 0.35), (1.5, 8, 2)),
    ((1.5, 3, 0.35), (1.5, 4, 2), (-2.5, 3, 0.35), (1.5, 8, 2)),
]
PLACARDS = {
    "dock_2016": [(4.5, 3 + 6 * i, 1.75) for i in range(3)],
    "dock_2018": [(7.5, 3, 1.85), (6.5, 3, 1.85)],
    "dock_2022": [(5.95, 3 + 6 * i, 1.75) for i in range(3)],
}
SYMBOLS_AT = {
    "dock_2016": [(4.43, 3 + 6 * i, 2.25) for i in range(3)],
    "dock_2016_dynamic": [(4.40, 3 + 6 * i, 2.25) for i in range(3)],
    "dock_2018": [(7.6, 3, 2.35), (6.4, 3, 2.35)],
    "dock_2018_dynamic": [(7.6, 3, 2.35), (6.4, 3, 2.35)],
    "dock_2022": [(5.68, 3 + 6 * i, 1.5) for i in range(3)],
    "dock_2022_dynamic": [(5.65, 3 + 6 * i, 1.5) for i in range(3)],
}


def of_object(name):
    (dock,) = load_object(name).docks
    return dock_geometry(dock)


def drawn(layout, **keys):
    world = load_world({"docks": [{"name": "d", "layout": layout, **keys}]})
    return dock_geometry(world.docks[0])


def numbers(bay):
    return bay.internal.center, bay.internal.size, bay.external.center, bay.external.size


@pytest.mark.parametrize(
    ("drawing", "found"),
    [
        ("X X\nX X\nXXX", [Bay((0, 1), (1, 1), (-1, 0))]),
        ("XXX\nX X\nX X", [Bay((1, 1), (2, 1), (1, 0))]),
        ("XXX\n  X\nXXX", [Bay((1, 0), (1, 1), (0, -1))]),
        ("XXX\nX\nXXX", [Bay((1, 1), (1, 2), (0, 1))]),
        ("X\nX X\nXXX", [Bay((1, 1), (1, 1), (-1, 0))]),  # as deep as its shorter side
        ("XXX\nX X\nXXX", []),  # a pond
        ("X X\nX X", []),  # a channel
        ("X X\n\nXXX", []),  # sides that do not reach the end
        (" X\nX X\nXXX", []),  # shut by a block before its mouth
        ("XXX", []),
    ],
)
def test_a_bay_has_blocks_on_three_sides_and_open_water_on_the_fourth(drawing, found):
    assert find_bays(load_dock(drawing)) == tuple(found)


def test_bays_come_in_reading_order():
    found = find_bays(load_dock("X X X\nXXXXX\nX X X"))
    assert [bay.first for bay in found] == [(0, 1), (0, 3), (2, 1), (2, 3)]


@pytest.mark.parametrize(("name", "opens"), [("dock_2016", [(-1, 0)] * 3), ("dock_2018", [(-1, 0), (1, 0)])])
def test_the_bays_of_vrx_docks_are_found_in_their_drawings(name, opens):
    assert [bay.opens for bay in find_bays(load_dock(name))] == opens


@pytest.mark.parametrize(
    ("name", "zones"),
    [("dock_2018", BAYS_2018), ("dock_2022", BAYS_2022), ("dock_2023", BAYS_2023), ("dock_2022_base", BAYS_2023)],
)
def test_the_zones_are_vrx_own(name, zones):
    found = of_object(name).bays
    assert [bay.name for bay in found] == [f"bay{i}" for i in range(1, len(zones) + 1)]
    for bay, zone in zip(found, zones, strict=True):
        assert [number for box in numbers(bay) for number in box] == pytest.approx([n for box in zone for n in box])


@pytest.mark.parametrize("name", ["dock_2016", "dock_2018", "dock_2022"])
def test_the_placards_are_where_vrx_has_them(name):
    for model in (name, f"{name}_dynamic"):
        found = of_object(model).placards
        assert [item.name for item in found] == [f"{name}_placard{i}" for i in range(1, len(found) + 1)]
        assert [item.pose[:3] for item in found] == PLACARDS[name]
        assert [item.symbol_pose[:3] for item in found] == SYMBOLS_AT[model]
        assert {item.symbol for item in found} == {"blue_circle"}
        assert {"rectangle" in item.shapes for item in found} == {name == "dock_2022"}


@pytest.mark.parametrize(("name", "shift"), [("dock_2022", 0.0), ("dock_2022_dynamic", 0.0), ("dock_2023", -0.01)])
def test_the_holes_are_vrx_own(name, shift):
    found = {(hole.bay, hole.size): hole for hole in of_object(name).holes}
    assert len(found) == 6
    for bay in (1, 2, 3):
        y = 3 + 6 * (bay - 1) + shift
        assert found[bay, "big"].center == pytest.approx((5.95, y + 0.6, 2.83))
        assert found[bay, "small"].center == pytest.approx((5.95, y - 0.6, 2.83))
        assert found[bay, "big"].box == pytest.approx((0.5, 0.5, 0.5))
        assert found[bay, "small"].box == pytest.approx((0.5, 0.25, 0.25))


def test_the_zones_of_a_drawing_grow_with_its_bay():
    internal, external = Bay((1, 1), (2, 6), (0, 1)).zones(1.0)  # 6 m deep along y, 2 m wide
    assert internal.center == pytest.approx((1.5, 4.0, 0.25))
    assert internal.size == pytest.approx((0.75, 4.0, 2.0))
    assert external.center == pytest.approx((1.5, 9.0, 0.25))
    assert external.size == pytest.approx((3.5, 1.5, 2.0))


def test_a_dock_without_bays_in_its_file_has_zones_but_no_placards():
    found = drawn("X  X\nXXXX")
    assert len(found.bays) == 1
    assert found.bays[0].placard is None
    assert (found.placards, found.holes) == ((), ())


def test_every_listed_bay_gets_a_board_that_faces_out_of_it():
    found = drawn("XXXX\nX  X\nX  X", bays=[{"name": "home", "symbol": "red_cross", "placard": "placard_2022"}])
    (board,) = found.placards
    assert (found.bays[0].name, found.bays[0].placard) == ("home", "d_placard1")
    assert (board.symbol, board.name) == ("red_cross", "d_placard1")
    assert board.pose[:3] == pytest.approx((0.05, 3.0, 1.75))  # 0.95 m behind the end at x = 1
    assert board.symbol_pose[:3] == pytest.approx((0.32, 3.0, 1.5))
    big, small = found.holes
    assert big.center == pytest.approx((0.05, 2.4, 2.83))  # on the left, seen from the bay
    assert small.center == pytest.approx((0.05, 3.6, 2.83))


def test_a_board_may_be_left_out():
    found = drawn("X X X\nXXXXX", bays=[{"placard": "none"}, {}])
    assert [bay.placard for bay in found.bays] == [None, "d_placard2"]


def test_given_zones_win_over_those_of_the_drawing():
    zone = {"center": [1, 2, 3], "size": [4, 5, 6]}
    (bay,) = drawn("X X\nXXX", bays=[{"external": zone}]).bays
    assert bay.external.model_dump() == {"center": (1.0, 2.0, 3.0), "size": (4.0, 5.0, 6.0)}
    assert bay.internal == Bay((0, 1), (0, 1), (-1, 0)).zones(2.0)[0]


def test_a_dock_of_one_row_has_bays_if_it_says_where():
    zone = {"center": [1, 2, 3], "size": [4, 5, 6]}
    found = drawn("XX", bays=[{"placard": "none", "internal": zone, "external": zone}])
    assert [bay.name for bay in found.bays] == ["bay1"]


def test_symbols_go_to_the_placards_in_order():
    found = drawn("X X X\nXXXXX", bays=[{"symbol": "green_cross"}, {"symbol": "red_cross"}], symbols=["yellow_circle"])
    assert [item.symbol for item in found.placards] == ["yellow_circle", "red_cross"]


def test_a_floating_dock_has_an_end():
    with pytest.raises(ConfigError) as caught:
        load_world({"docks": [{"name": "d", "layout": "X" * 201, "dynamic": True}]})
    text = "201 blocks; a floating dock has at most 200"
    assert str(caught.value) == f"<world>: docks[0].dynamic: {text}"
    longest = load_world({"docks": [{"name": "d", "layout": "X" * 200, "dynamic": True}]})
    assert len(longest.docks[0].cells) == 200


def test_a_drawing_has_an_end():
    assert len(load_dock("\n".join(["X" * 100] * 100))) == 10_000
    with pytest.raises(ConfigError) as caught:
        load_dock("\n".join(["X" * 100] * 101))
    assert str(caught.value) == "<dock>:1:1: 101 rows of up to 100 cells; at most 10000 cells"


@pytest.mark.parametrize("opens", [(-1, 0), (1, 0), (0, -1), (0, 1)])
def test_a_board_faces_out_of_its_bay_whichever_way_that_opens(opens):
    """The front of a board is its -y; it stands at the bay's inner end, so that the way out from it is the bay."""
    bay = Bay((1, 1), (2, 2), opens)
    placard = bay.board(2.0, "sign", "placard")
    x, y, _, _, _, yaw = placard.pose
    assert (math.sin(yaw), -math.cos(yaw)) == pytest.approx(opens, abs=1e-12)
    assert (x + opens[0] * 2.95, y + opens[1] * 2.95) == pytest.approx((3.0, 3.0))


LAYOUTS = {
    "an indented block": "|2\n        X X\n      X   X\n      XXXXX",
    "rows in lines": "\n      - '  X X'\n      - 'X   X'\n      - XXXXX",
    "rows in brackets": "['  X X', X   X, XXXXX]",
}


@pytest.mark.parametrize("layout", LAYOUTS.values(), ids=LAYOUTS)
def test_a_first_row_may_begin_with_a_blank(tmp_path, layout):
    file = tmp_path / "mine.yaml"
    file.write_text(f"docks:\n  - name: a\n    layout: {layout}\n", encoding="utf-8")
    (dock,) = load_world(file).docks
    assert dock.cells == ((0, 2), (0, 4), (1, 0), (1, 4), *((2, column) for column in range(5)))
    assert load_world({"docks": [{"name": "a", "layout": ["  X X", "X   X", "XXXXX"]}]}).docks[0].layout == dock.layout


def test_one_row_of_a_list_is_a_row_and_no_name():
    assert load_world({"docks": [{"name": "a", "layout": ["X X"]}]}).docks[0].cells == ((0, 0), (0, 2))
    text = "<world>: docks[0].layout[0]: row 1, column 1: 'd' in a dock; use only X and space"
    with pytest.raises(ConfigError, match=f"^{re.escape(text)}$"):
        load_world({"docks": [{"name": "a", "layout": ["dock_2016"]}]})
