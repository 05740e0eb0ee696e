"""Refuses to start a mission whose vehicles or payloads other runs or operators have."""

from collections.abc import Callable, Container, Mapping

from m2pem.errors import BusyError
from m2pem.fleet.allocation import resources_of_mission
from m2pem.fleet.fleet import Fleet
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.mission import Mission


def refuse_busy(
    mission: Mission,
    fleet: Fleet,
    taken: Mapping[ResourceId, str],
    holder: Callable[[ResourceId], str | None],
    over: Container[str],
) -> None:
    """Check that everything that a mission names is free now.

    `taken`: the operators who have resources. `holder`: the behavior that holds a resource.
    `over`: runs that have ended; a vehicle may still come to a stand for one.

    Raises:
        BusyError: it is not; the error says who has what, and what to do.
    """
    runs: dict[str, list[ResourceId]] = {}
    operators: dict[str, list[ResourceId]] = {}
    for resource in resources_of_mission(mission, fleet):
        if (operator := taken.get(resource)) is not None:
            operators.setdefault(operator, []).append(resource)
        elif (behavior := holder(resource)) is not None:
            runs.setdefault(behavior.partition(".")[0], []).append(resource)
    if not runs and not operators:
        return
    who = [f"run {run} uses {_list(names)}" for run, names in runs.items()]
    who += [f"{operator} has {_list(names)}" for operator, names in operators.items()]
    do = [
        f"wait until {_list(names)} has come to a stand: run {run} has ended"
        if run in over
        else f"wait until run {run} is done with {_list(names)}, or stop it"
        for run, names in runs.items()
    ]
    do += [f"have {operator} give back {_list(names)}" for operator, names in operators.items()]
    raise BusyError(
        f"the mission was not started, because what it needs is busy: {'; '.join(who)}. "
        f"First {'; '.join(do)}: a task for what is busy ends with RESOURCE_UNAVAILABLE",
        {
            str(resource): holder
            for having in (runs, operators)
            for holder, names in having.items()
            for resource in names
        },
    )


def _list(names: list[ResourceId]) -> str:
    return ", ".join(names)
