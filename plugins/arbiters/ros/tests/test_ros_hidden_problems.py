"""What ROS never tells of itself is named before anything moves: in a state of the vehicle, as the
reason of what is rejected, and by `m2pem doctor`."""

import logging
from collections.abc import AsyncIterator, Iterator, Mapping
from contextlib import ExitStack, asynccontextmanager
from pathlib import Path
from typing import Any
from uuid import UUID

import pytest
from m2pem_plugin_ros.arbiter import NAMED_WITHIN_S, RosArbiter
from m2pem_plugin_ros.frames import to_geodetic
from m2pem_plugin_ros.host_checks import check_host
from m2pem_plugin_ros.runtime import RosRuntime, qos
from m2pem_plugin_ros.testing import Peer, reserved_domain
from ros_base_bench import until
from std_msgs.msg import String

from m2pem.api import (
    ArbiterContext,
    BehaviorState,
    Connection,
    HealthStatus,
    Point,
    ResourceId,
    VehicleState,
)
from m2pem.api.clock import SystemClock
from m2pem.fleet.fleet_file import load_fleet
from m2pem.telemetry.bus import Bus
from m2pem.testing.contracts.arbiter_harness import ArbiterHarness

PEER = Path(__file__).with_name("ros_plain_peer.py")
ORIGIN = (38.1075, -77.3192, 60.0)
JOURNAL = UUID("0f5d1c7e-35b1-4b67-9f0d-6b3a2f7b1c55")
ROVER = ResourceId("rover1")
AMPLE_S = 40.0
BASE = {"driver": "base"}

PROBLEMS = {
    "TwistStamped to a base that takes Twist": (
        [["/rover1", "base", "map", "TwistStamped"]],
        BASE,
        "/rover1/cmd_vel is subscribed to as geometry_msgs/msg/TwistStamped (/rover1/vehicle",
        "m2pem publishes geometry_msgs/msg/Twist, which that does not get; write 'stamped: true'",
    ),
    "odometry in rover1/odom only": (
        [["/rover1", "base", "rover1/odom"]],
        BASE,
        "odometry of rover1 on /rover1/odom is in 'rover1/odom'; no transform from 'map' to",
        "was received on /tf: nothing was",
    ),
    "two vehicles in one namespace": (
        [["/rover1", "base", "map"], ["/rover1", "base", "map"]],
        BASE,
        "/rover1/odom in ROS domain",
        "has 2 publishers: /rover1/vehicle (gid ",
    ),
    "a QoS that cannot match": (
        [["/rover1", "base", "map", "latched"]],
        BASE,
        "/rover1/cmd_vel is subscribed to with a QoS that m2pem's commands do not have",
        "it is published volatile, and subscribed to transient local",
    ),
    "another namespace": (
        [["/rover_1", "base", "map"], ["/boat", "base", "map"]],
        BASE,
        "/rover1/odom (nav_msgs/msg/Odometry) has no publisher in ROS domain",
        "the same topic is in the namespace /boat, /rover_1: write 'namespace: /rover_1'",
    ),
    "another name of the topic": (
        [["/rover1", "base", "map"]],
        {**BASE, "topics": {"odom": "odometry/filtered"}},
        "/rover1/odometry/filtered (nav_msgs/msg/Odometry) has no publisher",
        "the same type is published on /rover1/odom: name it under 'topics'",
    ),
    "a node of another kind": (
        [["/rover1", "base", "map"]],
        {},
        "/rover1/vehicle_status (m2pem_interfaces/msg/VehicleStatus) has no publisher",
        "in its namespace there is /rover1/vehicle, which does not publish it",
    ),
    "an empty domain": (
        [],
        BASE,
        "/rover1/odom (nav_msgs/msg/Odometry) has no publisher in ROS domain",
        "there is no other ROS node in domain",
    ),
}


class Truth:
    """How often vehicles were made to move, by their own word."""

    def __init__(self, ros: RosRuntime) -> None:
        self.begun = 0
        self.heard = 0
        ros.subscribe(String, "/truth", self._on_message, qos.EVENTS)

    def _on_message(self, message: Any) -> None:
        self.heard += 1
        self.begun = max(self.begun, int(message.data.split(" ")[2]))


def arbiter_for(settings: Mapping[str, Any]) -> RosArbiter:
    connection = Connection(ROVER, "ground", {"namespace": "/rover1", **settings}, sitl=True)
    context = ArbiterContext(
        SystemClock(), Bus(), logging.getLogger("m2pem.arbiter"), ORIGIN, {}, JOURNAL, lambda _: 1
    )
    return RosArbiter({ROVER: connection}, context)


@asynccontextmanager
async def connected(
    domain: int, settings: Mapping[str, Any], vehicles: int = 1
) -> AsyncIterator[tuple[ArbiterHarness, Truth]]:
    """`domain` is that of the vehicles, so many, which are discovered before the arbiter begins."""
    async with RosRuntime("watcher", domain_id=domain) as ros:
        truth = Truth(ros)
        await until(lambda: ros.node.count_publishers("/truth") == vehicles)
        async with ArbiterHarness(arbiter_for(settings), SystemClock()) as bench:
            yield bench, truth


