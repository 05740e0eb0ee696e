"""Runs, prompts and findings as JSON, and the run that an address names."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Annotated, Any, Self

from pydantic import BaseModel, ConfigDict, Field

from m2pem.api import (
    MAX_DATA_VALUES,
    MAX_NAME_CHARACTERS,
    MAX_REASON_CHARACTERS,
    Decision,
    MissionControl,
    RunStatus,
    RunSummary,
)
from m2pem.errors import NotDrivenError
from m2pem_plugin_web.problems import ProblemError

Name = Annotated[str, Field(min_length=1, max_length=MAX_NAME_CHARACTERS)]
Reason = Annotated[str, Field(max_length=MAX_REASON_CHARACTERS)]
Data = Annotated[dict[Name, Any], Field(max_length=MAX_DATA_VALUES)]
"""Names and values for the data store of a run."""


class Body(BaseModel):
    """Base of what is sent: a field that is not known is an error, as it may be misspelt."""

    model_config = ConfigDict(extra="forbid", strict=True)


class Answer(BaseModel):
    """Base of what is answered about something that the executive has returned."""

    model_config = ConfigDict(from_attributes=True)

    @classmethod
    def of(cls, found: object, **more: Any) -> Self:
        """Return what is answered: `more`, and fields of `found` that are called the same."""
        said = {name: getattr(found, name) for name in cls.model_fields if name not in more}
        return cls.model_validate({**said, **more})


class RunModel(Answer):
    """A run. Times are microseconds since the Unix epoch.

    `began_us` is by the clock on the wall, `started_us` and `ended_us` by the executive's, which
    may run faster. `took_s`: seconds of that clock until the end, of mission time until now; null
    when no executive drives the run.
    """

    run: str
    mission: str
    process: str
    status: RunStatus
    started_us: int
    ended_us: int | None
    records: int
    detail: str
    began_us: int
    took_s: float | None


def run_model(summary: RunSummary, took_s: float | None = None) -> RunModel:
    """A summary as JSON. `took_s`: up to now, of a run that goes on."""
    if summary.took_s is not None:
        took_s = summary.took_s
    began_us = summary.began_us or summary.started_us
    return RunModel.of(summary, began_us=began_us, took_s=took_s)


class RecordModel(BaseModel):
    """A record: its own fields are beside these, as docs/records.md says."""

    model_config = ConfigDict(extra="allow")

    run: str
    seq: int
    t: float
    record: str


class RecordPage(BaseModel):
    """`next`: what to ask for `after` next; null: there are no more records now."""

    records: list[RecordModel]
    next: int | None


class PromptModel(BaseModel):
    """An open prompt."""

    run: str
    prompt: str
    process: str
    element: str
    text: str
    decisions: list[Decision]
    role: str


async def find_run(control: MissionControl, run: str) -> RunSummary:
    """The run of that id.

    Raises:
        ProblemError: 404, there is none.
    """
    for summary in await control.runs():
        if summary.run == run:
            return summary
    raise ProblemError(404, f"there is no run {run}")


@asynccontextmanager
async def known_run(control: MissionControl, run: str) -> AsyncIterator[None]:
    """Say of a command to a run that is not driven whether there is such a run.

    The journal is read after the command only: it may be what does not answer, and STOP waits for
    nothing.

    Raises:
        ProblemError: 404, there is none.
        NotDrivenError: there is one.
    """
    try:
        yield
    except NotDrivenError:
        await find_run(control, run)
        raise


async def known_resource(control: MissionControl, resource: str) -> None:
    """Refuse what is no vehicle or payload of the fleet.

    Raises:
        ProblemError: 404, it has none.
    """
    if resource not in await control.holders():
        raise ProblemError(404, f"the fleet has no {resource}")
