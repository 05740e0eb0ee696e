"""A vehicle with an m2pem node that surveys by itself, in a process of its own:
`ros_survey_peer.py SPEED NAME LATITUDE LONGITUDE`.

The simulated arbiter is on board; the node publishes what is left of a survey.
"""

import asyncio
import logging
import sys

from m2pem_plugin_ros.drivers.driver import DriverEvents
from m2pem_plugin_ros.onboard.arbiter_driver import ArbiterDriver
from m2pem_plugin_ros.onboard.node import OnboardNode
from m2pem_plugin_ros.onboard.target_bus import TargetBus
from m2pem_plugin_ros.runtime import RosRuntime, qos
from nav_msgs.msg import Odometry
from ros_e2e_world import ORIGIN

from m2pem.api import ArbiterContext, Connection, LocalFrame, ResourceId
from m2pem.api.clock import SystemClock
from m2pem.simulation.arbiters import SimArbiter

LOGGER = logging.getLogger("peer")
PERIOD_S = 0.1


async def main(speed: float, name: str, home: tuple[float, float]) -> None:
    clock, targets, vehicle = SystemClock(speed), TargetBus(), ResourceId(name)
    context = ArbiterContext(clock, targets, LOGGER, ORIGIN)
    connection = Connection(vehicle, "ground", {"home": list(home), "cruise_speed": "5 m/s"})
    arbiter = SimArbiter({vehicle: connection}, context)

    def make_driver(events: DriverEvents) -> ArbiterDriver:
        return ArbiterDriver(arbiter, vehicle, events, targets, LOGGER)

    async with RosRuntime("peer", namespace=f"/{name}") as ros:
        catalogue = arbiter.catalogue(vehicle)
        node = OnboardNode(
            ros, name, f"/{name}", make_driver, clock=clock, bus=targets, catalogue=catalogue
        )
        await node.open()
        odometry = ros.node.create_publisher(Odometry, "odom", qos.TELEMETRY)
        frame = LocalFrame(ORIGIN[:2])
        print("ready", flush=True)
        while True:
            state = arbiter.sight(vehicle)
            assert state is not None
            assert state.position is not None
            message = Odometry()
            message.header.frame_id = "map"
            message.header.stamp = ros.node.get_clock().now().to_msg()
            here = frame.to_local((state.position.latitude_deg, state.position.longitude_deg))
            message.pose.pose.position.x, message.pose.pose.position.y = here
            message.pose.pose.orientation.w = 1.0
            odometry.publish(message)
            await asyncio.sleep(PERIOD_S)


asyncio.run(main(float(sys.argv[1]), sys.argv[2], (float(sys.argv[3]), float(sys.argv[4]))))
