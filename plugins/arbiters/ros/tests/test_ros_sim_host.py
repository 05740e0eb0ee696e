"""Simulated vehicles whose node cannot begin, or whose process was not run."""

import asyncio
import time
from typing import Any

import pytest
from m2pem_plugin_ros.pose import Twist
from m2pem_plugin_ros.runtime import RosRuntime
from m2pem_plugin_ros.settings import DriverName, Settings
from m2pem_plugin_ros.simulator import host as hosts
from m2pem_plugin_ros.simulator.simulation import LATE_S, Simulation
from m2pem_plugin_ros.simulator.specification import VehicleSpec
from m2pem_plugin_ros.simulator.vehicle import Vehicle
from ros_sim_watch import until

from m2pem.api import SystemClock


class Stillborn:
    """It fails when it is opened for the first time."""

    born = 0

    async def open(self) -> None:
        Stillborn.born += 1
        if Stillborn.born == 1:
            raise RuntimeError("not today")

    async def close(self) -> None:
        return None


async def test_a_node_that_failed_to_begin_can_be_begun_again(
    ros_domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    def make(_: Any) -> Stillborn:
        return Stillborn()

    monkeypatch.setattr(hosts, "make_onboard_control", make)
    async with RosRuntime("hosting", domain_id=ros_domain) as ros:
        simulated = hosts.SimulatedVehicle(
            ros, Vehicle(VehicleSpec("ugv1", Settings("/ugv1"))), SystemClock()
        )
        nodes = lambda: {name for name, _ in ros.node.get_node_names_and_namespaces()}  # noqa: E731
        with pytest.raises(RuntimeError, match="not today"):
            await simulated.open()
        assert nodes() == {"hosting", "base"}
        simulated.start()
        await until(lambda: nodes() == {"hosting", "base", "m2pem_node"})
        simulated.kill()
        await until(lambda: nodes() == {"hosting"})
        await simulated.close()


async def test_for_a_process_that_was_not_run_no_time_has_passed(ros_domain: int) -> None:
    spec, speed = VehicleSpec("ugv1", Settings("/ugv1", driver=DriverName.BASE)), 20.0
    async with Simulation([spec], speed=speed, domain_id=ros_domain) as simulation:
        vehicle = simulation["ugv1"].vehicle

        def drives() -> bool:
            vehicle.command(Twist(1.0))
            return vehicle.body.twist.forward_m_s > 0.9

        await until(drives)
        before_s = vehicle.now_s
        time.sleep(1.5)  # noqa: ASYNC251  # it stands for a busy computer
        await asyncio.sleep(0)
        await until(lambda: vehicle.now_s > before_s)
        assert vehicle.now_s - before_s < 3 * LATE_S * speed
        assert vehicle.body.twist.forward_m_s > 0.9, "it does not stop for want of commands"
