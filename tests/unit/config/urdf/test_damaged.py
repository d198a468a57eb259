"""A URDF of VRX changed at random: it is read, or refused with a message."""

import random
from contextlib import suppress
from pathlib import Path

import pytest
from lxml import etree

from vrx_mj.config.urdf.gazebo import read_gazebo
from vrx_mj.config.urdf.reader import read_urdf
from vrx_mj.errors import VrxError

GOLDEN = Path(__file__).parents[3] / "golden" / "urdf" / "wamv.urdf"
VALUES = ["", "nan", "-1", "0", "1e400", "abc", "1 2", "-inf", "99999999999", "wamv/", "../x", "é", "a" * 300, "-0"]


@pytest.mark.parametrize("seed", range(80))
@pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
def test_no_change_to_a_file_ends_in_anything_but_a_boat_or_a_message(seed):
    """VRX's file with elements taken out, moved and renamed, and values that are none."""
    choose = random.Random(seed)
    root = etree.fromstring(GOLDEN.read_bytes())
    for _ in range(choose.choice((1, 1, 2, 5))):
        nodes = [node for node in root.iter("*") if node is not root]
        node, other = choose.choice(nodes), choose.choice(nodes)
        change = choose.randrange(5)
        if change == 0:
            node.getparent().remove(node)
        elif change == 1 and node.attrib:
            node.set(choose.choice(sorted(node.attrib)), choose.choice(VALUES))
        elif change == 2:
            node.text = choose.choice(VALUES)
        elif change == 3:
            node.tag = other.tag
        elif node is not other and node not in other.iterancestors():
            other.append(node)
    with suppress(VrxError):
        read_gazebo(read_urdf(etree.tostring(root, encoding="unicode"), GOLDEN))
