"""Where real autopilots went, and how far that is from what was commanded.

Positions are those of the autopilots' own telemetry, on a link that m2pem does not have. Places are
metres east and north of an origin.
"""

import math
import socket
import threading
import time
from collections import defaultdict
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

from pymavlink import DFReader
from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import offset

At = tuple[float, float]
"""East and north, m."""
STATION = 253
POSITION_HZ = 10.0
MAVLINK2, MAVLINK2_OVERHEAD = 0xFD, 12
WANTED = (dialect.MAVLINK_MSG_ID_HEARTBEAT, dialect.MAVLINK_MSG_ID_GLOBAL_POSITION_INT)
ARRIVED_M = 5.0
STRAIGHT_RAD = math.radians(4.0)
STRAIGHT_S = 4.0


class Sample(NamedTuple):
    """`at_s`: of the vehicles' clocks, since the tap was made; `boot_s`: of this vehicle's own,
    since it was started; `up_m`: above home; `course_rad`: over ground, clockwise from north."""

    at_s: float
    boot_s: float
    place: At
    up_m: float
    speed_mps: float
    course_rad: float
    mode: int


class Tap:
    """Hears vehicles beside m2pem, each by its system id, and asks them for their position."""

    def __init__(self, origin: At, speed: float) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4 << 20)
        self._socket.bind(("127.0.0.1", 0))
        self._socket.settimeout(0.1)
        self.port: int = self._socket.getsockname()[1]
        self.tracks: dict[int, list[Sample]] = defaultdict(list)
        self._origin = origin
        self._speed = speed
        self._modes: dict[int, int] = {}
        self._sender = dialect.MAVLink(None, STATION, dialect.MAV_COMP_ID_MISSIONPLANNER)
        self._over = False
        self._began_s = time.monotonic()

    @property
    def now_s(self) -> float:
        """Of the vehicles' clocks, since this was made."""
        return (time.monotonic() - self._began_s) * self._speed

    @contextmanager
    def recording(self) -> Iterator["Tap"]:
        """Record in a thread until the end of the block."""
        thread = threading.Thread(target=self._record)
        thread.start()
        try:
            yield self
        finally:
            self._over = True
            thread.join()
            self._socket.close()

    def _record(self) -> None:
        parsers: dict[Any, Any] = defaultdict(lambda: dialect.MAVLink(None))
        while not self._over:
            with suppress(TimeoutError):
                data, peer = self._socket.recvfrom(65536)
                at_s = self.now_s
                for frame in _frames(data):
                    for message in parsers[peer].parse_buffer(frame) or ():
                        self._take(message, peer, at_s)

    def _take(self, message: Any, peer: Any, at_s: float) -> None:
        if message.get_srcComponent() != dialect.MAV_COMP_ID_AUTOPILOT1:
            return
        system = message.get_srcSystem()
        if message.get_type() == "HEARTBEAT":
            if system not in self._modes:
                self._ask(system, peer)
            self._modes[system] = message.custom_mode
        elif message.get_type() == "GLOBAL_POSITION_INT":
            place = east_north(self._origin, (message.lat / 1e7, message.lon / 1e7))
            speed_mps = math.hypot(message.vx, message.vy) / 100
            course_rad = math.atan2(message.vy, message.vx)
            boot_s = message.time_boot_ms / 1e3
            up_m, mode = message.relative_alt / 1e3, self._modes.get(system, -1)
            self.tracks[system].append(
                Sample(at_s, boot_s, place, up_m, speed_mps, course_rad, mode)
            )

    def _ask(self, system: int, peer: Any) -> None:
        ask, id_ = dialect.MAV_CMD_SET_MESSAGE_INTERVAL, dialect.MAVLINK_MSG_ID_GLOBAL_POSITION_INT
        message = dialect.MAVLink_command_long_message(
            *(system, 1, ask, 0, id_, 1e6 / POSITION_HZ, 0, 0, 0, 0, 0)
        )
        self._socket.sendto(message.pack(self._sender), peer)


def _frames(data: bytes) -> Iterator[bytes]:
    """The MAVLink 2 frames of a datagram that are wanted (mavlink.io, "Packet Serialization").

    To decode all that six vehicles send would take too long.
    """
    begin = 0
    while begin + MAVLINK2_OVERHEAD <= len(data) and data[begin] == MAVLINK2:
        end = begin + MAVLINK2_OVERHEAD + data[begin + 1]
        if int.from_bytes(data[begin + 7 : begin + 10], "little") in WANTED:
            yield data[begin:end]
        begin = end


def east_north(origin: At, place: At) -> At:
    """Of a latitude and longitude in degrees, near an origin in degrees."""
    north_deg = offset(origin, 0.0, 1.0)[0] - origin[0]
    east_deg = offset(origin, 1.0, 0.0)[1] - origin[1]
    return (place[1] - origin[1]) / east_deg, (place[0] - origin[0]) / north_deg


