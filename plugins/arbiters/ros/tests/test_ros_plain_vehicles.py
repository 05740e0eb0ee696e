"""Vehicles of plain rclpy nodes: one that comes late, one that returns, two in one namespace, and
wrong frames."""

import asyncio
import itertools
import logging
import re
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import AsyncExitStack, asynccontextmanager
from pathlib import Path
from typing import Any
from uuid import UUID

import pytest
from m2pem_plugin_ros import vehicle
from m2pem_plugin_ros.arbiter import RosArbiter
from m2pem_plugin_ros.checkpoint import Checkpoint, encode_checkpoint
from m2pem_plugin_ros.frames import to_geodetic
from m2pem_plugin_ros.runtime import RosRuntime, qos
from m2pem_plugin_ros.sensors.graph import NAMELESS
from m2pem_plugin_ros.testing import Peer
from std_msgs.msg import String

from m2pem.api import (
    ArbiterContext,
    BehaviorState,
    Connection,
    GeoPosition,
    Point,
    ResourceId,
    RunStatus,
    VehiclePosition,
    VehicleState,
)
from m2pem.api.clock import SystemClock
from m2pem.executive.executive import Executive
from m2pem.fleet.fleet_file import load_fleet
from m2pem.journal import MemoryJournal
from m2pem.plugins import PluginManager
from m2pem.telemetry.bus import Bus
from m2pem.testing.contracts.arbiter_harness import ArbiterHarness

PEER = Path(__file__).with_name("ros_plain_peer.py")
ACTION_PEER = Path(__file__).with_name("ros_onboard_peer.py")
ORIGIN = (38.1075, -77.3192, 60.0)
JOURNAL = UUID("0f5d1c7e-35b1-4b67-9f0d-6b3a2f7b1c55")
UGV1 = ResourceId("ugv1")
AMPLE_S = 40.0
NO_TRANSFORM = "is in 'rover1/odom'; no transform from 'map' to 'rover1/odom' was received on /tf"


class Truth:
    """What vehicles do, by their own word, whatever their links carry."""

    def __init__(self, ros: RosRuntime) -> None:
        self._ros = ros
        self._recent = {"/ugv1": ["/ugv1", "0", "0"]}
        self._links = ros.node.create_publisher(String, "/link", 10)
        ros.subscribe(String, "/truth", self._on_message, qos.EVENTS)

    def speed(self, vehicle: str = "/ugv1") -> float:
        return float(self._recent[vehicle][1])

    def begun(self, vehicle: str = "/ugv1") -> int:
        return int(self._recent[vehicle][2])

    def cancels(self, vehicle: str = "/ugv1") -> list[str]:
        return self._recent[vehicle][3].split(",") if len(self._recent[vehicle]) > 3 else []

    def cut(self, vehicle: str) -> None:
        """Make a vehicle deaf and dumb; "" mends it."""
        self._links.publish(String(data=vehicle))

    def _on_message(self, message: Any) -> None:
        words = message.data.split(" ")
        self._recent[words[0]] = words


def arbiter_for(domain: int, bus: Bus, epoch: int = 1, **settings: Any) -> RosArbiter:
    connection = Connection(
        UGV1,
        "ground",
        {"namespace": "/ugv1", "domain_id": domain, **settings},
        lost_after_s=3.0,
        sitl=True,
    )
    context = ArbiterContext(
        SystemClock(), bus, logging.getLogger("m2pem.test"), ORIGIN, {}, JOURNAL, lambda _: epoch
    )
    return RosArbiter({UGV1: connection}, context)


@asynccontextmanager
async def connected(
    domain: int, epoch: int = 1, **settings: Any
) -> AsyncIterator[tuple[ArbiterHarness, Truth]]:
    async with RosRuntime("watcher", domain_id=domain) as ros:
        truth = Truth(ros)
        arbiter = arbiter_for(domain, Bus(), epoch, **settings)
        async with ArbiterHarness(arbiter, SystemClock()) as bench:
            yield bench, truth


