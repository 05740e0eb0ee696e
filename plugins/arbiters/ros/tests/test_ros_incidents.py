"""Incidents of a ROS vehicle: a plain base stands until an operator has decided, and drives on."""

from pathlib import Path

from m2pem_plugin_ros.frames import to_geodetic
from m2pem_plugin_ros.runtime import RosRuntime
from m2pem_plugin_ros.testing import Peer
from test_ros_plain_vehicles import ORIGIN, PEER, Truth, until

from m2pem.api import RunStatus
from m2pem.api.clock import SystemClock
from m2pem.executive.executive import Executive
from m2pem.fleet.fleet_file import load_fleet
from m2pem.journal import MemoryJournal
from m2pem.plugins import PluginManager
from m2pem.testing import scenarios

FLEET = """
version: 1
name: test
origin: {{lat: 38.1075, lon: -77.3192, alt: 60.0}}
on_error: incident
vehicles:
  ugv1:
    domain: ground
    arbiter: ros
    sitl: true
    connection: {{namespace: /ugv1, domain_id: {domain}, driver: base}}
"""


async def test_a_base_stands_with_an_incident_and_drives_after_a_retry(
    ros_domain: int, tmp_path: Path
) -> None:
    file = tmp_path / "fleet.yaml"
    file.write_text(FLEET.format(domain=ros_domain))
    place = to_geodetic(500.0, 0.0, 0.0, ORIGIN)
    target = f"[{place.latitude_deg}, {place.longitude_deg}]"
    drive = scenarios.one_behavior("goto", "ugv1", target=target, speed="${speed}")
    with Peer(PEER, ros_domain, ["/ugv1", "base", "map"]):
        async with (
            RosRuntime("incidents", domain_id=ros_domain) as ros,
            Executive(
                load_fleet(file), MemoryJournal(), PluginManager(), SystemClock()
            ) as executive,
        ):
            control, truth = executive.control, Truth(ros)

            async def until_incident(code: str) -> None:
                async def found() -> bool:
                    return any(each.code == code for each in await control.incidents())

                while not await found():
                    await SystemClock().sleep(0.02)

            run = await control.start(drive, data={"speed": "fast"})
            await until_incident("REJECTED")
            await control.resolve_incident(run, "i1", "set_data", data={"speed": 1}, by="anna")
            await control.resolve_incident(run, "i1", "retry", by="anna")
            await until(lambda: truth.speed() > 0.3)
            await control.take("ugv1", by="anna")
            await until_incident("TAKEN_OVER")
            await until(lambda: truth.speed() == 0.0)
            await control.give_back("ugv1", by="anna")
            assert (await control.holders())["ugv1"] == f"{run}.i2"
            await control.resolve_incident(run, "i2", "retry", by="anna")
            await until(lambda: truth.speed() > 0.3)
            await control.stop(run, by="anna")
            await until(lambda: truth.speed() == 0.0)
            assert (await control.wait(run)).status is RunStatus.STOPPED
