"""Memory that is given back: code that runs again all the same, and nothing that was changed."""

import subprocess
import sys

import pytest

LINUX = pytest.mark.skipif(sys.platform != "linux", reason="Linux lists what is mapped")
PROGRAM = """
import ctypes, mujoco, mmap, tempfile
from vrx_mj.unix import release_memory

def code():
    lines = iter(open("/proc/self/smaps"))
    return sum(int(next(line for line in lines if line.startswith("Rss:")).split()[1])
               for line in lines if " r-xp " in line and "mujoco" in line)

with tempfile.TemporaryFile() as file:
    file.write(b"a" * mmap.PAGESIZE)
    file.flush()
    changed = mmap.mmap(file.fileno(), mmap.PAGESIZE, mmap.MAP_PRIVATE, mmap.PROT_READ | mmap.PROT_WRITE)
    changed[0:1] = b"b"
    address = ctypes.addressof(ctypes.c_char.from_buffer(changed))
    ctypes.CDLL(None).mprotect(ctypes.c_void_p(address), mmap.PAGESIZE, mmap.PROT_READ | mmap.PROT_EXEC)
    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    before = code()
    release_memory(code=False)
    kept = code()
    release_memory()
    print(kept == before, code() < before / 2, changed[0:1])
mujoco.mj_step(model, mujoco.MjData(model))
"""


@LINUX
def test_code_is_given_back_where_it_may_and_runs_again_and_what_was_changed_stays():
    done = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, encoding="utf-8", check=True)
    assert done.stdout.split() == ["True", "True", "b'b'"]
