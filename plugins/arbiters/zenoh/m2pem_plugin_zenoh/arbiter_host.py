"""Runs one arbiter beside its vehicles, for an executive that it reaches over a link.

It trusts the link in nothing: a request that arrives twice is done once, one that arrives after the
contact was lost is refused unless it stops something, and what it reports is kept until received.
It knows nothing of Zenoh.
"""

import asyncio
import math
from collections import OrderedDict
from collections.abc import Coroutine
from dataclasses import replace
from logging import Logger
from typing import Any, Protocol
from uuid import UUID, uuid4

from m2pem.api import (
    Arbiter,
    ArbiterContext,
    BehaviorReport,
    BehaviorState,
    Connection,
    HostedArbiter,
    PayloadState,
    ResourceId,
    TeamState,
    Telemetry,
    VehicleState,
    WhenCutOff,
)
from m2pem.api.arbiter import adjusts, fences, reclaims
from m2pem.api.epoch_fence import run_of
from m2pem.api.latest_task import cancel_and_wait
from m2pem.errors import StaleCommandError
from m2pem_plugin_zenoh import messages as m
from m2pem_plugin_zenoh.store import HostStore, Kept

LOST_AFTER_S = 3.0
"""Of a vehicle for which neither the fleet nor its arbiter states one."""

AT_FIRST = 4
"""States are sent so many times less often than the fleet says, until the round trip is known."""

ITEMS_AT_ONCE = 100
ANSWERS_KEPT = 1_000
AGAIN_S = 0.3


class LinkError(Exception):
    """The other end does not answer, or not in this protocol."""


class Outlet(Protocol):
    """The way from the host to an executive."""

    async def deliver(self, executive: str, items: m.Items) -> int:
        """Send items; returns up to which number the executive has received them.

        Raises:
            LinkError: it has not answered.
        """
        ...

    def publish(self, executive: str, states: bytes) -> None:
        """Send states; they may get lost."""
        ...


def lost_after_s(connection: Connection, arbiter: Arbiter) -> float:
    """After which silence a resource counts as lost, without the way to its host."""
    if connection.lost_after_s is not None:
        return connection.lost_after_s
    own_s = arbiter.limits(connection.resource).lost_after_s
    return own_s if math.isfinite(own_s) else LOST_AFTER_S


