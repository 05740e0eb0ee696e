"""Missions that others have drawn for ArduPilot and PX4, uploaded to copters and rovers of a face.

`M2PEM_CORPORA` names a folder with `.plan` and `.waypoints` files, and text files that begin with
"QGC WPL", anywhere below it; those of ArduPilot (Tools/autotest) and PX4 (test/mavsdk_tests) are
such. Each is carried out as it is drawn, or refused with the number of an item. The judge are the
positions that the face reports.
"""

import asyncio
import math
import os
import re
import socket
import time
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import suppress
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from mavlink_gcs import served
from mavlink_mavsdk_world import free_port
from mavlink_public_plans import PublicPlan, public_plans
from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem import load_fleet
from m2pem.api import Fleet, LatLon, SystemClock, distance_m, offset
from m2pem.testing.harness import run_executive

PLANS = public_plans(Path(os.environ.get("M2PEM_CORPORA") or os.devnull))
WITHIN_S = 100.0
FLIGHT_S = 8.0
"""Of the wall clock, for the longest plan of a fleet."""
CRUISE_M_S = 40.0
LONGEST_STEP_NS = 20_000_000
SLOWEST, FAST, FASTEST = 5.0, 15.0, 60.0
"""Of the clock. A plan that needs more than `FAST` has a fleet of its own, as positions are further
apart then."""
REGION_M = 40_000.0
MOST_PLANS = 12
"""In one fleet, each with a copter and a rover."""
TOLERANCE_M = 5.0
START = dialect.MAV_CMD_MISSION_START
WAYPOINT, LOITER, TURNS, LAND = 16, 17, 18, 21
TAKE_OFFS = (22, 84)
NOWHERE = (47.3977, 8.5456)
ABOVE = (3, 6, 10, 11)
"""MAV_FRAME of heights above home or ground."""
PLAIN = frozenset({WAYPOINT, 20, LAND, 22, 178})
"""What every copter does: waypoints, return, land, take-off, speed."""

pytestmark = pytest.mark.skipif(
    not PLANS, reason="M2PEM_CORPORA names no folder with missions of ground stations"
)


class Vehicle:
    """What a station has received of a vehicle."""

    def __init__(self, name: str, system: int, plan: PublicPlan) -> None:
        self.name, self.system, self.plan = name, system, plan
        self.flies = name.startswith("c")
        self.track: list[tuple[LatLon, float]] = []
        self.texts: list[str] = []
        self.answers: asyncio.Queue[Any] = asyncio.Queue()
        self.result: int | None = None
        self.state = 0
        self.changed = asyncio.Event()

    def take(self, message: Any) -> None:
        match message.get_type():
            case "GLOBAL_POSITION_INT":
                place = message.lat / 1e7, message.lon / 1e7
                if not self.track or place != self.track[-1][0] or self.flies:
                    self.track.append((place, message.relative_alt / 1e3))
                return
            case "STATUSTEXT":
                text = message.text.rstrip("\0")
                if message.chunk_seq:
                    self.texts[-1] += text
                else:
                    self.texts.append(text)
            case "MISSION_REQUEST_INT" | "MISSION_REQUEST" | "MISSION_ACK":
                self.answers.put_nowait(message)
            case "COMMAND_ACK" if message.result != dialect.MAV_RESULT_IN_PROGRESS:
                self.result = message.result
            case "MISSION_CURRENT":
                self.state = message.mission_state
        self.changed.set()

    async def until(self, true: Callable[[], Any], what: str) -> Any:
        async with asyncio.timeout(WITHIN_S):
            while not (value := true()):
                self.changed.clear()
                await self.changed.wait()
            return value

    @property
    def refusals(self) -> list[str]:
        return [each for each in self.texts if each.startswith(f"{self.name}: ")]


