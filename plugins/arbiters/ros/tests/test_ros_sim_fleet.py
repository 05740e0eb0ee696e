"""What is simulated for a fleet file: what an executive with the same file looks for."""

import asyncio
import math
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from geometry_msgs.msg import TwistStamped
from m2pem_plugin_ros import settings
from m2pem_plugin_ros.runtime import RosRuntime, qos
from m2pem_plugin_ros.settings import DriverName
from m2pem_plugin_ros.simulator.sensors import Target
from m2pem_plugin_ros.simulator.specification import VehicleSpec
from m2pem_plugin_ros.testing import Peer
from nav_msgs.msg import Odometry
from ros_sim_command import cli
from ros_sim_watch import AMPLE_S, COMMAND, Heard, insist, until
from std_msgs.msg import String

from m2pem import load_fleet
from m2pem.errors import PluginError

pytestmark = pytest.mark.skipif(
    not hasattr(settings, "DetectorMessage"), reason="the settings of ROS vehicles cannot be read"
)

FLEET = """
version: 1
name: simulated
origin: {lat: 38.1075, lon: -77.3192, alt: 60.0}
vehicles:
  evsg1:
    domain: ground
    arbiter: ros
    sitl: true
    connection:
      namespace: /evsg1
      driver: base
      stamped: true
      topics: {odom: odometry/global, cmd_vel: drive}
      bounds: {speed: 4 m/s, turn_radius: 3 m}
      sim: {home: [38.1075, -77.3182], heading: 90 deg, drift: 1 %, cruise_speed: 3 m/s}
    payloads:
      gpr:
        detector: true
        connection:
          topic: gpr
          sim: {range: 3 m, targets: [{type: mine, position: [38.1075, -77.3192]}]}
      nose:
        detector: true
        connection: {topic: /noses/one, message: string, type: smell}
      ptz: {arbiter: sim}
  boat:
    domain: surface
    arbiter: ros
    sitl: true
    connection: {namespace: /boat, driver: base}
  real:
    domain: ground
    arbiter: ros
    connection: {namespace: /real}
  rehearsed: {domain: ground, arbiter: sim}
"""


def fleet_file(folder: Path, text: str = FLEET) -> Path:
    file = folder / "fleet.yaml"
    file.write_text(text, encoding="utf-8")
    return file


def specs(folder: Path, text: str = FLEET, **words: Any) -> list[VehicleSpec]:
    from m2pem_plugin_ros.simulator.fleet import read_specs

    return list(read_specs(load_fleet(fleet_file(folder, text)), words))


def test_what_is_marked_as_software_in_the_loop_is_simulated(tmp_path: Path) -> None:
    evsg1, boat = specs(tmp_path)
    assert (evsg1.name, boat.name) == ("evsg1", "boat")
    assert evsg1.settings.namespace == "/evsg1"
    assert evsg1.settings.topics.odom == "odometry/global"
    assert evsg1.settings.driver is DriverName.BASE
    assert (evsg1.start.east_m, evsg1.start.yaw_rad) == pytest.approx((87.7, 0), abs=0.1)
    assert evsg1.inaccuracy.drift == 0.01
    assert (boat.domain, boat.start.east_m) == ("surface", 5.0)
    assert boat.start.yaw_rad == pytest.approx(math.pi / 2)


def test_a_base_can_do_what_the_fleet_says_that_it_can(tmp_path: Path) -> None:
    evsg1, _ = specs(tmp_path)
    assert (evsg1.chassis.speed_m_s, evsg1.chassis.turn_radius_m) == (4.0, 3.0)


def test_words_of_the_command_line_are_over_those_of_the_file(tmp_path: Path) -> None:
    evsg1, boat = specs(tmp_path, drift="5 %")
    assert evsg1.inaccuracy.drift == boat.inaccuracy.drift == 0.05


def test_detectors_are_those_of_the_fleet(tmp_path: Path) -> None:
    gpr, nose = specs(tmp_path)[0].detectors
    assert (gpr.payload, gpr.topic, gpr.range_m) == ("evsg1/gpr", "/evsg1/gpr", 3.0)
    assert gpr.targets == (Target("mine", 0.0, 0.0),)
    assert (nose.payload, nose.topic, nose.type) == ("evsg1/nose", "/noses/one", "smell")
    assert nose.plain
    assert nose.targets == ()


@pytest.mark.parametrize(
    ("right", "wrong", "said"),
    [
        ("drift: 1 %", "drfit: 1 %", "evsg1: connection.sim.drfit: simulated vehicles know no"),
        ("heading: 90 deg", "heading: 90", "evsg1: connection.sim.heading: 90 has no unit"),
        ("range: 3 m", "range: wide", "evsg1/gpr: connection.sim.range: 'wide' is not a number"),
        ("driver: base\n", "driver: bass\n", "evsg1: connection.driver"),
    ],
)
def test_what_is_wrong_in_the_file_is_named(
    right: str, wrong: str, said: str, tmp_path: Path
) -> None:
    assert right in FLEET
    with pytest.raises(PluginError) as caught:
        specs(tmp_path, FLEET.replace(right, wrong))
    assert said in str(caught.value)


def test_a_fleet_without_such_vehicles_is_refused(tmp_path: Path) -> None:
    file = fleet_file(tmp_path, FLEET.replace("    sitl: true\n", ""))
    result = CliRunner().invoke(cli, ["sim", "ros", "--fleet", str(file)])
    assert result.exit_code == 2
    assert "no vehicle has `arbiter: ros` and `sitl: true`" in result.output


async def test_the_simulator_speaks_on_the_topics_of_the_fleet(
    tmp_path: Path, ros_domain: int
) -> None:
    words = ["sim", "ros", "--fleet", str(fleet_file(tmp_path))]
    with Peer(COMMAND, ros_domain, words):
        async with RosRuntime("watching", domain_id=ros_domain) as ros:
            odometry = Heard(ros, Odometry, "/evsg1/odometry/global")
            smells = Heard(ros, String, "/noses/one", qos.EVENTS)
            drive = ros.node.create_publisher(TwistStamped, "/evsg1/drive", qos.COMMANDS)
            await until(drive.get_subscription_count)
            await until(lambda: ros.node.count_publishers("/noses/one"))
            forward = TwistStamped()
            forward.twist.linear.x = 2.0
            east_m = (await odometry.next()).pose.pose.position.x
            async with asyncio.timeout(AMPLE_S):
                while odometry.last.pose.pose.position.x <= east_m + 0.1:
                    drive.publish(forward)
                    await asyncio.sleep(0.05)
            assert (await insist(ros, "evsg1: detect nose", smells)).data == "smell"
