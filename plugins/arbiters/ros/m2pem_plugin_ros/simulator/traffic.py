"""Filters between the nodes of a simulated vehicle and ROS, by which faults silence, deafen and
kill nodes.

A node on board gets a `FilteredRuntime` in place of the `RosRuntime`.
"""

import itertools
from collections import deque
from typing import Any

from m2pem_interfaces.msg import BehaviorCommand, BehaviorStatus

from m2pem.api.clock import RateTimer
from m2pem_plugin_ros.runtime import RosRuntime
from m2pem_plugin_ros.simulator.faults import TrafficFaults

UNSILENCED = ("cmd_vel",)
"""A silent vehicle still receives its commands, and drives on."""


class TrafficFilter:
    """Passes or drops messages. `closed`: its nodes are killed."""

    def __init__(self, traffic_faults: TrafficFaults) -> None:
        self.traffic_faults = traffic_faults
        self.closed = False

    def send(self, publisher: Any, leaf: str, message: Any) -> None:
        """Publish a message unless it is dropped. `leaf` is the last part of the topic's name."""
        if not self.closed and (leaf in UNSILENCED or not self.traffic_faults.silent):
            publisher.publish(message)

    def accepts(self, leaf: str, message: Any) -> bool:
        """Return whether a message reaches its subscribers."""
        return not self.closed

    def made(self, publisher: Any, leaf: str) -> None:
        """Process a new publisher."""


class FilteredPublisher:
    """A publisher whose messages pass a filter."""

    def __init__(self, publisher: Any, traffic_filter: TrafficFilter) -> None:
        self._publisher = publisher
        self._traffic_filter = traffic_filter
        self._leaf = leaf(publisher.topic_name)
        traffic_filter.made(publisher, self._leaf)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._publisher, name)

    def publish(self, message: Any) -> None:
        """Publish a message, if the filter passes it."""
        self._traffic_filter.send(self._publisher, self._leaf, message)


class FilteredNode:
    """A node whose topics pass a filter."""

    def __init__(self, node: Any, traffic_filter: TrafficFilter) -> None:
        self.inner = node
        self._traffic_filter = traffic_filter

    def __getattr__(self, name: str) -> Any:
        return getattr(self.inner, name)

    def create_publisher(self, *arguments: Any, **options: Any) -> FilteredPublisher:
        return FilteredPublisher(
            self.inner.create_publisher(*arguments, **options), self._traffic_filter
        )

    def create_subscription(
        self, message_type: Any, topic: str, callback: Any, *arguments: Any, **options: Any
    ) -> Any:
        traffic_filter, name = self._traffic_filter, leaf(topic)

        def hear(message: Any) -> None:
            if traffic_filter.accepts(name, message):
                callback(message)

        create = self.inner.create_subscription
        return create(message_type, topic, hear, *arguments, **options)


class FilteredRuntime:
    """A `RosRuntime` for one part of a vehicle. All that is made with it can be destroyed
    together."""

    def __init__(
        self, ros: RosRuntime, traffic_filter: TrafficFilter, name: str, namespace: str
    ) -> None:
        self.traffic_filter = traffic_filter
        self._ros = ros
        self._made: list[Any] = []
        self.node = self.make_node(name, namespace)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._ros, name)

    def make_node(self, name: str, namespace: str = "", **options: Any) -> FilteredNode:
        """Make a filtered node. It has no parameter services unless they are requested."""
        options = {"start_parameter_services": False, "enable_rosout": False, **options}
        node = self._ros.make_node(name, namespace, **options)
        self._made.append(node)
        return FilteredNode(node, self.traffic_filter)

    def drop_node(self, node: FilteredNode) -> None:
        """Destroy a node. It may be destroyed already."""
        if node.inner in self._made:
            self._made.remove(node.inner)
            self._ros.drop_node(node.inner)

    def subscribe(self, *arguments: Any, node: Any = None, **options: Any) -> Any:
        """Subscribe as `RosRuntime.subscribe`; without a node, on the own node."""
        return self._ros.subscribe(*arguments, node=node or self.node, **options)

    def client(self, service_type: Any, name: str, *, node: Any = None) -> Any:
        """Make a client as `RosRuntime.client`; without a node, on the own node."""
        return self._ros.client(service_type, name, node=node or self.node)

    def serve(self, service_type: Any, name: str, handler: Any, *, node: Any = None) -> Any:
        """Serve as `RosRuntime.serve`; without a node, on the own node."""
        return self._ros.serve(service_type, name, handler, node=node or self.node)

    def destroy(self) -> None:
        """Destroy all nodes. DDS tells the others that they are gone."""
        self.traffic_filter.closed = True
        for node in self._made:
            self._ros.drop_node(node)
        self._made.clear()

    async def close(self) -> None:
        """Destroy the nodes. The runtime itself belongs to all vehicles."""
        self.destroy()


