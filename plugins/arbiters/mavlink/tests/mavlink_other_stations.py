"""Acts of another ground station while m2pem runs a mission on a real autopilot.

Each act is played with the autopilot's own program, `m2pem run` as a user starts it, and a second
ground station, which acts in a phase of the mission and looks on.
"""

import re
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from m2pem_plugin_mavlink.sitl.launch import px4_port, running
from mavlink_failsafe_cells import COPTER, GO, PX4, RETURN, ROVER, UP
from mavlink_failsafes import (
    GROUND_STATION_PORT,
    LATITUDE,
    LONGITUDE,
    Play,
    Relay,
    Vehicle,
    launch,
    mission,
)
from mavlink_sitl import free_port
from mavlink_station import SECOND, Station
from mavlink_wires import UdpWire
from pymavlink.dialects.v20 import ardupilotmega as dialect

FORCE = 21196
"""Parameter 2 of MAV_CMD_COMPONENT_ARM_DISARM: disarm in flight."""
MODE = dialect.MAV_CMD_DO_SET_MODE
PLACE_ALONE = 0b1101_1111_1000
"""POSITION_TARGET_TYPEMASK: a position."""
FAR = f"[{LATITUDE + 0.0027},{LONGITUDE}]"
"""300 m to the north."""
ELSEWHERE = (LATITUDE, LONGITUDE + 0.0016)
"""140 m to the east of where the vehicle begins."""
EARLY, LATE = 4, 8
"""Items of a mission of nine or more."""

GO_FAR: tuple[str, Mapping[str, object]] = ("goto", {"target": FAR})
CORNERS = [(LATITUDE + 0.0004 * (n % 9), LONGITUDE + 0.0004 * (n % 2)) for n in range(1, 10)]
ROUTE: tuple[str, Mapping[str, object]] = (
    "single_vehicle_routing",
    {"route": "zigzag", "altitude": "30 m"},
)
LAND: tuple[str, Mapping[str, object]] = ("land", {})


class Act(NamedTuple):
    """What another station does in a phase of a mission, and what m2pem makes of it.

    `steps`: the behaviors of the mission; `now`: it is time; `act`: what the station does; `says`:
    pattern of the line that operators read, `within_s` of the autopilot's time; `not_in`: modes in
    which m2pem must not bring the vehicle afterwards; `later`: what the station does 15 s later;
    `status`: of `m2pem run`; None: any.
    """

    name: str
    steps: tuple[tuple[str, Mapping[str, object]], ...]
    now: Callable[[Station], bool]
    act: Callable[[Play], None]
    says: str
    within_s: float = 2.0
    not_in: tuple[str, ...] = ()
    later: Callable[[Play], None] | None = None
    status: int | None = 1
    parameters: Mapping[str, float] = {}


@dataclass
class Seen:
    """`lines`: what operators read after the act, with the seconds since it; `modes`: of the
    vehicle since then."""

    lines: list[tuple[float, str]] = field(default_factory=list)
    modes: list[str] = field(default_factory=list)
    status: int | None = None
    armed: bool = False

    def at_s(self, pattern: str) -> float | None:
        """When operators first read a line; None: never."""
        return next((at_s for at_s, line in self.lines if re.search(pattern, line)), None)


# --- what the other station does ------------------------------------------------------------------


def command(command: int, *params: float) -> Callable[[Play], None]:
    return lambda play: play.station.command_quietly(command, *params)


def set_current(seq: int) -> Callable[[Play], None]:
    """MISSION_SET_CURRENT, a message without an acknowledgement."""
    make = dialect.MAVLink_mission_set_current_message
    return lambda play: play.station.send(make(play.station.system, 1, seq), SECOND)


def reposition(play: Play) -> None:
    """DO_REPOSITION to elsewhere, 30 m above home."""
    station = play.station
    assert station.home is not None
    frame, up_m = dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT, 30.0
    if station.px4:
        frame, up_m = dialect.MAV_FRAME_GLOBAL, 30.0 + station.home[2]
    make = dialect.MAVLink_command_int_message
    at = (round(ELSEWHERE[0] * 1e7), round(ELSEWHERE[1] * 1e7), up_m)
    reposition = dialect.MAV_CMD_DO_REPOSITION
    station.send(
        make(station.system, 1, frame, reposition, 0, 0, -1, 1, 0, float("nan"), *at), SECOND
    )


