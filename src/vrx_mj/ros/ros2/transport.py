"""The transport: what the simulation's thread calls, and the thread in which ROS 2 is spoken."""

import logging
import os
import threading
from collections import deque
from collections.abc import Sequence

from vrx_mj.ros.inbox import Inbox
from vrx_mj.ros.offer import Dialect, Sent, Table, Traffic
from vrx_mj.ros.ros2.installed import has_package, load_rclpy
from vrx_mj.ros.ros2.node import Node
from vrx_mj.ros.table.vrx3 import PACKAGES

__all__ = ["Ros2"]

LOOPBACK = ("127.0.0.1", "localhost", "::1")
RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
PERIOD = 0.01
"""Wall time after which subscriptions are emptied at the latest [s]."""
MOST_BATCHES = 64
"""Batches that wait for the network's thread; the oldest goes first."""
MOST_LINES = 64
CLOSING = 2.0
EXAMPLES = {"ros_gz_interfaces": "/vrx/task/info and range_bearing", "tf2_msgs": "/tf and /tf_static"}

_logger = logging.getLogger(__name__)


class Ros2:
    """A `Transport` (see `vrx_mj.ros.offer`) by VRX 3's names, on the rclpy of the user's ROS 2."""

    title = "ROS 2"
    dialect: Dialect = "vrx3"

    def __init__(self, inbox: Inbox, *, host: str = "127.0.0.1", node: str = "vrx_mj") -> None:
        """A node of this name; with a host of loopback it looks for others on this machine alone."""
        self._inbox, self._host, self._name = inbox, host, node
        self._lock, self._woken, self._closing = threading.Lock(), threading.Event(), False
        self._table: Table | None = None
        self._batches: deque[Sequence[Sent]] = deque()
        self._lines: deque[tuple[str, str]] = deque(maxlen=MOST_LINES)
        self._dropped = 0
        self._node: Node | None = None
        self._thread = threading.Thread(target=self._run, name="vrx_mj ROS 2", daemon=True)

    def start(self) -> Sequence[str]:
        """Open the node; returns lines that say where it is, and what this ROS 2 lacks.

        Raises:
            NetworkError: there is no rclpy, or it does not start.
        """
        rclpy = load_rclpy()
        if self._host in LOOPBACK:
            os.environ.setdefault(RANGE, "LOCALHOST")
        self._node = Node(rclpy, self._inbox, self._name)
        self._thread.start()
        domain, distro = os.environ.get("ROS_DOMAIN_ID") or "0", os.environ.get("ROS_DISTRO") or "jazzy"
        by, reach = rclpy.get_rmw_implementation_identifier(), os.environ.get(RANGE, "SUBNET")
        lines = [f"ROS 2: node /{self._name} in domain {domain} by {by}, {RANGE}={reach}"]
        for package in PACKAGES:
            if not has_package(package):
                told = f", as {EXAMPLES[package]}," if package in EXAMPLES else ""
                debian = f"ros-{distro}-{package.replace('_', '-')}"
                lines.append(f"ROS 2: no {package} here (apt-get install {debian}): its topics{told} are not published")
        return lines

    def offer(self, table: Table) -> None:
        """Offer this table from now on, and nothing else."""
        with self._lock:
            self._table = table
        self._woken.set()

    @property
    def wanted(self) -> frozenset[str]:
        """Names of the outputs that somebody subscribes to now."""
        return self._node.wanted if self._node else frozenset()

    def publish(self, batch: Sequence[Sent]) -> None:
        """Send messages of one moment to who listens."""
        with self._lock:
            self._batches.append(batch)
            if len(self._batches) > MOST_BATCHES:
                oldest = self._batches.popleft()
                kept = [sent for sent in oldest if sent.output.latched]
                self._dropped += len(oldest) - len(kept)
                self._batches[0] = [*kept, *self._batches[0]]
        self._woken.set()

    def log(self, level: str, text: str) -> None:
        """Tell a line on /rosout."""
        with self._lock:
            self._lines.append((level, text))

    @property
    def traffic(self) -> Traffic:
        """What it has carried."""
        node = self._node
        return Traffic(node.clients, node.sent, self._dropped) if node else Traffic(0, 0, self._dropped)

    def close(self) -> None:
        """Leave ROS 2, and wait until that is done: 2 s at most."""
        self._closing = True
        self._woken.set()
        if self._thread.is_alive():
            self._thread.join(CLOSING)

    def _run(self) -> None:
        node = self._node
        assert node is not None, "the thread begins after the node"
        failed, last = "", False
        while not last:
            self._woken.wait(PERIOD)
            self._woken.clear()
            last = self._closing  # what waits is still sent
            try:
                self._work(node)
            except Exception as error:  # rclpy raises classes of its C extension; the simulation goes on without it
                if str(error) != failed:
                    failed = str(error)
                    _logger.exception("ROS 2")
        node.close()

    def _work(self, node: Node) -> None:
        with self._lock:
            table, self._table = self._table, None
            batches, self._batches = self._batches, deque()
            lines = list(self._lines)
            self._lines.clear()
        if table is not None:
            node.offer(table)
        for batch in batches:
            node.publish(batch)
        for line in lines:
            node.log(*line)
        node.take()
        node.look()
