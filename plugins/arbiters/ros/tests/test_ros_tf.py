"""Poses by tf, and in frames other than `map`, over real DDS."""

import math
from collections.abc import AsyncIterator, Iterator
from dataclasses import replace
from typing import Any
from unittest.mock import Mock
from uuid import uuid4

import pytest
from m2pem_plugin_ros.arbiter import RosArbiter
from m2pem_plugin_ros.drivers.driver import DriverSetup, make_driver
from m2pem_plugin_ros.frames import to_geodetic, to_local
from m2pem_plugin_ros.pose import Pose
from m2pem_plugin_ros.runtime import RosRuntime
from m2pem_plugin_ros.sensors.localization import TopicLocalization
from m2pem_plugin_ros.settings import DriverName, OdomFrame, Settings, read_settings
from m2pem_plugin_ros.simulator.simulation import Simulation
from m2pem_plugin_ros.simulator.specification import VehicleSpec
from m2pem_plugin_ros.testing import Peer, reserved_domain
from ros_double import ORIGIN, at
from ros_sensors import (
    AMPLE_S,
    GPR,
    PEER,
    TOPICS,
    Sensors,
    V,
    connected,
    odometry,
    sensors,
    transform,
    until,
)

from m2pem.api import BehaviorRequest, BehaviorState, Connection, PayloadState, Point, ResourceId
from m2pem.api.clock import SystemClock
from m2pem.testing.contracts.arbiter_harness import ArbiterHarness, context

ODOM, BASE = "rover1/odom", "rover1/base_link"
QUARTER = math.pi / 2
MOUNTED = transform("map", ODOM, 100.0, 50.0, QUARTER, topic="/tf_static")


@pytest.fixture
def domain() -> Iterator[int]:
    with reserved_domain() as domain, Peer(PEER, domain, TOPICS):
        yield domain


@pytest.fixture
async def ros(domain: int) -> AsyncIterator[RosRuntime]:
    async with RosRuntime("tested", domain_id=domain) as ros:
        yield ros


@pytest.fixture
def teller(ros: RosRuntime) -> Sensors:
    return Sensors(ros)


def localization(ros: RosRuntime, **settings: Any) -> TopicLocalization:
    return TopicLocalization(ros, V, Settings("/evsg1", **settings), context(SystemClock()))


async def test_odometry_in_another_frame_is_refused_by_name_until_tf_tells_where_that_is(
    ros: RosRuntime, teller: Sensors
) -> None:
    where = localization(ros)
    await teller.say(odometry(3.0, 4.0, stamp=10, frame=ODOM))
    await until(lambda: where.wrong_frame, "odometry is heard")
    assert where.pose is None
    assert where.wrong_frame.startswith(
        "odometry of evsg1 on /evsg1/odom is in 'rover1/odom'; no transform from 'map' to"
        " 'rover1/odom' was received on /tf"
    )
    assert where.age_s == math.inf

    await teller.say(MOUNTED)
    await teller.repeat(
        lambda: where.pose, "it is where tf says", odometry(3.0, 4.0, yaw=1.0, frame=ODOM)
    )
    expected = Pose(pytest.approx(96.0), pytest.approx(53.0), pytest.approx(1.0 + QUARTER))
    assert where.pose == expected
    assert where.wrong_frame == ""


async def test_odometry_is_put_where_its_frame_was_at_its_time(
    ros: RosRuntime, teller: Sensors
) -> None:
    where = localization(ros)
    await teller.say(odometry(0.0, 0.0, stamp=9, frame=ODOM))
    await teller.say(
        transform("map", ODOM, 100.0, 0.0, stamp=10), transform("map", ODOM, 104.0, 2.0, stamp=12)
    )
    await teller.say(odometry(1.0, 0.0, stamp=11, frame=ODOM))
    await until(lambda: where.pose, "it is heard")
    assert where.pose == Pose(pytest.approx(103.0), pytest.approx(1.0), 0.0)
    await teller.say(odometry(2.0, 0.0, stamp=20, frame=ODOM))
    await until(lambda: where.wrong_frame, "it is heard")
    assert "the last transform from 'map' to 'rover1/odom' is 8.0 s older" in where.wrong_frame
    assert where.pose.east_m == pytest.approx(103.0), "it is not moved by what cannot be placed"


async def test_a_pose_from_tf_is_that_of_the_frame_of_its_odometry(
    ros: RosRuntime, teller: Sensors
) -> None:
    where = localization(ros, odom_frame=OdomFrame.TF)
    assert "no transform from 'map' to 'base_link' was received on /tf" in where.wrong_frame
    assert where.problems == ("no odometry yet on /evsg1/odom, for the speed",)
    await teller.say(MOUNTED, transform(ODOM, BASE, 3.0, 4.0, 1.0, stamp=10))
    await teller.say(odometry(7.0, 7.0, forward=1.5, frame="anything", child=BASE))
    await until(lambda: where.pose, "both are heard")
    expected = Pose(pytest.approx(96.0), pytest.approx(53.0), pytest.approx(1.0 + QUARTER))
    assert where.pose == expected
    assert where.twist.forward_m_s == 1.5
    assert (where.wrong_frame, where.problems) == ("", ())
    before = where.changes
    await teller.say(transform(ODOM, BASE, 5.0, 4.0, 1.0, stamp=11))
    await until(lambda: where.pose.north_m > 54.0, "it has moved")
    assert where.changes > before
    assert where.age_s < 20.0


