"""Copters that fly a mission which is revised, and what they do as they say themselves: a ground
station looks on at each and commands nothing, and the logs of ArduPilot are read."""

import asyncio
import json
import math
import threading
from collections.abc import AsyncIterator, Callable, Coroutine, Mapping, Sequence
from contextlib import ExitStack, asynccontextmanager
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

import mavlink_sitl as sitl
from m2pem_plugin_mavlink.simulator.specification import Kind
from m2pem_plugin_mavlink.sitl.launch import px4_port
from mavlink_failsafes import GROUND_STATION_PORT
from mavlink_station import Station
from mavlink_wires import UdpWire
from pymavlink import DFReader

from m2pem import load_fleet
from m2pem.api import Area, MissionControl, Point, Route, SystemClock, offset
from m2pem.executive.executive import Executive
from m2pem.journal import MemoryJournal
from m2pem.plugins import PluginManager
from m2pem.testing import scenarios
from tests.command_line import CommandLine

WITHIN_S = 200.0
"""Of the wall clock, for one condition."""

STILL_M_S = 0.3
STEADY_M_S = 4.0
"""A vehicle on a straight line at `CRUISE` is never slower, unless something stops it."""

CRUISE = "6 m/s"
FLEET = """
version: 1
debugging: true
origin: {{lat: {home[0]}, lon: {home[1]}, alt: {home[2]}}}
vehicles:
"""
VEHICLE = """
  {name}:
    domain: air
    arbiter: mavlink
    sitl: true
    lost_after: 60 s
    connection: {{url: "udpin://127.0.0.1:{port}", system_id: {system}}}
"""

Place = tuple[float, float]
"""Metres east and north of where uav1 starts; uav2 starts 22.5 m further east."""

Steps = list[tuple[str, Mapping[str, object]]]


def latlon(place: Place) -> tuple[float, float]:
    return offset(sitl.HOME[:2], *place)


def lane(*places: Place) -> Route:
    """A route at the altitude that its task says."""
    return Route(tuple((*latlon(each), None) for each in places))


def goes_to(place: Place) -> tuple[str, Mapping[str, object]]:
    return "goto", {"target": [round(each, 7) for each in latlon(place)], "speed": CRUISE}


def flies(route: str, altitude: str, speed: str = CRUISE) -> tuple[str, Mapping[str, object]]:
    return "single_vehicle_routing", {"route": route, "altitude": altitude, "speed": speed}


def drawn(*each: Steps, **geometries: Point | Route | Area) -> bytes:
    """A mission of uav1 and, if it is in it, uav2, with tasks A1, A2, ... and B1, B2, ..., and
    their geometries."""
    branches = ((f"uav{number}", steps) for number, steps in enumerate(each, 1))
    return scenarios.drawn(scenarios.side_by_side(*branches), **geometries)


class Sample(NamedTuple):
    """What a copter says of itself at a time of its clock; `place` as `Place`."""

    at_s: float
    mode: str
    place: Place
    height_m: float
    speed_m_s: float
    mission: int
    """A number of its stored mission, by which PX4 distinguishes missions; 0: it has none."""


@dataclass
class Copter:
    """One copter, as it says itself."""

    name: str
    station: Station
    folder: Path
    samples: list[Sample]

    @property
    def now(self) -> Sample:
        return self.samples[-1]

    @property
    def missions(self) -> list[int]:
        """The stored missions of a PX4, one after the other, by their numbers."""
        return [number for number, _ in groupby(each.mission for each in self.samples) if number]

    @property
    def modes(self) -> list[str]:
        """Its modes, one after the other, as its heartbeats had them: not those of a moment."""
        return [mode for mode, _ in groupby(each.mode for each in self.samples)]

    def since(self, at_s: float) -> list[Sample]:
        """What it has said from a time of its clock on."""
        return [each for each in self.samples if each.at_s >= at_s]

    def nearest_m(self, place: Place, since_s: float = 0.0) -> float:
        """How near it has come to a place."""
        return min(math.dist(each.place, place) for each in self.since(since_s))

    def first_at_s(self, place: Place, within_m: float, since_s: float = 0.0) -> float:
        """When it was so near to a place first; infinite: never."""
        near = (each for each in self.since(since_s) if math.dist(each.place, place) < within_m)
        return next((each.at_s for each in near), math.inf)

    def slowest_m_s(self, begin: Callable[[Sample], bool], end: Callable[[Sample], bool]) -> float:
        """The lowest speed between two moments: the first of each."""
        first = next(n for n, each in enumerate(self.samples) if begin(each))
        last = next(n for n, each in enumerate(self.samples) if n > first and end(each))
        return min(each.speed_m_s for each in self.samples[first:last])

    def take_in(self) -> None:
        """Let a little time pass, and keep what it has said of its position."""
        station = self.station
        before = station.latest.get("GLOBAL_POSITION_INT")
        station.pump()
        message = station.latest.get("GLOBAL_POSITION_INT")
        if message is None or message is before:
            return
        mission = station.latest.get("MISSION_CURRENT")
        shrink = math.cos(math.radians(sitl.HOME[0]))
        place = (
            (message.lon / 1e7 - sitl.HOME[1]) * METRES_IN_A_DEGREE * shrink,
            (message.lat / 1e7 - sitl.HOME[0]) * METRES_IN_A_DEGREE,
        )
        self.samples.append(
            Sample(
                message.time_boot_ms / 1e3,
                station.mode,
                place,
                message.relative_alt / 1e3,
                math.hypot(message.vx, message.vy) / 100,
                0 if mission is None else _mission_id(mission),
            )
        )

    def logged(self) -> "Logged":
        """What its log has, once its program has ended."""
        found = Logged([], [])
        for file in sorted((self.folder / "logs").glob("*.BIN")):
            log = DFReader.DFReader_binary(str(file))
            while (message := log.recv_match(type=["MSG", "MODE"])) is not None:
                if message.get_type() == "MSG":
                    found.texts.append(message.Message)
                elif not found.modes or found.modes[-1] != message.Mode:
                    found.modes.append(message.Mode)
        return found


