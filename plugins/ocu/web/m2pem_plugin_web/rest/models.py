"""What runs and prompts look like as JSON."""

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from m2pem.api import RunStatus, RunSummary

Name = Annotated[str, Field(min_length=1, max_length=200)]
Reason = Annotated[str, Field(max_length=1000)]
Data = Annotated[dict[Name, Any], Field(max_length=1000)]
"""Names and values for the data store of a run."""


class Body(BaseModel):
    """Base of what is sent: a field that is not known is an error, as it may be misspelt."""

    model_config = ConfigDict(extra="forbid", strict=True)


class RunModel(BaseModel):
    """A run. Times are microseconds since the Unix epoch.

    `began_us` is by the clock on the wall, `started_us` and `ended_us` by the executive's, which
    may run faster. `took_s`: seconds of that clock until the end, of mission time until now; null
    when nobody drives the run.
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
    if summary.ended_us is not None:
        took_s = max(0, summary.ended_us - summary.started_us) / 1_000_000
    return RunModel(
        run=summary.run,
        mission=summary.mission,
        process=summary.process,
        status=summary.status,
        started_us=summary.started_us,
        ended_us=summary.ended_us,
        records=summary.records,
        detail=summary.detail,
        began_us=summary.began_us or summary.started_us,
        took_s=took_s,
    )


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


class DecisionModel(BaseModel):
    """A choice: `value` is kept, `label` is shown."""

    value: str
    label: str


class PromptModel(BaseModel):
    """A question that stands."""

    run: str
    prompt: str
    process: str
    element: str
    text: str
    decisions: list[DecisionModel]
    role: str
