"""An m2pem node for a vehicle: what it is asked for, a driver on board does."""

import asyncio
import logging
import time
from collections.abc import AsyncIterator, Callable, Sequence
from dataclasses import replace
from typing import Any
from uuid import UUID, uuid5

from m2pem_interfaces import msg as interfaces

from m2pem.api import (
    BehaviorRequest,
    BehaviorSpec,
    BehaviorState,
    Clock,
    FleetBus,
    PayloadState,
)
from m2pem_plugin_ros.catalogue import LEVEL
from m2pem_plugin_ros.drivers.driver import Driver, Order, Outcome, Told
from m2pem_plugin_ros.interfaces.behavior_command import (
    Asked,
    Verb,
    misfit,
    read_command,
    read_parameters,
    read_request,
)
from m2pem_plugin_ros.interfaces.behavior_status import Status
from m2pem_plugin_ros.interfaces.key_values import WireError
from m2pem_plugin_ros.interfaces.vehicle_status import VehicleStatus
from m2pem_plugin_ros.log_throttle import Complaints
from m2pem_plugin_ros.onboard.action_server import Goals
from m2pem_plugin_ros.onboard.journal import Book
from m2pem_plugin_ros.onboard.publisher import Voice
from m2pem_plugin_ros.onboard.target_bus import Targets, read_target
from m2pem_plugin_ros.runtime import RosRuntime, qos

LOGGER = logging.getLogger("m2pem.onboard")

IDS = UUID("5f0c3c36-3a52-5e43-9d0a-6f1b0c1f7b61")
"""Ids of behaviors are any text; drivers know goals by UUIDs, which are made of them by this."""

SILENT_AFTER_S = 3.0
"""A driver whose vehicle was not heard for so long has lost it."""

SILENT_LEAST_S = 2.0
"""Of real time: a clock may be so fast that a busy computer is silent for longer than that."""

ENDED = "the node on the vehicle was ended"
STOP_WITHIN_S = 5.0
SAID_WITHIN_S = 1.0


