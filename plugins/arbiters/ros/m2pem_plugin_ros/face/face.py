"""The face `ros`, as the executive makes it. ROS is loaded when it serves."""

import asyncio
import logging
import os
from collections.abc import Mapping
from importlib import import_module
from typing import TYPE_CHECKING

from m2pem.api import follow
from m2pem_plugin_ros.face.names import Names
from m2pem_plugin_ros.face.run_watcher import RunWatcher
from m2pem_plugin_ros.face.settings import read_options
from m2pem_plugin_ros.installation import require_interfaces
from m2pem_plugin_ros.loopback import keep_on_loopback, stays_on_loopback

if TYPE_CHECKING:
    from m2pem.api import FaceSettings, MissionControl

NODE = "face"
PACKAGES = ("m2pem_interfaces", "tf2_msgs", "geographic_msgs")

log = logging.getLogger("m2pem.face.ros")


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
            await serving.run()
