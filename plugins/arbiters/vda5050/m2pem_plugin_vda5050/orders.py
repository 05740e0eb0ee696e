"""Orders of VDA 5050: the nodes and edges of a behavior, and which of them are released.

Node 0 is where the vehicle stands when it gets the order, and node N the Nth waypoint. The nodes
and edges of an order are numbered together: node N has the sequence id 2 N.
"""

import math
from dataclasses import dataclass, field

from msgspec import UNSET

from m2pem_plugin_vda5050.map_frame import MapPoint
from m2pem_plugin_vda5050.messages import Action, Edge, Node, NodePosition


@dataclass(frozen=True, slots=True)
class OrderPlan:
    """The way of an order, in the frame of the vehicle's map.

    `start`: where the vehicle stands; None after a restart, when it is not sent again. `points`:
    the waypoints. `theta_rad`: the direction at the last one; None: any. `loop`: the first waypoint
    follows the last one, without end. `actions`: of the last node. `both_spellings`: send
    `allowedDeviationXy`, too, as the schema of version 2.0 spells it.
    """

    order_id: str
    map_id: str
    start: MapPoint | None
    points: tuple[MapPoint, ...] = ()
    loop: bool = False
    speed_m_s: float | None = None
    theta_rad: float | None = None
    backwards: bool = False
    deviation_m: float = 0.5
    end_deviation_m: float = 0.5
    start_deviation_m: float = 1.0
    actions: tuple[Action, ...] = field(default=())
    both_spellings: bool = False

    @property
    def last(self) -> int | None:
        """The number of the last node; None: there is none."""
        return None if self.loop else len(self.points)

    def part(self, first: int, base_end: int, end: int) -> tuple[list[Node], list[Edge]]:
        """Return the nodes `first` to `end` and the edges between them. Those up to the node
        `base_end` are released."""
        nodes = [self._node(number, number <= base_end) for number in range(first, end + 1)]
        edges = [self._edge(number, number < base_end) for number in range(first, end)]
        return nodes, edges

    def node_id(self, number: int) -> str:
        """Return the id of a node by its number."""
        name = self.order_id[:8]
        return f"{name}.0" if number == 0 else f"{name}.{(number - 1) % len(self.points) + 1}"

    def _node(self, number: int, released: bool) -> Node:
        is_last = number == self.last
        if number > 0:
            point = self.points[(number - 1) % len(self.points)]
            deviation_m = self.end_deviation_m if is_last else self.deviation_m
        else:
            assert self.start is not None, "node 0 is sent once, from where the vehicle stands"
            point, deviation_m = self.start, self.start_deviation_m
        has_theta = is_last and number > 0
        theta = None if self.theta_rad is None or not has_theta else round(self.theta_rad, 5)
        position = NodePosition(
            x=round(point.x, 3),
            y=round(point.y, 3),
            map_id=self.map_id,
            theta=UNSET if theta is None else theta,
            allowed_deviation_x_y=deviation_m,
            allowed_deviation_xy=deviation_m if self.both_spellings else UNSET,
        )
        actions = list(self.actions) if is_last else []
        return Node(
            node_id=self.node_id(number),
            sequence_id=2 * number,
            released=released,
            actions=actions,
            node_position=position,
        )

    def _edge(self, number: int, released: bool) -> Edge:
        """Return the edge from a node to the next one."""
        return Edge(
            edge_id=f"{self.node_id(number)}-{(number % len(self.points)) + 1}",
            sequence_id=2 * number + 1,
            released=released,
            start_node_id=self.node_id(number),
            end_node_id=self.node_id(number + 1),
            actions=[],
            max_speed=UNSET if self.speed_m_s is None else round(self.speed_m_s, 3),
            orientation=round(math.pi, 5) if self.backwards else UNSET,
            orientation_type="TANGENTIAL" if self.backwards else UNSET,
        )


class OrderProgress:
    """What of an order was sent, and how far the vehicle has come.

    `released_nodes`: so many nodes ahead of the vehicle are released; 0: all, of a loop one lap.
    `most_nodes`: of one message; None: there is no limit. `update_id`: of the last message that was
    made. `traversed`: the number of the last node that the vehicle has reached.
    """

    def __init__(self, plan: OrderPlan, released_nodes: int, most_nodes: int | None) -> None:
        self.plan = plan
        self.update_id = -1
        self.traversed = 0
        self.base_end = 0
        self._first = 0
        self._end = 0
        self._released = released_nodes
        self._most = most_nodes

    def adopt(self, update_id: int, traversed: int, base_end: int) -> None:
        """Take up an order that is on the vehicle already."""
        self.update_id, self.traversed, self.base_end = update_id, traversed, base_end
        self._first, self._end = base_end, base_end

    def reach(self, number: int) -> None:
        """Note the last node that the vehicle says it has reached: none that is not released, or
        the next update would be as long as a wrong number is high."""
        self.traversed = max(self.traversed, min(number, self.base_end))

    def is_at_base_end(self, update_id: int, reached: int) -> bool:
        """Whether a vehicle that has this update has reached all nodes that it may drive to, and
        more will follow."""
        end = self.base_end if update_id >= self.update_id else self._first
        return reached >= end and end != self.plan.last

    @property
    def is_update_due(self) -> bool:
        """Whether more nodes should be released."""
        return self.update_id < 0 or self._wanted_base_end() > self.base_end

    def extend(self) -> None:
        """Release more nodes: the next message is a new update."""
        self._first = self.base_end
        self.update_id += 1
        last = self.plan.last
        furthest = self._wanted_base_end()
        end = furthest if last is None else last
        if self._most is not None:
            end = min(end, self._first + max(2, self._most) - 1)
        self.base_end = min(furthest, end)
        self._end = end

    def message(self) -> tuple[list[Node], list[Edge]]:
        """Return the nodes and edges of the last update, to be sent once or again."""
        return self.plan.part(self._first, self.base_end, self._end)

    def _wanted_base_end(self) -> int:
        last = self.plan.last
        if last is not None and not self._released:
            return last
        ahead = self._released or len(self.plan.points)
        wanted = max(self.base_end, self.traversed + ahead)
        return wanted if last is None else min(wanted, last)
