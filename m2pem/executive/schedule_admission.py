"""Whether a mission may be scheduled: it fits the fleet, and so does what its start waits for."""

import asyncio
from collections.abc import Container, Sequence

from m2pem.api.authoring import MissionSource
from m2pem.api.schedule import EntryId, When, host_time_zone
from m2pem.errors import ExpressionError, ScheduleError
from m2pem.executive.run_starter import RunStarter
from m2pem.executive.scheduled_runs import refuse_unattended
from m2pem.executive.scheduled_start import vehicles_of
from m2pem.executive.supervisor import Supervisor
from m2pem.fleet.allocation import resources_of_mission
from m2pem.fleet.facts import fleet_facts
from m2pem.mission.candidate_facts import FLEET_FACTS
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.expression import Expression
from m2pem.mission.expression.partial import possible_truth
from m2pem.mission.values import Value
from m2pem.scheduling.entry import SchedulePlan
from m2pem.scheduling.times import condition_of, resolved
from m2pem.suggestions import did_you_mean


async def planned(
    supervisor: Supervisor,
    starter: RunStarter,
    known: Container[EntryId],
    mission: MissionSource,
    when: When,
    process: str | None,
    data: dict[str, Value],
    priority: int,
    by: str,
) -> tuple[SchedulePlan, tuple[ResourceId, ...]]:
    """Return the plan of an entry, and the resources that its mission names.

    `known`: the entries that it may come after. Others as in `MissionControl.schedule`.

    Raises:
        MissionError: with every finding, when the mission is not well or does not fit the fleet.
        ScheduleError: `when` makes no sense; or no mission may start unattended.
    """
    refuse_unattended(supervisor.fleet)
    now_us = supervisor.clock.now_us()
    when = resolved(when, now_us, host_time_zone())
    loaded, process_id = await asyncio.to_thread(starter.load, mission, process, data)
    named = resources_of_mission(loaded, supervisor.fleet)
    await _refuse_unknown(supervisor, known, when, named)
    plan = SchedulePlan(
        loaded.file,
        loaded.source,
        process_id,
        supervisor.fleet.name,
        now_us,
        when,
        loaded.library,
        data,
        supervisor.arbiters.nothing_is_real,
        priority,
        by,
    )
    return plan, named


async def _refuse_unknown(
    supervisor: Supervisor, known: Container[EntryId], when: When, named: Sequence[ResourceId]
) -> None:
    """Check that the vehicles of a condition, and what it comes after, are there.

    Raises:
        ScheduleError: they are not.
    """
    vehicles = supervisor.fleet.vehicles
    for name in when.vehicles:
        if name not in vehicles:
            hint = did_you_mean(name, vehicles) or f"it has {', '.join(vehicles)}"
            raise ScheduleError(f"vehicles (--of): the fleet has no {name!r}; {hint}", "vehicles")
    if when.condition and not when.vehicles and not vehicles_of(named):
        raise ScheduleError(
            "the mission names no vehicle: say of which the condition is to hold (vehicles, --of)",
            "vehicles",
        )
    if when.condition:
        for name in when.vehicles or vehicles_of(named):
            _refuse_impossible(supervisor, condition_of(when.condition), ResourceId(name))
    if when.after and when.after not in known:
        runs = await supervisor.journal.runs()
        if when.after not in {line.run for line in runs}:
            raise ScheduleError(
                f"after: there is no run and no entry of the schedule {when.after!r} to come "
                "after; `m2pem runs` and `m2pem schedule --all` list them",
                "after",
            )


def _refuse_impossible(supervisor: Supervisor, condition: Expression, vehicle: ResourceId) -> None:
    """Check that a condition can hold of a vehicle, as far as the fleet file says.

    Raises:
        ScheduleError: it cannot.
    """
    facts = fleet_facts(supervisor.fleet, supervisor.arbiters.graph, vehicle)
    try:
        holds = possible_truth(condition, FLEET_FACTS.__contains__, facts.get)
    except ExpressionError as error:
        raise ScheduleError(
            f"condition: {error}; write for example vehicle.battery > 0.9", "condition"
        ) from error
    if holds is False:
        raise ScheduleError(
            f"condition: {condition.text!r} never holds of {vehicle}: change it, or name "
            "other vehicles (vehicles, --of)",
            "condition",
        )
