"""An m2pem node: receives commands, and has a driver on board execute them."""

import asyncio
import logging
import time
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any
from uuid import UUID, uuid5

from m2pem_interfaces import msg as interfaces

from m2pem.api import (
    BehaviorRequest,
    BehaviorSpec,
    BehaviorState,
    Clock,
    EpochFence,
    FleetBus,
    PayloadState,
    Value,
)
from m2pem.api.latest_task import cancel_and_wait
from m2pem_plugin_ros.catalogue import LEVEL
from m2pem_plugin_ros.drivers.driver import Driver, DriverEvents, Order, Outcome
from m2pem_plugin_ros.installation import require_interfaces
from m2pem_plugin_ros.interfaces.behavior_command import (
    REFUSAL_CODE,
    Command,
    Verb,
    mismatch,
    past_reason,
    read_command,
    read_parameters,
    read_request,
)
from m2pem_plugin_ros.interfaces.behavior_status import Status
from m2pem_plugin_ros.interfaces.key_values import WireError
from m2pem_plugin_ros.interfaces.vehicle_status import VehicleStatus
from m2pem_plugin_ros.log_throttle import LogThrottle
from m2pem_plugin_ros.onboard.action_server import BehaviorActionServer
from m2pem_plugin_ros.onboard.journal import BehaviorJournal
from m2pem_plugin_ros.onboard.publisher import StatusPublisher
from m2pem_plugin_ros.onboard.target_bus import TargetBus, read_target
from m2pem_plugin_ros.runtime import RosRuntime, qos

LOGGER = logging.getLogger("m2pem.onboard")

IDS = UUID("5f0c3c36-3a52-5e43-9d0a-6f1b0c1f7b61")
"""Namespace of the UUIDs of goals. Ids of behaviors are any text, but drivers need UUIDs."""

SILENT_AFTER_S = 3.0
"""A vehicle that its driver did not report for this time is lost."""

SILENT_LEAST_S = 2.0
"""The same in real time, as a busy computer may be silent for longer on a fast clock."""

ENDED = "the node on the vehicle was stopped"
DEACTIVATED = "the node on the vehicle was deactivated"
STOP_WITHIN_S = 5.0
SENT_WITHIN_S = 1.0


