"""Events (BPMN 2.0.2, clauses 10.5 and 13.5)."""

from m2pem.engine import records as r
from m2pem.engine.arming import arm_entered, arm_events
from m2pem.engine.compensation import throw_compensation
from m2pem.engine.data_flow import pass_event_outputs, payload
from m2pem.engine.elements.sequence_flows import true_flows
from m2pem.engine.elements.subprocesses import cancel, finish
from m2pem.engine.execution import Execution
from m2pem.engine.records import RunOutcome, TokenOutcome
from m2pem.engine.scopes import end_run, end_tokens
from m2pem.engine.state import Token
from m2pem.engine.throwing import throw_error, throw_escalation
from m2pem.engine.triggering import send, take_kept_messages, throw_signal
from m2pem.mission.elements import (
    Event,
    IntermediateCatchEvent,
    IntermediateThrowEvent,
    StartEvent,
)
from m2pem.mission.events import (
    CancelEventDefinition,
    CompensateEventDefinition,
    ErrorEventDefinition,
    EscalationEventDefinition,
    EventDefinition,
    MessageEventDefinition,
    SignalEventDefinition,
    TerminateEventDefinition,
)


def complete(x: Execution, token: Token) -> None:
    """Leave an event that has occurred, by every flow."""
    decided = true_flows(x, token, None)
    if decided is not None:
        x.proceed(token, *decided)


def start(x: Execution, token: Token) -> None:
    """Leave a plain start event at once; a typed one waits for its trigger (paper, section 4.1).

    The start event of an event subprocess, or of an instance, has been triggered already.
    """
    node = token.node
    assert isinstance(node, StartEvent)
    if node.definitions and not x.has_been_triggered(token):
        catch(x, token)
    elif not token.waits:  # else others of its triggers must still occur
        leave_caught(x, token)


def leave_caught(x: Execution, token: Token) -> None:
    """Leave an event that has occurred. What a trigger brought has been received with it; where
    none brings anything, the event's outputs are passed now."""
    node = token.node
    assert isinstance(node, Event)
    received = any(not isinstance(each, _THROWN_AT_IT) for each in node.definitions)
    if received or pass_event_outputs(x, token):
        complete(x, token)


_THROWN_AT_IT = (
    CancelEventDefinition,
    CompensateEventDefinition,
    ErrorEventDefinition,
    EscalationEventDefinition,
)


def catch(x: Execution, token: Token) -> None:
    """Wait for the trigger of a catch event; the target of a link has none (table 10.98)."""
    node = token.node
    assert isinstance(node, Event)
    if not node.definitions or (isinstance(node, IntermediateCatchEvent) and node.linked_from):
        complete(x, token)
        return
    if arm_events(x, token, [node]):
        take_kept_messages(x, token)


def throw(x: Execution, token: Token) -> None:
    """Throw the results of an event and leave it, unless a result ended the scope."""
    node = token.node
    assert isinstance(node, Event)
    for definition in node.definitions:
        arm_entered(x)  # what the definition before has led to
        if not x.is_active(token):
            return
        _throw(x, token, definition)
        if not x.is_active(token):
            return
    if not pass_event_outputs(x, token):
        return
    if isinstance(node, IntermediateThrowEvent) and node.links_to is not None:
        x.leave(token, TokenOutcome.COMPLETED)
        x.enter(token.id, node.links_to, token.scope)
    elif not token.compensations:
        complete(x, token)


def _throw(x: Execution, token: Token, definition: EventDefinition) -> None:
    match definition:
        case SignalEventDefinition():
            signal(x, token, definition.signal.id)
        case MessageEventDefinition():
            send(x, token, definition.message.id)
        case EscalationEventDefinition(escalation=escalation):
            assert escalation is not None
            throw_escalation(x, token, escalation)
        case CompensateEventDefinition():
            throw_compensation(x, token, definition)


def signal(x: Execution, token: Token, signal_id: str) -> None:
    """Broadcast a signal in the run, with its data inputs."""
    node = token.node
    data = payload(x, token)
    if data is None:
        return
    place = (x.process_of(node), node.id, token.scope.id)
    x.emit(r.SignalThrown(signal_id, token.id, *place, data=data))
    throw_signal(x, signal_id, data)


def end(x: Execution, token: Token) -> None:
    """Consume the token of an end event, after throwing its results."""
    node = token.node
    assert isinstance(node, Event)
    for definition in sorted(node.definitions, key=_ends_the_scope):
        arm_entered(x)  # what the definition before has led to
        if not x.is_active(token):
            return
        match definition:
            case TerminateEventDefinition():
                _terminate(x, token)
                return
            case CancelEventDefinition():
                cancel(x, token)
                return
            case ErrorEventDefinition(error=error):
                assert error is not None
                throw_error(x, token, error.code, f"thrown by {node.label}", leaving=True)
                return
            case EscalationEventDefinition(escalation=escalation) if len(node.definitions) == 1:
                assert escalation is not None
                goes_on = throw_escalation(x, token, escalation, leaving=True)
                if goes_on:
                    x.check_scope_later(token.scope)
                return
            case _:
                _throw(x, token, definition)
                if not x.is_active(token):
                    return
    if not token.compensations and pass_event_outputs(x, token):
        x.consume(token)


def _ends_the_scope(definition: EventDefinition) -> int:
    """Sort key of results: those that end the scope come last, so that all are thrown."""
    if isinstance(definition, TerminateEventDefinition | CancelEventDefinition):
        return 2
    return 1 if isinstance(definition, ErrorEventDefinition) else 0


def _terminate(x: Execution, token: Token) -> None:
    """End the scope at once (13.5.6), or the run, in the process that the run began with."""
    scope = token.scope
    x.leave(token, TokenOutcome.COMPLETED)
    if scope is x.state.root:
        end_run(x, RunOutcome.TERMINATED, f"terminated by {token.node.label}")
        return
    end_tokens(x, scope, TokenOutcome.TERMINATED)
    finish(x, scope, TokenOutcome.TERMINATED)
