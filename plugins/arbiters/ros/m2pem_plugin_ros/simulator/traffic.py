"""What stands between the nodes of a simulated vehicle and ROS: it can silence, deafen, end them.

A node on board is given a `GuardedRuntime` as if it were the `RosRuntime`, and need not know.
"""

import itertools
from collections import deque
from collections.abc import Callable
from typing import Any

from m2pem_interfaces.msg import BehaviorCommand, BehaviorStatus

from m2pem_plugin_ros.runtime import RosRuntime
from m2pem_plugin_ros.simulator.clock import Pace
from m2pem_plugin_ros.simulator.faults import Troubles

UNSILENCED = ("cmd_vel",)
"""What moves the base goes through: a silent vehicle drives on."""


class Gate:
    """Lets messages through, or not. `closed`: its nodes are dead, whatever they still say."""

    def __init__(self, troubles: Troubles) -> None:
        self.troubles = troubles
        self.closed = False

    def send(self, publisher: Any, leaf: str, message: Any) -> None:
        """Publish a message, if it may be. `leaf`: the last part of the topic's name."""
        if not self.closed and (leaf in UNSILENCED or not self.troubles.silent):
            publisher.publish(message)

    def hears(self, leaf: str, message: Any) -> bool:
        """Whether a message reaches who has subscribed."""
        return not self.closed

    def made(self, publisher: Any, leaf: str) -> None:
        """A publisher is there, and has published nothing yet."""


class GuardedPublisher:
    """A publisher whose messages go through a gate."""

    def __init__(self, publisher: Any, gate: Gate) -> None:
        self._publisher = publisher
        self._gate = gate
        self._leaf = leaf(publisher.topic_name)
        gate.made(publisher, self._leaf)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._publisher, name)

    def publish(self, message: Any) -> None:
        """Publish a message, if the gate lets it through."""
        self._gate.send(self._publisher, self._leaf, message)


class GuardedNode:
    """A node whose topics go through a gate; everything else is as it was."""

    def __init__(self, node: Any, gate: Gate) -> None:
        self.inner = node
        self._gate = gate

    def __getattr__(self, name: str) -> Any:
        return getattr(self.inner, name)

    def create_publisher(self, *arguments: Any, **options: Any) -> GuardedPublisher:
        """A publisher behind the gate."""
        return GuardedPublisher(self.inner.create_publisher(*arguments, **options), self._gate)

    def create_subscription(
        self,
        message_type: Any,
        topic: str,
        callback: Callable[[Any], None],
        *arguments: Any,
        **options: Any,
    ) -> Any:
        """A subscription behind the gate."""
        gate, name = self._gate, leaf(topic)

        def hear(message: Any) -> None:
            if gate.hears(name, message):
                callback(message)

        create = self.inner.create_subscription
        return create(message_type, topic, hear, *arguments, **options)


class GuardedRuntime:
    """A `RosRuntime` for one part of a vehicle: whatever is made with it can be ended together."""

    def __init__(self, ros: RosRuntime, gate: Gate, name: str, namespace: str) -> None:
        self.gate = gate
        self._ros = ros
        self._made: list[Any] = []
        self.node = self.make_node(name, namespace)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._ros, name)

    def make_node(self, name: str, namespace: str = "", **options: Any) -> GuardedNode:
        """A node behind the gate, without services for its parameters unless they are asked for."""
        options = {"start_parameter_services": False, "enable_rosout": False, **options}
        node = self._ros.make_node(name, namespace, **options)
        self._made.append(node)
        return GuardedNode(node, self.gate)

    def drop_node(self, node: GuardedNode) -> None:
        """End one of them; one that has ended is no more to be ended."""
        if node.inner in self._made:
            self._made.remove(node.inner)
            self._ros.drop_node(node.inner)

    def subscribe(
        self,
        message_type: Any,
        topic: str,
        callback: Callable[[Any], None],
        qos: Any,
        *,
        node: Any = None,
        **options: Any,
    ) -> Any:
        """As that of the runtime; without a node, on our own."""
        node = node or self.node
        return self._ros.subscribe(message_type, topic, callback, qos, node=node, **options)

    def client(self, service_type: Any, name: str, *, node: Any = None) -> Any:
        """As that of the runtime; without a node, on our own."""
        return self._ros.client(service_type, name, node=node or self.node)

    def serve(self, service_type: Any, name: str, handler: Any, *, node: Any = None) -> Any:
        """As that of the runtime; without a node, on our own."""
        return self._ros.serve(service_type, name, handler, node=node or self.node)

    def destroy(self) -> None:
        """End all nodes, with all that they have: DDS tells the others that they are gone."""
        self.gate.closed = True
        for node in self._made:
            self._ros.drop_node(node)
        self._made.clear()

    async def close(self) -> None:
        """The runtime belongs to all vehicles: it stays, our nodes go."""
        self.destroy()


def leaf(topic: str) -> str:
    """The last part of a topic's name."""
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
"""Of a flood: what is more than that is not made up for when the computer is slow."""


class NodeGate(Gate):
    """Lies, floods and does not hear, as the troubles say."""

    def __init__(self, troubles: Troubles) -> None:
        super().__init__(troubles)
        self._publisher: Any = None
        self._said: deque[Any] = deque(maxlen=10)
        self._numbers = itertools.count(1)
        self._pace = Pace(LIE_HZ)
        self._owed = 0.0

    def send(self, publisher: Any, leaf: str, message: Any) -> None:
        """Publish a message, and after a terminal status, while it lies, another one."""
        super().send(publisher, leaf, message)
        if leaf != STATUS:
            return
        self._said.append(message)
        if self.troubles.lies and message.state in TERMINAL:
            super().send(publisher, leaf, _contradiction(message))

    def hears(self, leaf: str, message: Any) -> bool:
        """Whether a message reaches the node."""
        if self.troubles.deaf and leaf == COMMAND and message.verb == BehaviorCommand.START:
            return False
        return super().hears(leaf, message)

    def made(self, publisher: Any, leaf: str) -> None:
        """With this it can lie before the node has said anything."""
        if leaf == STATUS:
            self._publisher = publisher

    def step(self, now_s: float, wall_dt_s: float) -> None:
        """Say what is due by now."""
        if self._publisher is None:
            return
        if self.troubles.lies and self._pace.is_due(now_s):
            self._say(self._invention(next(self._numbers)))
        if self.troubles.flood_per_s <= 0:
            self._owed = 0.0
            return
        self._owed = min(self._owed + self.troubles.flood_per_s * wall_dt_s, MOST_AT_ONCE)
        while self._owed >= 1:
            self._owed -= 1
            number = next(self._numbers)
            said = self._said[number % len(self._said)] if self._said and number % 2 else None
            self._say(said or self._invention(number))

    def _say(self, message: Any) -> None:
        super().send(self._publisher, STATUS, message)

    def _invention(self, number: int) -> Any:
        """A status of a behavior that nobody gave it."""
        return BehaviorStatus(
            id=f"never-given-{number}",
            number=1 + number % 7,
            state=LIES[number % len(LIES)],
            reason="a simulated lie",
        )


def _contradiction(message: Any) -> Any:
    """The same behavior has ended once more, and otherwise."""
    succeeded = message.state == BehaviorStatus.SUCCEEDED
    return BehaviorStatus(
        stamp=message.stamp,
        id=message.id,
        number=message.number + 1,
        state=BehaviorStatus.FAILED if succeeded else BehaviorStatus.SUCCEEDED,
        code="FAILED" if succeeded else "",
        reason="a simulated lie",
    )
