"""What conditional events wait for (BPMN 2.0.2, table 10.95).

A condition is looked at when its event is armed, and after every step that wrote data, before the
next step. It fires when it is true. What catches again must first be seen false
(table 10.84): its wait is spent until then.
"""

from m2pem.engine import records as r
from m2pem.engine.data import reader
from m2pem.engine.execution import Execution, definitions_of
from m2pem.engine.state import Wait
from m2pem.engine.throwing import throw_error, throw_error_in
from m2pem.errors import ExpressionError
from m2pem.mission.events import ConditionalEventDefinition


def definition_of(wait: Wait) -> ConditionalEventDefinition:
    """The definition whose condition is awaited."""
    return next(
        definition
        for definition in definitions_of(wait.node)
        if isinstance(definition, ConditionalEventDefinition)
        and definition.condition.text == wait.ref
    )


def comes_true(x: Execution, wait: Wait) -> bool:
    """Whether an armed condition fires now; a spent one that is false may fire from now on.

    One that cannot be evaluated throws error EXPRESSION where it is awaited.
    """
    holder = wait.token or wait.scope
    try:
        holds = definition_of(wait).condition.holds(reader(holder))
    except ExpressionError as error:
        reason = f"condition of {wait.node.id}: {error}"
        if wait.token is not None:
            throw_error(x, wait.token, "EXPRESSION", reason)
        else:
            throw_error_in(x, wait.scope, "EXPRESSION", reason)
        return False
    ready = x.state.conditions[wait.id]
    if not holds and not ready:
        x.emit(r.ConditionReset(wait.id))
    return holds and ready
