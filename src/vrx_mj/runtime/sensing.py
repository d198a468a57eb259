"""What boats sense: readings made when they are asked for, from the moments that the sensors' clocks caught.

A reading is a function of its moment, the moment before it, the run's seed and the moment's number: how often sensors
are read changes neither the motion nor any reading. Only a first reading depends on when it is asked for: it
is of that moment, and from then on sensors of the same rate have moments.

A world's lights and placards are here as well: what they show, and what they are made to show.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from vrx_mj.arguments import Names, as_numbers, check_kind, check_name
from vrx_mj.arrays import FloatArray
from vrx_mj.config.docks import LIGHT_COLORS, OFF, SYMBOLS
from vrx_mj.config.sensors import LidarConfig
from vrx_mj.errors import CommandError, SensorError, quote
from vrx_mj.mjcf.world import World
from vrx_mj.model.things import Georeference
from vrx_mj.physics.kernel import is_cached
from vrx_mj.physics.surface import draw_surface
from vrx_mj.runtime.loop import MAX_STATE
from vrx_mj.runtime.loop_arrays import LoopArrays
from vrx_mj.runtime.mounted import Mounted
from vrx_mj.runtime.run_lock import RunLock, with_run_lock
from vrx_mj.runtime.timing import Moment
from vrx_mj.runtime.warmup import compile_notice
from vrx_mj.runtime.weather import Sea, Wind
from vrx_mj.sensors.camera import Cameras
from vrx_mj.sensors.displays import Display, new_pattern, next_pattern, next_symbol, symbol_mark
from vrx_mj.sensors.instruments import Draw, apparent_wind, beam, bottom_distance
from vrx_mj.sensors.lidar import Lidar, Water, cast_at_sea, noisy
from vrx_mj.sensors.rays import cast
from vrx_mj.sensors.readings import Image, Mount, Place, PointCloud, Reading, Scan
from vrx_mj.sensors.view import Labeller

_SEA_COMPILING = ("the sea's pictures", 8)
"""Name of what cameras compile, and about how long that takes [s]."""
_STILL_SHOT_PROFILES = ("vrx", "vrx3")
"""Profiles of physics in which a ball leaves the shooter without the boat's velocity."""
_Drawing = Callable[[], mujoco.MjModel]
_BASE_MOUNT = Mount.of((0.0, 0.0, 0.0), ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)))
"""Mount at `base_link` itself."""


class Sights:
    """The cameras and lidars of a run; the drawing model is made for the first that is used."""

    def __init__(self, world: World, arrays: LoopArrays, drawing: _Drawing) -> None:
        self._world, self._arrays, self._drawing = world, arrays, drawing
        self._data: mujoco.MjData | None = None
        self._cameras: Cameras | None = None
        self._labeller: Labeller | None = None
        self._lidars: dict[tuple[str, str], Lidar] = {}

    def image(self, sensor: Mounted, now: Moment, draw: Draw) -> Image:
        """The picture of a camera, with labels if its configuration asks for them."""
        model = self._drawing()
        if self._cameras is None:
            self._cameras = Cameras(model, self._world.parameters)
        place = sensor.place(now.qpos, now.qvel)
        data = self._scene(model, now)
        if self._arrays.displays:
            self._cameras.paint(
                display_colors(model, self._arrays.displays, self._arrays.display_part(now.device_state), now.time)
            )
        at = place.position, place.rotation, now.time
        self._cameras.set_sea(self._arrays.waves)
        with compile_notice(draw_surface, *_SEA_COMPILING):
            image = self._cameras.image(sensor.config, data, *at, draw.key, draw.index)
        if not sensor.config.labels:
            return image
        if self._labeller is None:
            self._labeller = Labeller(model, self._world.parameters)
        return replace(image, labels=self._labeller(self._cameras.seen_geoms(sensor.config), sensor.boat))

    def scan(self, sensor: Mounted, now: Moment, draw: Draw) -> PointCloud | Scan:
        """The scan of a lidar."""
        water = Water(self._arrays.waves, self._arrays.sea, now.time) if sensor.config.sea_returns else None
        lidar = self._lidar(sensor, sensor.config)
        with compile_notice(cast, "the lidar", 8):
            return lidar.scan(self._scene(self._drawing(), now), draw.key, draw.index, water)

    def echo(self, sensor: Mounted, now: Moment) -> float:
        """How far along an echo sounder's beam the bottom is, or what is in the way but its own boat [m]; else inf."""
        lidar = self._lidar(sensor, beam(sensor.config), own=False)
        with compile_notice(cast, "the echo sounder", 8):
            met = float(lidar.ranges(self._scene(self._drawing(), now))[0])
        sea = self._world.parameters.sea
        return min(met, bottom_distance(sensor.place(now.qpos, now.qvel), sea.level, sea.depth))

    def _lidar(self, sensor: Mounted, config: LidarConfig, *, own: bool = True) -> Lidar:
        """A sensor's rays, which meet its own boat or do not."""
        key = sensor.boat, sensor.name
        if key not in self._lidars:
            model, mount = self._drawing(), sensor.mount
            body = int(model.body(sensor.body).id)
            self._lidars[key] = Lidar(model, config, body, mount.position, mount.rotation, own=own)
        return self._lidars[key]

    def compile(self, sensors: Sequence[Mounted], now: Moment) -> None:
        """Compile the kernels that cameras and lidars need, if they are not compiled yet; `now` is any moment.

        What is cached is left for the first reading to load, in a fraction of a second.
        """
        if any(sensor.config.type == "camera" for sensor in sensors) and not is_cached(draw_surface):
            with compile_notice(draw_surface, *_SEA_COMPILING):
                Cameras(self._drawing(), self._world.parameters).compile()
        lidars = (sensor for sensor in sensors if sensor.config.type == "lidar")
        for sea, sensor in {sensor.config.sea_returns: sensor for sensor in lidars}.items():
            if not (is_cached(cast) and is_cached(noisy) and (is_cached(cast_at_sea) or not sea)):
                self.scan(sensor, now, Draw(0, sensor.boat, sensor.name, 0, sensor.config.rate))
        for sensor in sensors:
            if sensor.config.type == "echo_sounder" and not is_cached(cast):
                self.echo(sensor, now)

    def _scene(self, model: mujoco.MjModel, now: Moment) -> mujoco.MjData:
        """Where everything was at a moment."""
        if self._data is None:
            self._data = mujoco.MjData(model)
        self._data.qpos[:] = now.qpos
        mujoco.mj_kinematics(model, self._data)
        return self._data


