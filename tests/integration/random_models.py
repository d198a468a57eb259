"""Random models of Gazebo: frames, nesting, merging, placement, automatic and turned inertia, poses in each form."""

import math
import random
from pathlib import Path

WATER = (
    '<plugin filename="libbuoyancy_gazebo_plugin.so" name="w"><buoyancy><link_name>{}</link_name><geometry><box>'
    "<size>9 9 9</size></box></geometry></buoyancy></plugin>"
)
SIZES = {
    "box": ("size", 3),
    "sphere": ("radius", 1),
    "cylinder": ("radius length", 2),
    "capsule": ("radius length", 2),
    "ellipsoid": ("radii", 3),
}


class Models:
    """A model in a folder `top`, and those that it includes beside it; the same for the same seed."""

    def __init__(self, seed: int, folder: Path) -> None:
        self.random = random.Random(seed)
        self.folder = folder
        self.count = 0
        self.version = self.random.choice(["1.8", "1.9", "1.10", "1.11"])
        self.merged: set[str] = set()
        self.library: list[tuple[str, list[str]]] = []
        for _ in range(self.random.randrange(3)):
            self.library.append(self.included())

    def new(self, kind: str) -> str:
        """A name that no other has."""
        self.count += 1
        return f"{kind}{self.count}"

    def number(self, reach: float = 2.0) -> float:
        return round(self.random.uniform(-reach, reach), 6)

    def pose(self, frames: list[str], odds: float = 0.8) -> str:
        """A `<pose>` in one of its forms, in one of some frames; or none."""
        if self.random.random() > odds:
            return ""
        frame = self.random.choice(["", *frames])
        attributes = f' relative_to="{frame}"' if frame else ""
        place = [self.number() for _ in range(3)]
        form = self.random.randrange(4)
        if form == 0:
            length = math.hypot(*(turn := [self.random.gauss(0, 1) for _ in range(4)]))
            turn = [value / length for value in turn]
            attributes += ' rotation_format="quat_xyzw"'
        elif form == 1:
            turn = [self.number(170.0) for _ in range(3)]
            attributes += ' degrees="true"'
        else:
            turn = [self.number(1.5) for _ in range(3)]
        return f"<pose{attributes}>{' '.join(f'{value:.17g}' for value in (*place, *turn))}</pose>"

    def collision(self, frames: list[str]) -> str:
        shape = self.random.choice([*SIZES])
        tag, count = SIZES[shape]
        numbers = [f"{self.random.uniform(0.2, 1.5):.6f}" for _ in range(count)]
        rows = dict(zip(tag.split(), numbers, strict=True)) if " " in tag else {tag: " ".join(numbers)}
        sizes = "".join(f"<{key}>{value}</{key}>" for key, value in rows.items())
        density = self.random.choice(["", f"<density>{self.random.uniform(100, 3000):.3f}</density>"])
        return (
            f'<collision name="{self.new("c")}">{self.pose(frames, 0.7)}{density}<geometry><{shape}>{sizes}</{shape}>'
            "</geometry></collision>"
        )

    def inertial(self, frames: list[str]) -> str:
        """Given, turned, or by the collisions; or none."""
        form = self.random.randrange(8)
        if form == 0:
            return ""
        if form < 3 and self.version == "1.11":
            density = self.random.choice(["", f"<density>{self.random.uniform(100, 3000):.3f}</density>"])
            shapes = "".join(self.collision(frames) for _ in range(self.random.randrange(1, 4)))
            return f'<inertial auto="true">{density}</inertial>{shapes}'
        a, b, c = (self.random.uniform(0.5, 2.0) for _ in range(3))
        mass, products = self.random.uniform(1, 20), [self.number(0.1) for _ in range(3)]
        tensor = zip(("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), (b + c, a + c, a + b, *products), strict=True)
        rows = "".join(f"<{key}>{value:.9f}</{key}>" for key, value in tensor)
        return f"<inertial>{self.pose([], 0.8)}<mass>{mass:.6f}</mass><inertia>{rows}</inertia></inertial>"

    def included(self) -> tuple[str, list[str]]:
        """The name of a model of its own folder, and the frames in it that can be placed."""
        name = self.new("inc")
        text, root, frames = self.model(name, depth=1)
        self.write(name, text)
        return name, [root, *frames]

    def write(self, name: str, model: str) -> None:
        folder = self.folder / name
        folder.mkdir(parents=True)
        config = f'<model><name>{name}</name><sdf version="{self.version}">model.sdf</sdf></model>'
        (folder / "model.config").write_text(config, encoding="utf-8")
        text = f'<sdf version="{self.version}">{model}</sdf>'
        (folder / "model.sdf").write_text(text, encoding="utf-8")

    def model(self, name: str, depth: int, more: str = "") -> tuple[str, str, list[str]]:
        """The text of a model, its root link, and its frames. All its links hang on the first one."""
        root = self.new("l")
        around, held, parts, waiting = ["__model__"], [root], [], []
        for link in (root, *(self.new("l") for _ in range(self.random.randrange(3)))):
            place = self.pose(around)
            frames = around[1:] if depth else around  # in a merged model libsdformat takes another __model__ for shapes
            parts.append(f'<link name="{link}">{place}{self.inertial([link, *frames])}</link>')
            around.append(link)
            waiting += [link] if link != root else []
        own = []
        for _ in range(self.random.randrange(3)):
            frame, on = self.new("f"), self.random.choice(["", *around])
            attached = f' attached_to="{on}"' if on else ""
            parts.append(f'<frame name="{frame}"{attached}>{self.pose(around)}</frame>')
            own.append(frame)
        around += own
        for _ in range(self.random.randrange(3) if depth < 2 else 0):
            part, child = self.nested(around, depth)
            parts.append(part)
            waiting.append(child)
            around.append(child)
        for child in waiting:
            parts.append(self.joint(self.random.choice([*held, "__model__"]), child, around))
            held.append(child)
        self.random.shuffle(parts) if more == "" else None
        first = next(part for part in parts if part.startswith(f'<link name="{root}"'))
        parts.remove(first)  # the canonical link is the first
        placed = self.random.choice(["", f' placement_frame="{self.random.choice([root, *own])}"'])
        return f'<model name="{name}"{placed}>{self.pose([])}{first}{"".join(parts)}{more}</model>', root, own

    def nested(self, around: list[str], depth: int) -> tuple[str, str]:
        """A model in a model, written there or included, and its root link."""
        name = self.new("m")
        if not self.library or self.random.random() < 0.4:
            text, root, _ = self.model(name, depth + 1)
            return text, f"{name}::{root}"
        uri, frames = self.random.choice(self.library)
        placed = self.random.choice(["", f"<placement_frame>{self.random.choice(frames)}</placement_frame>"])
        pose = self.pose(around) if not placed else self.pose(around, 1.0)
        merge = self.random.random() < 0.4 and uri not in self.merged
        attribute = ' merge="true"' if merge else ""
        self.merged |= {uri} if merge else set()
        text = f"<include{attribute}><uri>model://{uri}</uri><name>{name}</name>{pose}{placed}</include>"
        return text, frames[0] if merge else f"{name}::{frames[0]}"

    def joint(self, parent: str, child: str, around: list[str]) -> str:
        kind = self.random.choice(["fixed", "revolute", "prismatic", "continuous"])
        axis = ""
        if kind != "fixed":
            frame = self.random.choice(["", *around])
            attribute = f' expressed_in="{frame}"' if frame else ""
            values = " ".join(f"{self.random.choice([-1, 1]) * self.random.uniform(0.2, 1):.6f}" for _ in range(3))
            axis = f"<axis><xyz{attribute}>{values}</xyz></axis>"
        pose = self.pose(around)
        name = self.new("j")
        return f'<joint name="{name}" type="{kind}">{pose}<parent>{parent}</parent><child>{child}</child>{axis}</joint>'


def write_models(seed: int, folder: Path) -> Path:
    """The file of a random model below a folder, with all that it includes; it floats, as an object."""
    models = Models(seed, folder)
    text, root, _ = models.model("top", depth=0, more=" ")
    models.write("top", text.replace(" </model>", f"{WATER.format(root)}</model>"))
    return folder / "top" / "model.sdf"
