"""One handler for each kind of BPMN element: what executing a token on it does.

`EXECUTE` maps a kind of node to its handler; `m2pem.engine.arming.WHEN_ENTERED` maps kinds that
wait to what happens as soon as they are entered; `m2pem.engine.triggering.WHEN_TRIGGERED` maps
kinds that wait at their own node to what follows.
"""

from collections.abc import Callable

from m2pem.engine.arming import WHEN_ENTERED
from m2pem.engine.compensation import advance, close_undone
from m2pem.engine.elements import (
    activities,
    ad_hoc,
    complex_gateway,
    containers,
    event_gateway,
    events,
    gateways,
)
from m2pem.engine.elements.beginning import WORK, begin_activity, enter_activity
from m2pem.engine.elements.completion import complete
from m2pem.engine.execution import Execution
from m2pem.engine.state import Scope, Token
from m2pem.engine.transactions import leave_cancelled
from m2pem.engine.triggering import WHEN_TRIGGERED
from m2pem.mission import elements as e
from m2pem.mission.elements import FlowNode


def look_at(x: Execution, scope: Scope) -> None:
    """Something in a scope has ended: perhaps the scope has, or it is the next one's turn to be
    undone in it."""
    if scope.compensations:
        advance(x, scope)
    elif scope.cancelled or scope.reopened:
        if not scope.tokens:
            leave = leave_cancelled if scope.cancelled else close_undone
            leave(x, scope)
    elif isinstance(scope.container, e.AdHocSubProcess) and scope.loop is None:
        ad_hoc.look_at(x, scope)
    else:
        containers.look_at(x, scope)


EXECUTE: dict[type[FlowNode], Callable[[Execution, Token], None]] = {
    **dict.fromkeys(WORK, begin_activity),
    e.ExclusiveGateway: gateways.exclusive,
    e.ParallelGateway: gateways.parallel,
    e.InclusiveGateway: gateways.inclusive,
    e.ComplexGateway: complex_gateway.complex_gateway,
    e.EventBasedGateway: event_gateway.event_based,
    e.StartEvent: events.start,
    e.EndEvent: events.end,
    e.IntermediateCatchEvent: events.catch,
    e.IntermediateThrowEvent: events.throw,
    e.BoundaryEvent: events.boundary,
}

WHEN_ENTERED.update(
    {
        **dict.fromkeys(WORK, enter_activity),
        e.EventBasedGateway: event_gateway.event_based,
        e.StartEvent: events.start,
        e.IntermediateCatchEvent: events.catch,
    }
)

WHEN_TRIGGERED.update(
    {
        e.UserTask: activities.prompt_timed_out,
        e.ScriptTask: complete,
        e.ServiceTask: complete,
        e.BusinessRuleTask: complete,
        e.SendTask: complete,
        e.ReceiveTask: complete,
        e.StartEvent: events.complete,
        e.IntermediateCatchEvent: events.complete,
        e.IntermediateThrowEvent: events.complete,
        e.EndEvent: Execution.consume,
    }
)
