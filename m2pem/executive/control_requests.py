"""Operators ask each other for vehicles and payloads: who has one gives it, or refuses.

The journal of each run has requests and their ends. So the next executive knows those that are
open, and their time begins again: no operator loses a vehicle by a time-out that was not seen.
"""

import asyncio
import logging
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

from m2pem.api.alerts import AlertSeverity
from m2pem.api.clock import Clock
from m2pem.api.people import OpenControlRequest
from m2pem.api.runs import CONTROL_REQUEST, Alert
from m2pem.engine import inputs as i
from m2pem.engine.inputs import RequestOutcome
from m2pem.engine.state import ControlRequest, RunState
from m2pem.errors import M2pemError, OperatorError
from m2pem.executive.handover import Handover
from m2pem.executive.runner import Runner
from m2pem.fleet.approval import person_of
from m2pem.fleet.fleet import Fleet, Unanswered
from m2pem.mission.catalogue import ResourceId
from m2pem.units import US_PER_S

log = logging.getLogger("m2pem.executive")


@dataclass(slots=True)
class _Open:
    by: str
    holder: str
    until_us: int
    timer: asyncio.Task[None] | None = None


@dataclass(eq=False)
class ControlRequests:
    """The requests for control that are open, one of each resource at most.

    `runners`: those whose journals say it. `is_gone`: whether an operator is present nowhere.
    `publish`: tells operators. `changed`: is called when there is one more or less.
    """

    _fleet: Fleet
    _handover: Handover
    _clock: Clock
    _runners: Callable[[], Iterable[Runner]]
    _is_gone: Callable[[str], bool]
    _publish: Callable[[Alert], None]
    _changed: Callable[[], None]
    _open: dict[ResourceId, _Open] = field(default_factory=dict)
    _unanswered: dict[ResourceId, str] = field(default_factory=dict)

    def all(self) -> list[OpenControlRequest]:
        """Return the requests that are open."""
        now_us = self._clock.now_us()
        return [
            OpenControlRequest(
                resource,
                each.by,
                each.holder,
                max(0.0, (each.until_us - now_us) / US_PER_S),
                self._fleet.control_unanswered is Unanswered.GIVE,
                self._is_gone(each.holder),
            )
            for resource, each in self._open.items()
        ]

    async def ask(self, name: str, by: str) -> None:
        """Ask the operator who has a resource for it.

        Raises:
            OperatorError: no other operator has it, or it is asked for already.
        """
        resource = self._handover.known(name)
        holder = self._handover.taken.get(resource)
        if not person_of(by):
            raise OperatorError("who asks for control needs a name")
        if holder is None:
            raise OperatorError(f"no operator has {resource}: take it")
        if person_of(holder) == person_of(by):
            raise OperatorError(f"you have {resource} already, as {holder}")
        if (other := self._open.get(resource)) is not None:
            raise OperatorError(f"{other.by} asks {holder} for {resource} already")
        self._begin(resource, by, holder)
        text = str(next(each for each in self.all() if each.resource == resource))
        self._publish(Alert("", CONTROL_REQUEST, text, AlertSeverity.WARNING, (resource,)))
        for runner in list(self._runners()):
            if not runner.done.is_set():
                await runner.submit(i.ControlRequested(resource, by, holder))

    async def answer(self, name: str, by: str, *, give: bool) -> None:
        """Give a resource to the operator who asks for it, or refuse; who has asked withdraws it.

        Raises:
            OperatorError: no operator asks for it, or it is not with this operator.
        """
        resource = self._handover.known(name)
        request = self._open.get(resource)
        if request is None:
            raise OperatorError(f"no operator asks for {resource}")
        if person_of(by) == person_of(request.by) and not give:
            outcome = RequestOutcome.WITHDRAWN
        elif self._was_returned(resource, request):
            raise OperatorError(f"{resource} was given back to the missions: it can be taken")
        elif person_of(by) != person_of(request.holder):
            raise OperatorError(
                f"{resource} is with {request.holder}, whom {request.by} asks for it"
            )
        else:
            outcome = RequestOutcome.GIVEN if give else RequestOutcome.REFUSED
        await self._end(resource, outcome, by)

    def left_unanswered(self, name: str) -> bool:
        """Return whether the operator who has a resource has let the last request for it expire."""
        resource = ResourceId(name)
        holder = self._handover.taken.get(resource)
        return holder is not None and self._unanswered.get(resource) == holder

    def seen(self, by: str) -> None:
        """An operator has commanded something: what was left unanswered before does not count."""
        for resource, holder in list(self._unanswered.items()):
            if person_of(holder) == person_of(by):
                del self._unanswered[resource]

    async def returned(self, name: str, by: str) -> None:
        """A resource was given back to the missions: no operator has it, who could be asked."""
        resource = ResourceId(name)
        self._unanswered.pop(resource, None)
        request = self._open.get(resource)
        if request is not None and self._was_returned(resource, request):
            await self._end(resource, RequestOutcome.RETURNED, by)

    def take_up(self, requests: Mapping[str, ControlRequest]) -> None:
        """After a restart: which requests are open, by the journal of a run."""
        for name, request in requests.items():
            resource = ResourceId(name)
            if resource not in self._open and self._handover.taken.get(resource) == request.holder:
                self._begin(resource, request.by, request.holder)

    def close(self) -> None:
        """Let no time of a request be over any more."""
        for each in self._open.values():
            if each.timer is not None:
                each.timer.cancel()

    def _begin(self, resource: ResourceId, by: str, holder: str) -> None:
        within_s = self._fleet.control_answer_s
        request = _Open(by, holder, self._clock.now_us() + round(within_s * US_PER_S))
        self._open[resource] = request
        request.timer = asyncio.create_task(self._expire(resource, request, within_s))
        self._changed()

    async def _expire(self, resource: ResourceId, request: _Open, within_s: float) -> None:
        await self._clock.sleep(within_s)
        # One that is given back just now ends with that, not with a new holder.
        if self._open.get(resource) is request and not self._was_returned(resource, request):
            gives = self._fleet.control_unanswered is Unanswered.GIVE
            try:
                await self._end(
                    resource, RequestOutcome.GIVEN if gives else RequestOutcome.EXPIRED, ""
                )
            except M2pemError as error:
                log.error("%s: the end of a request was not recorded: %s", resource, error)

    async def _end(self, resource: ResourceId, outcome: RequestOutcome, by: str) -> None:
        request = self._open.pop(resource)
        self._unanswered.pop(resource, None)
        if outcome is RequestOutcome.EXPIRED:
            self._unanswered[resource] = request.holder
        if request.timer is not None and request.timer is not asyncio.current_task():
            request.timer.cancel()
        if outcome is RequestOutcome.GIVEN:
            self._handover.pass_on(resource, request.by)
        self._changed()
        text = _sentence(resource, request, outcome, by, gone=self._is_gone(request.holder))
        over = not self._open
        self._publish(
            Alert("", CONTROL_REQUEST, text, AlertSeverity.NOTICE, (resource,), clears=over)
        )
        ended = i.ControlRequestEnded(resource, request.by, outcome, by)
        for runner in list(self._runners()):
            if runner.done.is_set():  # it may have ended while another run got it
                continue
            if outcome is RequestOutcome.GIVEN and resource not in control_of(runner.run.state)[0]:
                # What the one before commands with it by hand is over.
                await runner.submit(i.ControlTaken(resource, request.by))
            else:
                await runner.submit(ended)

    def _was_returned(self, resource: ResourceId, request: _Open) -> bool:
        return self._handover.taken.get(resource) != request.holder


