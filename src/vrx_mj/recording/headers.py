"""The texts in a recording that are JSON, each read by one schema: wrong kinds are errors that name the key."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import AllowInfNan, FailFast, Field, TypeAdapter, ValidationError

from vrx_mj.config.loading import fault_text
from vrx_mj.config.sensors import sensor_config
from vrx_mj.errors import RecordError
from vrx_mj.recording.record_scene import FORMAT, RecordedSensor, RowLayout

__all__ = ["CompanyHead", "Head", "company_head", "head_of", "sent_messages"]

Finite = Annotated[float, AllowInfNan(False)]


@dataclass(frozen=True)
class Version:
    """Version of a header of any format."""

    format: int


@dataclass(frozen=True)
class Head:
    """Header of a recording: its run, columns and sensors."""

    properties: dict[str, Any]
    timestep: Annotated[float, Field(gt=0.0, le=1.0)]
    """Physics step [s]."""
    wind_direction: tuple[Finite, Finite]
    """Unit vector the wind blows toward, east and north."""
    layout: RowLayout
    """Columns of the rows of the first company."""
    sensors: Annotated[tuple[RecordedSensor, ...], FailFast()] = ()


@dataclass(frozen=True)
class CompanyHead:
    """Header of the boats that sail together from some time on."""

    number: Annotated[int, Field(ge=1, le=1_000_000)]
    layout: RowLayout
    world_sha256: str
    files: Annotated[tuple[str, ...], FailFast()]
    """Names of the files of the saved world."""


Sent = list[tuple[int, list[tuple[str, Any]]]]
"""Numbers of frames, and topic and content of what was sent with each."""

VERSION, HEAD, COMPANY, SENT = (TypeAdapter[Any](kind) for kind in (Version, Head, CompanyHead, Sent))


def head_of(text: str) -> Head:
    """The header of a recording.

    Raises:
        RecordError: it is damaged, or of another version.
    """
    version: Version = checked(VERSION, "head", text)
    if version.format != FORMAT:
        raise RecordError(f"head: format {version.format}; this version reads {FORMAT}")
    head: Head = checked(HEAD, "head", text)
    check_layout("head", head.layout)
    check_sensors(head.sensors)
    return head


def company_head(text: str) -> CompanyHead:
    """The header of the boats that sail together.

    Raises:
        RecordError: it is damaged.
    """
    head: CompanyHead = checked(COMPANY, "companies", text)
    check_layout("companies", head.layout)
    return head


def sent_messages(text: str) -> Sent:
    """What a team sent.

    Raises:
        RecordError: it is damaged.
    """
    sent: Sent = checked(SENT, "sent", text)
    return sent


def checked(schema: TypeAdapter[object], name: str, text: str) -> Any:
    """The values in a JSON text, by its schema.

    Raises:
        RecordError: it does not fit.
    """
    try:
        return schema.validate_json(text, strict=True)
    except ValidationError as error:
        raise RecordError(f"{name}: {fault_text(error)}") from None


def check_layout(name: str, layout: RowLayout) -> None:
    """Check that the bodies of a layout share its columns, one after another.

    Raises:
        RecordError: they do not.
    """
    for key, values in (("bodies", [body.name for body in layout.bodies]), ("thrusters", layout.thrusters)):
        if len(set(values)) < len(values):
            raise RecordError(f"{name}: layout.{key}: two of one name")
    if not all(low >= least for low, least in widths_of(layout)):
        raise RecordError(f"{name}: layout.bodies: their places in qpos and qvel are not those of free joints")


def widths_of(layout: RowLayout) -> Iterator[tuple[int, int]]:
    """How many columns there are for each body in qpos and qvel, and the least; that those begin at 0 is one more."""
    bodies = sorted(layout.bodies, key=lambda body: body.qpos)
    for starts, end, least in (
        ([body.qpos for body in bodies], layout.nq, 7),
        ([body.dof for body in bodies], layout.nv, 6),
    ):
        yield from ((after - start, least) for start, after in zip(starts, [*starts[1:], end], strict=False))
        yield -(starts[0] if starts else end), 0


def check_sensors(sensors: Sequence[RecordedSensor]) -> None:
    """Check what the sensors of a recording are.

    Raises:
        RecordError: two have one name, or a sensor's configuration is invalid, or of another type.
    """
    if len({(one.boat, one.name) for one in sensors}) < len(sensors):
        raise RecordError("head: sensors: two of one name")
    for one in sensors:
        try:
            config = sensor_config({"config": one.config})
        except ValidationError as error:
            raise RecordError(f"head: sensors: {one.boat} {one.name}: {fault_text(error)}") from None
        if config.type != one.type:
            raise RecordError(f"head: sensors: {one.boat} {one.name}: of type {one.type}, configured as {config.type}")
