"""Two MAVLink rovers at a host, as both ends know them."""

from functools import partial

from m2pem.api import Connection, CutOffPolicy, Host, HostedArbiter, ResourceId
from m2pem.plugins import PluginManager

A, B = ResourceId("v1"), ResourceId("v2")
NUMBERS = {A: 1, B: 2}
AT_HOME = (47.397742, 8.545594)


def hosted_rovers(port: int, first_udp_port: int) -> HostedArbiter:
    """Two rovers, which listen at this UDP port and the next one of their host."""
    connections = {
        vehicle: Connection(
            vehicle,
            "ground",
            {"url": f"udpout://127.0.0.1:{first_udp_port + place}", "system_id": number},
            lost_after_s=40.0,
        )
        for place, (vehicle, number) in enumerate(NUMBERS.items())
    }
    host = Host("pi", (f"tcp/127.0.0.1:{port}",), telemetry_hz=50.0)
    make = partial(PluginManager().arbiter("mavlink"), connections)
    policies = dict.fromkeys(connections, CutOffPolicy())
    return HostedArbiter("fleet", host, "mavlink", connections, policies, make)
