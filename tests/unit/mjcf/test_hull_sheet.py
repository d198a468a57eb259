"""The hydrostatic sheet of a mesh: closed forms of a barge, a sphere and another program's figures."""

import csv
import math

import numpy as np
import pytest

from unit.physics.test_panels import TABLES, barge, off
from vrx_mj.errors import VrxError
from vrx_mj.mjcf.flotation import hull_sheet


def corners(mesh):
    vertices, triangles = mesh
    return vertices[triangles]


BARGE = corners(barge(4.0, 2.0, 1.5, up=0.75))  # its keel is at z = 0


def test_a_barge():
    sheet = hull_sheet(BARGE, 4100.0, (0.0, 0.0, 0.5), gravity=9.81)
    assert (sheet.volume, sheet.draft, sheet.kb, sheet.kg) == pytest.approx((4.0, 0.5, 0.25, 0.5))
    assert sheet.waterplane_area == pytest.approx(8.0)
    assert sheet.stiffness == pytest.approx((80_442.0, 16_758.75, 97_200.75), rel=1e-5)
    assert sheet.bm == pytest.approx((2.0 / 3.0, 8.0 / 3.0), rel=1e-5)
    assert sheet.gm == pytest.approx((5.0 / 12.0, 29.0 / 12.0), rel=1e-5)
    assert sheet.tonnes_per_centimetre == pytest.approx(0.082)
    arms = dict(sheet.righting_arms)
    for heel in (10.0, 20.0):  # wall-sided: GZ = sin(phi) (GM + BM tan2(phi) / 2)
        phi = math.radians(heel)
        assert arms[heel] == pytest.approx(math.sin(phi) * (5.0 / 12.0 + math.tan(phi) ** 2 / 3.0), rel=1e-6)
    assert arms[90.0] == pytest.approx(0.25)  # on its side: half its depth less KG
    assert (arms[0.0], arms[180.0]) == pytest.approx((0.0, 0.0), abs=1e-9)


def test_a_shifted_weight_does_not_move_the_buoyancy():
    one, other = hull_sheet(BARGE, 2000.0, (0.0, 0.0, 0.5)), hull_sheet(BARGE, 2000.0, (0.3, -0.2, 0.7))
    assert one.center_of_buoyancy == pytest.approx(other.center_of_buoyancy, abs=1e-9)
    assert one.center_of_flotation == pytest.approx(other.center_of_flotation, abs=1e-6)
    assert other.bm == pytest.approx(one.bm, rel=1e-6)
    assert other.gm == pytest.approx((one.gm[0] - 0.2, one.gm[1] - 0.2), rel=1e-6)


def test_the_metacentric_radii_of_a_wedge_are_those_of_its_waterplane():
    """A hull that is deeper aft: BM = I / V about the waterplane's middle, wherever its weight is."""
    wedge = BARGE.copy()
    wedge[..., 2] += np.where(wedge[..., 2] < 0.1, 0.2 * (wedge[..., 0] + 2.0), 0.0)
    for x in (-0.4, 0.0, 0.7):
        sheet = hull_sheet(wedge, 6000.0, (x, 0.0, 0.5))
        area, volume = 8.0, 6000.0 / 1025.0
        assert sheet.waterplane_area == pytest.approx(area)
        assert sheet.bm == pytest.approx((area * 2.0**2 / 12.0 / volume, area * 4.0**2 / 12.0 / volume), rel=1e-6)


def test_a_sphere_has_its_metacentre_in_its_middle():
    sphere = corners(off("sphere"))
    sheet = hull_sheet(sphere, 100.0, (0.0, 0.0, -0.1))
    assert sheet.gm == pytest.approx((0.1, 0.1), abs=2e-3)
    assert dict(sheet.righting_arms)[60.0] == pytest.approx(0.1 * math.sin(math.pi / 3.0), abs=2e-3)


@pytest.mark.parametrize("name", ["barge", "sphere", "wigley"])
def test_hulls_float_where_another_program_has_them(name):
    with (TABLES / "hydrostatics.csv").open(encoding="utf-8") as file:
        table = csv.DictReader(line for line in file if not line.startswith("#"))
        row = next(row for row in table if (row["mesh"], row["heel"], row["trim"]) == (name, "0", "0"))
    sheet = hull_sheet(corners(off(name)), 1000.0 * float(row["volume"]), (0.0, 0.0, 0.0), density=1000.0)
    assert sheet.waterline == pytest.approx(0.0, abs=1e-6)
    assert sheet.waterplane_area == pytest.approx(float(row["area"]), rel=1e-3)
    assert sheet.center_of_buoyancy == pytest.approx([float(row[axis]) for axis in "xyz"], abs=1e-3)


def test_what_does_not_float():
    with pytest.raises(VrxError) as error:
        hull_sheet(BARGE, 13_000.0, (0.0, 0.0, 0.0))
    assert str(error.value) == (
        "it sinks: its mass is 13000 kg, but its hull's 12 m3 carry 1.23e+04 kg; check the mesh's unit (m), or "
        "its --scale"
    )
    assert np.isfinite(hull_sheet(BARGE, 12_299.0, (0.0, 0.0, 0.0)).draft)
