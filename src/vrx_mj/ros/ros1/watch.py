"""What other nodes do wrong, seen in the master's state: unheard commands, subscribers that cannot reach us."""

import asyncio
import time
from collections.abc import Callable, Mapping

from vrx_mj.errors import CommandError
from vrx_mj.ros.inbox import Inbox
from vrx_mj.ros.ros1.address import is_local
from vrx_mj.ros.ros1.http import BROKEN, LARGEST_REPLY, Proxy, address
from vrx_mj.ros.ros1.link import Link
from vrx_mj.ros.ros1.notices import Notices
from vrx_mj.ros.ros1.publication import Publication
from vrx_mj.ros.ros1.registrar import State
from vrx_mj.ros.ros1.xmlrpc import Fault

__all__ = ["Watch"]

PUBLIC = {"/rosout", "/rosout_agg", "/clock", "/tf", "/tf_static", "/statistics", "/diagnostics"}
"""Topics on which anybody publishes."""
PATIENCE = 10.0
"""Wall time in which a subscriber should have connected [s]."""
MOST_WAITING = 1000


class Watch:
    """Looks at one state after the other."""

    def __init__(
        self, node: str, link: Link, inbox: Inbox, notices: Notices, publications: Mapping[str, Publication]
    ) -> None:
        self._node, self._link, self._inbox, self._notices = node, link, inbox, notices
        self._publications = publications
        self.announced = ""
        """The address that others are told."""
        self.clock: Callable[[], float] = time.monotonic
        self._unknown_publishers: set[tuple[str, str]] = set()
        self._since: dict[tuple[str, str], float] = {}
        self._work: set[asyncio.Task[None]] = set()

    def look(self, state: State, inputs: Mapping[str, object]) -> None:
        """Find what is new in a state; `inputs` are the topics that we listen to."""
        publishers, subscribers = state[0], state[1]
        unknown_publishers = {
            (topic, node)
            for topic, nodes in publishers.items()
            if topic not in PUBLIC and topic not in inputs and topic not in self._publications
            if not set(subscribers.get(topic, [])) - {self._node}
            for node in nodes
            if node != self._node
        }
        new, self._unknown_publishers = unknown_publishers - self._unknown_publishers, unknown_publishers
        if new:
            self._begin(self._report_unknown_publishers(new))
        silent = self._silent(subscribers)
        if silent:
            self._begin(self._tell_unreachable(silent))

    async def close(self) -> None:
        """Stop."""
        work = list(self._work)
        for task in work:
            task.cancel()
        await asyncio.gather(*work, return_exceptions=True)

    def _begin(self, work: "asyncio._CoroutineLike[None]") -> None:
        task = asyncio.get_running_loop().create_task(work)
        self._work.add(task)
        task.add_done_callback(self._work.discard)

    async def _report_unknown_publishers(self, new: set[tuple[str, str]]) -> None:
        try:
            (pairs,) = await self._link.many([("getTopicTypes", (self._node,))])
            types = {str(topic): str(kind) for topic, kind in pairs or []}
        except (*BROKEN, Fault, TypeError, ValueError):
            types = {}
        for topic, node in sorted(new):
            self._inbox.unknown_publisher(topic, types.get(topic, "*"), node)

    def _silent(self, subscribers: Mapping[str, list[str]]) -> list[tuple[str, str]]:
        """Topics and nodes that subscribed to them long ago and never connected; of a node only one topic."""
        waiting = {
            (topic, node)
            for topic, publication in self._publications.items()
            for node in subscribers.get(topic, [])
            if node != self._node and node not in publication.met
        }
        now = self.clock()
        since = {pair: self._since.get(pair, now) for pair in sorted(waiting)[:MOST_WAITING]}
        late = {node: topic for (topic, node), begun in since.items() if now - begun > PATIENCE}
        self._since = {pair: begun for pair, begun in since.items() if pair[1] not in late}
        return [(topic, node) for node, topic in late.items()]

    async def _tell_unreachable(self, silent: list[tuple[str, str]]) -> None:
        for (_, node), uri in zip(silent, await self._lookup([node for _, node in silent]), strict=False):
            try:
                host, _ = address(uri)
                if not await _answers(uri):
                    continue  # it has died, and its registration has stayed
            except CommandError:
                continue
            where = "this machine" if await asyncio.to_thread(is_local, host) else host
            text = (
                f"subscriber {node} on {where} never connected: can it reach {self.announced}, "
                "the address set by ROS_HOSTNAME, ROS_IP or --host?"
            )
            self._notices.tell("WARN", "unreachable", node, text)

    async def _lookup(self, nodes: list[str]) -> list[str]:
        try:
            return [str(uri) for uri in await self._link.many([("lookupNode", (self._node, node)) for node in nodes])]
        except (*BROKEN, Fault):
            return []


async def _answers(uri: str) -> bool:
    """Whether a node is alive."""
    proxy = Proxy(uri, LARGEST_REPLY)
    try:
        await proxy.ros("getPid", "/vrx_mj", patience=2.0)
    except (*BROKEN, Fault):
        return False
    finally:
        proxy.close()
    return True
