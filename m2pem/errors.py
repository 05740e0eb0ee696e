"""Every error that m2pem raises on purpose, in one tree.

The class says whose fault it is, the message says where it is and what would be right:

* `MissionError`, `FleetError`, `AnswersError`, `ExpressionSyntaxError`: what a person wrote is
  wrong; the first three carry *every* finding at once.
* `OperatorError`: a request that cannot be met now (unknown run, prompt already answered).
* `PluginError`: a plugin broke its contract.
* `JournalError`: the journal cannot be read or written; `JournalUrlError`: what names it is none.
* `InternalError`: m2pem is wrong; please report it.

Anything a running mission may handle (a behavior failed, a vehicle was lost, an expression
divided by zero) is a record in the journal and never one of these.
"""

from collections.abc import Mapping, Sequence

from m2pem.findings import Finding, lines


class M2pemError(Exception):
    """Root of the tree. `exit_status` is what the command line ends with."""

    exit_status = 1


class FindingsError(M2pemError):
    """Something a person wrote cannot be used; `findings` lists all that is wrong with it."""

    exit_status = 2

    def __init__(self, what: str, findings: Sequence[Finding]) -> None:
        self.what = what
        self.findings = tuple(findings)
        super().__init__("\n".join([what, *lines(self.findings)]))


class MissionError(FindingsError):
    """The mission file cannot be loaded, or does not fit the fleet."""


class FleetError(FindingsError):
    """The fleet file, or a file that it names, cannot be used."""


class AnswersError(FindingsError):
    """The answers file cannot be used, or does not fit the mission."""


class ExpressionSyntaxError(M2pemError):
    """An expression, duration or script line cannot be parsed.

    `position` is the 0-based offset in `text` at which reading stopped.
    """

    exit_status = 2

    def __init__(self, message: str, text: str, position: int) -> None:
        self.message = message
        self.text = text
        self.position = position
        super().__init__(f"{message} at column {position + 1} of {text!r}" if text else message)


class ExpressionError(M2pemError):
    """Evaluating an expression failed. The engine turns it into BPMN error EXPRESSION."""


class OperatorError(M2pemError):
    """A request of an operator or script that cannot be met now; nothing was changed."""


class BusyError(OperatorError):
    """A mission that is to start names resources that other runs or operators have.

    `holders`: the run or the operator that has each.
    """

    def __init__(self, message: str, holders: Mapping[str, str]) -> None:
        self.holders = dict(holders)
        super().__init__(message)


class NotApprovedError(OperatorError):
    """A mission that is to start was not approved by as many persons as the fleet asks for.

    `missing`: how many more must approve it.
    """

    exit_status = 2

    def __init__(self, message: str, missing: int) -> None:
        self.missing = missing
        super().__init__(message)


class ScheduleError(OperatorError):
    """A mission cannot be scheduled so; nothing was scheduled. The message says what would be
    right. `field`: of `When`, which is wrong; "": none alone."""

    def __init__(self, message: str, field: str = "") -> None:
        self.field = field
        super().__init__(message)


class StuckError(OperatorError):
    """A choice about an incident after which the mission cannot complete, by the checker."""


class NotDrivenError(OperatorError):
    """The run is not driven by this executive; another one may."""


class PluginError(M2pemError):
    """A plugin could not be loaded or broke its contract."""


class JournalError(M2pemError):
    """The journal cannot be opened, read or written."""


class JournalUrlError(JournalError):
    """What a person gave as a journal's path or URL cannot be one; nothing was opened."""

    exit_status = 2


class StaleEntryError(JournalError):
    """The entry of the schedule was changed by another executive since, or the whole schedule is
    held; nothing was written."""


class StaleDrawingsError(JournalError):
    """Another process has written drawings of the fleet since they were read; nothing was
    written."""


class StaleAlertsError(JournalError):
    """Another process has written alerts of the fleet since they were read; nothing was written."""


class FleetServedError(JournalError):
    """Another executive serves the fleet on this journal."""

    exit_status = 2


class StaleEpochError(JournalError):
    """Another executive has claimed the run since; this one must stop driving it."""


class StaleCommandError(M2pemError):
    """A command of a lower epoch than its receiver has seen of the run: nothing was done.

    `epoch`: of the command; `newest`: the highest that was seen.
    """

    code = "STALE_EPOCH"

    def __init__(self, what: str, run: str, epoch: int, newest: int) -> None:
        super().__init__(
            f"{what} is refused: it has epoch {epoch} of {run}, and epoch {newest} was seen: "
            "another executive drives the run"
        )
        self.run = run
        self.epoch = epoch
        self.newest = newest


class InternalError(M2pemError):
    """A bug in m2pem: the run is held, nothing else is touched."""
