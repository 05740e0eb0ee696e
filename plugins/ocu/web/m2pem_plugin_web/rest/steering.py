"""/api/runs/{run}/...: what operators do with a run that goes on; and with all of them at once."""

from fastapi import APIRouter
from pydantic import BaseModel

from m2pem.api import MissionControl
from m2pem_plugin_web.access.people import Operator
from m2pem_plugin_web.problems import RESPONSES
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


def router(control: MissionControl) -> APIRouter:
    """The routes of steering."""
    routes = APIRouter(prefix="/api", tags=["steering"], responses=RESPONSES)

    @routes.post("/stop-all")
    @routes.post("/stop", include_in_schema=False)
    async def stop_all(person: Operator, wanted: StopModel) -> StoppedModel:
        """Stop every run that goes on. One that cannot be stopped does not keep the others."""
        return StoppedModel(runs=list(await control.stop_all(by=person.name, reason=wanted.reason)))

    @routes.post("/runs/{run}/stop", status_code=204)
    async def stop(person: Operator, run: str, wanted: StopModel) -> None:
        """End every token of a run, and cancel its behaviors."""
        await find_run(control, run)
        await control.stop(run, by=person.name, reason=wanted.reason)

    @routes.post("/runs/{run}/pause", status_code=204)
    async def pause(person: Operator, run: str) -> None:
        """Hold the vehicles of a run, and its time."""
        await find_run(control, run)
        await control.pause(run, by=person.name)

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
