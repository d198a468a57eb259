"""The sandboxed process: what it answers, what it may not do, and what it may not take."""

import os
import pickle
import signal
import subprocess
import sys
import threading
import time
import warnings
from pathlib import Path

import psutil
import pytest

from foreign_jobs.tricks import Row
from vrx_mj.errors import ConfigError, UnknownNameError, VrxWarning
from vrx_mj.foreign import ReaderError, ask, ask_ahead, asking, budget, spend

LINUX = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the limits are those of Linux")
LOCKS = "from vrx_mj.foreign.confinement import lock_files; raise SystemExit(not lock_files(['/']))"
CALLS = "from vrx_mj.foreign.confinement import lock_calls; raise SystemExit(not lock_calls())"
FILTERED = pytest.mark.skipif(
    subprocess.run([sys.executable, "-c", CALLS], check=False).returncode != 0, reason="no filter of system calls"
)
LANDLOCK = subprocess.run([sys.executable, "-c", LOCKS], check=False).returncode == 0


@pytest.fixture(autouse=True)
def jobs(monkeypatch, tmp_path):
    """Jobs of these tests, and a cache of their own."""
    monkeypatch.setattr(asking, "PACKAGE", "foreign_jobs")
    monkeypatch.setattr(asking, "_folder", lambda: tmp_path / "cache")
    (tmp_path / "cache").mkdir()
    asking._answers.clear()


@pytest.fixture
def inside(tmp_path):
    folder = tmp_path / "inside"
    folder.mkdir()
    (folder / "a.txt").write_text("content", encoding="utf-8")
    (tmp_path / "secret.txt").write_text("secret", encoding="utf-8")
    return folder


def told(name, *arguments, returns=str, **options):
    return ask(f"tricks:{name}", *arguments, returns=returns, about="mesh a.stl", **{"cached": False, **options})


def reason(name, *arguments, **options):
    with pytest.raises(ReaderError) as refused:
        told(name, *arguments, **options)
    return refused.value.reason


# Answers


def test_plain_data_comes_back_as_its_types():
    row = told("echoed", "a", [1.5, float("inf"), 0.1], {"x": [1, 2]}, returns=Row)
    assert row.numbers.tolist() == [1.5, float("inf"), 0.1]
    assert (row.name, row.table, row.place, row.blob) == ("a", {"x": (1, 2)}, Path("a/b"), b"\0\xff")


def test_a_job_may_be_longer_than_a_pipe_holds():
    """A URDF of 100 kB is an argument."""
    assert told("echoed", "x" * 500_000, [1.0], {}, returns=Row).name == "x" * 500_000


def test_an_answer_of_another_type_is_refused():
    assert reason("modules", returns=Row).startswith("the answer of its reader is damaged: ")


def test_warnings_and_errors_are_those_of_the_call():
    with pytest.warns(VrxWarning, match=r"^a hull of 0.1 kg$"):
        assert told("warned", returns=int) == 7
    with pytest.raises(UnknownNameError) as unknown:
        told("unknown")
    assert unknown.value.known == ("left", "right")
    with pytest.raises(ConfigError) as refused:
        told("refused")
    assert [problem.line for problem in refused.value.problems] == [3]


def test_what_a_reader_was_not_made_for_is_one_line():
    with pytest.raises(ReaderError, match=r"^mesh a.stl cannot be read: KeyError: 'no such key'$"):
        told("wrong")


def test_a_job_that_cannot_be_imported_is_one_line():
    assert reason("nothing").startswith("AttributeError: ")


@pytest.mark.parametrize("entry", ["", "/nowhere", __file__], ids=["here", "nowhere", "file"])
def test_folders_of_modules_may_be_missing(monkeypatch, entry):
    """The first is the current folder, in which a stranger's files may lie: nothing is imported from there."""
    asking._versions.cache_clear()
    monkeypatch.setattr(sys, "path", [entry, *sys.path])
    assert told("unknowns", returns=int, cached=True) == 0


# Rights


@pytest.mark.parametrize(
    "what",
    ["write", "append", "create", "remove", "rename", "folder", "link", "start", "system", "fork", "exec", "socket",
     "name", "library", "kill", "list", "device", "self"],
)  # fmt: skip
def test_nothing_is_allowed_but_reading_in_the_folders(what, inside):
    before = sorted(inside.iterdir())
    assert "not allowed" in told("attempt", what, str(inside / "a.txt"), reads=[inside])
    assert sorted(inside.iterdir()) == before


def test_files_are_read_in_the_folders_alone(inside, tmp_path):
    (inside / "link.txt").symlink_to(tmp_path / "secret.txt")
    assert told("content", str(inside / "a.txt"), reads=[inside]) == "content"
    for path in (tmp_path / "secret.txt", inside / "link.txt", inside / ".." / "secret.txt", inside.with_name("insid")):
        assert "not allowed to read" in reason("content", str(path), reads=[inside])


