"""Who publishes a topic with another type than is expected: DDS connects no such endpoints, without
an error."""

from collections.abc import Sequence
from typing import Any

LONGEST = 300


def other_type(publishers: Sequence[Any], expected: str) -> str:
    """Return how a topic is published, if not as expected: "is published as std_msgs/msg/String by
    /nose"; "" if all is right. `publishers`: those of `get_publishers_info_by_topic`."""
    for each in publishers:
        if each.topic_type != expected:
            node = f"{each.node_namespace.rstrip('/')}/{each.node_name}"
            text = f"is published as {each.topic_type} by {node}"
            return "".join(letter if letter.isprintable() else "?" for letter in text)[:LONGEST]
    return ""