def _mission_id(current: Any) -> int:
    """Of MISSION_CURRENT, which the dialect knows only up to `mission_mode`."""
    frame = bytes(current.get_msgbuf())
    payload = frame[MAVLINK2_HEADER : MAVLINK2_HEADER + frame[1]]
    return int.from_bytes(payload[6:10], "little")


class Logged(NamedTuple):
    """`texts`: what it has said to ground stations; `modes`: their numbers, in order."""

    texts: list[str]
    modes: list[int]

    @property
    def uploads(self) -> int:
        """How many missions were uploaded to it."""
        return self.texts.count("Flight plan received")


MAVLINK2_HEADER = 10
METRES_IN_A_DEGREE = 111_194.9
GUIDED, AUTO, RTL, BRAKE = 4, 3, 6, 17


PX4_SPEED = 3.0
_World = tuple[list[Copter], list[sitl.Launch], str]
"""Copters, their programs, and their part of the fleet file."""


class Copters:
    """Copters of ArduPilot or PX4, with a thread that listens to them. Two PX4s on two processors
    fall behind the clock: there is one, and it is slower."""

    def __init__(self, folder: Path, firmware: str = "ardupilot") -> None:
        folder.mkdir()
        self._stack = ExitStack()
        self.speed = float(sitl.SPEED) if firmware == "ardupilot" else PX4_SPEED
        with ExitStack() as started:
            begin = self._ardupilots if firmware == "ardupilot" else self._px4
            self.all, launches, vehicles = begin(folder, started)
            self.fleet = folder / "fleet.yaml"
            self.fleet.write_text(FLEET.format(home=sitl.HOME) + vehicles, encoding="utf-8")
            started.enter_context(sitl.running(launches, folder))
            for copter in self.all:
                copter.station.beats = False
                copter.station.connect()
            for copter in self.all:
                copter.station.ready()
                while not copter.samples:
                    copter.take_in()
            self._listen(started)
            self._stack = started.pop_all()

    @property
    def both(self) -> tuple[Copter, Copter]:
        first, second = self.all
        return first, second

    @property
    def of_fleet(self) -> tuple[str, ...]:
        """The options of the command line for the fleet."""
        return ("--fleet", str(self.fleet), "--speed", f"{self.speed:g}")

    def _ardupilots(self, folder: Path, started: ExitStack) -> _World:
        binary = sitl.program("M2PEM_ARDUCOPTER")
        assert binary is not None
        copters, launches, vehicles = [], [], ""
        for number in range(2):
            wire, port, system = UdpWire(Kind.COPTER, "ardupilot"), sitl.free_port(), number + 1
            started.callback(wire.close)
            # The log begins with the program; a ground station that is killed is no failsafe here.
            parameters = {"LOG_DISARMED": 1, "FS_GCS_ENABLE": 0}
            instance = sitl.first_instance(2) + number
            ports = (port, wire.port)
            launches.append(sitl.ardupilot(binary, "quad", instance, ports, system, parameters))
            name = f"uav{system}"
            copters.append(Copter(name, Station(wire, system), folder / launches[-1].name, []))
            vehicles += VEHICLE.format(name=name, port=port, system=system)
        return copters, launches, vehicles

    def _px4(self, folder: Path, started: ExitStack) -> _World:
        binary = sitl.program("M2PEM_PX4")
        assert binary is not None
        instance = sitl.first_instance(1)
        wire = UdpWire(Kind.COPTER, "px4", GROUND_STATION_PORT)
        started.callback(wire.close)
        launch = sitl.px4(binary, instance, folder, speed=self.speed)
        system = instance + 1
        copter = Copter("uav1", Station(wire, system), folder / launch.name, [])
        vehicle = VEHICLE.format(name="uav1", port=px4_port(instance), system=system)
        return [copter], [launch], vehicle

    def _listen(self, started: ExitStack) -> None:
        ended = threading.Event()

        def listen() -> None:
            while not ended.is_set():
                for copter in self.all:
                    copter.take_in()

        thread = threading.Thread(target=listen, daemon=True)
        thread.start()
        started.callback(thread.join)
        started.callback(ended.set)

    def close(self) -> None:
        """End the programs, so that their logs are whole."""
        self._stack.close()


