"""The bookkeeping of an arbiter: which behaviors it was given, and what it has reported of them."""

import logging
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from m2pem.api import behavior_parameters
from m2pem.api.arbiter import BehaviorId, BehaviorReport, BehaviorRequest
from m2pem.api.async_queue import AsyncQueue
from m2pem.api.epoch_fence import EpochFence, run_of
from m2pem.mission.catalogue import BehaviorSpec, BehaviorState, ResourceId
from m2pem.mission.values import Value
from m2pem.suggestions import suggest

REMEMBERED = 10_000

_DEFAULT_CODES = {
    BehaviorState.FAILED: "FAILED",
    BehaviorState.REJECTED: "REJECTED",
    BehaviorState.LOST: "LINK_LOST",
}


@dataclass(slots=True)
class _Entry:
    resources: tuple[ResourceId, ...]
    epoch: int
    last: BehaviorReport


class BehaviorTracker:
    """Keeps what every arbiter promises of ids, numbers, epochs and refusals.

    An arbiter asks `admit` before it commands anything, and says what became of it with `progress`
    and `end`; the ledger makes the reports, each once and in order, and drops what comes too late.
    `catalogue` is the arbiter's own. No arbiter must use it.

    The number of a report follows from its state (ACCEPTED 1, RUNNING 2, an end 3; a rejection is
    1; `refer` makes more), so that it rises even for an arbiter that has forgotten everything.
    """

    def __init__(
        self, catalogue: Callable[[ResourceId], Sequence[BehaviorSpec]], logger: logging.Logger
    ) -> None:
        self._catalogue = catalogue
        self._logger = logger
        self._epochs = EpochFence()
        self._entries: dict[BehaviorId, _Entry] = {}
        self._holders: dict[ResourceId, BehaviorId] = {}
        self._reports: AsyncQueue[BehaviorReport] = AsyncQueue()

    # --- what the executive asks for ------------------------------------------------------------

    def admit(
        self,
        request: BehaviorRequest,
        native_ref: str | Callable[[], str] | None = None,
        refusal: Callable[[BehaviorRequest], str] = lambda _: "",
    ) -> bool:
        """Whether to do what `Arbiter.start` was asked. If so, it is reported ACCEPTED.

        False: it is known already; or it was reported REJECTED, because the
        behavior or a parameter does not fit the catalogue, or a resource is busy. Behaviors that it
        preempts are reported CANCELLED: the new command must end them on the vehicle. `refusal`
        returns why a request that fits the catalogue cannot be done; "" if it can. A callable
        `native_ref` is called only if the request is accepted.

        Raises:
            StaleCommandError: another executive drives the run.
        """
        if not self._is_new(request):
            return False
        if reason := self._misfit(request) or refusal(request):
            self._reject(request, "REJECTED", reason)
            return False
        holders = {resource: self.holder(resource) for resource in request.resources}
        for resource, holder in holders.items():
            if holder and holder not in request.preempts:
                self._reject(request, "RESOURCE_UNAVAILABLE", f"{resource} is busy with {holder}")
                return False
        for holder in holders.values():
            self.end(holder, BehaviorState.CANCELLED, reason=f"{request.id} took over")
        self._holders.update(dict.fromkeys(request.resources, request.id))
        reference = native_ref() if callable(native_ref) else native_ref
        self._enter(request, BehaviorState.ACCEPTED, native_ref=reference)
        return True

    def may_cancel(self, behavior: BehaviorId, epoch: int) -> bool:
        """Whether to do what `Arbiter.cancel` was asked: the behavior goes on.

        Raises:
            StaleCommandError: another executive drives the run.
        """
        return self._may("cancel", behavior, epoch)

    def may_adjust(self, behavior: BehaviorId, epoch: int) -> bool:
        """The same for what `AdjustingArbiter.adjust` was asked."""
        return self._may("adjustment", behavior, epoch)

    def fence(self, behavior: BehaviorId, epoch: int) -> None:
        """Refuse lower epochs of a run from now on; `behavior`: one of it, or the run itself.

        `Arbiter.query` calls it with `ArbiterContext.epoch_of`, and so does `fence`.
        """
        self._epochs.admit(behavior, epoch)

    def superseded(self, behavior: BehaviorId, newest: int) -> None:
        """The vehicle has seen a newer epoch of the run than that of this executive, which a report
        says: it is the last one that counts."""
        self._epochs.admit(behavior, newest)
        self._reports.put(self.last(behavior))

    def disown(self, run: str) -> list[BehaviorId]:
        """Forget the behaviors of a run that go on, without a report; returns them."""
        ids = [
            id_
            for id_, entry in self._entries.items()
            if run_of(id_) == run and not entry.last.state.terminal
        ]
        for id_ in ids:
            self._logger.warning("%s: let go of, as another executive drives %s", id_, run)
            del self._entries[id_]
        self._holders = {each: id_ for each, id_ in self._holders.items() if id_ not in ids}
        return ids

    def last(self, behavior: BehaviorId) -> BehaviorReport:
        """Return the last report of a behavior; UNKNOWN, with number 0, without one.

        It names the highest epoch that was seen of the run.
        """
        entry, epoch = self._entries.get(behavior), self._epochs.newest(behavior)
        if entry is None:
            reason = "this arbiter knows no such behavior"
            return BehaviorReport(behavior, 0, BehaviorState.UNKNOWN, reason=reason, epoch=epoch)
        return replace(entry.last, epoch=epoch)

    def reports(self) -> AsyncIterator[BehaviorReport]:
        """Return the stream of reports, for `Arbiter.reports`."""
        return self._reports.read()

    def close(self) -> None:
        """End the reports. What goes on goes on, unreported."""
        self._reports.close()

    # --- what the vehicle says ------------------------------------------------------------------

    def progress(self, behavior: BehaviorId) -> None:
        """The vehicle does it: reported RUNNING, the first time."""
        entry = self._entries.get(behavior)
        if entry is not None and entry.last.state is BehaviorState.ACCEPTED:
            self._report(entry, BehaviorState.RUNNING)

    def refer(self, behavior: BehaviorId, native_ref: str) -> None:
        """It is to be found again by this from now on.

        What is RUNNING is reported so once more, for the journal must have it.
        """
        entry = self._entries.get(behavior)
        if entry is None or entry.last.state.terminal:
            return
        entry.last = replace(entry.last, native_ref=native_ref)
        if entry.last.state is BehaviorState.RUNNING:
            self._report_again(entry)

    def remains(self, behavior: BehaviorId, remaining: Mapping[str, Value]) -> None:
        """Report what is left of a behavior that is RUNNING, where that has changed.

        `remaining`: the parameters by which another vehicle would do it. Each report is journaled:
        report at waypoints, not with every telemetry.
        """
        entry = self._entries.get(behavior)
        if entry is None or entry.last.state is not BehaviorState.RUNNING:
            return
        if entry.last.remaining != remaining:
            entry.last = replace(entry.last, remaining=dict(remaining))
            self._report_again(entry)

    def end(
        self,
        behavior: BehaviorId | None,
        state: BehaviorState,
        code: str = "",
        reason: str = "",
        outputs: Mapping[str, Value] | None = None,
    ) -> None:
        """It has ended, and its resources are free; nothing happens if it is unknown or over.

        A `code` that is left out is FAILED, REJECTED or LINK_LOST, as the state says. `outputs` as
        in `BehaviorReport`.
        """
        entry = self._entries.get(behavior) if behavior is not None else None
        if behavior is None or entry is None or entry.last.state.terminal:
            return
        for resource in entry.resources:
            if self._holders.get(resource) == behavior:
                del self._holders[resource]
        self._report(entry, state, code or _DEFAULT_CODES.get(state, ""), reason, outputs)

    def lose(self, resource: ResourceId, reason: str) -> None:
        """Report the behavior of a resource as LOST, because its link is lost."""
        self.end(self.holder(resource), BehaviorState.LOST, reason=reason)

    def adopt(
        self,
        behavior: BehaviorId,
        resources: Sequence[ResourceId],
        native_ref: str | None,
        number: int = 2,
    ) -> None:
        """After a restart: the vehicle was found doing it. It is RUNNING; that is not reported.

        `number`: of the report that said so, where `refer` had it said more than once.
        """
        if behavior not in self._entries:
            report = BehaviorReport(behavior, number, BehaviorState.RUNNING, native_ref=native_ref)
            self._entries[behavior] = _Entry(tuple(resources), 0, report)
            self._holders.update(dict.fromkeys(resources, behavior))

    def holder(self, resource: ResourceId) -> BehaviorId | None:
        """The behavior that a resource is held by now."""
        return self._holders.get(resource)

    # --- inside ---------------------------------------------------------------------------------

    def _is_new(self, request: BehaviorRequest) -> bool:
        self._epochs.require("start", request.id, request.epoch)
        known = self._entries.get(request.id)
        # A higher epoch that starts an ended behavior again means it: it is another executive.
        return known is None or (known.last.state.terminal and request.epoch > known.epoch > 0)

    def _may(self, what: str, behavior: BehaviorId, epoch: int) -> bool:
        self._epochs.require(what, behavior, epoch)
        entry = self._entries.get(behavior)
        return entry is not None and not entry.last.state.terminal

    def _misfit(self, request: BehaviorRequest) -> str:
        for resource in request.resources:
            offered = {spec.name: spec for spec in self._catalogue(resource)}
            if request.behavior not in offered:
                known = suggest(request.behavior, offered, "behaviors")
                return f"{resource} has no behavior '{request.behavior}'; {known}"
            spec = offered[request.behavior]
            if reason := behavior_parameters.refusal(spec, request.parameters):
                return reason
        return ""

    def _reject(self, request: BehaviorRequest, code: str, reason: str) -> None:
        self._enter(request, BehaviorState.REJECTED, code, reason)

    def _enter(
        self,
        request: BehaviorRequest,
        state: BehaviorState,
        code: str = "",
        reason: str = "",
        native_ref: str | None = None,
    ) -> None:
        report = BehaviorReport(request.id, 1, state, code, reason, native_ref)
        self._entries.pop(request.id, None)
        self._entries[request.id] = _Entry(request.resources, request.epoch, report)
        self._forget()
        self._reports.put(report)

    def _report(
        self,
        entry: _Entry,
        state: BehaviorState,
        code: str = "",
        reason: str = "",
        outputs: Mapping[str, Value] | None = None,
    ) -> None:
        last = entry.last
        number = max(3, last.number + 1) if state.terminal else 2
        entry.last = BehaviorReport(
            last.id,
            number,
            state,
            code,
            reason,
            last.native_ref,
            outputs or {},
            remaining=None if state is BehaviorState.SUCCEEDED else last.remaining,
        )
        self._reports.put(entry.last)

    def _report_again(self, entry: _Entry) -> None:
        entry.last = replace(entry.last, number=entry.last.number + 1)
        self._reports.put(entry.last)

    def _forget(self) -> None:
        """Let go of the oldest that has ended."""
        if len(self._entries) > REMEMBERED:
            over = (id_ for id_, entry in self._entries.items() if entry.last.state.terminal)
            if (oldest := next(over, None)) is not None:
                del self._entries[oldest]
