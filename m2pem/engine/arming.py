"""What an element does as soon as a token enters it, before anything else happens in the run.

To enter a catch event is to wait for it (BPMN 2.0.2, clause 13.5.2), so that nothing thrown after
record `TokenEntered` is missed. Tokens that enter such elements are in `Execution.entered`; all
other steps come in their turn, from `Execution.queue`.
"""

from collections.abc import Callable

from m2pem.engine.execution import Execution
from m2pem.engine.state import Token
from m2pem.mission.elements import FlowNode

WHEN_ENTERED: dict[type[FlowNode], Callable[[Execution, Token], None]] = {}
"""What happens at once when a token enters a kind of node; filled by the handlers."""


def arm_next(x: Execution) -> None:
    """Arm what the first token that entered waits for, unless it has left already."""
    token = x.entered.popleft()
    if x.state.tokens.get(token.id) is token:
        WHEN_ENTERED[type(token.node)](x, token)


def arm_entered(x: Execution) -> None:
    """Arm what every token that entered waits for: something is about to be thrown.

    Conditions that are true may let ever more tokens enter: those go as far as the batch.
    """
    there = len(x.entered)
    while x.entered and (there > 0 or x.left > 0):
        there -= 1
        x.left -= 1
        arm_next(x)
