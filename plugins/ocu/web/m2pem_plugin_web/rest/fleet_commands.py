"""/api/fleet/...: who has which vehicle and payload, and commands to them outside of missions.

A command names one resource or many. Each is commanded for itself: what is refused for one does not
keep the others, and the answer says it for each.
"""

import asyncio
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Annotated

from fastapi import APIRouter
from pydantic import BaseModel, Field

from m2pem.api import (
    MissionControl,
    ResourceId,
    RunId,
    RunStatus,
    RunView,
)
from m2pem.api import records as r
from m2pem.bpmn.one_task import is_one_task
from m2pem.errors import BusyError, FindingsError, M2pemError
from m2pem_plugin_web.access.permissions import Operator, Viewer
from m2pem_plugin_web.live.hub import Hub
from m2pem_plugin_web.problems import RESPONSES
from m2pem_plugin_web.rest.models import Body, Data, Name, Reason

MOST_RESOURCES = 1000

AT_A_TIME = 4
"""Commands of one request that are given side by side: each reads a small mission in a thread."""

HOLD = "hold"

RETURNED = "returned: held"
"""Of `MissionControl.unavailable`: it was lost, and can be commanded again."""

Resources = Annotated[list[Name], Field(min_length=1, max_length=MOST_RESOURCES)]


class ResourceStatusModel(BaseModel):
    """A vehicle or payload that is not just free.

    `holder`: an operator, a behavior ("r1.b3"), a request ("r1.a2"), or "". `run`: which commands
    it now, `task` with what, in words; "" for none. `direct`: it was commanded outside of a
    mission, by `by`; `held`: that is paused. `unavailable`: why missions do not get it now.
    """

    holder: str
    run: str
    task: str
    direct: bool
    by: str
    held: bool
    unavailable: str


class FleetStatusModel(BaseModel):
    """By vehicle and payload; what is free and can be had is missing."""

    resources: dict[str, ResourceStatusModel]


class ResourcesModel(Body):
    """Vehicles and payloads of the fleet."""

    resources: Resources


class GiveBackManyModel(ResourcesModel):
    """`reason`: of an operator who gives back what others have, who are gone."""

    reason: Reason = ""


class HoldModel(ResourcesModel):
    """`take`: take over first what a run or another's command has."""

    take: bool = False


class CommandModel(HoldModel):
    """A behavior with its parameters, as in a mission file: texts with units or names of
    geometries, numbers in SI, `[latitude, longitude]`, GeoJSON objects."""

    behavior: Name
    parameters: Data = Field(default_factory=dict)


class ResultModel(BaseModel):
    """What came of a command: `run` was started, "" for none; `problem`: why it was refused and
    what would help, "" if it was not."""

    resource: str
    run: str = ""
    problem: str = ""


class ResultsModel(BaseModel):
    """In the order of the request."""

    results: list[ResultModel]


class EffectModel(BaseModel):
    """What a command of this user would meet. `take`: it must be taken over first. `says`: what
    that, or the command itself, would end; `problem`: why it cannot be commanded, or ""."""

    resource: str
    take: bool
    says: list[str]
    problem: str


class PreviewModel(BaseModel):
    """In the order of the request."""

    effects: list[EffectModel]


@dataclass(frozen=True, slots=True)
class _Commanded:
    """A resource that a run commands. `by`: who commanded it outside of a mission."""

    run: RunId
    task: str
    is_direct: bool
    by: str
    is_held: bool


