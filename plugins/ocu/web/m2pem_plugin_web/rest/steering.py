"""/api/runs/{run}/..., /api/prompts, /api/resources: what operators do with runs and vehicles."""

from typing import Any

from fastapi import APIRouter, Request
from pydantic import BaseModel

from m2pem.api import MissionControl
from m2pem.api.allocation import SharedSpaceState, SpaceHolder, WaitingTask
from m2pem.fleet.fleet import Fleet
from m2pem.geo.geojson import as_geojson
from m2pem.mission.geometry import Area, Route
from m2pem_plugin_web.access.permissions import Operator, Stopper, Viewer
from m2pem_plugin_web.access.requests import LATEST_S, age_s
from m2pem_plugin_web.access.roles import Person
from m2pem_plugin_web.live.hub import Hub
from m2pem_plugin_web.live.messages import prompt_of
from m2pem_plugin_web.problems import RESPONSES, ProblemError
from m2pem_plugin_web.rest.models import (
    Answer,
    Body,
    Data,
    Name,
    PromptModel,
    Reason,
    known_resource,
    known_run,
)


class StopModel(Body):
    """Why, for the journal."""

    reason: Reason = ""


class SignalModel(Body):
    """A signal, by its id or its name."""

    signal: Name
    data: Data | None = None


class MessageModel(Body):
    """A message, by its id."""

    message: Name
    data: Data | None = None


class StoppedModel(BaseModel):
    """The runs that were stopped."""

    runs: list[str]


def router(control: MissionControl, hub: Hub) -> APIRouter:
    """The routes of steering. A STOP that arrives late is carried out, and every page says so."""
    routes = APIRouter(prefix="/api", tags=["steering"], responses=RESPONSES)

    def reason_of(request: Request, person: Person, what: str, wanted: StopModel) -> str:
        try:
            age = age_s(request)
        except ProblemError:  # whatever its clock says, a STOP is a STOP
            age = 0.0
        if age <= LATEST_S:
            return wanted.reason
        late = f"given {age:.0f} s before it arrived"
        hub.announce(f"{what} by {person.name} was {late}; it is carried out")
        return f"{wanted.reason} ({late})".lstrip()

    @routes.post("/stop-all")
    @routes.post("/stop", include_in_schema=False)
    async def stop_all(request: Request, person: Stopper, wanted: StopModel) -> StoppedModel:
        """Stop every run that goes on. One that cannot be stopped does not keep the others."""
        reason = reason_of(request, person, "STOP of all runs", wanted)
        return StoppedModel(runs=list(await control.stop_all(by=person.name, reason=reason)))

    @routes.post("/runs/{run}/stop", status_code=204)
    async def stop(request: Request, person: Stopper, run: str, wanted: StopModel) -> None:
        """End every token of a run, and cancel its behaviors."""
        reason = reason_of(request, person, f"STOP of {run}", wanted)
        async with known_run(control, run):
            await control.stop(run, by=person.name, reason=reason)

    @routes.post("/runs/{run}/pause", status_code=204)
    async def pause(person: Operator, run: str) -> None:
        """Hold the vehicles of a run, and its time."""
        async with known_run(control, run):
            await control.pause(run, by=person.name)

    @routes.post("/runs/{run}/resume", status_code=204)
    async def resume(person: Operator, run: str) -> None:
        """Go on after a pause."""
        async with known_run(control, run):
            await control.resume(run, by=person.name)

    @routes.post("/signals", status_code=204)
    async def signal_all(person: Operator, wanted: SignalModel) -> None:
        """Throw a signal in every run that has it."""
        await control.signal(wanted.signal, data=wanted.data, by=person.name)

    @routes.post("/runs/{run}/signals", status_code=204)
    async def signal(person: Operator, run: str, wanted: SignalModel) -> None:
        """Throw a signal in a run."""
        async with known_run(control, run):
            await control.signal(wanted.signal, run=run, data=wanted.data, by=person.name)

    @routes.post("/runs/{run}/messages", status_code=204)
    async def message(person: Operator, run: str, wanted: MessageModel) -> None:
        """Send a message to a run."""
        async with known_run(control, run):
            await control.message(wanted.message, run=run, data=wanted.data, by=person.name)

    return routes


