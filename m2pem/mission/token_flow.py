"""The ways that tokens take through a mission: what may have happened before a token enters a node.

Conditions are not looked at. What may happen at the same time may have happened before.
"""

from collections.abc import Collection, Iterable, Iterator, Sequence
from itertools import chain
from typing import TypeAlias

from m2pem.mission import elements as e
from m2pem.mission.loops import MultiInstance
from m2pem.mission.mission import Mission
from m2pem.mission.reachability import following, instantiates, reach

_Nodes: TypeAlias = Sequence[e.FlowNode]
_Fork: TypeAlias = list[tuple[_Nodes, set[e.FlowNode]]]
"""Where tokens begin that come to be several, and what each leads to before that happens again."""


class TokenFlow:
    """The ways that tokens take, across subprocesses and calls."""

    def __init__(self, mission: Mission) -> None:
        self._mission = mission
        self._callers: dict[e.Container, list[e.FlowNode]] = {}
        for node in mission.nodes:
            if isinstance(node, e.CallActivity):
                self._callers.setdefault(node.called, []).append(node)
        self._forks: dict[e.Container, list[_Fork]] = {}
        self._compensation = [each for each in mission.activities() if each.for_compensation]

    def led_to(self, begun: Iterable[e.FlowNode], ends: Collection[e.FlowNode]) -> set[e.FlowNode]:
        """Return the nodes that tokens may enter that enter those of `begun` first.

        They leave none of `ends`; what interrupts one goes on.
        """
        found, waiting = set[e.FlowNode](), [*begun]
        while waiting:
            node = waiting.pop()
            if node in found:
                continue
            found.add(node)
            waiting += self._interrupted(node)
            inside = node.called if isinstance(node, e.CallActivity) else node
            if isinstance(inside, e.Process | e.SubProcess) and inside.entries:
                waiting += inside.entries
            elif node not in ends:
                waiting += self.left(node)
        return found

    def aside(self, task: e.FlowNode) -> Iterator[e.FlowNode]:
        """Return where tokens may be, or may enter next, while a task goes on."""
        yield from self._interrupted(task)
        yield from self._beside(task)
        yield from self._compensation

    def last_of(
        self, tasks: Collection[e.Activity], process: e.Process
    ) -> dict[e.Activity, e.Activity | e.Process | None]:
        """Return for each of some tasks which of them has ended last before it, on all ways; the
        process that a run begins with: none has; None: it is not one and the same, or may go on."""
        ends = {*tasks}
        begun = process.entries if len(process.entries) == 1 else ()  # several begin at once
        ways: list[tuple[e.Activity | e.Process | None, Iterable[e.FlowNode]]] = [
            (None, chain.from_iterable(map(self.aside, tasks))),
            (process, begun),
            *((each, self.left(each)) for each in tasks),
        ]
        found: dict[e.FlowNode, list[e.Activity | e.Process | None]] = {}
        for last, entered in ways:
            for node in self.led_to(entered, ends) & ends:
                found.setdefault(node, []).append(last)
        one = {node: lasts[0] for node, lasts in found.items() if len(lasts) == 1}
        return {each: one.get(each) for each in tasks}

    def _around(self, node: e.FlowNode) -> _Nodes:
        """The activities that a node is directly in."""
        own = node.container
        return (own,) if isinstance(own, e.SubProcess) else self._callers.get(own, ())

    def _outwards(self, node: e.FlowNode) -> list[e.FlowNode]:
        """The node, and the activities around it."""
        found = [node]
        for inner in found:
            found += (each for each in self._around(inner) if each not in found)
        return found

    def left(self, node: e.FlowNode) -> Iterator[e.FlowNode]:
        """What a token enters that has left a node, or the activities that end with it."""
        ended = [node]
        for each in ended:
            if isinstance(each, e.Activity) and each.loop is not None:
                yield each
            if isinstance(each.container, e.AdHocSubProcess):
                yield from each.container.entries
            onwards = [to for to in following(each) if getattr(to, "attached_to", None) is not each]
            yield from onwards
            ended += (outer for outer in self._around(each) if not onwards and outer not in ended)

    def _interrupted(self, node: e.FlowNode) -> Iterator[e.FlowNode]:
        """The events, and event subprocesses, that may begin while a token is on a node."""
        for each in self._outwards(node):
            yield from each.container.event_subprocesses
            yield from each.boundary if isinstance(each, e.Activity) else ()

    def _beside(self, task: e.FlowNode) -> Iterator[e.FlowNode]:
        """Where tokens may be that are not on the way of a task's own."""
        for node in self._outwards(task):
            container = node.container
            for fork in self._forks_in(container):
                beside = [entries for entries, led_to in fork if node not in led_to]
                yield from chain.from_iterable(beside if len(beside) < len(fork) else ())
            if isinstance(node, e.Activity):
                events = isinstance(node, e.SubProcess) and node.triggered_by_event
                yield from container.nodes if events or node.for_compensation else ()
                if isinstance(node.loop, MultiInstance) and not node.loop.sequential:
                    yield node
            if isinstance(container, e.Process) and container not in self._callers:
                for process in {*self._mission.processes} - {container, *self._callers}:
                    yield from (*process.entries, *filter(instantiates, process.nodes))

    def _forks_in(self, container: e.Container) -> list[_Fork]:
        if container not in self._forks:
            forks = self._forks[container] = list[_Fork]()
            if len(container.entries) > 1:
                forks.append([((each,), reach((each,))) for each in container.entries])
            for node in container.nodes:
                after: list[e.FlowNode] = [flow.target for flow in node.outgoing]
                boundary = node.boundary if isinstance(node, e.Activity) else ()
                if beside := [each for each in boundary if not each.interrupting]:
                    own = ((node, *after), {node, *reach(after, node)})
                    forks.append([own, *(((each,), reach((each,), node)) for each in beside)])
                one = isinstance(node, e.EventBasedGateway) and not node.parallel
                if len(after) > 1 and not one and not isinstance(node, e.ExclusiveGateway):
                    forks.append([((each,), reach((each,), node)) for each in after])
        return self._forks[container]