def set_position(play: Play) -> None:
    """SET_POSITION_TARGET_GLOBAL_INT to elsewhere."""
    make = dialect.MAVLink_set_position_target_global_int_message
    at = (round(ELSEWHERE[0] * 1e7), round(ELSEWHERE[1] * 1e7), 30.0)
    frame = dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT
    s = play.station
    s.send(make(0, s.system, 1, frame, PLACE_ALONE, *at, *[0.0] * 8), SECOND)


def move_home(play: Play) -> None:
    """DO_SET_HOME, 360 m to the east."""
    station = play.station
    assert station.home is not None
    at = (round(LATITUDE * 1e7), round((LONGITUDE + 0.0041) * 1e7), station.home[2])
    make = dialect.MAVLink_command_int_message
    frame, home = dialect.MAV_FRAME_GLOBAL, dialect.MAV_CMD_DO_SET_HOME
    station.send(make(station.system, 1, frame, home, 0, 0, 0, 0, 0, 0, *at), SECOND)


def set_parameter(name: str, value: float) -> Callable[[Play], None]:
    return lambda play: play.station.parameter(name, value)


# --- when -----------------------------------------------------------------------------------------


def at_item(number: int) -> Callable[[Station], bool]:
    return lambda s: s.mode == s.auto and int(s.known.get("current", 0)) >= number


def in_mode(mode: str, above_m: float = 0.0) -> Callable[[Station], bool]:
    return lambda s: s.mode == mode and s.height_m > above_m


def on_the_way(s: Station) -> bool:
    """40 m from where it began, and still under way."""
    return s.mode == s.guided and 40.0 < s.distance_m() < 200.0


DISARM = command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 0, FORCE)
IN_THE_AIR = r"FAILED.*disarmed \d+ m above"
TAKEN = r"TAKEN_OVER"
HELD = ("BRAKE", "LOITER", "HOLD")

COMMON = (
    Act("disarmed in land", (UP, LAND), in_mode("LAND", 20.0), DISARM, IN_THE_AIR),
    Act("disarmed in RTL", (UP, GO, RETURN), in_mode("RTL", 15.0), DISARM, IN_THE_AIR),
    Act("disarmed in a mission", (UP, ROUTE), at_item(3), DISARM, IN_THE_AIR),
    Act(
        "DO_REPOSITION in goto",
        (UP, GO_FAR),
        on_the_way,
        reposition,
        TAKEN,
        not_in=HELD[:1],
    ),
    Act(
        "home moved, then RTL",
        (UP, GO, RETURN),
        in_mode("RTL", 15.0),
        move_home,
        r"home.*3[56]\d m",
        within_s=4.0,
        status=None,
    ),
)
ACTS: dict[str, tuple[Vehicle, Act]] = {}


def _add(vehicle: Vehicle, *acts: Act) -> None:
    ACTS.update({f"{vehicle.name}: {each.name}": (vehicle, each) for each in acts})


_add(
    COPTER,
    *COMMON,
    Act("SET_POSITION_TARGET in goto", (UP, GO_FAR), on_the_way, set_position, TAKEN, not_in=HELD),
    Act("MISSION_SET_CURRENT", (UP, ROUTE), at_item(EARLY), set_current(LATE), TAKEN, not_in=HELD),
    Act(
        "DO_SET_MISSION_CURRENT",
        (UP, ROUTE),
        at_item(EARLY),
        command(dialect.MAV_CMD_DO_SET_MISSION_CURRENT, LATE),
        TAKEN,
        not_in=HELD,
    ),
    Act(
        "paused and continued",
        (UP, ROUTE),
        at_item(3),
        command(dialect.MAV_CMD_DO_PAUSE_CONTINUE, 0),
        "paused by another station",
        not_in=HELD,
        later=command(dialect.MAV_CMD_DO_PAUSE_CONTINUE, 1),
        status=0,
    ),
    *(
        Act(
            f"{name} set",
            (UP, GO_FAR),
            on_the_way,
            set_parameter(name, value),
            rf"{name}.*{value:g}",
            status=0,
        )
        for name, value in (
            ("WPNAV_SPEED", 900.0),
            ("RTL_ALT", 2100.0),
            ("FENCE_ENABLE", 1.0),
            ("FS_GCS_ENABLE", 0.0),
        )
    ),
)
_add(
    PX4,
    *COMMON,
    Act("MISSION_SET_CURRENT", (UP, ROUTE), at_item(EARLY), set_current(LATE), TAKEN, not_in=HELD),
    Act(
        "DO_SET_MISSION_CURRENT",
        (UP, ROUTE),
        at_item(EARLY),
        command(dialect.MAV_CMD_DO_SET_MISSION_CURRENT, LATE),
        TAKEN,
        not_in=HELD,
    ),
    Act(
        "held and continued",
        (UP, ROUTE),
        at_item(3),
        command(MODE, 1, 4, 3),
        "paused by another station",
        within_s=3.0,
        later=command(MODE, 1, 4, 4),
        status=0,
    ),
    *(
        Act(
            f"{name} set",
            (UP, GO_FAR),
            on_the_way,
            set_parameter(name, value),
            rf"{name}.*{value:g}",
            status=0,
        )
        for name, value in (("MPC_XY_CRUISE", 4.0), ("RTL_RETURN_ALT", 21.0), ("NAV_DLL_ACT", 0.0))
    ),
)
_add(
    ROVER,
    Act(
        "disarmed in a mission",
        (("single_vehicle_routing", {"route": "zigzag"}),),
        at_item(3),
        DISARM,
        r"TAKEN_OVER.*disarmed",
    ),
    Act("DO_REPOSITION in goto", (GO_FAR,), on_the_way, reposition, TAKEN, not_in=HELD),
    Act(
        "MISSION_SET_CURRENT",
        (("single_vehicle_routing", {"route": "zigzag"}),),
        at_item(EARLY),
        set_current(LATE),
        TAKEN,
        not_in=HELD,
    ),
)

