"""A damaged entry of the kernels' cache is dropped and compiled again, with one line."""

import errno
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from numba.core.bytecode import FunctionIdentity
from numba.core.registry import cpu_target

import vrx_mj.physics.kernel as module
from vrx_mj.physics.kernel import is_cached, kernel

SOURCE = Path(module.__file__).parents[2]


def _twice(x):
    return 2.0 * x


def _thrice(x):
    return 3.0 * x


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """An empty cache, of a process that has said nothing yet."""
    monkeypatch.setattr(module, "FOLDER", tmp_path)
    monkeypatch.setattr(module, "_said", set())
    return tmp_path


def files(folder):
    """The data and the index of the one kernel that is kept."""
    (data,), (index,) = folder.rglob("*.nbc"), folder.rglob("*.nbi")
    return data, index


def came_from_the_cache(function=_twice):
    """Call a function as the next process would, and tell whether it had to be compiled."""
    compiled = kernel(function)
    assert compiled(2.0) == function(2.0)
    return bool(compiled.stats.cache_hits)


def said(file, why):
    return f"vrx_mj: compiled kernels in {file.parent} are damaged and are compiled again ({file.name}: {why}"


def truncate(file):
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])


def junk(file):
    file.write_bytes(os.urandom(3000))


def empty(file):
    file.write_bytes(b"")


def flip(file):
    content = bytearray(file.read_bytes())
    content[-40] ^= 1
    file.write_bytes(content)


def lengthen(file):
    file.write_bytes(file.read_bytes() + b"\0")


def spoil_object_code(file):
    """A pickle that can be read, around machine code that LLVM aborts on."""
    content = bytearray(file.read_bytes())
    start = content.find(b"\x7fELF")
    content[start + 0x28 : start + 0x30] = b"\xff" * 8
    file.write_bytes(content)


def make_folder(file):
    file.unlink()
    file.mkdir()
    (file / "inside").write_bytes(b"x")


def make_circle(file):
    file.unlink()
    file.symlink_to(file.name)


DAMAGE = {
    truncate: "its digest is another", junk: "its digest is another", empty: "its digest is another",
    flip: "its digest is another", lengthen: "its digest is another", spoil_object_code: "its digest is another",
    make_folder: os.strerror(errno.EISDIR), make_circle: os.strerror(errno.ELOOP),
}  # fmt: skip


@pytest.mark.skipif(sys.platform == "win32", reason="other words for what is wrong")
@pytest.mark.parametrize("damage", DAMAGE)
@pytest.mark.parametrize("which", [0, 1], ids=["data", "index"])
def test_what_is_damaged_is_compiled_again_with_one_line_and_then_whole(folder, capsys, damage, which):
    assert not came_from_the_cache()
    file = files(folder)[which]
    damage(file)
    assert not came_from_the_cache()
    assert capsys.readouterr().err == said(file, f"{DAMAGE[damage]})\n")
    module._said.clear()
    assert came_from_the_cache()
    assert capsys.readouterr().err == ""


def test_a_kernel_that_is_loaded_loads_nothing_of_what_compiling_needs(monkeypatch):
    assert not came_from_the_cache()
    monkeypatch.setattr(cpu_target.target_context, "refresh", lambda: pytest.fail("0.45 s"))
    assert came_from_the_cache()


def test_many_damaged_files_are_one_line(folder, capsys):
    for function in (_twice, _thrice):
        came_from_the_cache(function)
    for file in folder.rglob("*.nb?"):
        truncate(file)
    for function in (_twice, _thrice):
        assert not came_from_the_cache(function)
    assert len(capsys.readouterr().err.splitlines()) == 1
    for function in (_twice, _thrice):
        assert came_from_the_cache(function)


@pytest.mark.parametrize("which", [0, 1], ids=["data", "index"])
def test_what_is_missing_is_compiled_without_a_word(folder, capsys, which):
    came_from_the_cache()
    files(folder)[which].unlink()
    assert not came_from_the_cache()
    assert came_from_the_cache()
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("which", [0, 1], ids=["data", "index"])
def test_a_damaged_entry_is_none(folder, which):
    """Then it is announced that the kernel is compiled."""
    came_from_the_cache()
    assert is_cached(kernel(_twice))
    truncate(files(folder)[which])
    assert not is_cached(kernel(_twice))


@pytest.mark.parametrize("kept", [True, False])
@pytest.mark.parametrize("look", [is_cached, lambda compiled: compiled(2.0)], ids=["asked", "called"])
def test_lines_wait_for_the_first_kernel_that_is_looked_up(kept, look, folder, monkeypatch, capsys):
    """With a cache and without, and are written once."""
    monkeypatch.setattr(module, "FOLDER", folder if kept else None)
    monkeypatch.setattr(module, "_waiting", [])
    module.say_before_the_first(["one", "another"])
    compiled, written = kernel(_twice), []
    for act in (lambda _: None, look, look):
        act(compiled)
        written.append(capsys.readouterr().err)
    assert written == ["", "vrx_mj: one\nvrx_mj: another\n", ""]


