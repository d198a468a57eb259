"""The largest and smallest numbers that a world's file may give: a run, a diverged one, or an error of ours."""

import contextlib
import importlib
import pkgutil
from typing import Annotated, get_args, get_origin

import pytest
from pydantic.fields import FieldInfo

import vrx_mj
import vrx_mj.config
from vrx_mj.config.base import Config
from vrx_mj.config.values import MAX_NUMBER, MIN_POSITIVE, NumberOf
from vrx_mj.errors import ConfigError, VrxError

FLEET = {"boats": [{"name": "a", "pose": [0, 0, 0.1, 0, 0, 0], "sensors": "none"}]}
SECTIONS = {
    "sea": ["scale", "angle", "steepness", "gain", "amplitude", "period", "tau"],
    "wind": ["direction", "mean_velocity", "var_gain", "var_time"],
    "physics": ["timestep", "gravity"],
    "georeference": ["elevation", "heading"],
}
CASES = [(section, key) for section, keys in SECTIONS.items() for key in keys]
GIVEN = {"georeference": {"latitude": 1.0, "longitude": 2.0}, "sea": {"model": "cwr"}}
WORST = {"sea": {"gain": 0.4}, "wind": {"mean_velocity": 5.0, "var_gain": 2.0}}


@pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
@pytest.mark.parametrize("number", [MAX_NUMBER, -MAX_NUMBER, MIN_POSITIVE, 1e-300, 0.0])
@pytest.mark.parametrize(("section", "key"), CASES)
def test_numbers_of_a_world_run_or_are_refused(section, key, number, tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    values = WORST.get(section, {}) | GIVEN.get(section, {}) | {key: number}
    with contextlib.suppress(VrxError):
        vrx_mj.Simulation(vrx_mj.compile_world({section: values}, fleet=FLEET)).step(duration=0.2)


@pytest.mark.parametrize(
    ("world", "message"),
    [
        ({"sea": {"gain": 1.0e308}}, "<world>: sea.gain: must be at most 1000000000, got 1e+308"),
        (
            {"sea": {"direction": [1.0, -1e10]}},
            "<world>: sea.direction[1]: must be at least -1000000000, got -10000000000",
        ),
        ({"wind": {"var_time": 1e-13}}, "<world>: wind.var_time: must be at least 1e-12, got 1e-13"),
    ],
)
def test_numbers_without_physics_are_refused(world, message):
    with pytest.raises(ConfigError) as raised:
        vrx_mj.compile_world(world)
    assert str(raised.value) == message


def models_of(base):
    for model in base.__subclasses__():
        if model.__module__.startswith(("vrx_mj.config.", "vrx_mj.formats.")):
            yield model
        yield from models_of(model)


def parts_of(mark):
    """The marks that one stands for."""
    return mark.metadata if isinstance(mark, FieldInfo) else mark if isinstance(mark, NumberOf) else [mark]


def numbers_in(annotation, marks=()):
    """Marks of every float in an annotation."""
    if annotation is float:
        yield marks
    own = annotation.__metadata__ if get_origin(annotation) is Annotated else ()
    outer = () if get_origin(annotation) in {tuple, dict} else marks
    for part in get_args(annotation)[: 1 if own else None]:
        yield from numbers_in(part, (*own, *outer))


def limits_of(marks):
    """Limits in marks, as names and numbers."""
    parts = [part for mark in marks for part in parts_of(mark)]
    return {(key, limit) for part in parts for key in ("ge", "gt", "le", "lt")
            if (limit := getattr(part, key, None)) is not None}  # fmt: skip


def numbers_of_files():
    """Model, key and marks of every number of a file."""
    for module in pkgutil.walk_packages(vrx_mj.config.__path__, "vrx_mj.config."):
        importlib.import_module(module.name)
    fields = [(model, *item) for model in models_of(Config) for item in model.model_fields.items()]
    return [(model, name, marks) for model, name, own in fields for marks in numbers_in(own.annotation, own.metadata)]


def test_every_number_of_a_file_has_limits():
    found = numbers_of_files()
    assert len(found) > 500
    for model, name, marks in found:
        given = {key for key, _ in limits_of(marks)}
        assert given & {"ge", "gt"}, f"{model.__name__}.{name} has no lower limit"
        assert given & {"le", "lt"}, f"{model.__name__}.{name} has no upper limit"


def test_a_key_repeats_no_limit_of_the_number_that_it_gives():
    """The dataclass declares the range; a key has narrower limits alone, after it, where they win."""
    found = [(each, marks) for *each, marks in numbers_of_files() if any(isinstance(mark, NumberOf) for mark in marks)]
    assert len(found) > 50
    for each, marks in found:
        declared, own = (limits_of([mark for mark in marks if isinstance(mark, NumberOf) is is_declared])
                         for is_declared in (True, False))  # fmt: skip
        assert not {limit for limit in own & declared if abs(limit[1]) != MAX_NUMBER}, each
        last = dict(limit for mark in marks for limit in sorted(limits_of([mark])))
        for key, limit in own | declared:
            assert last[key] >= limit if key in {"ge", "gt"} else last[key] <= limit, each
