"""The example notebook: what is stored is whole and small, and a kernel that runs it shows the same kinds."""

import ast
import json
from pathlib import Path

import pytest

from vrx_command import environment

NOTEBOOK = Path(__file__).parents[2] / "examples" / "waves_thrust_stationkeeping.ipynb"
LARGEST = 1_000_000
"""Bytes: figures are small, and no recording is stored."""


@pytest.fixture(scope="module")
def stored():
    return json.loads(NOTEBOOK.read_text(encoding="utf-8"))


def code_cells(notebook):
    return [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]


def kinds(cell):
    """What a cell shows: names of streams, and the forms of each output."""
    return [
        output["output_type"] if output["output_type"] in {"stream", "error"} else sorted(output["data"])
        for output in cell["outputs"]
        if output.get("name") != "stderr"
    ]


def test_what_is_stored_is_small_and_was_run_in_order(stored):
    assert NOTEBOOK.stat().st_size < LARGEST
    assert [cell["execution_count"] for cell in code_cells(stored)] == list(range(1, len(code_cells(stored)) + 1))
    assert not [kind for cell in code_cells(stored) for kind in kinds(cell) if kind == "error"]


def test_its_code_compiles(stored):
    for cell in code_cells(stored):
        ast.parse("".join(cell["source"]).removeprefix("%matplotlib inline\n"))


@pytest.mark.slow
def test_a_kernel_shows_what_is_stored(stored, tmp_path, monkeypatch):
    import nbclient
    import nbformat

    for name, value in environment().items():
        monkeypatch.setenv(name, value)
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path))
    monkeypatch.setenv("JUPYTER_PREFER_ENV_PATH", "1")
    fresh = nbformat.read(NOTEBOOK, as_version=4)
    where = {"metadata": {"path": str(tmp_path)}}
    nbclient.NotebookClient(fresh, timeout=300, resources=where, coalesce_streams=True).execute()
    assert [kinds(cell) for cell in code_cells(fresh)] == [kinds(cell) for cell in code_cells(stored)]
    assert Path(tmp_path / "stationkeeping.rrd").stat().st_size > 100_000
