"""Write docs/formats/*.md from the models that read the files: `python tools/format_pages.py`.

Every key stands there with its type, range, unit, default and meaning, below the head of the page, which is written by
hand. tests/test_docs.py compares the pages with what this writes.
"""

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, get_args, get_origin, get_type_hints

from pydantic import BeforeValidator
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from vrx_mj.config.base import Config, field_docstrings
from vrx_mj.config.docks import LIGHT_COLORS, SHAPES, DockPlacement, LightColor, Pattern, Symbol
from vrx_mj.config.fleet import FleetConfig, Origin
from vrx_mj.config.layouts import Heading
from vrx_mj.config.objects import ObjectConfig, PathConfig
from vrx_mj.config.robots import Arguments, RobotConfig
from vrx_mj.config.shapes import Factor
from vrx_mj.config.tasks import TASKS, Gate, Task
from vrx_mj.config.values import MAX_NUMBER, Color, Coordinate, Name, NumberOf, Pose, Switch
from vrx_mj.config.world import Sensors, WorldConfig
from vrx_mj.formats.parts.compliance import load_rules
from vrx_mj.formats.parts.read import PartType, part_types
from vrx_mj.formats.series.worlds import REQUIRED, macros
from vrx_mj.formats.urdf import gazebo, gazebo_sensors
from vrx_mj.formats.urdf.elements import FIELDS, Entry, Tag, sections
from vrx_mj.tasks import TASK_KINDS

REPO = Path(__file__).resolve().parents[1]
FOLDER = REPO / "docs" / "formats"
SIMPLE = {float: "number", int: "whole number", str: "text", bool: "true or false"}
MARK = "<!-- from here on by tools/format_pages.py -->\n"
HEADER = "| key | type and range | unit | default | meaning |\n|---|---|---|---|---|\n"
FORMS = {"word": "text", "switch": "true or false", "triple": "text of 3 numbers"}
EXTENDS = "| `extends` | text | | | Name or path of another file of this kind, whose keys this file overrides. |\n"
UNIT = re.compile(r"\[((?:degrees|pixels|points|rad|kg|Hz|N|m|s|h|1)(?:[ /,0-9][^\]]*)?)\]")

POSE = "pose [x, y, z, roll, pitch, yaw]"

WORDS: tuple[tuple[Any, str], ...] = (
    (Pose, POSE),
    (Color, "colour"),
    (Name, "name"),
    (Switch, "true or false"),
    (Coordinate, "number"),
    (Symbol, f"symbol, as `red_circle`: {', '.join(LIGHT_COLORS)}; {', '.join(SHAPES)}"),
    (LightColor, "`red`, `green`, `blue`, `yellow` or `off`"),
    (Sensors, "`vrx`, `none`, or list of names"),
    (Origin, "`world`, `spawn`, or [x, y, yaw]"),
    (Heading, "`outward`, `inward`, `tangent`, or number"),
    (Task, "[keys](task.md), by `type`"),
    (Gate, "[left, right], names of buoys"),
    (Arguments, "names and values of xacro arguments"),
    (Pattern, "[first, second, third], each `red`, `green`, `blue`, `yellow` or `off`"),
    (Factor, "number, not 0"),
)
"""Types with words of their own."""

EXAMPLES = {
    "world": "assets/start/world.yaml",
    "fleet": "assets/start/fleet.yaml",
    "object": "assets/start/object.yaml",
    "dock": "assets/start/dock.txt",
    "robot": "assets/robots/skiff/robot.yaml",
    "parts": "assets/start/component_config.yaml",
}
"""Files that the pages show."""


