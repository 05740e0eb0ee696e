"""python -m bench.lost_member [--vehicles mavlink,ros,mavlink] [--arducopter PROGRAM] [--speed 5]

Three vehicles survey an area as a team, each simulated by a process of its own: copters over
MAVLink, ground vehicles over ROS. The second one's process is killed when it has done two fifths of
its band. Prints how much of the area was surveyed, how much
twice, and how long the others took against the least time. Ends with 1 if that is worse than
docs/teams.md says.
"""

import argparse
import asyncio
import json
import os
import socket
import sys
import tempfile
from collections.abc import Sequence
from contextlib import AsyncExitStack, ExitStack, suppress
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

from m2pem_plugin_mavlink.sitl.launch import Start, ardupilot_launch
from m2pem_plugin_mavlink.sitl.programs import FRAMES, ardupilot_program

from bench.coverage import Coverage, Sample, optimum_s
from m2pem import load_fleet
from m2pem.api import LatLon, LocalFrame, SystemClock, VehicleState
from m2pem.executive.executive import Executive
from m2pem.journal import MemoryJournal
from m2pem.plugins import PluginManager

ORIGIN = (38.1075, -77.3192, 60.0)
FRAME = LocalFrame(ORIGIN)
MAVLINK, ROS = "mavlink", "ros"
NAMES = ("one", "two", "three")
LOST = "two"
CUT_SHARE = 0.4
EAST_M, PASSES, WIDTH_M, OVERSHOOT_M = 200.0, 9, 19.5, 8.0
SPEED_M_S = 5.0
READY_S = 180.0
MOST_S = 1200.0
COVERED, TWICE, SLOWER = 0.97, 0.05, 1.15
"""The bounds: of the area, of the area, of the least time."""

TASK = (
    '<scriptTask id="{id}"><extensionElements><m2pem:behavior type="{type}" name="{name}">'
    "<m2pem:properties>{given}</m2pem:properties><m2pem:resources><m2pem:role {role}/>"
    "</m2pem:resources></m2pem:behavior></extensionElements></scriptTask>"
)
MISSION = (
    '<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" '
    'xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="bench">'
    '<process id="P" isExecutable="true"><startEvent id="S"/>{tasks}<endEvent id="E"/>{flows}'
    "</process></definitions>"
)


def mission(kinds: Sequence[str]) -> bytes:
    """Return a mission: all copters take off, and all survey the area."""

    def task(id_: str, type_: str, name: str, role: str, **parameters: str) -> str:
        given = "".join(
            f'<m2pem:property name="{key}" value="{value}"/>' for key, value in parameters.items()
        )
        return TASK.format(id=id_, type=type_, name=name, role=role, given=given)

    tasks = [
        task(f"Up_{name}", "vehicle", "takeoff", f'name="pilot" vehicle="{name}"', altitude="20 m")
        for name in _flying(kinds)
    ]
    tasks.append(
        task(
            "Survey",
            "team",
            "area_survey",
            'name="crew" team="crew"',
            area="field",
            spacing="20 m",
            speed=f"{SPEED_M_S:g} m/s",
            overshoot=f"{OVERSHOOT_M:g} m",
            heading="90 deg",
            altitude="20 m",
        )
    )
    ids = ["S", *(f"Up_{name}" for name in _flying(kinds)), "Survey", "E"]
    flows = "".join(
        f'<sequenceFlow id="to_{after}" sourceRef="{before}" targetRef="{after}"/>'
        for before, after in pairwise(ids)
    )
    return MISSION.format(tasks="".join(tasks), flows=flows).encode()


def _flying(kinds: Sequence[str]) -> list[str]:
    return [name for name, kind in zip(NAMES, kinds, strict=True) if kind == MAVLINK]


def fleet_text(
    kinds: Sequence[str], ports: Sequence[int], homes: Sequence[LatLon], only: str = ""
) -> str:
    """Return the fleet file; `only`: with that vehicle alone."""
    origin = f"origin: {{lat: {ORIGIN[0]}, lon: {ORIGIN[1]}, alt: {ORIGIN[2]:g}}}"
    lines = ["version: 1", "name: bench", origin, "vehicles:"]
    for number, name in enumerate(NAMES, 1):
        if only not in ("", name):
            continue
        kind, home = kinds[number - 1], list(homes[number - 1])
        if kind == MAVLINK:
            url = f"udpin://127.0.0.1:{ports[number - 1]}"
            connection = f'{{url: "{url}", system_id: {number}}}'
        else:
            bounds = f"max_speed: {SPEED_M_S:g} m/s, acceleration: 1.5 m/s2"
            connection = f"{{namespace: /{name}, sim: {{home: {home}, heading: 90 deg, {bounds}}}}}"
        lines += [
            f"  {name}:",
            f"    domain: {'air' if kind == MAVLINK else 'ground'}",
            f"    arbiter: {kind}",
            "    sitl: true",
            f"    connection: {connection}",
            "    lost_after: 10 s",
            f"    cruise_speed: {SPEED_M_S:g} m/s",
        ]
    if not only:
        members = ", ".join(NAMES)
        lines.append(f"teams: {{crew: {{members: [{members}], on_lost_member: continue}}}}")
        lines.append("areas: {field: field.geojson}")
    return "\n".join(lines) + "\n"


