"""The executive's end: represents an arbiter that runs on another host."""

import asyncio
import os
import socket
from collections.abc import AsyncIterator, Coroutine, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any
from uuid import uuid4

from m2pem.api import (
    ArbiterCapabilities,
    ArbiterContext,
    AsyncQueue,
    BehaviorId,
    BehaviorReport,
    BehaviorRequest,
    BehaviorSpec,
    BehaviorState,
    HostedArbiter,
    Limits,
    LinkState,
    PayloadState,
    ResolvedValue,
    ResourceId,
    Telemetry,
    VehicleState,
)
from m2pem.api.epoch_fence import run_of
from m2pem.api.latest_task import cancel_and_wait
from m2pem.errors import PluginError, StaleCommandError
from m2pem_plugin_zenoh import messages as m
from m2pem_plugin_zenoh.arbiter_host import LinkError, create_task, lost_after_s
from m2pem_plugin_zenoh.link import Endpoints, Link, settings

APPEARS_WITHIN_S = 3.0
ROUND_TRIPS = 3
"""How many of them a host has to appear, where they take longer: connections are made meanwhile."""

CONNECTS_WITHIN_S = 20.0
"""How long a host that is there may take to connect its arbiter to the vehicles."""

STATES_WAITING = 10_000
PINGS_IN_SILENCE = 4
"""Pings in the time after which silence means that the contact is lost."""

PING_TIMEOUT_S = 30.0
START_WITHIN_S = 5.0
"""After so long a start returns, though the host has not confirmed it: it is sent on."""

CONFIRMED_WITHIN_S = 8.0
"""And two round trips: how long what stops a vehicle is sent again until the host confirms it."""

AGAIN_S = 1.0
LATE_ANSWERS = 4
"""So many in a row give operators the alert that the link is slow."""


def _stale(what: str, behavior: BehaviorId, epoch: int, newest: int) -> StaleCommandError:
    return StaleCommandError(f"{what} of {behavior}", run_of(behavior), epoch, newest)


class HostError(PluginError):
    """A host refuses something, or is not reached."""


@dataclass(slots=True)
class _Behavior:
    """What the executive goes by. `ended`: as reported to it."""

    resources: tuple[ResourceId, ...]
    number: int = 0
    ended: bool = False