@LINUX
def test_a_pipe_is_no_file(inside):
    os.mkfifo(inside / "pipe")
    assert "not a file" in reason("content", str(inside / "pipe"), reads=[inside])


@pytest.mark.skipif(not LANDLOCK, reason="a Linux with Landlock is needed")
def test_native_code_reads_in_the_folders_alone(inside, tmp_path):
    assert told("natively", str(inside / "a.txt"), reads=[inside]) == "content"
    assert told("natively", str(tmp_path / "secret.txt"), reads=[inside]) == "refused"


@FILTERED
@pytest.mark.parametrize("call", ["datagrams", "program"])
def test_native_code_opens_no_socket_and_starts_no_program(call):
    assert told(f"{call}_natively") == "refused"


def test_it_knows_nothing_of_the_environment(monkeypatch):
    monkeypatch.setenv("SECRET", "1")
    assert told("environment", returns=dict[str, str]).keys() <= {*asking.ENVIRONMENT, "SYSTEMROOT"}


def test_it_has_no_kernels_and_no_simulator():
    assert not {"numba", "mujoco", "vrx_mj.physics.kernel"} & set(told("modules", returns=list[str]))


# Limits


@LINUX
@pytest.mark.parametrize("name", ["memory", "slowly_memory"])
def test_memory_is_limited(name, monkeypatch):
    monkeypatch.setattr(asking, "memory", lambda _pid: 0)
    assert reason(name, memory=64 << 20) == "it takes more than 64 MiB of memory"


@LINUX
def test_memory_is_watched_where_the_system_has_no_limit(monkeypatch):
    monkeypatch.setattr(asking, "memory", lambda _pid: 1 << 40)
    assert reason("asleep") == "it takes more than 512 MiB of memory"


def test_memory_that_a_copy_took_is_measured():
    told("modules", returns=list[str])
    assert asking.memory(asking.READER._process.pid) < 32 << 20


@LINUX
@pytest.mark.slow
def test_processor_time_is_limited():
    assert reason("forever", seconds=1) == "it takes more than 1 s of processor time"


def test_the_clock_is_limited(monkeypatch):
    monkeypatch.setattr(asking, "CLOCK_PER_PROCESSOR_TIME", 0.2)
    assert reason("asleep", seconds=1) == "it takes more than 0.2 s"


def test_an_answer_is_limited():
    assert reason("flood", returns=bytes, answer=1 << 20) == "more than 1 MiB"


@LINUX
def test_limits_of_the_system_hold_for_native_code_too():
    assert told("shares", "RLIMIT_FSIZE") == "(0, 0)"
    assert told("shares", "RLIMIT_NPROC") == "(0, 0)"
    assert told("shares", "RLIMIT_NOFILE") == "(64, 64)"


def limited(monkeypatch, unit, most):
    monkeypatch.setitem(asking.TOGETHER, unit, most)
    return f"the files of this command take more than {most} {unit}"


def test_all_jobs_of_a_command_have_one_budget(monkeypatch):
    message = limited(monkeypatch, asking.TIME, 10)
    with budget():
        with budget():
            assert told("unknowns", returns=int) == 0
        asking.READER.spent[asking.TIME] += 11.0
        assert reason("unknowns", returns=int) == message
    assert told("unknowns", returns=int) == 0
    with budget():
        assert told("unknowns", returns=int) == 0


@pytest.mark.parametrize("cached", [True, False])
def test_text_of_all_jobs_of_a_command_is_limited_asked_anew_or_not(cached, monkeypatch):
    message = limited(monkeypatch, asking.TEXT, 3)
    values = ["x" * (1 << 19), [], {}]  # half a MiB there and back
    with budget():
        for _ in range(4 if cached else 2):
            told("echoed", *values, returns=Row, cached=cached)
        assert reason("echoed", *values, returns=Row, cached=cached) == message
    told("echoed", *values, returns=Row, cached=cached)


def test_notes_of_a_command_are_limited_warnings_among_them(monkeypatch):
    message = limited(monkeypatch, asking.NOTES, 3)
    with budget():
        spend("mesh a.stl", notes=2)
        with pytest.warns(VrxWarning, match="a hull"):
            told("warned", returns=int)
        assert reason("warned", returns=int) == message
    spend("mesh a.stl")


def test_what_is_ended_counts_with_all_that_it_might_take(monkeypatch):
    monkeypatch.setattr(asking, "CLOCK_PER_PROCESSOR_TIME", 0.02)
    before = asking.READER.spent[asking.TIME]
    assert reason("asleep", seconds=7)
    assert asking.READER.spent[asking.TIME] >= before + 7


