"""Rules of the whole project that no linter checks (CONTRIBUTING.md, "How code should read")."""

import ast
import re
import subprocess
import sys
import tomllib
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from importlib import metadata
from pathlib import Path

import pytest
import yaml
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

import figures

REPO = Path(__file__).resolve().parents[1]
SOURCES = sorted((REPO / "src").rglob("*.py"))
TESTS = sorted((REPO / "tests").rglob("*.py"))
PROSE = sorted([*REPO.glob("*.md"), *(REPO / "docs").rglob("*.md"), REPO / "assets" / "README.md"])
MODULE_LINES = 600
FUNCTION_LINES = 40
LONG = re.compile(rf"^( *)(?:async )?def .*\n(?:(?:\1[ )].*)?\n){{{FUNCTION_LINES}}}", re.MULTILINE)
"""A function of more lines than that, its docstring counted: files without one need not be parsed."""
TEXT = re.compile(r'"""(?:[^"\\]|\\.|"(?!""))*"""', re.DOTALL)
IMPORT = re.compile(r"^ *(?:import ([\w., ]+)|from ([\w.]+) import)", re.MULTILINE)
NAME = re.compile(r"(?<!\bas )(?!as )\b[\w.]+")
CONSTANT = re.compile("_?[A-Z][A-Z0-9_]*")
UNFINISHED = re.compile(r"\b(TODO|FIXME)\b")
PHYSICS_IMPORTS = {"numpy", "numba", "llvmlite", "vrx_mj", "__future__"} | set(sys.stdlib_module_names)
LACKED = {
    "crypt", "curses", "fcntl", "grp", "nis", "ossaudiodev", "posix", "pty", "pwd", "readline", "resource", "spwd",
    "syslog", "termios", "tty",  # by Windows
    "msvcrt", "nt", "winreg", "winsound", "_scproxy", "_winapi",  # by Linux, and all but one by macOS
}  # fmt: skip
"""Modules of the standard library that Linux, macOS or Windows is without."""
ROS = {"gazebo_msgs", "genpy", "geographic_msgs", "geometry_msgs", "nav_msgs", "rclpy", "rosgraph_msgs", "rospy",
       "sensor_msgs", "std_msgs", "std_srvs", "usv_msgs", "visualization_msgs", "vrx_gazebo"}  # fmt: skip
"""Imported by programs that tests start where ROS is installed."""
LIGHT = "import sys, vrx_mj; print([m for m in sys.modules if m.split('.')[0] in set(sys.argv[1:])])"
HEAVY = (
    "IPython",
    "numpy",
    "mujoco",
    "numba",
    "pydantic",
    "yaml",
    "matplotlib",
    "rerun",
    "trimesh",
    "gymnasium",
    "pettingzoo",
)


@cache
def text_of(file: Path) -> str:
    return file.read_text(encoding="utf-8")


@cache
def tree_of(file: Path) -> ast.Module:
    return ast.parse(text_of(file), filename=str(file))


def faults(files: Iterable[Path], found: Callable[[Path], object]) -> dict[str, object]:
    """What a rule finds in files, by their names."""
    return {shown(file): fault for file in files if (fault := found(file))}


def shown(file: Path) -> str:
    return file.relative_to(REPO).as_posix()


def statements(node: ast.AST) -> Iterator[ast.AST]:
    """What stands in the blocks of a node, and in theirs: a tenth of all nodes."""
    for block in ("body", "orelse", "finalbody", "handlers", "cases"):
        for inner in getattr(node, block, ()):
            yield inner
            yield from statements(inner)


def functions(file: Path) -> Iterator[ast.FunctionDef | ast.AsyncFunctionDef]:
    return (node for node in statements(tree_of(file)) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef))