@dataclass
class Writer:
    """Sections of one page, and where each model is described."""

    page: str
    homes: dict[type[Config], str]
    queue: list[tuple[str, type[Config]]] = field(default_factory=list)

    def section(self, title: str, model: type[Config], level: str) -> str:
        """A heading, what the model is, and its table of keys."""
        lines = [f"{level} {title}\n", f"{(model.__doc__ or '').strip()}\n"]
        if kind := TASK_KINDS.get(title.rpartition(", ")[2]):
            lines.append(f"Score: {kind.meaning}.\n")
        return "\n".join(lines) + "\n" + self.table(model, title)

    def table(self, model: type[Config], title: str) -> str:
        """The keys of a model; nested models that nobody describes yet follow."""
        rows = HEADER + (EXTENDS if model in {WorldConfig, FleetConfig, ObjectConfig, RobotConfig} else "")
        hints, docstrings = get_type_hints(model, include_extras=True), field_docstrings(model)
        for key, info in model.model_fields.items():
            if info.exclude:
                continue
            path = key if not title.startswith("`") else f"{title.split('`')[1]}.{key}"
            words = self.words(hints[key], path)
            cells = (f"`{key}`", words, unit(hints[key], docstrings[key]), default(info), meaning(docstrings[key]))
            rows += row(cells)
        return rows + "\n"

    def words(self, hint: Any, path: str) -> str:
        """A type in plain words."""
        known = next((said for kind, said in WORDS if hint == kind), None)
        if known is not None:
            return known
        metadata = getattr(hint, "__metadata__", ())
        if metadata:
            return self._annotated(hint.__origin__, metadata, path)
        if isinstance(hint, type) and issubclass(hint, Config):
            return f"[{alternative(hint) or 'keys'}]({self.link(hint, path)})"
        return SIMPLE[hint] if hint in SIMPLE else self._compound(get_origin(hint), get_args(hint), path)

    def _compound(self, origin: Any, arguments: tuple[Any, ...], path: str) -> str:
        """A type made of others."""
        if origin is Literal:
            return either([f"`{part}`" for part in arguments])
        if origin is tuple and arguments[-1] is Ellipsis:
            return f"list of {self.words(arguments[0], path)}"
        if origin is dict:
            return f"names, each with {self.words(arguments[1], path)}"
        parts = [self.words(part, path) for part in arguments if part is not type(None)]
        if origin is tuple and len(set(parts)) == 1:
            return f"list of {len(parts)}: {parts[0]}"
        return either(list(dict.fromkeys(parts)))

    def _annotated(self, inner: Any, metadata: tuple[Any, ...], path: str) -> str:
        """A type with limits, or of several numbers."""
        labels = next((found for each in metadata if (found := labels_of(each))), None)
        if labels:
            each = {self.words(part, path) for part in get_args(inner)}
            limit = each.pop().removeprefix("number").removeprefix(",") if len(each) == 1 else ""
            return f"[{', '.join(labels)}]" + (f", each {limit.strip()}" if limit else "")
        words = self.words(inner, path)
        ranked = sorted(metadata, key=lambda each: not isinstance(each, NumberOf))  # a key's own limits are narrower
        sides = {limit.startswith(("above", "at least")): limit for each in ranked for limit in limits_of(each)}
        limits = ", ".join(sides[low] for low in (True, False) if low in sides)
        return words + (f", {limits}" if limits and "number, " not in words else "")

    def link(self, model: type[Config], path: str) -> str:
        """Where a model is described; a new one gets a section of this page."""
        if model not in self.homes:
            kind = alternative(model)
            title = f"`{path}` of type {kind}" if kind else f"`{path}`"
            self.homes[model] = f"{self.page}.md#{slug(title)}"
            self.queue.append((title, model))
        page, anchor = self.homes[model].split("#")
        return f"#{anchor}" if page == f"{self.page}.md" else f"{page}#{anchor}"

    def rest(self, level: str) -> Iterator[str]:
        """Sections of the models that the ones above name."""
        while self.queue:
            title, model = self.queue.pop(0)
            yield self.section(title, model, level)


def alternative(model: type[Config]) -> str:
    """The type that chooses a model among several for one key, such as `gps`, or ""."""
    kind = model.model_fields.get("type")
    return f"`{kind.default}`" if kind and get_args(kind.annotation) == (kind.default,) else ""


def either(words: list[str]) -> str:
    """`a`, `b` or `c`."""
    return " or ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def labels_of(validator: Any) -> list[str] | None:
    """The names of the numbers that `numbers` demands."""
    function = getattr(validator, "func", None)
    if not isinstance(validator, BeforeValidator) or "several.<locals>" not in getattr(function, "__qualname__", ""):
        return None
    cells = dict(zip(function.__code__.co_freevars, function.__closure__ or (), strict=True))
    labels = re.search(r"\d numbers \[([^]]*)\]$", cells["form"].cell_contents)
    return labels[1].split(", ") if labels else None