def leaf(topic: str) -> str:
    """Return the last part of a topic's name."""
    return topic.rpartition("/")[2]


STATUS, COMMAND = "behavior_status", "command"
TERMINAL = range(BehaviorStatus.SUCCEEDED, BehaviorStatus.LOST + 1)
LIES = (
    BehaviorStatus.ACCEPTED,
    BehaviorStatus.RUNNING,
    BehaviorStatus.SUCCEEDED,
    BehaviorStatus.FAILED,
    BehaviorStatus.CANCELLED,
)
LIE_HZ = 2.0
MOST_AT_ONCE = 500
"""Statuses of a flood at once. More are not caught up on a slow computer."""


class NodeTrafficFilter(TrafficFilter):
    """Makes a bad node of a good one: lies, floods, and drops START, by the traffic faults."""

    def __init__(self, traffic_faults: TrafficFaults) -> None:
        super().__init__(traffic_faults)
        self._publisher: Any = None
        self._recent: deque[Any] = deque(maxlen=10)
        self._numbers = itertools.count(1)
        self._rate_timer = RateTimer(LIE_HZ)
        self._owed = 0.0

    def send(self, publisher: Any, leaf: str, message: Any) -> None:
        """Publish a message, and with the fault `lies`, a contradiction after a terminal status."""
        super().send(publisher, leaf, message)
        if leaf != STATUS:
            return
        self._recent.append(message)
        if self.traffic_faults.lies and message.state in TERMINAL:
            super().send(publisher, leaf, _contradiction(message))

    def accepts(self, leaf: str, message: Any) -> bool:
        """Return whether a message reaches the node."""
        if self.traffic_faults.deaf and leaf == COMMAND and message.verb == BehaviorCommand.START:
            return False
        return super().accepts(leaf, message)

    def made(self, publisher: Any, leaf: str) -> None:
        """Keep the publisher, to lie before the node has published."""
        if leaf == STATUS:
            self._publisher = publisher

    def step(self, now_s: float, wall_dt_s: float) -> None:
        """Publish what is due."""
        if self._publisher is None:
            return
        if self.traffic_faults.lies and self._rate_timer.is_due(now_s):
            self._say(self._invention(next(self._numbers)))
        if self.traffic_faults.flood_per_s <= 0:
            self._owed = 0.0
            return
        self._owed = min(self._owed + self.traffic_faults.flood_per_s * wall_dt_s, MOST_AT_ONCE)
        while self._owed >= 1:
            self._owed -= 1
            number = next(self._numbers)
            said = self._recent[number % len(self._recent)] if self._recent and number % 2 else None
            self._say(said or self._invention(number))

    def _say(self, message: Any) -> None:
        super().send(self._publisher, STATUS, message)

    def _invention(self, number: int) -> Any:
        """Return a status of a behavior that the node was never given."""
        return BehaviorStatus(
            id=f"never-given-{number}",
            number=1 + number % 7,
            state=LIES[number % len(LIES)],
            reason="a simulated lie",
        )


def _contradiction(message: Any) -> Any:
    """Return a second, different end of the same behavior."""
    succeeded = message.state == BehaviorStatus.SUCCEEDED
    return BehaviorStatus(
        stamp=message.stamp,
        id=message.id,
        number=message.number + 1,
        state=BehaviorStatus.FAILED if succeeded else BehaviorStatus.SUCCEEDED,
        code="FAILED" if succeeded else "",
        reason="a simulated lie",
    )
