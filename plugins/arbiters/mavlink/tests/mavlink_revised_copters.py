"""Two copters of ArduPilot that fly a mission which is revised, and what they do as they say
themselves: a ground station looks on at each and commands nothing, and their logs are read."""

import asyncio
import math
import threading
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import ExitStack, asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import mavlink_sitl as sitl
from m2pem_plugin_mavlink.simulator.specification import Kind
from mavlink_station import Station
from mavlink_wires import UdpWire
from pymavlink import DFReader

from m2pem import load_fleet
from m2pem.api import Area, Point, Route, SystemClock, offset
from m2pem.executive.executive import Executive
from m2pem.journal import MemoryJournal
from m2pem.plugins import PluginManager
from m2pem.testing import scenarios

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
  uav1:
    domain: air
    arbiter: mavlink
    sitl: true
    lost_after: 60 s
    connection: {{url: "udpin://127.0.0.1:{ports[0]}", system_id: 1}}
  uav2:
    domain: air
    arbiter: mavlink
    sitl: true
    lost_after: 60 s
    connection: {{url: "udpin://127.0.0.1:{ports[1]}", system_id: 2}}
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


def drawn(first: Steps, second: Steps, **geometries: Point | Route | Area) -> bytes:
    """A mission of both, with tasks A1, A2, ... and B1, B2, ..., and their geometries."""
    return scenarios.drawn(scenarios.side_by_side(("uav1", first), ("uav2", second)), **geometries)


class Sample(NamedTuple):
    """What a copter says of itself at a time of its clock; `place` as `Place`."""

    at_s: float
    mode: str
    place: Place
    height_m: float
    speed_m_s: float


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

    def since(self, at_s: float) -> list[Sample]:
        """What it has said from a time of its clock on."""
        return [each for each in self.samples if each.at_s >= at_s]

    def nearest_m(self, place: Place, since_s: float = 0.0) -> float:
        """How near it has come to a place."""
        return min(math.dist(each.place, place) for each in self.since(since_s))

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


class Logged(NamedTuple):
    """`texts`: what it has said to ground stations; `modes`: their numbers, in order."""

    texts: list[str]
    modes: list[int]

    @property
    def uploads(self) -> int:
        """How many missions were uploaded to it."""
        return self.texts.count("Flight plan received")


METRES_IN_A_DEGREE = 111_194.9
GUIDED, AUTO, RTL, BRAKE = 4, 3, 6, 17


class Copters:
    """Both copters, with a thread that listens to them."""

    def __init__(self, folder: Path) -> None:
        folder.mkdir()
        self._stack = ExitStack()
        with ExitStack() as started:
            wires = [UdpWire(Kind.COPTER, "ardupilot") for _ in range(2)]
            ports = [sitl.free_port(), sitl.free_port()]
            for wire in wires:
                started.callback(wire.close)
            self.fleet = folder / "fleet.yaml"
            self.fleet.write_text(FLEET.format(home=sitl.HOME, ports=ports), encoding="utf-8")
            launches = [_launch(n, (ports[n], wire.port)) for n, wire in enumerate(wires)]
            self.both = [
                Copter(f"uav{n + 1}", Station(wire, n + 1), folder / launch.name, [])
                for n, (wire, launch) in enumerate(zip(wires, launches, strict=True))
            ]
            started.enter_context(sitl.running(launches, folder))
            for copter in self.both:
                copter.station.beats = False
                copter.station.connect()
            for copter in self.both:
                copter.station.ready()
            self._listen(started)
            self._stack = started.pop_all()

    def _listen(self, started: ExitStack) -> None:
        ended = threading.Event()

        def listen() -> None:
            while not ended.is_set():
                for copter in self.both:
                    copter.take_in()

        thread = threading.Thread(target=listen, daemon=True)
        thread.start()
        started.callback(thread.join)
        started.callback(ended.set)

    def close(self) -> None:
        """End the programs, so that their logs are whole."""
        self._stack.close()


def _launch(number: int, ports: tuple[int, int]) -> sitl.Launch:
    binary = sitl.program("M2PEM_ARDUCOPTER")
    assert binary is not None
    # The log begins with the program; a ground station that is killed is no failsafe here.
    parameters = {"LOG_DISARMED": 1, "FS_GCS_ENABLE": 0}
    instance = sitl.first_instance(2) + number
    return sitl.ardupilot(binary, "quad", instance, ports, number + 1, parameters)


async def until(condition: Callable[[], bool]) -> None:
    """Wait until something is so."""
    async with asyncio.timeout(WITHIN_S):
        while not condition():  # noqa: ASYNC110  # a thread and another program change it
            await asyncio.sleep(0.02)


@asynccontextmanager
async def executive(copters: Copters) -> AsyncIterator[Any]:
    """What commands the copters; yields its `MissionControl`."""
    clock = SystemClock(sitl.SPEED)
    fleet = load_fleet(copters.fleet)
    async with Executive(
        fleet, MemoryJournal(), PluginManager(), clock, speed=sitl.SPEED
    ) as commands:
        yield commands.control
