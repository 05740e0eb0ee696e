"""What is simulated for a fleet file: what an executive with the same file looks for."""

from pathlib import Path

import pytest
from click.testing import CliRunner
from m2pem_plugin_ptz.drivers.ros.settings import Axis
from m2pem_plugin_ptz.simulator.ros.command_line import ros_cameras
from m2pem_plugin_ros.runtime import RosRuntime, qos
from m2pem_plugin_ros.testing import Peer
from ptz_ros_world import until
from sensor_msgs.msg import JointState

from m2pem import load_fleet
from m2pem.errors import PluginError

COMMAND = Path(__file__).with_name("ptz_ros_sim_command.py")
FLEET = """
version: 1
name: simulated
origin: {lat: 38.1075, lon: -77.3192, alt: 60.0}
vehicles:
  evsg2:
    domain: ground
    arbiter: ros
    sitl: true
    connection: {namespace: /evsg2, via: action}
    payloads:
      ptz:
        arbiter: ptz
        connection:
          driver: ros
          command: positions
          joints: {pan: mast, zoom: lens}
          reach: {tilt: [-60 deg, 30 deg], zoom_max: 20}
      dome: {arbiter: ptz, connection: {driver: onvif, host: 127.0.0.1, port: 8081}}
  real:
    domain: ground
    arbiter: ros
    connection: {namespace: /real}
    payloads:
      ptz: {arbiter: ptz, connection: {driver: ros}}
"""


def fleet_file(folder: Path, text: str = FLEET) -> Path:
    file = folder / "fleet.yaml"
    file.write_text(text, encoding="utf-8")
    return file


def test_cameras_over_ros_on_simulated_vehicles_are_simulated(tmp_path: Path) -> None:
    from m2pem_plugin_ptz.simulator.ros.fleet import read_specs

    (spec,) = read_specs(load_fleet(fleet_file(tmp_path)))
    assert spec.name == "evsg2/ptz"
    assert spec.settings.joint_states == "/evsg2/joint_states"
    assert spec.settings.joints.names[Axis.PAN] == "mast"
    assert spec.reach.zoom_max == 20.0
    assert spec.reach.tilt_rad == pytest.approx((-1.0472, 0.5236), abs=1e-4)


def test_what_is_wrong_in_the_file_is_named(tmp_path: Path) -> None:
    from m2pem_plugin_ptz.simulator.ros.fleet import read_specs

    file = fleet_file(tmp_path, FLEET.replace("command: positions", "command: position"))
    with pytest.raises(PluginError, match=r"evsg2/ptz: connection\.command"):
        list(read_specs(load_fleet(file)))


def test_a_fleet_without_such_cameras_is_refused(tmp_path: Path) -> None:
    file = fleet_file(tmp_path, FLEET.replace("    sitl: true\n", ""))
    result = CliRunner().invoke(ros_cameras, ["--fleet", str(file)])
    assert result.exit_code == 2
    assert "no payload of a vehicle with `sitl: true`" in result.output


async def test_a_simulated_ptz_head_speaks_on_the_topics_of_the_fleet(
    tmp_path: Path, ros_domain: int
) -> None:
    with Peer(COMMAND, ros_domain, ["ros-cameras", "--fleet", str(fleet_file(tmp_path))]):
        async with RosRuntime("watching", domain_id=ros_domain) as ros:
            heard: list[JointState] = []
            ros.subscribe(JointState, "/evsg2/joint_states", heard.append, qos.TELEMETRY)
            await until(lambda: heard)
            assert list(heard[-1].name) == ["wheel", "mast", "tilt_joint", "lens"]
            assert list(heard[-1].position) == [0.0, 0.0, 0.0, 1.0]