async def until(true: Callable[[], object]) -> None:
    async with asyncio.timeout(AMPLE_S):
        while not true():  # noqa: ASYNC110  # what is waited for has no event
            await asyncio.sleep(0.02)


def ahead() -> Point:
    place = to_geodetic(500.0, 0.0, 0.0, ORIGIN)
    return Point((place.latitude_deg, place.longitude_deg, None))


async def drives(bench: ArbiterHarness, truth: Truth, id_: str = "r1.b1", epoch: int = 1) -> None:
    await bench.start(id_, "goto", UGV1, epoch=epoch, target=ahead())
    await bench.running(id_)
    await until(lambda: truth.speed() > 0.3)


def state(bench: ArbiterHarness) -> VehicleState | None:
    latest = bench.latest(UGV1)
    return latest if isinstance(latest, VehicleState) else None


def reasons(bench: ArbiterHarness) -> str:
    latest = state(bench)
    return "" if latest is None else "; ".join(latest.not_ready_reasons)


# --- one that comes late, or never ----------------------------------------------------------------


@asynccontextmanager
async def late(domain: int, kind: str) -> AsyncIterator[None]:
    """The vehicle, from now on; the loop goes on while it starts and ends."""
    action = kind == "action"
    arguments = ["1", "ugv1"] if action else ["/ugv1", kind, "map"]
    peer = Peer(ACTION_PEER if action else PEER, domain, arguments)
    await asyncio.to_thread(peer.__enter__)
    try:
        yield
    finally:
        await asyncio.to_thread(peer.__exit__, None, None, None)


@pytest.mark.parametrize(
    ("kind", "settings"),
    [
        ("node", {}),
        ("action", {"via": "action"}),
        ("base", {"driver": "base"}),
        ("nav2", {"driver": "nav2"}),
    ],
)
async def test_a_behavior_waits_for_a_vehicle_that_comes_late(
    ros_domain: int,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    kind: str,
    settings: Mapping[str, Any],
) -> None:
    monkeypatch.setattr(vehicle, "FOUND_WITHIN_S", AMPLE_S)
    async with connected(ros_domain, **settings) as (bench, truth):
        await bench.start("r1.b1", "goto", UGV1, target=ahead())
        await until(lambda: "ugv1: r1.b1 waits: not discovered yet: " in caplog.text)
        async with late(ros_domain, kind):
            await bench.running("r1.b1", AMPLE_S)
            # To the executive, a lost link would have been its end.
            assert "lost" not in {state.link for state in bench.states}
            if kind != "action":
                await until(lambda: truth.speed() > 0.3)
                assert truth.begun() == 1


@pytest.mark.parametrize(
    ("there", "settings", "missing"),
    [
        ("", {}, "/ugv1/vehicle_status (m2pem_interfaces/msg/VehicleStatus) has no publisher"),
        ("", {"driver": "base"}, "/ugv1/odom (nav_msgs/msg/Odometry) has no publisher"),
        ("nav2", {"driver": "base"}, "a subscriber to /ugv1/cmd_vel"),
        ("base", {"driver": "nav2"}, "an answer of the service /ugv1/bt_navigator/get_state"),
        ("node", {"via": "action"}, "the service /ugv1/execute_behavior/_action/send_goal and "),
    ],
)
async def test_a_behavior_is_rejected_with_what_of_its_vehicle_never_comes(
    ros_domain: int,
    monkeypatch: pytest.MonkeyPatch,
    there: str,
    settings: Mapping[str, Any],
    missing: str,
) -> None:
    monkeypatch.setattr(vehicle, "FOUND_WITHIN_S", 0.5 if not there else 4.0)
    async with AsyncExitStack() as stack:
        if there:
            await stack.enter_async_context(late(ros_domain, there))
        bench, truth = await stack.enter_async_context(connected(ros_domain, **settings))
        await bench.start("r1.b1", "goto", UGV1, target=ahead())
        end = await bench.ended("r1.b1", AMPLE_S)
        assert (end.state, end.code) == (BehaviorState.REJECTED, "REJECTED")
        assert re.match(r"not discovered within [\d.]+ s: " + re.escape(missing), end.reason)
        assert truth.begun() == 0