def display_colors(
    model: mujoco.MjModel, displays: Sequence[Display], marks: FloatArray, time: float
) -> dict[int, tuple[float, ...]]:
    """Colours of lights and placards by the numbers of their geoms in a model, by their marks at a time [s]."""
    now = np.array([time])
    colors: dict[int, tuple[float, ...]] = {}
    for display in displays:
        parts = display.colors(int(display.codes(marks[None], now)[0]))
        colors |= {int(model.geom(name).id): parts[part] for part in parts for name in display.parts[part]}
    return colors


_Floats = npt.NDArray[np.float64]


class Readings(Mapping[str, Reading]):
    """The readings of a boat by sensor, each made when it is looked up: what is not asked for costs nothing.

    A copy, also one that was pickled, holds the readings that the run had made by then, and makes none.
    """

    def __init__(
        self, names: Sequence[str], read: Callable[[str], Reading], made: Callable[[], Mapping[str, Reading]]
    ) -> None:
        """Readings of these sensors, by `read`; `made` gives those that there are."""
        self._names = tuple(names)
        self._read, self._made = read, made

    def __reduce__(self) -> tuple[Callable[..., "Readings"], tuple[Names, dict[str, Reading]]]:
        return _copied_readings, (self._names, dict(self._made()))

    def __getitem__(self, name: str) -> Reading:
        return self._read(name)

    def __contains__(self, name: object) -> bool:
        return name in self._names

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    def get(self, name: str, default: Any = None) -> Any:
        """The reading of a sensor, or `default` without such a sensor."""
        return self._read(name) if name in self._names else default


def _copied_readings(names: Names, made: dict[str, Reading]) -> Readings:
    """Readings that were copied."""

    def read(name: str) -> Reading:
        check_name("sensor", name, names)
        if name not in made:
            raise SensorError(f"no reading of {name} in a copied observation: read it before copying")
        return made[name]

    return Readings(names, read, lambda: made)