def router(control: MissionControl, hub: Hub) -> APIRouter:
    """The routes of the fleet. `hub` follows the runs."""
    routes = APIRouter(prefix="/api/fleet", tags=["fleet"], responses=RESPONSES)

    @routes.get("/status")
    async def status(_: Viewer) -> FleetStatusModel:
        """Who has what, for which run and task, and what missions do not get now."""
        return FleetStatusModel(resources=await _statuses(control, _commanded(hub)))

    @routes.post("/preview")
    async def preview(person: Operator, wanted: ResourcesModel) -> PreviewModel:
        """Say what a command of this user would end, before it is given."""
        commanded, holders = _commanded(hub), await control.holders()
        unavailable = await _out_of_reach(control)
        return PreviewModel(
            effects=[
                await _effect(control, each, person.name, commanded, holders, unavailable)
                for each in dict.fromkeys(wanted.resources)
            ]
        )

    @routes.post("/take")
    async def take(person: Operator, wanted: ResourcesModel) -> ResultsModel:
        """Take them from the missions, to command them by hand."""
        return await _each(wanted.resources, partial(control.take, by=person.name))

    @routes.post("/give-back")
    async def give_back(person: Operator, wanted: GiveBackManyModel) -> ResultsModel:
        """Give them back to the missions. Only who has one may, or another one with a reason."""
        give_back = partial(control.give_back, reason=wanted.reason, by=person.name)
        return await _each(wanted.resources, give_back)

    @routes.post("/request")
    async def request(person: Operator, wanted: ResourcesModel) -> ResultsModel:
        """Ask the operators who have them for them."""
        return await _each(wanted.resources, partial(control.request_control, by=person.name))

    @routes.post("/execute")
    async def execute(person: Operator, wanted: CommandModel) -> ResultsModel:
        """Command a behavior: a run for each, in the place of this user's last one."""
        commanded, unavailable = _commanded(hub), await _out_of_reach(control)

        async def command(resource: str) -> RunId:
            _refuse_unavailable(resource, unavailable)
            if wanted.take:
                await _take_if_needed(control, resource, person.name, commanded)
            return await control.execute_behavior(
                resource, wanted.behavior, wanted.parameters, by=person.name
            )

        return await _each(wanted.resources, command)

    @routes.post("/hold")
    async def hold(person: Operator, wanted: HoldModel) -> ResultsModel:
        """Hold what was commanded outside of missions; command `hold` to what is free."""
        commanded, unavailable = _commanded(hub), await _out_of_reach(control)

        async def command(resource: str) -> RunId:
            found = commanded.get(resource)
            if found is not None and found.is_direct:
                if not found.is_held:
                    await control.pause(found.run, by=person.name)
                return found.run
            _refuse_unavailable(resource, unavailable)
            if wanted.take:
                await _take_if_needed(control, resource, person.name, commanded)
            return await control.execute_behavior(resource, HOLD, by=person.name)

        return await _each(wanted.resources, command)

    @routes.post("/resume")
    async def resume(person: Operator, wanted: ResourcesModel) -> ResultsModel:
        """Go on with what is held."""
        commanded = _commanded(hub)

        async def command(resource: str) -> RunId:
            found = commanded.get(resource)
            if found is None or not (found.is_direct and found.is_held):
                raise _RefusedError(f"nothing that {resource} was commanded is held")
            await control.resume(found.run, by=person.name)
            return found.run

        return await _each(wanted.resources, command)

    return routes


class _RefusedError(Exception):
    """A command that makes no sense now."""


async def _each(
    resources: Sequence[str], command: Callable[[str], Awaitable[RunId | None]]
) -> ResultsModel:
    """Give a command to each resource, a few at a time."""
    turn = asyncio.Semaphore(AT_A_TIME)

    async def result(resource: str) -> ResultModel:
        async with turn:
            try:
                return ResultModel(resource=resource, run=await command(resource) or "")
            except (M2pemError, _RefusedError) as error:
                return ResultModel(resource=resource, problem=_in_words(resource, error))

    return ResultsModel(results=await asyncio.gather(*map(result, dict.fromkeys(resources))))


def _in_words(resource: str, error: Exception) -> str:
    """Why a command was refused, and what would help."""
    if isinstance(error, FindingsError):
        said = [" ".join(filter(None, (f.message, f.remedy))) for f in error.findings]
        return "; ".join(said) or error.what
    if isinstance(error, BusyError) and (holder := error.holders.get(resource)):
        return _busy(resource, holder)
    return str(error)


def _busy(resource: str, holder: str) -> str:
    """`holder`: a run or an operator."""
    if holder[:1] == "r" and holder[1:].isdigit():
        return (
            f"run {holder} has {resource}: take {resource} over, stop {holder}, "
            "or wait until it has ended"
        )
    return f"{holder} has {resource}: ask {holder} to give it back"


