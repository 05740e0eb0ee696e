"""/api/schedule: missions that start later, and what operators do with them."""

from typing import Annotated

import msgspec
from fastapi import APIRouter
from pydantic import BaseModel, Field

from m2pem.api import Concurrency, Draft, Missed, MissionControl, When
from m2pem_plugin_web.access.permissions import Commander, Operator, Stopper, Viewer
from m2pem_plugin_web.missions.folder import MissionFolder
from m2pem_plugin_web.problems import RESPONSES, ProblemError
from m2pem_plugin_web.rest.drafts import WrittenName, of_folder
from m2pem_plugin_web.rest.models import Answer, Body, Data, Name, Reason

Seconds = Annotated[float, Field(ge=0)]
MOST_VEHICLES = 1000


class WhenModel(Body):
    """When to start, as docs/scheduling.md says. Without `at` and `cron`: as soon as its vehicles
    are free. `time_zone`: an IANA name, of a date without an offset and of `cron`."""

    at: Annotated[str, Field(max_length=100)] = ""
    cron: Annotated[str, Field(max_length=100)] = ""
    time_zone: Annotated[str, Field(max_length=100)] = ""
    until: Annotated[str, Field(max_length=100)] = ""
    after: Annotated[str, Field(max_length=100)] = ""
    outcomes: list[str] = Field(default=["completed"], max_length=4)
    condition: Annotated[str, Field(max_length=10_000)] = ""
    vehicles: list[Name] = Field(default=[], max_length=MOST_VEHICLES)
    held_for_s: Seconds = 0.0
    starting_deadline_s: Seconds | None = None
    missed: Annotated[Missed, Field(strict=False)] = Missed.SKIP
    concurrency: Annotated[Concurrency, Field(strict=False)] = Concurrency.FORBID

    def when(self) -> When:
        """Return it as the executive takes it."""
        return msgspec.convert(self.model_dump(), When, strict=False)


class ToScheduleModel(Body):
    """What to start, and when. `version`: of the mission, None for its newest."""

    mission: WrittenName
    version: str | None = None
    process: Name | None = None
    data: Data | None = None
    when: WhenModel = WhenModel()
    priority: int = 0


class EntryModel(BaseModel):
    """The id of the entry."""

    entry: str


class StartedModel(BaseModel):
    """The id of the run."""

    run: str


class HoldModel(Body):
    """Why, for the journal."""

    reason: Reason = ""


class SettledTimeModel(Answer):
    """What became of a time: started, missed (`times` of them together), or refused."""

    due_us: int
    at_us: int
    settlement: str
    run: str
    text: str
    times: int


class ScheduledMissionModel(Answer):
    """An entry of the schedule. Times are microseconds since the Unix epoch by the executive's
    clock; null: there is none. `when`: in words."""

    entry: str
    mission: str
    process: str
    when: str
    time_zone: str
    status: str
    priority: int
    by: str
    next_us: int | None
    due_us: int | None
    deadline_us: int | None
    starts_us: int | None
    reason: str
    run: str
    times: list[SettledTimeModel]


class ScheduleModel(Answer):
    """The schedule of the executive's fleet. `hold`: who holds it and why; "": no operator."""

    hold: str
    served: bool
    warning_s: float
    entries: list[ScheduledMissionModel]


def router(control: MissionControl, folder: MissionFolder) -> APIRouter:
    """The routes of the schedule. To hold it is to stop something: that is never too late."""
    routes = APIRouter(prefix="/api/schedule", tags=["schedule"], responses=RESPONSES)

    @routes.get("")
    async def scheduled(_: Viewer) -> ScheduleModel:
        """What starts when, and what it waits for."""
        found = await control.scheduled()
        entries = [
            ScheduledMissionModel.of(each, when=each.when_text, time_zone=each.when.time_zone)
            for each in found.entries
        ]
        return ScheduleModel.of(found, entries=entries)

    @routes.post("", status_code=201)
    async def schedule(person: Commander, wanted: ToScheduleModel) -> EntryModel:
        """Have a mission started later."""
        source = await of_folder(folder.source, wanted.mission, wanted.version)
        entry = await control.schedule(
            Draft(folder.file(wanted.mission), source),
            when=wanted.when.when(),
            process=wanted.process,
            data=wanted.data,
            priority=wanted.priority,
            by=person.name,
        )
        return EntryModel(entry=entry)

    @routes.post("/hold", status_code=204)
    async def hold(person: Stopper, wanted: HoldModel) -> None:
        """Hold the whole schedule: nothing starts until it is released."""
        await control.hold_schedule(by=person.name, reason=wanted.reason)

    @routes.post("/release", status_code=204)
    async def release(person: Commander) -> None:
        """Let the schedule start missions again."""
        await control.release_schedule(by=person.name)

    async def known(entry: str) -> None:
        if entry not in {each.entry for each in (await control.scheduled()).entries}:
            raise ProblemError(404, f"there is no entry {entry} in the schedule")

    @routes.post("/{entry}/cancel", status_code=204)
    async def cancel(person: Operator, entry: str) -> None:
        """Cancel an entry: it starts nothing any more."""
        await known(entry)
        await control.unschedule(entry, by=person.name)

    @routes.post("/{entry}/start", status_code=201)
    async def start(person: Commander, entry: str) -> StartedModel:
        """Start the mission of an entry now, whatever it waits for."""
        await known(entry)
        return StartedModel(run=await control.start_scheduled(entry, by=person.name))

    @routes.post("/{entry}/hold", status_code=204)
    async def hold_entry(person: Stopper, entry: str, wanted: HoldModel) -> None:
        """Hold an entry."""
        await known(entry)
        await control.hold_schedule(entry, by=person.name, reason=wanted.reason)

    @routes.post("/{entry}/release", status_code=204)
    async def release_entry(person: Commander, entry: str) -> None:
        """Let an entry start missions again."""
        await known(entry)
        await control.release_schedule(entry, by=person.name)

    return routes