class RemoteArbiter:
    """Implements `m2pem.api.Arbiter`. `key`: the beginning of the keys of its host.

    It has contact from the host's answer to `Hello` until no ping was answered for as long as makes
    a vehicle lost. Then its vehicles are lost, and what they do is LOST for the mission, whatever
    the host reports of it later.
    """

    def __init__(self, hosted: HostedArbiter, context: ArbiterContext, key: str) -> None:
        self._hosted = hosted
        self._host = hosted.host
        self._context = context
        self._log = context.logger
        self._key = key
        self._local = hosted.make(context)
        declared = getattr(self._local, "capabilities", ArbiterCapabilities())
        self.capabilities = replace(declared, sights=False, addresses=True, fences=True)
        # What the arbiter of the host cannot, this one must not seem to.
        if declared.adjusts:
            self.adjust = self._adjust
        if declared.reclaims:
            self.reclaim = self._reclaim
        if declared.detects:
            self.detectors = self._local.detectors  # type: ignore[attr-defined]  # it says so
        self._id = uuid4().hex
        self._link: Link | None = None
        self._contact = self._store = ""
        self._received = 0
        self._fresh = True
        self._refusal = self._greeting = ""
        self._hello: m.Hello | None = None
        self._answered_s = 0.0
        self._round_trip_s = 0.0
        self._late_answers = 0
        self._clock_ahead_us: int | None = None
        self._behaviors: dict[BehaviorId, _Behavior] = {}
        self._lost: set[ResourceId] = set()
        self._latest: dict[ResourceId, VehicleState | PayloadState] = {}
        self._reports: AsyncQueue[BehaviorReport] = AsyncQueue()
        self._states: AsyncQueue[Telemetry] = AsyncQueue(STATES_WAITING)
        self._is_there, self._greeted = asyncio.Event(), asyncio.Event()
        self._appeared = asyncio.Event()
        self._tasks: set[asyncio.Task[None]] = set()

    # --- what is known here ---------------------------------------------------------------------

    def catalogue(self, resource: ResourceId) -> Sequence[BehaviorSpec]:
        """What the arbiter of the host offers, which is the same program."""
        return self._local.catalogue(resource)

    def limits(self, resource: ResourceId) -> Limits:
        """The bounds of the arbiter of the host, and the way to it."""
        own, way_s = self._local.limits(resource), self._host.round_trip_s
        return Limits(
            lost_after_s=self._silence_s(resource) + way_s,
            hold_within_s=own.hold_within_s + way_s,
            cancel_timeout_s=own.cancel_timeout_s + 2 * way_s,
        )

    def addresses(self, resource: ResourceId) -> Sequence[str]:
        """One text for each resource of the host."""
        where = (*self._host.connect, *self._host.listen)
        return [f"{', '.join(where)}: {self._host.name}: {resource}"]

    # --- life -----------------------------------------------------------------------------------

    async def connect(self) -> None:
        """Look for the host; return when there is contact, or soon if it is not there.

        Raises:
            PluginError: an endpoint or a file of its security cannot be used.
        """
        endpoints = Endpoints(self._host.connect, self._host.listen)
        self._link = Link(settings(self._host, endpoints), f"host {self._host.name}")
        self._answered_s = self._now_s
        if endpoints.listen:
            await self._link.open()
        self._create(self._keep_contact(self._link), "contact")
        self._create(self._watch(), "watch the contact")
        try:
            appears_within_s = max(APPEARS_WITHIN_S, ROUND_TRIPS * self._host.round_trip_s)
            async with asyncio.timeout(appears_within_s):
                await self._is_there.wait()
            async with asyncio.timeout(CONNECTS_WITHIN_S):
                await self._greeted.wait()
        except TimeoutError:
            self._log.warning("%s", self._unreached)

    async def close(self) -> None:
        """Close the link. The host's arbiter goes on."""
        await cancel_and_wait(*self._tasks)
        link, self._link = self._link, None
        if link is not None:
            await link.close()
        self._reports.close()
        self._states.close()
        await self._local.close()

    def reports(self) -> AsyncIterator[BehaviorReport]:
        """Reports as they come, for one reader, until `close`."""
        return self._reports.read()

    def telemetry(self) -> AsyncIterator[Telemetry]:
        """States as they come; a slow reader misses old ones."""
        return self._states.read()

    # --- commands -------------------------------------------------------------------------------

    async def start(self, request: BehaviorRequest) -> None:
        """Have the host start a behavior: once, however often it is sent.

        While the host is not reached the behavior is REJECTED: it is not sent.

        Raises:
            StaleCommandError: another executive drives the run.
        """
        known = self._behaviors.get(request.id)
        if known is None or known.ended:
            number = known.number if known is not None else 0
            self._behaviors[request.id] = _Behavior(request.resources, number)
        if not self._contact:
            self._end(request.id, BehaviorState.REJECTED, "LINK_LOST", self._unreached)
            return
        stale: asyncio.Future[StaleCommandError] = asyncio.get_running_loop().create_future()
        sending = self._create(self._send_start(request, stale), f"start {request.id}")
        await asyncio.wait({sending}, timeout=START_WITHIN_S)
        if stale.done():
            raise stale.result()

    async def _send_start(
        self, request: BehaviorRequest, stale: "asyncio.Future[StaleCommandError]"
    ) -> None:
        body, id_, answered = m.Start(m.plain_request(request)), uuid4().hex, self._answered()
        behavior = self._behaviors[request.id]
        is_first = True
        while not behavior.ended:
            # An executive that was stopped for a while may not repeat what it has commanded.
            if not (is_first or self._context.may_send()):
                await self._again()
                continue
            is_first = False
            try:
                answer = await self._request(id_, body, self._resend_after_s, answered=answered)
            except LinkError:
                await self._again()
                continue
            match answer:
                case m.Refused("NO_CONTACT"):
                    answered = self._answered()
                    await self._again()
                    continue
                case m.Refused("STALE_EPOCH"):
                    behavior.ended = True
                    stale.set_result(_stale("start", request.id, request.epoch, answer.newest))
                case m.Refused(code, reason):
                    self._end(request.id, BehaviorState.REJECTED, code, reason)
            return

    async def cancel(self, behavior: BehaviorId, epoch: int) -> None:
        """Have the host end a behavior; returns when it has taken the command.

        Raises:
            HostError: it has not confirmed that, or refuses it.
            StaleCommandError: another executive drives the run.
        """
        await self._stop(m.Cancel(behavior, epoch))

    async def hold(self, resource: ResourceId) -> None:
        """Have the host hold a resource; returns when it has taken the command.

        Raises:
            HostError: it has not confirmed that, or refuses it.
        """
        await self._stop(m.Hold(resource))

    async def resume(self, resource: ResourceId) -> None:
        """Have the host let a resource go on; errors as for `hold`."""
        await self._confirmed(m.Resume(resource))

    async def query(self, behavior: BehaviorId, native_ref: str | None) -> BehaviorReport:
        """Ask the host, which asks its arbiter.

        Raises:
            HostError: the host is not reached.
        """
        epoch = self._context.epoch_of(behavior)
        answer = await self._confirmed(m.Query(behavior, native_ref, epoch))
        if not isinstance(answer, m.Found):
            raise HostError(f"host {self._host.name} has answered something else")
        report = m.decode_report(answer.report)
        if report.state is not BehaviorState.UNKNOWN:
            known = self._behaviors.setdefault(behavior, _Behavior(()))
            known.resources = known.resources or tuple(map(ResourceId, answer.resources))
            known.number = max(known.number, report.number)
            known.ended = known.ended or report.state.terminal
        return report

    async def _adjust(
        self, behavior: BehaviorId, epoch: int, parameters: Mapping[str, ResolvedValue]
    ) -> None:
        await self._confirmed(m.Adjust(behavior, epoch, m.plain_parameters(parameters)))

    async def _reclaim(self, resource: ResourceId) -> str:
        answer = await self._confirmed(m.Reclaim(resource))
        return answer.text if isinstance(answer, m.Done) else ""

    async def fence(self, run: str, epoch: int) -> None:
        """Have the host refuse commands of the run that have a lower epoch.

        Without contact nothing is done: each command has its epoch.
        """
        if self._contact:
            await self._confirmed(m.Fence(run, epoch))

    async def disown(self, run: str) -> None:
        """Send nothing more for the behaviors of a run.

        The host's arbiter keeps them: the executive that drives the run now has the same one.
        """
        for id_, behavior in self._behaviors.items():
            if run_of(id_) == run:
                behavior.ended = True

    # --- requests -------------------------------------------------------------------------------

    async def _stop(self, body: m.Cancel | m.Hold) -> None:
        """Send what stops a vehicle, with or without contact."""
        if not self._contact:
            if self._link is not None:
                self._create(self._send_once(body), "stop")
            raise HostError(self._unreached)
        await self._confirmed(body, urgent=True)

    async def _send_once(self, body: m.Body) -> None:
        try:
            await self._request(uuid4().hex, body, CONFIRMED_WITHIN_S, urgent=True)
        except LinkError as error:
            self._log.info("host %s: %s", self._host.name, error)

    async def _confirmed(self, body: m.Body, *, urgent: bool = False) -> m.Answer:
        """Send a request until it is answered; raises HostError."""
        id_, answered = uuid4().hex, self._answered()
        within_s = CONFIRMED_WITHIN_S + 2 * self._host.round_trip_s
        try:
            async with asyncio.timeout(within_s):
                while self._contact:
                    try:
                        answer = await self._request(
                            id_, body, self._resend_after_s, urgent=urgent, answered=answered
                        )
                    except LinkError:
                        await self._again()
                        continue
                    if isinstance(answer, m.Refused):
                        if answer.code == "STALE_EPOCH" and isinstance(body, m.Cancel | m.Adjust):
                            what = type(body).__name__.lower()
                            raise _stale(what, body.behavior, body.epoch, answer.newest)
                        raise HostError(f"host {self._host.name}: {answer.reason}")
                    return answer
        except TimeoutError:
            raise HostError(
                f"host {self._host.name} has not confirmed it within {within_s:g} s"
            ) from None
        raise HostError(self._unreached)

    async def _request(
        self,
        id_: str,
        body: m.Body,
        timeout_s: float,
        *,
        urgent: bool = False,
        answered: "asyncio.Future[bytes] | None" = None,
    ) -> m.Answer:
        """Send a request; returns the answer. `answered`: by the answer to what was sent before
        with the same id, too.

        Raises:
            LinkError: there is none within `timeout_s`.
        """
        link = self._link
        if link is None:
            raise LinkError("the link is closed")
        journal = "" if isinstance(body, m.Ping) else str(self._context.journal)
        request = m.Request(id_, self._id, journal, self._contact, body)
        key = f"{self._key}/request"
        content = await link.request(
            key, m.encode(request), timeout_s, urgent=urgent, answered=answered
        )
        try:
            answer: m.Answer = m.decode(content, m.Answer)
        except m.MessageError as error:
            raise LinkError(str(error)) from error
        return answer

    def _answered(self) -> "asyncio.Future[bytes]":
        return asyncio.get_running_loop().create_future()

    async def _again(self) -> None:
        await asyncio.sleep(min(AGAIN_S, max(0.1, self._round_trip_s)))

    @property
    def _resend_after_s(self) -> float:
        """How long an answer is waited for before the request is sent again."""
        return max(AGAIN_S, 2 * self._round_trip_s)

    # --- contact --------------------------------------------------------------------------------

    async def _keep_contact(self, link: Link) -> None:
        await link.open()
        await link.answer(f"{self._key}/{self._id}/items", self._take_items)
        await link.subscribe(f"{self._key}/{self._id}/state", self._take_states)
        await link.watch(f"{self._key}/alive", self._appears)
        pings: set[asyncio.Task[None]] = set()
        while True:
            if self._contact:
                # Each goes out in its time: on a slow link several are on the way.
                ping = self._create(self._ping(), "ping")
                pings.add(ping)
                ping.add_done_callback(pings.discard)
                await asyncio.sleep(self._shortest_silence_s / PINGS_IN_SILENCE)
                continue
            # On a slow link several greetings are on the way, too.
            self._appeared.clear()
            self._create(self._greet(), "greet")
            with suppress(TimeoutError):
                async with asyncio.timeout(AGAIN_S):
                    await self._appeared.wait()

    def _appears(self) -> None:
        self._is_there.set()
        self._appeared.set()

    async def _greet(self) -> None:
        going = tuple(id_ for id_, each in self._behaviors.items() if not each.ended)
        who = f"the executive {os.getpid()} of {socket.gethostname()}"
        hello = m.Hello(m.VERSION, who, self._fresh, going)
        if hello != self._hello:
            # An answer to the former one is too late: the host would let go on what has ended here.
            self._hello, self._greeting = hello, uuid4().hex
        id_ = self._greeting
        try:
            answer = await self._request(id_, hello, PING_TIMEOUT_S)
        except LinkError as error:
            self._log.debug("host %s: %s", self._host.name, error)
            return
        if self._contact or id_ != self._greeting:
            return  # the same one was answered before
        self._hello = None
        if isinstance(answer, m.Welcome | m.Refused):
            self._greeted.set()
        if isinstance(answer, m.Refused):
            if answer.reason != self._refusal:
                self._log.error("host %s refuses contact: %s", self._host.name, answer.reason)
            self._refusal = answer.reason
            return
        if not isinstance(answer, m.Welcome):
            return
        if answer.store != self._store:
            self._store, self._received = answer.store, 0
        self._contact, self._fresh, self._refusal = answer.contact, False, ""
        self._answered_s = self._now_s
        self._appeared.set()
        self._clock_ahead_us = None
        self._lost.clear()
        self._log.info("contact with host %s", self._host.name)

    async def _ping(self) -> None:
        contact, sent_s, sent_us = self._contact, self._now_s, self._now_us
        body = m.Ping(self._round_trip_s or None)
        try:
            answer = await self._request("", body, PING_TIMEOUT_S)
        except LinkError:
            return
        before_s, self._round_trip_s = self._round_trip_s, self._now_s - sent_s
        self._judge_round_trip()
        if contact != self._contact:
            return
        if isinstance(answer, m.Refused):
            self._lose_contact(answer.reason)
        elif isinstance(answer, m.Done):
            self._answered_s = self._now_s
            # The shortest way tells most of the other clock.
            if self._clock_ahead_us is None or self._round_trip_s <= before_s:
                self._clock_ahead_us = answer.time_us - (sent_us + self._now_us) // 2

    def _judge_round_trip(self) -> None:
        """Tell operators, once, that the link is slower than the fleet says."""
        if self._late_answers == LATE_ANSWERS:
            return
        self._late_answers += 1
        if self._round_trip_s <= self._host.round_trip_s:
            self._late_answers = 0
        elif self._late_answers == LATE_ANSWERS:
            self._log.warning(
                "host %s answers after %.1f s; contact is lost too early where the fleet file has "
                "a shorter round_trip (%g s): write a longer one for this host",
                *(self._host.name, self._round_trip_s, self._host.round_trip_s),
            )

    async def _watch(self) -> None:
        """Notice that the host does not answer; each resource has its own bound."""
        while True:
            await asyncio.sleep(self._shortest_silence_s / 8)
            silent_s = self._now_s - self._answered_s
            for resource in self._hosted.connections:
                bound_s = self._silence_s(resource) + self._host.round_trip_s
                if silent_s > bound_s and resource not in self._lost:
                    self._lose(resource, f"no contact with host {self._host.name}")
            if self._contact and self._lost:
                self._lose_contact(f"no answer for {silent_s:.1f} s")

    def _lose_contact(self, reason: str) -> None:
        """The contact is over. Until there is a new one nothing is started."""
        self._log.warning("no contact with host %s: %s", self._host.name, reason)
        self._contact = ""

    def _lose(self, resource: ResourceId, reason: str) -> None:
        self._lost.add(resource)
        for id_, behavior in self._behaviors.items():
            if resource in behavior.resources:
                self._end(id_, BehaviorState.LOST, "LINK_LOST", reason)
        last = self._latest.get(resource)
        if last is not None:
            self._states.put(replace(last, time_us=self._now_us, link=LinkState.LOST))

    @property
    def _unreached(self) -> str:
        why = f": {self._refusal}" if self._refusal else ""
        return f"host {self._host.name} is not reached{why}"

    # --- what the host reports ------------------------------------------------------------------

    async def _take_items(self, content: bytes) -> bytes:
        items: m.Items = m.decode(content, m.Items)
        if items.store != self._store:
            return m.encode(m.Received(0))  # its answer to `Hello` has not arrived yet
        for item in items.items:
            if item.number <= self._received:
                continue
            self._received = item.number
            try:
                if item.kind == m.REPORT:
                    self._report(m.decode_report(item.content))
                elif item.kind == m.STATE:
                    self._take_states(item.content)
                elif item.kind == m.NOTE:
                    text = item.content.decode(errors="replace")
                    self._log.warning("host %s: %s", self._host.name, text)
            except m.MessageError as error:
                self._log.error("host %s: %s", self._host.name, error)
        return m.encode(m.Received(self._received))

    def _report(self, report: BehaviorReport) -> None:
        known = self._behaviors.setdefault(report.id, _Behavior(()))
        if known.ended or report.number <= known.number:
            self._log.info("%s: %s is reported too late", report.id, report.state)
            return
        known.number = report.number
        known.ended = report.state.terminal
        self._reports.put(report)

    def _end(self, id_: BehaviorId, state: BehaviorState, code: str, reason: str) -> None:
        known = self._behaviors[id_]
        if not known.ended:
            known.ended = True
            known.number += 1
            self._reports.put(BehaviorReport(id_, known.number, state, code, reason))

    def _take_states(self, content: bytes) -> None:
        # What was on its way while the contact was lost does not mean that the vehicle is there.
        if not self._contact:
            return
        for each in m.decode_states(content):
            if each.resource in self._hosted.connections:
                state = self._in_our_time(each)
                self._latest[state.resource] = state
                self._states.put(state)

    def _in_our_time(self, state: VehicleState | PayloadState) -> VehicleState | PayloadState:
        """Return a state with its time by the clock of this host; it does not go back."""
        ahead_us = self._clock_ahead_us
        if ahead_us is None:
            ahead_us = max(0, state.time_us - self._now_us)
        last = self._latest.get(state.resource)
        time_us = min(state.time_us - ahead_us, self._now_us)
        if last is not None:
            time_us = max(time_us, last.time_us)
        if isinstance(state, PayloadState):
            found = tuple(
                replace(each, time_us=min(each.time_us - ahead_us, self._now_us))
                for each in state.detections
            )
            return replace(state, time_us=time_us, detections=found)
        return replace(state, time_us=time_us)

    # --- inside ---------------------------------------------------------------------------------

    def _silence_s(self, resource: ResourceId) -> float:
        return lost_after_s(self._hosted.connections[resource], self._local)

    @property
    def _shortest_silence_s(self) -> float:
        return min(map(self._silence_s, self._hosted.connections))

    @property
    def _now_s(self) -> float:
        return asyncio.get_running_loop().time()

    @property
    def _now_us(self) -> int:
        return self._context.clock.now_us()

    def _create(self, job: Coroutine[Any, Any, None], name: str) -> "asyncio.Task[None]":
        task = create_task(job, f"host {self._host.name}: {name}", self._log)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return task
