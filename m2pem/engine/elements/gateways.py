"""Exclusive, parallel and inclusive gateways (BPMN 2.0.2, clauses 10.6.2-10.6.4, 13.4.1-13.4.3)."""

from m2pem.engine.elements.flows import true_flows
from m2pem.engine.execution import Execution
from m2pem.engine.records import TokenOutcome
from m2pem.engine.state import Join, Token
from m2pem.mission.elements import ExclusiveGateway, InclusiveGateway


def exclusive(x: Execution, token: Token) -> None:
    """First true flow, else the default, else error NO_FLOW. Every incoming token passes."""
    node = token.node
    assert isinstance(node, ExclusiveGateway)
    if len(node.outgoing) == 1 and node.outgoing[0].condition is None:
        x.proceed(token, node.outgoing)
        return
    flows = true_flows(x, token, node.default, first_only=True)
    if flows is not None:
        x.proceed(token, flows)


def parallel(x: Execution, token: Token) -> None:
    """Goes on when every incoming flow has a token (clause 13.4.1, table 13.1).

    The token that came last goes on, the others are consumed; a second token on a flow stays for
    the next round.
    """
    node = token.node
    if len(node.incoming) > 1:
        join = token.scope.joins[node]
        if len(join.by_flow) < len(node.incoming):
            return
        merge(x, token, join)
    x.proceed(token, node.outgoing)


def inclusive(x: Execution, token: Token) -> None:
    """Joins at the next quiet moment (`m2pem.engine.elements.joins`); a split goes on at once."""
    node = token.node
    assert isinstance(node, InclusiveGateway)
    if len(node.incoming) <= 1:
        split(x, token, node)


def split(x: Execution, token: Token, node: InclusiveGateway) -> None:
    """Take every true flow, else the default (table 13.3)."""
    flows = true_flows(x, token, node.default)
    if flows is not None:
        x.proceed(token, flows)


def merge(x: Execution, last: Token, join: Join) -> None:
    """Consume one token of each flow that has any, but for `last`, which goes on."""
    for tokens in [tokens for flow, tokens in join.by_flow.items() if flow is not last.flow]:
        x.leave(tokens[0], TokenOutcome.COMPLETED)
