"""/api/alerts: what operators must know now, who has seen it, and who takes care."""

from typing import Annotated

from fastapi import APIRouter
from pydantic import Field

from m2pem.api import MAX_NAME_CHARACTERS, MissionControl
from m2pem_plugin_web.access.permissions import Operator, Viewer
from m2pem_plugin_web.problems import RESPONSES, ProblemError
from m2pem_plugin_web.rest.models import Answer, Body


class AlertModel(Answer):
    """An alert (docs/operating.md#alerts). Times are microseconds since the Unix epoch, by the
    executive's clock; null: there is none.

    `subject`: the id of a prompt or incident. `age_s`, `left_s`: seconds since it was raised (of
    one that is over: until it was), and until the deadline, by that clock. `calls`: it is open, and
    nobody has acknowledged it.
    """

    alert: str
    severity: str
    code: str
    text: str
    raised_us: int
    last_us: int
    run: str
    resources: list[str]
    subject: str
    count: int
    details: list[str]
    deadline_us: int | None
    cleared_us: int | None
    acknowledged_by: str
    acknowledged_us: int | None
    owner: str
    owned_us: int | None
    age_s: float
    left_s: float | None
    calls: bool


class OwnModel(Body):
    """Who takes care. Null: who asks; "": no operator any more."""

    owner: Annotated[str, Field(max_length=MAX_NAME_CHARACTERS)] | None = None


def router(control: MissionControl) -> APIRouter:
    """The routes of alerts."""
    routes = APIRouter(prefix="/api/alerts", tags=["alerts"], responses=RESPONSES)

    @routes.get("")
    async def alerts(_: Viewer, over: bool = False) -> list[AlertModel]:
        """The alerts that are open, the most severe first; with `over`, then those that are
        over."""
        return [AlertModel.of(each) for each in await control.alerts(over=over)]

    async def known(alert: str) -> None:
        if alert not in {each.alert for each in await control.alerts(over=True)}:
            raise ProblemError(404, f"there is no alert {alert}")

    @routes.post("/{alert}/acknowledge", status_code=204)
    async def acknowledge(person: Operator, alert: str) -> None:
        """Note that the user has seen an alert."""
        await known(alert)
        await control.acknowledge_alert(alert, by=person.name)

    @routes.post("/{alert}/own", status_code=204)
    async def own(person: Operator, alert: str, wanted: OwnModel) -> None:
        """Note who takes care of an alert."""
        await known(alert)
        await control.own_alert(alert, owner=wanted.owner, by=person.name)

    return routes