# The process


@LINUX
def test_a_process_that_ends_is_one_line_and_again():
    assert reason("aborts") == "its reader was killed by SIGABRT"
    assert told("modules", returns=list[str])


@LINUX
def test_a_process_that_is_killed_meanwhile_is_one_line_and_again():
    told("modules", returns=list[str])
    pid = asking.READER._process.pid
    threading.Timer(0.2, os.kill, (pid, signal.SIGKILL)).start()
    assert reason("asleep") == "its reader was killed by SIGKILL"
    assert told("modules", returns=list[str])


@LINUX
def test_a_process_that_went_for_want_of_work_is_started_again():
    told("modules", returns=list[str])
    process = asking.READER._process
    process.kill()
    process.wait()
    assert told("modules", returns=list[str])


def test_jobs_have_one_process():
    first = told("modules", returns=list[str])
    pid = asking.READER._process and asking.READER._process.pid
    assert told("modules", returns=list[str]) == first
    assert (asking.READER._process and asking.READER._process.pid) == pid


def test_threads_take_turns(inside):
    found = []

    def read():
        found.append(told("content", str(inside / "a.txt"), reads=[inside]))

    threads = [threading.Thread(target=read) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == ["content"] * 8


INTERRUPTED = """
import os, signal, threading
from vrx_mj.foreign import ask, asking
asking.PACKAGE = "foreign_jobs"
def interrupt():
    print(asking.READER._process.pid, flush=True)
    os.kill(os.getpid(), signal.SIGINT)
threading.Timer(1.0, interrupt).start()
try:
    ask("tricks:forever", returns=int, about="a", cached=False)
except KeyboardInterrupt:
    print(asking.READER._process)
"""


@LINUX
@pytest.mark.slow
def test_an_interrupt_ends_it():
    tests = str(Path(__file__).parents[2])
    done = subprocess.run([sys.executable, "-c", INTERRUPTED], env={**os.environ, "PYTHONPATH": tests},
                          capture_output=True, encoding="utf-8", timeout=60, check=True)  # fmt: skip
    pid, left = done.stdout.split()
    assert left == "None"
    assert not psutil.pid_exists(int(pid))


FORKED = """
import os
from vrx_mj.foreign import ask, asking
asking.PACKAGE = "foreign_jobs"
told = lambda: len(ask("tricks:modules", returns=list[str], about="a", cached=False))
first = told()
if (pid := os.fork()) == 0:
    os._exit(0 if told() == first else 1)
assert os.waitpid(pid, 0)[1] == 0
assert told() == first
"""


@LINUX
def test_a_forked_process_has_one_of_its_own():
    tests = str(Path(__file__).parents[2])
    done = subprocess.run([sys.executable, "-W", "error", "-c", FORKED], env={**os.environ, "PYTHONPATH": tests},
                          capture_output=True, encoding="utf-8", timeout=60, check=False)  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")


def test_where_the_system_cannot_fork_each_job_has_a_process(monkeypatch, inside):
    monkeypatch.setattr(asking, "FORKS", False)
    asking.READER.end()
    assert told("content", str(inside / "a.txt"), reads=[inside]) == "content"
    assert asking.READER._process is None
    assert reason("flood", returns=bytes, answer=1 << 20) == "more than 1 MiB"
    assert "not allowed to read" in reason("content", str(inside.parent / "secret.txt"), reads=[inside])


# What was answered before


def times_run(monkeypatch):
    """How often the process was asked."""
    runs = []
    answer = asking.READER.answer
    monkeypatch.setattr(asking.READER, "answer", lambda job, about: runs.append(job) or answer(job, about))
    return runs


@pytest.fixture
def runs(monkeypatch):
    return times_run(monkeypatch)


@pytest.mark.parametrize("remembered", [True, False])
def test_an_answer_is_kept_while_all_files_are_as_they_were(inside, runs, remembered):
    def read():
        if not remembered:
            asking._answers.clear()
        paths = [str(inside / name) for name in ("first.txt", "a.txt")]
        return told("first_there", paths, reads=[inside], cached=True)

    assert [read(), read(), len(runs)] == ["content", "content", 1]
    (inside / "a.txt").write_text("changed", encoding="utf-8")
    assert [read(), read(), len(runs)] == ["changed", "changed", 2]
    (inside / "first.txt").write_text("new", encoding="utf-8")
    assert [read(), read(), len(runs)] == ["new", "new", 3]
    (inside / "first.txt").unlink()
    assert [read(), len(runs)] == ["changed", 4]


def test_warnings_and_errors_come_again(runs):
    for _ in range(2):
        with pytest.warns(VrxWarning, match="a hull"):
            told("warned", returns=int, cached=True)
        with pytest.raises(UnknownNameError):
            told("unknown", cached=True)
    assert len(runs) == 2


@pytest.mark.parametrize("remembered", [True, False])
def test_several_calls_are_one_question(runs, remembered):
    ask_ahead("tricks:named", [["a"], ["b"], ["none"]], "some files")
    if not remembered:
        asking._answers.clear()
    for name in "ab":
        with pytest.warns(VrxWarning, match=f"a hull of {name}"):
            assert told("named", name, cached=True) == name
    with pytest.raises(UnknownNameError, match="no thruster named 'none'"):
        told("named", "none", cached=True)
    ask_ahead("tricks:named", [["a"], ["b"]], "some files")
    assert len(runs) == 1


def test_of_calls_that_take_too_much_together_each_is_a_question(runs, monkeypatch):
    monkeypatch.setattr(asking, "ANSWER", 1 << 20)
    texts = [letter * 700_000 for letter in "ab"]
    ask_ahead("tricks:named", [[text] for text in texts], "some files")
    with pytest.warns(VrxWarning):
        assert [told("named", text, cached=True) for text in texts] == texts
    assert len(runs) == 3


@pytest.mark.parametrize(("most", "count"), [(10_000, 2), (500, 3)])
def test_answers_of_so_many_bytes_are_remembered(runs, monkeypatch, most, count):
    monkeypatch.setattr(asking, "_folder", lambda: None)
    monkeypatch.setattr(asking, "_REMEMBERED", most)
    for letter in "aba":
        with pytest.warns(VrxWarning):
            assert told("named", letter * 300, cached=True) == letter * 300
    assert len(runs) == count


def test_bytes_that_are_no_answer_are_damage(monkeypatch):
    monkeypatch.setattr(asking.READER, "answer", lambda *_: b"x")
    assert reason("modules").startswith("the answer of its reader is ")


def test_an_error_of_a_reader_comes_whole_from_another_process():
    again = pickle.loads(pickle.dumps(ReaderError("mesh a.stl", "it is too large")))
    assert (again.about, again.reason) == ("mesh a.stl", "it is too large")
    assert str(again) == "mesh a.stl cannot be read: it is too large"


def test_what_took_too_much_is_tried_again(runs):
    for _ in range(2):
        assert reason("flood", returns=bytes, answer=1 << 20, cached=True)
    assert len(runs) == 2


@pytest.mark.parametrize("damage", [lambda content: content[:-1], lambda content: b"", lambda content: content[::-1]])
def test_a_damaged_answer_is_asked_for_again(inside, runs, tmp_path, damage):
    for _ in range(2):
        assert told("content", str(inside / "a.txt"), reads=[inside], cached=True) == "content"
        for file in (tmp_path / "cache").iterdir():
            file.write_bytes(damage(file.read_bytes()))
        asking._answers.clear()
    assert len(runs) == 2


def test_without_a_folder_nothing_is_kept_and_nothing_said(inside, monkeypatch, capfd):
    monkeypatch.setattr(asking, "_folder", lambda: None)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert told("content", str(inside / "a.txt"), reads=[inside], cached=True) == "content"
    assert capfd.readouterr() == ("", "")


def test_a_full_disk_keeps_nothing(inside, monkeypatch, tmp_path):
    def full(*_arguments):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    assert told("content", str(inside / "a.txt"), reads=[inside], cached=True) == "content"
    assert list((tmp_path / "cache").iterdir()) == []


def test_the_oldest_answers_go(inside, monkeypatch, tmp_path):
    monkeypatch.setattr(asking, "MAX_KEPT", 2000)
    for number in range(20):
        asking._trimmed.clear()
        (inside / f"{number}.txt").write_text("x" * 300, encoding="utf-8")
        told("content", str(inside / f"{number}.txt"), reads=[inside], cached=True)
        time.sleep(0.002)
    files = list((tmp_path / "cache").iterdir())
    assert 1 <= len(files) <= 4
    assert sum(file.stat().st_size for file in files) <= 2000


def test_other_sources_or_versions_are_another_answer(inside, runs, monkeypatch):
    for version in ("1", "2", "1"):
        monkeypatch.setattr(asking, "_versions", lambda version=version: version)
        told("content", str(inside / "a.txt"), reads=[inside], cached=True)
    assert len(runs) == 2


def test_the_current_folder_counts_only_where_paths_are_shown_relative_to_it(inside, runs, monkeypatch, tmp_path):
    (tmp_path / "other").mkdir()
    for folder, count in (("/", 1), ("other", 2), ("inside", 3), ("inside", 3)):
        monkeypatch.chdir(tmp_path / folder)
        told("content", str(inside / "a.txt"), reads=[inside], cached=True)
        assert len(runs) == count
