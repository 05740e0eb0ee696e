"""Teams of rovers over MAVLink: simulated autopilots of ArduPilot and PX4, over real UDP."""

import asyncio
from pathlib import Path

import mavlink_rover_teams as rovers
import pytest
from m2pem_plugin_mavlink.simulator.geometry import Location
from m2pem_plugin_mavlink.simulator.simulator import Simulator
from m2pem_plugin_mavlink.simulator.specification import Kind, VehicleSpec
from mavlink_simulated import HOME, HOME_ALTITUDE_M, at

from m2pem.api import Clock, LocalFrame, RunStatus
from m2pem.engine.records import BehaviorEnded
from m2pem.executive.executive import Executive
from m2pem.journal import MemoryJournal
from m2pem.plugins import PluginManager
from m2pem.testing.loopback import run_on_loopback

SPEED = 5.0

pytestmark = pytest.mark.parametrize("firmware", ["ardupilot", "px4"])


class Drive:
    """A team that is driven to its end. `lost_at_m`: where the link of the second rover is cut,
    east of the first one's start."""

    def __init__(
        self, folder: Path, firmware: str, team: str, lost_at_m: float | None = None
    ) -> None:
        self.tracks: dict[str, list[tuple[float, float, float]]] = {
            each: [] for each in rovers.NAMES
        }
        self._lost_at_m = lost_at_m
        self._over = False
        self._frame = LocalFrame(HOME)
        self._specs = [
            VehicleSpec(
                Kind.ROVER,
                number,
                Location(*at(*place), HOME_ALTITUDE_M),
                firmware=firmware,
                estimator_s=1.0,
            )
            for number, place in enumerate(rovers.STARTS.values(), 1)
        ]
        self._folder, self._team = folder, team
        self.ended: BehaviorEnded = run_on_loopback(self._drive, SPEED)

    async def _drive(self, clock: Clock) -> BehaviorEnded:
        async with Simulator(self._specs, speed=SPEED, to=None) as simulator:
            for vehicle in simulator:
                for each in rovers.HOLDS[vehicle.autopilot.spec.firmware].items():
                    vehicle.autopilot.parameters.__setitem__(*each)
            urls = [
                f"udpout://{host}:{port}" for host, port in (each.address for each in simulator)
            ]
            fleet = rovers.write_fleet(self._folder, dict(zip(rovers.NAMES, urls, strict=True)))
            executive = Executive(fleet, MemoryJournal(), PluginManager(), clock, speed=SPEED)
            async with executive:
                looking = asyncio.create_task(simulator.until(lambda: self._look(simulator)))
                run = await executive.control.start(rovers.drives(self._team))
                result = await executive.control.wait(run)
                self._over = True
                await looking
                assert result.status is RunStatus.COMPLETED, result
                records = [each.record for each in await executive.control.records(run)]
                (ended,) = (each for each in records if isinstance(each, BehaviorEnded))
                return ended

    def _look(self, simulator: Simulator) -> bool:
        for track, vehicle in zip(self.tracks.values(), simulator, strict=True):
            where = vehicle.location
            place = self._frame.to_local((where.latitude_deg, where.longitude_deg))
            track.append((simulator.now_s, *place))
        if self._lost_at_m is not None and self.tracks[rovers.NAMES[1]][-1][1] < self._lost_at_m:
            simulator[2].faults.cut_link()
        return self._over


@pytest.mark.parametrize("team", rovers.TEAMS)
def test_members_keep_apart(tmp_path: Path, firmware: str, team: str) -> None:
    rovers.check(team, Drive(tmp_path, firmware, team).tracks)


def test_the_others_pass_a_lost_member_that_stops_by_its_own_failsafe(
    tmp_path: Path, firmware: str
) -> None:
    drive = Drive(tmp_path, firmware, "column", lost_at_m=-40.0)
    assert drive.ended.reason.startswith("without rover2 (LINK_LOST"), drive.ended
    rovers.check_lost("column", drive.tracks)
