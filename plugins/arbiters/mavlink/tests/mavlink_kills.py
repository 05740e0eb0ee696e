"""An m2pem that is killed (SIGKILL) again and again while a real copter and a real rover move.

The mission runs as a user starts it; each kill comes at a random moment, and `m2pem resume` after a
random pause. A second ground station looks on and sends nothing. The judge is the autopilots' own
logs: which commands they took, in which mode they were, where they were, and why modes changed.
"""

import json
import random
import re
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

from m2pem_plugin_mavlink.simulator.specification import Kind
from m2pem_plugin_mavlink.sitl.launch import Launch, Start, ardupilot_launch, running
from m2pem_plugin_mavlink.sitl.programs import FRAMES, ardupilot_program
from mavlink_sitl import SPEED, free_port
from mavlink_station import Station
from mavlink_wires import UdpWire
from pymavlink import DFReader
from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import distance_m, offset
from m2pem.testing.scenarios import ORIGIN, side_by_side

PLACE = ORIGIN[:2]
FLIGHT_WITHIN_S = 400.0
"""Of the wall clock."""
KILL_AFTER_S = (0.2, 9.0)
RESUME_AFTER_S = (0.0, 4.0)
"""Of the wall clock: up to 20 s of the vehicles', so that some ground station failsafes begin."""
GCS_TIMEOUT_S = 25
PATIENT_SHARE = 0.3
"""Of the missions: those with a patient operator."""


def _at(east_m: float, north_m: float) -> str:
    latitude, longitude = offset(PLACE, east_m, north_m)
    return f"[{latitude:.7f},{longitude:.7f}]"


COPTER = (
    ("takeoff", {"altitude": "20 m"}),
    ("goto", {"target": _at(0, 60), "speed": "5 m/s"}),
    ("single_vehicle_routing", {"route": "round", "speed": "6 m/s"}),
    ("area_survey", {"area": "field", "spacing": "20 m", "altitude": "20 m"}),
    ("return_to_launch", {}),
)
ROVER = (
    ("goto", {"target": _at(40, 20), "speed": "3 m/s"}),
    ("single_vehicle_routing", {"route": "road", "speed": "4 m/s"}),
    ("reverse", {"distance": "6 m"}),
    ("goto", {"target": _at(10, -30)}),
    ("return_to_launch", {}),
)
LINES = {
    "round": [(40, 60), (40, 20), (-40, 20), (-40, 60)],
    "road": [(60, 40), (60, -20), (20, -20)],
}
FIELD = [(-50, 70), (50, 70), (50, 130), (-50, 130), (-50, 70)]
FLEET = """
version: 1
name: two
origin: {{lat: 38.1075, lon: -77.3192, alt: 60.0}}
vehicles:
  uav1:
    domain: air
    arbiter: mavlink
    connection: {{url: "udpin://127.0.0.1:{ports[0]}", system_id: 1}}
    lost_after: 30 s
    sitl: true
    failsafe: return_to_launch
  rover1:
    domain: ground
    arbiter: mavlink
    connection: {{url: "udpin://127.0.0.1:{ports[1]}", system_id: 2}}
    lost_after: 30 s
    sitl: true
    failsafe: hold
routes: {{round: round.geojson, road: road.geojson}}
areas: {{field: field.geojson}}
"""
RUN = ("run", "mission.bpmn", "--fleet", "fleet.yaml", "--speed", SPEED)
OPTIONS = ("--journal", "journal.db", "--ocu", "plain")
NOT_BEGUN = re.compile("there is no journal|has no run")
"""It was killed before it had written that there is a run."""

PROMPT = re.compile(r"^\[(?P<id>\w+)\] (?P<text>.*)")
CLOSED = re.compile("answered by |is not asked any more")
"""A question that another answer, or the end of the run, has closed."""

RETURNING = ("RTL", "LAND", "SMART_RTL")
HOMEWARD = ("mode 6", "mode 9", "mode 11")
"""RTL and LAND of a copter, RTL of a rover. A rover that a failsafe holds may be sent on by the
next behavior of the mission, not in the mission that it was in (AUTO)."""
AUTO = ("mode 3", "mode 10")
COMMANDED, FAILSAFES = 2, (5, 25)
"""Why a mode changed: ModeReason of ArduPilot (libraries/AP_Vehicle/ModeReason.h)."""
REPOSITION = dialect.MAV_CMD_DO_REPOSITION
MOVING = (dialect.MAV_CMD_NAV_TAKEOFF, REPOSITION, dialect.MAV_CMD_MISSION_START)
STOOD_M, STOOD_UP_M = 3.0, 1.0
"""A vehicle that has moved less since it was commanded has not begun."""


class Answer(NamedTuple):
    """To a question about a vehicle, at a time of its autopilot."""

    vehicle: str
    at_s: float
    decision: str


@dataclass
class Flight:
    """What came of one mission. `failsafes`: how many began; `again`: commands that a vehicle
    took once more before it had begun; `faults`: what must not be."""

    kills: int = 0
    answers: list[Answer] = field(default_factory=list)
    failsafes: int = 0
    again: int = 0
    ended: str = ""
    faults: list[str] = field(default_factory=list)


