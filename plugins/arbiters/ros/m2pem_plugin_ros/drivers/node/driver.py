"""Reaches a vehicle through the m2pem node that runs on it."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any
from uuid import UUID

from m2pem_interfaces import msg as interfaces

from m2pem.api import BehaviorRequest, BehaviorState, ResolvedValue
from m2pem_plugin_ros.drivers.driver import Health, Order, Outcome, Seat
from m2pem_plugin_ros.drivers.node.action_link import ByAction
from m2pem_plugin_ros.drivers.node.link import Insisting, Link
from m2pem_plugin_ros.drivers.node.topic_link import ByTopics
from m2pem_plugin_ros.interfaces.behavior_command import Verb, adjust_command, vehicle_command
from m2pem_plugin_ros.interfaces.behavior_status import read_status
from m2pem_plugin_ros.interfaces.key_values import WireError, encode_parameters
from m2pem_plugin_ros.interfaces.vehicle_status import VehicleStatus, read_vehicle_status
from m2pem_plugin_ros.log_throttle import Complaints
from m2pem_plugin_ros.runtime import qos
from m2pem_plugin_ros.settings import Via

HOLD_REPEATS = 20
"""A vehicle that says ten seconds long that it is not held does not do as it is told."""


class NodeDriver:
    """Implements `Driver`."""

    def __init__(self, seat: Seat) -> None:
        self._seat = seat
        self._clock = seat.context.clock
        self._complaints = Complaints(seat.context.logger, seat.connection.resource)
        self._holding = Insisting(self._clock)
        self._said: VehicleStatus | None = None
        self._publisher: Any = None
        self._link: Link | None = None

    # --- life -----------------------------------------------------------------------------------

    async def open(self) -> None:
        """Listen; the vehicle need not be there yet."""
        ros = self._seat.ros
        self._publisher = ros.node.create_publisher(
            interfaces.BehaviorCommand, self._name("command"), qos.COMMANDS
        )
        if self._seat.settings.via is Via.ACTION:
            self._link = ByAction(self._seat, self._name("execute_behavior"), self._complaints)
        else:
            link = self._link = ByTopics(self._seat, self._send, self._complaints)
            ros.subscribe(
                interfaces.BehaviorStatus,
                self._name("behavior_status"),
                lambda message: self._hear_status(link, message),
                qos.BEHAVIOR_STATUS,
            )
        ros.subscribe(
            interfaces.VehicleStatus,
            self._name("vehicle_status"),
            self._hear_vehicle,
            qos.STATUS,
        )

    async def close(self) -> None:
        """Send nothing more."""
        self._holding.stop_all()
        if self._link is not None:
            await self._link.close()

    @property
    def health(self) -> Health:
        """What vehicle_status has said last."""
        return self._said.health if self._said is not None else Health()

    def refusal(self, request: BehaviorRequest) -> str:
        """Why it cannot be sent; whether it can be done, the node on the vehicle decides."""
        try:
            encode_parameters(request.parameters)
        except WireError as error:
            return str(error)
        return ""

    # --- orders ---------------------------------------------------------------------------------

    def begin(self, order: Order) -> None:
        """Have the node do this; it ends a hold."""
        self._holding.stop_all()
        if reason := self.refusal(order.request):
            self._seat.told.ended(order.goal, Outcome(BehaviorState.REJECTED, "REJECTED", reason))
        else:
            self._opened.begin(order)

    def end(self, goal: UUID) -> None:
        """Have the node end this."""
        self._opened.end(goal)

    def adjust(self, goal: UUID, parameters: Mapping[str, ResolvedValue]) -> None:
        """Tell the node, once."""
        order = self._opened.order
        if order is None or order.goal != goal:
            return
        try:
            self._send(adjust_command(order, parameters, self._clock.now_us()))
        except WireError as error:
            self._complaints.add("a change that cannot be told", str(error))

    def hold(self) -> None:
        """Tell the node, until it says that the vehicle is held."""
        self._insist(Verb.HOLD, held=True)

    def resume(self) -> None:
        """Tell the node, until it says that the vehicle is not held."""
        self._insist(Verb.RESUME, held=False)

    async def look(self, order: Order) -> Outcome:
        """What the node says of the goal, and whether the vehicle is held."""
        outcome = await self._opened.look(order)
        return replace(outcome, held=self._said is not None and self._said.held)

    def forget(self) -> None:
        """Nothing is sent any more."""
        self._holding.stop_all()
        self._opened.forget()

    # --- what the node says ---------------------------------------------------------------------

    def _hear_vehicle(self, message: Any) -> None:
        self._seat.told.heard()
        self._said = said = read_vehicle_status(message)
        if said.vehicle != self._resource:
            self._complaints.add(f"the node in {self._name('')} is another one's", said.vehicle)
        self._opened.vehicle_does(said.behavior)

    def _hear_status(self, link: ByTopics, message: Any) -> None:
        self._seat.told.heard()
        try:
            link.status(read_status(message))
        except WireError as error:
            self._complaints.add("a status that cannot be", str(error))

    # --- inside ---------------------------------------------------------------------------------

    @property
    def _resource(self) -> str:
        return self._seat.connection.resource

    @property
    def _opened(self) -> Link:
        assert self._link is not None, "the driver is not open"
        return self._link

    def _name(self, leaf: str) -> str:
        return self._seat.settings.topic(leaf)

    def _send(self, message: object) -> None:
        self._publisher.publish(message)

    def _insist(self, verb: int, held: bool) -> None:
        # What the vehicle says of before need not be its answer, so that it is watched for a while.
        said = 0

        def say() -> bool:
            nonlocal said
            agrees = self._said is not None and self._said.held is held
            if not (said and agrees):
                self._send(vehicle_command(verb, self._clock.now_us()))
            said += 1
            return said < HOLD_REPEATS

        self._holding.start("hold", say)
