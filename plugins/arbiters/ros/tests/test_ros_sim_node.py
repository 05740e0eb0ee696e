"""A simulated vehicle with an m2pem node on board, commanded over DDS as any other."""

import asyncio
import itertools
import json
from collections.abc import AsyncIterator, Callable, Iterator
from typing import Any

import pytest

pytest.importorskip("m2pem_plugin_ros.onboard")
pytest.importorskip("m2pem_plugin_ros.drivers.base")

from m2pem_interfaces.msg import BehaviorCommand, BehaviorStatus, KeyValue, VehicleStatus
from m2pem_plugin_ros.runtime import RosRuntime, qos
from m2pem_plugin_ros.testing import Peer, reserved_domain
from nav_msgs.msg import Odometry
from ros_sim_watch import AMPLE_S, COMMAND, Heard, switch, until
from std_msgs.msg import UInt32

SETTINGS = ["sim", "ros", "--ground", "2", "--speed", "5", "--set", "battery=70 %"]
AGAIN_S = 0.2
QUIET_S = 1.0
"""Real time without a status after which no more lies are to be expected: ten would have come."""

ids = itertools.count(1)


@pytest.fixture(scope="module")
def domain() -> Iterator[int]:
    with reserved_domain() as domain, Peer(COMMAND, domain, SETTINGS):
        yield domain


@pytest.fixture
async def ros(domain: int) -> AsyncIterator[RosRuntime]:
    async with RosRuntime("commanding", domain_id=domain) as ros:
        yield ros


class Vehicle:
    """ugv1 as an executive sees it."""

    def __init__(self, ros: RosRuntime) -> None:
        self._ros = ros
        self._commands = ros.node.create_publisher(BehaviorCommand, "/ugv1/command", qos.COMMANDS)
        self.statuses = Heard(ros, BehaviorStatus, "/ugv1/behavior_status", qos.BEHAVIOR_STATUS)
        self.states = Heard(ros, VehicleStatus, "/ugv1/vehicle_status", qos.STATUS)
        self.odometry = Heard(ros, Odometry, "/ugv1/odom")
        self.motions = Heard(ros, UInt32, "/ugv1/motions", qos.STATUS)

    def of(self, name: str) -> list[int]:
        """The states of a behavior that were heard, in order. What is asked again is answered
        again, with the same number."""
        numbered = [(each.number, each.state) for each in self.statuses.messages if each.id == name]
        return [state for _, state in dict.fromkeys(numbered)]

    def say(self, verb: int, name: str, behavior: str = "", **parameters: object) -> None:
        values = [KeyValue(key=key, value=json.dumps(value)) for key, value in parameters.items()]
        self._commands.publish(
            BehaviorCommand(
                verb=verb, id=name, run="r1", epoch=1, behavior=behavior, parameters=values
            )
        )

    async def insist(self, until_so: Callable[[], Any], *what: Any, **parameters: object) -> None:
        """Say it again and again until something is so, as executives do."""
        async with asyncio.timeout(AMPLE_S):
            while not until_so():
                self.say(*what, **parameters)
                await asyncio.sleep(AGAIN_S)

    async def start(self, behavior: str, **parameters: object) -> str:
        """Start a behavior; its id, once a status of it was heard."""
        name = f"b{next(ids)}"
        heard = lambda: self.of(name)  # noqa: E731
        await self.insist(heard, BehaviorCommand.START, name, behavior, **parameters)
        return name

    async def stop(self, name: str) -> None:
        ended = lambda: self.of(name)[-1] > BehaviorStatus.RUNNING  # noqa: E731
        await self.insist(ended, BehaviorCommand.CANCEL, name)


@pytest.fixture
async def vehicle(ros: RosRuntime) -> Vehicle:
    vehicle = Vehicle(ros)
    await until(lambda: vehicle.states.last and vehicle.odometry.last and vehicle.motions.last)
    await until(lambda: vehicle.states.last.readiness == VehicleStatus.READY)
    return vehicle


def stands(message: Any) -> bool:
    return message.twist.twist.linear.x == 0 == message.twist.twist.angular.z


async def test_a_simulated_vehicle_does_what_it_is_commanded_and_counts_the_motion(
    vehicle: Vehicle,
) -> None:
    await vehicle.odometry.next(stands)
    before, place = vehicle.motions.last.data, vehicle.odometry.last.pose.pose.position.y
    name = await vehicle.start("reverse", distance=3.0)
    await until(lambda: BehaviorStatus.SUCCEEDED in vehicle.of(name))
    assert vehicle.of(name) == [
        BehaviorStatus.ACCEPTED,
        BehaviorStatus.RUNNING,
        BehaviorStatus.SUCCEEDED,
    ]
    reached = await vehicle.odometry.next(stands)
    assert reached.pose.pose.position.y == pytest.approx(place - 3, abs=1.0)
    await until(lambda: vehicle.motions.last.data > before)
    await vehicle.states.next()
    assert vehicle.motions.last.data == before + 1
    assert vehicle.states.last.battery == pytest.approx(0.7, abs=0.01)


