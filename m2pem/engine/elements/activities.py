"""What all activities have in common: how they begin and complete (BPMN 2.0.2, clause 13.3.2)."""

from m2pem.engine import records as r
from m2pem.engine.compensation import enable, undone
from m2pem.engine.data_flow import give_out, take_in
from m2pem.engine.elements.loops import begin_loop, instance_done
from m2pem.engine.elements.sequence_flows import true_flows
from m2pem.engine.execution import Execution, Waits, waits_when_entered
from m2pem.engine.records import TokenOutcome
from m2pem.engine.state import Token
from m2pem.engine.triggering import arm_boundary
from m2pem.mission.elements import Activity, AdHocSubProcess
from m2pem.mission.reach import begins_by_itself


def _gather(x: Execution, token: Token, node: Activity) -> bool:
    """Whether enough tokens have come to begin; all but this one are then consumed (table 10.3)."""
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


def has_entered(token: Token) -> bool:
    """Whether a token that waits for its turn has done what `enter_activity` does before it."""
    node = token.node
    if not isinstance(node, Activity):
        return False
    return token.armed or len(token.scope.gathered.get(node, ())) in range(1, node.start_quantity)


def begin_activity(x: Execution, token: Token) -> None:
    """Begin the work of an activity, whose boundary events are armed.

    An instance of a loop or multi-instance activity only works: what else there is to an activity
    is the whole's, once.
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
                pass_on(x, token)
            return
    if node.data_flow.inputs and not take_in(x, token):
        return
    x.handlers[type(node)].execute(x, token)


def complete(x: Execution, token: Token, outcome: TokenOutcome = TokenOutcome.COMPLETED) -> None:
    """The work of an activity, or of one instance of it, is done.

    `outcome` TERMINATED: by a terminate end event in it.
    """
    node = token.node
    assert isinstance(node, Activity)
    if node.data_flow.outputs and not give_out(x, token):
        return
    if token.instance is None:
        pass_on(x, token)
        return
    for whole in instance_done(x, token, outcome):
        pass_on(x, whole)


def pass_on(x: Execution, token: Token) -> None:
    """The activity as a whole is done: leave by every flow that is true.

    What undoes another activity leaves by none: it is outside the normal flow (clause 10.7).
    """
    node = token.node
    assert isinstance(node, Activity)
    if token.undoes is not None:
        undone(x, token)
        return
    flows = true_flows(x, token, node.default)
    if flows is not None:
        enable(x, token)
        x.proceed(token, [*flows] * node.completion_quantity)
        if isinstance(node.container, AdHocSubProcess) and not begins_by_itself(node):
            x.queue.append(token.scope)
