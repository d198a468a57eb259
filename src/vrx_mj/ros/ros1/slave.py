"""The slave API of our nodes, and what other nodes do wrong."""

import asyncio
import os
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from vrx_mj.errors import CommandError
from vrx_mj.ros.access import is_local
from vrx_mj.ros.graph import Graph
from vrx_mj.ros.network import Notices
from vrx_mj.ros.parameters import resolve
from vrx_mj.ros.ros1.master import Reply
from vrx_mj.ros.ros1.publication import Publication
from vrx_mj.ros.ros1.registrar import Link, SystemState
from vrx_mj.ros.ros1.subscription import Subscription
from vrx_mj.ros.ros1.xmlrpc import BROKEN, LARGEST_REPLY, Fault, Proxy, address

__all__ = ["Slave", "Watch"]

RESTRICTED = {"shutdown", "publisherUpdate", "paramUpdate"}
"""Only for programs on this machine and the master's."""
MASTER = "/master"
"""The caller that masters say they are."""


class Slave:
    """Answers with what a node has."""

    def __init__(
        self,
        node: str,
        master_uri: str,
        publications: dict[str, Publication],
        subscriptions: dict[str, Subscription],
        notices: Notices,
    ) -> None:
        self.node, self.master_uri = node, master_uri
        self.publications, self.subscriptions, self.notices = publications, subscriptions, notices
        self.uri = ""
        self.stream: tuple[str, int] = ("", 0)
        """Host and port of TCPROS."""
        self.trusted: Callable[[str], bool] = lambda host: False
        """Whether a caller at such an address may command the node."""
        self.is_masters_own = False
        """Whether the master is this process's own, which never ends its node; others may have it call us."""
        self.on_shutdown: Callable[[str], None] | None = None
        """Called with the reason when somebody shuts the node down."""
        self._methods: dict[str, tuple[int, Callable[..., Reply]]] = {
            "getBusStats": (0, self._bus_stats),
            "getBusInfo": (0, self._bus_info),
            "getMasterUri": (0, lambda: (1, self.master_uri, self.master_uri)),
            "getUri": (0, lambda: (1, "", self.uri)),
            "getName": (0, lambda: (1, "", self.node)),
            "getPid": (0, lambda: (1, "", os.getpid())),
            "getSubscriptions": (0, lambda: (1, "subscriptions", _listed(self.subscriptions))),
            "getPublications": (0, lambda: (1, "publications", _listed(self.publications))),
            "paramUpdate": (2, lambda *_: (-1, "not subscribed", 0)),
            "publisherUpdate": (2, self._publisher_update),
            "requestTopic": (2, self._request_topic),
            "shutdown": (-1, self._shutdown),
        }
        """How many values each takes after the caller; -1: any number."""

    async def answer(self, method: str, values: Sequence[object], host: str) -> list[object]:
        """What a call from an address gives; Fault for an unknown method."""
        if method == "system.listMethods":
            return [*self._methods, "system.listMethods", "system.multicall"]
        if method not in self._methods:
            raise Fault(1, f'method "{method[:100]}" is not supported')
        count, function = self._methods[method]
        if not values or not isinstance(values[0], str):
            return [-1, "caller_id must be a string", 0]
        if count >= 0 and len(values) != count + 1:
            return [-1, "Error: bad call arity", 0]
        if method in RESTRICTED and not self.trusted(host):
            text = f"{host} ({values[0][:100]}) called {method}: only this machine and the master's machine may"
            self.notices.write("WARN", method, host, text)
            return [-1, f"{method} is refused: {host} is neither this machine nor the master's", 0]
        return list(function(*values[1:]) if method != "shutdown" else function(*values))

    def _bus_stats(self) -> Reply:
        sent = [
            [
                topic.name,
                sum(one.sent for one in topic.readers),
                [[one.number, one.sent, one.messages, True] for one in topic.readers],
            ]
            for topic in self.publications.values()
        ]
        got = [
            [topic.name, [[one.number, one.received, -1, one.receiver is not None] for one in topic.sources.values()]]
            for topic in self.subscriptions.values()
        ]
        return 1, "", [sent, got, []]

    def _bus_info(self) -> Reply:
        out = [reader.info() for topic in self.publications.values() for reader in topic.readers]
        return (
            1,
            "bus info",
            out + [source.info() for topic in self.subscriptions.values() for source in topic.sources.values()],
        )

    def _publisher_update(self, topic: object, publishers: object) -> Reply:
        if not isinstance(topic, str) or not isinstance(publishers, list):
            return -1, "publisherUpdate takes a topic and a list of URIs", 0
        if topic in self.subscriptions:
            self.subscriptions[topic].update(uri for uri in publishers if isinstance(uri, str))
        return 1, "", 0

    def _request_topic(self, topic: object, protocols: object) -> Reply:
        name = resolve(topic, self.node) if isinstance(topic, str) else ""
        if name not in self.publications:
            return -1, f"Not a publisher of [{str(topic)[:100]}]", []
        known = [one[0] for one in protocols if isinstance(one, list) and one] if isinstance(protocols, list) else []
        if "TCPROS" not in known:
            return 0, "no supported protocol implementations: TCPROS is spoken here", []
        host, port = self.stream
        return 1, f"ready on {host}:{port}", ["TCPROS", host, port]

    def _shutdown(self, caller: str, *reason: object) -> Reply:
        if self.is_masters_own and caller == MASTER:
            return -1, "shutdown is refused: this master does not end this node", 0
        self.end(f"{caller[:100]} shut it down: {str(reason[0])[:200] if reason else 'no reason given'}")
        return 1, "shutdown", 0

    def end(self, reason: str) -> None:
        """Shut down: report the reason, and call `on_shutdown`."""
        self.notices.write("WARN", "shutdown", reason, f"node {self.node}: {reason}")
        if self.on_shutdown is not None:
            self.on_shutdown(reason)


