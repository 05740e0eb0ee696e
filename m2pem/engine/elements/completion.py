"""The end of an activity's work (BPMN 2.0.2, clause 13.3.2)."""

from m2pem.engine.compensation import enable, undone
from m2pem.engine.data_flow import give_out
from m2pem.engine.elements.flows import true_flows
from m2pem.engine.elements.loops import instance_done
from m2pem.engine.execution import Execution
from m2pem.engine.records import TokenOutcome
from m2pem.engine.state import Token
from m2pem.mission.elements import Activity, AdHocSubProcess
from m2pem.mission.reach import begins_by_itself


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
