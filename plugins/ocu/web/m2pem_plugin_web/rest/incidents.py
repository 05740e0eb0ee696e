"""/api/incidents, /api/runs/{run}/incidents/...: errors about which operators decide."""

from collections.abc import Sequence

from fastapi import APIRouter

from m2pem.api import IncidentPreview, MissionControl, OpenIncident
from m2pem_plugin_web.access.permissions import Operator, Viewer
from m2pem_plugin_web.problems import RESPONSES
from m2pem_plugin_web.rest.models import Answer, Body, Data, Name, known_run


class ChoiceModel(Body):
    """What is chosen: one of the incident's `choices`, with what it needs."""

    choice: Name
    data: Data | None = None
    to: str = ""
    roles: dict[str, list[str]] | None = None


class ResolveModel(ChoiceModel):
    """As for a preview. `even_if_stuck`: an operator has confirmed a choice after which the mission
    cannot complete."""

    even_if_stuck: bool = False


class RequirementOutlookModel(Answer):
    """What follows for a requirement. `requirement`: its id; `english`: what it says; `text`:
    verdict and reason in a sentence."""

    requirement: str
    english: str
    verdict: str
    reason: str
    text: str


class OutlookModel(Answer):
    """What follows a choice. `text`: verdict and reason in a sentence; `requirements`: what
    follows for those that the run is monitored for, and that are open."""

    verdict: str
    reason: str
    text: str
    requirements: list[RequirementOutlookModel]


def outlook_model(preview: IncidentPreview) -> OutlookModel:
    """Return what follows as JSON."""
    requirements = [
        RequirementOutlookModel.of(each, english=each.text, text=str(each))
        for each in preview.requirements
    ]
    return OutlookModel.of(preview, text=preview.completion, requirements=requirements)


def router(control: MissionControl) -> APIRouter:
    """The routes of incidents."""
    routes = APIRouter(prefix="/api", tags=["incidents"], responses=RESPONSES)

    @routes.get("/incidents")
    async def incidents(_: Viewer) -> Sequence[OpenIncident]:
        """The incidents of all runs that are open."""
        return await control.incidents()

    @routes.post("/runs/{run}/incidents/{incident}/preview")
    async def preview(_: Operator, run: str, incident: str, wanted: ChoiceModel) -> OutlookModel:
        """Whether the mission still completes after a choice."""
        async with known_run(control, run):
            found = await control.preview_incident(
                run,
                incident,
                wanted.choice,
                data=wanted.data,
                to=wanted.to,
                roles=wanted.roles,
            )
        return outlook_model(found)

    @routes.post("/runs/{run}/incidents/{incident}", status_code=204)
    async def resolve(person: Operator, run: str, incident: str, wanted: ResolveModel) -> None:
        """Decide about an incident. The first choice wins."""
        async with known_run(control, run):
            await control.resolve_incident(
                run,
                incident,
                wanted.choice,
                data=wanted.data,
                to=wanted.to,
                roles=wanted.roles,
                by=person.name,
                even_if_stuck=wanted.even_if_stuck,
            )

    return routes
