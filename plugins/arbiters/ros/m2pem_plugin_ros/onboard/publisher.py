"""What an m2pem node says: `behavior_status`, `vehicle_status` and `payload_status`."""

import asyncio
import math
from collections.abc import Callable
from typing import Any

from m2pem_interfaces import msg as interfaces
from rclpy.duration import Duration
from rclpy.node import Node

from m2pem.api import Clock, PayloadState
from m2pem_plugin_ros.interfaces import set_stamp
from m2pem_plugin_ros.interfaces.behavior_status import Status, write_status
from m2pem_plugin_ros.interfaces.vehicle_status import VehicleStatus, write_payload_status
from m2pem_plugin_ros.runtime import qos

STATUS_EVERY_S = 0.4
FASTEST_S = 0.02
"""Of real time: a clock may be so fast that telling would flood the network."""

_READINESS = {
    None: interfaces.VehicleStatus.NOT_KNOWN,
    False: interfaces.VehicleStatus.NOT_READY,
    True: interfaces.VehicleStatus.READY,
}


class Voice:
    """Publishes; before `open` and after `close` nothing is said."""

    def __init__(
        self,
        clock: Clock,
        look: Callable[[], VehicleStatus],
        sight: Callable[[], PayloadState | None] | None = None,
    ) -> None:
        self._clock = clock
        self._look = look
        self._sight = sight
        self._behaviors: Any = None
        self._vehicle: Any = None
        self._payload: Any = None

    def open(self, node: Node) -> None:
        """Publish from this node."""
        create = node.create_publisher
        self._behaviors = create(interfaces.BehaviorStatus, "behavior_status", qos.BEHAVIOR_STATUS)
        self._vehicle = create(interfaces.VehicleStatus, "vehicle_status", qos.STATUS)
        if self._sight is not None:
            self._payload = create(interfaces.PayloadStatus, "payload_status", qos.TELEMETRY)

    def close(self) -> None:
        """Say nothing more."""
        self._behaviors = self._vehicle = self._payload = None

    def behavior(self, status: Status) -> None:
        """Say a status."""
        if self._behaviors is not None:
            message = write_status(interfaces.BehaviorStatus(), status, interfaces.KeyValue)
            self._publish(self._behaviors, message)

    def vehicle(self) -> None:
        """Say how the vehicle is."""
        if self._vehicle is None:
            return
        about = self._look()
        battery = about.health.battery_fraction
        message = interfaces.VehicleStatus(
            vehicle=about.vehicle,
            mode=about.health.mode,
            behavior=about.behavior,
            held=about.held,
            readiness=_READINESS[about.health.ready],
            not_ready_reasons=list(about.health.not_ready_reasons),
            battery=math.nan if battery is None else battery,
        )
        self._publish(self._vehicle, message)

    def payload(self) -> None:
        """Say where the payload looks, if that is known."""
        state = self._sight() if self._sight is not None else None
        if state is not None and self._payload is not None:
            self._publish(self._payload, write_payload_status(interfaces, state))

    def _publish(self, publisher: Any, message: Any) -> None:
        set_stamp(message.stamp, self._clock.now_us())
        publisher.publish(message)

    async def keep_telling(self) -> None:
        """Say how the vehicle or payload is, at a steady rate."""
        while True:
            self.vehicle()
            self.payload()
            async with asyncio.TaskGroup() as both:
                both.create_task(self._clock.sleep(STATUS_EVERY_S))
                both.create_task(asyncio.sleep(FASTEST_S))

    async def heard_out(self, within_s: float) -> None:
        """Wait until all who listen have the statuses, or for so many real seconds."""
        said = Duration(seconds=within_s)
        await asyncio.to_thread(self._behaviors.wait_for_all_acked, said)
