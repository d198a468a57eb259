"""What steers boats on behalf of topics: `cmd_vel`, `/swarm/formation`, and thrusts that last."""

import contextlib
import json
import math
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

from pydantic import ValidationError

from vrx_mj.arguments import check_name
from vrx_mj.config.base import Config
from vrx_mj.config.layouts import LayoutName
from vrx_mj.config.loading import fault_text
from vrx_mj.config.values import Point
from vrx_mj.control.formation import Formation
from vrx_mj.control.navigation import true_estimate
from vrx_mj.control.velocity import VelocityKeeper, craft_of
from vrx_mj.errors import CommandError, VrxError
from vrx_mj.runtime.observation import Observation
from vrx_mj.runtime.run import CONTROL_RATE
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.runtime.timing import Schedule

_TIMEOUT = 1.0
"""Time for which a `cmd_vel` holds [s], as thrusts do."""
_OFF_WORDS = ("off", "none", "stop")
"""Words that turn a mode off."""


class _VelocityOrder(NamedTuple):
    surge: float
    turn: float
    expires: float


class _ThrustOrder(NamedTuple):
    command: float
    renewed: float
    """Simulated time at which it was given last [s]."""
    period: float
    """After which it is given again [s]."""


class Steering:
    """Orders that outlast a message: velocities, by ground truth, formations, by the boats' sensors, and thrusts."""

    def __init__(self, sim: Simulation, report: Callable[[str, str], None]) -> None:
        self._sim, self._report = sim, report
        self._orders: dict[str, _VelocityOrder] = {}
        self._held: dict[tuple[str, str], _ThrustOrder] = {}
        """The last commands of the thrusters that go on by them, by boat and thruster."""
        self._keepers: dict[str, VelocityKeeper] = {}
        self._formation: Formation | None = None
        self._schedule = Schedule()

    def bind(self) -> None:
        """Boats came or went, or time began anew."""
        here = set(self._sim.boats)
        self._orders = {boat: order for boat, order in self._orders.items() if boat in here}
        self._held = {key: order for key, order in self._held.items() if key[0] in here}
        self._keepers.clear()
        self._schedule = Schedule()
        leader = self._formation.leader.name if self._formation else None
        if leader is not None and leader not in here:
            self._formation = None

    def steer_boat(self, boat: str, surge: float, turn: float) -> None:
        """Keep a speed ahead [m/s] and a turning rate [rad/s], for a second."""
        self._held = {key: order for key, order in self._held.items() if key[0] != boat}
        self._orders[boat] = _VelocityOrder(surge, turn, self._sim.time + _TIMEOUT)

    def let_go(self, boat: str, thrusters: Iterable[str]) -> None:
        """Somebody else commands these thrusters of the boat."""
        self._orders.pop(boat, None)
        for name in thrusters:
            self._held.pop((boat, name), None)

    def hold(self, boat: str, thruster: str, command: float) -> None:
        """Go on giving a command that the simulation has taken just now."""
        own = self._sim.world.parameters.thrusters_of(boat)
        timeout = next(each.timeout for each in own if each.name == thruster)
        period = 0.5 * timeout if timeout > 0.0 else math.inf
        self._held[boat, thruster] = _ThrustOrder(command, self._sim.time, period)

    def begin(self) -> None:
        """Hold no thrust any more: time began anew, or others steer now."""
        self._held.clear()

    def form(self, text: str) -> None:
        """Command the fleet to keep a formation, or to change to another one.

        Raises:
            CommandError: the text is not a formation.
            VrxError: the boats cannot keep it.
        """
        wanted, state = parse_formation(text), "off"
        if wanted is None:
            self._formation = None
        elif self._formation is not None and not {"leader", "path", "speed", "radius", "apart"} & wanted.keys():
            self._formation.change(wanted.get("shape", self._formation.shape), wanted.get("spacing"))
        else:
            if "path" not in wanted:
                check_name("boat", wanted.setdefault("leader", self._sim.boats[0]), self._sim.boats)
            self._formation = Formation(**wanted)
        if self._formation is not None:
            leader = self._formation.leader.name
            whom = f"led by {leader}" if leader else "along its path"
            state = f"{self._formation.shape}, {self._formation.spacing:g} m apart, {whom}"
        self._report("INFO", f"formation: {state}")
        self._held.clear()

    def steer(self) -> None:
        """Command the boats, if it is time."""
        time = self._sim.time
        if not (self._orders or self._formation) or not self._schedule.take("steer", CONTROL_RATE, time):
            return
        seen = self._sim.observe()
        self._orders = {boat: order for boat, order in self._orders.items() if time < order.expires}
        for boat, order in self._orders.items():
            if boat not in self._keepers:
                self._keepers[boat] = VelocityKeeper(seen[boat].thrusters, craft_of(seen[boat]), hold_sway=True)
            keeper = self._keepers[boat]
            self._sim.command_all({boat: keeper(true_estimate(seen[boat]), time, order.surge, order.turn)})
        if self._formation is not None:
            self._keep_formation(self._formation, seen, time)

    def renew(self) -> None:
        """Give held commands again before they end."""
        time = self._sim.time
        due: dict[str, dict[str, float]] = {}
        for (boat, name), order in self._held.items():
            if time - order.renewed >= order.period:
                due.setdefault(boat, {})[name] = order.command
                self._held[boat, name] = order._replace(renewed=time)
        if due:
            self._sim.command_all(due)

    def _keep_formation(self, formation: Formation, seen: Observation, time: float) -> None:
        try:
            commands = formation(seen, time)
        except VrxError as error:
            self._formation = None
            self._report("WARN", f"formation: off: {error}")
            return
        self._sim.command_all({boat: given for boat, given in commands.items() if boat not in self._orders})


class FormationOrder(Config):
    """Arguments of `Formation` in a message on `/swarm/formation`."""

    shape: LayoutName = "wedge"
    spacing: float = 0.0
    leader: str = ""
    path: tuple[Point, ...] = ()
    speed: float = 0.0
    radius: float = 0.0
    apart: float = 0.0


def parse_formation(text: str) -> dict[str, Any] | None:
    """The arguments of `Formation` in a message on `/swarm/formation`; None ends the formation.

    Either a shape and its parameters, `wedge spacing=12`, or a JSON object with the same names.

    Raises:
        CommandError: it is neither.
    """
    if text.strip().lower() in _OFF_WORDS:
        return None
    given = _from_json(text) if text.lstrip().startswith("{") else _from_words(text)
    for key in given:
        check_name("parameter of a formation", key, FormationOrder.model_fields)
    try:
        return FormationOrder.model_validate(given).model_dump(exclude_unset=True)
    except ValidationError as error:
        raise CommandError(f"formation: {fault_text(error)}") from None


def _from_words(text: str) -> dict[str, object]:
    shape, *rest = text.split() or [""]
    given: dict[str, object] = {"shape": shape}
    for word in rest:
        key, equals, value = word.partition("=")
        if not equals:
            raise CommandError(f"formation '{text}': '{word}' is not name=value, as in wedge spacing=12")
        given[key] = value
        with contextlib.suppress(ValueError):
            given[key] = value if key == "leader" else float(value)
    return given


def _from_json(text: str) -> dict[str, object]:
    try:
        return dict(json.loads(text))
    except (ValueError, TypeError, RecursionError) as error:
        raise CommandError(f"formation: not a JSON object: {error}") from None