async def _out_of_reach(control: MissionControl) -> dict[str, str]:
    """Why resources that nobody has cannot be commanded, such as lost ones."""
    holders = await control.holders()
    return {
        str(resource): why
        for resource, why in (await control.unavailable()).items()
        if not holders.get(resource) and why != RETURNED
    }


def _unavailable(resource: str, why: str) -> str:
    return f"{resource} cannot be commanded now: {why}"


def _refuse_unavailable(resource: str, unavailable: Mapping[str, str]) -> None:
    """Refuse what would begin a run that fails at once."""
    if why := unavailable.get(resource):
        raise _RefusedError(_unavailable(resource, why))


async def _take_if_needed(
    control: MissionControl, resource: str, by: str, commanded: Mapping[str, _Commanded]
) -> None:
    holder = (await control.holders()).get(ResourceId(resource), "")
    if holder == by or not holder or _is_own(commanded.get(resource), by):
        return
    await control.take(resource, by=by)


def _is_own(found: _Commanded | None, by: str) -> bool:
    return found is not None and found.is_direct and found.by == by


async def _effect(
    control: MissionControl,
    resource: str,
    by: str,
    commanded: Mapping[str, _Commanded],
    holders: Mapping[ResourceId, str],
    unavailable: Mapping[str, str],
) -> EffectModel:
    known = ResourceId(resource)

    def effect(*says: str, take: bool = False, problem: str = "") -> EffectModel:
        return EffectModel(resource=resource, take=take, says=list(says), problem=problem)

    if known not in holders:
        return effect(problem=f"the fleet has no {resource}")
    holder, found = holders[known], commanded.get(resource)
    if _is_own(found, by):
        assert found is not None
        return effect(f"{found.task} ({found.run}), which you commanded, ends")
    if holder == by:
        return effect()
    if found is None and not holder:
        why = unavailable.get(resource)
        return effect(problem=_unavailable(resource, why) if why else "")
    if holder and holder != by and not _is_of_run(holder):
        return effect(problem=_busy(resource, holder))
    if found is not None and found.is_direct:
        return effect(f"{found.task} ({found.run}), which {found.by} commanded, ends", take=True)
    ends = [str(each) for each in await control.preview_take(resource)]
    return effect(*(ends or [f"{holder.partition('.')[0]} does not get it any more"]), take=True)


def _is_of_run(holder: str) -> bool:
    run, dot, _ = holder.partition(".")
    return bool(dot) and run[:1] == "r" and run[1:].isdigit()


async def _statuses(
    control: MissionControl, commanded: Mapping[str, _Commanded]
) -> dict[str, ResourceStatusModel]:
    holders, unavailable = await control.holders(), await control.unavailable()
    labels = await control.holder_labels()
    found: dict[str, ResourceStatusModel] = {}
    for resource, holder in holders.items():
        now, why = commanded.get(resource), unavailable.get(resource, "")
        if not (holder or now or why):
            continue
        run = holder.partition(".")[0] if _is_of_run(holder) else ""
        found[resource] = ResourceStatusModel(
            holder=holder,
            run=now.run if now is not None else run,
            task=now.task if now is not None else labels.get(holder, ""),
            direct=now is not None and now.is_direct,
            by=now.by if now is not None else "",
            held=now is not None and now.is_held,
            unavailable=why,
        )
    return found


def _commanded(hub: Hub) -> dict[str, _Commanded]:
    """What runs command now, by vehicle and payload."""
    found: dict[str, _Commanded] = {}
    for live in hub.runs.values():
        view = live.view
        if view.status not in (RunStatus.RUNNING, RunStatus.PAUSED):
            continue
        is_direct = view.mission is not None and is_one_task(view.mission)
        by = _started_by(view) if is_direct else ""
        is_held = view.status is RunStatus.PAUSED
        for behavior in view.behaviors.values():
            task = view.label(behavior.element)
            for resource in behavior.resources:
                found[resource] = _Commanded(view.run, task, is_direct, by, is_held)
    return found


def _started_by(view: RunView) -> str:
    """Who started a run of few records."""
    return next((s.record.by for s in view.newest if isinstance(s.record, r.RunStarted)), "")