def limits_of(constraint: Any) -> Iterator[str]:
    """Limits of a number in words."""
    if isinstance(constraint, FieldInfo | NumberOf):
        for each in constraint.metadata if isinstance(constraint, FieldInfo) else constraint:
            yield from limits_of(each)
    for name, words in (("gt", "above"), ("ge", "at least"), ("lt", "below"), ("le", "at most")):
        limit = getattr(constraint, name, None)
        if limit is not None and abs(limit) != MAX_NUMBER:  # all numbers have that one
            yield f"{words} {'2^63' if limit == 2**63 else number(limit)}"


def unit(hint: Any, docstring: str) -> str:
    """Units as the docstring gives them in brackets; those of a pose are always the same."""
    found = [part.strip() for text in UNIT.findall(docstring) for part in text.split(",")]
    if not found and Pose in {hint, *get_args(hint)}:
        found = ["m", "rad"]
    return ", ".join(dict.fromkeys(found))


def default(info: FieldInfo) -> str:
    """A default as a file would give it."""
    value = info.default
    if info.is_required():
        return "**required**"
    if value is PydanticUndefined or value is None or isinstance(value, Config):
        return ""
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    if isinstance(value, float | int):
        return f"`{number(value)}`"
    if isinstance(value, tuple):
        return f"`{_list(value)}`"
    return f"`{value}`" if value else ""


def _list(value: object) -> str:
    """Numbers, texts and lists of them as YAML has them."""
    if isinstance(value, tuple):
        return f"[{', '.join(map(_list, value))}]"
    return number(value) if isinstance(value, float) else str(value)


def number(value: float) -> str:
    """A number without a needless point."""
    return f"{value:.6g}"


def meaning(docstring: str) -> str:
    """An attribute's docstring on one line."""
    text = " ".join(docstring.split()).replace("|", "\\|")
    return re.sub(rf" {UNIT.pattern}", "", text) if len(UNIT.findall(text)) == 1 else text


def part_default(value: str | float | bool | None) -> str:
    """The default of a part's parameter."""
    if value is None:
        return "**required**"
    if isinstance(value, bool) or not isinstance(value, float):
        return f"`{str(value).lower() if isinstance(value, bool) else value}`"
    return f"`{number(value)}`"


def row(cells: tuple[str, ...]) -> str:
    """A row of a table."""
    return "|" + "|".join(f" {cell} " if cell else " " for cell in cells) + "|\n"


def slug(title: str) -> str:
    """The anchor of a heading, as mkdocs and GitHub make it."""
    return re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")


def pages() -> dict[str, str]:
    """Contents of all pages, by file name."""
    homes: dict[type[Config], str] = {DockPlacement: "dock.md#keys", PathConfig: "object.md#path"}
    written = {
        "world": model_page("world", homes, WorldConfig),
        "fleet": model_page("fleet", homes, FleetConfig),
        "object": model_page("object", homes, ObjectConfig, ("`path`", PathConfig)),
        "dock": model_page("dock", homes, DockPlacement),
        "task": task_page(homes),
        "robot": model_page("robot", homes, RobotConfig),
        "parts": parts_page(),
        "axes": axes_page(),
        "gazebo": gazebo_page(),
    }
    return {f"{name}.md": text.rstrip("\n") + "\n" for name, text in written.items()}


def model_page(name: str, homes: dict[type[Config], str], root: type[Config], *more: tuple[str, type[Config]]) -> str:
    """A page of a file that one model reads."""
    writer = Writer(name, homes, list(more))
    homes.setdefault(root, f"{name}.md#keys")
    return begin(name) + "## Keys\n\n" + writer.table(root, "Keys") + "".join(writer.rest("##"))


def task_page(homes: dict[type[Config], str]) -> str:
    """The types of tasks; what all of them have comes first."""
    writer = Writer("task", homes)
    text = begin("task")
    for name, model in TASKS.items():
        if model not in homes:
            homes[model] = f"task.md#{slug(name)}"
            names = [one for one in TASKS if TASKS[one] is model]
            text += writer.section(", ".join(names), model, "##")
    return text + "".join(writer.rest("##"))


