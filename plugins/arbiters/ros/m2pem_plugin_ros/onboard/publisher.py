"""Publishes `behavior_status`, `vehicle_status` and `payload_status` of an m2pem node."""

import asyncio
import math
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from m2pem_interfaces import msg as interfaces
from rclpy.duration import Duration
from rclpy.node import Node

from m2pem.api import Clock, PayloadState
from m2pem_plugin_ros.interfaces import set_stamp
from m2pem_plugin_ros.interfaces.behavior_command import Command, write_refusal
from m2pem_plugin_ros.interfaces.behavior_status import Status, write_status
from m2pem_plugin_ros.interfaces.vehicle_status import (
    READINESS,
    VehicleStatus,
    write_payload_status,
)
from m2pem_plugin_ros.runtime import qos

STATUS_EVERY_S = 0.4
FASTEST_S = 0.02
"""Shortest period in real time, so that a fast clock does not flood the network."""


class StatusPublisher:
    """Publishes between `open` and `close`. `stamp_us` returns the stamp of a message for a time of
    the clock."""

    def __init__(
        self,
        clock: Clock,
        look: Callable[[], VehicleStatus],
        payload_state: Callable[[], PayloadState | None] | None = None,
        stamp_us: Callable[[int], int] = int,
    ) -> None:
        self._clock = clock
        self._vehicle_status = look
        self._stamp_us = stamp_us
        self._payload_state = payload_state
        self._behaviors: Any = None
        self._vehicle: Any = None
        self._payload: Any = None
        self._refusals: Any = None

    def open(self, node: Node) -> None:
        """Create the publishers on a node."""
        create = node.create_publisher
        self._behaviors = create(interfaces.BehaviorStatus, "behavior_status", qos.BEHAVIOR_STATUS)
        self._vehicle = create(interfaces.VehicleStatus, "vehicle_status", qos.STATUS)
        self._refusals = create(interfaces.CommandRefusal, "command_refusal", qos.COMMANDS)
        if self._payload_state is not None:
            self._payload = create(interfaces.PayloadStatus, "payload_status", qos.TELEMETRY)

    def close(self) -> None:
        """Publish nothing more."""
        self._behaviors = self._vehicle = self._payload = self._refusals = None

    def behavior(self, status: Status) -> None:
        """Publish the status of a behavior."""
        if self._behaviors is not None:
            self._publish(self._behaviors, write_status(status))

    def refusal(self, command: Command, newest: int) -> None:
        """Publish that a command is refused, as `newest` is the epoch of its run."""
        if self._refusals is not None:
            self._publish(self._refusals, write_refusal(command, newest))

    def vehicle(self) -> None:
        """Publish the status of the vehicle."""
        if self._vehicle is None:
            return
        about = self._vehicle_status()
        battery = about.health.battery_fraction
        message = interfaces.VehicleStatus(
            vehicle=about.vehicle,
            mode=about.health.mode,
            behavior=about.behavior,
            held=about.held,
            readiness=READINESS[about.health.ready],
            not_ready_reasons=list(about.health.not_ready_reasons),
            battery=math.nan if battery is None else battery,
        )
        self._publish(self._vehicle, message)

    def payload(self) -> None:
        """Publish the direction of the payload, if it is known."""
        state = self._payload_state() if self._payload_state is not None else None
        if state is not None and self._payload is not None:
            self._publish(self._payload, write_payload_status(interfaces, state))

    def _publish(self, publisher: Any, message: Any) -> None:
        set_stamp(message.stamp, self._stamp_us(self._clock.now_us()))
        publisher.publish(message)

    async def keep_publishing(self) -> None:
        """Publish the status of the vehicle or payload periodically, also while the clock
        stands."""
        while True:
            self.vehicle()
            self.payload()
            await asyncio.sleep(FASTEST_S)
            with suppress(TimeoutError):
                async with asyncio.timeout(STATUS_EVERY_S):
                    await self._clock.sleep(STATUS_EVERY_S)

    async def wait_until_received(self, within_s: float) -> None:
        """Wait until all subscribers have the statuses, or for so many real seconds."""
        said = Duration(seconds=within_s)
        await asyncio.to_thread(self._behaviors.wait_for_all_acked, said)