class Sensing:
    """The sensors of all boats of a run."""

    def __init__(
        self,
        world: World,
        arrays: LoopArrays,
        wind: Wind,
        drawing: _Drawing,
        rebound: Callable[[], None],
        run_lock: RunLock,
    ) -> None:
        """Sensors of loop arrays.

        Args:
            world: what they are in.
            arrays: whose moments they see.
            wind: that they feel.
            drawing: gives the model that cameras and lidars see.
            rebound: is called when the loop's arrays of moments are new ones.
            run_lock: that of the run; a reading is of one moment.
        """
        self.wind, self._rebound, self._run_lock = wind, rebound, run_lock
        self._seed = 0
        self._kept: dict[tuple[str, str], Reading] = {}
        self.bind(world, arrays, drawing)

    def bind(self, world: World, arrays: LoopArrays, drawing: _Drawing) -> None:
        """Go on in a world in which boats have come or gone; readings of those who stay are still theirs."""
        self.world, self.arrays = world, arrays
        self.sights = Sights(world, arrays, drawing)
        self.earth = world.parameters.georeference
        self._at_base = frozenset(world.parameters.at_base_link)
        self._boats: dict[str, dict[str, Mounted]] = {boat: {} for boat in world.boats}
        for sensor in arrays.sensors:
            self._boats[sensor.boat][sensor.name] = sensor
        self._kept = {key: reading for key, reading in self._kept.items() if key[0] in self._boats}

    def names(self, boat: str) -> Names:
        """Names of a boat's sensors.

        Raises:
            UnknownNameError: no boat has that name.
        """
        return tuple(self._of(boat))

    def begin(self, seed: int) -> None:
        """The state was set, by a reset or from a saved one."""
        self._seed = seed
        self._kept.clear()

    def renew(self) -> None:
        """Latch moments of the present time again, after something was moved by hand."""
        self.arrays.sample_clocks.renew(self.arrays.data.qpos, self.arrays.data.qvel, self.arrays.data.time)
        self._kept.clear()

    def readings(self, boat: str) -> Readings:
        """Readings of a boat's sensors by name.

        Raises:
            UnknownNameError: no boat has that name.
        """
        return Readings(self.names(boat), partial(self.sense, boat), partial(self._readings_of, boat))

    @with_run_lock
    def sense(self, boat: str, name: str) -> Reading:
        """Last reading of a sensor, for any thread; CommandError while another advances, else as `read`."""
        return self.read(boat, name)

    def compile(self) -> None:
        """Compile the kernels that the boats' cameras and lidars need; nothing is measured."""
        data, marks = self.arrays.data, self.arrays.sample_clocks.device_state
        self.sights.compile(self.arrays.sensors, Moment(0, float(data.time), data.qpos, data.qvel, marks))

    def read(self, boat: str, name: str) -> Reading:
        """Last reading of a sensor; the same object until it measures again.

        Raises:
            UnknownNameError: no such boat, or no such sensor on it.
        """
        sensor = self._find(boat, name)
        now, before = self._last_moments(sensor.config.rate)
        kept = self._kept.get((boat, name))
        if kept is not None and kept.time == now.time:
            return kept
        reading = self._kept[boat, name] = self._reading(sensor, now, before)
        return reading

    def labelled_image(self, boat: str, name: str) -> Reading:
        """The last picture of a camera, with labels whether or not its configuration asks for them.

        Raises:
            UnknownNameError: no such boat, or no such camera on it.
        """
        sensor = self._find(boat, name, "camera")
        sensor = replace(sensor, config=sensor.config.model_copy(update={"labels": True}))
        return self._reading(sensor, *self._last_moments(sensor.config.rate))

    def of_kind(self, boat: str, kind: str) -> dict[str, Mounted]:
        """A boat's sensors of a kind, by name.

        Raises:
            UnknownNameError: no boat has that name.
        """
        return {name: sensor for name, sensor in self._of(boat).items() if sensor.config.type == kind}

    def beacon(self, boat: str, name: str) -> tuple[float, float, float]:
        """Where the beacon that a receiver hears is [m, ENU].

        Raises:
            UnknownNameError: no such boat, or no such receiver on it.
        """
        sensor = self._find(boat, name, "pinger")
        x, y, z = self.arrays.sample_clocks.device_state[sensor.marks]
        return float(x), float(y), float(z)

    def set_beacon(self, boat: str, name: str, position: Sequence[float]) -> None:
        """Put the beacon that a receiver hears somewhere [m, ENU].

        Raises:
            UnknownNameError: no such boat, or no such receiver on it.
            CommandError: not three finite numbers.
        """
        sensor = self._find(boat, name, "pinger")
        place = as_numbers(f"position of {name}'s beacon", position, 3, MAX_STATE)
        self.arrays.sample_clocks.device_state[sensor.marks] = place
        self.renew()

    # Inside

    def _readings_of(self, boat: str) -> dict[str, Reading]:
        """The readings of a boat that there are."""
        return {name: reading for (own, name), reading in self._kept.items() if own == boat}

    def _of(self, boat: str) -> dict[str, Mounted]:
        check_name("boat", boat, self._boats)
        return self._boats[boat]

    def _find(self, boat: str, name: str, kind: str = "sensor") -> Mounted:
        known = self._of(boat) if kind == "sensor" else self.of_kind(boat, kind)
        check_name(f"{kind} of {boat}", name, known)
        return known[name]

    def _last_moments(self, rate: float) -> tuple[Moment, Moment | None]:
        """The last moment of a clock, and the one before it."""
        moments, data = self.arrays.sample_clocks, self.arrays.data
        if moments.runs(rate):
            moments.latch_due(data.qpos, data.qvel, data.time)
        else:
            moments.start(rate, data.qpos, data.qvel, data.time)
            self._rebound()
        return moments.last(rate)

    def _reading(self, sensor: Mounted, now: Moment, before: Moment | None) -> Reading:
        draw = Draw(self._seed, sensor.boat, sensor.name, now.index, sensor.config.rate, life=sensor.life)
        data = sensor.kind.measure(_Measurement(self, sensor, now, before, draw))
        return Reading(sensor.name, sensor.config.type, now.time, now.index, sensor.frame, data, sensor.mount)

    def measuring_place(self, sensor: Mounted, moment: Moment) -> Place:
        """Where a sensor measures, and how that place moves."""
        mount = sensor.mount
        if sensor.config.type in self._at_base:
            mount = _BASE_MOUNT if sensor.config.type == "pinger" else mount.at_base()
        return sensor.place(moment.qpos, moment.qvel, mount)