class Station:
    """Hands what it receives to the vehicles. It reads all that there is at once: asyncio reads one
    datagram, and loses others while many vehicles send."""

    def __init__(self, port: int, vehicles: Sequence[Vehicle]) -> None:
        self.mav = dialect.MAVLink(self, 254, 190)
        self._parser = dialect.MAVLink(None, 254, 190)
        self._vehicles = {each.system: each for each in vehicles}
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.connect(("127.0.0.1", port))
        self._loop = asyncio.get_running_loop()
        self._loop.add_reader(self._socket, self._read)
        self._beating = self._loop.create_task(self._beat())

    def write(self, frame: bytes) -> None:
        self._socket.send(frame)

    def close(self) -> None:
        self._beating.cancel()
        self._loop.remove_reader(self._socket)
        self._socket.close()

    async def _beat(self) -> None:
        while True:
            self.mav.heartbeat_send(dialect.MAV_TYPE_GCS, dialect.MAV_AUTOPILOT_INVALID, 0, 0, 4)
            await asyncio.sleep(0.3)

    def _read(self) -> None:
        with suppress(BlockingIOError, ConnectionRefusedError):
            while True:
                for message in self._parser.parse_buffer(self._socket.recv(2048)) or ():
                    if (vehicle := self._vehicles.get(message.get_srcSystem())) is not None:
                        vehicle.take(message)

    async def upload(self, vehicle: Vehicle) -> int:
        """Upload a plan as QGroundControl does; MAV_MISSION_RESULT."""
        items = vehicle.plan.items
        self.mav.mission_count_send(vehicle.system, 1, len(items), 0)
        async with asyncio.timeout(WITHIN_S):
            while True:
                answer = await vehicle.answers.get()
                if answer.get_type() == "MISSION_ACK":
                    return int(answer.type)
                fields = items[answer.seq].fields(answer.seq)
                self.mav.mission_item_int_send(vehicle.system, 1, *fields, 0)

    async def begin(self, vehicle: Vehicle) -> int:
        """Send MISSION_START; MAV_RESULT."""
        vehicle.result = None
        self.mav.command_long_send(vehicle.system, 1, START, 0, *[0.0] * 7)
        await vehicle.until(lambda: vehicle.result is not None, "COMMAND_ACK")
        assert vehicle.result is not None
        return vehicle.result


def drawn(plan: PublicPlan) -> list[tuple[int, LatLon, float | None, float]]:
    """The places to which a plan leads, in order: the item, its place, its height above home, if it
    is one, and how far from the place the vehicle is to be."""
    found: list[tuple[int, LatLon, float | None, float]] = []
    for number, place in plan.places:
        item = plan.items[number]
        if item.command in TAKE_OFFS:
            continue
        height = item.z if item.frame in (3, 6) and item.command == WAYPOINT and item.z else None
        radius_m = abs(item.params[2]) if item.command == TURNS else 0.0
        found.append((number, place, height, radius_m))
        if item.command in (LOITER, LAND):
            break
    return found


def steepest(plan: PublicPlan) -> float:
    """The slope of the steepest leg: a vehicle that is 1 m beside a place is so far beneath it."""
    ways = [(place, up_m or 0.0) for _, place, up_m, _ in drawn(plan)]
    slopes = (abs(b - a) / max(1.0, distance_m(p, q)) for (p, a), (q, b) in pairwise(ways))
    return max(slopes, default=0.0)


def unreached(vehicle: Vehicle) -> str:
    """The first item that the vehicle has not come to in its turn; "": it was at each."""
    track = vehicle.track
    steps = [distance_m(a[0], b[0]) for a, b in pairwise(track)]
    climbs = [abs(a[1] - b[1]) for a, b in pairwise(track)]
    begin, slope = 0, steepest(vehicle.plan)
    for number, place, height, radius_m in drawn(vehicle.plan):
        nearest = math.inf
        for index in range(begin, len(track)):
            around = slice(max(0, index - 1), index + 1)
            at, up_m = track[index]
            away_m = abs(distance_m(at, place) - radius_m)
            nearest = min(nearest, away_m)
            if away_m > TOLERANCE_M + max(steps[around], default=0.0) / 2:
                continue
            off_m = abs(up_m - height) if vehicle.flies and height is not None else 0.0
            steep_m = away_m * slope
            if off_m <= TOLERANCE_M + steep_m + max(climbs[around], default=0.0) / 2:
                begin = index
                break
        else:
            return f"item {number}: {nearest:.1f} m away at best, of {len(track)} positions"
    return ""