class OnboardNode:
    """The m2pem node of a vehicle or payload (docs/ros-nodes.md). It serves
    `command`, `behavior_status`, `vehicle_status` and `execute_behavior` in `namespace`, and for a
    payload `payload_status`.

    `vehicle`: its name in the fleet, or that of the payload. `make_driver` gets this
    node as `DriverEvents`. `bus` receives the states on `target`; it must be the bus of the
    driver's context. `catalogue`: the behaviors of the driver. `payload_state` returns the state of
    the payload.
    `epochs`: those of the runs; with a file, past executives are refused after a restart, too.
    `node`: serves on this node, which stays at the end; else on one of its own. `inactive`: why it
    obeys no START; "" if it does. `standstill` returns why the clock stands, "" if it does not.
    """

    def __init__(
        self,
        ros: RosRuntime,
        vehicle: str,
        namespace: str,
        make_driver: Callable[[DriverEvents], Driver],
        *,
        clock: Clock,
        bus: FleetBus | None = None,
        catalogue: Sequence[BehaviorSpec] = LEVEL,
        payload_state: Callable[[], PayloadState | None] | None = None,
        epochs: EpochFence | None = None,
        logger: logging.Logger = LOGGER,
        node: Any = None,
        inactive: str = "",
        standstill: Callable[[], str] = str,
    ) -> None:
        self._ros = ros
        self._name = vehicle
        self._namespace = namespace
        self._clock = clock
        self._bus = TargetBus() if bus is None else bus
        self._catalogue = catalogue
        self._logger = logger
        self._log_throttle = LogThrottle(logger, vehicle)
        self._journal = BehaviorJournal(self._publish_status, epochs)
        self._publisher = StatusPublisher(clock, self._about_vehicle, payload_state, ros.stamp_us)
        self._held = False
        self._inactive = inactive
        self._end_reason = ""
        self._standstill = standstill
        self._contact_us: int | None = None
        self._contact_s = 0.0
        self._request: BehaviorRequest | None = None
        self._ids: dict[UUID, str] = {}
        self._ended_event = asyncio.Event()
        self._tasks: list[asyncio.Task[None]] = []
        self._node: Any = node
        self._owns_node = node is None
        self._goals: BehaviorActionServer | None = None
        self._driver = make_driver(self)

    # --- life -----------------------------------------------------------------------------------

    async def open(self) -> None:
        """Open the driver, and serve.

        Raises:
            RosError: the interfaces are those of an earlier m2pem.
        """
        require_interfaces("m2pem_interfaces")
        await self._driver.open()
        if self._owns_node:
            self._node = self._ros.make_node(
                "m2pem_onboard",
                self._namespace,
                start_parameter_services=False,
                enable_rosout=False,
            )
        node = self._node
        self._publisher.open(node)
        self._goals = BehaviorActionServer(self._ros, node, self)
        subscribe = self._ros.subscribe
        subscribe(interfaces.BehaviorCommand, "command", self.command, qos.COMMANDS, node=node)
        subscribe(interfaces.TargetState, "target", self._on_target, qos.TELEMETRY, node=node)
        loop = asyncio.get_running_loop()
        self._tasks = [
            loop.create_task(self._publisher.keep_publishing()),
            loop.create_task(self._watch()),
        ]

    async def close(self) -> None:
        """Stop the vehicle, publish the end of its behavior, and close."""
        self._inactive = self._end_reason = ENDED
        try:
            if id_ := self._journal.current:
                self._ended_event.clear()
                self._driver.end(_goal(id_))
                await self._within(self._ended_event.wait(), STOP_WITHIN_S)
                self._journal.end(id_, BehaviorState.CANCELLED, reason=ENDED)
            if self._goals is not None:
                await self._goals.wait_until_ended(SENT_WITHIN_S)
                await self._publisher.wait_until_received(SENT_WITHIN_S)
        finally:
            await self.drop()

    async def drop(self) -> None:
        """Close at once without publishing, as in a power failure."""
        await cancel_and_wait(*self._tasks)
        self._tasks = []
        self._publisher.close()
        self._goals = None
        try:
            await self._driver.close()
        finally:
            node, self._node = self._node, None
            if node is not None and self._owns_node:
                self._ros.drop_node(node)

    # --- whether it obeys -----------------------------------------------------------------------

    @property
    def busy(self) -> bool:
        """Whether the vehicle has a behavior, or is still stopping."""
        return bool(self._journal.current)

    def activate(self) -> None:
        """Obey commands from now on."""
        self._inactive = ""
        self._publisher.vehicle()

    def deactivate(self, reason: str) -> None:
        """Obey no START from now on, for that reason, and stop the vehicle."""
        self._inactive = reason
        self.stop(DEACTIVATED)
        self._publisher.vehicle()

    def stop(self, reason: str) -> None:
        """Stop the vehicle; its behavior ends as CANCELLED with that reason."""
        if id_ := self._journal.current:
            self._end_reason = reason
            self._driver.end(_goal(id_))

    # --- commands -------------------------------------------------------------------------------

    def command(self, message: Any) -> None:
        """Handle a message on `command`."""
        try:
            command = read_command(message)
        except WireError as error:
            self._log_throttle.log("an invalid command", str(error))
            return
        if command.verb is Verb.START:
            self.start(message)
            return
        is_past = bool(command.run) and self._is_past(command)
        if command.verb is Verb.HOLD:  # from any sender
            self._hold()
        elif command.verb is Verb.QUERY:
            self._journal.repeat(command.id)
        elif is_past or command.verb is Verb.CLAIM:
            return
        elif command.verb is Verb.RESUME:
            self._resume()
        elif command.verb is Verb.CANCEL:
            self.cancel(command.id)
        else:
            self._adjust(command, message)

    def _is_past(self, command: Command) -> bool:
        """Whether another executive drives the run by now, which is said if the command is refused
        for it."""
        if self._journal.epochs.admit_run(command.run, command.epoch):
            return False
        newest = self._journal.epochs.newest_of_run(command.run)
        if command.verb is not Verb.HOLD:
            text = f"{command.verb.name} {command.id}: {past_reason(command.epoch, newest)}"
            self._log_throttle.log("a command of a past epoch", text)
            self._publisher.refusal(command, newest)
        return True

    def start(self, message: Any) -> None:
        """Handle a START: begin a new behavior, or publish the status of a known one again."""
        id_ = message.id
        is_past = self._is_past(Command(Verb.START, id_, message.run, message.epoch))
        if self._journal.knows(id_):
            self._journal.repeat(id_)
            return
        if is_past:
            newest = self._journal.epochs.newest_of_run(message.run)
            self._journal.reject(id_, REFUSAL_CODE, past_reason(message.epoch, newest))
            return
        try:
            request = read_request(message, self._name)
            reason = self._refusal(request)
        except WireError as error:
            reason = str(error)
        except Exception as error:  # a START must not remain without an answer
            self._logger.exception("%s: %s", self._name, message.behavior)
            reason = f"internal error of the driver: {error!r}"
        if reason:
            self._logger.info("%s: %s is rejected: %s", self._name, id_, reason)
            self._journal.reject(id_, "REJECTED", reason)
            return
        self._logger.info("%s: %s begins: %s", self._name, id_, request.behavior)
        self._begin(request, message.run)

    def cancel(self, id_: str) -> None:
        """Handle a CANCEL: end the current behavior, or publish the status of an ended one
        again."""
        if id_ == self._journal.current:
            self._driver.end(_goal(id_))
        elif self._journal.knows(id_):
            self._journal.repeat(id_)

    def _refusal(self, request: BehaviorRequest) -> str:
        if reason := self._inactive or self._standstill():
            return reason
        catalogue, parameters = self._catalogue, request.parameters
        if reason := mismatch(catalogue, self._name, request.behavior, parameters):
            return reason
        return self._lost_reason() or self._driver.refusal(request)

    def _begin(self, request: BehaviorRequest, run: str) -> None:
        preempted = {id_: _goal(id_) for id_ in request.preempts}
        if current := self._journal.current:
            preempted[current] = _goal(current)
        order = Order(request, _goal(request.id), uuid5(IDS, run), tuple(preempted.values()))
        self._ids = {order.goal: request.id}
        self._request = request
        self._held = False
        self._end_reason = ""
        self._journal.accept(request.id)
        try:
            self._driver.begin(order)
        except Exception as error:  # an error of the driver must not end the node
            self._logger.exception("%s: %s", self._name, request.behavior)
            reason = f"internal error of the driver: {error!r}"
            self._journal.end(request.id, BehaviorState.FAILED, "FAILED", reason)
        self._publisher.vehicle()

    def _hold(self) -> None:
        if not self._held:
            self._held = True
            self._driver.hold()
        self._publisher.vehicle()

    def _resume(self) -> None:
        if self._held:
            self._held = False
            self._driver.resume()
        self._publisher.vehicle()

    def _adjust(self, command: Command, message: Any) -> None:
        if command.id != self._journal.current or self._request is None:
            return
        try:
            parameters = read_parameters(message)
        except WireError as error:
            self._log_throttle.log("an invalid change of parameters", str(error))
            return
        behavior, together = self._request.behavior, {**self._request.parameters, **parameters}
        if reason := mismatch(self._catalogue, self._name, behavior, together):
            self._log_throttle.log("an invalid change of parameters", reason)
            return
        self._request = replace(self._request, parameters=together)
        self._driver.adjust(_goal(command.id), parameters)

    # --- reports of the driver ------------------------------------------------------------------

    def alive(self) -> None:
        self._contact_us = self._clock.now_us()
        self._contact_s = time.monotonic()

    def progress(self, goal: UUID) -> None:
        if goal in self._ids:
            self._journal.progress(self._ids[goal])

    def remains(self, goal: UUID, remaining: Mapping[str, Value]) -> None:
        if goal in self._ids:
            self._journal.remains(self._ids[goal], remaining)

    def ended(self, goal: UUID, outcome: Outcome) -> None:
        if goal in self._ids:
            reason = outcome.reason or self._end_reason
            state = outcome.state.name
            why = f": {reason}" if reason else ""
            self._logger.info("%s: %s ends: %s%s", self._name, self._ids[goal], state, why)
            self._journal.end(self._ids[goal], outcome.state, outcome.code, reason, outcome.outputs)

    def superseded(self, run: str, newest: int) -> None:
        """Do nothing: what drives on board compares no epochs."""

    # --- statuses -------------------------------------------------------------------------------

    def _publish_status(self, status: Status) -> None:
        self._publisher.behavior(status)
        if self._goals is not None:
            self._goals.publish_status(status)
        if status.state.terminal:
            self._ended_event.set()
            self._publisher.vehicle()

    def _about_vehicle(self) -> VehicleStatus:
        health, silence = self._driver.health, self._lost_reason()
        why_not = [each for each in (self._inactive, self._standstill(), silence) if each]
        if why_not:
            reasons = (*health.not_ready_reasons, *why_not)
            health = replace(health, ready=False, not_ready_reasons=reasons)
        return VehicleStatus(self._name, self._journal.current, self._held, health)

    async def _watch(self) -> None:
        """End the behavior of a vehicle that is lost."""
        async for _ in watchdog_rounds(self._clock, SILENT_AFTER_S / 5):
            if (reason := self._lost_reason()) and (id_ := self._journal.current):
                self._driver.abandon()
                self._journal.end(id_, BehaviorState.LOST, "LINK_LOST", reason)

    def _lost_reason(self) -> str:
        """Return why the vehicle counts as lost; "" if it does not."""
        if self._contact_us is None:
            return "the vehicle has sent no message yet"
        silent_s = (self._clock.now_us() - self._contact_us) / 1e6
        if silent_s <= SILENT_AFTER_S or time.monotonic() - self._contact_s <= SILENT_LEAST_S:
            return ""
        return f"the vehicle has sent no message for {silent_s:.1f} s"

    # --- inside ---------------------------------------------------------------------------------

    def _on_target(self, message: Any) -> None:
        try:
            target = read_target(message, self._clock.now_us())
        except WireError as error:
            self._log_throttle.log("an invalid target", str(error))
        else:
            self._bus.publish(target)

    async def _within(self, happens: Any, seconds: float) -> None:
        """Wait for an awaitable, or for so many seconds of the clock, which may stand, or real
        ones."""
        waits = (happens, self._clock.sleep(seconds), asyncio.sleep(seconds))
        tasks = [asyncio.ensure_future(each) for each in waits]
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        await cancel_and_wait(*tasks)


def _goal(id_: str) -> UUID:
    return uuid5(IDS, id_)


LATE = 2.0
"""A round that comes this many times later than planned means that the process was suspended."""


async def watchdog_rounds(clock: Clock, every_s: float) -> AsyncIterator[None]:
    """Yield once in `every_s` of the clock.

    After a late round, messages that arrived meanwhile are not read yet, so that round is skipped;
    but never two in a row, so that a computer that is always late still has rounds.
    """
    left_out = False
    while True:
        began_us = clock.now_us()
        await clock.sleep(every_s)
        late = (clock.now_us() - began_us) / 1e6 > LATE * every_s
        left_out = late and not left_out
        if not left_out:
            yield
