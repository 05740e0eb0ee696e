"""`m2pem gateway` with two MAVLink copters and two ROS rovers, all in other processes, and a client
in plain rclpy."""

import socket
from pathlib import Path
from typing import Any

import numpy as np
import pymap3d
import pytest
from action_msgs.msg import GoalStatus
from m2pem_interfaces.msg import BehaviorStatus, FleetState
from nav_msgs.msg import Odometry
from rclpy.qos import qos_profile_sensor_data
from ros_e2e_programs import Programs
from ros_face_client import LATCHED, STATIC, Client, behavior_goal, until
from sensor_msgs.msg import BatteryState, NavSatFix, NavSatStatus
from tf2_msgs.msg import TFMessage

HOME = (38.1075, -77.3192, 60.0)
VEHICLES = ("copter1", "copter2", "rover1", "rover2")
FLEET = """
version: 1
name: mixed
origin: {{lat: 38.1075, lon: -77.3192, alt: 60.0}}
faces:
  ros: {{commands: [copter1]}}
vehicles:
  copter1: {{domain: air, arbiter: mavlink, sitl: true, connection: {{url: "udpin://127.0.0.1:{port}", system_id: 1}}}}
  copter2: {{domain: air, arbiter: mavlink, sitl: true, connection: {{url: "udpin://127.0.0.1:{port}", system_id: 2}}}}
  rover1: {{domain: ground, arbiter: ros, sitl: true, connection: {{namespace: /rover1, sim: {{home: [38.1076, -77.3192]}}}}}}
  rover2:
    domain: ground
    arbiter: ros
    sitl: true
    connection: {{driver: base, namespace: /robots/two, bounds: {{speed: 2 m/s}}, sim: {{home: [38.1077, -77.3192]}}}}
"""  # noqa: E501
ONE_PLACE = """
version: 1
origin: {{lat: 38.1075, lon: -77.3192, alt: 60.0}}
faces:
  ros: {{}}
vehicles:
  copter: {{domain: air, arbiter: mavlink, sitl: true, connection: {{url: "udpin://127.0.0.1:{port}", system_id: 1}}}}
  rover:
    domain: ground
    arbiter: ros
    sitl: true
    connection: {{driver: base, namespace: /robots/one, odom_frame: odom, sim: {{home: [38.1075, -77.3192]}}}}
"""  # noqa: E501


@pytest.fixture
def port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        return int(free.getsockname()[1])


def gateway(m2pem: Programs, tmp_path: Path, port: int, speed: int) -> Any:
    """Start the simulators and the gateway."""
    fleet = tmp_path / "fleet.yaml"
    fleet.write_text(FLEET.format(port=port))
    m2pem.simulate(fleet, speed)
    home, to = "38.1073,-77.3192,60", f"udp://127.0.0.1:{port}"
    words = ("--home", home, "--to", to, "--speed", speed, "--ekf", "1s")
    m2pem.m2pem("sim", "mavlink", "--copters", 2, *words)
    served = m2pem.m2pem("gateway", "--fleet", fleet, "--speed", speed)
    served.until_line("faces: ros")
    return served


async def test_a_rover_and_a_copter_at_one_place_are_shown_at_one_height(
    m2pem: Programs, ros_domain: int, tmp_path: Path, port: int
) -> None:
    """The rover's only altitude is that of its NavSatFix, the copter's that of MAVLink."""
    fleet = tmp_path / "fleet.yaml"
    fleet.write_text(ONE_PLACE.format(port=port))
    home, to = "38.1075,-77.3192,60", f"udp://127.0.0.1:{port}"
    m2pem.simulate(fleet, 1)
    m2pem.m2pem("sim", "mavlink", "--copters", 1, "--home", home, "--to", to, "--ekf", "1s")
    m2pem.m2pem("gateway", "--fleet", fleet).until_line("faces: ros")
    async with Client(ros_domain) as client:
        for vehicle in ("copter", "rover"):
            fix = await client.hears(
                f"/{vehicle}/fix", NavSatFix, qos_profile_sensor_data,
                wanted=lambda each: each.status.status == NavSatStatus.STATUS_FIX,
            )  # fmt: skip
            # 60 m above mean sea level, which is 33.97 m below the ellipsoid there.
            assert fix.altitude == pytest.approx(26.03, abs=0.2)
            odom = await client.hears(f"/{vehicle}/odom", Odometry, qos_profile_sensor_data)
            assert odom.pose.pose.position.z == pytest.approx(0.0, abs=0.2)


