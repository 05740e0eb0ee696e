"""Failsafes of real autopilots while m2pem runs a mission on them: what each of the two does.

A cell is a failsafe in a phase of a mission (`mavlink_failsafe_cells`). It is played with the real
program, `m2pem run` as a user starts it, and a second ground station that brings the failsafe about
and looks on. What was seen is kept in `traces/failsafes.json`; docs/failsafes.md is made of that.
"""

import json
import re
import select
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

from m2pem_plugin_mavlink.simulator.specification import Kind
from m2pem_plugin_mavlink.sitl.launch import (
    Launch,
    Start,
    ardupilot_launch,
    px4_launch,
    px4_port,
    running,
)
from m2pem_plugin_mavlink.sitl.programs import FRAMES, ardupilot_program, find_px4
from mavlink_sitl import free_port
from mavlink_station import Station
from mavlink_wires import UdpWire

from m2pem.testing.scenarios import ORIGIN, one_after_another

FILE = Path(__file__).parent / "traces/failsafes.json"
AFTERWARDS_S = 90.0
"""So long the vehicle is watched after the mission, unless its motors stop."""
STANDS_M_S = 0.3
CIRCLES_WITHIN_M = 150.0
"""Of its home a plane circles, at most: WP_LOITER_RAD, RTL_RADIUS and what it drifts."""
GROUND_STATION_PORT = 14550
"""Every PX4 sends there, too."""
LATITUDE, LONGITUDE, ALTITUDE_M = ORIGIN
NORTH = f"[{LATITUDE + 0.0008},{LONGITUDE}]"
FAR_NORTH = f"[{LATITUDE + 0.003},{LONGITUDE}]"
CORNERS = [
    (LONGITUDE + east, LATITUDE + north)
    for north, east in ((0.0003, 0.0), (0.0012, 0.0), (0.0012, 0.001), (0.0003, 0.001))
]
AREA = {
    "type": "Feature",
    "properties": {},
    "geometry": {"type": "Polygon", "coordinates": [[*CORNERS, CORNERS[0]]]},
}


class Phase(NamedTuple):
    """`steps`: the behaviors of the mission; `now`: whether it is time for the failsafe, which is
    `before` the mission if it is there before the mission begins."""

    name: str
    steps: tuple[tuple[str, Mapping[str, object]], ...]
    now: Callable[[Station], bool]
    before: bool = False


class Failsafe(NamedTuple):
    """`parameters`: set from the beginning; `cause`: brings it about; `end`: ends it after 20 s;
    `phases`: in which it is played, if they are not those of all failsafes of the vehicle;
    `prepare`: what the second ground station does before the mission."""

    name: str
    parameters: Mapping[str, float]
    cause: Callable[["Play"], None]
    end: Callable[["Play"], None] = lambda play: None
    phases: tuple[Phase, ...] = ()
    prepare: Callable[["Play"], None] = lambda play: None


class Vehicle(NamedTuple):
    """A program with its parameters, and what is played with it.

    `name`: in the traces; `title`: for people; `variable`: of the environment, names the program;
    `model`: of its simulation; `speed`: how much faster than real time; `prepare`: what the second
    ground station does before the mission; `circles`: it circles where others stand or land."""

    name: str
    title: str
    variable: str
    kind: Kind
    firmware: str
    model: str
    domain: str
    resource: str
    failsafe: str
    speed: int
    parameters: Mapping[str, float]
    phases: Mapping[str, Phase]
    failsafes: Mapping[str, Failsafe]
    prepare: Callable[[Station], None] = lambda station: None
    circles: bool = False

    def phases_of(self, failsafe: Failsafe) -> Mapping[str, Phase]:
        """The phases in which a failsafe is played, by their names."""
        return {each.name: each for each in failsafe.phases} or self.phases

    @property
    def flies(self) -> bool:
        """It does not stand safely where its motors run."""
        return self.domain == "air"


@dataclass
class Play:
    """A cell that is being played."""

    station: Station
    relay: "Relay"


@dataclass
class Relay:
    """Between an autopilot and m2pem; `cut`: nothing passes."""

    to_port: int
    port: int = 0
    """Of its own, to which the autopilot sends; 0: one that is free."""
    cut: bool = False
    _stopped: bool = False
    _sockets: list[socket.socket] = field(default_factory=list)

    @contextmanager
    def run(self) -> Iterator["Relay"]:
        """Pass datagrams on in a thread."""
        near, far = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2))
        near.bind(("127.0.0.1", self.port))
        far.bind(("127.0.0.1", 0))
        self.port = near.getsockname()[1]
        thread = threading.Thread(target=self._pass, args=(near, far))
        thread.start()
        try:
            yield self
        finally:
            self._stopped = True
            thread.join()
            near.close()
            far.close()

    def _pass(self, near: socket.socket, far: socket.socket) -> None:
        autopilot: Any = None
        while not self._stopped:
            for ready in select.select([near, far], [], [], 0.1)[0]:
                try:
                    data, sender = ready.recvfrom(65536)
                except ConnectionError:
                    continue  # m2pem is not there yet, or no longer
                if ready is near:
                    autopilot = sender
                if self.cut:
                    continue
                if ready is near:
                    far.sendto(data, ("127.0.0.1", self.to_port))
                elif autopilot is not None:
                    near.sendto(data, autopilot)


