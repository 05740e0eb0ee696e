"""How the arbiter connects: in which domains, over which networks, and what it leaves behind."""

import logging
import threading

import pytest
from m2pem_plugin_ros import connections
from m2pem_plugin_ros.connections import ConnectionsSetup
from m2pem_plugin_ros.installation import RosError
from m2pem_plugin_ros.settings import DetectorMessage, DetectorSettings, Settings
from m2pem_plugin_ros.testing import reserved_domain

from m2pem.api import ArbiterContext, Connection, ResourceId
from m2pem.api.clock import SystemClock
from m2pem.telemetry.bus import Bus

A, B, GPR = ResourceId("a"), ResourceId("b"), ResourceId("b/gpr")


def installation(domains: dict[ResourceId, int | None], *, sitl: bool = True) -> ConnectionsSetup:
    context = ArbiterContext(SystemClock(), Bus(), logging.getLogger(), (38.1, -77.3, 60.0))
    connections = {each: Connection(each, "ground", sitl=sitl) for each in (*domains, GPR)}
    vehicles = {each: Settings(f"/{each}", domain) for each, domain in domains.items()}
    gpr = DetectorSettings("/b", "/b/words", domains[A], "gpr", DetectorMessage.STRING)
    return ConnectionsSetup(connections, vehicles, {GPR: gpr}, context, lambda _: None)


def ros_threads() -> list[str]:
    return [each.name for each in threading.enumerate() if each.name.startswith("ros-")]


@pytest.mark.parametrize(("sitl", "kept"), [(True, 1), (False, 0)])
async def test_a_fleet_that_is_all_simulated_stays_on_this_machine(
    ros_domain: int, monkeypatch: pytest.MonkeyPatch, sitl: bool, kept: int
) -> None:
    calls: list[str] = []
    monkeypatch.setattr(connections.loopback, "keep_on_loopback", lambda: calls.append("kept"))
    made = connections.DdsConnections(installation({A: ros_domain}, sitl=sitl))
    await made.open()
    await made.close()
    assert len(calls) == kept


async def test_vehicles_of_one_domain_share_a_connection(
    ros_domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", str(ros_domain))
    with reserved_domain() as other:
        known = installation({A: None, B: ros_domain, ResourceId("c"): other})
        made = connections.DdsConnections(known)
        vehicles = await made.open()
        assert vehicles[A].ros is vehicles[B].ros
        assert vehicles[ResourceId("c")].ros is not vehicles[A].ros
        node = vehicles[A].ros.node
        assert node.get_name() == f"m2pem_{known.context.journal.hex[:8]}"
        assert node.count_subscribers("/diagnostics") == 1
        await made.close()
        await made.close()
    assert ros_threads() == []


async def test_what_cannot_be_opened_leaves_nothing_behind(
    ros_domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise RosError("no such thing")

    monkeypatch.setattr(connections, "DetectorTopic", fail)
    with pytest.raises(RosError, match="no such thing"):
        await connections.DdsConnections(installation({A: ros_domain})).open()
    assert ros_threads() == []
