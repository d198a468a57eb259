"""Boats, objects and docks that come and go: the part of a `Simulation` that changes what is in its world."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from vrx_mj.mjcf.joining import with_boat, with_dock, with_object
from vrx_mj.runtime.spawning import Spawning
from vrx_mj.runtime.turns import Turn, in_turn


class Roster:
    """What is in a world while it runs."""

    _spawning: Spawning
    _turn: Turn

    @in_turn
    def spawn(
        self,
        name: str,
        *,
        pose: Sequence[float],
        robot: str | Path | None = None,
        thrusters: str | Path | None = None,
        components: str | Path | None = None,
        sensors: str | Sequence[str] | None = None,
        engines: str = "fixed",
        color: Sequence[float] | None = None,
    ) -> None:
        """Add a boat at rest to the run. The others move exactly as without it, until they touch it.

        It stays until it is removed or the run is reset. `sim.model`, `sim.data` and `sim.world` are new objects
        afterwards; `sim.sea`, `sim.wind`, subscriptions and commands are kept. If a removed boat had the same name,
        the sensors of the new boat have different noise.

        Args:
            name: name of the boat; nothing else in the world has it.
            pose: (x, y, z, roll, pitch, yaw) of its `base_link` origin [m, rad, ENU].
            robot: name or path of the robot; by default that of the world's spawn. With an absolute `Path`, the other
                paths are relative to its folder.
            thrusters: name of a layout, or a thruster file of VRX; by default that of the world's spawn.
            components: a component file of VRX.
            sensors: `vrx`, `none`, or names of suites or sensors; by default as in a fleet file.
            engines: `fixed` or `hinged`.
            color: red, green, blue and alpha of the hull, 0 to 1.

        Raises:
            ConfigError: an argument is invalid, or the robot does not exist.
            CommandError: the name or the place is taken, or the simulation is advancing.
            CompileError: the boat cannot be built.
        """
        paths = {"robot": robot, "thrusters": thrusters, "components": components}
        files = {key: path for key, path in paths.items() if path is not None}
        entry = {"name": name, "pose": pose, "sensors": sensors, "engines": engines, "color": color}
        self._spawning.add("spawn", with_boat, files, **entry)

    @in_turn
    def spawn_object(
        self,
        name: str,
        *,
        model: str | Path,
        pose: Sequence[float],
        path: Mapping[str, object] | None = None,
        symbols: Sequence[str] | None = None,
    ) -> None:
        """Add an object at rest to the run, as one of a world file's `objects`. All else moves exactly as without it.

        It stays until it is removed or the run is reset; `sim.model`, `sim.data` and `sim.world` are new objects
        afterwards, as after `spawn`. It floats where the water is now. One that is made of others joins with all of
        them, as `name/red_0`.

        Args:
            name: name of the object; nothing else in the world has it.
            model: name from `vrx-mj list objects`, `model://NAME` of Gazebo, or the path of a YAML or SDF file, from
                the current folder.
            pose: (x, y, z, roll, pitch, yaw) of its link's origin [m, rad, ENU].
            path: along which it swims, with the keys of `path` in an object's file; by default its model's own.
            symbols: that the placards of its docks show at the start.

        Raises:
            ConfigError: an argument is invalid, or the model does not exist.
            CommandError: the name or the place is taken, or the simulation is advancing.
        """
        entry = {"name": name, "pose": pose, "path": path, "symbols": symbols}
        self._spawning.add("spawn_object", with_object, {"model": model}, **entry)

    @in_turn
    def spawn_dock(
        self,
        name: str,
        *,
        layout: str | Path | Sequence[str],
        pose: Sequence[float],
        dynamic: bool = False,
        block: float = 2.0,
        mooring: Mapping[str, object] | None = None,
        bays: Sequence[Mapping[str, object]] | None = None,
        symbols: Sequence[str] | None = None,
    ) -> None:
        """Add a dock at rest to the run, as one of a world file's `docks`; else as `spawn_object`.

        Args:
            name: name of the dock; nothing else in the world has it.
            layout: rows of X and blanks, as text or a list; a name from `vrx-mj list docks`; or the path of a file.
            pose: (x, y, z, roll, pitch, yaw) of the middle of the drawing's first cell [m, rad, ENU].
            dynamic: whether it floats.
            block: edge of a block [m], from 0.5 to 2.
            mooring: what holds a floating dock, with the keys of `mooring` in a world file.
            bays: what is known of its bays, with the keys of `bays` in a world file.
            symbols: that its placards show at the start.

        Raises:
            ConfigError: an argument is invalid, or the layout does not exist.
            CommandError: the name or the place is taken, or the simulation is advancing.
        """
        rows = layout.as_posix() if isinstance(layout, Path) else layout
        entry = {"name": name, "layout": rows, "pose": pose, "dynamic": dynamic, "block": block}
        self._spawning.add("spawn_dock", with_dock, {}, mooring=mooring, bays=bays, symbols=symbols, **entry)

    @in_turn
    def remove(self, name: str) -> None:
        """Remove a boat, an object or a dock from the run. All else moves exactly as before.

        Subscriptions to the sensors of a boat that is removed end. An object goes with all that it is made of.

        Raises:
            UnknownNameError: nothing has that name.
            CommandError: the task scores this boat or refers to this object or dock, it is a part of another object,
                or the simulation is advancing.
        """
        self._spawning.remove(name)
