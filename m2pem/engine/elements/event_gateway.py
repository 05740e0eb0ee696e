"""The event-based gateway (BPMN 2.0.2, clauses 10.6.6 and 13.4.4)."""

from m2pem.engine.execution import Execution
from m2pem.engine.state import Token
from m2pem.engine.triggering import await_behind, collect_letters


def event_based(x: Execution, token: Token) -> None:
    """Wait for the events behind it; where one comes, `m2pem.engine.triggering` goes on."""
    if token.waits is not None:
        return  # it began its process: the first of its events has come
    if await_behind(x, token):
        collect_letters(x, token)
