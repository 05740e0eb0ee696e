"""The static check of take-offs: aircraft that are on the ground when a task commands them to fly.

A task is found if on all ways of the diagram that lead to it no take-off comes before, or a landing
since. What may happen at the same time may have happened before. So a finding is certain, but for
an aircraft that is in the air when the run begins: it is a warning.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import chain
from typing import TypeAlias

from m2pem.findings import Finding, Severity
from m2pem.fleet.behaviors import FLOWN, SHARED, takeoff_first
from m2pem.fleet.fleet import Domain, Fleet
from m2pem.fleet.graph import Catalogue
from m2pem.fleet.shortage import joined
from m2pem.fleet.task_findings import TaskFindings
from m2pem.mission import elements as e
from m2pem.mission.behavior import Behavior, BehaviorType
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.loops import MultiInstance
from m2pem.mission.mission import Mission
from m2pem.mission.reachability import following, instantiates, reach

Commanded: TypeAlias = Mapping[e.Activity, tuple[Behavior, Collection[ResourceId]]]
"""What tasks command: the behavior, and all vehicles that may perform it."""

_Nodes: TypeAlias = Sequence[e.FlowNode]
_Fork: TypeAlias = list[tuple[_Nodes, set[e.FlowNode]]]
"""Where tokens begin that come to be several, and what each leads to before that happens again."""


def check_takeoffs(
    mission: Mission, commanded: Commanded, fleet: Fleet, catalogue: Catalogue
) -> Iterator[Finding]:
    """Find aircraft that are on the ground where they must fly, if their arbiters take off."""
    flow = _Flow(mission)
    aloft: dict[ResourceId, set[e.FlowNode]] = {}
    for name in dict.fromkeys(each for _, able in commanded.values() for each in able):
        vehicle = fleet.vehicles[name]
        own = vehicle.settings.get("sim")
        simulated = own if isinstance(own, Mapping) else vehicle.settings
        grounded = vehicle.domain is Domain.AIR and "altitude" not in simulated
        if grounded and any(each.name == "takeoff" for each in catalogue(name)):
            aloft[name] = flow.where_aloft(name, commanded)
    for task, (behavior, resources) in commanded.items():
        team = behavior.type is BehaviorType.TEAM
        must_fly = behavior.name in FLOWN or (team and (behavior.name, behavior.type) in SHARED)
        landed = [each for each in resources if each in aloft and task not in aloft[each]]
        if must_fly and landed and (team or len(landed) == len(resources)):
            yield TaskFindings(mission.file_of(task), task).add(
                "no-takeoff",
                f"{takeoff_first(joined(landed))}; no way to this task has a take-off after the"
                " last landing",
                "command `takeoff` before; what is in the air when the run begins needs none",
                line=behavior.line,
                severity=Severity.WARNING,
            )


class _Flow:
    """The ways that tokens take, across subprocesses and calls."""

    def __init__(self, mission: Mission) -> None:
        self._mission = mission
        self._callers: dict[e.Container, list[e.FlowNode]] = {}
        for node in mission.nodes:
            if isinstance(node, e.CallActivity):
                self._callers.setdefault(node.called, []).append(node)
        self._forks: dict[e.Container, list[_Fork]] = {}
        self._found: dict[tuple[e.FlowNode | None, ...], set[e.FlowNode]] = {}

    def where_aloft(self, aircraft: ResourceId, commanded: Commanded) -> set[e.FlowNode]:
        """Return the nodes that a token may enter while an aircraft is in the air."""
        takeoffs, landings = list[e.FlowNode](), list[e.FlowNode]()
        for task, (behavior, resources) in commanded.items():
            # An arbiter's own behavior may take off, and so may an operator.
            known = (behavior.name, behavior.type) in SHARED
            if aircraft in resources and (not known or behavior.name in ("takeoff", "teleop")):
                takeoffs.append(task)
            elif behavior.name in ("land", "return_to_launch") and [*resources] == [aircraft]:
                landings.append(task)
        key = (*takeoffs, None, *landings)  # much the same is asked of most of a large fleet
        if key not in self._found:
            self._found[key] = self._led_to(takeoffs, landings)
        return self._found[key]

    def _led_to(self, takeoffs: _Nodes, landings: _Nodes) -> set[e.FlowNode]:
        found, waiting = set[e.FlowNode](), list[e.FlowNode]()
        for task in takeoffs:
            waiting += (*self._left(task), *self._interrupted(task), *self._beside(task))
        if waiting:
            waiting += (each for each in self._mission.activities() if each.for_compensation)
        while waiting:
            node = waiting.pop()
            if node in found:
                continue
            found.add(node)
            waiting += self._interrupted(node)
            inside = node.called if isinstance(node, e.CallActivity) else node
            if isinstance(inside, e.Process | e.SubProcess) and inside.entries:
                waiting += inside.entries
            elif node not in landings:
                waiting += self._left(node)
        return found

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

    def _left(self, node: e.FlowNode) -> Iterator[e.FlowNode]:
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
            forks: list[_Fork] = [[((each,), reach((each,))) for each in container.entries]]
            for node in container.nodes:
                after: list[e.FlowNode] = [flow.target for flow in node.outgoing]
                if isinstance(node, e.Activity):
                    beside = [each for each in node.boundary if not each.interrupting]
                    own = ((node, *after), {node, *reach(after, node)})
                    forks.append([own, *(((each,), reach((each,), node)) for each in beside)])
                one = isinstance(node, e.EventBasedGateway) and not node.parallel
                if not one and not isinstance(node, e.ExclusiveGateway):
                    forks.append([((each,), reach((each,), node)) for each in after])
            self._forks[container] = [each for each in forks if len(each) > 1]
        return self._forks[container]
