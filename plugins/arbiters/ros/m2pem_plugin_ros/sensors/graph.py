"""What the nodes of other processes have in a ROS domain."""

import asyncio
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rclpy.node import Node

LOOK_EVERY_S = 1.0

UNKNOWN_NODE = "_NODE_NAME_UNKNOWN_"
"""The name of a node whose endpoint was discovered before the node itself."""

NAMELESS = "a node whose name is not known yet"


class Graph:
    """The graph of a domain, as it was at most a second ago: a look at it costs a call for each
    topic, and many vehicles may not be there at once. It belongs to the running event loop."""

    def __init__(self, node: "Node") -> None:
        self._node = node
        self._loop = asyncio.get_running_loop()
        self._looked_s = -LOOK_EVERY_S
        self._nodes: list[str] = []
        self._topics: dict[str, list[str]] = {}

    def nodes(self) -> list[str]:
        """Return the full names of the nodes of other processes, without hidden ones."""
        self._refresh()
        return self._nodes

    def topics_of(self, type_: str) -> list[str]:
        """Return the topics of a type that have a publisher of another process."""
        self._refresh()
        if type_ not in self._topics:
            self._topics[type_] = self._published(type_)
        return self._topics[type_]

    def _refresh(self) -> None:
        from m2pem_plugin_ros.runtime import own_nodes  # noqa: PLC0415  # it needs rclpy

        now_s = self._loop.time()
        if now_s - self._looked_s < LOOK_EVERY_S:
            return
        self._looked_s = now_s
        self._topics.clear()
        full = (
            f"{namespace.rstrip('/')}/{name}"
            for name, namespace in self._node.get_node_names_and_namespaces()
            if not name.startswith("_")
        )
        self._nodes = sorted(set(full) - own_nodes())

    def _published(self, type_: str) -> list[str]:
        from m2pem_plugin_ros.runtime import own_nodes  # noqa: PLC0415  # it needs rclpy

        own = own_nodes() | {NAMELESS}  # which may be one of them
        return [
            name
            for name, types in self._node.get_topic_names_and_types()
            if type_ in types
            and any(
                node_of(each) not in own for each in self._node.get_publishers_info_by_topic(name)
            )
        ]


def node_of(endpoint: Any) -> str:
    """Return the full name of the node that an endpoint belongs to."""
    if endpoint.node_name == UNKNOWN_NODE:
        return NAMELESS
    return f"{endpoint.node_namespace.rstrip('/')}/{endpoint.node_name}"
