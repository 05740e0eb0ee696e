"""Teams of three real ArduRovers, each in its own program, and one within a fence with a hole:
judged by what the rovers say of themselves to another ground station, which commands nothing."""

import asyncio
import math
import threading
import time
from collections.abc import Awaitable, Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import mavlink_rover_teams as rovers
import mavlink_sitl as sitl
import pytest
import shapely
from m2pem_plugin_mavlink.simulator.specification import Kind
from m2pem_plugin_mavlink.sitl.launch import Program, Start, ardupilot_launch
from m2pem_plugin_mavlink.sitl.programs import FRAMES, ardupilot_program
from mavlink_simulated import HOME, HOME_ALTITUDE_M, at
from mavlink_station import Station
from mavlink_wires import UdpWire

from m2pem.api import LocalFrame, MissionControl, SystemClock
from m2pem.engine.records import BehaviorEnded
from m2pem.errors import MissionError
from m2pem.executive.executive import Executive
from m2pem.fleet.fleet import Fleet
from m2pem.journal import MemoryJournal
from m2pem.plugins import PluginManager
from m2pem.testing import scenarios

pytestmark = [pytest.mark.timeout(600), pytest.mark.sitl("M2PEM_ARDUROVER")]

SPEED = 5.0
NEARER_M = 4.5
"""The rover whose program is killed is at rest at once; the one behind it needs 4 m to stop, and
2 m as it turns back forwards."""


class Rovers:
    """The programs, and where each rover was, in s of its speed's clock."""

    def __init__(self, folder: Path, started: ExitStack, names: Sequence[str]) -> None:
        binary = sitl.program("M2PEM_ARDUROVER")
        assert binary is not None
        self.tracks: dict[str, list[rovers.Said]] = {each: [] for each in names}
        self.stations: list[Station] = []
        self.urls: dict[str, str] = {}
        self.silent: set[str] = set()
        launches = []
        for number, name in enumerate(names):
            wire, port = UdpWire(Kind.ROVER, "ardupilot"), sitl.free_port()
            started.callback(wire.close)
            instance, system = sitl.first_instance(len(names)) + number, number + 1
            launches.append(
                ardupilot_launch(
                    name,
                    ardupilot_program(binary, FRAMES["rover"]),
                    FRAMES["rover"],
                    Start(*at(*rovers.STARTS[name]), HOME_ALTITUDE_M, speed=SPEED),
                    instance=instance,
                    system_id=system,
                    ports=(port, wire.port),
                    parameters=rovers.HOLDS["ardupilot"],
                )
            )
            self.urls[name] = f"udpin://127.0.0.1:{port}"
            self.stations.append(Station(wire, system))
        self.programs: dict[str, Program] = {
            each.name: each for each in started.enter_context(sitl.running(launches, folder))
        }
        for station in self.stations:
            station.beats = False
            station.connect()
        for station in self.stations:
            station.ready()

    def kill(self, name: str) -> None:
        """End a rover's program at once: it says nothing more, and is where it was."""
        self.silent.add(name)
        self.programs[name].process.kill()

    def listen(self, ended: threading.Event) -> None:
        """Note where the rovers are, until it has ended."""
        frame, last = LocalFrame(HOME), dict[str, Any]()
        while not ended.is_set():
            for (name, track), station in zip(self.tracks.items(), self.stations, strict=True):
                if name in self.silent:
                    continue
                station.pump()
                message = station.latest.get("GLOBAL_POSITION_INT")
                if message is not None and message is not last.get(name):
                    last[name] = message
                    place = frame.to_local((message.lat / 1e7, message.lon / 1e7))
                    track.append((time.monotonic() * SPEED, *place))


@contextmanager
def running(folder: Path, names: Sequence[str] = rovers.NAMES) -> Iterator[Rovers]:
    with ExitStack() as started:
        found = Rovers(folder / "rovers", started, names)
        ended = threading.Event()
        thread = threading.Thread(target=found.listen, args=(ended,), daemon=True)
        thread.start()
        started.callback(thread.join)
        started.callback(ended.set)
        yield found


def commanded(fleet: Fleet, story: Callable[[MissionControl], Awaitable[Any]]) -> Any:
    """Return what a story returns that an executive of the fleet is handed to."""

    async def main() -> Any:
        clock = SystemClock(SPEED)
        async with Executive(
            fleet, MemoryJournal(), PluginManager(), clock, speed=SPEED
        ) as executive:
            return await story(executive.control)

    return asyncio.run(main())


async def done(control: MissionControl, mission: bytes) -> BehaviorEnded:
    """Return the last end of a behavior in a mission."""
    run = await control.start(mission)
    await control.wait(run)
    records = [each.record for each in await control.records(run)]
    return [each for each in records if isinstance(each, BehaviorEnded)][-1]


@pytest.mark.parametrize("speed", ["2 m/s", "4 m/s"])
@pytest.mark.parametrize("team", rovers.TEAMS)
def test_members_keep_apart(tmp_path: Path, team: str, speed: str) -> None:
    with running(tmp_path) as found:
        fleet = rovers.write_fleet(tmp_path, found.urls)
        drives = rovers.drives(team, speed)
        ended = commanded(fleet, lambda control: done(control, drives))
        assert ended.state == "SUCCEEDED", ended
    rovers.check(team, found.tracks)


@pytest.mark.parametrize("team", ["column", "wedge"])
def test_the_others_pass_a_lost_member(tmp_path: Path, team: str) -> None:
    with running(tmp_path) as found:

        async def story(control: MissionControl) -> BehaviorEnded:
            over = asyncio.create_task(done(control, rovers.drives(team)))
            while found.tracks["rover2"][-1][1] > -40.0:
                assert not over.done(), over.result()
                await asyncio.sleep(0.02)
            found.kill("rover2")
            return await over

        ended = commanded(rovers.write_fleet(tmp_path, found.urls), story)
        assert ended.reason.startswith("without rover2 (LINK_LOST"), ended
    rovers.check_lost(team, found.tracks, NEARER_M)


POND = shapely.box(-70, -15, -40, 15)
YARD = shapely.box(-150, -60, 30, 60)


def test_a_return_leads_around_a_hole_of_the_fence_and_a_way_out_of_it_is_refused(
    tmp_path: Path,
) -> None:
    def goto(place: rovers.Place) -> tuple[str, Mapping[str, object]]:
        return "goto", {"target": [round(each, 7) for each in at(*place)]}

    def route(*places: rovers.Place) -> bytes:
        return scenarios.one_after_another("rover1", *map(goto, places))

    with running(tmp_path, rovers.NAMES[:1]) as found:
        rings = [[*each.exterior.coords][:-1] for each in (YARD, POND)]
        fleet = rovers.write_fleet(tmp_path, found.urls, rings)

        async def story(control: MissionControl) -> list[BehaviorEnded]:
            went = await done(control, route((-55.0, 40.0), (-110.0, 0.0)))
            with pytest.raises(MissionError, match="250 m outside the fleet's fence"):
                await control.start(route((-400.0, 0.0)))
            home = scenarios.one_behavior("return_to_launch", "rover1")
            return [went, await done(control, home)]

        ends = commanded(fleet, story)
    assert [each.state for each in ends] == ["SUCCEEDED"] * 2, ends
    track = found.tracks["rover1"]
    line = shapely.LineString([each[1:] for each in track])
    assert YARD.covers(line)
    assert not line.intersects(POND.buffer(-rovers.CORNER_M))
    assert math.dist(track[-1][1:], (0.0, 0.0)) < rovers.REACHED_M
