"""The m2pem node of one camera: it executes commands by the arbiter `ptz` on board."""

import logging
from typing import TYPE_CHECKING

from m2pem_plugin_ros import ArbiterDriver, OnboardNode, TargetBus

from m2pem.api import ArbiterContext, Clock, Connection, PayloadState
from m2pem_plugin_ptz.arbiter import PtzArbiter

if TYPE_CHECKING:
    from m2pem_plugin_ros import DriverEvents, RosRuntime

LOGGER = logging.getLogger("m2pem.onboard")


class CameraNode:
    """Serves the topics of docs/ros-nodes.md, in `namespace`. The executive publishes the
    states of the camera's vehicle and of targets.

    `connection`: of the camera, as a fleet has it for the arbiter `ptz`. `origin`: of the fleet's
    local frame (latitude and longitude in degrees, altitude in metres).

    Raises:
        PluginError: the connection cannot be used; the text names the resource and the key.
    """

    def __init__(
        self,
        ros: "RosRuntime",
        connection: Connection,
        namespace: str,
        clock: Clock,
        origin: tuple[float, float, float],
    ) -> None:
        targets, camera = TargetBus(), connection.resource
        context = ArbiterContext(clock, targets, LOGGER, origin)
        arbiter = PtzArbiter({camera: connection}, context)
        drivers: list[ArbiterDriver] = []

        def make(events: "DriverEvents") -> ArbiterDriver:
            drivers.append(ArbiterDriver(arbiter, camera, events, targets, LOGGER))
            return drivers[0]

        def payload_state() -> PayloadState | None:
            return drivers[0].state

        self._node = OnboardNode(
            ros,
            camera,
            namespace,
            make,
            clock=clock,
            bus=targets,
            catalogue=arbiter.catalogue(camera),
            payload_state=payload_state,
            logger=LOGGER,
        )

    async def open(self) -> None:
        """Connect to the camera, and serve.

        Raises:
            PluginError: a library of the driver is missing, or its settings are invalid.
        """
        await self._node.open()

    async def close(self) -> None:
        """Stop the camera, publish the end of its behavior, and close."""
        await self._node.close()
