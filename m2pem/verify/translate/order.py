"""Which tasks may come after which, by the graph alone."""

from collections.abc import Mapping

from m2pem.mission import elements as e
from m2pem.mission.mission import Mission
from m2pem.mission.reachability import following


def forks(node: e.FlowNode) -> bool:
    """Whether one token can become several at a node."""
    if isinstance(node, e.ExclusiveGateway | e.EventBasedGateway):
        return False
    if isinstance(node, e.Activity) and (
        node.completion_quantity > 1 or any(not b.interrupting for b in node.boundary)
    ):
        return True
    if isinstance(node, e.StartEvent) and len(node.container.entries) > 1:
        return True
    return len(node.outgoing) > 1


MOST_NODES = 1_000
"""In a process of more nodes, any task may come after any other."""


class Order:
    """Which tasks of the process that a run begins with may come after which.

    Of tasks in subprocesses and other processes, and of those that several tokens may come to, any
    may come after any other.
    """

    def __init__(self, process: e.Process) -> None:
        self._process = process
        self._reach = {node: _reached(following(node)) for node in process.nodes}
        self._several = frozenset(process.nodes) if len(process.entries) > 1 else self._doubled()

    def _doubled(self) -> frozenset[e.FlowNode]:
        """The nodes to which several tokens of a fork may come."""
        found: set[e.FlowNode] = set()
        for node in self._process.nodes:
            if isinstance(node, e.BoundaryEvent) and not node.interrupting:
                found |= self._reach[node]
            if isinstance(node, e.Activity) and node.completion_quantity > 1:
                found |= self._reach[node]
            if forks(node):
                seen: set[e.FlowNode] = set()
                for each in following(node):
                    beyond = {each} | self._reach.get(each, frozenset())
                    found |= seen & beyond
                    seen |= beyond
        return frozenset(found)

    def may_follow(self, task: e.FlowNode, other: e.FlowNode) -> bool:
        """Whether a task may begin after another one, or the same, has begun."""
        reach = self._reach
        if task not in reach or other not in reach or {task, other} & self._several:
            return True
        if task in reach[other] or task in reach[task]:
            return True
        if task is other:
            return isinstance(task, e.Activity) and task.loop is not None
        return other not in reach[task]


def later_tasks(
    mission: Mission, process: e.Process, tasks: Mapping[e.FlowNode, object]
) -> dict[e.FlowNode, frozenset[e.FlowNode]]:
    """Return, by task, those that may come after it. `process`: the one that the run begins
    with."""
    calls = [each.called for each in mission.nodes if isinstance(each, e.CallActivity)]
    if process in calls or len(process.nodes) > MOST_NODES:
        return dict.fromkeys(tasks, frozenset(tasks))
    order = Order(process)
    return {
        other: frozenset(task for task in tasks if order.may_follow(task, other)) for other in tasks
    }


def _reached(first: list[e.FlowNode]) -> frozenset[e.FlowNode]:
    found = set(first)
    waiting = list(first)
    while waiting:
        for each in following(waiting.pop()):
            if each not in found:
                found.add(each)
                waiting.append(each)
    return frozenset(found)
