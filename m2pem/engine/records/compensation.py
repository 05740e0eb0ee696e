"""Records about compensation and transactions (BPMN 2.0.2, clauses 10.7 and 13.5.5)."""

from m2pem.engine.records.base import BaseRecord


class CompensationEnabled(BaseRecord, frozen=True):
    """An activity, or an instance of one, has completed and can be undone from here."""

    token: int
    process: str
    element: str
    scope: int
    completion: int
    instance: int | None = None


class CompensationTriggered(BaseRecord, frozen=True):
    """`completions` of the scope `target` will be undone, in this order; none: there are none.

    By a compensation event, a cancel end event, or an activity that is undone by undoing what was
    done in it. `waits`: the event waits until all of them are.
    """

    token: int
    process: str
    element: str
    scope: int
    compensation: int
    target: int
    completions: tuple[int, ...] = ()
    waits: bool = False


class CompensationBegan(BaseRecord, frozen=True):
    """`activity` is being undone: a token enters its compensation activity, or itself again."""

    token: int
    process: str
    element: str
    scope: int
    compensation: int
    completion: int
    activity: str


class CompensationEnded(BaseRecord, frozen=True):
    """All that it was triggered for has been undone."""

    compensation: int
    scope: int


class ScopeReopened(BaseRecord, frozen=True):
    """A scope that was kept is there again, with its data, to be undone. `token` sits on it."""

    scope: int
    process: str
    element: str
    token: int


class TransactionCancelled(BaseRecord, frozen=True):
    """The cancel end event `element` has ended all in the transaction's scope."""

    token: int
    process: str
    element: str
    scope: int
