"""Records as lines of the log: what an operator wants to know of them, in the diagram's words."""

from dataclasses import dataclass
from enum import StrEnum

from m2pem.api import records as r
from m2pem.api.control import StampedRecord
from m2pem_plugin_terminal.board import Board
from m2pem_plugin_terminal.words import clock_time


class Weight(StrEnum):
    """How much a line matters."""

    QUIET = "quiet"
    PLAIN = "plain"
    GOOD = "good"
    ALARM = "alarm"


@dataclass(frozen=True, slots=True)
class Line:
    """One line of the log: mission time, text, and how much it matters."""

    time: str
    text: str
    weight: Weight = Weight.PLAIN


def tell(board: Board, stamped: StampedRecord) -> Line | None:
    """The line about a record, before the board takes it in; None when it matters to nobody."""
    told = _run(stamped.record) or _work(board, stamped.record) or _events(board, stamped.record)
    if told is None:
        return None
    text, weight = told
    return Line(clock_time(stamped.t_s), text, weight)


def _by(name: str) -> str:
    return f" by {name}" if name else ""


def _run(record: r.Record) -> tuple[str, Weight] | None:
    match record:
        case r.RunStarted(by=by):
            return f"mission started{_by(by)}", Weight.PLAIN
        case r.RunClaimed(by=by):
            return f"taken over after a restart{_by(by)}", Weight.PLAIN
        case r.RunPaused(by=by):
            return f"paused{_by(by)}", Weight.ALARM
        case r.RunResumed(by=by):
            return f"resumed{_by(by)}", Weight.PLAIN
        case r.RunEnded(outcome=outcome, detail=detail):
            good = outcome in (r.RunOutcome.COMPLETED, r.RunOutcome.TERMINATED)
            text = f"mission {outcome.value}" + (f": {detail}" if detail else "")
            return text, Weight.GOOD if good else Weight.ALARM
        case r.OperatorTookControl(resource=resource, by=by):
            return f"{resource} taken{_by(by)}", Weight.ALARM
        case r.OperatorGaveControlBack(resource=resource, by=by):
            return f"{resource} given back{_by(by)}", Weight.PLAIN
        case r.GeometryReceived(name=name, by=by):
            return f"{name} received{_by(by)}", Weight.PLAIN
    return None


def _work(board: Board, record: r.Record) -> tuple[str, Weight] | None:
    match record:
        case r.BehaviorRequested():
            who = ", ".join(record.resources)
            return f"{board.label(record.element)}: {who} begins {record.name}", Weight.PLAIN
        case r.BehaviorUnsettled(behavior=behavior, reason=reason):
            return f"{behavior} unsettled: {reason}", Weight.ALARM
        case r.BehaviorEnded():
            label, state = board.label(record.element), record.state.value.lower()
            if record.code and record.code != state.upper():
                state = f"{state}, {record.code}"
            reason = f" ({record.reason})" if record.reason else ""
            calm = state in ("succeeded", "cancelled")
            weight = Weight.GOOD if state == "succeeded" else Weight.QUIET
            return f"{label}: {state}{reason}", weight if calm else Weight.ALARM
        case r.PromptOpened():
            return f"{board.label(record.element)} asks: {record.text}", Weight.PLAIN
        case r.PromptAnswered():
            label = board.label(record.element)
            return f"{label}: {record.decision}{_by(record.by)}", Weight.PLAIN
        case r.PromptWithdrawn(prompt=prompt):
            element = board.prompts.get(prompt, "")
            return f"{board.label(element) or prompt}: no longer asked", Weight.QUIET
        case r.ServiceEnded() if record.code:
            reason = f" ({record.reason})" if record.reason else ""
            return f"{board.label(record.element)}: {record.code}{reason}", Weight.ALARM
        case r.DataWritten(key=key, value=value):
            return f"{key} = {value}", Weight.QUIET
    return None


def _events(board: Board, record: r.Record) -> tuple[str, Weight] | None:
    match record:
        case r.SignalThrown():
            found = board.mission.signals.get(record.signal)
            name = found.name if found is not None and found.name else record.signal
            return f"signal {name}{_by(record.by)}", Weight.PLAIN
        case r.MessageThrown():
            sent = board.mission.messages.get(record.message)
            name = sent.name if sent is not None and sent.name else record.message
            return f"message {name}{_by(record.by)}", Weight.PLAIN
        case r.EscalationThrown():
            return f"{board.label(record.element)}: escalation {record.code}", Weight.PLAIN
        case r.ErrorThrown():
            caught = f", caught by {board.label(record.caught_by)}" if record.caught_by else ""
            reason = f" ({record.reason})" if record.reason else ""
            weight = Weight.PLAIN if record.caught_by else Weight.ALARM
            return f"{board.label(record.element)}: error {record.code}{reason}{caught}", weight
    return None
