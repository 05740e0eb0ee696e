"""The contract of arbiters with `driver: mavsdk`, against simulated autopilots over real UDP."""

import pytest
import test_mavlink_contract_udp as over_udp
from m2pem_plugin_mavlink.arbiter import MavlinkArbiter
from mavlink_mavsdk_world import native_threads, threads_fall_to
from mavlink_simulated import connections


class _Mavsdk:
    @pytest.fixture(autouse=True)
    def nothing_is_left_of_mavsdk(self, simulator):
        before = native_threads()
        yield
        assert threads_fall_to(before)

    @pytest.fixture
    def make_arbiter(self, simulator):
        return lambda context: MavlinkArbiter(connections(simulator, "mavsdk"), context)


class TestMavsdkRovers(_Mavsdk, over_udp.TestSimulatedRovers):
    pass


@pytest.mark.long
class TestMavsdkCopters(_Mavsdk, over_udp.TestSimulatedCopters):
    pass


@pytest.mark.long
class TestMavsdkPx4Copters(_Mavsdk, over_udp.TestSimulatedCopters):
    firmware = "px4"
