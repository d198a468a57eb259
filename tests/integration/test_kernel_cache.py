"""A damaged cache of compiled kernels costs one compilation, and nothing else."""

import os
import shutil

import pytest

import vrx_mj
from vrx_command import state_in, vrx
from vrx_mj.physics.kernel import cache_folder

pytestmark = pytest.mark.slow

RUN = ("run", "ocean", "--duration", "1")


def damage(file, number):
    """Half of the files end in their middle, the others hold something else."""
    content = file.read_bytes()
    file.write_bytes(os.urandom(len(content)) if number % 2 else content[: len(content) // 2])


@pytest.mark.nightly
def test_a_run_on_a_cache_of_damaged_files_compiles_again_and_says_so_once(tmp_path):
    vrx_mj.Simulation(vrx_mj.compile_world("ocean")).step()  # there are kernels of a run
    kept, place = cache_folder(), tmp_path / "cache"
    shutil.copytree(kept, place / kept.name)
    files = sorted(place.rglob("*.nb?"))
    assert len(files) > 2
    for number, file in enumerate(files):
        damage(file, number // 2)  # an index and its data alike
    first, then = (vrx(*RUN, cwd=tmp_path, VRX_MJ_CACHE=place) for _ in range(2))
    usual = vrx(*RUN, cwd=tmp_path)
    assert [code for code, _, _ in (first, then, usual)] == [0, 0, 0], first
    assert [error.count("are damaged and are compiled again") for _, _, error in (first, then)] == [1, 0]
    assert "vrx_mj: compiling the physics for this machine, once" in first[2]
    assert "compil" not in then[2]
    assert state_in(first[1]) == state_in(then[1]) == state_in(usual[1])
