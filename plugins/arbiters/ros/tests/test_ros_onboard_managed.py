"""`m2pem ros onboard --ros-args`: what plain clients of ROS see of its node, and may do with it."""

import logging
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from m2pem_interfaces.msg import BehaviorCommand, BehaviorStatus, KeyValue, VehicleStatus
from m2pem_plugin_ros.runtime import qos
from m2pem_plugin_ros.testing import Peer
from rcl_interfaces.msg import Log, ParameterType
from rclpy.qos import DurabilityPolicy, QoSProfile
from ros_node_client import ACTIVATE, CLEANUP, CONFIGURE, DEACTIVATE, NodeClient, node_client

from m2pem.cli.group import run_command_line

HERE = Path(__file__).parent
ONBOARD = ["ros", "onboard", "--vehicle", "evsg1", "--origin", "38.0,-77.0,60", "--loopback"]
NODE = "/evsg1/m2pem_onboard"
INACTIVE = f"the node is inactive: `ros2 lifecycle set {NODE} activate` makes it obey"
LINE = '{"type": "LineString", "coordinates": [[-77.0, 38.00003], [-77.0, 38.01]]}'
FAR = f'{{"type": "Feature", "properties": {{}}, "geometry": {LINE}}}'
TYPES = "start_type_description_service"
ROSOUT = QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def onboard(domain: int, *words: str) -> Peer:
    return Peer(HERE / "ros_m2pem_command.py", domain, [*ONBOARD, *words])


def base(domain: int, namespace: str = "/evsg1", *more: str) -> Peer:
    return Peer(HERE / "ros_base_peer.py", domain, [namespace, "plain", "1", *more])


class Commander:
    """Starts behaviors as an executive does, and hears of them."""

    def __init__(self, client: NodeClient, namespace: str = "/evsg1") -> None:
        self.client = client
        create = client.node.create_publisher
        self.commands = create(BehaviorCommand, f"{namespace}/command", qos.COMMANDS)
        self.statuses = client.heard(
            BehaviorStatus, f"{namespace}/behavior_status", qos.BEHAVIOR_STATUS
        )
        self.vehicles = client.heard(VehicleStatus, f"{namespace}/vehicle_status", qos.STATUS)
        client.until(self.commands.get_subscription_count)

    def start(self, id_: str) -> None:
        command = BehaviorCommand(verb=BehaviorCommand.START, id=id_, run="r", epoch=1)
        command.behavior = "single_vehicle_routing"
        command.parameters = [KeyValue(key="route", value=FAR)]
        self.commands.publish(command)

    def until(self, id_: str, state: int) -> Any:
        return self.client.until(
            lambda: next((s for s in self.statuses if (s.id, s.state) == (id_, state)), None),
            self.statuses,
        )

    def until_ready(self) -> None:
        self.client.until(
            lambda: self.vehicles and self.vehicles[-1].readiness == VehicleStatus.READY
        )


def test_parameters_are_described_and_what_cannot_change_is_refused(ros_domain: int) -> None:
    words = ["--set", "bounds.speed=1.5 m/s", "--ros-args", "-p", "bounds.yaw_rate:=0.7"]
    with onboard(ros_domain, *words), node_client(NODE, ros_domain) as client:
        names = client.names()
        assert {"origin", "driver", "odom_frame", "bounds.speed", "topics.odom"} <= set(names)
        speed, frame = client.described("bounds.speed", "odom_frame")
        assert speed.type == ParameterType.PARAMETER_DOUBLE
        assert speed.read_only
        assert speed.description == "Limit of a plain base: speed in m/s."
        (limits,) = speed.floating_point_range
        assert (limits.from_value, limits.to_value) == (0.0, 1000.0)
        assert frame.additional_constraints.startswith("One of: map, odom")
        ours = [name for name in names if name not in ("use_sim_time", TYPES)]
        assert all(each.description for each in client.described(*ours))
        read = client.values("bounds.speed", "bounds.yaw_rate", "origin", "driver", "stamped")
        assert read == [1.5, 0.7, [38.0, -77.0, 60.0], "base", False]
        assert not client.set("bounds.speed", 2.0).successful
        refused = client.set("use_sim_time", True)
        assert (refused.successful, refused.reason) == (
            False,
            "start the node with -p use_sim_time:=...: its clock cannot change while it runs",
        )


