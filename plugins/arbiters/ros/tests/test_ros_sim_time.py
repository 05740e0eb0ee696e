"""`use_sim_time`: what follows /clock, and what never does. /clock is of a plain node of ROS."""

import asyncio
import logging
import re
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

import pytest
from m2pem_interfaces.msg import BehaviorCommand, BehaviorStatus, VehicleStatus
from m2pem_plugin_ros.runtime import RosRuntime, qos
from m2pem_plugin_ros.runtime.clock_watch import ClockWatch
from m2pem_plugin_ros.runtime.ros_clock import RosClock
from m2pem_plugin_ros.settings import DriverName
from m2pem_plugin_ros.simulator.fleet import make_default_vehicles
from m2pem_plugin_ros.simulator.simulation import Simulation
from m2pem_plugin_ros.simulator.specification import FORT
from nav_msgs.msg import Odometry
from ros_node_bench import bench
from ros_node_client import node_client
from rosgraph_msgs.msg import Clock as ClockMessage
from test_ros_onboard_managed import Commander, base, onboard

from m2pem.api import SystemClock

SIM_TIME = ["--ros-args", "-p", "use_sim_time:=true"]
START_S = 1000.0
AMPLE_S = 30.0
TICK_S = 0.01


class SimulatedTime:
    """Publishes /clock with the pace of a simulator."""

    def __init__(self, node: Any, pace: float = 1.0) -> None:
        self.now_s, self.pace = START_S, pace
        self._last_s = time.monotonic()
        self._publisher = node.create_publisher(ClockMessage, "/clock", 10)

    def tick(self) -> None:
        now_s = time.monotonic()
        self.now_s += self.pace * (now_s - self._last_s)
        self._last_s = now_s
        message = ClockMessage()
        message.clock.sec, rest = divmod(round(self.now_s * 1e9), 1_000_000_000)
        message.clock.nanosec = rest
        self._publisher.publish(message)


class Ticking(SimulatedTime):
    """Ticks on the event loop."""

    async def until(self, holds: Callable[[], object]) -> None:
        async with asyncio.timeout(AMPLE_S):
            while not holds():
                self.tick()
                await asyncio.sleep(TICK_S)


@asynccontextmanager
async def two(domain: int) -> AsyncIterator[tuple[RosRuntime, Ticking]]:
    """A runtime, and /clock by another one."""
    async with (
        RosRuntime("tested", domain_id=domain) as ros,
        RosRuntime("simulator", domain_id=domain) as other,
    ):
        yield ros, Ticking(other.node)


async def test_a_clock_follows_and_never_goes_back(ros_domain: int) -> None:
    async with two(ros_domain) as (ros, simulated):
        clock = RosClock(ros)
        jumps: list[float] = []
        clock.on_jump = jumps.append
        assert not clock.began
        assert clock.stands == "use_sim_time is set, and nothing was received on /clock yet"
        early = asyncio.ensure_future(clock.sleep(0.2))
        await simulated.until(lambda: clock.began)
        assert START_S * 1e6 - 1 <= clock.now_us() < (START_S + 0.2) * 1e6 + 1e6
        await simulated.until(early.done)

        simulated.pace = 10.0
        before_us, real_s = clock.now_us(), time.monotonic()
        nap = asyncio.ensure_future(clock.sleep(10.0))
        await simulated.until(nap.done)
        assert clock.now_us() - before_us >= 10e6
        assert time.monotonic() - real_s < 10.0

        simulated.pace = 0.0
        await simulated.until(lambda: abs(clock.now_us() - simulated.now_s * 1e6) <= 1)
        stands_us = clock.now_us()
        await simulated.until(lambda: clock.stands)
        assert clock.stands == "use_sim_time is set, and /clock has stood still for 1 s"
        assert clock.now_us() == stands_us

        simulated.now_s -= 500.0
        await simulated.until(lambda: jumps)
        assert jumps == [pytest.approx(500.0)]
        assert clock.now_us() == stands_us
        simulated.pace = 1.0
        await simulated.until(lambda: clock.now_us() > stands_us + 100_000)
        assert clock.now_us() < stands_us + 400e6
        assert jumps == [pytest.approx(500.0)]


async def test_operators_of_an_executive_hear_how_clock_differs(
    ros_domain: int, caplog: pytest.LogCaptureFixture
) -> None:
    logger = logging.getLogger("m2pem.test.clock")
    caplog.set_level(logging.INFO, logger.name)

    def said(text: str) -> bool:
        return any(text in record.getMessage() for record in caplog.records)

    async with two(ros_domain) as (ros, simulated):
        mission = SystemClock()
        watch = ClockWatch(ros, mission, logger)
        watching = asyncio.create_task(watch.run())
        simulated.pace = 10.0
        await simulated.until(lambda: said("start m2pem with --speed "))
        simulated.pace = 0.0
        await simulated.until(lambda: said("/clock stands still; mission time goes on"))
        before_us = mission.now_us()
        simulated.now_s -= 12.5
        await simulated.until(lambda: said("/clock jumped back 12.500 s; mission time does not"))
        assert 0 <= mission.now_us() - before_us < AMPLE_S * 1e6
        simulated.pace = 1.0
        await simulated.until(lambda: said("/clock goes as fast as mission time"))
        assert len(caplog.records) <= 6
        watching.cancel()


