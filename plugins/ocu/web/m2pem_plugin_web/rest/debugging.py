"""/api/runs/{run}/breakpoints, step, data, value: runs that are debugged (docs/debugging.md)."""

from collections.abc import Sequence
from typing import Annotated

from fastapi import APIRouter, Query
from pydantic import Field, StringConstraints

from m2pem.api import MissionControl, ScopeData
from m2pem.api.runs import ExpressionValue
from m2pem_plugin_web.access.permissions import Operator, Viewer
from m2pem_plugin_web.problems import RESPONSES
from m2pem_plugin_web.rest.models import Body, Data, Name, known_run

MAX_SCOPE = 2**31 - 1
Condition = Annotated[str, StringConstraints(min_length=1, max_length=2_000)]


class BreakpointsModel(Body):
    """Ids of elements, and conditions over the data."""

    elements: Annotated[list[Name], Field(default_factory=list)]
    conditions: Annotated[list[Condition], Field(default_factory=list)]


class DataModel(Body):
    """Values by name, and the number of the scope that sees them; 0: the first process."""

    data: Data
    scope: Annotated[int, Field(ge=0, le=MAX_SCOPE)] = 0


def router(control: MissionControl) -> APIRouter:
    """The routes of debugging."""
    routes = APIRouter(prefix="/api", tags=["debugging"], responses=RESPONSES)

    @routes.put("/runs/{run}/breakpoints", status_code=204)
    async def set_breakpoints(person: Operator, run: str, wanted: BreakpointsModel) -> None:
        """Pause a run where a token comes to an element, or when a condition becomes true."""
        async with known_run(control, run):
            await control.set_breakpoints(run, wanted.elements, wanted.conditions, by=person.name)

    @routes.post("/runs/{run}/step", status_code=204)
    async def step(person: Operator, run: str) -> None:
        """Execute one step of a paused run."""
        async with known_run(control, run):
            await control.step(run, by=person.name)

    @routes.post("/runs/{run}/data", status_code=204)
    async def set_data(person: Operator, run: str, wanted: DataModel) -> None:
        """Change data of a paused run."""
        async with known_run(control, run):
            await control.set_data(run, wanted.data, scope=wanted.scope, by=person.name)

    @routes.get("/runs/{run}/data")
    async def data(_: Viewer, run: str) -> Sequence[ScopeData]:
        """Return the data of a run that goes on: of its data stores, then of each active process,
        and of subprocesses and tasks that have some."""
        async with known_run(control, run):
            return await control.data(run)

    @routes.get("/runs/{run}/value")
    async def value(
        _: Viewer, run: str, expression: Condition, token: Annotated[int, Query(ge=0)] = 0
    ) -> ExpressionValue:
        """Return the value of an expression, as the element sees the data that a token is on; 0:
        as the first process does."""
        async with known_run(control, run):
            return await control.evaluate(run, expression, token=token)

    return routes
