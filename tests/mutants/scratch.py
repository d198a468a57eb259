"""A scratch copy of the repository in which one mutant at a time is made and tested."""

import ast
import functools
import importlib.util
import os
import re
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType

from mutants.catalogue import ROOT, Mutant
from mutants.forks import run_pytest

KERNELS = ("physics", "sensors", "runtime", "recording")
"""Packages whose sources name the folder of the compiled kernels (`vrx_mj.physics.kernel`)."""
TESTS, SOURCES = ROOT / "tests", ROOT / "src" / "vrx_mj"


def nearest_tests(mutant: Mutant) -> list[str]:
    """Test files called after the module, or that import it; where there are none, those of its package."""
    path = Path(mutant.file)
    importing = _importing(".".join(path.with_suffix("").parts))
    own = [file for entry in own_tests(mutant) for file in _files(ROOT / entry)]
    near = [file for file in own if re.match(rf"test_(view_)?{path.stem}(_|$)", file.stem) or file in importing]
    return _names(near) or own_tests(mutant)


def own_tests(mutant: Mutant) -> list[str]:
    """The folder of unit tests of the mutant's package; of a module outside of packages, the files that import it."""
    folder = TESTS / "unit" / mutant.package
    return _names([folder] if folder.is_dir() else _importing(mutant.package))


def fingerprint_tests(mutant: Mutant) -> list[str]:
    """Fingerprints of what is computed through the module: it is among what their files' imports use."""
    files = [*TESTS.glob("integration/test_fingerprints_*.py"), TESTS / "integration/test_examples.py"]
    through = {file: _used_by(_imports_of(file)) for file in files}
    found = (file for file in files if SOURCES / mutant.file in through[file])
    return _names(sorted(found, key=lambda file: len(through[file])))


def related_tests(mutant: Mutant) -> list[str]:
    """Fingerprints of what is computed through the module, its package's unit tests, and other files that import some.

    A fingerprint looks at whatever the modules that its file imports use; any other test, at what it imports.
    """
    folder = TESTS / "unit" / mutant.package
    others = [file for file in _importing(mutant.package) if folder not in file.parents]
    return list(dict.fromkeys([*fingerprint_tests(mutant), *own_tests(mutant), *_names(others)]))


@functools.cache
def _used_by(lines: str) -> frozenset[Path]:
    """The sources that some lines import, and those that these import."""
    found, new = set[Path](), _named_in(lines, "")
    while new - found:
        found |= new
        new = frozenset().union(*(_named_in(file.read_text("utf-8"), file.parent.name) for file in new))
    return frozenset(found)


@functools.cache
def _named_in(lines: str, package: str) -> frozenset[Path]:
    """The sources that are imported in a text of a package, or named as `module:function`."""
    named = re.findall(r"\bvrx_mj\.([\w.]+)(?: import (\([^)]*\)|[\w, ]+))?", lines)
    paths = {one for path, names in named for one in (path, *(f"{path}.{name}" for name in re.findall(r"\w+", names)))}
    paths |= {f"{package}.{path}" for path in re.findall(r'"([\w.]+):\w+"', lines)}
    files = [SOURCES / path.replace(".", "/") for path in paths]
    return frozenset(one for file in files for one in (file.with_suffix(".py"), file / "__init__.py") if one.is_file())


@functools.cache
def _importing(name: str) -> list[Path]:
    """Test files that import a module or package of `vrx_mj`, or are called after it."""
    above, _, last = f"vrx_mj.{name}".rpartition(".")
    imported, called = re.compile(rf"\b{above}(\.| import [^\n]*\b){last}\b"), re.compile(rf"test_{last}(_|$)")
    return [file for file in _files(TESTS) if imported.search(_imports_of(file)) or called.match(file.stem)]


def _names(paths: list[Path]) -> list[str]:
    return [path.relative_to(ROOT).as_posix() for path in paths]


@functools.cache
def _files(entry: Path) -> list[Path]:
    return sorted(entry.rglob("test_*.py")) if entry.is_dir() else [entry]


@functools.cache
def _imports_of(file: Path) -> str:
    """The lines of a file that name the package, and of the helpers and fixtures that it uses."""
    text = file.read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if "vrx_mj" in line]
    homes = (f"import vrx_mj.{home}" for name, home in _homes().items() if _of_package(name).search("\n".join(lines)))
    helpers = [TESTS / f"{name.replace('.', '/')}.py" for name in re.findall(r"^(?:from|import) ([\w.]+)", text, re.M)]
    fixtures = [file.with_name("conftest.py")] if file.parent != TESTS else []
    used = [_imports_of(helper) for helper in (*helpers, *fixtures) if helper.exists() and helper != file]
    return "\n".join([*lines, *homes, *used])


@functools.cache
def _of_package(name: str) -> re.Pattern[str]:
    return re.compile(rf"\bvrx_mj(\.| import [^\n]*\b){name}\b")


@functools.cache
def _homes() -> dict[str, str]:
    """The modules of the names that `import vrx_mj` offers."""
    text = (ROOT / "src/vrx_mj/__init__.py").read_text(encoding="utf-8")
    return dict(re.findall(r'^    "(\w+)": "([\w.]+)",$', text, re.M))


