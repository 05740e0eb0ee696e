"""Messages of m2pem_interfaces, made of what the executive says."""

import math
from collections.abc import Iterable
from typing import Any

import msgspec
from builtin_interfaces.msg import Time
from m2pem_interfaces import msg

from m2pem.api import (
    Finding,
    OpenPrompt,
    RunStatus,
    RunSummary,
    RunView,
    Severity,
    StampedRecord,
    describe,
)
from m2pem_plugin_ros.interfaces.texts import sendable

_STATUS = {
    RunStatus.RUNNING: msg.RunStatus.RUNNING,
    RunStatus.PAUSED: msg.RunStatus.PAUSED,
    RunStatus.INTERRUPTED: msg.RunStatus.INTERRUPTED,
    RunStatus.COMPLETED: msg.RunStatus.COMPLETED,
    RunStatus.TERMINATED: msg.RunStatus.TERMINATED,
    RunStatus.FAILED: msg.RunStatus.FAILED,
    RunStatus.STOPPED: msg.RunStatus.STOPPED,
}

LAST_SECOND = 2**31 - 1
"""Of builtin_interfaces/Time."""


def time_of(time_us: int | None) -> Any:
    """A time in microseconds since the Unix epoch; None is zero."""
    seconds, rest = divmod(max(0, time_us or 0), 1_000_000)
    return Time(sec=min(seconds, LAST_SECOND), nanosec=rest * 1000)


def run_status(summary: RunSummary, mission_time_s: float = math.nan) -> Any:
    """A run; NaN where no executive here drives it."""
    return msg.RunStatus(
        run=summary.run,
        mission=sendable(summary.mission),
        process=sendable(summary.process),
        status=_STATUS[summary.status],
        started=time_of(summary.started_us),
        ended=time_of(summary.ended_us),
        mission_time_s=mission_time_s,
        detail=sendable(summary.detail),
    )


def open_prompt(prompt: OpenPrompt, since_us: int) -> Any:
    """A prompt that is open since then."""
    return msg.Prompt(
        stamp=time_of(since_us),
        run=prompt.run,
        prompt=prompt.prompt,
        state=msg.Prompt.OPEN,
        element=sendable(prompt.element),
        text=sendable(prompt.text),
        decisions=[
            msg.Decision(value=sendable(each.value), label=sendable(each.label))
            for each in prompt.decisions
        ],
        role=sendable(prompt.role),
    )


def closed_prompt(prompt: OpenPrompt, decision: str, by: str, at_us: int) -> Any:
    """A prompt that was answered, or withdrawn if there is no decision."""
    message = open_prompt(prompt, at_us)
    message.state = msg.Prompt.ANSWERED if decision else msg.Prompt.WITHDRAWN
    message.decision, message.answered_by = sendable(decision), sendable(by)
    return message


def active_elements(views: Iterable[RunView], now_us: int) -> Any:
    """The elements with tokens, of all runs that an executive drives."""
    elements = [
        msg.ActiveElement(
            run=view.run,
            element=sendable(active.element),
            name=sendable(view.label(active.element)),
            type=_type_of(view, active.element),
            tokens=active.tokens,
            since=time_of(active.since_us),
            behaviors=[sendable(each.name) for each in active.behaviors],
            resources=list(dict.fromkeys(each for b in active.behaviors for each in b.resources)),
        )
        for view in views
        if view.status is not RunStatus.INTERRUPTED
        for active in view.active()
    ]
    return msg.ActiveElements(stamp=time_of(now_us), elements=elements)


def _type_of(view: RunView, element: str) -> str:
    """As BPMN writes it: "scriptTask"; "" if that is not known."""
    found = view.mission.elements.get(element) if view.mission is not None else None
    name = type(found).__name__ if found is not None else ""
    return name[:1].lower() + name[1:]


def event(view: RunView, stamped: StampedRecord, at_us: int) -> Any:
    """A record of a journal, and when it came to be."""
    fields = msgspec.to_builtins(stamped.record)
    name = fields.pop("record")
    return msg.MissionEvent(
        stamp=time_of(at_us),
        run=stamped.run,
        seq=stamped.seq,
        mission_time_s=stamped.t_s,
        type=name,
        element=sendable(getattr(stamped.record, "element", "")),
        text=sendable(describe(stamped, view).text),
        data=msgspec.json.encode(fields).decode(),
    )


def finding(found: Finding) -> Any:
    """A finding of a mission."""
    error = found.severity is Severity.ERROR
    return msg.Finding(
        severity=msg.Finding.ERROR if error else msg.Finding.WARNING,
        file=sendable(found.file),
        line=found.line,
        element=sendable(found.element),
        rule=found.rule,
        number=found.number,
        message=sendable(found.message),
        remedy=sendable(found.remedy),
    )
