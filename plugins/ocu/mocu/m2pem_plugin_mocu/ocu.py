"""Serves operator control units over ROS 2, as an OCU of the executive."""

import asyncio
import logging
import os
from collections.abc import Mapping
from contextlib import suppress
from importlib import import_module
from typing import TYPE_CHECKING

from m2pem_plugin_ros import keep_on_loopback, require_interfaces, stays_on_loopback

from m2pem.api import follow
from m2pem.errors import M2pemError
from m2pem_plugin_mocu import settings

if TYPE_CHECKING:
    from m2pem.api import MissionControl
    from m2pem_plugin_mocu.topics import Topics

NODE = "executive"

SETTLE_TURNS = 5
"""Turns of the event loop without a notice, after which all that was committed is known."""

SETTLE_S = 0.5

log = logging.getLogger("m2pem.ocu.mocu")


def _load_rclpy() -> None:
    """Load what takes a second, in a thread: STOP reaches the vehicles meanwhile."""
    for module in ("m2pem_plugin_ros.runtime", "m2pem_plugin_mocu.services"):
        import_module(module)


class MocuOcu:
    """All its operators see the same and may do the same, wherever in the ROS domain they are.

    `environment`: the variables of `settings`, and M2PEM_ROS_LOOPBACK. `domain_id`: None takes
    ROS_DOMAIN_ID.

    Raises:
        PluginError: ROS 2, or m2pem_interfaces, is not there or not usable, or a variable has a
            value that it may not have.
    """

    def __init__(
        self,
        control: "MissionControl",
        *,
        environment: Mapping[str, str] = os.environ,
        domain_id: int | None = None,
    ) -> None:
        self.namespace = settings.namespace(environment)
        self._control = control
        self._domain_id = domain_id
        if stays_on_loopback(environment, simulated=control.simulated()):
            keep_on_loopback()
        require_interfaces("m2pem_interfaces")
        self._follower = follow(control)

    async def serve(self) -> None:
        """Publish what happens, and carry out what operators ask, until cancelled.

        Ends when the executive does.
        """
        await asyncio.to_thread(_load_rclpy)
        from m2pem_plugin_ros import RosRuntime  # noqa: PLC0415  # rclpy

        from m2pem_plugin_mocu.diagnostics import DiagnosticsPublisher  # noqa: PLC0415
        from m2pem_plugin_mocu.fleet_view import FleetView  # noqa: PLC0415
        from m2pem_plugin_mocu.services import Services  # noqa: PLC0415
        from m2pem_plugin_mocu.topics import Topics  # noqa: PLC0415

        async with RosRuntime(NODE, namespace=self.namespace, domain_id=self._domain_id) as ros:
            topics = Topics(ros, self._control, self._follower)
            self._follower.listener = topics
            services = Services(ros, self._control, topics)
            diagnostics = DiagnosticsPublisher(ros, self._control, self._follower, topics, services)
            fleet = FleetView(ros, self._control, topics.now_us)
            following = asyncio.create_task(self._follower.run())
            publishing = [
                asyncio.create_task(topics.run()),
                asyncio.create_task(diagnostics.run()),
                asyncio.create_task(diagnostics.listen()),
                asyncio.create_task(fleet.run()),
                asyncio.create_task(fleet.listen()),
            ]
            log.info("operators are served over ROS in %s", ros.node.get_namespace())
            try:
                await asyncio.wait([following])
                self._say_why(following)
            finally:
                ending = asyncio.create_task(self._end(topics, following, publishing))
                try:
                    await asyncio.shield(ending)
                finally:  # whoever cancels again does not wait for readers: the node goes now
                    ending.cancel()
                    await asyncio.gather(ending, return_exceptions=True)

    def _say_why(self, following: "asyncio.Task[None]") -> None:
        try:
            following.result()
        except M2pemError as error:
            log.warning("operators over ROS are served no more: %s", error)

    async def _end(
        self,
        topics: "Topics",
        following: "asyncio.Task[None]",
        publishing: "list[asyncio.Task[None]]",
    ) -> None:
        """Publish how it ended: the last records may have come just before."""
        await self._settle(following)
        for task in [following, *publishing]:
            task.cancel()
        await asyncio.gather(following, *publishing, return_exceptions=True)
        await topics.flush()

    async def _settle(self, following: "asyncio.Task[None]") -> None:
        """Wait until what was committed is known here, unless it never ends."""
        taken, turns = self._follower.notices_taken, 0
        with suppress(TimeoutError):
            async with asyncio.timeout(SETTLE_S):
                while turns < SETTLE_TURNS and not following.done():
                    await asyncio.sleep(0)
                    turns = turns + 1 if self._follower.notices_taken == taken else 0
                    taken = self._follower.notices_taken