class Scratch:
    """One copy, and one cache of kernels that follows its mutants."""

    def __init__(self, folder: Path) -> None:
        self.tree, self.cache = folder / "tree", folder / "kernels"
        listed = subprocess.run(
            ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
            cwd=ROOT, check=True, capture_output=True, encoding="utf-8",
        )  # fmt: skip
        for name in filter(None, listed.stdout.split("\0")):
            if (ROOT / name).is_file():
                (self.tree / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(ROOT / name, self.tree / name)
        self._hash = _source_hash(self.tree)
        self._take_kernels()
        self._sound = dict[str, bool]()

    def is_sound(self, test: str, limit: float) -> bool:
        """Whether a test passes where nothing is wrong; one that does not is left out from now on."""
        if not test:  # the process ended by itself
            return True
        if test not in self._sound:
            self._sound[test] = self.run_tests([test, "-m", ""], limit)[0] == "passed"
            if not self._sound[test]:
                print(f"left out, as it fails without a mutant: {test}", flush=True)
        return self._sound[test]

    def _take_kernels(self) -> None:
        """Begin with the kernels that the checkout has compiled."""
        there = _kernel_module().cache_folder()
        if there is not None and there.name == self._hash:
            shutil.copytree(there, self.cache / self._hash)

    @contextmanager
    def holding(self, mutant: Mutant) -> Iterator[None]:
        """The copy with the mutant in it, and with the kernels that it leaves as they are."""
        file = self.tree / mutant.source
        text, status = file.read_text(encoding="utf-8"), file.stat()
        file.write_text(mutant.mutated_source(text), encoding="utf-8")
        _forget_bytecode(file)
        own = self.cache / _source_hash(self.tree)
        if own.name != self._hash:
            stale = _stale(self.tree, mutant, text)
            for kept in (self.cache / self._hash).rglob("*.nb[ic]"):
                if kept.parent.name in KERNELS and kept.name.split(".")[0] not in stale:  # tests' own call others
                    target = own / kept.relative_to(self.cache / self._hash)
                    target.parent.mkdir(parents=True, exist_ok=True)
                    os.link(kept, target)
        try:
            yield
        finally:
            file.write_text(text, encoding="utf-8")
            os.utime(file, ns=(status.st_atime_ns, status.st_mtime_ns))
            _forget_bytecode(file)
            if own.name != self._hash:
                shutil.rmtree(own, ignore_errors=True)

    def run_tests(self, arguments: Sequence[str], limit: float) -> tuple[str, str]:
        """Run pytest in the copy until a test fails: `passed`, `failed` or `endless`, and the test."""
        log = self.tree.parent / "pytest.log"
        plain = ["-x", "-q", "-n0", "-p", "no:cacheprovider", "--no-header", "-rfE", f"--rootdir={self.tree}"]
        unsound = [f"--deselect={test}" for test, sound in self._sound.items() if not sound]
        code = run_pytest([*plain, *unsound, *arguments], self.tree, self.cache, log, limit)
        if code is None:
            return "endless", ""
        if code < 0:
            return "failed", ""
        output = log.read_text(encoding="utf-8", errors="replace")
        # a test's file, its conftest or its parameters, which the mutant breaks
        broken = "found no collectors", "while loading conftest", "no match in any of"
        if code not in {0, 1, 2, 5} and not (code == 4 and any(text in output for text in broken)):
            raise RuntimeError(f"pytest ended with {code}:\n{output[-4000:]}")
        if code in {0, 5}:  # 5: no test was chosen
            return "passed", ""
        found = re.search(r"^(?:FAILED |ERROR |ERROR: not found: .*/tree/)(\S+)", output, re.MULTILINE)
        return "failed", found.group(1) if found else ""


def _forget_bytecode(file: Path) -> None:
    """Two mutants of one second and size would look the same to Python."""
    for kept in (file.parent / "__pycache__").glob(f"{file.stem}.*.pyc"):
        kept.unlink()


def _source_hash(tree: Path) -> str:
    module = _kernel_module()
    module.__file__ = str(tree / "src/vrx_mj/physics/kernel.py")  # beside it are the sources that count
    return str(module.source_hash())


def _kernel_module() -> ModuleType:
    """The checkout's `vrx_mj.physics.kernel`, which knows what the folder of compiled kernels is called."""
    spec = importlib.util.spec_from_file_location("kernels", ROOT / "src/vrx_mj/physics/kernel.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def _stale(tree: Path, mutant: Mutant, text: str) -> set[str]:
    """Modules whose compiled kernels may hold the line that the mutant changes: its own, and those that call it."""
    if not _in_kernel(text, text.count("\n", 0, text.index(mutant.old)) + 1):
        return set()
    sources = {file.stem: file for package in KERNELS for file in (tree / "src/vrx_mj" / package).glob("*.py")}
    needs = {stem: set(_imports(file)) for stem, file in sources.items()}
    stale: set[str] = set()
    found = {Path(mutant.file).stem}
    while found - stale:
        stale |= found
        found = {stem for stem, imported in needs.items() if imported & stale}
    return stale


def _in_kernel(text: str, line: int) -> bool:
    """Whether a line is in a kernel, in a module of intrinsics, or outside of all functions: a constant of one."""
    tree = ast.parse(text)
    around = [
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef) and node.lineno <= line <= (node.end_lineno or 0)
    ]
    return (
        not around
        or "@intrinsic" in text
        or any("kernel" in ast.unparse(mark) for node in around for mark in node.decorator_list)
    )


def _imports(file: Path) -> Iterator[str]:
    kernels = re.compile(rf"vrx_mj\.({'|'.join(KERNELS)})")
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module and kernels.match(node.module):
            yield node.module.rpartition(".")[2]
            yield from (alias.name for alias in node.names)