def regions() -> list[list[PublicPlan]]:
    """The plans by the places where they begin, which a fleet has room for."""
    found: list[tuple[LatLon, list[PublicPlan]]] = []
    for plan in PLANS:
        begins = plan.places[0][1] if plan.places else NOWHERE
        is_long = speed_for([plan]) > FAST
        for place, members in found:
            if is_long or speed_for(members) > FAST:
                continue
            if distance_m(place, begins) < REGION_M and len(members) < MOST_PLANS:
                members.append(plan)
                break
        else:
            found.append((begins, [plan]))
    return [members for _, members in found]


def fleet_of(folder: Path, plans: Sequence[PublicPlan]) -> tuple[Fleet, list[Vehicle]]:
    """A fleet with a copter and a rover for each plan, 20 m from where it begins."""
    lines, vehicles = [], []
    for number, plan in enumerate(plans):
        home = offset(plan.places[0][1] if plan.places else NOWHERE, -20.0, 0.0)
        for kind, domain in (("c", "air"), ("r", "ground")):
            name = f"{kind}{number}"
            lines.append(
                f"  {name}: {{domain: {domain}, arbiter: sim, connection: {{"
                f"home: [{home[0]:.7f}, {home[1]:.7f}], cruise_speed: {CRUISE_M_S} m/s, "
                f"max_speed: {CRUISE_M_S} m/s, acceleration: 20 m/s2, deceleration: 20 m/s2, "
                "climb_rate: 20 m/s, turn_rate: 360 deg/s, telemetry_hz: 4, endurance: 100 h}}"
            )
            vehicles.append(Vehicle(name, len(vehicles) + 1, plan))
        if not number:
            origin = f"origin: {{lat: {home[0]:.7f}, lon: {home[1]:.7f}, alt: 100.0}}"
    folder.mkdir()
    file = folder / "fleet.yaml"
    file.write_text("\n".join(["version: 1", origin, "vehicles:", *lines, ""]), encoding="utf-8")
    return load_fleet(str(file)), vehicles


def speed_for(plans: Sequence[PublicPlan]) -> float:
    lengths = [0.0]
    for plan in plans:
        ways = [(place, up_m or 0.0) for _, place, up_m, _ in drawn(plan)]
        climbs = [abs(b - a) for a, b in pairwise((0.0, *(up_m for _, up_m in ways)))]
        legs = [min(distance_m(a, b), REGION_M) for (a, _), (b, _) in pairwise(ways)]
        lengths.append(sum(legs) + 2 * sum(climbs))
    return max(SLOWEST, min(FASTEST, max(lengths) / CRUISE_M_S / FLIGHT_S))


class Steady:
    """The steady time in nanoseconds, as far as the event loop keeps up with it: on a computer that
    is busy, vehicles do not move while nothing is sent of them."""

    def __init__(self) -> None:
        self._seen_ns, self._shown_ns = time.monotonic_ns(), 0

    def __call__(self) -> int:
        now_ns = time.monotonic_ns()
        self._shown_ns += min(now_ns - self._seen_ns, LONGEST_STEP_NS)
        self._seen_ns = now_ns
        return self._shown_ns


