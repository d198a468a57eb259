"""Colours that tell boats apart, in recordings and videos. No rerun."""

from __future__ import annotations

from collections.abc import Iterable

__all__ = ["boat_colors"]

Rgb = tuple[int, int, int]

COLORS: tuple[Rgb, ...] = (
    (255, 177, 61),
    (84, 214, 255),
    (255, 105, 140),
    (140, 232, 120),
    (190, 150, 255),
    (255, 236, 110),
    (40, 180, 160),
    (255, 120, 50),
    (90, 140, 255),
    (235, 120, 235),
    (178, 210, 40),
    (205, 160, 120),
)
"""Colours of boats, distinct on dark blue and on the sea; the first ones differ most."""


def boat_colors(names: Iterable[str]) -> dict[str, Rgb]:
    """A colour for every boat, by the order of the names; the thirteenth has that of the first."""
    return {name: COLORS[i % len(COLORS)] for i, name in enumerate(names)}