async def test_a_simulated_vehicle_refuses_with_the_reason_that_it_was_told(
    vehicle: Vehicle, ros: RosRuntime
) -> None:
    await switch(ros, 'ugv1: refuse "too wet" for 15 s')
    name = await vehicle.start("reverse", distance=1.0)
    refused = next(each for each in vehicle.statuses.messages if each.id == name)
    assert (refused.id, refused.state, refused.reason) == (name, BehaviorStatus.REJECTED, "too wet")
    done: list[int] = []
    while BehaviorStatus.SUCCEEDED not in done:
        name = await vehicle.start("reverse", distance=1.0)
        await until(lambda name=name: vehicle.of(name)[-1] > BehaviorStatus.RUNNING)
        done = vehicle.of(name)


async def test_a_simulated_vehicle_may_miss_new_commands(vehicle: Vehicle, ros: RosRuntime) -> None:
    await switch(ros, "ugv1: never accept for 12 s")
    name = f"b{next(ids)}"
    state = vehicle.states.last
    vehicle.say(BehaviorCommand.START, name, "reverse", distance=1.0)
    await vehicle.states.next(lambda m: m.stamp.sec >= state.stamp.sec + 2)
    assert vehicle.of(name) == []
    said = lambda: vehicle.of(name)  # noqa: E731
    await vehicle.insist(said, BehaviorCommand.START, name, "reverse", distance=1.0)


@pytest.mark.long
async def test_a_simulated_vehicle_may_lie(vehicle: Vehicle, ros: RosRuntime) -> None:
    await switch(ros, "ugv1: lie for 30 s")
    await vehicle.statuses.next(lambda m: m.id.startswith("never-given-"))
    name = await vehicle.start("reverse", distance=1.0)
    await until(lambda: BehaviorStatus.FAILED in vehicle.of(name))
    told = vehicle.of(name)
    assert told.index(BehaviorStatus.SUCCEEDED) < told.index(BehaviorStatus.FAILED)
    await vehicle.statuses.silence(QUIET_S)  # the next test is to find an honest vehicle


@pytest.mark.long
async def test_a_simulated_vehicle_may_flood(vehicle: Vehicle, ros: RosRuntime) -> None:
    before = len(vehicle.statuses)
    await switch(ros, "ugv1: flood 2000 for 15 s")
    await until(lambda: len(vehicle.statuses) > before + 200)
    await vehicle.statuses.silence(QUIET_S)


async def test_its_node_may_die_alone_and_forgets_what_it_did(
    vehicle: Vehicle, ros: RosRuntime
) -> None:
    name = await vehicle.start("teleop")
    await until(lambda: BehaviorStatus.RUNNING in vehicle.of(name))
    await switch(ros, "ugv1: kill node for 20 s")
    await until(lambda: ros.node.count_publishers("/ugv1/vehicle_status") == 0)
    assert ros.node.count_publishers("/ugv1/odom") == 1
    await vehicle.odometry.next(stands)
    assert vehicle.of(name)[-1] == BehaviorStatus.RUNNING  # a power failure says nothing
    await until(lambda: ros.node.count_publishers("/ugv1/vehicle_status") == 1)
    unknown = lambda: vehicle.of(name)[-1] == BehaviorStatus.UNKNOWN  # noqa: E731
    await vehicle.insist(unknown, BehaviorCommand.QUERY, name)
    again = await vehicle.start("reverse", distance=1.0)
    await until(lambda: BehaviorStatus.SUCCEEDED in vehicle.of(again))


@pytest.mark.long
async def test_a_simulated_vehicle_stops_and_gives_up_when_its_odometry_is_no_number(
    vehicle: Vehicle, ros: RosRuntime
) -> None:
    name = await vehicle.start("reverse", distance=30.0)
    await vehicle.odometry.next(lambda m: m.twist.twist.linear.x < -0.5)
    await switch(ros, "ugv1: odometry nan for 40 s")
    await vehicle.odometry.next(lambda m: m.twist.twist.linear.x == 0)
    await until(lambda: BehaviorStatus.LOST in vehicle.of(name))
    ready = await vehicle.states.next(lambda m: m.readiness == VehicleStatus.READY)
    assert ready.behavior == ""
