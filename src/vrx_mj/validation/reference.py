"""Tables and meshes of other programs and tanks, in `assets/validation`; each table names its source in its head."""

import csv
from pathlib import Path
from typing import Any

import numpy as np

from vrx_mj.arrays import FloatArray, IntArray
from vrx_mj.resources import root


def folder() -> Path:
    """Where the tables, meshes and worlds of the report are."""
    return root() / "assets" / "validation"


TableRow = dict[str, Any]
"""A row of a table by column: numbers and texts."""


def rows(name: str) -> list[TableRow]:
    """The rows of a table by column; what reads as a number is one."""
    with (folder() / f"{name}.csv").open(encoding="utf-8", newline="") as file:
        found = csv.DictReader(line for line in file if not line.startswith("#"))
        return [{column: _value(text) for column, text in row.items()} for row in found]


def _value(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


def source(name: str) -> str:
    """The head of a table: what made it, and how."""
    text = (folder() / f"{name}.csv").read_text(encoding="utf-8")
    return " ".join(line.lstrip("# ").strip() for line in text.splitlines() if line.startswith("#"))


def mesh(name: str) -> tuple[FloatArray, IntArray]:
    """Vertices (n, 3) [m] and triangles (m, 3) of a hull, counter-clockwise from outside."""
    lines = (folder() / "hulls" / f"{name}.off").read_text(encoding="utf-8").split("\n")
    count, faces, _ = (int(word) for word in lines[1].split())
    vertices = [[float(word) for word in line.split()] for line in lines[2 : 2 + count]]
    triangles = [[int(word) for word in line.split()[1:]] for line in lines[2 + count : 2 + count + faces]]
    return np.array(vertices, np.float64), np.array(triangles, np.int64)
