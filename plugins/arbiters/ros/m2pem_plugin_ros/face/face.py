"""The face `ros`, as the executive makes it. ROS is loaded when it serves."""

import asyncio
import logging
import os
from collections.abc import Coroutine, Mapping
from importlib import import_module
from typing import TYPE_CHECKING, Any

from m2pem.api import EventThrower, ThrownEvents, follow
from m2pem.api.latest_task import cancel_and_wait
from m2pem.errors import M2pemError
from m2pem_plugin_ros.face.event_settings import read_event_rules
from m2pem_plugin_ros.face.names import Names
from m2pem_plugin_ros.face.run_watcher import RunWatcher
from m2pem_plugin_ros.face.settings import read_options
from m2pem_plugin_ros.installation import require_interfaces
from m2pem_plugin_ros.loopback import keep_on_loopback, stays_on_loopback

if TYPE_CHECKING:
    from m2pem.api import FaceSettings, MissionControl
    from m2pem_plugin_ros.runtime import RosRuntime

NODE = "face"
PACKAGES = ("m2pem_interfaces", "tf2_msgs", "geographic_msgs")

log = logging.getLogger("m2pem.face.ros")
events_log = logging.getLogger("m2pem.face.events")


def _load() -> None:
    """Load what takes a second, in a thread: STOP reaches the vehicles meanwhile."""
    for package in PACKAGES:
        require_interfaces(package)
    import_module("m2pem_plugin_ros.face.serving")


class RosFace:
    """Every vehicle of the fleet in ROS, whatever arbiter it has.

    Raises:
        PluginError: a setting is wrong.
    """

    def __init__(
        self,
        control: "MissionControl",
        settings: "FaceSettings",
        environment: Mapping[str, str] = os.environ,
    ) -> None:
        self._control = control
        self._options = read_options(settings, control.fleet())
        self._names = Names(control.fleet(), self._options)
        if stays_on_loopback(environment, simulated=control.simulated()):
            keep_on_loopback()
        self._rules = read_event_rules(settings)
        sent = [each.rule for each in self._rules.sent]
        self._thrown = ThrownEvents(control, sent) if sent else None
        self._watcher = RunWatcher()
        self._follower = follow(control, self._watcher)

    async def serve(self) -> None:
        """Serve until cancelled.

        Raises:
            PluginError: ROS, or a package of interfaces, is not installed or not usable.
        """
        await asyncio.to_thread(_load)
        from m2pem_plugin_ros.face.serving import Serving  # noqa: PLC0415  # rclpy
        from m2pem_plugin_ros.runtime import RosRuntime  # noqa: PLC0415

        namespace, domain_id = self._options.namespace, self._options.domain_id
        async with RosRuntime(NODE, namespace=namespace, domain_id=domain_id) as ros:
            await asyncio.sleep(0)
            serving = Serving(
                ros, self._control, self._follower, self._watcher, self._names, self._options
            )
            await serving.open()
            log.info("the fleet is in ROS; %s", ros.node.get_fully_qualified_name())
            beside = [asyncio.create_task(_reported(each)) for each in self._events(ros)]
            try:
                await serving.run()
            finally:
                await cancel_and_wait(*beside)

    def _events(self, ros: "RosRuntime") -> list[Coroutine[Any, Any, None]]:
        """Return what passes events between ROS and missions."""
        from m2pem_plugin_ros.face.received_events import receive  # noqa: PLC0415  # rclpy
        from m2pem_plugin_ros.face.sent_events import SentEvents  # noqa: PLC0415

        thrower = EventThrower(self._control)
        namespace, domain_id = self._options.namespace, self._options.domain_id
        passing: list[Coroutine[Any, Any, None]] = []
        if received := self._rules.received:
            passing += [thrower.run(), receive(received, thrower, namespace, domain_id)]
        if self._thrown is not None:
            passing.append(SentEvents(ros, self._control, self._rules.sent, self._thrown).run())
        return passing


async def _reported(passing: Coroutine[Any, Any, None]) -> None:
    """Run it; if it ends, operators are told, and the fleet stays in ROS."""
    try:
        await passing
    except M2pemError as error:
        events_log.warning("ROS and missions exchange no more events: %s", error)
    except Exception:
        events_log.exception("ROS and missions exchange no more events")