async def carry_out(folder: Path, plans: Sequence[PublicPlan]) -> list[tuple[Vehicle, str]]:
    """Upload each plan to its copter and rover, and begin it; how each has ended: `flown`,
    `refused`, or what is wrong."""
    fleet, vehicles = fleet_of(folder, plans)
    port, clock = free_port(), SystemClock(speed_for(plans), steady_ns=Steady())
    rates = {"GLOBAL_POSITION_INT": "20 Hz", "MISSION_CURRENT": "2 Hz"}
    rates |= dict.fromkeys(("ATTITUDE", "VFR_HUD", "GPS_RAW_INT", "SYS_STATUS"), "0.2 Hz")
    face = {"url": f"udpin://127.0.0.1:{port}", "commands": "all", "rates": rates}
    async with (
        run_executive(fleet, clock=clock, speed=clock.speed) as control,
        served(control, **face),
    ):
        station = Station(port, vehicles)

        async def one(vehicle: Vehicle) -> str:
            await vehicle.until(lambda: vehicle.track, "a position")
            result = await station.upload(vehicle)
            if result != dialect.MAV_MISSION_ACCEPTED:
                await vehicle.until(lambda: vehicle.refusals, "why it is refused")
                return refused(vehicle, result, await station.begin(vehicle))
            if (begun := await station.begin(vehicle)) != dialect.MAV_RESULT_ACCEPTED:
                return f"accepted, and MISSION_START is answered with {begun}: {vehicle.texts[-2:]}"
            ends = (dialect.MISSION_STATE_COMPLETE, dialect.MISSION_STATE_NOT_STARTED)
            failed = re.compile("fail|reject|lost", re.IGNORECASE)
            try:
                await vehicle.until(
                    lambda: vehicle.state == ends[0] or failed.search(" ".join(vehicle.texts)),
                    "its end",
                )
            except TimeoutError:
                return f"it does not end: {vehicle.texts[-3:]}"
            if vehicle.state != ends[0]:
                return f"it fails: {vehicle.texts[-3:]}"
            return unreached(vehicle) or "flown"

        try:
            ended = await asyncio.gather(*map(one, vehicles))
        finally:
            station.close()
    return list(zip(vehicles, ended, strict=True))


def refused(vehicle: Vehicle, result: int, begun: int) -> str:
    text = vehicle.refusals[0]
    if begun != dialect.MAV_RESULT_DENIED:
        return f"it is refused ({text}), and MISSION_START is answered with {begun}"
    if result == dialect.MAV_MISSION_DENIED and "no item of the plan moves it" in text:
        return "refused"
    named = re.search(r"\bitem (\d+)", text)
    if result != dialect.MAV_MISSION_UNSUPPORTED or named is None:
        return f"it is refused with {result}, and no item: {text}"
    if int(named[1]) >= len(vehicle.plan.items):
        return f"it is refused for an item that it does not have: {text}"
    return "refused"


def is_plain(plan: PublicPlan) -> bool:
    """Whether a copter must be able to fly a plan: it takes off at the beginning, if at all, and
    lands or returns at the end, if at all, and waits nowhere for ever."""
    commands = [each.command for each in plan.items]
    inside = commands[1:-1]
    return (
        set(commands) <= PLAIN
        and bool(drawn(plan))
        and not {20, LAND, 22}.intersection(inside)
        and commands[-1] != 22
        and commands[0] not in (20, LAND)
        and all(each.z > 0 for each in plan.items if each.command == 22)
        and all(each.z >= 1 or each.frame not in ABOVE for each in plan.items if each.x)
        and max(distance_m(drawn(plan)[0][1], place) for _, place in plan.places) < REGION_M
    )


def test_public_plans_are_carried_out_as_they_are_drawn_or_refused_with_an_item(
    tmp_path: Path,
) -> None:
    counts: Counter[tuple[str, str, str]] = Counter()
    wrong: list[str] = []
    for number, plans in enumerate(regions()):
        for vehicle, ended in asyncio.run(carry_out(tmp_path / str(number), plans)):
            kind, what = vehicle.plan.kind, "copter" if vehicle.flies else "rover"
            if ended not in ("flown", "refused"):
                wrong.append(f"{vehicle.plan.name} by a {what}: {ended}")
            elif ended == "refused" and vehicle.flies and is_plain(vehicle.plan):
                wrong.append(f"{vehicle.plan.name} is refused: {vehicle.refusals}")
            counts[kind, what, ended] += 1
    for (kind, what, ended), count in sorted(counts.items()):
        print(f"{kind}, {what}: {count} {ended}")
    assert not wrong, "\n".join(wrong)
    for kind, count in Counter(each.kind for each in PLANS).items():
        for what in ("copter", "rover"):
            assert counts[kind, what, "flown"] + counts[kind, what, "refused"] == count
    flown = [counts[kind, "copter", "flown"] for kind in {each.kind for each in PLANS}]
    assert sum(flown) >= sum(map(is_plain, PLANS)) > 0
