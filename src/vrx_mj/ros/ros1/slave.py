"""The slave API of our node: what other nodes, tools and the master call."""

import os
from collections.abc import Callable, Sequence
from typing import Any

from vrx_mj.ros.ros1.master import Reply
from vrx_mj.ros.ros1.names import resolve
from vrx_mj.ros.ros1.notices import Notices
from vrx_mj.ros.ros1.publication import Publication
from vrx_mj.ros.ros1.subscription import Subscription
from vrx_mj.ros.ros1.xmlrpc import Fault

__all__ = ["Slave"]

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
        """Whether one at such an address may tell us what to do."""
        self.is_masters_own = False
        """Whether the master is this process's own, which never ends its node; others may have it call us."""
        self.on_shutdown: Callable[[str], None] | None = None
        """Called with the reason when we are told to end."""
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

    async def answer(self, method: str, values: Sequence[Any], host: str) -> Any:
        """What a call of somebody at an address gives; Fault if there is no such method."""
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
            self.notices.tell("WARN", method, host, text)
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

    def _publisher_update(self, topic: Any, publishers: Any) -> Reply:
        if not isinstance(topic, str) or not isinstance(publishers, list):
            return -1, "publisherUpdate takes a topic and a list of URIs", 0
        if topic in self.subscriptions:
            self.subscriptions[topic].update(uri for uri in publishers if isinstance(uri, str))
        return 1, "", 0

    def _request_topic(self, topic: Any, protocols: Any) -> Reply:
        name = resolve(topic, self.node) if isinstance(topic, str) else ""
        if name not in self.publications:
            return -1, f"Not a publisher of [{str(topic)[:100]}]", []
        known = [one[0] for one in protocols if isinstance(one, list) and one] if isinstance(protocols, list) else []
        if "TCPROS" not in known:
            return 0, "no supported protocol implementations: TCPROS is spoken here", []
        host, port = self.stream
        return 1, f"ready on {host}:{port}", ["TCPROS", host, port]

    def _shutdown(self, caller: str, *reason: Any) -> Reply:
        if self.is_masters_own and caller == MASTER:
            return -1, "shutdown is refused: this master does not end this node", 0
        self.end(f"{caller[:100]} shut it down: {str(reason[0])[:200] if reason else 'no reason given'}")
        return 1, "shutdown", 0

    def end(self, reason: str) -> None:
        """Tell whoever serves that it is over."""
        self.notices.tell("WARN", "shutdown", reason, f"node {self.node}: {reason}")
        if self.on_shutdown is not None:
            self.on_shutdown(reason)


def _listed(topics: dict[str, Any]) -> list[list[str]]:
    return [[topic.name, topic.type] for topic in topics.values()]
