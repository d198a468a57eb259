"""Compiled worlds from texts and trees: whole ones, and parameters of which a test gives only what it looks at."""

import json
from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass
from functools import cache
from types import NoneType, UnionType
from typing import Union, get_args, get_origin, get_type_hints

from vrx_mj.mjcf.pieces import Piece, Pieces
from vrx_mj.mjcf.world import World
from vrx_mj.model.world import Parameters, parameters_of

hints_of = cache(get_type_hints)


def make_world(mjcf, assets, parameters):
    """The world of an MJCF that is one piece."""
    return World(Pieces(Piece(mjcf, assets)), parameters)


def typed(tree):
    """The parameters that a whole tree stands for, checked."""
    return parameters_of(json.dumps(dict(tree)).encode())


def partial(tree, kind=Parameters):
    """A dataclass of the model with the fields that a tree gives, and defaults; others raise an AttributeError."""
    hints, made = hints_of(kind), object.__new__(kind)
    for own in fields(kind):
        if own.name in tree:
            object.__setattr__(made, own.name, _as(hints[own.name], tree[own.name]))
        elif own.default_factory is not MISSING:
            object.__setattr__(made, own.name, own.default_factory())
        elif own.default is not MISSING:
            object.__setattr__(made, own.name, own.default)
    return made


def task_of(tree):
    """A task of the type that a tree has, as `partial`."""
    return _as(hints_of(Parameters)["task"], tree)


def _as(hint, value):
    """A value of a tree as a field of this type has it."""
    origin, inside = get_origin(hint), get_args(hint)
    if origin in (Union, UnionType):
        kinds = [kind for kind in inside if is_dataclass(kind)]
        typed = [
            kind
            for kind in kinds
            if isinstance(value, Mapping) and value.get("type") in get_args(hints_of(kind).get("type"))
        ]
        others = [kind for kind in inside if kind is not NoneType]
        return None if value is None else _as((typed or others)[0], value)
    if origin is tuple:
        kinds = inside[:1] * len(value) if ... in inside else inside
        return tuple(_as(kind, item) for kind, item in zip(kinds, value, strict=True))
    return partial(value, hint) if is_dataclass(hint) and isinstance(value, Mapping) else value