async def test_a_behavior_waits_for_the_position_of_its_target(
    ros_domain: int, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(vehicle, "FOUND_WITHIN_S", AMPLE_S)
    bus, place = Bus(), GeoPosition(38.1085, -77.3192, 60.0)
    async with late(ros_domain, "base"):
        arbiter = arbiter_for(ros_domain, bus, driver="base")
        async with ArbiterHarness(arbiter, SystemClock()) as bench:
            target = VehiclePosition("ugv2")
            await bench.start("r1.b1", "goto", UGV1, target=target)
            await until(
                lambda: "r1.b1 waits: not discovered yet: a position of ugv2" in caplog.text
            )
            now_us = SystemClock().now_us()
            bus.publish(VehicleState(ResourceId("ugv2"), now_us, place))
            await bench.running("r1.b1", AMPLE_S)


async def test_a_query_after_a_restart_waits_for_a_vehicle_that_comes_late(
    ros_domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(vehicle, "ASKED_WITHIN_S", AMPLE_S)
    reference = encode_checkpoint(Checkpoint((UGV1,), "goto", 1, {"target": ahead()}))
    async with connected(ros_domain) as (bench, _):
        asked = asyncio.create_task(bench.arbiter.query("r1.b1", reference))
        async with late(ros_domain, "node"):
            found = await asyncio.wait_for(asked, AMPLE_S)
        assert found.state is BehaviorState.UNKNOWN
        assert found.reason == "the vehicle's node was restarted and does not have the behavior"


async def test_a_behavior_that_waits_can_be_cancelled(
    ros_domain: int, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(vehicle, "FOUND_WITHIN_S", AMPLE_S)
    async with connected(ros_domain) as (bench, truth):
        await bench.start("r1.b1", "goto", UGV1, target=ahead())
        await until(lambda: "r1.b1 waits: " in caplog.text)
        await bench.arbiter.cancel("r1.b1", 1)
        assert (await bench.ended("r1.b1", AMPLE_S)).state is BehaviorState.CANCELLED
        async with late(ros_domain, "node"):
            await drives(bench, truth, "r1.b2")
            assert truth.begun() == 1


async def test_what_may_run_since_before_a_restart_is_cancelled_when_its_vehicle_comes(
    ros_domain: int, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(vehicle, "FOUND_WITHIN_S", AMPLE_S)
    monkeypatch.setattr(vehicle, "ASKED_WITHIN_S", 0.0)
    reference = encode_checkpoint(Checkpoint((UGV1,), "goto", 1, {"target": ahead()}))
    async with connected(ros_domain) as (bench, truth):
        asked = await bench.arbiter.query("r1.b1", reference)
        assert asked.state is BehaviorState.UNKNOWN
        await bench.start("r1.b1", "goto", UGV1, target=ahead())
        await until(lambda: "r1.b1 waits: " in caplog.text)
        await bench.arbiter.cancel("r1.b1", 1)
        async with late(ros_domain, "node"):
            assert (await bench.ended("r1.b1", AMPLE_S)).state is BehaviorState.CANCELLED
            await until(lambda: any(truth.cancels()))
            assert truth.begun() == 0


async def test_what_may_run_since_before_a_restart_is_lost_and_ended_when_its_vehicle_comes_late(
    ros_domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(vehicle, "FOUND_WITHIN_S", 0.5)
    monkeypatch.setattr(vehicle, "ASKED_WITHIN_S", 0.0)
    monkeypatch.setattr(vehicle, "RECLAIM_WITHIN_S", AMPLE_S)
    reference = encode_checkpoint(Checkpoint((UGV1,), "goto", 1, {"target": ahead()}))
    async with connected(ros_domain) as (bench, truth):
        await bench.arbiter.query("r1.b1", reference)
        await bench.start("r1.b1", "goto", UGV1, target=ahead())
        end = await bench.ended("r1.b1", AMPLE_S)
        assert end.state is BehaviorState.LOST
        assert end.reason.startswith("not discovered within 0.5 s: ")
        async with late(ros_domain, "node"):
            assert await bench.arbiter.reclaim(UGV1) == ""  # type: ignore[attr-defined]
            await until(lambda: any(truth.cancels()))
            assert truth.begun() == 0


@pytest.mark.parametrize(("kind", "settings"), [("base", {"driver": "base"}), ("node", {})])
async def test_a_vehicle_that_is_held_before_it_comes_begins_when_it_is_resumed(
    ros_domain: int,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    kind: str,
    settings: Mapping[str, Any],
) -> None:
    monkeypatch.setattr(vehicle, "FOUND_WITHIN_S", AMPLE_S)
    async with connected(ros_domain, **settings) as (bench, truth):
        await bench.start("r1.b1", "goto", UGV1, target=ahead())
        await until(lambda: "r1.b1 waits: " in caplog.text)
        await bench.arbiter.hold(UGV1)
        async with late(ros_domain, kind):
            await until(lambda: (now := state(bench)) is not None and now.link == "connected")
            received = len(bench.states)
            await until(lambda: len(bench.states) > received + 5)
            assert truth.begun() == 0
            await bench.arbiter.resume(UGV1)
            await until(lambda: truth.speed() > 0.3)


# --- one that returns -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("kind", "settings"),
    [
        ("node", {}),
        pytest.param("base", {"driver": "base"}, marks=pytest.mark.long),
        pytest.param("nav2", {"driver": "nav2"}, marks=pytest.mark.long),
    ],
)
async def test_a_vehicle_that_returns_is_told_to_stop_and_is_free_when_it_has(
    ros_domain: int, kind: str, settings: Mapping[str, Any]
) -> None:
    with Peer(PEER, ros_domain, ["/ugv1", kind, "map"]):
        async with connected(ros_domain, 7, **settings) as (bench, truth):
            await drives(bench, truth, epoch=7)
            truth.cut("/ugv1")
            assert (await bench.ended("r1.b1", AMPLE_S)).state is BehaviorState.LOST
            assert truth.speed() > 0.3, "it drives on, as nobody can tell it otherwise"
            truth.cut("")
            await until(lambda: (seen := state(bench)) is not None and seen.link == "connected")
            async with asyncio.timeout(AMPLE_S):
                while await bench.arbiter.reclaim(UGV1):  # type: ignore[attr-defined]
                    pass
            await until(lambda: truth.speed() == 0.0)
            assert kind != "node" or truth.cancels()[0] == "7"
            # Nav2 answers again only when it is asked for its state again.
            await until(lambda: "Nav2 does not answer" not in reasons(bench))
            await drives(bench, truth, "r1.b2", epoch=7)


# --- two in one namespace -------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("kind", "settings", "topic"),
    [
        ("node", {}, "/ugv1/vehicle_status"),
        pytest.param("base", {"driver": "base"}, "/ugv1/odom", marks=pytest.mark.long),
    ],
)
async def test_two_vehicles_in_one_namespace_are_both_named_and_not_commanded(
    ros_domain: int, kind: str, settings: Mapping[str, Any], topic: str
) -> None:
    arguments = ["/ugv1", kind, "map"]
    one, other = Peer(PEER, ros_domain, arguments), Peer(PEER, ros_domain, arguments)
    with one, other:
        async with connected(ros_domain, **settings) as (bench, truth):
            await until(lambda: reasons(bench).count("/ugv1/vehicle (gid ") == 2)
            assert state(bench).ready is False  # type: ignore[union-attr]
            await bench.start("r1.b1", "goto", UGV1, target=ahead())
            end = await bench.ended("r1.b1", AMPLE_S)
            assert end.state is BehaviorState.REJECTED
            assert f"{topic} in ROS domain {ros_domain} has 2 publishers" in end.reason
            assert end.reason.count("/ugv1/vehicle (gid ") == 2
            gids = {part.split(")")[0] for part in end.reason.split("(gid ")[1:]}
            assert len(gids) == 2, "two endpoints have two gids"
            assert truth.begun() == 0


@pytest.mark.long
async def test_a_vehicle_that_appears_later_is_told_of_and_was_not_restarted(
    ros_domain: int,
) -> None:
    arguments = ["/ugv1", "node", "map"]
    with Peer(PEER, ros_domain, arguments):
        async with connected(ros_domain) as (bench, truth):
            await drives(bench, truth)
            with Peer(PEER, ros_domain, arguments):
                await until(lambda: "has 2 publishers" in reasons(bench))
                # The second one answers that it knows nothing of what the first one does.
                await bench.clock.sleep(6.0)
                assert [each.state.value for each in bench.of("r1.b1")] == ["ACCEPTED", "RUNNING"]
            await until(lambda: "has 2 publishers" not in reasons(bench))
            await bench.arbiter.cancel("r1.b1", 1)
            assert (await bench.ended("r1.b1", AMPLE_S)).state is BehaviorState.CANCELLED
            await until(lambda: truth.speed() == 0.0)


# --- frames and types -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("settings", "frame", "says"),
    [
        (
            {},
            "rover1/odom",
            "is in 'rover1/odom'; no transform from 'map' to 'rover1/odom' was",
        ),
        *(
            pytest.param({"driver": "base", **more}, frame, says, marks=pytest.mark.long)
            for more, frame, says in (
                (
                    {},
                    "rover1/odom",
                    "is in 'rover1/odom'; no transform from 'map' to 'rover1/odom' was",
                ),
                ({}, "", "is in ''; a frame without a name cannot be looked up"),
                ({}, "ugv1/map", "is in 'ugv1/map'; no transform from 'map' to 'ugv1/map'"),
                (
                    {"odom_frame": "odom"},
                    "map",
                    "declared is 'odom': write 'odom_frame: map'",
                ),
            )
        ),
    ],
)
async def test_odometry_in_a_frame_that_is_not_the_declared_one_is_refused_by_name(
    ros_domain: int, settings: Mapping[str, Any], frame: str, says: str
) -> None:
    kind = "base" if settings else "node"
    with Peer(PEER, ros_domain, ["/ugv1", kind, frame]):
        async with connected(ros_domain, **settings) as (bench, truth):
            await until(lambda: says in reasons(bench) or settings)
            assert says in await reason_with_a_name(bench)
            assert truth.begun() == 0


async def reason_with_a_name(bench: Any) -> str:
    """Why a behavior is rejected, once the names of all nodes are known."""
    reason = NAMELESS
    for number in itertools.count(1):
        if NAMELESS not in reason:
            break
        await bench.start(f"r1.b{number}", "goto", UGV1, target=ahead())
        end = await bench.ended(f"r1.b{number}", AMPLE_S)
        assert end.state is BehaviorState.REJECTED
        reason = end.reason
    return reason


@pytest.mark.parametrize(
    ("settings", "type_", "says"),
    [
        ({}, "TwistStamped", "is subscribed to as geometry_msgs/msg/TwistStamped (/ugv1/vehicle"),
        ({"stamped": True}, "Twist", "write 'stamped: false' in its connection"),
        pytest.param(
            {},
            "pose",
            "/ugv1/odom is of type geometry_msgs/msg/PoseStamped (/ugv1/vehicle",
            marks=pytest.mark.long,
        ),
    ],
)
async def test_a_type_that_does_not_match_is_named_before_anything_moves(
    ros_domain: int, settings: Mapping[str, Any], type_: str, says: str
) -> None:
    with Peer(PEER, ros_domain, ["/ugv1", "base", "map", type_]):
        async with connected(ros_domain, driver="base", **settings) as (bench, truth):
            assert says in await reason_with_a_name(bench)
            assert truth.begun() == 0


async def test_what_is_awaited_where_is_said_of_a_vehicle_in_another_domain(
    ros_domain: int, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("m2pem_plugin_ros.arbiter.FIRST_CONTACT_WITHIN_S", 0.5)
    async with connected(ros_domain):
        pass
    expected = (
        "/ugv1/vehicle_status (m2pem_interfaces/msg/VehicleStatus) has no publisher in ROS domain"
        f" {ros_domain}, namespace /ugv1"
    )
    assert expected in caplog.text


# --- epochs ---------------------------------------------------------------------------------------


async def test_a_cancel_of_an_executive_that_was_replaced_is_refused(ros_domain: int) -> None:
    with Peer(PEER, ros_domain, ["/ugv1", "node", "map"]):
        async with connected(ros_domain, 1) as (old, truth):
            await drives(old, truth)
            reference = old.of("r1.b1")[-1].native_ref
            async with ArbiterHarness(arbiter_for(ros_domain, Bus(), 2), SystemClock()) as new:
                report = await new.arbiter.query("r1.b1", reference)
                assert report.state is BehaviorState.RUNNING
                await old.arbiter.cancel("r1.b1", 1)
                await until(lambda: "1refused" in truth.cancels())
                assert truth.speed() > 0.3
                await new.arbiter.cancel("r1.b1", 2)
                assert (await new.ended("r1.b1", AMPLE_S)).state is BehaviorState.CANCELLED
                await until(lambda: "2" in truth.cancels() and truth.speed() == 0.0)


# --- after a restart ------------------------------------------------------------------------------


async def test_what_a_base_does_not_know_after_a_restart_is_cancelled_at_once(
    ros_domain: int,
) -> None:
    with Peer(PEER, ros_domain, ["/ugv1", "base", "map"]):
        async with connected(ros_domain, driver="base") as (old, truth):
            await drives(old, truth)
            reference = old.of("r1.b1")[-1].native_ref
        async with connected(ros_domain, 2, driver="base") as (new, truth):
            assert (await new.arbiter.query("r1.b1", reference)).state is BehaviorState.UNKNOWN
            await new.arbiter.cancel("r1.b1", 2)
            bound_s = new.arbiter.limits(UGV1).cancel_timeout_s
            assert (await new.ended("r1.b1", bound_s)).state is BehaviorState.CANCELLED
            assert truth.speed() == 0.0


# --- detectors ------------------------------------------------------------------------------------

FLEET = """
version: 1
name: test
origin: {{lat: 38.1075, lon: -77.3192, alt: 60.0}}
vehicles:
  ugv1:
    domain: ground
    arbiter: ros
    sitl: true
    connection: {{namespace: /ugv1, domain_id: {domain}}}
    payloads:
      gpr: {{connection: {{topic: gpr/alarm, message: string}}}}
"""
MISSION = b"""<?xml version="1.0" encoding="UTF-8"?>
<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"
             xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="test">
  <process id="P" isExecutable="true">
    <startEvent id="S"/>
    <serviceTask id="D"><extensionElements><m2pem:service class="Detector"/></extensionElements>
    </serviceTask>
    <endEvent id="E"/>
    <sequenceFlow id="F1" sourceRef="S" targetRef="D"/>
    <sequenceFlow id="F2" sourceRef="D" targetRef="E"/>
  </process>
</definitions>
"""


async def test_a_payload_with_a_topic_is_a_detector_without_being_marked_as_one(
    ros_domain: int, tmp_path: Path
) -> None:
    file = tmp_path / "fleet.yaml"
    file.write_text(FLEET.format(domain=ros_domain))
    fleet, journal = load_fleet(file), MemoryJournal()
    with Peer(PEER, ros_domain, ["/ugv1", "node", "map"]):
        async with (
            RosRuntime("gpr", domain_id=ros_domain) as ros,
            Executive(fleet, journal, PluginManager(), SystemClock()) as executive,
        ):
            alarm = ros.node.create_publisher(String, "/ugv1/gpr/alarm", 10)
            await until(alarm.get_subscription_count)
            run = await executive.control.start(MISSION)
            over = asyncio.create_task(executive.control.wait(run))
            while not over.done():
                alarm.publish(String(data="mine"))
                await asyncio.wait([over], timeout=0.5)
            assert over.result().status is RunStatus.COMPLETED