def _listed(topics: Mapping[str, Publication] | Mapping[str, Subscription]) -> list[list[str]]:
    return [[topic.name, topic.type] for topic in topics.values()]


PUBLIC = {"/rosout", "/rosout_agg", "/clock", "/tf", "/tf_static", "/statistics", "/diagnostics"}
"""Topics on which anybody publishes."""
CONNECT_TIMEOUT = 10.0
"""Wall time in which a subscriber should have connected [s]."""
MOST_WAITING = 1000


class Watch:
    """Looks at one state after the other."""

    def __init__(self, graph: Graph, link: Link, publications: Mapping[str, Publication]) -> None:
        self._graph, self._link = graph, link
        self._publications = publications
        self.announced = ""
        """The address that others get."""
        self.clock: Callable[[], float] = time.monotonic
        self._unknown_publishers: set[tuple[str, str]] = set()
        self._since: dict[tuple[str, str], float] = {}
        self._work: set[asyncio.Task[None]] = set()

    def look(self, state: SystemState, inputs: Mapping[str, object]) -> None:
        """Find what is new in a state; `inputs` are the topics that we listen to."""
        publishers, subscribers = state[0], state[1]
        unknown_publishers = {
            (topic, node)
            for topic, nodes in publishers.items()
            if topic not in PUBLIC and topic not in inputs and topic not in self._publications
            if not set(subscribers.get(topic, [])) - {self._graph.node}
            for node in nodes
            if node not in self._graph.local
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
            pairs: Any
            (pairs,) = await self._link.many([("getTopicTypes", (self._graph.node,))])
            types = {str(topic): str(kind) for topic, kind in pairs or []}
        except (*BROKEN, Fault, TypeError, ValueError):
            types = {}
        for topic, node in sorted(new):
            self._graph.inbox.unknown_publisher(topic, types.get(topic, "*"), node)

    def _silent(self, subscribers: Mapping[str, list[str]]) -> list[tuple[str, str]]:
        """Topics and nodes that subscribed to them long ago and never connected; of a node only one topic."""
        waiting = {
            (topic, node)
            for topic, publication in self._publications.items()
            for node in subscribers.get(topic, [])
            if node not in self._graph.local and node not in publication.met
        }
        now = self.clock()
        since = {pair: self._since.get(pair, now) for pair in sorted(waiting)[:MOST_WAITING]}
        late = {node: topic for (topic, node), begun in since.items() if now - begun > CONNECT_TIMEOUT}
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
            self._graph.notices.write("WARN", "unreachable", node, text)

    async def _lookup(self, nodes: list[str]) -> list[str]:
        try:
            requests = [("lookupNode", (self._graph.node, node)) for node in nodes]
            return [str(uri) for uri in await self._link.many(requests)]
        except (*BROKEN, Fault):
            return []


async def _answers(uri: str) -> bool:
    """Whether a node is alive."""
    proxy = Proxy(uri, LARGEST_REPLY)
    try:
        await proxy.ros("getPid", "/vrx_mj", timeout=2.0)
    except (*BROKEN, Fault):
        return False
    finally:
        proxy.close()
    return True
