"""Battery (sensor_msgs/BatteryState) and errors (diagnostic_msgs/DiagnosticArray) of vehicles."""

import math
from typing import TYPE_CHECKING, Any

from m2pem.api import ArbiterContext, Clock, ResourceId
from m2pem_plugin_ros.log_throttle import LogThrottle
from m2pem_plugin_ros.settings import Settings

if TYPE_CHECKING:
    from m2pem_plugin_ros.runtime import RosRuntime


class Battery:
    """The battery of a vehicle. `fraction` is 0 to 1; None if it is not known. It is subscribed at
    once."""

    def __init__(
        self, ros: "RosRuntime", resource: ResourceId, settings: Settings, context: ArbiterContext
    ) -> None:
        from sensor_msgs.msg import BatteryState  # noqa: PLC0415  # it is loaded where ROS is only

        from m2pem_plugin_ros.runtime import qos  # noqa: PLC0415

        self.fraction: float | None = None
        self._log_throttle = LogThrottle(context.logger, resource)
        topic = settings.topic(settings.topics.battery)
        ros.subscribe(BatteryState, topic, self._on_message, qos.TELEMETRY)

    def _on_message(self, message: Any) -> None:
        share = message.percentage
        if 0.0 <= share <= 1.0:
            self.fraction = share
        elif not math.isnan(share):  # NaN: the battery does not measure it
            hint = "; BatteryState.percentage is from 0 to 1" if 1.0 < share <= 100.0 else ""
            self._log_throttle.log("an invalid battery charge", f"{share:g}{hint}")


OLD_AFTER_S = 5.0
"""Components report once a second. Older errors do not count."""

OWN_STATUS = "m2pem: "
"""Prefix of the names of what any executive publishes about vehicles. It is ignored."""

_ERROR = 2
MOST_PARTS = 1000


class Diagnostics:
    """One topic with the diagnostics of many vehicles, subscribed once.

    Call `watch` for each vehicle. Statuses of others are dropped.
    """

    def __init__(self, ros: "RosRuntime", topic: str, clock: Clock) -> None:
        from diagnostic_msgs.msg import (  # noqa: PLC0415  # it is loaded where ROS is only
            DiagnosticArray,
        )

        from m2pem_plugin_ros.runtime import qos  # noqa: PLC0415

        self._clock = clock
        self._errors: dict[str, dict[str, tuple[str, int]]] = {}
        ros.subscribe(DiagnosticArray, topic, self._on_message, qos.TELEMETRY)

    def watch(self, hardware_id: str) -> None:
        """Keep the errors of a vehicle from now on."""
        self._errors.setdefault(hardware_id, {})

    def errors(self, hardware_id: str) -> tuple[str, ...]:
        """Return the current errors of a vehicle, sorted by component."""
        said = self._errors.get(hardware_id)
        if not said:
            return ()
        oldest_us = self._clock.now_us() - round(OLD_AFTER_S * 1e6)
        for name in [name for name, (_, at_us) in said.items() if at_us < oldest_us]:
            del said[name]
        return tuple(said[name][0] for name in sorted(said))

    def _on_message(self, message: Any) -> None:
        now_us = self._clock.now_us()
        for status in message.status:
            said = self._errors.get(status.hardware_id)
            if said is None or status.name.startswith(OWN_STATUS):
                continue
            if ord(status.level) < _ERROR:
                said.pop(status.name, None)
            elif status.name in said or len(said) < MOST_PARTS:
                said[status.name] = (f"{status.name}: {status.message or 'error'}", now_us)
