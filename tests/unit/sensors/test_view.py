"""What a camera says of itself and what it can see, without drawing anything."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrx_mj.config.sensors import CameraConfig
from vrx_mj.errors import RenderError
from vrx_mj.physics.noise import bits
from vrx_mj.sensors import canvas
from vrx_mj.sensors.camera import LEVELS, Cameras, grain_table, with_grain
from vrx_mj.sensors.view import intrinsics

VRX = CameraConfig(name="c", link="l", frame="f")
ANGLE = st.floats(-3.1, 3.1)


def rotation(roll, pitch, yaw):
    cr, sr, cp, sp, cy, sy = (f(a) for a in (roll, pitch, yaw) for f in (math.cos, math.sin))
    about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    return np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]]) @ about_y @ about_x


# Intrinsics


def test_intrinsics_are_vrxs():
    info = intrinsics(VRX)
    assert (info.width, info.height, info.D, info.distortion_model) == (1280, 720, (0.0,) * 5, "plumb_bob")
    focal = pytest.approx(762.72, abs=0.005)
    assert list(info.K) == [focal, 0, 640.5, 0, focal, 360.5, 0, 0, 1]
    assert info.R == (1, 0, 0, 0, 1, 0, 0, 0, 1)
    baseline = pytest.approx(-53.39, abs=0.005)
    assert list(info.P) == [focal, 0, 640.5, baseline, 0, focal, 360.5, 0, 0, 0, 1, 0]


def test_focal_length_follows_width_and_field_of_view():
    info = intrinsics(VRX.model_copy(update={"width": 100, "height": 300, "horizontal_fov": math.pi / 2}))
    assert (info.K[0], info.K[2], info.K[5]) == (pytest.approx(50.0), 50.5, 150.5)


def test_gz_sims_principal_point_is_half_of_the_picture():
    info = intrinsics(VRX.model_copy(update={"width": 5, "height": 4, "info": "vrx3", "baseline": 0.0}))
    assert (info.K[2], info.K[5], info.P[2], info.P[3], info.P[6]) == (2.5, 2.0, 2.5, 0.0, 2.0)


def test_a_centered_camera_counts_pixels_from_0():
    """The middle of 5 columns is the third, number 2; of 4 rows, the edge between numbers 1 and 2."""
    info = intrinsics(VRX.model_copy(update={"width": 5, "height": 4, "info": "centered"}))
    assert (info.K[2], info.K[5], info.P[2], info.P[6]) == (2.0, 1.5, 2.0, 1.5)
    assert info.K[0] == intrinsics(VRX.model_copy(update={"width": 5, "height": 4})).K[0]


# What is in view


def in_picture(view, point):
    ahead, left, up = view.rotation.T @ (point - view.position)
    return view.near < ahead < view.far and abs(left) < view.half_width * ahead and abs(up) < view.half_height * ahead


@given(angles=st.tuples(ANGLE, ANGLE, ANGLE), seed=st.integers(0, 1000))
def test_whatever_has_a_point_in_the_picture_is_drawn(angles, seed):
    rng = np.random.default_rng(seed)
    view = Cameras.view(VRX, np.array([3.0, -2.0, 1.5]), rotation(*angles))
    centers, radii = rng.normal(0.0, 40.0, (60, 3)), rng.uniform(0.05, 15.0, 60)
    seen = view.shows(centers, radii)
    inside = rng.normal(size=(60, 40, 3))
    inside *= (rng.uniform(0, 1, (60, 40, 1)) ** (1 / 3)) / np.linalg.norm(inside, axis=2, keepdims=True)
    for center, radius, points, drawn in zip(centers, radii, inside, seen, strict=True):
        if any(in_picture(view, center + radius * point) for point in points):
            assert drawn


@given(angles=st.tuples(ANGLE, ANGLE, ANGLE), field=st.floats(0.2, 2.4))
def test_all_of_the_picture_lies_between_its_lowest_and_highest_direction_and_hardly_more_does(angles, field):
    view = Cameras.view(VRX.model_copy(update={"horizontal_fov": field}), np.zeros(3), rotation(*angles))
    left, up = np.meshgrid(*(half * np.linspace(-1.0, 1.0, 65) for half in (view.half_width, view.half_height)))
    rays = view.rotation @ np.stack([np.ones_like(left), left, up]).reshape(3, -1)
    seen = np.arcsin(rays[2] / np.linalg.norm(rays, axis=0))
    low, high = view.elevations()
    # the margin, and half a step between these places
    more = 0.03 + math.hypot(view.half_width, view.half_height) / 64.0
    assert max(seen.min() - more, -0.5 * math.pi) <= low <= seen.min()
    assert seen.max() <= high <= seen.max() + more


def test_a_level_camera_sees_as_far_down_as_up():
    low, high = Cameras.view(VRX, np.zeros(3), np.eye(3)).elevations()
    assert (low, high) == (pytest.approx(-high), pytest.approx(math.atan(math.tan(0.69813) * 9 / 16) + 0.03, abs=1e-4))


def test_what_is_behind_beside_far_or_tiny_is_not_drawn():
    view = Cameras.view(VRX, np.zeros(3), np.eye(3))
    centers = np.array([[-5, 0, 0], [10, 30, 0], [10, 0, -30], [302, 0, 0], [299, 0, 0], [250, 0, 0], [-50, 0, 0]])
    radii = np.array([1.0, 2.0, 2.0, 1.0, 1.0, 0.05, 0.0])
    assert view.shows(centers.astype(float), radii).tolist() == [False, False, False, False, True, False, True]


@given(yaw=ANGLE, pitch=st.floats(-0.5, 0.5), roll=st.floats(-0.3, 0.3))
def test_the_sea_fills_the_picture(yaw, pitch, roll):
    view = Cameras.view(VRX, np.array([0.0, 0.0, 2.0]), rotation(roll, pitch, yaw))
    course, half = view.horizontal_range()
    offs = []
    for across in np.linspace(-1, 1, 9):
        for upward in np.linspace(-1, 1, 9):
            ray = view.rotation @ np.array([1.0, across * view.half_width, upward * view.half_height])
            offs.append((math.atan2(ray[1], ray[0]) - course + math.pi) % (2 * math.pi) - math.pi)
    assert max(map(abs, offs)) <= half
    assert min(offs) == pytest.approx(-max(offs))


@pytest.mark.parametrize("pitch", [math.pi / 2, -math.pi / 2, 1.2])
def test_a_camera_that_looks_down_or_up_has_sea_all_around(pitch):
    assert Cameras.view(VRX, np.zeros(3), rotation(0, pitch, 0.3)).horizontal_range()[1] == math.pi


# Noise


def test_grain_has_the_standard_deviation_it_is_asked_for():
    table = grain_table(0.02)
    assert len(table) == LEVELS
    assert table.mean() == pytest.approx(0.0, abs=1e-3)
    assert table.std() == pytest.approx(math.hypot(0.02 * 255, 1 / math.sqrt(12)), rel=1e-3)  # and that of rounding


def test_grain_is_the_tables_entry_that_the_streams_bits_name():
    drawn = np.full((3, 4, 3), 128, np.uint8)
    drawn[0] = 250  # the lowest row
    out = np.empty_like(drawn)
    table = grain_table(0.05)
    with_grain(drawn, table, np.uint64(99), out)
    words = [int(bits(np.uint64(99), np.uint64(n))) for n in range(3)]
    entries = [(word >> 12 * part) & 4095 for word in words for part in range(5)][:12]
    expected = np.repeat(drawn[::-1, :, :1].astype(int) + table[entries].reshape(3, 4, 1), 3, axis=2)
    assert np.array_equal(out, np.clip(expected, 0, 255))


# Ways to draw


@pytest.fixture
def choice(monkeypatch):
    """Chooses afresh, on a Linux where `working` is what works."""

    def choose(wanted=None, working=(), display=None):
        for name, value in (("MUJOCO_GL", wanted), ("DISPLAY", display)):
            monkeypatch.delenv(name, raising=False)
            if value is not None:
                monkeypatch.setenv(name, value)
        monkeypatch.setattr(canvas.sys, "platform", "linux")
        monkeypatch.setattr(canvas, "problem_of", lambda name: None if name in working else f"no {name} here")
        return canvas.choose_backend.__wrapped__()

    return choose


@pytest.mark.parametrize(
    ("wanted", "working", "display", "chosen"),
    [
        (None, ("egl", "osmesa"), None, "egl"),
        (None, ("osmesa",), None, "osmesa"),
        ("osmesa", ("egl", "osmesa"), None, "osmesa"),
        (" EGL ", ("egl", "osmesa"), None, "egl"),
        ("on", ("osmesa",), None, "osmesa"),
        ("glfw", ("egl",), ":0", "mujoco"),
        (None, (), ":0", "mujoco"),
    ],
)
def test_the_way_to_draw_is_the_one_asked_for_or_the_first_that_works(choice, wanted, working, display, chosen):
    assert choice(wanted, working, display) == chosen


def test_without_any_way_to_draw_the_error_says_what_to_install(choice):
    with pytest.raises(RenderError) as caught:
        choice()
    assert str(caught.value) == (
        "cannot draw pictures without a screen:\n"
        "  egl: no egl here\n"
        "  osmesa: no osmesa here\n"
        "Install one of these; it is found automatically, or selected by the variable MUJOCO_GL:\n"
        "  sudo apt-get install -y libegl1 libgl1-mesa-dri libopengl0    # then MUJOCO_GL=egl\n"
        "  sudo apt-get install -y libosmesa6 libopengl0    # then MUJOCO_GL=osmesa"
    )


def test_a_way_that_was_asked_for_and_does_not_work_is_not_replaced(choice):
    with pytest.raises(RenderError) as caught:
        choice("egl", ("osmesa",), ":0")
    assert str(caught.value).splitlines()[:3] == [
        "cannot draw pictures without a screen:",
        "  egl: no egl here",
        "Install one of these; it is found automatically, or selected by the variable MUJOCO_GL:",
    ]


def test_drawing_that_is_switched_off_says_so(choice):
    with pytest.raises(RenderError) as caught:
        choice("off", ("egl",))
    assert str(caught.value) == "MUJOCO_GL=off disables rendering; unset it, or set it to egl or osmesa"


def test_a_library_that_is_missing_is_named(monkeypatch):
    def absent(name):
        raise OSError(f"{name}: cannot open shared object file: No such file or directory")

    monkeypatch.delenv("PYOPENGL_PLATFORM", raising=False)
    monkeypatch.setattr(canvas.ctypes, "CDLL", absent)
    missing = ": cannot open shared object file: No such file or directory"
    found = canvas.problem_of("egl"), canvas.problem_of("osmesa")
    assert found == (f"libEGL.so.1{missing}", f"libOSMesa.so.8{missing}")


def test_pyopengl_that_is_bound_to_another_way_is_an_obstacle(monkeypatch):
    monkeypatch.setenv("PYOPENGL_PLATFORM", "osmesa")
    assert canvas.problem_of("egl") == "PYOPENGL_PLATFORM=osmesa prevents it"
