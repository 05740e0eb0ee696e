"""The driver of a vehicle with an m2pem node."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any
from uuid import UUID

from m2pem_interfaces import msg as interfaces

from m2pem.api import BehaviorRequest, BehaviorState, ResolvedValue
from m2pem.api.remember import remember
from m2pem_plugin_ros.drivers.driver import DriverSetup, Health, Order, Outcome
from m2pem_plugin_ros.drivers.node.action_link import ActionLink
from m2pem_plugin_ros.drivers.node.link import REMEMBERED, STILL_S, NodeLink, Retries
from m2pem_plugin_ros.drivers.node.topic_link import TopicLink
from m2pem_plugin_ros.interfaces.behavior_command import (
    Verb,
    adjust_command,
    read_refusal,
    vehicle_command,
)
from m2pem_plugin_ros.interfaces.behavior_status import read_status
from m2pem_plugin_ros.interfaces.key_values import WireError, encode_parameters
from m2pem_plugin_ros.interfaces.vehicle_status import VehicleStatus, read_vehicle_status
from m2pem_plugin_ros.log_throttle import LogThrottle
from m2pem_plugin_ros.runtime import qos
from m2pem_plugin_ros.settings import Via

HOLD_REPEATS = 20
"""HOLD is repeated for ten seconds at most while the node is received; one that is silent gets it
when it is back."""


class NodeDriver:
    def __init__(self, setup: DriverSetup) -> None:
        self._setup = setup
        self._clock = setup.context.clock
        self._log_throttle = LogThrottle(setup.context.logger, setup.connection.resource)
        self._holding = Retries(self._clock)
        self._status: VehicleStatus | None = None
        self._received_us = 0
        self._publisher: Any = None
        self._link: NodeLink | None = None
        self._claims: dict[UUID, int] = {}

    # --- life -----------------------------------------------------------------------------------

    async def open(self) -> None:
        ros = self._setup.ros
        self._publisher = ros.publisher(
            interfaces.BehaviorCommand, self._name("command"), qos.COMMANDS
        )
        if self._setup.settings.via is Via.ACTION:
            self._link = ActionLink(self._setup, self._name("execute_behavior"), self._log_throttle)
        else:
            link = self._link = TopicLink(self._setup, self._send, self._log_throttle)
            ros.subscribe(
                interfaces.BehaviorStatus,
                self._name("behavior_status"),
                lambda message: self._on_status(link, message),
                qos.BEHAVIOR_STATUS,
            )
        ros.subscribe(
            interfaces.CommandRefusal,
            self._name("command_refusal"),
            self._on_refusal,
            qos.COMMANDS,
        )
        ros.subscribe(
            interfaces.VehicleStatus,
            self._name("vehicle_status"),
            self._on_vehicle_status,
            qos.STATUS,
        )

    async def close(self) -> None:
        self._holding.stop_all()
        if self._link is not None:
            await self._link.close()

    @property
    def health(self) -> Health:
        """The health in the last vehicle_status."""
        return self._status.health if self._status is not None else Health()

    def refusal(self, request: BehaviorRequest) -> str:
        """Return why the request cannot be sent. The node decides whether it can be done."""
        try:
            encode_parameters(request.parameters)
        except WireError as error:
            return str(error)
        return ""

    def missing(self, request: BehaviorRequest) -> str:
        """Return which topic, service or message of the node is not there yet."""
        del request
        if self._status is None:
            return f"a message on {self._name('vehicle_status')}"
        if isinstance(self._link, ActionLink):
            return self._link.missing
        node, answers = self._setup.ros.node, self._name("behavior_status")
        if not self._publisher.get_subscription_count():
            return f"a subscriber to {self._name('command')}"
        return "" if node.count_publishers(answers) else f"a publisher of {answers}"

    # --- orders ---------------------------------------------------------------------------------

    def begin(self, order: Order) -> None:
        """Send the order. It ends a hold."""
        self._holding.stop_all()
        if reason := self.refusal(order.request):
            self._setup.events.ended(
                order.goal, Outcome(BehaviorState.REJECTED, "REJECTED", reason)
            )
        else:
            self._opened.begin(order)

    def end(self, goal: UUID) -> None:
        self._opened.end(goal)

    def adjust(self, goal: UUID, parameters: Mapping[str, ResolvedValue]) -> None:
        """Send the change once."""
        order = self._opened.order
        if order is None or order.goal != goal:
            return
        try:
            self._send(adjust_command(order, parameters, self._stamp_us()))
        except WireError as error:
            self._log_throttle.log("a change of parameters that cannot be sent", str(error))

    def hold(self) -> None:
        """Send HOLD until the node reports that the vehicle is held."""
        self._retry(Verb.HOLD, held=True)

    def resume(self) -> None:
        """Send RESUME until the node reports that the vehicle is not held."""
        self._retry(Verb.RESUME, held=False)

    async def query(self, order: Order) -> Outcome:
        """Return what the node reports of the goal, and whether the vehicle is held."""
        outcome = await self._opened.query(order)
        return replace(outcome, held=self._status is not None and self._status.held)

    def claim(self, run: UUID, epoch: int) -> None:
        """Send CLAIM now, and again whenever the node is received again."""
        remember(self._claims, run, epoch, REMEMBERED)
        self._send(vehicle_command(Verb.CLAIM, run, epoch, self._stamp_us()))

    def abandon(self) -> None:
        self._holding.stop_all()
        self._opened.abandon()

    # --- messages of the node -------------------------------------------------------------------

    def _on_vehicle_status(self, message: Any) -> None:
        self._setup.events.alive()
        self._status = sent = read_vehicle_status(message)
        was_silent = self._clock.now_us() - self._received_us > STILL_S * 1e6
        self._received_us = self._clock.now_us()
        if was_silent:
            for run, epoch in self._claims.items():
                self._send(vehicle_command(Verb.CLAIM, run, epoch, self._stamp_us()))
        if sent.vehicle != self._resource:
            self._log_throttle.log(
                f"the node in {self._name('')} belongs to another vehicle", sent.vehicle
            )
        self._opened.vehicle_does(sent.behavior)

    def _on_status(self, link: TopicLink, message: Any) -> None:
        self._setup.events.alive()
        try:
            link.status(read_status(message))
        except WireError as error:
            self._log_throttle.log("an invalid status", str(error))

    def _on_refusal(self, message: Any) -> None:
        refusal = read_refusal(message)
        self._setup.events.superseded(refusal.run, refusal.newest)

    # --- inside ---------------------------------------------------------------------------------

    @property
    def _resource(self) -> str:
        return self._setup.connection.resource

    @property
    def _opened(self) -> NodeLink:
        assert self._link is not None, "the driver is not open"
        return self._link

    def _name(self, leaf: str) -> str:
        return self._setup.settings.topic(leaf)

    def _stamp_us(self) -> int:
        return self._setup.ros.stamp_us(self._clock.now_us())

    def _send(self, message: object) -> None:
        self._publisher.publish(message)

    def _retry(self, verb: int, held: bool) -> None:
        # A status may be older than the command, so it is checked repeatedly.
        sent = 0
        order = self._opened.order
        run = None if order is None else order.run
        context = self._setup.context
        epoch = 0
        if order is not None:
            epoch = max(context.epoch_of(order.request.id), order.request.epoch)

        def send() -> bool:
            nonlocal sent
            if not (held or context.may_send()):
                return True
            agrees = self._status is not None and self._status.held is held
            if not (sent and agrees):
                self._send(vehicle_command(verb, run, epoch, self._stamp_us()))
            sent += self._clock.now_us() - self._received_us < STILL_S * 1e6
            return sent < HOLD_REPEATS

        self._holding.start("hold", send)
