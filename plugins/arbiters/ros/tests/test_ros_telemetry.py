"""What the fleet is told of vehicles, and of what their detectors find, over real DDS."""

import asyncio
import logging
import math
from collections.abc import Iterator

import pytest
from m2pem_interfaces.msg import TargetState
from m2pem_plugin_ros.connections import TargetPublisher
from m2pem_plugin_ros.runtime import qos
from m2pem_plugin_ros.sensors.detectors import WAITING
from m2pem_plugin_ros.settings import read_settings
from m2pem_plugin_ros.testing import Peer, reserved_domain
from ros_double import ORIGIN, at
from ros_sensors import AMPLE_S, GPR, PEER, TOPICS, V, connected, fix, odometry, sensors, until

from m2pem.api import (
    Connection,
    GeoPosition,
    PayloadState,
    ResourceId,
    ServiceContext,
    VehicleState,
)
from m2pem.services.detector import Detector
from m2pem.telemetry.bus import Bus

NAN = math.nan
ERROR, WARN, OK = 2, 1, 0


@pytest.fixture(scope="module")
def domain() -> Iterator[int]:
    with reserved_domain() as domain, Peer(PEER, domain, TOPICS):
        yield domain


def diagnostics(*said: tuple[str, str, int, str]):
    names = ("name", "hardware_id", "level", "message")
    return ("/diagnostics", {"status": [dict(zip(names, each, strict=True)) for each in said]})


def battery(share: float):
    return ("/evsg1/battery_state", {"percentage": share})


def detection(type_: str = "gpr", **fields):
    return ("/evsg1/detections", {"type": type_, **fields})


def positioned(bench) -> VehicleState | None:
    """The last state, if it has a position."""
    state = bench.latest(V)
    return state if state is not None and state.position is not None else None


def found(bench) -> list:
    return [d for s in bench.states if isinstance(s, PayloadState) for d in s.detections]


async def test_a_state_is_made_of_what_all_topics_say(domain: int) -> None:
    async with connected(domain) as bench, sensors(domain) as teller:

        def told() -> bool:
            state = positioned(bench)
            return state and state.battery_fraction and state.not_ready_reasons

        await teller.repeat(
            told,
            "odometry, battery and diagnostics are heard",
            odometry(30.0, 40.0, yaw=math.pi / 2, forward=1.5),
            battery(0.75),
            diagnostics(
                ("motor", "evsg1", ERROR, "hot"),
                ("fan", "evsg1", WARN, "slow"),
                ("motor", "evsg2", ERROR, "on fire"),
                ("m2pem: link evsg1", "evsg1", ERROR, "said by m2pem itself"),
            ),
        )
        state = bench.latest(V)
        assert state.battery_fraction == 0.75
        assert state.not_ready_reasons == ("motor: hot",)
        assert state.position.latitude_deg == pytest.approx(ORIGIN[0] + 40.0 / 110_990, abs=1e-6)
        assert state.velocity_enu_m_s == pytest.approx((0.0, 1.5, 0.0), abs=1e-6)
        assert state.yaw_rad == pytest.approx(math.pi / 2)
        assert state.ready is False
        await teller.say(diagnostics(("motor", "evsg1", OK, "")), battery(NAN), battery(80.0))
        await until(lambda: bench.latest(V).ready, "the motor is well again")
        assert bench.latest(V).not_ready_reasons == ()
        assert bench.latest(V).battery_fraction == 0.75


async def test_a_pose_that_is_no_number_never_reaches_the_fleet(
    domain: int, caplog: pytest.LogCaptureFixture
) -> None:
    async with connected(domain) as bench, sensors(domain) as teller:
        await teller.repeat(lambda: positioned(bench), "odometry is heard", odometry(1.0, 1.0))
        await teller.repeat(
            lambda: all(
                any(cause in each for each in caplog.messages)
                for cause in ("odometry with an invalid position", "an invalid satellite fix")
            ),
            "what is no number is heard",
            odometry(NAN, NAN, forward=NAN),
            fix(NAN, NAN),
        )
        told = len(bench.states)
        await until(lambda: len(bench.states) > told + 2, "states go on")
        posed = [s for s in bench.states if isinstance(s, VehicleState) and s.position]
        assert posed
        for state in posed:
            numbers = (state.position.latitude_deg, *state.velocity_enu_m_s, state.yaw_rad)
            assert all(map(math.isfinite, numbers))