def parts_page() -> str:
    """Types of thrusters and components with their parameters."""
    rules = load_rules("classic")
    text = begin("parts")
    for kind in ("thrusters", "components"):
        text += f"## {kind.capitalize()}\n\n"
        for part in part_types().values():
            if part.kind == kind:
                allowed = rules.of(kind).types.get(part.name)
                text += part_section(part, allowed.most if allowed else 0, allowed.parameters if allowed else ())
    return text


def part_section(part: PartType, most: int, allowed: tuple[str, ...]) -> str:
    """A type of part."""
    legal = f"A competition allows {most} at most." if most else "No competition allows it."
    text = f"### `{part.name}`\n\n{part.meaning[0].upper()}{part.meaning[1:]}. {legal}\n\n"
    text += "| parameter | type | unit | default | competition | meaning |\n|---|---|---|---|---|---|\n"
    for each in part.parameters:
        release = f" (VRX {each.release} only)" if each.release else ""
        cells = (
            f"`{each.name}`",
            FORMS.get(each.form, each.form),
            each.unit,
            part_default(each.default),
            "yes" if each.name in allowed else "no",
            each.meaning + release,
        )
        text += row(cells)
    return text + "\n"


def axes_page() -> str:
    """Macros with their parameters."""
    text = begin("axes") + "## Macros\n\n| macro | creates | parameters and defaults | XML |\n|---|---|---|---|\n"
    for name, macro in macros().items():
        given = ", ".join(parameter(key, value) for key, value in macro.defaults.items())
        blocks = ", ".join(f"`/**{block}`" for block in macro.blocks)
        text += f"| `{name}` | {macro.part} | {given} | {blocks} |\n"
    return text


RATES = (
    gazebo_sensors.PLUGIN_RATE["path"],
    gazebo_sensors.SENSOR_RATE.path,
    gazebo_sensors.INSTRUMENTS["gz-sim-odometry-publisher-system"].rate["path"],
)
RATE = "|".join(dict.fromkeys(path for ways in RATES for path in ways.split("|")))
TAGS = {
    "Thrusters": {
        "`libusv_gazebo_thrust_plugin.so`, in each `<thruster>`": FIELDS["thruster"],
        "`gz-sim-thruster-system`": FIELDS["newer_thruster"],
    },
    "Water": {
        "`libusv_gazebo_dynamics_plugin.so`": FIELDS["hydrodynamics"],
        "`Surface` of VRX 3, once for each hull": FIELDS["hull"] | FIELDS["water"],
    },
    "Sensors": {
        "all plugins of sensors; `<sensor>`s are on the link of their `<gazebo reference>`": {
            "link": Tag(gazebo_sensors.LINK, ""),
            "topic": Tag(gazebo_sensors.TOPIC, ""),
            "frame": Tag(gazebo_sensors.FRAME, ""),
            "rate": Tag(RATE, 0.0, "Hz", low=0),
        },
        "`<camera>`": FIELDS["camera"],
        "the plugin of a camera": FIELDS["camera_plugin"],
        "`<ray>` or `<lidar>`": FIELDS["lidar"],
        "the plugin of a lidar": FIELDS["lidar_plugin"],
        "`<noise>` of an axis of `<imu>`": FIELDS["bias"],
        "Hector's plugins, after `accel`, `rate`, `yaw`, `tilt` or `velocity`; of a position with a small letter": (
            FIELDS["hector"]
        ),
        "`libgazebo_ros_p3d.so`, `libgazebo_ros_imu.so`, `gz-sim-odometry-publisher-system`": FIELDS["noise"],
        "pingers": FIELDS["pinger"],
        "ball shooters": FIELDS["shooter"],
    },
}
"""Tables of tags, by what they are in."""
NOT_DONE = (gazebo.SPEEDS, gazebo.CURRENT, *gazebo_sensors.LENS, *gazebo_sensors.OFFSETS)