def play(
    vehicle: Vehicle, failsafe: Failsafe, phase: Phase, binary: Path, instance: int
) -> dict[str, Any]:
    """What a real autopilot and m2pem do.

    `modes`: of the vehicle, from the failsafe on; `texts`: its warnings; `end`: how the behavior
    ended; `said`: what operators read from the failsafe on; `status`: of m2pem; `disarmed`: the
    motors stopped; `stands`: at the end, it did not move; `at home`: it was then within 4 m of
    where it began (a plane that flies: within 150 m).
    """
    px4 = vehicle.firmware == "px4"
    wire = UdpWire(vehicle.kind, vehicle.firmware, GROUND_STATION_PORT if px4 else 0)
    relayed = Relay(free_port(), px4_port(instance) if px4 else 0)
    try:
        with TemporaryDirectory() as name, relayed.run() as relay:
            folder = Path(name)
            with running(
                [launch(vehicle, failsafe.parameters, binary, instance, wire, relay, folder)],
                folder,
            ):
                station = Station(wire, instance + 1 if px4 else 1)
                return _played(vehicle, failsafe, phase, Play(station, relay), folder)
    finally:
        wire.close()


def launch(
    vehicle: Vehicle,
    more: Mapping[str, float],
    binary: Path,
    instance: int,
    wire: UdpWire,
    relay: Relay,
    folder: Path,
) -> Launch:
    """The program of a vehicle, with `more` parameters."""
    start = Start(LATITUDE, LONGITUDE, ALTITUDE_M, speed=vehicle.speed)
    parameters = {**vehicle.parameters, **more}
    if vehicle.firmware == "px4":
        return px4_launch(
            *(vehicle.model, find_px4(binary.parent.parent), vehicle.model, start),
            instance=instance,
            folder=folder / vehicle.model,
            parameters=parameters,
        )
    frame = FRAMES[vehicle.model]
    return ardupilot_launch(
        *(vehicle.model, ardupilot_program(binary, frame), frame, start),
        instance=instance,
        system_id=1,
        ports=[relay.port, wire.port],
        parameters=parameters,
    )


def _played(
    vehicle: Vehicle, failsafe: Failsafe, phase: Phase, cell: Play, folder: Path
) -> dict[str, Any]:
    s = cell.station
    s.beats = False
    s.connect()
    s.ready()
    vehicle.prepare(s)
    failsafe.prepare(cell)
    if phase.before:
        failsafe.cause(cell)
        s.watch(3.0)
    with mission(vehicle, phase.steps, s.system, cell.relay.to_port, folder) as (process, lines):
        s.until("begun", lambda: bool(lines) or process.poll() is not None, 120.0)
        if not phase.before:
            if not s.until("phase", lambda: phase.now(s), 200.0):
                process.kill()
                raise RuntimeError(f"the phase did not come: {s.mode}, {list(lines)}")
            s.watch(2.0)  # m2pem has then seen the mode that it asked for
            del lines[:-1]
            s.forget()
            s.begin(failsafe.name)
            failsafe.cause(cell)
        mended = s.now_s + 20.0
        s.until("mended", lambda: s.now_s > mended or s.now_s < mended - 60.0, 30.0)
        failsafe.end(cell)
        over = s.until("over", lambda: process.poll() is not None, 240.0)
        if not over:
            process.kill()
        status = process.wait()
    s.until("disarmed", lambda: not s.armed, AFTERWARDS_S)
    step = s.trace[-1] if s.trace else {}
    return {
        "modes": step.get("mode", []),
        "texts": step.get("warnings", []),
        "said": [_plain(line) for line in lines],
        "status": status if over else None,
        "disarmed": not s.armed,
        "stands": s.speed_mps < STANDS_M_S,
        "at home": s.distance_m() < (CIRCLES_WITHIN_M if vehicle.circles and s.armed else 4.0),
    }


def _plain(line: str) -> str:
    """Without the time."""
    return re.sub(r"^\s*\d+\.\d s\s+", "", line)


@contextmanager
def mission(
    vehicle: Vehicle,
    steps: tuple[tuple[str, Mapping[str, object]], ...],
    system: int,
    port: int,
    folder: Path,
    more: str = "",
) -> Iterator[tuple["subprocess.Popen[str]", list[str]]]:
    """`m2pem run` with these behaviors, one after another, and the lines that it prints;
    `more`: of the fleet."""
    (folder / "mission.bpmn").write_bytes(one_after_another(vehicle.resource, *steps))
    (folder / "field.geojson").write_text(json.dumps(AREA), encoding="utf-8")
    fleet = FLEET.format(vehicle=vehicle, system=system, port=port) + more
    (folder / "fleet.yaml").write_text(fleet, encoding="utf-8")
    words = ("run", "mission.bpmn", "--fleet", "fleet.yaml", "--speed", vehicle.speed)
    words += ("--journal", "journal.db", "--ocu", "none")
    lines: list[str] = []
    with subprocess.Popen(
        [sys.executable, "-m", "m2pem", *map(str, words)],
        cwd=folder,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    ) as process:
        assert process.stdout is not None
        reader = threading.Thread(
            target=lambda: lines.extend(line.rstrip() for line in process.stdout or ())
        )
        reader.start()
        try:
            yield process, lines
        finally:
            if process.poll() is None:
                process.kill()
            reader.join()


FLEET = """
version: 1
name: one
origin: {{lat: 38.1075, lon: -77.3192, alt: 60.0}}
vehicles:
  {vehicle.resource}:
    domain: {vehicle.domain}
    arbiter: mavlink
    connection: {{url: "udpin://127.0.0.1:{port}", system_id: {system}}}
    lost_after: 10 s
    sitl: true
    failsafe: {vehicle.failsafe}
areas: {{field: field.geojson}}
"""
