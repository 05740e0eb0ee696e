"""How full a vehicle's battery is: sensor_msgs/BatteryState."""

import math
from typing import TYPE_CHECKING, Any

from m2pem.api import ArbiterContext, ResourceId
from m2pem_plugin_ros.complaints import Complaints
from m2pem_plugin_ros.settings import Settings

if TYPE_CHECKING:
    from m2pem_plugin_ros.runtime import RosRuntime


class Battery:
    """Subscribed from the beginning. `fraction` of a full one; None: it was not said."""

    def __init__(
        self, ros: "RosRuntime", resource: ResourceId, settings: Settings, context: ArbiterContext
    ) -> None:
        from sensor_msgs.msg import BatteryState  # noqa: PLC0415  # it is loaded where ROS is only

        from m2pem_plugin_ros.runtime import qos  # noqa: PLC0415

        self.fraction: float | None = None
        self._complaints = Complaints(context.logger, resource)
        topic = settings.topic(settings.topics.battery)
        ros.subscribe(BatteryState, topic, self._hear, qos.TELEMETRY)

    def _hear(self, message: Any) -> None:
        share = message.percentage
        if 0.0 <= share <= 1.0:
            self.fraction = share
        elif not math.isnan(share):  # NaN: the battery does not measure it
            hint = "; BatteryState.percentage is from 0 to 1" if 1.0 < share <= 100.0 else ""
            self._complaints.add("a charge that cannot be", f"{share:g}{hint}")