def code_lines(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Lines of a function, its docstring and decorators left out."""
    first, last = function.body[0], function.end_lineno or function.lineno
    documented = isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant)
    docstring = (first.end_lineno or 0) - first.lineno + 1 if documented else 0
    return last - function.lineno + 1 - docstring


def imported(file: Path, wanted: Callable[[str], object]) -> set[str]:
    """Modules of a kind that a file imports; one whose lines, in texts too, name none need not be parsed."""
    if not any(wanted(name) for found in IMPORT.finditer(text_of(file)) for name in NAME.findall(found[1] or found[2])):
        return set()
    names = set()
    for node in statements(tree_of(file)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names.add(node.module or "")
    return {name for name in names if wanted(name)}


def test_modules_stay_short():
    assert faults([*SOURCES, *TESTS], lambda file: len(text_of(file).splitlines()) > MODULE_LINES) == {}, "split them"


def test_functions_stay_short():
    def long(file):
        return {f.name: code_lines(f) for f in functions(file) if code_lines(f) > FUNCTION_LINES}

    def indented(text):
        return TEXT.sub(lambda found: "\n" * found[0].count("\n") + 80 * " ", text)

    files = [file for file in [*SOURCES, *TESTS] if LONG.search(indented(text_of(file)))]
    assert files, "some are long with their docstrings"
    assert faults(files, long) == {}


def low_constants(file: Path) -> list[str]:
    """Constants below a class or a function whose values need no class or function of the module."""
    own: set[str] = set()
    found: list[str] = []
    for node in tree_of(file).body:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            own.add(node.name)
        elif own and isinstance(node, ast.Assign | ast.AnnAssign):
            names = {part.id: part.ctx for part in ast.walk(node) if isinstance(part, ast.Name)}
            stored = {name for name, context in names.items() if isinstance(context, ast.Store)}
            constants = [name for name in stored if CONSTANT.fullmatch(name)]
            if constants and own.isdisjoint(names):
                found += constants
            else:
                own |= stored
    return found


def test_constants_stand_above_classes_and_functions():
    assert faults(SOURCES, low_constants) == {}, "put them below the imports, unless they are made of these"


def test_a_constant_that_stands_too_low_is_found(tmp_path):
    text = "A = 1\ndef f(): ...\nB = f\nC: int = 2\nD = B\nx = 3\nE = [i for i in D]\n_F, G = 4, 5\n"
    (tmp_path / "some.py").write_text(text, encoding="utf-8")
    assert sorted(low_constants(tmp_path / "some.py")) == ["C", "G", "_F"]


def test_nothing_is_left_for_later():
    files = {*SOURCES, *TESTS, *PROSE} - {Path(__file__)}
    assert faults(files, lambda file: [line for line in text_of(file).splitlines() if UNFINISHED.search(line)]) == {}


def test_physics_imports_numpy_numba_and_the_standard_library_only():
    allowed = re.compile(r"vrx_mj\.(physics|arrays|cache_folder|constants|linear_waves|spectra)\b")

    def other(name):
        return name.split(".")[0] not in PHYSICS_IMPORTS or (name.startswith("vrx_mj") and not allowed.match(name))

    files = list((REPO / "src/vrx_mj/physics").rglob("*.py"))
    assert files
    assert faults(files, lambda file: imported(file, other)) == {}


def test_modules_that_a_system_lacks_are_imported_by_name_nowhere():
    """vrx_mj/unix.py has those that are needed, and None on Windows."""

    def lacked(name):
        return name.partition(".")[0] in LACKED

    assert faults(SOURCES, lambda file: imported(file, lacked)) == {}


@pytest.mark.parametrize(
    "text",
    [
        "import os, pty as p",
        "import pty",
        "if True:\n    from pty import spawn",
        "try:\n  from pty.a import (\n b)\nfinally:\n  0",
    ],
)
def test_a_module_that_is_imported_is_found_wherever_that_stands(tmp_path, text):
    (tmp_path / "some.py").write_text(text + "\n", encoding="utf-8")
    assert imported(tmp_path / "some.py", lambda name: name.startswith("pty"))


def test_there_is_no_utils():
    assert not [shown(file) for file in SOURCES if re.search(r"util|helper|misc|common", file.stem)]


def test_public_names_are_listed_in_packages_alone():
    """Elsewhere a leading underscore says what is private."""
    listing = re.compile("^__all__", re.MULTILINE)
    assert not [shown(each) for each in SOURCES if each.stem != "__init__" and listing.search(each.read_text("utf-8"))]


def test_functions_that_are_named_in_texts_are_there():
    """Jobs of the sandboxed process, readers and commands, as `formats.urdf.kinematics:tree`."""
    named = re.compile(r'"((?:\w+\.)*\w+):(\w+)"')
    missing = []
    for file in SOURCES:
        for module, name in named.findall(file.read_text("utf-8")):
            places = [folder / f"{module.replace('.', '/')}.py" for folder in (file.parent, REPO / "src" / "vrx_mj")]
            home = next((place for place in places if place.is_file()), None)
            if home and not re.search(rf"^(def|class) {name}\b|^{name} = ", home.read_text("utf-8"), re.MULTILINE):
                missing.append((shown(file), f"{module}:{name}"))
    assert missing == []


def test_importing_the_package_loads_nothing_heavy():
    done = subprocess.run(
        [sys.executable, "-c", LIGHT, *HEAVY], capture_output=True, encoding="utf-8", check=True, cwd=REPO
    )
    assert done.stdout.strip() == "[]"


def read(file: str) -> str:
    return (REPO / file).read_text(encoding="utf-8")


def blocks_of_shell(file: str) -> list[str]:
    return re.findall(r"^```sh\n(.*?)^```$", read(file), re.MULTILINE | re.DOTALL)


def test_ci_and_the_documents_have_the_readmes_test_command():
    _, command = blocks_of_shell("README.md")[:2]
    printed = subprocess.run([REPO / ".ci" / "test-command"], capture_output=True, encoding="utf-8", check=True).stdout
    assert printed == command
    assert 'bash -c "$(.ci/test-command)"' in (REPO / ".ci" / "run").read_text(encoding="utf-8")
    assert command in blocks_of_shell("CONTRIBUTING.md")
    assert command in blocks_of_shell("README.zh-CN.md")


def test_the_documents_give_the_readmes_test_command_the_same_time():
    """As CONTRIBUTING.md has it; the READMEs write it as a word."""
    row = re.search(r"^\| `\.venv/bin/pytest -n logical` \|.*\| (\d+) min \|$", read("CONTRIBUTING.md"), re.M)
    words = ["four", "四"], ["five", "五"], ["six", "六"], ["seven", "七"], ["eight", "八"], ["nine", "九"]
    english, chinese = words[int(row[1]) - 4]
    assert re.findall(r"about (\w+) minutes", read("README.md")) == [english]
    assert re.findall(r"约(.)分钟", read("README.zh-CN.md")) == [chinese]


def test_the_workflow_tries_the_pythons_and_systems_that_the_package_names():
    quick = yaml.safe_load(read(".github/workflows/tests.yml"))["jobs"]["quick"]
    matrix = quick["strategy"]["matrix"]
    classifiers = tomllib.loads(read("pyproject.toml"))["project"]["classifiers"]
    assert matrix["python"] == [found[1] for each in classifiers if (found := re.search(r":: (3\.\d+)$", each))]
    systems = {"ubuntu-latest": "Linux", "macos-latest": "MacOS", "windows-latest": "Windows"}
    named = {each.rpartition(" :: ")[2] for each in classifiers if each.startswith("Operating System")}
    assert {systems[each] for each in matrix["system"]} == named


def test_the_readme_is_one_screen():
    assert len(read("README.md").split()) <= 450


def distributions_of(requirements: list[str], extras: dict[str, list[str]]) -> set[str]:
    """Names of distributions in a list of requirements, with what our extras stand for."""
    found = set()
    for each in map(Requirement, requirements):
        found |= set().union(*(distributions_of(extras[name], extras) for name in each.extras if each.name == "vrx-mj"))
        found.add(canonicalize_name(each.name))
    return found


def test_the_extra_test_brings_what_tests_and_examples_import():
    project = tomllib.loads(read("pyproject.toml"))["project"]
    brought = distributions_of([*project["dependencies"], "vrx-mj[test]"], project["optional-dependencies"])
    own = {"vrx_mj", "some_crew", "team", *(path.stem for path in REPO.glob("tests/*"))}
    files = [*TESTS, *(REPO / "examples").glob("[0-9]*.py")]
    own |= ROS | {"pydrake", "robot_localization", "tf2_ros"}  # in environments of their own, or of ROS, too
    own |= set(sys.stdlib_module_names)
    homes = metadata.packages_distributions()

    @cache
    def missing(name):
        first = name.split(".")[0]
        return first not in own and brought.isdisjoint(map(canonicalize_name, homes.get(first, ())))

    assert faults(files, lambda file: imported(file, missing)) == {}


@pytest.mark.parametrize(
    ("package", "name"),
    [("mujoco", "_MJPYTHON"), ("rerun-sdk", "flush_and_cleanup_orphaned_recordings"), ("typer", "_runtime_param")],
)
def test_packages_of_which_private_names_are_used_have_a_last_version(package, name):
    assert any(name in text_of(file) for file in SOURCES)
    project = tomllib.loads((REPO / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    (wanted,) = (one for one in map(Requirement, project["dependencies"]) if one.name == package)
    assert "<" in {each.operator for each in wanted.specifier}


FROM_A_REGISTRY = re.compile(r"vrx[-_]mj\[|\b(?:pip|uv|pipx|conda|uvx)\b.* install\b[^`|#&;\n]*\bvrx[-_]mj\b(?![/.\[])")
"""Our name as a requirement: until there is a release, whoever takes the name runs code on readers' machines."""


@pytest.mark.parametrize(
    ("line", "found"),
    [
        ("pip install 'vrx-mj[ros1]'", True),
        ("pip install -U vrx_mj", True),
        ("install_command(f'vrx-mj[{extra}]')", True),
        ("pip install '.[ros1]'", False),
        ("run in the clone of vrx_mj: python -m pip install '.[ros1]'", False),
        (".venv/bin/pip install -q . && .venv/bin/vrx-mj run ocean", False),
    ],
)
def test_a_line_that_installs_us_from_a_registry_is_found(line, found):
    assert bool(FROM_A_REGISTRY.search(line)) == found


INSTRUCTIONS = [
    *PROSE,
    *SOURCES,
    *(REPO / "examples").rglob("*.*"),
    *(REPO / "tools").glob("*.py"),
    REPO / ".ci" / "run",
]


def test_no_line_installs_us_from_a_registry():
    def told(file):
        lines = [line for line in text_of(file).splitlines() if file.name != "CHANGELOG.md" or "install" in line]
        return [line for line in lines if FROM_A_REGISTRY.search(line)]

    assert faults((file for file in INSTRUCTIONS if file.suffix not in {".npz", ".pyc"}), told) == {}


def test_the_version_is_one():
    project = tomllib.loads(read("pyproject.toml"))["project"]
    citation = read("CITATION.cff")
    assert f"version: {project['version']}\n" in citation
    package = (REPO / "src" / "vrx_mj" / "__init__.py").read_text(encoding="utf-8")
    assert f'__version__ = "{project["version"]}"\n' in package


def test_links_in_the_documents_lead_somewhere():
    def lost(file):
        targets = re.findall(r"\]\(([^)#]+?)(?:#[^)]*)?\)", text_of(file))
        return [one for one in targets if not re.match(r"[a-z]+:", one) and not (file.parent / one).exists()]

    assert faults(PROSE, lost) == {}


def test_links_of_pages_have_titles_for_texts():
    pages = list((REPO / "docs").rglob("*.md"))
    assert pages
    assert faults(pages, lambda file: re.findall(r"\[`?[\w./-]+\.md`?\]\(.*?\)", text_of(file))) == {}


def test_every_folder_of_assets_has_its_origin_written_down():
    table = (REPO / "assets" / "README.md").read_text(encoding="utf-8")
    folders = [entry.name for entry in sorted((REPO / "assets").iterdir()) if entry.is_dir()]
    assert [name for name in folders if f"`{name}/" not in table] == []


def test_contributing_shows_the_layers_that_are_checked():
    contracts = tomllib.loads(read("pyproject.toml"))["tool"]["importlinter"]["contracts"]
    checked = next(contract["layers"] for contract in contracts if contract["type"] == "layers")
    block = read("CONTRIBUTING.md").split("## Layers")[1].split("```")[1].strip()
    shown_layers = [re.split(r"\s{2,}", line)[0].split(" | ") for line in block.splitlines()]
    assert shown_layers == [re.sub(r"[()]", "", layer).split(" | ") for layer in checked]
    top = {path.stem for path in (REPO / "src" / "vrx_mj").iterdir() if not path.name.startswith("_")} - {"py"}
    assert {name.split(".")[0] for layer in shown_layers for name in layer} == top


def test_files_that_contributing_names_exist():
    text = read("CONTRIBUTING.md").split("## Where things go")[1].split("\n## ")[0]
    prose = re.sub(r"```.*?```", "", text, flags=re.DOTALL)
    named = {name for name in re.findall(r"`([\w.][\w./]*/[\w./]*)`", prose) if not re.search(r"NAME|\*", name)}
    places = [REPO, REPO / "src" / "vrx_mj"]
    assert {name for name in named if not any((place / name).exists() for place in places)} == set()
    assert len(named) > 30


def test_nobody_reads_a_compiled_world_by_string_keys():
    sources = (path.read_text(encoding="utf-8") for path in figures.SOURCE.rglob("*.py"))
    assert sum(len(figures.TREE_READ.findall(text)) for text in sources) == 0


def test_no_test_has_a_verdict_by_time():
    """A loaded machine fails it: count work (tests/work.py), or measure in a benchmark."""
    clocks = re.compile(r"\b(process_time|thread_time|perf_counter|clock_gettime)(_ns)?\(\)")
    found = [shown(file) for file in TESTS if file.name.startswith("test_") and clocks.search(file.read_text("utf-8"))]
    assert found == []


def test_equal_values_keep_their_order_on_every_processor():
    """NumPy's quicker sorts order ties by the instructions that a processor has."""
    sorts = re.compile(r"argsort\((?!.*kind=\"stable\").*")
    found = [(shown(file), line) for file in SOURCES for line in sorts.findall(file.read_text("utf-8"))]
    assert found == []
