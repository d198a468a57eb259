"""What is published: an sdist that builds, and a wheel that is whole, installed where nothing else of ours is."""

import re
import subprocess
import sys
import sysconfig
import tarfile
import venv
import zipfile
from collections import Counter
from pathlib import Path

import pytest
from packaging.metadata import Metadata

from vrx_command import ended, environment, state_in, vrx

REPO = Path(__file__).resolve().parents[2]
RUN = ("run", "ocean_buoys", "--duration", "2", "--thrust", "left=0.6,right=0.4")
DEPENDENCIES = "import site; site.addsitedir({!r})\n"

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def published(tmp_path_factory):
    """Folder with the sdist, and the wheel that was built from it."""
    folder = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "build", "--no-isolation", "--outdir", str(folder), str(REPO)]
    release = environment(GITHUB_SERVER_URL="https://example.org", GITHUB_REPOSITORY="some/where", GITHUB_SHA="0123abc")
    done = subprocess.run(command, capture_output=True, encoding="utf-8", check=False, cwd=folder, env=release)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


@pytest.fixture(scope="module")
def wheel(published):
    (file,) = published.glob("*.whl")
    return file


@pytest.fixture(scope="module")
def commands(wheel, tmp_path_factory):
    """Folder of the commands of an environment in which only the wheel was installed; its dependencies are ours."""
    home = tmp_path_factory.mktemp("测试 environment")
    venv.create(home)
    done = subprocess.run(
        [sys.executable, "-m", "pip", "--python", str(home), "install", "-q", "--no-deps", "--no-index", str(wheel)],
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    assert done.returncode == 0, done.stderr
    paths = sysconfig.get_paths("venv", {"base": str(home), "platbase": str(home)})
    lines = DEPENDENCIES.format(sysconfig.get_paths()["purelib"])
    (Path(paths["purelib"]) / "zz_dependencies.pth").write_text(lines, encoding="utf-8")
    return Path(paths["scripts"])


def files_under(folder):
    return {path.relative_to(REPO / folder).as_posix() for path in (REPO / folder).rglob("*") if is_shipped(path)}


def is_shipped(path):
    return path.is_file() and "__pycache__" not in path.parts


@pytest.mark.parametrize(
    ("folder", "inside"),
    [("src/vrx_mj", ""), ("assets", "assets/"), ("templates", "templates/"), ("fleets", "fleets/")],
)
def test_the_wheel_holds_every_file_of_ours(wheel, folder, inside):
    with zipfile.ZipFile(wheel) as stored:
        names = set(stored.namelist())
    assert {f"vrx_mj/{inside}{name}" for name in files_under(folder)} - names == set()


def test_the_wheel_is_typed_and_holds_nothing_else(wheel):
    with zipfile.ZipFile(wheel) as stored:
        names = stored.namelist()
        about = next(name for name in names if name.endswith("METADATA"))
        metadata = Metadata.from_email(stored.read(about))
    assert "vrx_mj/py.typed" in names
    assert {name.split("/")[0] for name in names} == {"vrx_mj", about.split("/")[0]}
    assert [name for name in names if "test" in Path(name).parts[1] or name.endswith((".pyc", ".rrd"))] == []
    assert any(name.endswith("licenses/LICENSE") for name in names)
    assert "mujoco" in {requirement.name for requirement in metadata.requires_dist}
    assert metadata.project_urls["Source"] == "https://example.org/some/where"
    links = re.findall(r"\]\((.*?)\)", metadata.description)
    assert len(links) > 10
    assert [link for link in links if not link.startswith("https://")] == []


def test_the_wheel_holds_no_file_twice(wheel):
    """By name, whatever a system makes of case, and by content; messages of one name in two packages, or of like
    fields, are alike: Gazebo's states, UsvDrive, which moved, and lists of transforms."""
    with zipfile.ZipFile(wheel) as stored:
        names = stored.namelist()
        content = {name: stored.read(name) for name in names}
    assert len({name.casefold() for name in names}) == len(names)
    alike = Counter(content.values())
    twice = [name for name in names if content[name] and alike[content[name]] > 1]
    messages = (
        "gazebo_msgs/LinkStates",
        "gazebo_msgs/ModelStates",
        "robotx_gazebo/UsvDrive",
        "tf2_msgs/TFMessage",
        "tf2_web_republisher/TFArray",
        "tf2_web_republisher/TFSubscriptionFeedback",
        "usv_gazebo_plugins/UsvDrive",
    )
    assert sorted(twice) == [f"vrx_mj/ros/definitions/{name}.msg" for name in messages]


def test_the_sdist_holds_what_the_tests_need(published):
    (file,) = published.glob("*.tar.gz")
    with tarfile.open(file) as stored:
        names = {name.partition("/")[2] for name in stored.getnames()}
    assert {"pyproject.toml", "README.md", "LICENSE", "tests/vrx_command.py", "tests/golden/objects.csv"} <= names


def installed(commands, *words, cwd, **more):
    """The code, stdout and stderr of the installed `vrx-mj`, which must not see the sources."""
    process = subprocess.Popen(
        [str(commands / "vrx-mj"), *words],
        cwd=cwd,
        env=environment(PYTHONPATH=None, **more),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        encoding="utf-8",
    )
    return ended(process)


@pytest.fixture
def boats(tmp_path):
    folder = tmp_path / "测试 boats"
    folder.mkdir()
    return folder


def test_the_installed_wheel_runs_from_another_folder_with_the_kernels_of_the_sources(commands, boats):
    """Kernels belong to their content, so that another installation of a version compiles nothing."""
    assert installed(commands, "list", "worlds", cwd=boats)[:2] == vrx("list", "worlds", cwd=boats)[:2]
    ours, theirs = vrx(*RUN, cwd=boats), installed(commands, *RUN, "--record", "船.rrd", cwd=boats)
    assert (ours[0], theirs[0], theirs[2].count("compiling")) == (0, 0, 0), theirs[2]
    assert state_in(ours[1]) == state_in(theirs[1])
    assert [file.name for file in boats.iterdir()] == ["船.rrd"]


@pytest.mark.nightly
def test_the_installed_wheel_keeps_what_it_compiled(commands, boats):
    """That two first uses at once share a cache is in tests/unit/physics/test_kernel.py, with fewer kernels."""
    first, again = (installed(commands, *RUN, cwd=boats, VRX_MJ_CACHE=boats / "kernels") for _ in range(2))
    assert first[2].startswith("vrx_mj: compiling the physics for this machine, once; it takes about ")
    assert (first[0], again[0], again[2].count("compiling")) == (0, 0, 0), again[2]
    assert len({state_in(out) for _, out, _ in (first, again, vrx(*RUN, cwd=boats))}) == 1
    assert [file.name for file in boats.iterdir()] == ["kernels"]


def test_the_installed_package_is_the_wheels(commands, tmp_path):
    python = commands / Path(sys.executable).name
    done = subprocess.run(
        [str(python), "-c", "import vrx_mj; print(vrx_mj.__file__)"],
        cwd=tmp_path,
        env=environment(PYTHONPATH=None),
        capture_output=True,
        encoding="utf-8",
        check=True,
    )
    assert Path(done.stdout.strip()).resolve().is_relative_to(commands.parent.resolve())