ZIGZAG = (
    '{"type": "Feature", "properties": {}, "geometry": {"type": "LineString", "coordinates": ['
    + ", ".join(f"[{longitude}, {latitude}]" for latitude, longitude in CORNERS)
    + "]}}"
)

ROUTES = "routes: {zigzag: zigzag.geojson}\n"


def play(vehicle: Vehicle, act: Act, binary: Path, instance: int, watch_s: float = 90.0) -> Seen:
    """What a real autopilot and m2pem do; `watch_s`: for how long at most after the act, by the
    autopilot's clock."""
    px4 = vehicle.firmware == "px4"
    wire = UdpWire(vehicle.kind, vehicle.firmware, GROUND_STATION_PORT if px4 else 0)
    relayed = Relay(free_port(), px4_port(instance) if px4 else 0)
    try:
        with TemporaryDirectory() as name, relayed.run() as relay:
            folder = Path(name)
            started = launch(vehicle, act.parameters, binary, instance, wire, relay, folder)
            with running([started], folder):
                station = Station(wire, instance + 1 if px4 else 1)
                return _played(vehicle, act, Play(station, relay), folder, watch_s)
    finally:
        wire.close()


def _played(vehicle: Vehicle, act: Act, cell: Play, folder: Path, watch_s: float) -> Seen:
    s, seen = cell.station, Seen()
    s.beats = False
    s.connect()
    s.ready()
    (folder / "zigzag.geojson").write_text(ZIGZAG, encoding="utf-8")
    port = cell.relay.to_port
    with mission(vehicle, act.steps, s.system, port, folder, ROUTES) as (process, lines):
        if not s.until("phase", lambda: act.now(s) or process.poll() is not None, 300.0):
            process.kill()
            process.wait()
        if process.poll() is not None:
            raise RuntimeError(f"the phase did not come: {s.mode}, {s.trace[-2:]}, {lines}")
        s.watch(2.0)  # m2pem has then seen the mode that it commanded
        read, stopped = len(lines), threading.Event()
        s.forget()
        s.begin(act.name)
        began = time.monotonic()

        def follow() -> None:
            nonlocal read
            while not stopped.is_set() or read < len(lines):
                while read < len(lines):
                    at_s = (time.monotonic() - began) * vehicle.speed
                    seen.lines.append((at_s, lines[read]))
                    read += 1
                time.sleep(0.01)

        follower = threading.Thread(target=follow)
        follower.start()
        act.act(cell)
        if act.later is not None:
            s.watch(15.0)
            act.later(cell)
            watch_s *= 3
        if not s.until("over", lambda: process.poll() is not None, watch_s):
            process.kill()
        else:
            seen.status = process.poll()
        process.wait()
    stopped.set()
    follower.join()
    s.watch(3.0)
    seen.modes = s.trace[-1].get("mode", []) if s.trace else []
    seen.armed = s.armed
    return seen
