"""The contract of arbiters with `driver: mavsdk`, against simulated autopilots over real UDP."""

import pytest
from m2pem_plugin_mavlink.arbiter import MavlinkArbiter
from mavlink_mavsdk_world import native_threads, threads_fall_to
from test_mavlink_contract_udp import A, B, _Simulated

from m2pem.api import Connection


class TestMavsdkRovers(_Simulated):
    @pytest.fixture(autouse=True)
    def nothing_is_left_of_mavsdk(self, simulator):
        before = native_threads()
        yield
        assert threads_fall_to(before)

    @pytest.fixture
    def make_arbiter(self, simulator):
        def make(context):
            connections = {}
            for resource, number in ((A, 1), (B, 2)):
                host, port = simulator[number].address
                settings = {
                    "driver": "mavsdk",
                    "url": f"udpout://{host}:{port}",
                    "system_id": number,
                }
                connections[resource] = Connection(resource, self.domain, settings)
            return MavlinkArbiter(connections, context)

        return make
