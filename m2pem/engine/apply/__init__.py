"""The fold: what each record does to the state. Nothing else changes a `RunState`.

An applier never decides and never fails on a journal that the engine wrote. It may rely only on
the state and the record, so that a replay by a later release gives the same state.
"""

from m2pem.engine import records as r
from m2pem.engine.apply import compensation as undoing
from m2pem.engine.apply import events, run, scopes, tokens, work
from m2pem.engine.apply.appliers import Appliers
from m2pem.engine.state import RunState


def apply(state: RunState, record: r.Record) -> None:
    """Fold one record into the state."""
    state.seq += 1
    _APPLIERS[type(record)](state, record)


_APPLIERS: Appliers = {
    **run.APPLIERS,
    **scopes.APPLIERS,
    **tokens.APPLIERS,
    **work.APPLIERS,
    **events.APPLIERS,
    r.CompensationEnabled: undoing.compensation_enabled,
    r.CompensationTriggered: undoing.compensation_triggered,
    r.CompensationBegan: undoing.compensation_began,
    r.CompensationEnded: undoing.compensation_ended,
    r.ScopeReopened: undoing.scope_reopened,
}
