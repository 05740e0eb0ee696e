"""What operators read when a run takes a request no more, or not in its state."""

from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager
from datetime import UTC, datetime
from typing import TYPE_CHECKING

from m2pem.api.runs import RunId
from m2pem.engine import inputs as i
from m2pem.engine.inputs import Input
from m2pem.engine.state import RunStatus
from m2pem.errors import OperatorError
from m2pem.journal.base import Journal, RunInfo
from m2pem.units import US_PER_S

if TYPE_CHECKING:
    from m2pem.executive.runner import Runner

NOTHING_TO_DO = {
    "attach": "m2pem replay prints what it did",
    "stop": "there was nothing to stop",
    "pause": "there was nothing to pause",
    "set_breakpoints": "it stops nowhere any more",
    "step": "there is no step to make",
    "set_data": "its data is changed no more",
    "data": "none of its processes is active: m2pem replay prints what was written",
    "evaluate": "its data is gone: m2pem replay prints what was written",
    "resume": "there is nothing to go on with: m2pem start begins its mission anew",
    "answer": "no question of it is open",
    "resolve_incident": "no incident of it is open",
    "preview_incident": "no incident of it is open",
    "plan_revision": "only a run that is under way is revised",
    "revise": "only a run that is under way is revised",
    "signal": "it takes no signals any more",
    "message": "it takes no messages any more",
    "set_geometry": "it takes no geometries any more",
}
"""By the method of `MissionControl`, or the command: what its end means for the request."""


def has_ended(runner: "Runner") -> bool:
    """Whether a run that this executive drives has ended, and its journal has that."""
    return runner.failure is None and runner.run.state.status is RunStatus.ENDED


def refuse_ended(runner: "Runner") -> None:
    """Check that a run has not ended.

    Raises:
        OperatorError: it has.
    """
    if has_ended(runner):
        raise OperatorError(f"{runner.id} has ended")


@asynccontextmanager
async def explain_end(
    request: str, run: RunId, runners: "Mapping[RunId, Runner]", journal: Journal
) -> AsyncIterator[None]:
    """Say how and when a run has ended that refuses a request for that reason.

    `request`: the method's name. `runners`: those of this executive; a run that ended long ago is
    known to the journal alone. An end that the request itself has caused, and a journal that stalls
    has not written, is none.
    """
    runner = runners.get(run)
    ended = runner is None or has_ended(runner)
    try:
        yield
    except OperatorError as error:
        if runner is not None and not ended and not _ended_and_released(runner):
            raise
        lines = {each.run: each for each in await journal.runs()}
        line = lines.get(run)
        if runner is None and (line is None or line.outcome is None):
            raise
        held = "" if runner is None else ", ".join(runner.run.state.held)
        raise OperatorError(describe_end(request, run, line, held)) from error


def _ended_and_released(runner: "Runner") -> bool:
    """Whether a run's end is in the journal, and nothing that it commanded is left."""
    return runner.failure is None and runner.done.is_set()


def describe_end(request: str, run: str, line: RunInfo | None, released: str = "") -> str:
    """Say that a run has ended, how and when, and what that means for a request.

    `line`: what the journal knows of the run, None: nothing yet. `released`: the resources that it
    is releasing still.
    """
    how = ""
    if line is not None and line.outcome is not None:
        how = f" ({line.outcome.value}{f': {line.detail}' if line.detail else ''})"
    when = "" if line is None else _when(line)
    what = NOTHING_TO_DO.get(request, "")
    if released and request == "stop":
        what = f"STOP went to what it is still releasing: {released}"
    return f"{run} has ended{when}{how}{f'; {what}' if what else ''}"


def _when(line: RunInfo) -> str:
    """When a run has ended. A clock that `--speed` takes ahead of the wall clock has no date."""
    if line.ended_us is None:
        return ""
    speed = line.header.speed
    if speed != 1.0:
        took_s = (line.ended_us - line.started_us) / US_PER_S
        return f" {took_s:.0f} s after its start, by a clock at {speed:g} times real time"
    at = datetime.fromtimestamp(line.ended_us / US_PER_S, UTC)
    return f" on {at:%Y-%m-%d at %H:%M:%S} UTC"


def in_words(item: Input, reason: str) -> str:
    """Return the reason why the engine ignored an input, as an operator understands it.

    The reasons of the journal name the class of the input.
    """
    words: dict[tuple[type[Input], RunStatus], str] = {
        (i.PauseRun, RunStatus.PAUSED): "it is paused already",
        (i.ResumeRun, RunStatus.RUNNING): "it is not paused",
        (i.StepRun, RunStatus.RUNNING): "it is not paused",
        (i.SetData, RunStatus.RUNNING): "it is not paused: data is changed in a pause",
    }
    for (kind, status), text in words.items():
        if isinstance(item, kind) and reason == f"{kind.__name__} while the run is {status.value}":
            return text
    return reason