def field_text() -> str:
    """Return the area, as GeoJSON."""
    north_m = PASSES * WIDTH_M
    corners = [(0.0, 0.0), (EAST_M, 0.0), (EAST_M, north_m), (0.0, north_m), (0.0, 0.0)]
    ring = [list(FRAME.to_latlon(corner))[::-1] for corner in corners]
    return json.dumps({"type": "Polygon", "coordinates": [ring]})


def free_ports(count: int) -> list[int]:
    """Return UDP ports of 127.0.0.1 that nothing uses now."""
    with ExitStack() as stack:
        sockets = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(count)]
        for each in sockets:
            stack.enter_context(each).bind(("127.0.0.1", 0))
        return [int(each.getsockname()[1]) for each in sockets]


async def start_ros(fleet: Path, speed: float) -> asyncio.subprocess.Process:
    """Start the process of a simulated ground vehicle."""
    command = [sys.executable, "-m", "m2pem", "sim", "ros", "--fleet", str(fleet)]
    return await asyncio.create_subprocess_exec(
        *(*command, "--speed", f"{speed:g}"),
        stdout=asyncio.subprocess.DEVNULL,
        stderr=asyncio.subprocess.DEVNULL,
    )


async def start_copter(
    number: int, port: int, home: LatLon, speed: float, program: Path | None, to: Path
) -> asyncio.subprocess.Process:
    """Start the process of a simulated copter, or of a real ArduCopter."""
    if program is None:
        command = [
            *(sys.executable, "-m", "m2pem", "sim", "mavlink", "--copters", "1"),
            *("--first-system", str(number), "--to", f"udp://127.0.0.1:{port}"),
            *("--speed", f"{speed:g}", "--ekf", "2s", "--home", f"{home[0]},{home[1]},60"),
        ]
        return await asyncio.create_subprocess_exec(
            *command, stdout=asyncio.subprocess.DEVNULL, stderr=asyncio.subprocess.DEVNULL
        )
    launch = ardupilot_launch(
        f"copter{number}",
        ardupilot_program(program, FRAMES["quad"]),
        FRAMES["quad"],
        Start(home[0], home[1], 60.0, 90.0, speed),
        instance=number + 40,
        system_id=number,
        ports=[port],
        parameters={"FS_GCS_ENABLE": 0},
    )
    folder = to / launch.name
    folder.mkdir()
    for name, text in launch.files.items():
        (folder / name).write_text(text, encoding="utf-8")
    return await asyncio.create_subprocess_exec(
        *launch.command,
        cwd=folder,
        stdout=asyncio.subprocess.DEVNULL,
        stderr=asyncio.subprocess.DEVNULL,
    )


@dataclass
class Watch:
    """Where the vehicles were, by their own positions, from their first pass on."""

    clock: SystemClock
    tracks: dict[str, list[Sample]] = field(default_factory=dict)
    ready: set[str] = field(default_factory=set)

    async def listen(self, executive: Executive) -> None:
        async for state in executive.bus.subscribe():
            if isinstance(state, VehicleState) and state.position is not None:
                if state.ready is not False or state.armed:
                    self.ready.add(state.resource)
                place = FRAME.to_local(state.position.latlon)
                track = self.tracks.setdefault(state.resource, [])
                track.append((state.time_us / 1e6, *place))

    def surveyed_m(self, name: str) -> float:
        """How much of the passes it has surveyed."""
        coverage = Coverage(EAST_M, PASSES * WIDTH_M, WIDTH_M)
        return coverage.add(self.tracks.get(name, ()))

    def began_s(self, name: str) -> float:
        """When it entered the area for the first time."""
        return next(t for t, east, north in self.tracks[name] if _inside(east, north))

    def ended_s(self, name: str) -> float:
        """When it was in the area for the last time."""
        return [t for t, east, north in self.tracks[name] if _inside(east, north)][-1]


def _inside(east_m: float, north_m: float) -> bool:
    return 0 < east_m < EAST_M and 0 < north_m < PASSES * WIDTH_M


