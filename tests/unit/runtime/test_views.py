"""The one list of the loop's arrays: what Python points at is what kernels see."""

import numpy as np
import pytest

from integration.sailing import boats, simulation
from vrx_mj.physics.kernel import kernel
from vrx_mj.runtime.views import ARRAYS, RUN, STATE, Views, point, point_rows, views


@kernel
def _seen(runs, out):
    own = views(runs[0])
    for k in range(own.qpos.size):
        out[k] = own.qpos[k]
    out[own.qpos.size] = own.xfrc_applied[1, 5]
    own.touches[0] = own.latched[1, 0, 2]
    own.hulls[1].mass = 7.0


def test_a_kernel_sees_the_arrays_that_python_points_at_and_writes_to_them():
    given = {name: np.zeros((2,) * array.ndim, array.dtype) for name, array in ARRAYS.items()}
    given["qpos"] = np.array([1.0, 2.0, 3.0])
    given["xfrc_applied"] = np.arange(12.0).reshape(2, 6)
    given["latched"] = np.arange(12.0).reshape(2, 2, 3)
    run, out = np.zeros(1, RUN), np.zeros(4)
    point(run, **given)
    _seen(run, out)
    assert out.tolist() == [1.0, 2.0, 3.0, 11.0]
    assert given["touches"].tolist() == [8.0, 0.0]
    assert given["hulls"]["mass"].tolist() == [0.0, 7.0]


def test_the_parts_of_a_stack_lie_one_behind_the_other_and_one_part_is_for_all():
    runs, own, shared = np.zeros(3, RUN), np.zeros((3, 5)), np.zeros((1, 5))
    point_rows(runs, qpos=own, qvel=shared)
    assert runs["qpos"].tolist() == [[own.ctypes.data + 40 * k, 5] for k in range(3)]
    assert runs["qvel"].tolist() == [[shared.ctypes.data, 5]] * 3


@pytest.mark.parametrize(
    "array", [np.zeros(3, np.float32), np.zeros((3, 3)), np.zeros(6)[::2]], ids=["type", "shape", "strides"]
)
def test_an_array_of_another_kind_is_a_mistake_of_ours(array):
    with pytest.raises(AssertionError):
        point(np.zeros(1, RUN), qpos=array)


def test_a_simulation_has_every_array_of_the_list_and_no_other():
    live = simulation(boats((0.0, 0.0, 0.0)))._live
    found = live.arrays.by_name(live.sampler.table, live.sampler.buffer)
    assert tuple(found) == tuple(ARRAYS) == Views._fields
    for name, array in ARRAYS.items():
        assert (found[name].dtype, found[name].ndim) == (array.dtype, array.ndim), name


def test_the_state_is_what_the_list_says_in_its_order():
    """Saved states have the bytes in this order."""
    state = [name for name, array in ARRAYS.items() if array.use == STATE]
    assert state == [
        "current_state", "wind_state", "air_state", "memory_state", "drift_state", "thruster_state", "propeller_state",
        "float_state", "element_state", "follower_state", "block_state", "link_state", "touches",
    ]  # fmt: skip