def gazebo_page() -> str:
    """Tags of plugins and sensors."""
    text = begin("gazebo")
    for title, tables in TAGS.items():
        text += f"## {title}\n\n"
        for place, rows in tables.items():
            text += f"In {place}:\n\n| tag | field | unit | default | range |\n|---|---|---|---|---|\n"
            text += "".join(tag_row(field, tag) for field, tag in rows.items()) + "\n"
    kinds = gazebo_sensors.INSTRUMENTS | {
        f'<sensor type="{name}">': kind for name, kind in gazebo_sensors.SENSORS.items()
    }
    text += "## Which are sensors\n\n| plugin or sensor | here | topic without one |\n|---|---|---|\n"
    for name, kind in kinds.items():
        text += row((f"`{name}`", f"`{kind.type}`", f"`{kind.topic.format(kind.own or 'NAME')}`"))
    quiet = ", ".join(f"`{name}`" for name in sorted(gazebo.QUIET_PLUGINS))
    text += f"\n## Read without a message\n\n{quiet}\n\n## Not simulated\n\n| tag | warning |\n|---|---|\n"
    text += "".join(row((f"`{tag.path}`", words.format(tag.path))) for tag, words in NOT_DONE)
    return text + elements_of_sdf()


def elements_of_sdf() -> str:
    """All elements and attributes of SDF and URDF, with what each is."""
    text = "\n## All elements and attributes\n\n| in | element, or @attribute | where | here |\n|---|---|---|---|\n"
    for section, paths in sections().items():
        grouped: dict[tuple[str, str], list[str]] = {}
        for path, entries in paths.items():
            for where, said in fates_of(entries):
                grouped.setdefault((where, said), []).append(path)
        for (where, said), names in grouped.items():
            text += row((f"`<{section}>`", ", ".join(f"`{name}`" for name in names), where, said))
    return text


def fates_of(entries: Mapping[str, Entry]) -> Iterator[tuple[str, str]]:
    """What an element is, and in boats, objects or worlds where it is another in others."""
    fates = {side: fate_of(entry) for side, entry in entries.items()}
    for said in dict.fromkeys(fates.values()):
        yield "" if len(set(fates.values())) == 1 else ", ".join(side for side in fates if fates[side] == said), said


def fate_of(entry: Entry) -> str:
    """What an element is, in words."""
    usual = f" (not `{entry.usual}`)" if entry.usual not in {None, "", "inf"} and entry.fate == "lost" else ""
    return f"{entry.fate}{f': {entry.words}' if entry.words else ''}{usual}"


def tag_row(field: str, tag: Tag) -> str:
    """A tag of a table."""
    paths = " or ".join(f"`{path.replace('/', ' / ')}`" for path in tag.path.split("|"))
    limits = ((tag.above, "above"), (tag.low, "at least"), (tag.high, "at most"))
    allowed = ", ".join(f"{words} {number(limit)}" for limit, words in limits if math.isfinite(limit))
    default = " ".join(map(number, tag.default)) if isinstance(tag.default, tuple) else tag_default(tag.default)
    return row((paths, f"`{field}`", tag.unit, default, allowed))


def tag_default(value: Any) -> str:
    """A default that is one value; that of what narrows is none."""
    if isinstance(value, bool | str):
        return f"`{str(value).lower()}`" if value != "" else ""
    return number(float(value)) if math.isfinite(value) else ""


def parameter(key: str, value: Any) -> str:
    """A parameter of a macro with its default."""
    if value is REQUIRED:
        return f"`{key}` (required)"
    return f"`{key}`" if value == "" else f"`{key}: {number(value) if isinstance(value, float) else value}`"


def begin(name: str) -> str:
    """The head of a page, which is kept, and its example."""
    head, mark, _ = (FOLDER / f"{name}.md").read_text(encoding="utf-8").partition(MARK)
    if not mark:
        raise ValueError(f"docs/formats/{name}.md lacks the line {MARK}")
    if name not in EXAMPLES:
        return f"{head}{mark}\n"
    content = (REPO / EXAMPLES[name]).read_text(encoding="utf-8").rstrip("\n")
    kind = "yaml" if EXAMPLES[name].endswith(".yaml") else "text"
    return f"{head}{mark}\n## Example\n\n```{kind}\n{content}\n```\n\n"


if __name__ == "__main__":
    for page, content in pages().items():
        (FOLDER / page).write_text(content, encoding="utf-8", newline="\n")