def _sentence(
    resource: ResourceId, request: _Open, outcome: RequestOutcome, by: str, *, gone: bool
) -> str:
    if by:
        done = {
            RequestOutcome.GIVEN: f"{by} has given {resource} to {request.by}",
            RequestOutcome.REFUSED: f"{by} keeps {resource}, for which {request.by} asked",
            RequestOutcome.WITHDRAWN: f"{by} does not ask {request.holder} for {resource} any more",
            RequestOutcome.RETURNED: f"{by} has given {resource} back to the missions, for which "
            f"{request.by} asked: it can be taken",
        }
        return done[outcome]
    who = f"{request.holder}, who is gone," if gone else request.holder
    if outcome is RequestOutcome.GIVEN:
        return f"{who} has not answered in time: {resource} is with {request.by} now"
    return f"{who} has not answered in time: {resource} stays with {request.holder}"


def control_of(state: RunState) -> tuple[dict[str, str], dict[str, ControlRequest]]:
    """Return what operators have by the journal of a run, and the requests that are open; also by
    what came during a pause, which is decided at its end."""
    taken, requests = dict(state.taken), dict(state.control_requests)
    for item in state.deferred:
        match item:
            case i.ControlTaken(resource=resource, by=by):
                taken.setdefault(resource, by)
            case i.ControlReturned(resource=resource):
                taken.pop(resource, None)
                requests.pop(resource, None)
            case i.ControlRequested(resource=resource, by=by, holder=holder):
                requests[resource] = ControlRequest(by, holder)
            case i.ControlRequestEnded(resource=resource, requested_by=by, outcome=outcome):
                requests.pop(resource, None)
                if outcome is RequestOutcome.GIVEN:
                    taken[resource] = by
    return taken, requests