class Seen(NamedTuple):
    """One line of an autopilot's log: a command that it took, or a change of its mode."""

    at_s: float
    what: str
    reason: int
    place: tuple[float, float]
    height_m: float


class Executive:
    """`m2pem run`, killed and resumed; all that it has printed is in `lines`."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.lines: list[str] = []
        self._taken = 0
        self._process: subprocess.Popen[str] | None = None
        self._reader: threading.Thread | None = None

    def start(self, *words: object) -> None:
        """Start it, or `resume` it."""
        self._process = subprocess.Popen(
            [sys.executable, "-m", "m2pem", *map(str, (*words, *OPTIONS))],
            cwd=self.folder,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self._reader = threading.Thread(target=self._read, args=(self._process,), daemon=True)
        self._reader.start()

    def _read(self, process: "subprocess.Popen[str]") -> None:
        for line in process.stdout or ():
            self.lines.append(line.rstrip("\n"))

    @property
    def status(self) -> int | None:
        """Its exit status; None while it runs."""
        assert self._process is not None
        return self._process.poll()

    def kill(self) -> None:
        """SIGKILL."""
        assert self._process is not None
        self._process.kill()
        self._end()

    def _end(self) -> None:
        assert self._process is not None
        assert self._reader is not None
        self._process.wait()
        self._reader.join(5.0)

    def type(self, line: str) -> None:
        """What an operator types."""
        assert self._process is not None
        assert self._process.stdin is not None
        with suppress(BrokenPipeError):  # it has ended; its status says how
            self._process.stdin.write(f"{line}\n")
            self._process.stdin.flush()

    def news(self) -> list[str]:
        """The lines since the last call."""
        taken, self._taken = self._taken, len(self.lines)
        return self.lines[taken : self._taken]


def fly(programs: dict[str, Path], seed: int, kills: int, folder: Path) -> Flight:
    """One mission with at most so many kills. `programs`: of `uav1` and `rover1`."""
    chance = random.Random(seed)
    flight = Flight()
    wires = {"uav1": UdpWire(Kind.COPTER, "ardupilot"), "rover1": UdpWire(Kind.ROVER, "ardupilot")}
    ports = [free_port(), free_port()]
    _write_files(folder, ports)
    launches = [
        _launch(programs[name], name, number, (port, wires[name].port), seed)
        for number, (name, port) in enumerate(zip(("uav1", "rover1"), ports, strict=True))
    ]
    with ExitStack() as opened:
        for wire in wires.values():
            opened.callback(wire.close)
        opened.enter_context(running(launches, folder))
        stations = {name: Station(wire, 1 + n) for n, (name, wire) in enumerate(wires.items())}
        for station in stations.values():
            station.beats = False
            station.connect()
        for station in stations.values():
            station.ready()
        _play(flight, Executive(folder), stations, chance, kills)
    for name in stations:
        _judge(flight, name, folder)
    return flight


def _launch(program: Path, name: str, number: int, ports: tuple[int, int], seed: int) -> Launch:
    frame = FRAMES["quad" if name == "uav1" else "rover"]
    latitude, longitude = offset(PLACE, 5.0 * number, 0.0)
    failsafe = {"FS_GCS_ENABLE": 1} if name == "uav1" else {"FS_GCS_ENABLE": 1, "FS_ACTION": 2}
    return ardupilot_launch(
        name,
        ardupilot_program(program, frame),
        frame,
        Start(latitude, longitude, ORIGIN[2], speed=SPEED),
        instance=20 + 2 * (seed % 20) + number,
        system_id=number + 1,
        ports=ports,
        parameters={**failsafe, "FS_GCS_TIMEOUT": GCS_TIMEOUT_S, "LOG_DISARMED": 1},
    )


def _write_files(folder: Path, ports: list[int]) -> None:
    (folder / "mission.bpmn").write_bytes(side_by_side(("uav1", COPTER), ("rover1", ROVER)))
    (folder / "fleet.yaml").write_text(FLEET.format(ports=ports), encoding="utf-8")
    for name, line in LINES.items():
        _write_geometry(folder / f"{name}.geojson", "LineString", _corners(line))
    _write_geometry(folder / "field.geojson", "Polygon", [_corners(FIELD)])


def _corners(line: list[tuple[int, int]]) -> list[tuple[float, float]]:
    return [offset(PLACE, east, north)[::-1] for east, north in line]


def _write_geometry(file: Path, kind: str, coordinates: Any) -> None:
    geometry = {"type": kind, "coordinates": coordinates}
    feature = {"type": "Feature", "properties": {}, "geometry": geometry}
    file.write_text(json.dumps(feature), encoding="utf-8")


def _play(
    flight: Flight,
    executive: Executive,
    stations: dict[str, Station],
    chance: random.Random,
    kills: int,
) -> None:
    """Kill, resume and answer until the run has ended."""
    executive.start(*RUN)
    over_s = time.monotonic() + FLIGHT_WITHIN_S
    kill_s = time.monotonic() + chance.uniform(*KILL_AFTER_S)
    patient = chance.random() < PATIENT_SHARE
    questions: dict[str, str] = {}
    while time.monotonic() < over_s:
        _look(stations)
        for match in filter(None, map(PROMPT.match, executive.news())):
            if CLOSED.match(match["text"]):
                questions.pop(match["id"], None)
            else:
                questions[match["id"]] = match["text"]
        if executive.status is not None and NOT_BEGUN.search(executive.lines[-1]):
            executive.start(*RUN)
        elif executive.status is not None:
            flight.ended = "\n".join(executive.lines[-6:])
            return
        if flight.kills < kills and time.monotonic() >= kill_s:
            executive.kill()
            flight.kills += 1
            resume_s = time.monotonic() + chance.uniform(*RESUME_AFTER_S)
            while time.monotonic() < resume_s:
                _look(stations)
            executive.news()
            questions.clear()
            executive.start("resume", "r1")
            kill_s = time.monotonic() + chance.uniform(*KILL_AFTER_S)
        for prompt, text in list(questions.items()):
            if (answer := _answer(text, stations, patient)) is not None:
                del questions[prompt]
                flight.answers.append(answer)
                executive.type(f"{prompt} {answer.decision}")
    executive.kill()
    flight.faults.append(f"the run has not ended: {executive.lines[-8:]}")


def _look(stations: dict[str, Station]) -> None:
    for station in stations.values():
        station.pump()


def _answer(text: str, stations: dict[str, Station], patient: bool) -> Answer | None:
    """A patient operator lets an aircraft that returns or lands by itself come down, and then
    aborts; others have the vehicle go on."""
    name = next((name for name in stations if name in text), "")
    assert name, f"what vehicle is this about: {text!r}"
    station = stations[name]
    if name != "uav1" or (station.mode not in RETURNING and station.armed):
        return Answer(name, station.now_s, "resume")
    if not station.armed:
        return Answer(name, station.now_s, "abort")
    return None if patient else Answer(name, station.now_s, "resume")


def _judge(flight: Flight, name: str, folder: Path) -> None:
    """What the autopilot's own log shows."""
    logs = sorted((folder / name / "logs").glob("*.BIN"))
    seen = [each for log in logs for each in read_log(log)]
    answers = [answer.at_s for answer in flight.answers if answer.vehicle == name]
    for first, second in _commanded_again(seen):
        moved = distance_m(first.place, second.place)
        if moved < STOOD_M and second.height_m - first.height_m < STOOD_UP_M:
            flight.again += 1
        elif not _answered(answers, first, second):
            flight.faults.append(
                f"{name}: {second.what} was commanded again at {second.at_s:.0f} s, {moved:.0f} m "
                "further on, and no operator had said so"
            )
    modes = list(_modes(seen))
    for one, other in pairwise(modes):
        if one.reason not in FAILSAFES:
            continue
        flight.failsafes += 1
        undone = one.what in HOMEWARD or other.what in AUTO
        if undone and other.reason == COMMANDED and not _answered(answers, one, other):
            flight.faults.append(
                f"{name}: its failsafe was interrupted at {other.at_s:.0f} s by {other.what}, and "
                "no operator had said so"
            )
    flight.failsafes += bool(modes) and modes[-1].reason in FAILSAFES