async def test_two_parents_are_refused_by_name(ros: RosRuntime, teller: Sensors) -> None:
    where = localization(ros, odom_frame=OdomFrame.TF, base_frame=BASE)
    await teller.repeat(
        lambda: "'rover1/base_link' on /tf has two parents, 'map' and" in where.wrong_frame,
        "both are heard",
        MOUNTED,
        transform(ODOM, BASE, 1.0, 0.0, stamp=10),
        transform("map", BASE, 9.0, 0.0, stamp=10),
    )


async def test_a_detection_in_a_frame_of_tf_is_on_the_map(
    domain: int, caplog: pytest.LogCaptureFixture
) -> None:
    def detection(type_: str, frame: str):
        local = {"position_kind": 2, "position_local": {"x": 10.0, "y": 0.0}}
        header = {"frame_id": frame}
        return ("/evsg1/detections", {"type": type_, "header": header, **local})

    def found(bench: Any) -> dict[str, Any]:
        states = [s for s in bench.states if isinstance(s, PayloadState)]
        return {d.type: d.position for s in states for d in s.detections}

    payload = {GPR: {"topic": "detections"}}
    async with connected(domain, payload) as bench, sensors(domain) as teller:
        await teller.repeat(
            lambda: "lost" in found(bench),
            "a detection is heard",
            odometry(0.0, 0.0),
            detection("lost", "rover1/lidar"),
        )
        assert "'rover1/lidar': no transform from 'map' to 'rover1/lidar'" in caplog.text
        await teller.say(MOUNTED)
        await teller.repeat(
            lambda: (
                (placed := found(bench).get("near")) is not None
                and placed.latitude_deg == pytest.approx(at(100.0, 60.0).position[0], abs=1e-7)
            ),
            "it is where tf says",
            detection("near", ODOM),
        )


async def test_a_base_whose_pose_is_from_tf_drives_to_where_it_is_sent(ros_domain: int) -> None:
    settings = Settings("/ugv1", driver=DriverName.BASE, odom_frame=OdomFrame.TF)
    spec = VehicleSpec("ugv1", settings, origin=ORIGIN, start=Pose(30.0, -20.0, 1.0))
    own = {"namespace": "/ugv1", "domain_id": ros_domain, "driver": "base", "odom_frame": "tf"}
    ugv1 = ResourceId("ugv1")
    lent = replace(context(SystemClock()), origin=ORIGIN, journal=uuid4())
    arbiter = RosArbiter({ugv1: Connection(ugv1, "ground", own, sitl=True)}, lent)
    async with (
        Simulation([spec], domain_id=ros_domain) as simulation,
        ArbiterHarness(arbiter, SystemClock()) as bench,
    ):
        east_m, north_m = 34.0, -20.0
        target = to_geodetic(east_m, north_m, 0.0, ORIGIN)
        place = Point((target.latitude_deg, target.longitude_deg, None))
        await bench.start("r1.b1", "goto", ugv1, target=place)
        assert (await bench.ended("r1.b1", AMPLE_S)).state is BehaviorState.SUCCEEDED
        body = simulation["ugv1"].vehicle.body
        assert math.dist((body.pose.east_m, body.pose.north_m), (east_m, north_m)) < 1.0
        told = bench.latest(ugv1).position
        assert to_local(told, ORIGIN)[:2] == pytest.approx((east_m, north_m), abs=1.5)


async def test_an_onboard_driver_refuses_with_the_frame(ros_domain: int) -> None:
    """The node on board has no arbiter: its driver says it."""
    own = {"namespace": "/ugv1", "domain_id": ros_domain, "driver": "base", "odom_frame": "tf"}
    ugv1 = ResourceId("ugv1")
    connection = Connection(ugv1, "ground", own, sitl=True)
    settings = read_settings({ugv1: connection})[ugv1]
    lent = replace(context(SystemClock()), origin=ORIGIN)
    async with RosRuntime("onboard", domain_id=ros_domain) as ros:
        where = TopicLocalization(ros, ugv1, settings, lent)
        driver = make_driver(DriverSetup(connection, settings, lent, ros, where, Mock()))
        target = to_geodetic(5.0, 0.0, 0.0, ORIGIN)
        place = Point((target.latitude_deg, target.longitude_deg, None))
        request = BehaviorRequest("r1.b1", 1, "goto", {"target": place}, (ugv1,))
        says = "ugv1: its pose is not known: no transform from 'map' to 'base_link' was received"
        assert driver.refusal(request).startswith(says)
        assert driver.health.not_ready_reasons[0].startswith(says)