async def measure(kinds: Sequence[str], program: Path | None, speed: float) -> bool:
    """Run the survey and print the figures. Return whether they are within the bounds."""
    homes = [FRAME.to_latlon((-20.0, 58.5 * index + 10.0)) for index in range(3)]
    async with AsyncExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        ports = free_ports(3)
        (folder / "field.geojson").write_text(field_text(), encoding="utf-8")
        (folder / "fleet.yaml").write_text(fleet_text(kinds, ports, homes), encoding="utf-8")
        fleet = load_fleet(folder / "fleet.yaml")
        vehicles = {}
        for number, (name, kind) in enumerate(zip(NAMES, kinds, strict=True), 1):
            port, home = ports[number - 1], homes[number - 1]
            if kind == MAVLINK:
                process = await start_copter(number, port, home, speed, program, folder)
            else:
                own = folder / f"{name}.yaml"
                own.write_text(fleet_text(kinds, ports, homes, only=name), encoding="utf-8")
                process = await start_ros(own, speed)
            vehicles[name] = process
            stack.push_async_callback(_end, process)
        clock = SystemClock(speed)
        executive = Executive(fleet, MemoryJournal(), PluginManager(), clock, speed=speed)
        await stack.enter_async_context(executive)
        watch = Watch(clock)
        listening = asyncio.create_task(watch.listen(executive))
        stack.callback(listening.cancel)
        await _until(clock, lambda: len(watch.ready) == 3, READY_S, "not all vehicles are ready")
        run = await executive.control.start(mission(kinds))
        band_m = EAST_M * PASSES / 3
        await _until(
            clock,
            lambda: watch.surveyed_m(LOST) >= CUT_SHARE * band_m,
            MOST_S,
            f"{LOST} does not survey",
        )
        await _end(vehicles[LOST])
        cut_s = watch.tracks[LOST][-1][0]
        summary = await asyncio.wait_for(executive.control.wait(run), MOST_S)
        print(f"the mission ended {summary.status}")
    return report(watch, cut_s)


def report(watch: Watch, cut_s: float) -> bool:
    """Print the figures. Return whether they are within the bounds."""
    coverage = Coverage(EAST_M, PASSES * WIDTH_M, WIDTH_M)
    for track in watch.tracks.values():
        coverage.add(track)
    others = [name for name in NAMES if name != LOST]
    done_m = sum(_surveyed_until(watch, name, cut_s) for name in NAMES)
    speeds = [
        _surveyed_until(watch, name, cut_s) / (cut_s - watch.began_s(name)) for name in others
    ]
    left_m = EAST_M * PASSES - done_m
    # From the end of its band to what is left of the one between: at least one width.
    least_s = optimum_s(left_m, speeds, WIDTH_M / SPEED_M_S)
    ends = [watch.ended_s(name) - cut_s for name in others]
    print(f"surveyed {coverage.covered:.1%}, twice {coverage.twice:.1%}")
    print(
        f"left when {LOST} was cut off: {left_m:.0f} m of {EAST_M * PASSES:.0f} m of passes; the "
        f"others survey {' and '.join(f'{each:.2f} m/s' for each in speeds)}, turns included"
    )
    print(
        f"they took {' and '.join(f'{each:.0f} s' for each in ends)}; the least time is "
        f"{least_s:.0f} s: {max(ends) / least_s - 1:+.1%}"
    )
    return coverage.covered >= COVERED and coverage.twice <= TWICE and max(ends) <= SLOWER * least_s


def _surveyed_until(watch: Watch, name: str, at_s: float) -> float:
    coverage = Coverage(EAST_M, PASSES * WIDTH_M, WIDTH_M)
    coverage.add([each for each in watch.tracks[name] if each[0] <= at_s])
    return len(coverage.passes) / WIDTH_M


async def _until(clock: SystemClock, true: object, within_s: float, wrong: str) -> None:
    assert callable(true)
    end_us = clock.now_us() + within_s * 1e6
    while not true():
        if clock.now_us() > end_us:
            raise SystemExit(f"{wrong} after {within_s:g} s")
        await clock.sleep(0.5)


async def _end(process: asyncio.subprocess.Process) -> None:
    with suppress(ProcessLookupError):
        process.kill()
    await process.wait()


def main() -> None:
    """Measure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--arducopter", type=Path, help="the program of a real ArduCopter")
    parser.add_argument("--speed", type=float, default=5.0, help="simulated seconds per second")
    parser.add_argument(
        "--vehicles", default="mavlink,mavlink,mavlink", help="mavlink or ros, each"
    )
    options = parser.parse_args()
    kinds = options.vehicles.split(",")
    if len(kinds) != len(NAMES) or not set(kinds) <= {MAVLINK, ROS}:
        parser.error(f"--vehicles: {len(NAMES)} of {MAVLINK} and {ROS} are expected")
    with ExitStack() as stack:
        if ROS in kinds:
            from m2pem_plugin_ros import loopback  # noqa: PLC0415  # needs ROS
            from m2pem_plugin_ros.testing import reserved_domain  # noqa: PLC0415  # as above

            domain = stack.enter_context(reserved_domain())
            os.environ.update(loopback.environment(domain))
        if not asyncio.run(measure(kinds, options.arducopter, options.speed)):
            sys.exit(1)


if __name__ == "__main__":
    main()
