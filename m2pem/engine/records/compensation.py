"""Records about compensation and transactions (BPMN 2.0.2, clauses 10.7 and 13.5.5)."""

from m2pem.engine.records.base import BaseRecord


class CompensationEnabled(BaseRecord, frozen=True):
    """An activity, or an instance of one, has completed and can be compensated."""

    token: int
    process: str
    element: str
    scope: int
    completion: int
    instance: int | None = None


class CompensationTriggered(BaseRecord, frozen=True):
    """`completions` of the scope `target` will be compensated, in this order; empty: there are
    none.

    The cause is a compensation event, a cancel end event, or an activity that is compensated by
    what was done in it. `waits`: the event waits until all are compensated.
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
    """The compensation of `activity` begins: a token enters its compensation activity, or
    itself."""

    token: int
    process: str
    element: str
    scope: int
    compensation: int
    completion: int
    activity: str


class CompensationEnded(BaseRecord, frozen=True):
    """All activities of a compensation have been compensated."""

    compensation: int
    scope: int


class ScopeReopened(BaseRecord, frozen=True):
    """A kept scope is open again, with its data, to be compensated. `token` is on its activity."""

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
