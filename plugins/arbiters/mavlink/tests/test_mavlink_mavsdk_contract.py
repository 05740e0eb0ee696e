"""The contract of arbiters with `driver: mavsdk`, against simulated autopilots over real UDP."""

import asyncio
from typing import ClassVar

import pytest
import test_mavlink_contract_udp as over_udp
from m2pem_plugin_mavlink.arbiter import MavlinkArbiter
from mavlink_mavsdk_world import native_threads, threads_fall_to
from mavlink_simulated import MAVSDK_SPEED, connections

from m2pem.api.clock import SystemClock


class _Mavsdk:
    unsupported: ClassVar = {"virtual clock": "threads of MAVSDK wait for real time to pass"}
    speed = MAVSDK_SPEED

    def play(self, main) -> None:
        asyncio.run(main(SystemClock(self.speed)))

    @pytest.fixture(autouse=True)
    def nothing_is_left_of_mavsdk(self, simulator):
        before = native_threads()
        yield
        assert threads_fall_to(before)

    @pytest.fixture
    def make_arbiter(self, simulator):
        return lambda context: MavlinkArbiter(connections(simulator, "mavsdk"), context)


class TestMavsdkRovers(_Mavsdk, over_udp.TestSimulatedRovers):
    """`quick`: what MAVSDK could do in another way than our own link."""

    quick: ClassVar = {
        "test_a_behavior_that_preempts_takes_the_vehicle_over",
        "test_a_cut_link_is_lost_within_the_declared_bound",
        "test_a_second_start_has_one_physical_effect",
        "test_accepted_comes_before_running_and_one_terminal_report_last",
        "test_another_arbiter_finds_the_behavior_again",
        "test_cancel_ends_a_behavior_within_the_declared_bound",
        "test_hold_stops_the_vehicle_within_the_declared_bound",
        "test_nothing_leaks_after_close",
        "test_resume_goes_on_with_the_behavior",
        "test_two_vehicles_do_not_mix",
    }


@pytest.mark.long
class TestMavsdkCopters(_Mavsdk, over_udp.TestSimulatedCopters):
    pass


@pytest.mark.long
class TestMavsdkPx4Copters(_Mavsdk, over_udp.TestSimulatedCopters):
    firmware = "px4"