async def test_an_executive_stamps_with_clock_and_waits_by_its_own(
    ros_domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("M2PEM_ROS_ARGS", "-p use_sim_time:=true")
    async with bench(ros_domain, "evsg1") as one:
        monkeypatch.delenv("M2PEM_ROS_ARGS")
        async with RosRuntime("vehicle", domain_id=ros_domain) as other:
            heard: list[BehaviorCommand] = []
            simulated = Ticking(other.node, pace=0.0)
            other.subscribe(BehaviorCommand, "/evsg1/command", heard.append, qos.COMMANDS)
            status = other.node.create_publisher(VehicleStatus, "/evsg1/vehicle_status", qos.STATUS)
            status.publish(VehicleStatus(vehicle="evsg1"))
            await simulated.until(lambda: one.ros.stamp_us(0) == START_S * 1e6)
            began_us = one.clock.now_us()
            one.begin("drive_stop")
            await simulated.until(lambda: len(heard) >= 3)  # repeated, though /clock stands
            assert {each.stamp.sec for each in heard} == {1000}
            assert 0.4e6 < one.clock.now_us() - began_us < AMPLE_S * 1e6


def test_a_node_on_board_stands_with_clock_and_stops_when_it_jumps_back(ros_domain: int) -> None:
    with (
        base(ros_domain),
        onboard(ros_domain, *SIM_TIME),
        node_client("/evsg1/m2pem_onboard", ros_domain) as client,
    ):
        commander = Commander(client)
        commander.start("b1")
        refused = commander.until("b1", BehaviorStatus.REJECTED)
        assert refused.reason == "use_sim_time is set, and nothing was received on /clock yet"

        simulated = SimulatedTime(client.node)
        timer = client.node.create_timer(TICK_S, simulated.tick)
        commander.until_ready()
        assert commander.vehicles[-1].stamp.sec in range(1000, 1100)
        commander.start("b2")
        commander.until("b2", BehaviorStatus.RUNNING)

        simulated.now_s -= 900.0
        ended = commander.until("b2", BehaviorStatus.CANCELLED)
        assert re.fullmatch(r"/clock jumped back (89|90)\d\.\d{3} s", ended.reason)
        client.until(lambda: commander.vehicles[-1].stamp.sec < 300)
        commander.until_ready()
        commander.start("b3")
        commander.until("b3", BehaviorStatus.RUNNING)

        timer.cancel()
        client.until(lambda: "has stood still" in str(commander.vehicles[-1].not_ready_reasons))
        commander.start("b4")
        refused = commander.until("b4", BehaviorStatus.REJECTED)
        assert refused.reason.startswith("use_sim_time is set, and /clock has stood still for")


@pytest.mark.tried_with(
    "rosgraph_msgs, /clock",
    "simulated time of ROS drives simulated vehicles",
    kind="ROS 2",
    result="they move with it",
    version="Jazzy",
)
async def test_simulated_vehicles_move_with_clock(
    ros_domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("M2PEM_ROS_ARGS", "-p use_sim_time:=true")
    origin = (FORT.latitude_deg, FORT.longitude_deg, FORT.altitude_m)
    specs = list(make_default_vehicles(["ground"], DriverName.BASE, origin))
    with pytest.raises(ValueError, match="as fast as /clock: leave --speed out"):
        async with Simulation(specs, domain_id=ros_domain, speed=2.0):
            pass
    async with Simulation(specs, domain_id=ros_domain) as vehicles:
        monkeypatch.delenv("M2PEM_ROS_ARGS")
        async with RosRuntime("simulator", domain_id=ros_domain) as other:
            heard: list[Odometry] = []
            other.subscribe(Odometry, "/ugv1/odom", heard.append, qos.TELEMETRY)
            simulated = Ticking(other.node, pace=10.0)
            await simulated.until(lambda: len(heard) > 30)
            first, last = heard[0].header.stamp, heard[-1].header.stamp
            assert first.sec in range(1000, 1060)
            assert last.sec > first.sec
            assert vehicles["ugv1"].vehicle.position
            simulated.pace = 0.0
            settled = len(heard) + 10
            for _ in range(50):
                simulated.tick()
                await asyncio.sleep(TICK_S)
            assert len(heard) < settled
