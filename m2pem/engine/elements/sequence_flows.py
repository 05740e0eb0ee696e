"""Which sequence flows a token leaves by (BPMN 2.0.2, clauses 8.4.13 and 10.6)."""

from collections.abc import Sequence

from m2pem.engine.data import reader
from m2pem.engine.execution import Execution
from m2pem.engine.state import Token
from m2pem.engine.throwing import throw_error
from m2pem.errors import ExpressionError
from m2pem.mission.elements import Activity, SequenceFlow
from m2pem.mission.values import ReadValue


def true_flows(
    x: Execution,
    token: Token,
    default: SequenceFlow | None,
    *,
    first_only: bool = False,
    read: ReadValue | None = None,
) -> tuple[Sequence[SequenceFlow], str] | None:
    """Return the flows whose condition is true, in the XML's order, else the default one; and why
    conditions were null, "" if none was.

    Out of an activity, flows with and without conditions are an inclusive and a parallel split
    (clause 13.3.1): its default is taken when no condition is true, beside those that have none.
    `read`: reads names for conditions; by default as the token's element does. None: an error was
    thrown instead, because a condition could not be evaluated (EXPRESSION) or nothing was true
    and there is no default (NO_FLOW).
    """
    node = token.node
    read = read or reader(token)
    chosen: list[SequenceFlow] = []
    nulls: list[str] = []
    for flow in node.outgoing:
        if flow is default:
            continue
        if flow.condition is not None:
            try:
                holds = flow.condition.truth(read)
                if holds is None:
                    why = flow.condition.why_null(read)
                    nulls.append(f"condition of {flow.id} is null{why and f': {why}'}")
                if not holds:
                    continue
            except ExpressionError as error:
                reason = f"condition of {flow.id}: {error}"
                throw_error(x, token, "EXPRESSION", reason)
                return None
        chosen.append(flow)
        if first_only:
            break
    reason = "; ".join(nulls)
    if default is not None and isinstance(node, Activity):
        conditional = any(flow.condition for flow in chosen)
        return chosen if conditional else [*chosen, default], reason
    if chosen or not node.outgoing:
        return chosen, reason
    if default is not None:
        return (default,), reason
    nothing = f"no flow out of {node.id} is true and it has no default"
    throw_error(x, token, "NO_FLOW", f"{nothing}{reason and f'; {reason}'}")
    return None