class _Measurement:
    """Data from which a reading of a sensor is made: see `sensors.kinds.Measurement`."""

    __slots__ = ("_before", "_now", "_sensing", "_sensor", "draw")

    def __init__(self, sensing: Sensing, sensor: Mounted, now: Moment, before: Moment | None, draw: Draw) -> None:
        self._sensing, self._sensor, self._now, self._before, self.draw = sensing, sensor, now, before, draw

    @property
    def config(self) -> Any:
        return self._sensor.config

    @property
    def place(self) -> Place:
        return self._sensing.measuring_place(self._sensor, self._now)

    @property
    def place_before(self) -> Place | None:
        return None if self._before is None else self._sensing.measuring_place(self._sensor, self._before)

    @property
    def interval(self) -> float:
        return 0.0 if self._before is None else self._now.time - self._before.time

    @property
    def gravity(self) -> _Floats:
        return np.array(self._sensing.arrays.model.opt.gravity)

    @property
    def earth(self) -> Georeference:
        if self._sensing.earth is None:
            whose, world = f"{self._sensor.name} of {self._sensor.boat}", self._sensing.world.name
            raise SensorError(f"{whose} cannot measure its position: the world {world} has no georeference")
        return self._sensing.earth

    @property
    def x_from_east(self) -> float:
        return self._sensing.world.parameters.x_from_east

    @property
    def marks(self) -> _Floats:
        return self._now.device_state[self._sensor.marks]

    @property
    def wind(self) -> _Floats:
        level = self._sensing.world.parameters.sea.level
        return apparent_wind(self._sensing.wind.velocity, self._now.time, level, self.place)

    def picture(self) -> Image:
        return self._sensing.sights.image(self._sensor, self._now, self.draw)

    def scan(self) -> PointCloud | Scan:
        return self._sensing.sights.scan(self._sensor, self._now, self.draw)

    def echo(self) -> float:
        return self._sensing.sights.echo(self._sensor, self._now)


def fire(sensing: Sensing, arrays: LoopArrays, sea: Sea, boat: str, name: str | None) -> bool:
    """Shoot, and return whether there was a shot left. The recoil on the boat is neglected, as in VRX.

    Raises:
        UnknownNameError: no such boat, or no such shooter on it.
        CommandError: the boat has no shooter, or several and none is named.
        SensorError: the world has no ball for it.
    """
    sensor = _shooter(sensing.of_kind(boat, "ball_shooter"), boat, name)
    if sensor.ball is None:
        raise SensorError(f"{sensor.name} of {boat} has no ball: the world was compiled without one")
    shots = arrays.sample_clocks.device_state[sensor.marks]
    if shots[0] < 1.0:
        return False
    shots[0] -= 1.0
    _launch(arrays, sea, sensor, inherits=sensing.world.parameters.profile not in _STILL_SHOT_PROFILES)
    return True