class AnswerModel(Body):
    """The `value` of one of the decisions."""

    decision: Name


def prompt_router(control: MissionControl, hub: Hub) -> APIRouter:
    """The routes of prompts."""
    routes = APIRouter(prefix="/api", tags=["prompts"], responses=RESPONSES)

    @routes.get("/prompts")
    async def prompts(_: Viewer) -> list[PromptModel]:
        """The questions that stand."""
        return [
            PromptModel.model_validate(prompt_of(each, hub.place(each)))
            for each in control.prompts()
        ]

    @routes.post("/runs/{run}/prompts/{prompt}", status_code=204)
    async def answer(person: Operator, run: str, prompt: str, wanted: AnswerModel) -> None:
        """Answer a question. The first answer to it wins."""
        async with known_run(control, run):
            await control.answer(run, prompt, wanted.decision, by=person.name)

    return routes


class SharedSpaceModel(Answer):
    """A shared space of the fleet file: `MissionControl.shared_space`. `geometry` (GeoJSON): an
    area, or a route with a corridor of `width_m`. `waiting`: the tasks that wait for a place."""

    name: str
    capacity: int
    geometry: dict[str, Any]
    width_m: float | None
    holders: list[SpaceHolder]
    waiting: list[WaitingTask]


def space_model(fleet: Fleet, state: SharedSpaceState) -> SharedSpaceModel:
    """A shared space as JSON."""
    geometry = fleet.geometries[state.name]
    assert isinstance(geometry, Area | Route)
    return SharedSpaceModel.of(
        state,
        geometry=as_geojson(geometry)["geometry"],
        width_m=fleet.shared_space[state.name].width_m,
    )


class HoldersModel(BaseModel):
    """Who has each resource: an operator, a behavior ("r1.b3"), a request ("r1.a2"), or "" when it
    is free. `labels`: the task and run of each behavior and request, by its id. `waiting`: the
    tasks that wait for some, in the order in which they are served."""

    holders: dict[str, str]
    labels: dict[str, str]
    waiting: list[WaitingTask]
    shared_space: list[SharedSpaceModel]
    unavailable: dict[str, str]


class GiveBackModel(Body):
    """`reason`: of an operator who gives back what another one has, who is gone."""

    reason: Reason = ""


def resource_router(control: MissionControl) -> APIRouter:
    """The routes of resources."""
    routes = APIRouter(prefix="/api/resources", tags=["resources"], responses=RESPONSES)

    @routes.get("")
    async def holders(_: Viewer) -> HoldersModel:
        """Who has what, which tasks wait, and what missions do not get now, and why."""
        found = await control.holders()
        return HoldersModel(
            holders={str(each): who for each, who in found.items()},
            labels=dict(await control.holder_labels()),
            waiting=list(await control.waiting()),
            shared_space=[
                space_model(control.fleet(), each) for each in await control.shared_space()
            ],
            unavailable={str(each): why for each, why in (await control.unavailable()).items()},
        )

    @routes.post("/{resource:path}/take", status_code=204)
    async def take(person: Operator, resource: str) -> None:
        """Take it from the missions, to steer it by hand."""
        await known_resource(control, resource)
        await control.take(resource, by=person.name)

    @routes.post("/{resource:path}/give-back", status_code=204)
    async def give_back(
        person: Operator, resource: str, wanted: GiveBackModel | None = None
    ) -> None:
        """Give it back to the missions. Only who has it may, or another one with a reason."""
        await known_resource(control, resource)
        reason = wanted.reason if wanted is not None else ""
        await control.give_back(resource, reason=reason, by=person.name)

    return routes