class Errors(NamedTuple):
    """In metres."""

    rms_m: float
    most_m: float

    def __str__(self) -> str:
        return f"RMS {self.rms_m:.1f} m, at most {self.most_m:.1f} m"


def errors(values: Sequence[float]) -> Errors:
    """Of distances from what should be, in metres; there is one at least."""
    return Errors(math.sqrt(math.fsum(v * v for v in values) / len(values)), max(values))


def cross_track(places: Sequence[At], lines: Sequence[At]) -> Errors:
    """How far places are from the nearest of the lines through points."""
    return errors([_from_lines(place, lines) for place in places])


def covered(places: Sequence[At], area: Sequence[At], width_m: float) -> tuple[float, float]:
    """The share of an area that a swath of that width along a track covers, and the share that
    more than one pass covers."""
    once = twice = total = 0
    wests, souths = zip(*area, strict=True)
    for east in range(math.ceil(min(wests)), math.floor(max(wests)), 2):
        for north in range(math.ceil(min(souths)), math.floor(max(souths)), 2):
            here = (float(east), float(north))
            if not _inside(here, area):
                continue
            total += 1
            passes = _passes(here, places, width_m / 2)
            once += passes > 0
            twice += passes > 1
    return once / total, twice / total


def _passes(here: At, places: Sequence[At], within_m: float) -> int:
    """How often a track comes so near and leaves again."""
    near = [math.dist(here, place) <= within_m for place in places]
    return sum(now and not before for before, now in pairwise([False, *near]))


def _inside(here: At, area: Sequence[At]) -> bool:
    inside = False
    for (e1, n1), (e2, n2) in pairwise([*area, area[0]]):
        if (n1 > here[1]) != (n2 > here[1]):
            inside ^= here[0] < (e2 - e1) * (here[1] - n1) / (n2 - n1) + e1
    return inside


def _from_lines(place: At, lines: Sequence[At]) -> float:
    return min(_from_line(place, one, other) for one, other in pairwise(lines))


def _from_line(place: At, one: At, other: At) -> float:
    along = (other[0] - one[0], other[1] - one[1])
    length = along[0] ** 2 + along[1] ** 2
    share = ((place[0] - one[0]) * along[0] + (place[1] - one[1]) * along[1]) / (length or 1.0)
    share = min(max(share, 0.0), 1.0)
    return math.dist(place, (one[0] + share * along[0], one[1] + share * along[1]))


def formation_error(
    lead: Sequence[Sample], member: Sequence[Sample], place: At
) -> tuple[Errors, float] | None:
    """How far a member is from its place while the lead goes straight on, from when it was within
    5 m of it first, and how long that took, s. `place` is metres behind the lead and to its left.
    None: it never was."""
    off: list[float] = []
    arrived_s = 0.0
    later = iter(member)
    other = next(later)
    for number, sample in enumerate(lead):
        while other.at_s < sample.at_s and other is not member[-1]:
            other = next(later)
        if not _straight(lead, number):
            continue
        east, north = (other.place[axis] - sample.place[axis] for axis in (0, 1))
        sine, cosine = math.sin(sample.course_rad), math.cos(sample.course_rad)
        behind, left = -(east * sine + north * cosine), north * sine - east * cosine
        error = math.dist((behind, left), place)
        if not off and error > ARRIVED_M:
            continue
        arrived_s = arrived_s or sample.at_s - lead[0].at_s
        off.append(error)
    return (errors(off), arrived_s) if off else None


def _straight(lead: Sequence[Sample], number: int) -> bool:
    """It has kept its course for some seconds."""
    now = lead[number]
    for before in reversed(lead[: number + 1]):
        if now.at_s - before.at_s > STRAIGHT_S:
            return True
        turned = math.remainder(before.course_rad - now.course_rad, math.tau)
        if before.speed_mps < 0.5 or abs(turned) > STRAIGHT_RAD:
            return False
    return False


class Uploaded(NamedTuple):
    """A mission in an autopilot's log: its waypoints, and when the last one was stored, in seconds
    since the autopilot was started."""

    at_s: float
    points: tuple[At, ...]


def logged_missions(folder: Path, origin: At) -> list[Uploaded]:
    """Those that ArduPilot says were uploaded, by its own log in its folder."""
    found: list[Uploaded] = []
    points: list[At] = []
    for log in sorted((folder / "logs").glob("*.BIN")):
        reader = DFReader.DFReader_binary(str(log))
        while (message := reader.recv_match(type="CMD")) is not None:
            if message.CNum == 0:
                points = []
            if message.CId == dialect.MAV_CMD_NAV_WAYPOINT and message.CNum > 0:
                points.append(east_north(origin, (message.Lat, message.Lng)))
            if message.CNum == message.CTot - 1 and len(points) > 1:
                found.append(Uploaded(message.TimeUS / 1e6, tuple(points)))
    return found
