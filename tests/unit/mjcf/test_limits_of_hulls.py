"""What is said of hulls of profile `marine` whose sea, start or step is beyond their model."""

import math
import warnings

import numpy as np
import pytest

from unit.physics.rows import moving
from vrx_mj import compile_world
from vrx_mj.mjcf.drift import coriolis
from vrx_mj.model import tables
from vrx_mj.physics.drag import added_mass_bias

URDF = """<robot name="box"><link name="base_link"><inertial><mass value="60"/>
<inertia ixx="2" iyy="8" izz="9" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><box size="1.2 0.5 0.4"/></geometry></collision></link>
<link name="screw"/><joint name="shaft" type="fixed"><parent link="base_link"/><child link="screw"/></joint></robot>"""
ADDED = "added_mass: [3, 40, 60, 1, 4, 4], damping_quadratic: [20, 100, 0, 0, 0, 0]"
FREE, DAMPED = "damping_linear: [0, 0, 0, 0, 0, 0]", "damping_linear: [10, 40, 300, 15, 40, 20]"
SHORT = {"model": "regular", "height": 0.02, "period": 0.7}
LONG = {"model": "regular", "height": 0.05, "period": 2.0}


def said(folder, hull, sea, *, added=ADDED, **physics):
    (folder / "box.urdf").write_text(URDF, encoding="utf-8")
    text = f"urdf: box.urdf\nhull: {{{added}, {hull}}}\nthrusters: {{main: {{propeller: screw, mapping: linear}}}}\n"
    (folder / "box.yaml").write_text(text, encoding="utf-8")
    world = {"physics": {"profile": "marine", **physics}, "sea": sea, "wind": {"objects": []}}
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        compile_world(world, fleet={"robot": str(folder / "box.yaml"), "boats": [{"name": "a", "pose": [0.0] * 6}]})
    return [text for item in caught if "box.yaml: " in (text := str(item.message))]


@pytest.mark.parametrize(
    ("hull", "sea", "texts"),
    [
        (DAMPED, LONG, ()),
        (DAMPED, SHORT, ("100 % of the sea's energy is in waves shorter than its waterline of 1.2 m",)),
        (
            FREE,
            LONG,
            ("makes it swing, which does not fade: give the sea a `ramp`", "steps of 0.01 s add over 1,000 %"),
        ),
        (
            FREE,
            LONG | {"ramp": 5.0},
            ("at 1.37 m/s, a Froude number of 0.4, steps of 0.01 s add over 1,000 % a minute",),
        ),
        (FREE.replace("0, 0, 0]", "0.02, 30, 20]").replace("[0, 0, 0", "[0, 0, 90"), LONG, ("fades to 5 % in",)),
    ],
)
def test_what_is_beyond_the_model_of_a_hull_is_one_warning_with_its_figures(tmp_path, hull, sea, texts):
    found = said(tmp_path, hull, sea)
    assert len(found) == bool(texts), found
    assert all(text in found[0] for text in texts), found


@pytest.mark.parametrize(
    ("damping", "sea", "remarked"),
    [(11.8, LONG, True), (12.2, LONG, False), (11.8, LONG | {"ramp": 5.0}, False), (11.8, {"model": "none"}, False)],
)
def test_a_swing_of_more_than_a_minute_is_remarked_in_a_sea_that_is_there_from_the_start(
    tmp_path, damping, sea, remarked
):
    """Heave m z'' + b z' + c z = 0 decays by exp(-b t / (2 m)), m with the added mass."""
    fades = math.log(20.0) * 2.0 * (60.0 + 60.0) / damping
    found = "".join(said(tmp_path, f"damping_linear: [10, 40, {damping}, 15, 40, 20]", sea))
    assert (f"which fades to 5 % in {fades:.3g} s" in found) == remarked == ("makes it swing" in found)


def test_a_shorter_step_adds_less(tmp_path):
    gains = []
    for timestep in (0.002, 0.001):
        (text,) = said(tmp_path, FREE, {"model": "none"}, timestep=timestep)
        gains.append(float(text.partition(" add ")[2].partition(" %")[0]) / 100.0)
    assert np.log1p(gains[1]) == pytest.approx(0.5 * np.log1p(gains[0]), rel=0.03)


@pytest.mark.parametrize(("share", "munk"), [(0.97, True), (1.03, True), (1.03, False)])
def test_munks_moment_in_pitch_is_told_of_where_it_is_larger_than_what_rights_the_hull(tmp_path, share, munk):
    draft, speed = 60.0 / (1025.0 * 1.2 * 0.5), 0.4 * np.sqrt(9.81 * 1.2)
    metacentre = 1.2**2 / (12.0 * draft) + 0.5 * draft - 0.2  # over the middle, where the centre of mass is
    heave = 3.0 + share * 60.0 * 9.81 * metacentre / speed**2
    hull = f"{FREE}, munk: {str(munk).lower()}"
    found = said(tmp_path, hull, {"model": "none"}, added=ADDED.replace("60,", f"{heave},"))
    assert any("Munk's moment" in text for text in found) == (share > 1.0 and munk), found


@pytest.mark.slow
def test_a_hull_of_many_triangles_is_told_to_be_slow(tmp_path):
    floats = ", ".join(f"{{type: cylinder, radius: 0.15, length: 3, pose: [0, {y}, 0, 0, 90, 0]}}" for y in (-1, 1))
    texts = said(tmp_path, f"{DAMPED}, shapes: [{floats}]", {"model": "none"})
    assert any("triangles, and every step visits each; a mesh whose long round parts have" in text for text in texts)


@pytest.mark.parametrize("munk", [False, True])
def test_the_force_of_the_added_mass_in_its_first_order_is_that_of_the_kernel(munk):
    draws = np.random.default_rng(4).normal(size=(6, 6))
    added = draws @ draws.T
    row, velocity, step = np.zeros(1, tables.VESSEL)[0], np.array([1.3, 0.0, 0.0, 0.0, 0.0, 0.0]), 1e-6
    row["added_mass"], row["munk"] = added, munk
    still = (0.0, 0.0, 0.0)

    def force(change):
        return np.array(added_mass_bias(row, moving(velocity=velocity + change), still, still))

    columns = [(force(step * axis) - force(-step * axis)) / (2.0 * step) for axis in np.eye(6)]
    assert coriolis(added, velocity[:3], munk=munk) == pytest.approx(np.stack(columns, axis=1), abs=1e-8)