def test_an_entry_in_the_place_of_another_is_damaged(folder, capsys):
    for function in (_twice, _thrice):
        came_from_the_cache(function)
    twice, thrice = (next(folder.rglob(f"*{name}-*.nbc")) for name in ("_twice", "_thrice"))
    twice.write_bytes(thrice.read_bytes())
    assert not came_from_the_cache()
    assert f"({twice.name}: its digest is another)" in capsys.readouterr().err


def test_what_is_whole_but_not_for_us_is_compiled_again(folder, capsys):
    came_from_the_cache()
    data, index = files(folder)
    content = b"not a pickle"
    data.write_bytes(module._digest(data.name, content) + content)
    assert not came_from_the_cache()
    assert capsys.readouterr().err.startswith(said(index, "UnpicklingError"))
    assert came_from_the_cache()


def test_what_may_not_be_read_is_compiled_again(folder, capsys, monkeypatch):
    came_from_the_cache()
    data, _ = files(folder)
    read = Path.read_bytes

    def forbidden(path):
        if path == data:
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
        return read(path)

    monkeypatch.setattr(Path, "read_bytes", forbidden)  # root may read everything
    assert not came_from_the_cache()
    assert f"({data.name}: {os.strerror(errno.EACCES)})" in capsys.readouterr().err


@pytest.mark.skipif(sys.platform == "win32", reason="limits are POSIX's")
def test_on_a_full_disk_the_run_goes_on_with_one_line(folder, capsys):
    import resource

    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, before[1]))  # no file takes more than that
    try:
        for function in (_twice, _thrice):
            assert not came_from_the_cache(function)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"vrx_mj: compiled kernels cannot be kept in {folder}")
    assert line.endswith(f": {os.strerror(errno.EFBIG)}")
    assert not [file for file in folder.rglob("*") if file.is_file()]


def test_a_folder_that_is_removed_meanwhile_is_made_again(folder):
    came_from_the_cache()
    compiled = kernel(_twice)
    for file in files(folder):
        file.unlink()
    files_folder = next(folder.iterdir())
    files_folder.rmdir()
    assert compiled(2.0) == 4.0
    assert came_from_the_cache()


def test_nothing_is_kept_once_a_source_was_edited(folder, monkeypatch):
    """The folder is named by a digest of the sources; a module that is imported later has another text than that."""
    stamps = list(module._STAMPS)
    monkeypatch.setattr(module, "_STAMPS", [*stamps[:-1], stamps[-1] - 1])
    assert not came_from_the_cache()
    assert not [file for file in folder.rglob("*") if file.is_file()]
    monkeypatch.setattr(module, "_STAMPS", stamps)
    assert not came_from_the_cache()
    assert came_from_the_cache()


PARTS = """
import operator, sys
from vrx_mj.physics.kernel import kernel

def binary(operation):
    return kernel(lambda x, y: operation(x, y))

plus, by = binary(operator.add), binary(operator.mul)

@kernel
def total(x, y):
    return plus(x, y)

@kernel
def product(x, y):
    return by(x, y)

@kernel
def total_alone(x, y):
    return total(x, y)

@kernel
def both(x, y):
    return 100.0 * total(x, y) + product(x, y)

print(globals()[sys.argv[1]](2.0, 3.0))
"""


@pytest.mark.slow
def test_kernels_of_two_processes_are_linked_as_those_of_one(folder, tmp_path):
    """Operators of one name, each the same in the order of its process: they were taken for one."""
    file = tmp_path / "parts.py"
    file.write_text(PARTS, encoding="utf-8")
    place = os.environ | {"VRX_MJ_CACHE": str(folder), "PYTHONPATH": str(SOURCE)}
    for name, result in (("total_alone", "5.0"), ("both", "506.0"), ("both", "506.0")):
        done = subprocess.run([sys.executable, file, name], env=place, capture_output=True, text=True, check=True)
        assert done.stdout.split() == [result]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
def test_a_forked_process_has_names_of_its_own():
    read, write = os.pipe()
    if not (child := os.fork()):
        os.write(write, str(next(FunctionIdentity._unique_ids)).encode())
        os._exit(0)
    os.waitpid(child, 0)
    assert abs(int(os.read(read, 99)) - next(FunctionIdentity._unique_ids)) > 1_000_000
    os.close(read)
    os.close(write)


@pytest.mark.slow
def test_a_process_that_is_killed_leaves_nothing_that_harms(folder):
    program = "from vrx_mj.physics.elementary import cosine; print('here', flush=True); print(cosine(0.0))"
    place = os.environ | {"VRX_MJ_CACHE": str(folder), "PYTHONPATH": str(SOURCE)}
    command = [sys.executable, "-c", program]
    for wait in (0.0, 0.1, 0.3, 0.4, 0.5):
        with subprocess.Popen(command, env=place, stdout=subprocess.PIPE) as process:
            process.stdout.readline()
            time.sleep(wait)
            process.kill()
    done = subprocess.run(command, env=place, capture_output=True, text=True, timeout=120, check=True)
    assert (done.stdout, done.stderr) == ("here\n1.0\n", "")