@pytest.fixture
def peers() -> Iterator[ExitStack]:
    with ExitStack() as stack:
        yield stack


async def first_reasons(bench: ArbiterHarness) -> str:
    """Why the vehicle is not ready, by the first state that says so: on a busy machine, DDS may
    list a second publisher after the first state."""
    named: list[str] = []

    def is_named() -> bool:
        for state in bench.states:
            if isinstance(state, VehicleState) and state.ready is False:
                named[:] = state.not_ready_reasons
                break
        return bool(named)

    assert await bench.until(is_named, AMPLE_S)
    return "; ".join(named)


async def rejected(bench: ArbiterHarness) -> str:
    place = to_geodetic(50.0, 0.0, 0.0, ORIGIN)
    target = Point((place.latitude_deg, place.longitude_deg, None))
    await bench.start("r1.b1", "goto", ROVER, target=target)
    end = await bench.ended("r1.b1", AMPLE_S)
    assert end.state is BehaviorState.REJECTED
    return end.reason


def test_what_is_wrong_is_named_within_three_seconds() -> None:
    assert NAMED_WITHIN_S < 3.0


@pytest.mark.parametrize("name", PROBLEMS)
async def test_it_is_named_and_nothing_moves(ros_domain: int, peers: ExitStack, name: str) -> None:
    vehicles, settings, *says = PROBLEMS[name]
    for arguments in vehicles:
        peers.enter_context(Peer(PEER, ros_domain, arguments))
    settings = {**settings, "domain_id": ros_domain}
    async with connected(ros_domain, settings, len(vehicles)) as (bench, truth):
        first, reason = await first_reasons(bench), await rejected(bench)
        for text in says:
            assert text in first
            assert text in reason
        if vehicles:
            await bench.until(lambda: truth.heard > 5, AMPLE_S)
        assert truth.begun == 0


async def test_a_vehicle_in_another_domain_is_named_with_it(
    ros_domain: int, peers: ExitStack, monkeypatch: pytest.MonkeyPatch
) -> None:
    with reserved_domain() as other:
        monkeypatch.setenv("ROS_DOMAIN_ID", str(other))
        peers.enter_context(Peer(PEER, other, ["/rover1", "base", "map"]))
        async with connected(other, {**BASE, "domain_id": ros_domain}) as (bench, truth):
            says = (
                f"/rover1/odom (nav_msgs/msg/Odometry) has no publisher in ROS domain {ros_domain}",
                f"it is published in ROS domain {other}: write 'domain_id: {other}'",
            )
            first, reason = await first_reasons(bench), await rejected(bench)
            for text in says:
                assert text in first
                assert text in reason
            await bench.until(lambda: truth.heard > 5, AMPLE_S)
            assert truth.begun == 0


async def test_operators_are_alerted_and_told_when_it_is_right(
    ros_domain: int, peers: ExitStack, caplog: pytest.LogCaptureFixture
) -> None:
    async with connected(ros_domain, {**BASE, "domain_id": ros_domain}, 0) as (bench, _):
        assert "there is no other ROS node in domain" in await first_reasons(bench)
        assert "rover1: no message from the vehicle yet: /rover1/odom" in caplog.text
        peers.enter_context(Peer(PEER, ros_domain, ["/rover1", "base", "map"]))
        assert await bench.until(lambda: bench.latest(ROVER).ready is True, AMPLE_S)
        assert "rover1: it can be commanded now" in caplog.text
        peers.enter_context(Peer(PEER, ros_domain, ["/rover1", "base", "map"]))
        assert await bench.until(lambda: bench.latest(ROVER).ready is False, AMPLE_S)
        assert "rover1: it is not commanded: /rover1/odom in ROS domain" in caplog.text


FLEET = """
version: 1
name: test
origin: {{lat: 38.1075, lon: -77.3192, alt: 60.0}}
vehicles:
  rover1:
    domain: ground
    arbiter: ros
    sitl: true
    connection: {{namespace: /rover1, domain_id: {domain}, driver: base}}
  rover2:
    domain: ground
    arbiter: ros
    sitl: true
    connection: {{namespace: /rover2, domain_id: {domain}, driver: base}}
"""


def test_doctor_names_it_of_each_vehicle(ros_domain: int, tmp_path: Path, peers: ExitStack) -> None:
    file = tmp_path / "fleet.yaml"
    file.write_text(FLEET.format(domain=ros_domain))
    peers.enter_context(Peer(PEER, ros_domain, ["/rover1", "base", "map", "TwistStamped"]))
    checks = {check.name: check for check in check_host(load_fleet(file))}
    wrong, absent = checks["ros rover1"], checks["ros rover2"]
    assert wrong.status is HealthStatus.ERROR
    assert "is subscribed to as geometry_msgs/msg/TwistStamped" in wrong.message
    assert absent.status is HealthStatus.WARNING
    assert "the same topic is in the namespace /rover1" in absent.message