def test_an_inactive_node_stops_its_vehicle_and_refuses_by_name(ros_domain: int) -> None:
    with (
        base(ros_domain),
        onboard(ros_domain) as program,
        node_client(NODE, ros_domain) as client,
    ):
        assert client.state() == "active"
        commander = Commander(client)
        commander.until_ready()
        commander.start("b1")
        commander.until("b1", BehaviorStatus.RUNNING)

        assert client.change(DEACTIVATE)
        assert client.state() == "inactive"
        commander.start("b2")
        assert commander.until("b2", BehaviorStatus.REJECTED).reason == INACTIVE
        ended = commander.until("b1", BehaviorStatus.CANCELLED)
        assert ended.reason == "the node on the vehicle was deactivated"
        client.until(
            lambda: (
                commander.vehicles[-1].readiness == VehicleStatus.NOT_READY
                and INACTIVE in commander.vehicles[-1].not_ready_reasons
            )
        )
        assert not client.change(CONFIGURE)  # from inactive, there is no such transition

        assert client.change(CLEANUP)
        assert client.state() == "unconfigured"
        client.until(lambda: not commander.commands.get_subscription_count())
        assert client.change(CONFIGURE)
        assert client.change(ACTIVATE)
        client.until(commander.commands.get_subscription_count)
        commander.until_ready()
        commander.start("b3")
        commander.until("b3", BehaviorStatus.RUNNING)

        assert client.change("shutdown")
        commander.until("b3", BehaviorStatus.CANCELLED)
        assert program.process.wait(20) == 0


def test_without_autostart_ros_configures_and_activates_it(ros_domain: int) -> None:
    with (
        base(ros_domain),
        onboard(ros_domain, "--no-autostart"),
        node_client(NODE, ros_domain) as client,
    ):
        assert client.state() == "unconfigured"
        assert client.node.count_subscribers("/evsg1/command") == 0
        assert not client.change(ACTIVATE)
        assert client.change(CONFIGURE)
        commander = Commander(client)
        commander.start("b1")
        assert commander.until("b1", BehaviorStatus.REJECTED).reason == INACTIVE
        assert client.change(ACTIVATE)
        commander.until_ready()


def test_names_and_topics_are_remapped(ros_domain: int) -> None:
    words = "--ros-args -r __ns:=/team_a -r __node:=pilot -r odom:=/evsg1/odom"
    with (
        base(ros_domain),
        onboard(ros_domain, *words.split(), "-r", "cmd_vel:=/evsg1/cmd_vel", "--"),
        node_client("/team_a/pilot", ros_domain) as client,
    ):
        assert client.state() == "active"
        commander = Commander(client, "/team_a")
        commander.until_ready()
        commander.start("b1")
        commander.until("b1", BehaviorStatus.RUNNING)
        moving = client.heard(VehicleStatus, "/team_a/vehicle_status", qos.STATUS)
        client.until(lambda: moving and moving[-1].mode == "auto")
        assert client.node.count_publishers("/evsg1/cmd_vel") == 1
        assert client.node.count_subscribers("/evsg1/command") == 0


def test_its_log_is_on_rosout_with_severity_and_name(ros_domain: int) -> None:
    words = ["--ros-args", "-p", "bounds.sped:=1.0"]
    with onboard(ros_domain, *words), node_client(NODE, ros_domain) as client:
        said = client.heard(Log, "/rosout", ROSOUT)

        def of(level: int) -> Sequence[str]:
            return [m.msg for m in said if m.level == level and m.name == "evsg1.m2pem_onboard"]

        client.until(lambda: f"{NODE}: activate" in of(20))
        Commander(client).start("b1")
        rejected = "evsg1: b1 is rejected: the vehicle has sent no message yet"
        client.until(lambda: rejected in of(20), said)
        assert of(30) == [
            "parameter bounds.sped is ignored: this node has none of that name; did you mean "
            "'bounds.speed' or 'bounds.reverse_speed'?"
        ]


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        ("--bogus", "ROS has no argument '--bogus'; it has -r, -p, --params-file, --log-level"),
        ("-r odom", "ROS cannot be started: Couldn't parse remap rule: '-r odom'"),
        ("--params-file nowhere.yaml", "Error opening YAML file"),
        ("--log-level loud", "Couldn't parse log level: '--log-level loud'"),
        ("-p bounds.speed:=fast", "'bounds.speed' to 'fast' of type 'STRING', expecting type"),
        ("-p bounds.speed:=-1.0", "bounds.speed out of range Min: 0.0, Max: 1000.0"),
        ("-p bounds.speed:=0.0", "evsg1: connection.bounds.speed: '0.0 m/s' is not above 0"),
        ("-p odom_frame:=earth", "parameter odom_frame: 'earth' is not one of map, odom"),
        ("-p origin:=[98.0,0.0,0.0]", "'98.0,0.0,0.0' is not on Earth"),
        ("-p topics.odom:=9x", "evsg1: connection.topics.odom: '9x' is not the name of a ROS"),
    ],
)
def test_wrong_arguments_of_ros_are_refused(
    words: str,
    problem: str,
    ros_domain: int,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", f"{ros_domain}")
    # The command line makes the log its own, for the rest of this process.
    logger = logging.getLogger("m2pem")
    for name in ("handlers", "propagate", "level"):
        monkeypatch.setattr(logger, name, getattr(logger, name))
    monkeypatch.setattr(logger, "handlers", [])
    assert run_command_line([*ONBOARD, "--ros-args", *words.split()]) == 2
    assert problem in capsys.readouterr().err
