"""The static check of take-offs: aircraft that are on the ground when a task commands them to fly.

A task is found if on all ways of the diagram that lead to it no take-off comes before, or a landing
since. What may happen at the same time may have happened before. So a finding is certain, but for
an aircraft that is in the air when the run begins: it is a warning.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import TypeAlias

from m2pem.findings import Finding, Severity
from m2pem.fleet.behaviors import FLOWN, SHARED, takeoff_first
from m2pem.fleet.fleet import Domain, Fleet
from m2pem.fleet.graph import Catalogue
from m2pem.fleet.shortage import joined
from m2pem.fleet.task_findings import TaskFindings
from m2pem.mission.behavior import Behavior, BehaviorType
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.elements import Activity, FlowNode
from m2pem.mission.mission import Mission
from m2pem.mission.token_flow import TokenFlow

Commanded: TypeAlias = Mapping[Activity, tuple[Behavior, Collection[ResourceId]]]
"""What tasks command: the behavior, and all vehicles that may perform it."""


def check_takeoffs(
    mission: Mission, commanded: Commanded, fleet: Fleet, catalogue: Catalogue
) -> Iterator[Finding]:
    """Find aircraft that are on the ground where they must fly, if their arbiters take off."""
    flow = TokenFlow(mission)
    led_to: dict[tuple[FlowNode | None, ...], set[FlowNode]] = {}
    aloft: dict[ResourceId, set[FlowNode]] = {}
    for name in dict.fromkeys(each for _, able in commanded.values() for each in able):
        vehicle = fleet.vehicles[name]
        own = vehicle.settings.get("sim")
        simulated = own if isinstance(own, Mapping) else vehicle.settings
        grounded = vehicle.domain is Domain.AIR and "altitude" not in simulated
        if grounded and any(each.name == "takeoff" for each in catalogue(name)):
            takeoffs, landings = _between(name, commanded)
            key = (*takeoffs, None, *landings)  # much the same for most of a large fleet
            if key not in led_to:
                led_to[key] = set[FlowNode]().union(
                    *(_led(flow, each, landings) for each in takeoffs)
                )
            aloft[name] = led_to[key]
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


def _led(flow: TokenFlow, takeoff: FlowNode, landings: Sequence[FlowNode]) -> set[FlowNode]:
    """Return the nodes that tokens may enter after a take-off, and before a landing after it: one
    beside it, on a parallel branch, may come before."""
    left, aside = [*flow.left(takeoff)], [*flow.aside(takeoff)]
    beside = flow.led_to(aside, ()) - flow.led_to(left, ())
    return flow.led_to([*left, *aside], [each for each in landings if each not in beside])


def _between(aircraft: ResourceId, commanded: Commanded) -> tuple[list[FlowNode], list[FlowNode]]:
    """Return the tasks from which, and those until which, an aircraft is in the air."""
    takeoffs, landings = list[FlowNode](), list[FlowNode]()
    for task, (behavior, resources) in commanded.items():
        # An arbiter's own behavior may take off, and so may an operator.
        known = (behavior.name, behavior.type) in SHARED
        if aircraft in resources and (not known or behavior.name in ("takeoff", "teleop")):
            takeoffs.append(task)
        elif behavior.name in ("land", "return_to_launch") and [*resources] == [aircraft]:
            landings.append(task)
    return takeoffs, landings