class Onboard:
    """Serves `command`, `behavior_status`, `vehicle_status` and `execute_behavior` in the vehicle's
    namespace (docs/ros.md, "Write your own node"), and of a payload `payload_status`.

    `vehicle`: its name in the fleet, or that of the payload. `make_driver`: of what is on board,
    and what it tells comes here. `bus`: gets what is heard on `target`; it is to be the one that
    the driver's context has. `catalogue`: what the driver can do. `sight`: of a payload, where it
    looks.
    """

    def __init__(
        self,
        ros: RosRuntime,
        vehicle: str,
        namespace: str,
        make_driver: Callable[[Told], Driver],
        *,
        clock: Clock,
        bus: FleetBus | None = None,
        catalogue: Sequence[BehaviorSpec] = LEVEL,
        sight: Callable[[], PayloadState | None] | None = None,
        logger: logging.Logger = LOGGER,
    ) -> None:
        self._ros = ros
        self._name = vehicle
        self._namespace = namespace
        self._clock = clock
        self._bus = Targets() if bus is None else bus
        self._catalogue = catalogue
        self._logger = logger
        self._complaints = Complaints(logger, vehicle)
        self._book = Book(self._say)
        self._voice = Voice(clock, self._about_vehicle, sight)
        self._held = False
        self._ending = False
        self._heard_us: int | None = None
        self._heard_s = 0.0
        self._request: BehaviorRequest | None = None
        self._ids: dict[UUID, str] = {}
        self._over = asyncio.Event()
        self._tasks: list[asyncio.Task[None]] = []
        self._node: Any = None
        self._goals: Goals | None = None
        self._driver = make_driver(_Told(self))

    # --- life -----------------------------------------------------------------------------------

    async def open(self) -> None:
        """Open the driver, and be there for commands."""
        await self._driver.open()
        node = self._node = self._ros.make_node(
            "m2pem_onboard",
            self._namespace,
            start_parameter_services=False,
            enable_rosout=False,
        )
        self._voice.open(node)
        self._goals = Goals(self._ros, node, self)
        subscribe = self._ros.subscribe
        subscribe(interfaces.BehaviorCommand, "command", self.command, qos.COMMANDS, node=node)
        subscribe(interfaces.TargetState, "target", self._hear_target, qos.TELEMETRY, node=node)
        loop = asyncio.get_running_loop()
        self._tasks = [
            loop.create_task(self._voice.keep_telling()),
            loop.create_task(self._watch()),
        ]

    async def close(self) -> None:
        """Stop the vehicle, say so, and let go."""
        self._ending = True
        try:
            if id_ := self._book.current:
                self._over.clear()
                self._driver.end(_goal(id_))
                await self._within(self._over.wait(), STOP_WITHIN_S)
                self._book.end(id_, BehaviorState.CANCELLED, reason=ENDED)
            if self._goals is not None:
                await self._goals.settled(SAID_WITHIN_S)
                await self._voice.heard_out(SAID_WITHIN_S)
        finally:
            await self.drop()

    async def drop(self) -> None:
        """Let go at once, without a word, as when the power fails."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        self._tasks = []
        self._voice.close()
        self._goals = None
        try:
            await self._driver.close()
        finally:
            node, self._node = self._node, None
            if node is not None:
                self._ros.drop_node(node)

    # --- commands -------------------------------------------------------------------------------

    def command(self, message: Any) -> None:
        """What came on `command`."""
        try:
            asked = read_command(message)
        except WireError as error:
            self._complaints.add("a command that cannot be", str(error))
            return
        if asked.verb is Verb.START:
            self.start(message)
        elif asked.verb is Verb.QUERY:
            self._book.is_past(asked.run, asked.epoch)  # who asks after a takeover shuts others out
            self._book.again(asked.id)
        elif asked.verb is Verb.HOLD:
            self._hold()
        elif asked.verb is Verb.RESUME:
            self._resume()
        elif self._book.is_past(asked.run, asked.epoch):
            text = f"{asked.verb.name} of {asked.id}: {_past(asked.epoch)}"
            self._complaints.add("a command of the past", text)
        elif asked.verb is Verb.CANCEL:
            self.cancel(asked.id)
        else:
            self._adjust(asked, message)

    def start(self, message: Any) -> None:
        """START: begin what is new, and say again what was said of what is not."""
        id_ = message.id
        if self._book.knows(id_):
            self._book.again(id_)
            return
        if self._book.is_past(message.run, message.epoch):
            self._book.reject(id_, "REJECTED", _past(message.epoch))
            return
        try:
            request = read_request(message, self._name)
            reason = self._refusal(request)
        except WireError as error:
            reason = str(error)
        except Exception as error:  # a driver's bug must not leave a START without an answer
            self._logger.exception("%s: %s", self._name, message.behavior)
            reason = f"the driver is wrong: {error!r}"
        if reason:
            self._book.reject(id_, "REJECTED", reason)
            return
        self._begin(request, message.run)

    def cancel(self, id_: str) -> None:
        """CANCEL: end it, if it goes on; of what has ended, say again how."""
        if id_ == self._book.current:
            self._driver.end(_goal(id_))
        elif self._book.knows(id_):
            self._book.again(id_)

    def _refusal(self, request: BehaviorRequest) -> str:
        if self._ending:
            return ENDED
        catalogue, parameters = self._catalogue, request.parameters
        if reason := misfit(catalogue, self._name, request.behavior, parameters):
            return reason
        return self._silence() or self._driver.refusal(request)

    def _begin(self, request: BehaviorRequest, run: str) -> None:
        preempted = {id_: _goal(id_) for id_ in request.preempts}
        if current := self._book.current:
            preempted[current] = _goal(current)
        order = Order(request, _goal(request.id), uuid5(IDS, run), tuple(preempted.values()))
        self._ids = {order.goal: request.id}
        self._request = request
        self._held = False
        self._book.accept(request.id)
        try:
            self._driver.begin(order)
        except Exception as error:  # of the driver; it must not end the node
            self._logger.exception("%s: %s", self._name, request.behavior)
            reason = f"the driver is wrong: {error!r}"
            self._book.end(request.id, BehaviorState.FAILED, "FAILED", reason)
        self._voice.vehicle()

    def _hold(self) -> None:
        if not self._held:
            self._held = True
            self._driver.hold()
        self._voice.vehicle()

    def _resume(self) -> None:
        if self._held:
            self._held = False
            self._driver.resume()
        self._voice.vehicle()

    def _adjust(self, asked: Asked, message: Any) -> None:
        if asked.id != self._book.current or self._request is None:
            return
        try:
            parameters = read_parameters(message)
        except WireError as error:
            self._complaints.add("a change that cannot be", str(error))
            return
        behavior, together = self._request.behavior, {**self._request.parameters, **parameters}
        if reason := misfit(self._catalogue, self._name, behavior, together):
            self._complaints.add("a change that cannot be", reason)
            return
        self._request = replace(self._request, parameters=together)
        self._driver.adjust(_goal(asked.id), parameters)

    # --- what the driver tells ------------------------------------------------------------------

    def heard(self) -> None:
        """The vehicle is alive."""
        self._heard_us = self._clock.now_us()
        self._heard_s = time.monotonic()

    def progress(self, goal: UUID) -> None:
        """The vehicle does it."""
        if goal in self._ids:
            self._book.progress(self._ids[goal])

    def ended(self, goal: UUID, outcome: Outcome) -> None:
        """It has ended."""
        if goal in self._ids:
            reason = outcome.reason or (ENDED if self._ending else "")
            self._book.end(self._ids[goal], outcome.state, outcome.code, reason, outcome.outputs)

    # --- what is said ---------------------------------------------------------------------------

    def _say(self, status: Status) -> None:
        self._voice.behavior(status)
        if self._goals is not None:
            self._goals.said(status)
        if status.state.terminal:
            self._over.set()
            self._voice.vehicle()

    def _about_vehicle(self) -> VehicleStatus:
        health, silence = self._driver.health, self._silence()
        if silence:
            reasons = (*health.not_ready_reasons, silence)
            health = replace(health, ready=False, not_ready_reasons=reasons)
        return VehicleStatus(self._name, self._book.current, self._held, health)

    async def _watch(self) -> None:
        """Give up on a vehicle that is not heard any more."""
        async for _ in rounds(self._clock, SILENT_AFTER_S / 5):
            if (reason := self._silence()) and (id_ := self._book.current):
                self._driver.forget()
                self._book.end(id_, BehaviorState.LOST, "LINK_LOST", reason)

    def _silence(self) -> str:
        """Why the driver's vehicle counts as lost; "" if it does not."""
        if self._heard_us is None:
            return "the vehicle was not heard yet"
        silent_s = (self._clock.now_us() - self._heard_us) / 1e6
        if silent_s <= SILENT_AFTER_S or time.monotonic() - self._heard_s <= SILENT_LEAST_S:
            return ""
        return f"the vehicle was not heard for {silent_s:.1f} s"

    # --- inside ---------------------------------------------------------------------------------

    def _hear_target(self, message: Any) -> None:
        try:
            target = read_target(message, self._clock.now_us())
        except WireError as error:
            self._complaints.add("a target that cannot be", str(error))
        else:
            self._bus.publish(target)

    async def _within(self, happens: Any, seconds: float) -> None:
        """Wait for something, or so many seconds of the clock."""
        waited = asyncio.ensure_future(happens)
        late = asyncio.ensure_future(self._clock.sleep(seconds))
        await asyncio.wait([waited, late], return_when=asyncio.FIRST_COMPLETED)
        for task in (waited, late):
            task.cancel()
        await asyncio.gather(waited, late, return_exceptions=True)


class _Told:
    """What the driver is given to tell: no more of the node than that."""

    def __init__(self, node: Onboard) -> None:
        self.heard = node.heard
        self.progress = node.progress
        self.ended = node.ended


def _goal(id_: str) -> UUID:
    return uuid5(IDS, id_)


def _past(epoch: int) -> str:
    return f"epoch {epoch} is past: another executive drives the run"


LATE = 2.0
"""Who comes so many times later than it was to, was not running: on a busy computer, say."""


async def rounds(clock: Clock, every_s: float) -> AsyncIterator[None]:
    """Once in `every_s`, of the clock.

    After a round that came late, what arrived meanwhile is not read yet: the round is left out, but
    never two in a row, so that a computer that is always late does not go without.
    """
    left_out = False
    while True:
        began_us = clock.now_us()
        await clock.sleep(every_s)
        late = (clock.now_us() - began_us) / 1e6 > LATE * every_s
        left_out = late and not left_out
        if not left_out:
            yield
