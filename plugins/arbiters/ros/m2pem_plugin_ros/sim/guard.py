"""What stands between the nodes of a simulated vehicle and ROS: it can silence, deafen, end them.

A node on board is given a `GuardedRuntime` as if it were the `RosRuntime`, and need not know.
"""

from collections.abc import Callable
from typing import Any

from m2pem_plugin_ros.runtime import RosRuntime
from m2pem_plugin_ros.sim.troubles import Troubles

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
