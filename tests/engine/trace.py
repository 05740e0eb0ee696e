"""Records and commands as short lines, so that what a test expects reads like a table."""

from collections.abc import Callable, Iterable
from typing import Any

from m2pem.engine import commands as c
from m2pem.engine import records as r


def _short(behavior: str) -> str:
    return behavior.rpartition(".")[2]


def _outcome(record: r.TokenLeft | r.ScopeClosed) -> str:
    return "" if record.outcome is r.TokenOutcome.COMPLETED else record.outcome.value


def _caught(record: r.ErrorThrown | r.EscalationThrown) -> str:
    return f"caught by {record.caught_by}" if record.caught_by else ""


_LINES: dict[type, Callable[[Any], Iterable[object]]] = {
    r.RunStarted: lambda x: ("begin", x.process),
    r.RunClaimed: lambda x: ("claim", x.epoch),
    r.RunPaused: lambda x: ("pause",),
    r.RunResumed: lambda x: ("resume",),
    r.BreakpointsSet: lambda x: (
        "breakpoints",
        *x.elements,
        *x.conditions,
        "step" if x.step else "",
    ),
    r.BreakpointReached: lambda x: ("reached", x.reason.value, x.element, x.condition),
    r.OperatorSetData: lambda x: ("set", x.scope),
    r.RunEnded: lambda x: ("end", x.outcome.value),
    r.RunYielded: lambda x: ("yield", *x.steps),
    r.InputIgnored: lambda x: ("ignored:", x.reason),
    r.InputDeferred: lambda x: ("defer", type(x.input).__name__),
    r.InputSeen: lambda x: ("seen", x.id),
    r.GeometryReceived: lambda x: ("geometry", x.name),
    r.MissionRevised: lambda x: ("revise", *(f"{a}={b}" for a, b in x.moves.items())),
    r.ScopeOpened: lambda x: ("open", x.element),
    r.ScopeClosed: lambda x: ("close", x.element, _outcome(x), "kept" if x.kept else ""),
    r.TokenEntered: lambda x: ("enter", x.element),
    r.TokenLeft: lambda x: ("leave", x.element, _outcome(x)),
    r.InstanceOutput: lambda x: ("give", x.value),
    r.FlowTaken: lambda x: ("take", x.flow),
    r.GatewayActivated: lambda x: ("activate", x.element, *x.flows),
    r.ActivitiesChosen: lambda x: ("choose", x.element, *x.elements),
    r.TokensGathered: lambda x: ("gather", x.token, x.element),
    r.GatewayReset: lambda x: ("reset", x.element),
    r.ScopeCompleting: lambda x: ("completing", x.scope),
    r.ScopeInterrupted: lambda x: ("interrupt", x.scope, x.element),
    r.BehaviorRequested: lambda x: (
        "request",
        _short(x.behavior),
        x.name,
        *x.resources,
        *(f"preempts {_short(other)}" for other in x.preempts),
    ),
    r.BehaviorProgressed: lambda x: ("progress", _short(x.behavior), x.state.value),
    r.BehaviorAdjusted: lambda x: ("adjust", _short(x.behavior), *x.parameters.values()),
    r.BehaviorCancelRequested: lambda x: ("cancel", _short(x.behavior), x.code),
    r.BehaviorUnsettled: lambda x: ("unsettled", _short(x.behavior)),
    r.BehaviorContinued: lambda x: ("continued", _short(x.behavior)),
    r.BehaviorRestarted: lambda x: ("restart", _short(x.behavior)),
    r.BehaviorEnded: lambda x: ("ended", _short(x.behavior), x.state.value, x.code),
    r.PromptOpened: lambda x: ("ask", x.prompt, x.element),
    r.PromptAnswered: lambda x: ("answer", x.prompt, x.decision),
    r.PromptWithdrawn: lambda x: ("withdraw", x.prompt),
    r.ServiceRequested: lambda x: ("call", x.service, x.name),
    r.ServiceEnded: lambda x: ("served", x.service, x.code),
    r.ServiceWithdrawn: lambda x: ("withdraw", x.service),
    r.DataWritten: lambda x: ("write", x.key, "=", x.value),
    r.EventAwaited: lambda x: ("await", x.element),
    r.EventTriggered: lambda x: ("triggered",),
    r.ConditionReset: lambda x: ("again", x.wait),
    r.SignalThrown: lambda x: ("signal", x.signal),
    r.MessageThrown: lambda x: ("message", x.message, "kept" if x.kept else ""),
    r.EscalationThrown: lambda x: ("escalation", x.code, _caught(x)),
    r.ErrorThrown: lambda x: ("error", x.code, _caught(x)),
    r.IncidentOpened: lambda x: ("incident", _short(x.incident), x.code, *x.resources),
    r.IncidentUpdated: lambda x: ("update", _short(x.incident)),
    r.IncidentResolved: lambda x: ("resolve", _short(x.incident), x.choice.value, x.to),
    r.IncidentClosed: lambda x: ("forget", _short(x.incident)),
    r.CompensationEnabled: lambda x: ("enable", x.element),
    r.CompensationTriggered: lambda x: ("undo", x.element, *x.completions),
    r.CompensationBegan: lambda x: ("undoing", x.activity),
    r.CompensationEnded: lambda x: ("undone", x.compensation),
    r.ScopeReopened: lambda x: ("reopen", x.element),
    r.TransactionCancelled: lambda x: ("cancelled", x.element),
    c.StartBehavior: lambda x: ("start", _short(x.behavior), x.name, *x.resources),
    c.AdjustBehavior: lambda x: (
        "adjust",
        _short(x.goes_on.behavior),
        *(f"{name}={x.goes_on.parameters[name]}" for name in x.names),
    ),
    c.CancelBehavior: lambda x: ("cancel", _short(x.behavior)),
    c.HoldResource: lambda x: ("hold", x.resource),
    c.ResumeResource: lambda x: ("resume", x.resource),
    c.OpenPrompt: lambda x: ("open", x.prompt, *(d.value for d in x.decisions)),
    c.ClosePrompt: lambda x: ("close", x.prompt, x.decision),
    c.RunService: lambda x: ("run", x.service, x.name),
    c.CancelService: lambda x: ("cancel", x.service),
}


def line(item: r.Record | c.Command) -> str:
    """One record or command."""
    return " ".join(str(word) for word in _LINES[type(item)](item) if word != "")


def table(text: str) -> list[str]:
    """The lines of an expected trace; several may stand on one line of text, parted by `;`."""
    return [part.strip() for part in text.replace("\n", ";").split(";") if part.strip()]