async def test_a_detection_is_where_it_says_or_else_where_its_vehicle_is(
    domain: int, caplog: pytest.LogCaptureFixture
) -> None:
    geographic = {
        "position_kind": 1,
        "position_geographic": {"latitude_deg": 38.2, "longitude_deg": -77.4, "altitude_m": 5.0},
    }
    local = {"position_kind": 2, "position_local": {"x": 10.0, "y": 20.0}}
    on_map = {**local, "header": {"frame_id": "map"}}
    on_arm = {**local, "header": {"frame_id": "arm"}}
    off_earth = {"position_kind": 1, "position_geographic": {"latitude_deg": NAN}}
    # An int for a float, which rclpy 7.1.6 (Jazzy) sends as 4.94066e-324.
    by_int = {"position_kind": 2, "position_local": {"x": 10.0, "y": 20}}
    async with (
        connected(domain, {GPR: {"topic": "detections"}}) as bench,
        sensors(domain) as teller,
    ):
        early = [detection("early")] * (WAITING + 1)
        await teller.repeat(
            lambda: any("the vehicle's position is not known" in each for each in caplog.messages),
            "as many wait for a position as can",
            *early,
        )
        assert found(bench) == []
        await teller.repeat(lambda: found(bench), "it waited for a position", odometry(0.0, 0.0))
        await teller.say(
            detection("here", source="evsg1/gpr"),
            detection("there", source="gpr", **geographic),
            detection("near", **on_map),
            detection("arm", **on_arm),
            detection("lost", **off_earth),
            detection("int", **by_int),
            detection("", source="evsg1/gpr"),
            detection("x" * 1000),
            detection("others", source="evsg1/magnetometer"),
            detection("last"),
        )
        await until(lambda: found(bench)[-1].type == "last", "all were heard")
        where = {d.type: d.position for d in found(bench)}
        assert list(where) == ["early", "here", "there", "near", "arm", "lost", "int", "last"]
        own = pytest.approx(ORIGIN, abs=1e-6)
        for type_ in ("early", "here", "arm", "lost", "int", "last"):
            at_ = where[type_]
            assert (at_.latitude_deg, at_.longitude_deg, at_.altitude_m) == own
        assert where["there"] == GeoPosition(38.2, -77.4, 5.0)
        assert where["near"].latitude_deg == pytest.approx(at(10.0, 20.0).position[0], abs=1e-7)
        assert {d.source for d in found(bench)} == {GPR}


async def test_a_detector_that_publishes_words_completes_the_service_detector(domain: int) -> None:
    payload = {GPR: {"topic": "words", "message": "string", "type": "gpr"}}
    async with connected(domain, payload) as bench, sensors(domain) as teller:
        bus = Bus()
        context = ServiceContext(
            clock=bench.clock, bus=bus, logger=logging.getLogger(__name__), detectors=(GPR,)
        )
        waiting = asyncio.create_task(Detector().run(context, {}, {}))
        await asyncio.sleep(0)
        await teller.repeat(
            lambda: found(bench),
            "the word is heard",
            odometry(0.0, 0.0),
            ("/evsg1/words", {"data": "mine"}),
        )
        for state in bench.states:
            bus.publish(state)
        written = await asyncio.wait_for(waiting, AMPLE_S)
        assert written["detection.type"] == "mine"
        assert written["detection.source"] == "evsg1/gpr"
        assert written["detection.position"] == pytest.approx(list(ORIGIN), abs=1e-6)
        await teller.say(("/evsg1/words", {"data": " "}))
        await until(lambda: found(bench)[-1].type == "gpr", "a word without one, as the fleet says")


async def test_a_burst_of_detections_is_told_whole(domain: int) -> None:
    async with (
        connected(domain, {GPR: {"topic": "detections"}}) as bench,
        sensors(domain) as teller,
    ):
        await teller.repeat(
            lambda: found(bench), "it is heard", odometry(0.0, 0.0), detection("before")
        )
        burst = [f"gpr{n}" for n in range(500)]
        await teller.say(*map(detection, burst))
        await until(lambda: found(bench)[-1].type == burst[-1], "the last is told")
        assert [d.type for d in found(bench) if d.type != "before"] == burst


async def test_a_vehicle_is_shown_its_target_over_its_topic(domain: int) -> None:
    async with sensors(domain) as teller, sensors(domain) as vehicle:
        shown: list[TargetState] = []
        vehicle.ros.subscribe(TargetState, "/evsg1/target", shown.append, qos.TELEMETRY)
        lead = ResourceId("lead")
        state = VehicleState(
            lead, 1_700_000_000_250_000, GeoPosition(38.2, -77.4, 5.0), None, (1.0, 2.0, 0.0)
        )
        settings = read_settings({V: Connection(V, "ground", {"namespace": "/evsg1"})})[V]
        show = TargetPublisher(teller.ros, settings).show
        show(VehicleState(lead, 0))
        while not shown:
            show(state)
            await asyncio.sleep(0.02)
        assert shown[0].vehicle == "lead"
        assert (shown[0].stamp.sec, shown[0].stamp.nanosec) == (1_700_000_000, 250_000_000)
        assert shown[0].position.longitude_deg == -77.4
        assert math.isnan(shown[0].yaw_rad)
        assert (shown[0].velocity.x, shown[0].velocity.y) == (1.0, 2.0)
