"""Records as one line for people, in the diagram's words."""

from typing import TYPE_CHECKING, Any

from m2pem.api import records as r
from m2pem_plugin_mocu.texts import one_line

if TYPE_CHECKING:
    from m2pem_plugin_mocu.picture import Picture

LONGEST_VALUE = 200
"""Characters of a value that are told; the record has all of it."""


def told(picture: "Picture", record: r.Record) -> str:
    """The line about a record; every record has one."""
    text = _run(picture, record) or _work(picture, record) or _events(picture, record)
    return one_line(text or _plain(picture, record))


def _by(name: str) -> str:
    return f" by {name}" if name else ""


def _why(reason: str) -> str:
    return f" ({reason})" if reason else ""


def _plain(picture: "Picture", record: Any) -> str:
    """Of what matters to programs only: its name, and where."""
    element = getattr(record, "element", "")
    return f"{type(record).__name__}{f': {picture.label(element)}' if element else ''}"


def _run(picture: "Picture", record: r.Record) -> str:
    match record:
        case r.RunStarted(process=process, by=by):
            return f"{picture.label(process)} started{_by(by)}"
        case r.RunClaimed(by=by):
            return f"taken up again{_by(by)}"
        case r.RunPaused(by=by):
            return f"paused{_by(by)}"
        case r.RunResumed(by=by):
            return f"goes on{_by(by)}"
        case r.RunEnded(outcome=outcome, detail=detail):
            return f"{outcome.value}{_why(detail)}"
        case r.InputIgnored(reason=reason):
            return f"ignored: {reason}"
        case r.OperatorTookControl(resource=resource, by=by):
            return f"{resource} taken{_by(by)}"
        case r.OperatorGaveControlBack(resource=resource, by=by):
            return f"{resource} given back{_by(by)}"
        case r.GeometryReceived(name=name, by=by):
            return f"{name} received{_by(by)}"
        case r.TokenEntered(element=element, instance=instance):
            number = f", instance {instance}" if instance is not None else ""
            return f"{picture.label(element)}{number}"
        case r.TokenLeft(element=element, outcome=outcome):
            return f"{picture.label(element)}: {outcome.value}"
    return ""


def _work(picture: "Picture", record: r.Record) -> str:
    match record:
        case r.BehaviorRequested(element=element, name=name, resources=resources):
            return f"{picture.label(element)}: {', '.join(resources)} begins {name}"
        case r.BehaviorProgressed(behavior=behavior, state=state):
            return f"{behavior} {state.value.lower()}"
        case r.BehaviorUnsettled(behavior=behavior, reason=reason):
            return f"{behavior} held: {reason}"
        case r.BehaviorEnded(element=element, behavior=behavior, state=state):
            how = state.value.lower()
            if record.code and record.code != state.value:
                how = f"{how}, {record.code}"
            return f"{picture.label(element)}: {behavior} {how}{_why(record.reason)}"
        case r.PromptOpened(element=element, text=text):
            return f"{picture.label(element)} asks: {text}"
        case r.PromptAnswered(element=element, decision=decision, by=by):
            return f"{picture.label(element)}: {decision}, answered{_by(by)}"
        case r.PromptWithdrawn(prompt=prompt):
            return f"{prompt} is no longer asked"
        case r.ServiceRequested(element=element, name=name):
            return f"{picture.label(element)}: runs {name}"
        case r.ServiceEnded(element=element, code=code, reason=reason):
            how = f"failed, {code}{_why(reason)}" if code else "done"
            return f"{picture.label(element)}: {how}"
        case r.DataWritten(key=key, value=value):
            return f"{key} = {str(value)[:LONGEST_VALUE]}"
    return ""


def _events(picture: "Picture", record: r.Record) -> str:
    mission = picture.mission
    match record:
        case r.SignalThrown(signal=signal, by=by):
            known = mission.signals.get(signal) if mission is not None else None
            return f"signal {known.name if known and known.name else signal}{_by(by)}"
        case r.MessageThrown(message=message, by=by):
            sent = mission.messages.get(message) if mission is not None else None
            return f"message {sent.name if sent and sent.name else message}{_by(by)}"
        case r.EscalationThrown(element=element):
            what = record.code or record.escalation
            return f"{picture.label(element)}: escalation {what}{_caught(picture, record)}"
        case r.ErrorThrown(element=element, code=code, reason=reason):
            caught = _caught(picture, record)
            return f"{picture.label(element)}: error {code}{_why(reason)}{caught}"
        case r.CompensationBegan(activity=activity):
            return f"{picture.label(activity)}: is undone"
    return ""


def _caught(picture: "Picture", record: r.EscalationThrown | r.ErrorThrown) -> str:
    return f", caught by {picture.label(record.caught_by)}" if record.caught_by else ", not caught"