def _answered(answers: Sequence[float], first: Seen, second: Seen) -> bool:
    return any(first.at_s < at_s < second.at_s for at_s in answers)


def _modes(seen: Sequence[Seen]) -> Iterator[Seen]:
    """ArduPilot logs a mode once more when it leaves it."""
    last: Seen | None = None
    for each in seen:
        if each.what.startswith("mode") and (last is None or each[1:3] != last[1:3]):
            yield each
            last = each


def _commanded_again(seen: Sequence[Seen]) -> Iterator[tuple[Seen, Seen]]:
    last: dict[str, Seen] = {}
    for each in seen:
        if each.what.startswith("command"):
            if each.what in last:
                yield last[each.what], each
            last[each.what] = each


def read_log(file: Path) -> Iterator[Seen]:
    """The commands and modes of a log of ArduPilot, with the place and the height above home."""
    log = DFReader.DFReader_binary(str(file))
    place, height_m = (0.0, 0.0), 0.0
    while (message := log.recv_msg()) is not None:
        kind = message.get_type()
        at_s = getattr(message, "TimeUS", 0) / 1e6
        if kind == "POS":
            place, height_m = (message.Lat, message.Lng), message.RelHomeAlt
        elif kind == "MAVC" and message.Res == 0 and message.Cmd in MOVING:
            target = f" {message.X} {message.Y}" if message.Cmd == REPOSITION else ""
            yield Seen(at_s, f"command {message.Cmd}{target}", 0, place, height_m)
        elif kind == "MODE":
            yield Seen(at_s, f"mode {message.Mode}", message.Rsn, place, height_m)
