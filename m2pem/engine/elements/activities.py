"""What all activities have in common: how they begin and complete (BPMN 2.0.2, clause 13.3.2)."""

from m2pem.engine import records as r
from m2pem.engine.compensation import compensated, enable_compensation
from m2pem.engine.data_flow import fill_data_inputs, pass_data_outputs
from m2pem.engine.elements.loops import begin_loop, instance_done
from m2pem.engine.elements.sequence_flows import true_flows
from m2pem.engine.execution import Execution, Waits, waits_when_entered
from m2pem.engine.records import TokenOutcome
from m2pem.engine.state import Token
from m2pem.engine.triggering import arm_boundary
from m2pem.mission.elements import Activity, AdHocSubProcess
from m2pem.mission.reachability import begins_by_itself


def _gather(x: Execution, token: Token, node: Activity) -> bool:
    """Whether enough tokens have arrived (`startQuantity`); all others are then consumed (10.3)."""
    waiting = token.scope.gathered.get(node, [])
    if token not in waiting:
        return True
    if len(waiting) < node.start_quantity:
        return False
    others = [other for other in waiting if other is not token]
    for other in others[: node.start_quantity - 1]:
        x.leave(other, TokenOutcome.CONSUMED)
    x.emit(r.TokensGathered(token.id, x.process_of(node), node.id, token.scope.id))
    return True


def enter_activity(x: Execution, token: Token) -> None:
    """Arm an activity's boundary events; if it begins to wait with it, begin it."""
    node = token.node
    assert isinstance(node, Activity)
    instance = token.instance is not None
    if waits_when_entered(node, instance=instance) is Waits.AT_ITSELF:
        begin_activity(x, token)
    elif not token.armed and (node.start_quantity <= 1 or _gather(x, token, node)):
        arm_boundary(x, token, node)


def has_been_entered(token: Token) -> bool:
    """Whether `enter_activity` was called for a token that is still in the queue."""
    node = token.node
    if not isinstance(node, Activity):
        return False
    return token.armed or len(token.scope.gathered.get(node, ())) in range(1, node.start_quantity)


def activate_later(x: Execution, token: Token) -> None:
    """Queue a token that is on its element already: after a yield, or to start again."""
    if (token.instance is None and token.node not in x.waits) or has_been_entered(token):
        x.queue.append(token)
    else:
        x.execute_later(token)


def begin_activity(x: Execution, token: Token) -> None:
    """Begin the work of an activity, whose boundary events are armed.

    An instance of a loop or multi-instance activity only executes. All else is done once, for the
    outer instance.
    """
    node = token.node
    assert isinstance(node, Activity)
    if node.start_quantity > 1 and not _gather(x, token, node):
        return
    if token.instance is None:
        if node.boundary and not token.armed and not arm_boundary(x, token, node):
            return
        if node.loop is not None and token.inner is None:
            if begin_loop(x, token, node.loop):
                leave_activity(x, token)
            return
    if node.data_flow.inputs and not fill_data_inputs(x, token):
        return
    x.handlers[type(node)].execute(x, token)


def complete(x: Execution, token: Token, outcome: TokenOutcome = TokenOutcome.COMPLETED) -> None:
    """Complete the work of an activity, or of one instance of it.

    `outcome` is TERMINATED when a terminate end event in it has ended it.
    """
    node = token.node
    assert isinstance(node, Activity)
    if node.data_flow.outputs and not pass_data_outputs(x, token):
        return
    if token.instance is None:
        leave_activity(x, token)
        return
    for outer in instance_done(x, token, outcome):
        leave_activity(x, outer)


def leave_activity(x: Execution, token: Token) -> None:
    """Leave a completed activity by every flow whose condition is true.

    A compensation activity leaves by no flow: it is outside the normal flow (clause 10.7).
    """
    node = token.node
    assert isinstance(node, Activity)
    if token.compensates is not None:
        compensated(x, token)
        return
    decided = true_flows(x, token, node.default)
    if decided is not None:
        flows, reason = decided
        enable_compensation(x, token)
        x.proceed(token, [*flows] * node.completion_quantity, reason)
        if isinstance(node.container, AdHocSubProcess) and not begins_by_itself(node):
            x.queue.append(token.scope)
