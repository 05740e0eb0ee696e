"""The m2pem node of one camera: it executes commands by the arbiter `ptz` on board."""

import logging
from typing import TYPE_CHECKING

from m2pem_plugin_ros import ArbiterDriver, OnboardNode, TargetBus

from m2pem.api import ArbiterContext, Clock, Connection
from m2pem_plugin_ptz.arbiter import PtzArbiter

if TYPE_CHECKING:
    from m2pem_plugin_ros import DriverEvents, RosRuntime

LOGGER = logging.getLogger("m2pem.onboard")


def camera_node(
    ros: "RosRuntime",
    connection: Connection,
    namespace: str,
    clock: Clock,
    origin: tuple[float, float, float],
) -> OnboardNode:
    """Make a node that serves the topics of docs/ros-nodes.md, in `namespace`. The executive
    publishes the states of the camera's vehicle and of targets.

    `connection`: of the camera, as a fleet has it for the arbiter `ptz`. `origin`: of the fleet's
    local frame (latitude and longitude in degrees, altitude in metres).

    Raises:
        PluginError: the connection cannot be used; the text names the resource and the key.
    """
    targets, camera = TargetBus(), connection.resource
    arbiter = PtzArbiter({camera: connection}, ArbiterContext(clock, targets, LOGGER, origin))
    drivers: list[ArbiterDriver] = []

    def make(events: "DriverEvents") -> ArbiterDriver:
        drivers.append(ArbiterDriver(arbiter, camera, events, targets, LOGGER))
        return drivers[0]

    return OnboardNode(
        ros,
        camera,
        namespace,
        make,
        clock=clock,
        bus=targets,
        catalogue=arbiter.catalogue(camera),
        payload_state=lambda: drivers[0].state,
        logger=LOGGER,
    )