def _launch(arrays: LoopArrays, sea: Sea, sensor: Mounted, *, inherits: bool) -> None:
    """Put the ball to the muzzle, with the launcher's axes, and let it go along their x.

    It starts with the speed that gravity takes in half a step more: a step takes gravity off before it moves, and so
    its places are those of the parabola.
    """
    assert sensor.ball is not None, f"{sensor.name} has no ball"
    data, ball, mount = arrays.data, arrays.floats[sensor.ball], sensor.mount
    muzzle = Mount(mount.position + mount.rotation @ sensor.config.muzzle, mount.rotation, mount.orientation)
    place = sensor.place(data.qpos, data.qvel, muzzle)
    velocity = place.rotation[:, 0] * (sensor.config.impulse / float(ball["mass"]))
    if inherits:
        velocity += place.velocity
    velocity -= 0.5 * arrays.timestep * arrays.model.opt.gravity
    qpos, dof = int(ball["qpos"]), int(ball["dof"])
    data.qpos[qpos : qpos + 3], data.qpos[qpos + 3 : qpos + 7] = place.position, place.orientation
    data.qvel[dof : dof + 3], data.qvel[dof + 3 : dof + 6] = velocity, 0.0
    arrays.start_floating(sensor.ball, float(sea.height(place.position[0], place.position[1], data.time)))


def _shooter(shooters: dict[str, Mounted], boat: str, name: str | None) -> Mounted:
    if not shooters:
        raise CommandError(f"{boat} has no ball shooter")
    if name is None and len(shooters) > 1:
        raise CommandError(f"{boat} has {len(shooters)} ball shooters: name one of {', '.join(shooters)}")
    chosen = next(iter(shooters)) if name is None else name
    check_name(f"ball shooter of {boat}", chosen, shooters)
    return shooters[chosen]


class Displays:
    """The lights and placards of a run; errors are those of the methods of `Simulation` with these names."""

    def __init__(self, sensing: Sensing) -> None:
        """Displays of the run of some sensors, which see what the displays are made to show."""
        self._sensing = sensing

    @property
    def _arrays(self) -> LoopArrays:
        return self._sensing.arrays

    def names(self, kind: str) -> Names:
        """Names of all displays of a kind, `light` or `placard`."""
        return tuple(display.name for display in self._arrays.displays if display.kind == kind)

    def showing(self, name: str) -> str:
        """Current colour of a light or symbol of a placard."""
        display = self._display("light or placard", name, ("light", "placard"))
        return display.shows(self._arrays.display_marks, float(self._arrays.data.time))

    def set_light(self, name: str, colors: Sequence[str]) -> None:
        """Make a light show three colours in turn, each for one second, beginning in one second."""
        display = self._display("light", name, ("light",))
        known = (*LIGHT_COLORS, OFF)
        given: Any = colors
        three = isinstance(given, Sequence) and not isinstance(given, str) and len(given) == 3
        if not three or not all(isinstance(color, str) and color in known for color in given):
            raise CommandError(f"invalid colours {quote(colors)} of {name}: three of {', '.join(known)} are needed")
        new_pattern(self._arrays.display_marks[display.marks], colors, float(self._arrays.data.time))
        self._sensing.renew()

    def set_placard(self, name: str, symbol: str) -> None:
        """Make a placard show a symbol, such as `red_circle`."""
        display = self._display("placard", name, ("placard",))
        check_name("symbol", symbol, SYMBOLS)
        self._arrays.display_marks[display.marks] = symbol_mark(symbol)
        self._sensing.renew()

    def shuffle(self, name: str) -> None:
        """Make a light or a placard show the next pattern in VRX's order."""
        display = self._display("light or placard", name, ("light", "placard"))
        marks = self._arrays.display_marks[display.marks]
        if display.kind == "light":
            next_pattern(marks, float(self._arrays.data.time))
        else:
            next_symbol(marks)
        self._sensing.renew()

    def paint(self, model: mujoco.MjModel) -> None:
        """Set the colours of lights and placards in a model to be drawn, such as `visual_model`."""
        check_kind("paint", model, mujoco.MjModel, "a model, as sim.visual_model")
        marks, time = self._arrays.display_marks, float(self._arrays.data.time)
        for geom, rgba in display_colors(model, self._arrays.displays, marks, time).items():
            model.geom_rgba[geom] = rgba

    def _display(self, what: str, name: str, kinds: Sequence[str]) -> Display:
        known = {display.name: display for display in self._arrays.displays if display.kind in kinds}
        check_name(what, name, known)
        return known[name]
