"""/api/runs/{run}/...: what operators do with a run that goes on; and with all of them at once."""

from fastapi import APIRouter, Request
from pydantic import BaseModel

from m2pem.api import MissionControl
from m2pem.errors import NotDrivenError
from m2pem_plugin_web.access.lateness import LONGEST_S, age_s
from m2pem_plugin_web.access.people import Operator, Person, Stopper
from m2pem_plugin_web.live.hub import Hub
from m2pem_plugin_web.problems import RESPONSES, ProblemError
from m2pem_plugin_web.rest.lookup import find_run
from m2pem_plugin_web.rest.models import Body, Data, Name, Reason


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
        if age <= LONGEST_S:
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
        try:
            # Not after a look into the journal, which may be what does not answer.
            await control.stop(run, by=person.name, reason=reason)
        except NotDrivenError:
            await find_run(control, run)
            raise

    @routes.post("/runs/{run}/pause", status_code=204)
    async def pause(person: Operator, run: str) -> None:
        """Hold the vehicles of a run, and its time."""
        try:
            await control.pause(run, by=person.name)
        except NotDrivenError:
            await find_run(control, run)
            raise

    @routes.post("/runs/{run}/resume", status_code=204)
    async def resume(person: Operator, run: str) -> None:
        """Go on after a pause."""
        await find_run(control, run)
        await control.resume(run, by=person.name)

    @routes.post("/signals", status_code=204)
    async def signal_all(person: Operator, wanted: SignalModel) -> None:
        """Throw a signal in every run that has it."""
        await control.signal(wanted.signal, data=wanted.data, by=person.name)

    @routes.post("/runs/{run}/signals", status_code=204)
    async def signal(person: Operator, run: str, wanted: SignalModel) -> None:
        """Throw a signal in a run."""
        await find_run(control, run)
        await control.signal(wanted.signal, run=run, data=wanted.data, by=person.name)

    @routes.post("/runs/{run}/messages", status_code=204)
    async def message(person: Operator, run: str, wanted: MessageModel) -> None:
        """Send a message to a run."""
        await find_run(control, run)
        await control.message(wanted.message, run=run, data=wanted.data, by=person.name)

    return routes
