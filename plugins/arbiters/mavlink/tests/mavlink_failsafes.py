"""Failsafes of a real ArduCopter while m2pem runs a mission on it: what each of the two does.

A cell is a failsafe in a phase of a mission. It is played with the real program, `m2pem run` as a
user starts it, and a second ground station that brings the failsafe about and looks on. What was
seen is kept in `traces/failsafes.json`; docs/failsafes.md is made of that.
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

from m2pem_plugin_mavlink.sim.specification import Kind
from m2pem_plugin_mavlink.sitl.frames import FRAMES
from m2pem_plugin_mavlink.sitl.launch import Start, ardupilot_launch
from m2pem_plugin_mavlink.sitl.processes import running
from m2pem_plugin_mavlink.sitl.programs import ardupilot_program
from mavlink_sitl import free_port
from mavlink_station import SECOND, Station
from mavlink_wires import UdpWire
from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.testing.scenarios import ORIGIN, one_after_another

FILE = Path(__file__).parent / "traces/failsafes.json"
SPEED = 10
HIGH_M = 12.0
AFTERWARDS_S = 90.0
"""So long the vehicle is watched after the mission, unless its motors stop."""
LATITUDE, LONGITUDE, ALTITUDE_M = ORIGIN
NORTH = f"[{LATITUDE + 0.0008},{LONGITUDE}]"
CORNERS = [
    (LONGITUDE + east, LATITUDE + north)
    for north, east in ((0.0003, 0.0), (0.0012, 0.0), (0.0012, 0.001), (0.0003, 0.001))
]
AREA = {
    "type": "Feature",
    "properties": {},
    "geometry": {"type": "Polygon", "coordinates": [[*CORNERS, CORNERS[0]]]},
}
UP: tuple[str, Mapping[str, object]] = ("takeoff", {"altitude": "30 m"})


class Phase(NamedTuple):
    """`steps`: the behaviors of the mission; `now`: whether it is time for the failsafe."""

    name: str
    steps: tuple[tuple[str, Mapping[str, object]], ...]
    now: Callable[[Station], bool]


PHASES = {
    phase.name: phase
    for phase in (
        Phase("on the ground", (UP,), lambda s: s.located),
        Phase("taking off", (("takeoff", {"altitude": "90 m"}),), lambda s: s.height_m > HIGH_M),
        Phase(
            "in a survey",
            (UP, ("area_survey", {"area": "field", "spacing": "20 m", "altitude": "30 m"})),
            lambda s: s.mode == "AUTO" and s.known.get("current", 0) > 1,
        ),
        Phase(
            "in RTL",
            (UP, ("goto", {"target": NORTH}), ("return_to_launch", {})),
            lambda s: s.mode == "RTL",
        ),
        Phase(
            "landing",
            (UP, ("goto", {"target": NORTH}), ("land", {})),
            lambda s: s.mode == "LAND",
        ),
    )
}


class Failsafe(NamedTuple):
    """`parameters`: set from the beginning; `cause`: brings it about; `end`: ends it after 20 s."""

    name: str
    parameters: Mapping[str, float]
    cause: Callable[["Play"], None]
    end: Callable[["Play"], None] = lambda play: None


def _set(parameter: str, value: float) -> Callable[["Play"], None]:
    return lambda play: play.station.set_quietly(parameter, value)


def _cut(play: "Play") -> None:
    play.relay.cut = True


def _mend(play: "Play") -> None:
    play.relay.cut = False


def _second(command: int, *params: float) -> Callable[["Play"], None]:
    return lambda play: play.station.command_quietly(command, *params)


def _clear(play: "Play") -> None:
    play.station.send(dialect.MAVLink_mission_clear_all_message(1, 1, 0), SECOND)


def _restart(play: "Play") -> None:
    """Forced, as it is in flight."""
    reboot = dialect.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN
    play.station.command_quietly(reboot, 1, 0, 0, 0, 0, 20190226)
    play.station.start_anew()


MODE = dialect.MAV_CMD_DO_SET_MODE
VOLTS = "SIM_BATT_VOLTAGE"
FAILSAFES = {
    failsafe.name: failsafe
    for failsafe in (
        Failsafe("ground station lost for 20 s, RTL", {}, _cut, _mend),
        Failsafe("battery low, no action", {"BATT_FS_LOW_ACT": 0}, _set(VOLTS, 10.4)),
        Failsafe("battery low, RTL", {"BATT_FS_LOW_ACT": 2}, _set(VOLTS, 10.4)),
        Failsafe(
            "battery critical, LAND",
            {"BATT_CRT_VOLT": 10.45, "BATT_FS_CRT_ACT": 1},
            _set(VOLTS, 10.3),
        ),
        Failsafe("radio of the pilot lost, RTL", {"FS_THR_ENABLE": 1}, _set("SIM_RC_FAIL", 1)),
        Failsafe("no GPS (EKF failsafe)", {}, _set("SIM_GPS1_ENABLE", 0)),
        Failsafe(
            "fence breached, RTL",
            {"FENCE_ENABLE": 1, "FENCE_TYPE": 1, "FENCE_ALT_MAX": 100, "FENCE_ACTION": 1},
            _set("FENCE_ALT_MAX", 10),
        ),
        Failsafe("motors fail, crash check", {"SIM_ENGINE_MUL": 0.0}, _set("SIM_ENGINE_FAIL", 15)),
        Failsafe(
            "the autopilot restarts",
            {},
            _restart,
        ),
        Failsafe("a second ground station: mode LOITER", {}, _second(MODE, 1, 5)),
        Failsafe("a second ground station: mode RTL", {}, _second(MODE, 1, 6)),
        Failsafe("a second ground station: clears the mission", {}, _clear),
    )
}


@dataclass
class Play:
    """A cell that is being played."""

    station: Station
    relay: "Relay"


@dataclass
class Relay:
    """Between an autopilot and m2pem; `cut`: nothing passes."""

    to_port: int
    cut: bool = False
    port: int = 0
    _stopped: bool = False
    _sockets: list[socket.socket] = field(default_factory=list)

    @contextmanager
    def run(self) -> Iterator["Relay"]:
        """Pass datagrams on in a thread."""
        near, far = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2))
        near.bind(("127.0.0.1", 0))
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


def play(failsafe: Failsafe, phase: Phase, binary: Path, instance: int) -> dict[str, Any]:
    """What a real ArduCopter and m2pem do.

    `modes`: of the vehicle, from the failsafe on; `texts`: its warnings; `end`: how the behavior
    ended; `said`: what operators read from the failsafe on; `status`: of m2pem; `disarmed`: the
    motors stopped; `at home`: it was then within 4 m of where it took off.
    """
    wire = UdpWire(Kind.COPTER, "ardupilot")
    frame = FRAMES["quad"]
    with TemporaryDirectory() as name, Relay(free_port()).run() as relay:
        folder = Path(name)
        launch = ardupilot_launch(
            "quad",
            ardupilot_program(binary, frame),
            frame,
            Start(LATITUDE, LONGITUDE, ALTITUDE_M, speed=SPEED),
            instance=instance,
            system_id=1,
            ports=[relay.port, wire.port],
            parameters={"FS_GCS_ENABLE": 1, **failsafe.parameters},
        )
        with running([launch], folder):
            try:
                return _played(failsafe, phase, Play(Station(wire), relay), folder)
            finally:
                wire.close()


def _played(failsafe: Failsafe, phase: Phase, cell: Play, folder: Path) -> dict[str, Any]:
    s = cell.station
    s.beats = False
    s.connect()
    s.ready()
    grounded = phase.name == "on the ground"
    if grounded:
        failsafe.cause(cell)
        s.watch(3.0)
    with _mission(phase, cell.relay.to_port, folder) as (process, lines):
        s.until("begun", lambda: bool(lines) or process.poll() is not None, 120.0)
        if not grounded:
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
        "at home": s.distance_m() < 4.0,
    }


def _plain(line: str) -> str:
    """Without the time."""
    return re.sub(r"^\s*\d+\.\d s\s+", "", line)


@contextmanager
def _mission(
    phase: Phase, port: int, folder: Path
) -> Iterator[tuple["subprocess.Popen[str]", list[str]]]:
    (folder / "mission.bpmn").write_bytes(one_after_another("uav1", *phase.steps))
    (folder / "field.geojson").write_text(json.dumps(AREA), encoding="utf-8")
    (folder / "fleet.yaml").write_text(FLEET.format(port=port), encoding="utf-8")
    words = ("run", "mission.bpmn", "--fleet", "fleet.yaml", "--speed", SPEED)
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
  uav1:
    domain: air
    arbiter: mavlink
    connection: {{url: "udpin://127.0.0.1:{port}", system_id: 1}}
    lost_after: 10 s
    sitl: true
    failsafe: return_to_launch
areas: {{field: field.geojson}}
"""
