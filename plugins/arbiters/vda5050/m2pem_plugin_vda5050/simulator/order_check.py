"""Whether an order is one of VDA 5050, and one that the vehicle can do (section 6.6.4)."""

from collections.abc import Collection, Iterator
from itertools import pairwise

from msgspec import UNSET

from m2pem_plugin_vda5050.catalogue import required_parameters
from m2pem_plugin_vda5050.messages import Action, Order


class OrderError(ValueError):
    """The vehicle refuses an order. `type`: of the error that it reports. `about`: what the error
    refers to, beside the order."""

    def __init__(self, type_: str, problem: str, **about: str) -> None:
        super().__init__(problem)
        self.type = type_
        self.about = about


def check_shape(order: Order) -> None:
    """Check what holds of any order.

    Raises:
        OrderError: it does not hold.
    """
    nodes, edges = order.nodes, order.edges
    if len(edges) != len(nodes) - 1:
        _invalid(f"{len(nodes)} nodes need {len(nodes) - 1} edges, not {len(edges)}")
    for node in nodes:
        if node.sequence_id % 2:
            _invalid(f"the sequenceId of a node is odd: {node.sequence_id}", nodeId=node.node_id)
    for before, after in pairwise(nodes):
        if after.sequence_id != before.sequence_id + 2:
            _invalid(f"sequenceId {after.sequence_id} follows {before.sequence_id}")
        if after.released and not before.released:
            _invalid("a released node follows one that is not", nodeId=after.node_id)
    for edge, (start, end) in zip(edges, pairwise(nodes), strict=True):
        if edge.sequence_id != start.sequence_id + 1:
            _invalid(f"edge {edge.sequence_id} follows node {start.sequence_id}")
        if (edge.start_node_id, edge.end_node_id) != (start.node_id, end.node_id):
            _invalid("an edge does not connect its neighbours", edgeId=edge.edge_id)
        if edge.released and not end.released:
            _invalid("a released edge leads to a node that is not", edgeId=edge.edge_id)
    if not nodes[0].released:
        _invalid("the first node is not released", nodeId=nodes[0].node_id)


def check_doable(order: Order, maps: Collection[str], known: Collection[str]) -> None:
    """Check that the vehicle has the maps and the actions (`known`: their types) of an order.

    Raises:
        OrderError: it has not.
    """
    for node in order.nodes:
        if node.node_position is UNSET:
            raise OrderError("orderError", "this vehicle needs nodePosition", nodeId=node.node_id)
        if node.node_position.map_id not in maps:
            problem = f"there is no map {node.node_position.map_id!r} on the vehicle"
            raise OrderError("orderError", problem, nodeId=node.node_id)
    for edge in order.edges:
        for key, value in (("trajectory", edge.trajectory), ("corridor", edge.corridor)):
            if value is not UNSET:
                raise OrderError("orderError", f"{key} cannot be used", edgeId=edge.edge_id)
    for action in actions_of(order):
        if action.action_type not in known:
            problem = f"there is no action {action.action_type!r}"
            raise OrderError("orderError", problem, actionId=action.action_id)
        given = () if action.action_parameters is UNSET else action.action_parameters
        lacking = {*required_parameters(action.action_type, None)} - {each.key for each in given}
        if lacking:
            problem = f"{action.action_type} lacks {', '.join(sorted(lacking))}"
            raise OrderError("orderError", problem, actionId=action.action_id)


def actions_of(order: Order) -> Iterator[Action]:
    """Yield all actions of an order."""
    for node in order.nodes:
        yield from node.actions
    for edge in order.edges:
        yield from edge.actions


def _invalid(problem: str, **about: str) -> None:
    raise OrderError("validationError", problem, **about)
