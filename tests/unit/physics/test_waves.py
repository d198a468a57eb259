"""The sea's components and its height."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from unit.physics.rows import oracle, sea, sea_of
from vrx_mj.model.tables import WAVE
from vrx_mj.physics.kinematics import surface_plane
from vrx_mj.physics.waves import (
    cwr_components,
    elevation,
    elevations,
    pms_components,
    ramp,
    row_waves,
    stretch_waves,
    surface_height,
    surface_heights,
    wave_columns,
)
from vrx_mj.runtime.rows import NOMINAL

TAU = 2.0


def sydney(gain, period, scale, direction):
    return sea(pms_components(3, scale, 0.4, 0.0, gain, period, direction), tau=TAU)


SEAS = {
    "A": sydney(0.1, 5, 1.5, (1, 0)),
    "A2": sydney(0.1, 5, 2.5, (1, 0)),
    "B": sydney(0.7, 6, 2.5, (0.4, 0.85)),
    "C": sydney(0.8, 5, 2.5, (-0.6, -0.32)),
    "J": sydney(0.3, 5, 1.1, (1, 0)),
    "W": sea(cwr_components(3, 2.0, 0.4, 0.1, 0.5, 5, (1, 0)), tau=TAU),
}

# Computed from VRX's formulas in double precision by other code: a, omega, k, dx, dy
COMPONENTS = [
    ("A", 0, 0.00531544248, 0.837758041, 0.0716161771, 0.921060994, -0.389418342),
    ("A", 1, 0.0273191457, 1.25663706, 0.161136398, 1, 0),
    ("A", 2, 0.0179327560, 1.88495559, 0.362556896, 0.921060994, 0.389418342),
    ("A2", 0, 1.51021858e-11, 0.502654825, 0.0257818237, 0.921060994, -0.389418342),
    ("A2", 1, 0.0433677994, 1.25663706, 0.161136398, 1, 0),
    ("A2", 2, 0.00964392186, 3.14159265, 1.00710249, 0.921060994, 0.389418342),
    ("B", 0, 1.52230033e-10, 0.418879020, 0.0179040443, 0.744538041, 0.667580037),
    ("B", 1, 0.437147417, 1.04719755, 0.111900277, 0.425797036, 0.904818702),
    ("B", 2, 0.0972107323, 2.61799388, 0.699376729, 0.0398320424, 0.999206389),
    ("C", 1, 0.346942395, 1.25663706, 0.161136398, -0.882352941, -0.470588235),
    ("C", 2, 0.0771513749, 3.14159265, 1.00710249, -0.629445187, -0.777044887),
    ("J", 0, 0.0363502011, 1.14239733, 0.133170577, 0.921060994, -0.389418342),
    ("J", 1, 0.0392276505, 1.25663706, 0.161136398, 1, 0),
    ("J", 2, 0.0385703180, 1.38230077, 0.194975042, 0.921060994, 0.389418342),
    ("W", 0, 0.25, 1.77715318, 0.322272797, 0.921060994, -0.389418342),
    ("W", 1, 0.5, 1.25663706, 0.161136398, 1, 0),
    ("W", 2, 1.0, 0.888576588, 0.0805681992, 0.921060994, 0.389418342),
]
HEIGHTS = [
    ("A", 0, 0, 1.0, 0.00254074139),
    ("A", 0, 0, 10.0, 0.0423071831),
    ("A", 10, -5, 20.0, -0.0219264763),
    ("A", 12.5, -7.25, 33.3, -0.0333259723),
    ("A2", -532, 162, 60.0, -0.0355997587),
    ("B", 0, 0, 5.0, 0.277908563),
    ("B", 3, 4, 12.5, 0.436264883),
    ("B", -532, 162, 30.0, -0.335366668),
    ("B", 12.5, -7.25, 33.3, -0.461461318),
    ("C", 0, 0, 30.0, 0.424093640),
    ("C", -530, 180, 100.0, 0.222110624),
    ("J", 10, 20, 15.0, -0.00800642400),
    ("W", 0, 0, 10.0, -0.238331914),
    ("W", 3, 4, 12.5, -0.921811952),
]
NINE_DIGITS = 6e-9  # of a value printed with nine


@pytest.mark.parametrize(("name", "index", "a", "omega", "k", "dx", "dy"), COMPONENTS)
def test_components(name, index, a, omega, k, dx, dy):
    wave = SEAS[name][0][index]
    values = (wave["amplitude"], wave["frequency"], wave["wavenumber"], *wave["direction"])
    assert values == pytest.approx((a, omega, k, dx, dy), rel=NINE_DIGITS, abs=1e-15)


@pytest.mark.parametrize(("name", "x", "y", "t", "height"), HEIGHTS)
def test_heights(name, x, y, t, height):
    assert surface_height(*SEAS[name], x, y, t) == pytest.approx(height, rel=NINE_DIGITS)


@pytest.mark.parametrize(("name", "height"), [("A", 0.0936450063), ("A2", 0.125658943), ("J", 0.186500726)])
def test_significant_heights(name, height):
    waves, _ = SEAS[name]
    assert 4 * math.sqrt(np.sum(waves["amplitude"] ** 2) / 2) == pytest.approx(height, rel=NINE_DIGITS)


def test_cwr_waves_are_equally_steep():
    assert SEAS["W"][0]["steepness"] == pytest.approx(0.413728167, rel=NINE_DIGITS)


@pytest.mark.parametrize("name", sorted({row["wave_set"] for row in oracle("wave_components")}))
def test_components_are_vrx_s(name):
    waves, _ = sea_of(name)
    rows = [row for row in oracle("wave_components") if row["wave_set"] == name]
    assert len(waves) == len(rows)
    for wave, row in zip(waves, rows, strict=True):
        values = (
            wave["amplitude"],
            wave["frequency"],
            wave["wavenumber"],
            *wave["direction"],
            wave["steepness"],
        )
        keys = ("amplitude_m", "omega_rad_s", "wavenumber_rad_m", "dir_x", "dir_y", "steepness_q")
        assert values == pytest.approx([row[key] for key in keys], rel=1e-12, abs=1e-15)


@pytest.mark.parametrize("name", sorted({row["wave_set"] for row in oracle("wave_heights")}))
def test_heights_are_vrx_s(name):
    waves, water = sea_of(name)
    rows = [row for row in oracle("wave_heights") if row["wave_set"] == name]
    x, y, t = (np.array([row[key] for row in rows]) for key in ("x_m", "y_m", "t_s"))
    out = np.empty(len(rows))
    surface_heights(waves, water, x, y, t, out)
    assert out == pytest.approx([row["h_simple_m"] for row in rows], abs=1e-13, rel=0)  # VRX: 1e-14
    assert out.tolist() == [surface_height(waves, water, *point) for point in zip(x, y, t, strict=True)]


@pytest.mark.parametrize(
    ("t", "share"),
    [
        (-5, 0),
        (0, 0),
        (0.001, 0.000499875021),
        (1, 0.393469340),
        (2, 0.632120559),
        (10, 0.993262053),
        (79.9, 1),
        (1e9, 1),
    ],
)
def test_the_sea_rises_with_the_ramp(t, share):
    assert ramp(SEAS["A"][1], float(t)) == pytest.approx(share, rel=NINE_DIGITS)


@pytest.mark.parametrize("tau", [0.0, -1.0])
def test_without_a_time_constant_the_sea_is_there_at_once(tau):
    assert ramp(sea(tau=tau)[1], 0.0) == 1.0


def test_no_waves_leave_the_level():
    assert surface_height(*sea(tau=TAU, level=0.3), 5.0, 6.0, 7.0) == 0.3


@given(x=st.floats(-1e3, 1e3), y=st.floats(-1e3, 1e3), t=st.floats(0, 1e4))
def test_a_height_is_the_sum_of_its_cosines(x, y, t):
    waves, water = SEAS["B"]
    phases = waves["wavenumber"] * (waves["direction"] @ (x, y)) - waves["frequency"] * t
    height = (1 - math.exp(-t / TAU)) * np.sum(waves["amplitude"] * np.cos(phases))
    # a phase of 2.6e4 rad is itself rounded to 4e-12
    assert surface_height(waves, water, x, y, t) == pytest.approx(height, abs=1e-11)


@given(t=st.floats(0, 1e3), along=st.floats(-50, 50), shift=st.floats(-20, 20))
def test_a_wave_travels_along_its_direction(t, along, shift):
    waves = cwr_components(1, 2.0, 0.4, 0.0, 0.5, 5.0, (3.0, 4.0))
    water = sea(waves)
    later = shift / (waves[0]["frequency"] / waves[0]["wavenumber"])
    here, there = (0.6 * along, 0.8 * along), (0.6 * (along + shift), 0.8 * (along + shift))
    assert surface_height(*water, *there, t + later) == pytest.approx(surface_height(*water, *here, t), abs=1e-11)


def test_pms_has_three_waves_at_most():
    with pytest.raises(ValueError, match=r"^the model has at most 3 waves, not 4$"):
        pms_components(4, 1.5, 0.4, 0.0, 0.1, 5.0, (1.0, 0.0))


@pytest.mark.parametrize("size", [0, 1, 4, 7])
def test_what_is_a_row_s_own_counts_as_if_it_were_in_the_table(size):
    """A factor of all heights, phases and factors of each height; to the bit in every form that kernels take."""
    (waves, water), own = SEAS["J"], np.array([0.7, 0.3, 1.0, -2.0, 1.1, 0.9, 1.2])[:size]
    whole, at = waves.copy(), (3.0, -2.0, 4.0)
    if size > 1:
        whole["phase"] = own[1:4]
    for column in ("amplitude", "orbital"):
        whole[column] = whole[column] * (own[4:] if size > 4 else 1.0) * (own[0] if size else 1.0)
    height = surface_height(whole, water, *at)
    assert surface_height(waves, water, *at, own) == height
    assert surface_height(row_waves(waves, own), water, *at) == height
    np.testing.assert_array_equal(wave_columns(waves, water, 4, own), wave_columns(whole, water, 4))
    reach = (0.9, -0.4, 0.5)
    assert surface_plane(waves, water, reach, *at, own) == surface_plane(whole, water, reach, *at)


@pytest.mark.parametrize("far", [1.0, 1e8])
@pytest.mark.parametrize("size", [0, 1, 4, 7])
def test_heights_at_four_points_are_those_at_each_to_the_bit(size, far):
    """In every form that kernels take; far: phases beyond a million radians."""
    (waves, water), own = SEAS["J"], np.array([0.7, 0.3, 1.0, -2.0, 1.1, 0.9, 1.2])[:size]
    arms = ((0.0, 0.0, 1.0), (4.9, 0.0, 1.0), (-2.0, far, 0.0), (-2.0, -far, 0.0))
    for form, more in ((waves, own), (waves, None), (wave_columns(waves, water, 4, own), None)):
        each = [elevation(form, 3.0 + east, -2.0 + north, 4.0, more) for east, north, _ in arms]
        assert elevations(form, 3.0, -2.0, arms, 4.0, more) == tuple(each)
        assert len(set(each)) == 4


# Seas that differ from a world's


def changed(phases=(0.0, 0.0, 0.0), factor=1.0, **change):
    """The sea J, of peak 2 pi / 5 s towards east, with factors, a turn and phases."""
    waves = SEAS["J"][0]
    nominal = np.array([(2 * math.pi / 5, (1.0, 0.0), 9.8)], NOMINAL)
    row = {"period": 1.0, "band": 1.0, "spread": 1.0, "turn": 0.0} | change
    given, out = np.array([tuple(row.values())], [(name, float) for name in row]), np.zeros(len(waves), WAVE)
    stretch_waves(waves, nominal[0], given[0], np.array([factor, *phases]), out)
    return waves, out


def test_a_sea_without_changes_is_the_world_s_to_the_last_bit():
    world, own = changed()
    assert own.tobytes() == world.tobytes()


def test_periods_stretch_and_lengths_with_their_squares_while_heights_stay():
    world, own = changed(period=1.5)
    np.testing.assert_allclose(own["frequency"], world["frequency"] / 1.5, rtol=1e-14)
    np.testing.assert_allclose(own["wavenumber"], world["wavenumber"] / 2.25, rtol=1e-14)
    np.testing.assert_array_equal(own["amplitude"], world["amplitude"])


@pytest.mark.parametrize(("band", "ratio"), [(0.0, 1.0), (0.5, math.sqrt(1.1)), (2.0, 1.21)])
def test_a_band_s_ratio_of_frequencies_is_raised_to_its_factor(band, ratio):
    _, own = changed(band=band)
    peak = 2 * math.pi / 5
    np.testing.assert_allclose(own["frequency"], [peak / ratio, peak, peak * ratio], rtol=1e-12)


@pytest.mark.parametrize(("spread", "turn"), [(0.0, 0.0), (1.0, 2.0), (1.5, -0.3)])
def test_directions_turn_and_spread(spread, turn):
    _, own = changed(spread=spread, turn=turn)
    angles = turn + spread * np.array([-0.4, 0.0, 0.4])
    np.testing.assert_allclose(own["direction"], np.stack((np.cos(angles), np.sin(angles)), axis=1), atol=1e-12)


def test_phases_are_those_at_the_origin_at_time_0():
    _, own = changed(phases=(0.3, 1.0, -2.0), factor=2.0)
    _, calm = sea()
    expected = (own["amplitude"] * np.cos([0.3, 1.0, -2.0])).sum()
    assert surface_height(own, calm, 0.0, 0.0, 0.0) == pytest.approx(expected, abs=1e-15)
    k, w, d = own["wavenumber"], own["frequency"], own["direction"]
    there = (own["amplitude"] * np.cos(k * (d @ [3.0, -4.0]) - w * 7.0 + [0.3, 1.0, -2.0])).sum()
    assert surface_height(own, calm, 3.0, -4.0, 7.0) == pytest.approx(there, abs=1e-14)