@pytest.mark.long
async def test_a_ros_client_sees_four_vehicles_and_sends_a_copter(
    m2pem: Programs, ros_domain: int, tmp_path: Path, port: int
) -> None:
    gateway(m2pem, tmp_path, port, 5)
    async with Client(ros_domain) as client:
        static = client.hear("/tf_static", TFMessage, STATIC)
        moving = client.hear("/tf", TFMessage, 100)
        for vehicle in VEHICLES:
            fix = await client.hears(
                f"/{vehicle}/fix", NavSatFix, qos_profile_sensor_data,
                wanted=lambda each: each.status.status == NavSatStatus.STATUS_FIX,
            )  # fmt: skip
            odom = await client.hears(f"/{vehicle}/odom", Odometry, qos_profile_sensor_data)
            charge = await client.hears(
                f"/{vehicle}/battery_state", BatteryState, qos_profile_sensor_data
            )
            expected = pymap3d.geodetic2enu(fix.latitude, fix.longitude, fix.altitude, *HOME)
            place = odom.pose.pose.position
            # The two messages need not be of the same moment, and copters drift.
            assert np.hypot(place.x - expected[0], place.y - expected[1]) < 1.0
            assert 0.0 < charge.percentage <= 1.0
            child = f"{vehicle}/base_link"
            await until(
                lambda child=child: child in
                {each.child_frame_id for message in list(moving) for each in message.transforms}
            )  # fmt: skip
        frames = {each.child_frame_id for each in static[-1].transforms}
        # Where odom of a ROS vehicle is, only the vehicle knows.
        assert frames == {"map", "copter1/odom", "copter2/odom"}
        # rover1 publishes its own topics; everything else is of the face.
        publishers = {
            vehicle: [
                endpoint.node_name
                for endpoint in client.node.get_publishers_info_by_topic(f"/{vehicle}/odom")
            ]
            for vehicle in VEHICLES
        }
        assert publishers["copter1"] == publishers["copter2"] == publishers["rover2"] == ["face"]
        assert len(publishers["rover1"]) == 1
        assert publishers["rover1"] != ["face"]

        fleet = await client.hears("/face/fleet_state", FleetState, LATCHED)
        actions = {each.resource: each.action for each in fleet.resources}
        assert actions["copter1"] == "/copter1/execute_behavior"
        assert actions["rover1"] == "/rover1/m2pem/execute_behavior"

        await client.hears(
            "/face/fleet_state", FleetState, LATCHED,
            lambda each: each.resources[0].readiness == each.resources[0].READY,
        )  # fmt: skip
        sent = await client.send(actions["copter1"], behavior_goal("takeoff", altitude=15.0))
        status, result = await sent.end()
        assert status == GoalStatus.STATUS_SUCCEEDED, result
        target = {"type": "Point", "coordinates": [-77.3192, 38.1078, 15.0]}
        sent = await client.send(actions["copter1"], behavior_goal("goto", target=target))
        status, result = await sent.end()
        assert status == GoalStatus.STATUS_SUCCEEDED, result
        await client.hears(
            "/copter1/fix", NavSatFix, wanted=lambda each: abs(each.latitude - 38.1078) < 3e-5
        )
        sent = await client.send(actions["rover1"], behavior_goal("goto", target=target))
        status, result = await sent.end()
        assert status == GoalStatus.STATUS_ABORTED
        assert result.status.state == BehaviorStatus.REJECTED
        assert "does not let ROS command rover1" in result.status.reason