class ArbiterHost:
    """The host's end of one arbiter. `store`: is closed with it."""

    def __init__(
        self, hosted: HostedArbiter, context: ArbiterContext, store: HostStore, outlet: Outlet
    ) -> None:
        self._hosted = hosted
        self._context = context
        self._log = context.logger
        self._store = store
        self._outlet = outlet
        self._arbiter: Arbiter | None = None
        self._executive = self._contact = self._who = ""
        self._answers: OrderedDict[str, asyncio.Task[m.Answer]] = OrderedDict()
        self._received_s = 0.0
        self._received_us = 0
        # Until it is measured: at first, states must not fill a thin link.
        self._round_trip_s = AT_FIRST / hosted.host.telemetry_hz
        self._held_for_executive: set[ResourceId] = set()
        self._ending: set[str] = set()
        self._greeting = asyncio.Lock()
        self._pending: dict[ResourceId, VehicleState | PayloadState] = {}
        self._news, self._states = asyncio.Event(), asyncio.Event()
        self._tasks: list[asyncio.Task[None]] = []
        self._readers: list[asyncio.Task[None]] = []

    # --- life -----------------------------------------------------------------------------------

    async def open(self) -> None:
        """Take up what went on when the host ended last, and wait for an executive.

        Raises:
            PluginError: the arbiter cannot connect, or cannot use its settings.
        """
        self._note_contact()
        if self._store.journal:
            await self._begin()
        self._tasks = [
            self._create(self._watch(), "watch the contact"),
            self._create(self._deliver(), "deliver reports"),
            self._create(self._publish(), "publish states"),
        ]

    async def close(self) -> None:
        """Close the arbiter. Its vehicles go on."""
        await cancel_and_wait(*self._tasks, *self._answers.values())
        await self._end()
        self._store.close()

    async def _begin(self) -> None:
        journal = UUID(self._store.journal)
        context = replace(self._context, journal=journal, epoch_of=self._store.epoch)
        arbiter = self._hosted.make(context)
        await arbiter.connect()
        self._arbiter = arbiter
        for kept in self._store.going():
            await self._take_up(arbiter, kept)
        self._readers = [
            self._create(self._read_reports(arbiter), "read reports"),
            self._create(self._read_telemetry(arbiter), "read telemetry"),
        ]

    async def _end(self) -> None:
        arbiter, self._arbiter = self._arbiter, None
        if arbiter is not None:
            await arbiter.close()
        await asyncio.gather(*self._readers, return_exceptions=True)
        self._readers = []

    async def _take_up(self, arbiter: Arbiter, kept: Kept) -> None:
        """Report what became of a behavior while the host was not running."""
        last = kept.report
        reason = ""
        try:
            found = await arbiter.query(kept.id, last.native_ref if last else None)
        except Exception as error:  # an arbiter's fault must not keep the host from its vehicles
            self._log.exception("%s: its arbiter raised on query", kept.id)
            reason = f"{type(error).__name__}: {error}"
            found = BehaviorReport(kept.id, 0, BehaviorState.UNKNOWN)
        if found.state in (BehaviorState.ACCEPTED, BehaviorState.RUNNING):
            if last is None:
                self._keep(replace(found, number=1, state=BehaviorState.ACCEPTED))
            if found.state is BehaviorState.RUNNING and (
                last is None or last.state is not BehaviorState.RUNNING
            ):
                self._keep(found)
            return
        if found.state is BehaviorState.UNKNOWN:
            reason = reason or found.reason or "its arbiter does not know what became of it"
            state, code = BehaviorState.LOST, "LINK_LOST"
            if found.not_begun:
                state, code = BehaviorState.REJECTED, "REJECTED"
            found = replace(
                found, state=state, code=code, reason=f"its host has restarted: {reason}"
            )
        self._keep(found)

    # --- requests -------------------------------------------------------------------------------

    async def handle(self, content: bytes) -> bytes:
        """Do what was requested, once for each id; returns the answer."""
        try:
            request: m.Request = m.decode(content, m.Request)
        except m.MessageError as error:
            return m.encode(m.Refused("VERSION", str(error)))
        if isinstance(request.body, m.Ping):
            return m.encode(self._ping(request, request.body))
        # In a new contact the answer may be another one.
        key = request.id + request.contact
        task = self._answers.get(key)
        if task is None:
            task = asyncio.get_running_loop().create_task(self._answer(request))
            self._answers[key] = task
            if len(self._answers) > ANSWERS_KEPT and self._oldest_is_done():
                self._answers.popitem(last=False)
        return m.encode(await asyncio.shield(task))

    def _oldest_is_done(self) -> bool:
        return next(iter(self._answers.values())).done()

    async def _answer(self, request: m.Request) -> m.Answer:
        try:
            if isinstance(request.body, m.Hello):
                async with self._greeting:
                    return await self._greet(request, request.body)
            return await self._do(request)
        except StaleCommandError as error:
            return m.Refused(error.code, str(error), error.newest)
        except Exception as error:  # an arbiter's fault must not end the host
            self._log.exception("%s", type(request.body).__name__)
            return m.Refused("FAILED", f"{type(error).__name__}: {error}")

    async def _greet(self, request: m.Request, hello: m.Hello) -> m.Answer:
        if hello.version != m.VERSION:
            reason = f"the host speaks version {m.VERSION} of the link, not {hello.version}"
            return m.Refused("VERSION", f"{reason}: install the same m2pem-plugin-zenoh on both")
        owner = self._store.journal
        if owner and owner != request.journal:
            if self._contact:
                return m.Refused("IN_USE", f"{self._who} commands its vehicles")
            if going := self._store.going():
                names = ", ".join(each.id for each in going)
                return m.Refused(
                    "IN_USE",
                    f"{names} of another journal still goes on; let its executive resume and end "
                    f"it, or remove the state of the host",
                )
        if not self._store.greet(request.executive):
            return self._superseded()
        if self._contact and self._executive != request.executive:
            self._log.warning("%s has taken over from %s", hello.who, self._who)
        if self._arbiter is None or owner != request.journal:
            await self._end()
            if owner != request.journal:
                self._store.begin_journal(request.journal)
            await self._begin()
        if not hello.fresh:
            await self._settle(frozenset(hello.going))
        self._contact, self._executive, self._who = uuid4().hex, request.executive, hello.who
        self._note_contact()
        self._news.set()
        self._log.info("contact with %s", hello.who)
        return m.Welcome(self._contact, self._store.identity, self._now_us)

    async def _settle(self, going: frozenset[str]) -> None:
        """After a lost contact: hold what the executive has given up, let go on what it has not."""
        arbiter, held = self._arbiter, set(self._store.held())
        assert arbiter is not None
        for kept in self._store.going():
            for resource in kept.resources:
                if kept.id not in going:
                    await arbiter.hold(resource)
                elif resource in held:
                    await arbiter.resume(resource)
                    self._note(f"{resource} goes on with {kept.id}")
        self._store.hold(())

    def _ping(self, request: m.Request, ping: m.Ping) -> m.Answer:
        if refused := self._out_of_contact(request):
            return refused
        self._note_contact()
        if ping.round_trip_s is not None:
            self._round_trip_s = ping.round_trip_s
        return m.Done(self._now_us)

    def _out_of_contact(self, request: m.Request) -> m.Refused | None:
        if self._contact and request.executive != self._executive:
            return self._superseded()
        if self._contact and request.contact == self._contact:
            return None
        return m.Refused("NO_CONTACT", "the host has lost the contact meanwhile")

    def _superseded(self) -> m.Refused:
        newer = self._who or "another executive"
        return m.Refused(
            "SUPERSEDED",
            f"{newer} has taken the host over from this one; to have it back, start this one again",
        )

    async def _do(self, request: m.Request) -> m.Answer:
        arbiter, body = self._arbiter, request.body
        if arbiter is None or request.journal != self._store.journal:
            return m.Refused("IN_USE", "another executive commands its vehicles")
        # What stops a vehicle is done without contact, too.
        match body:
            case m.Cancel():
                self._require("cancel", body.behavior, body.epoch)
                await arbiter.cancel(body.behavior, body.epoch)
                return self._done()
            case m.Hold():
                self._held_for_executive.add(ResourceId(body.resource))
                await arbiter.hold(ResourceId(body.resource))
                return self._done()
        if refused := self._out_of_contact(request):
            return refused
        self._note_contact()
        match body:
            case m.Start():
                return await self._start(arbiter, body)
            case m.Query():
                return await self._query(arbiter, body)
            case m.Adjust():
                self._require("adjust", body.behavior, body.epoch)
                assert adjusts(arbiter)  # its capabilities say so at the other end
                parameters = m.resolved_parameters(body.parameters)
                await arbiter.adjust(body.behavior, body.epoch, parameters)
            case m.Resume():
                resource = ResourceId(body.resource)
                self._held_for_executive.discard(resource)
                self._store.hold(self._store.held() - {resource})
                await arbiter.resume(resource)
            case m.Fence():
                self._store.admit(body.run, body.epoch)
                if fences(arbiter):
                    await arbiter.fence(body.run, body.epoch)
            case m.Reclaim():
                assert reclaims(arbiter)  # its capabilities say so at the other end
                text = await arbiter.reclaim(ResourceId(body.resource))
                return m.Done(self._now_us, text)
        return self._done()

    async def _start(self, arbiter: Arbiter, body: m.Start) -> m.Answer:
        request = m.behavior_request(body.request)
        self._require("start", request.id, request.epoch)
        known = self._store.behavior(request.id)
        # A higher epoch that starts an ended behavior again means it: it is another executive.
        if known is not None and not (known.ended and request.epoch > known.epoch):
            self._store.raise_epoch(request.id, request.epoch)
            return self._done()
        self._store.begin(request)
        try:
            await arbiter.start(request)
        except StaleCommandError:
            raise
        except Exception as error:  # an arbiter's fault must not end the host
            self._log.exception("start of %s", request.id)
            reason = f"the arbiter raised {type(error).__name__}: {error}"
            self._keep(BehaviorReport(request.id, 1, BehaviorState.REJECTED, "REJECTED", reason))
        return self._done()

    async def _query(self, arbiter: Arbiter, body: m.Query) -> m.Answer:
        self._store.admit(body.behavior, body.epoch)
        kept = self._store.behavior(body.behavior)
        last = kept.report if kept is not None else None
        if kept is not None and kept.ended and last is not None:
            found = last
        else:
            reference = body.native_ref
            if last is not None and last.native_ref is not None:
                reference = last.native_ref
            found = await arbiter.query(body.behavior, reference)
        found = replace(found, epoch=self._store.epoch(body.behavior))
        resources = kept.resources if kept is not None else ()
        # The arbiter says it of holds that it finds, not of those that it was asked for: an
        # executive that has just begun knows of neither.
        held = self._held_for_executive | self._store.held()
        if found.state in (BehaviorState.ACCEPTED, BehaviorState.RUNNING) and held & {*resources}:
            found = replace(found, held=True)
        return m.Found(m.encode_report(found), resources)

    def _require(self, what: str, behavior: str, epoch: int) -> None:
        """Check that a command is not of a past epoch; raises StaleCommandError."""
        if not self._store.admit(behavior, epoch):
            newest = self._store.epoch(behavior)
            raise StaleCommandError(f"{what} of {behavior}", run_of(behavior), epoch, newest)

    def _done(self) -> m.Done:
        return m.Done(self._now_us)

    # --- reports and states ---------------------------------------------------------------------

    async def _read_reports(self, arbiter: Arbiter) -> None:
        async for report in arbiter.reports():
            self._keep(report)

    def _keep(self, report: BehaviorReport) -> None:
        kept = self._store.behavior(report.id)
        if kept is not None:
            if kept.ended:
                return
            number = kept.report.number if kept.report is not None else 0
            # An arbiter that was restarted counts from the start again.
            if report.number <= number:
                report = replace(report, number=number + 1)
        self._store.report(report)
        if report.state.terminal:
            self._ending.discard(report.id)
        self._news.set()

    async def _read_telemetry(self, arbiter: Arbiter) -> None:
        async for state in arbiter.telemetry():
            self._take(state)

    def _take(self, state: Telemetry) -> None:
        if isinstance(state, TeamState):
            return
        if isinstance(state, PayloadState) and state.detections:
            self._store.state(m.encode_states([state]))
            self._news.set()
            return
        self._pending[state.resource] = state
        self._states.set()

    async def _deliver(self) -> None:
        while True:
            await self._news.wait()
            self._news.clear()
            while self._contact and (items := self._store.waiting(ITEMS_AT_ONCE)):
                message = m.Items(self._store.identity, tuple(items))
                try:
                    received = await self._outlet.deliver(self._executive, message)
                except LinkError:
                    received = 0
                self._store.received(received)
                if received < items[0].number:
                    await asyncio.sleep(AGAIN_S)

    async def _publish(self) -> None:
        while True:
            await self._states.wait()
            self._states.clear()
            if self._contact:
                pending, self._pending = self._pending, {}
                self._outlet.publish(self._executive, m.encode_states([*pending.values()]))
            await asyncio.sleep(self.state_interval_s)

    @property
    def state_interval_s(self) -> float:
        """How long the host waits from one state of a resource to the next: as the fleet says, or
        a round trip on a slow link, but so that the executive does not believe it lost."""
        slow_s = max(1.0 / self._hosted.host.telemetry_hz, self._round_trip_s)
        return min(slow_s, self._bound_s / 2)

    # --- without contact ------------------------------------------------------------------------

    async def _watch(self) -> None:
        while True:
            await asyncio.sleep(self._bound_s / 8)
            silent_s = asyncio.get_running_loop().time() - self._received_s
            if self._contact and silent_s > self._bound_s:
                self._contact = ""
                self._log.warning("no contact with %s for %.1f s", self._who, silent_s)
            if not self._contact and self._arbiter is not None and not self._greeting.locked():
                await self._act_alone(self._arbiter)

    async def _act_alone(self, arbiter: Arbiter) -> None:
        """Do what the fleet says of behaviors that go on without contact."""
        alone_s = (self._now_us - self._received_us) / 1e6
        for kept in self._store.going():
            for resource in kept.resources:
                policy = self._hosted.when_cut_off[resource]
                if alone_s < policy.after_s:
                    continue
                try:
                    await self._act(arbiter, kept, resource, policy.of(kept.name))
                except Exception:  # it is tried again, and the other vehicles have their turn
                    self._log.exception("%s without contact", resource)

    async def _act(
        self, arbiter: Arbiter, kept: Kept, resource: ResourceId, action: WhenCutOff
    ) -> None:
        if action is WhenCutOff.END and kept.id not in self._ending:
            await arbiter.cancel(kept.id, self._store.epoch(kept.id))
            self._ending.add(kept.id)
            self._note(f"{kept.id} of {resource} was ended, as there was no contact")
        elif action is WhenCutOff.HOLD:
            held = self._store.held()
            if resource not in held and resource not in self._held_for_executive:
                await arbiter.hold(resource)
                self._store.hold(held | {resource})
                self._note(f"{resource} was held, as there was no contact")

    def _note(self, text: str) -> None:
        """Have operators told, once there is contact."""
        self._log.warning("%s", text)
        self._store.note(text)
        self._news.set()

    # --- inside ---------------------------------------------------------------------------------

    def _note_contact(self) -> None:
        self._received_s = asyncio.get_running_loop().time()
        self._received_us = self._now_us

    @property
    def _now_us(self) -> int:
        return self._context.clock.now_us()

    @property
    def _silence_s(self) -> float:
        """The shortest silence after which one of its resources counts as lost."""
        arbiter, connections = self._arbiter, self._hosted.connections.values()
        if arbiter is None:
            return LOST_AFTER_S
        return min((lost_after_s(each, arbiter) for each in connections), default=LOST_AFTER_S)

    @property
    def _bound_s(self) -> float:
        return self._silence_s + self._hosted.host.round_trip_s

    def _create(self, job: Coroutine[Any, Any, None], name: str) -> asyncio.Task[None]:
        return create_task(job, f"host: {name}", self._log)


def create_task(job: Coroutine[Any, Any, None], name: str, log: Logger) -> asyncio.Task[None]:
    """Create a task. Its error is logged."""

    def ended(task: asyncio.Task[None]) -> None:
        if not task.cancelled() and (error := task.exception()) is not None:
            log.error("%s broke off", name, exc_info=error)

    task = asyncio.get_running_loop().create_task(job, name=name)
    task.add_done_callback(ended)
    return task