async def until(condition: Callable[[], bool]) -> None:
    """Wait until something is so."""
    async with asyncio.timeout(WITHIN_S):
        while not condition():  # noqa: ASYNC110  # a thread and another program change it
            await asyncio.sleep(0.02)


async def landed(copters: Copters) -> None:
    """Wait until all of them have stopped their motors, as their heartbeats say."""
    await until(lambda: not any(copter.station.armed for copter in copters.all))


@asynccontextmanager
async def executive(copters: Copters) -> AsyncIterator[Any]:
    """What commands the copters; yields its `MissionControl`."""
    clock = SystemClock(copters.speed)
    fleet = load_fleet(copters.fleet)
    async with Executive(
        fleet, MemoryJournal(), PluginManager(), clock, speed=copters.speed
    ) as commands:
        yield commands.control


async def revise(control: MissionControl, run: str, new: bytes, **moves: str) -> None:
    """Do what the plan says, which refuses nothing."""
    plan = await control.plan_revision(run, new, moves=moves)
    assert not plan.refusals
    await control.revise(run, new, plan.plan, moves=moves)


def flown(copter: Copter, north_m: float) -> Callable[[], bool]:
    """Whether it flies its route, and is so far north."""
    return lambda: copter.now.mode == copter.station.auto and copter.now.place[1] > north_m


async def goes_on_at(copter: Copter, speed_m_s: float) -> None:
    """Return when it has been that fast for ten seconds, and has not stopped on the way."""
    at_s = copter.now.at_s

    def is_steady() -> bool:
        now = copter.now
        last = [each.speed_m_s for each in copter.since(max(at_s, now.at_s - 10.0))]
        long = now.at_s > at_s + 10.0
        return long and max(abs(each - speed_m_s) for each in last) < 0.5

    await until(is_steady)
    assert min(each.speed_m_s for each in copter.since(at_s)) > 2.0


MOMENTS_OF_A_KILL = ("MissionRevised", "BehaviorRequested", "RUNNING")
"""When the revision is committed, when the task A2 that begins again is requested, and when it is
under way."""


def killed_and_resumed(
    copters: Copters,
    folder: Path,
    missions: Sequence[bytes],
    flying: Callable[[], Coroutine[Any, Any, None]],
    wait_for: str,
    moves: Sequence[str] = (),
) -> int:
    """Run the first mission, revise it to the second one when the copters are `flying`, kill m2pem
    (SIGKILL) at a moment, and resume the run to its end. `moves`: tokens to elements, "A2=A3".

    An operator has the copter go on where m2pem cannot tell; returns how often that was.
    """
    begun, new = folder / "begun.bpmn", folder / "new.bpmn"
    for file, mission in zip((begun, new), missions, strict=True):
        file.write_bytes(mission)
    m2pem = CommandLine(folder)
    printed = ("--format", "json", "--ocu", "none")
    run = m2pem.start("run", begun, *copters.of_fleet, *printed)
    asyncio.run(flying())
    moved = (f"--move={each}" for each in moves)
    status, _, errors = m2pem.run("revise", "r1", new, "--yes", *moved)
    assert status == 0, errors
    run.until_record("MissionRevised")
    if wait_for != "MissionRevised":
        again = run.until_record("BehaviorRequested", element="A2")["behavior"]
    if wait_for in ("ACCEPTED", "RUNNING"):
        run.until_record("BehaviorProgressed", behavior=again, state=wait_for)
    run.kill()
    resumed = m2pem.start("resume", "r1", *printed)
    asked = 0

    def is_over(line: str) -> bool:
        nonlocal asked
        record = json.loads(line)
        if record["record"] == "PromptOpened":
            asked += 1
            assert m2pem.run("answer", "r1", record["prompt"], "resume")[0] == 0
        return bool(record["record"] == "RunEnded")

    assert json.loads(resumed.until(is_over))["outcome"] == "completed"
    m2pem.end()
    asyncio.run(landed(copters))
    copters.close()
    return asked
