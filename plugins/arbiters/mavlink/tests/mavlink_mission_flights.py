"""Missions on real autopilots that m2pem commands, recorded beside it (`mavlink_tracks.Tap`)."""

import asyncio
import json
import subprocess
import sys
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from m2pem_plugin_mavlink.sitl.fleet import Vehicle, launches, read_vehicles
from m2pem_plugin_mavlink.sitl.launch import running
from m2pem_plugin_mavlink.sitl.readiness import connected, ready
from mavlink_tracks import At, Sample, Tap, Uploaded, east_north, logged_missions

from m2pem import load_fleet
from m2pem.api import Area, Fleet, Point, Route

Record = dict[str, Any]


@dataclass
class Flight:
    """What came of a mission. `records`: those that m2pem printed, each with the time at which it
    came, in seconds as of `tracks`, which are by vehicle."""

    fleet: Fleet
    tracks: Mapping[str, Sequence[Sample]]
    records: list[tuple[float, Record]]
    uploads: Mapping[str, Sequence[Uploaded]]
    status: int = 0
    errors: str = ""
    _ends: dict[str, float] = field(default_factory=dict)

    @property
    def origin(self) -> At:
        """Of the fleet: latitude and longitude."""
        return self.fleet.origin[:2]

    def behaviors(self, name: str) -> Iterator[tuple[Record, float, float]]:
        """Those of a name that have succeeded: what was requested, from when and until when."""
        ends = {
            record["behavior"]: at_s
            for at_s, record in self.records
            if record["record"] == "BehaviorEnded" and record["state"] == "SUCCEEDED"
        }
        for at_s, record in self.records:
            if record["record"] != "BehaviorRequested" or record["name"] != name:
                continue
            if record["behavior"] in ends:
                yield record, at_s, ends[record["behavior"]]

    def between(self, vehicle: str, begin_s: float, end_s: float) -> list[Sample]:
        """Where a vehicle was."""
        return [each for each in self.tracks[vehicle] if begin_s <= each.at_s <= end_s]

    def outline(self, name: str) -> list[At]:
        """The outer ring of an area, the waypoints of a route, or a point."""
        match self.fleet.geometries[name]:
            case Area(rings=rings):
                points = rings[0]
            case Route(waypoints=waypoints):
                points = waypoints
            case Point(position=position):
                points = (position,)
        return [east_north(self.origin, (point[0], point[1])) for point in points]


def fly(
    programs: Path, fleet_file: Path, mission: Path, folder: Path, speed: float, *words: object
) -> Flight:
    """Start the autopilots of a fleet (`programs`: the folder of ArduPilot's), run a mission, and
    record. `words`: for `m2pem run`."""
    fleet = load_fleet(fleet_file)
    tap = Tap(fleet.origin[:2], speed)
    vehicles = [
        replace(each, ports=(*each.ports, tap.port)) for each in read_vehicles(fleet, speed)
    ]
    with ExitStack() as opened:
        opened.enter_context(running(launches(vehicles, programs, None, folder), folder))
        opened.enter_context(tap.recording())
        asyncio.run(_until_ready(vehicles, speed))
        records, status, errors = _run(mission, fleet_file, speed, folder, tap, words)
    by_vehicle = {str(each.resource): each.settings.system_id for each in vehicles}
    return Flight(
        fleet,
        {name: tap.tracks[system] for name, system in by_vehicle.items()},
        records,
        {name: logged_missions(folder / name, fleet.origin[:2]) for name in by_vehicle},
        status,
        errors,
    )


async def _until_ready(vehicles: list[Vehicle], speed: float) -> None:
    async with connected(vehicles, speed) as found:
        await ready(found, lambda text: None)


def _run(
    mission: Path, fleet: Path, speed: float, folder: Path, tap: Tap, words: Sequence[object]
) -> tuple[list[tuple[float, Record]], int, str]:
    command = (
        *(sys.executable, "-m", "m2pem", "run", mission, "--fleet", fleet, "--speed", f"{speed:g}"),
        *("--journal", folder / "journal.db", "--format", "json", "--ocu", "none", *words),
    )
    records: list[tuple[float, Record]] = []
    with subprocess.Popen(
        [str(word) for word in command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        lines: list[str] = []
        reader = threading.Thread(target=lambda: lines.extend(process.stderr or ()))
        reader.start()
        for line in process.stdout:
            records.append((tap.now_s, json.loads(line)))
        reader.join()
    return records, process.returncode, "".join(lines)
