"""The gimbal of a real ArduCopter: a camera points, scans and tracks while the copter flies.

The judge is ArduPilot's own log: where its mount pointed, and where the copter was.
"""

import json
import math
from collections.abc import Iterator
from operator import mul
from pathlib import Path
from typing import NamedTuple, TypeAlias

import mavlink_sitl
import pytest
from mavlink_mission_flights import Flight, fly
from mavlink_tracks import At, east_north
from pymavlink import DFReader
from test_mavlink_sitl_tracks import completed, said

from m2pem.api import offset
from m2pem.testing.scenarios import ORIGIN, side_by_side

pytestmark = [pytest.mark.timeout(400), pytest.mark.sitl("M2PEM_ARDUCOPTER")]

SETTLED_S = 3.0
LATE_S = 1.5
SCANNED_AT_DEG = -20.0

TOWER: At = (60.0, 40.0)
"""East and north of the origin, on the ground, m."""


def _at(east_m: float, north_m: float) -> str:
    latitude, longitude = offset(ORIGIN[:2], east_m, north_m)
    return f"[{latitude:.7f}, {longitude:.7f}]"


Vector: TypeAlias = tuple[float, float, float]


class Pointing(NamedTuple):
    """Where the mount pointed: seconds since the start of the autopilot, the heading from north and
    the elevation in degrees, and how far the camera's axis was from the tower, in degrees."""

    boot_s: float
    heading_deg: float
    elevation_deg: float
    off_deg: float


@pytest.fixture
def fleet(tmp_path: Path) -> Path:
    text = {
        "version": 1,
        "name": "gimbal",
        "origin": {"lat": ORIGIN[0], "lon": ORIGIN[1], "alt": 60.0},
        "vehicles": {
            "uav1": {
                "domain": "air",
                "arbiter": "mavlink",
                "sitl": True,
                "lost_after": "60 s",
                "connection": {
                    "url": f"udpin://127.0.0.1:{mavlink_sitl.free_port()}",
                    "system_id": 1,
                    "sitl": {"parameters": {**mavlink_sitl.MOUNT, "LOG_DISARMED": 1}},
                },
                "payloads": {
                    "cam": {
                        "arbiter": "ptz",
                        "connection": {
                            "driver": "mavlink",
                            "stabilized": True,
                            "mounting": {"up": "0 m"},
                            "reach": {
                                "pan": ["-160 deg", "160 deg"],
                                "tilt": ["-90 deg", "25 deg"],
                            },
                        },
                    }
                },
            }
        },
        "points": {"tower": "tower.geojson"},
    }
    place = offset(ORIGIN[:2], *TOWER)[::-1]
    geometry = {"type": "Point", "coordinates": place}
    feature = {"type": "Feature", "properties": {}, "geometry": geometry}
    (tmp_path / "tower.geojson").write_text(json.dumps(feature), encoding="utf-8")
    file = tmp_path / "fleet.yaml"
    file.write_text(json.dumps(text), encoding="utf-8")
    return file


@pytest.fixture
def programs(tmp_path: Path) -> Path:
    return mavlink_sitl.programs_folder(tmp_path / "bin", "arducopter")


def pointings(folder: Path, origin: At) -> Iterator[Pointing]:
    """By the log in an autopilot's folder. MNT has what the servos are turned to, from the bow and
    the deck, ATT how the copter leans."""
    place, up_m = (0.0, 0.0), 0.0
    attitude = (0.0, 0.0, 0.0)
    for log in sorted((folder / "logs").glob("*.BIN")):
        reader = DFReader.DFReader_binary(str(log))
        while (message := reader.recv_match(type=["POS", "ATT", "MNT"])) is not None:
            match message.get_type():
                case "POS":
                    place = east_north(origin, (message.Lat, message.Lng))
                    up_m = message.RelHomeAlt
                case "ATT":
                    attitude = (message.Roll, message.Pitch, message.Yaw)
                case "MNT":
                    ahead = _turned((1.0, 0.0, 0.0), (0.0, message.Pitch, message.YawB))
                    north, east, down = _turned(ahead, attitude)
                    elevation = math.degrees(math.asin(-down))
                    heading = math.degrees(math.atan2(east, north))
                    target = (TOWER[1] - place[1], TOWER[0] - place[0], up_m)
                    cosine = sum(map(mul, (north, east, down), target)) / math.hypot(*target)
                    off = math.degrees(math.acos(min(1.0, cosine)))
                    yield Pointing(message.TimeUS / 1e6, heading, elevation, off)


def _turned(vector: Vector, angles: Vector) -> Vector:
    """From the axes of a body (forward, right, down) that leans and heads so (roll, pitch and yaw
    in degrees) to those that it is meant in."""
    roll, pitch, yaw = (math.radians(angle) for angle in angles)
    x, y, z = vector
    y, z = y * math.cos(roll) - z * math.sin(roll), y * math.sin(roll) + z * math.cos(roll)
    x, z = x * math.cos(pitch) + z * math.sin(pitch), z * math.cos(pitch) - x * math.sin(pitch)
    x, y = x * math.cos(yaw) - y * math.sin(yaw), x * math.sin(yaw) + y * math.cos(yaw)
    return x, y, z


def boot_s(flight: Flight, at_s: float) -> float:
    """A time of the recorder as one of the copter's own clock."""
    nearest = min(flight.tracks["uav1"], key=lambda sample: abs(sample.at_s - at_s))
    return nearest.boot_s


def seen(flight: Flight, folder: Path, name: str) -> list[Pointing]:
    """Where the mount pointed during a behavior that has succeeded, and a little later: a record is
    read some tenths of a second after what it says has come about."""
    ((_, begin_s, end_s),) = flight.behaviors(name)
    begin_s, end_s = boot_s(flight, begin_s), boot_s(flight, end_s) + LATE_S
    return [p for p in pointings(folder, flight.origin) if begin_s <= p.boot_s <= end_s]


def at_the_height_of_the_scan(pointing: Pointing) -> bool:
    """The camera is not on the way to another task."""
    return abs(pointing.elevation_deg - SCANNED_AT_DEG) < 1.0


@pytest.mark.tried_with(
    "ArduCopter",
    "a camera points, scans and tracks",
    kind="Autopilots",
    result="looks where the mission says",
    version="4.7.0-dev",
    on="2026-11",
)
def test_a_camera_on_a_real_copter_points_scans_and_tracks(
    programs: Path, fleet: Path, tmp_path: Path
) -> None:
    flying = (
        ("takeoff", {"altitude": "30 m"}),
        ("goto", {"target": _at(0, 100), "speed": "4 m/s"}),
    )
    looking = (
        (
            "ptz_scan_sector",
            {"heading": "0 deg", "sector": "90 deg", "elevation": f"{SCANNED_AT_DEG} deg"},
        ),
        ("ptz_point_at", {"target": "tower"}),
        ("ptz_track", {"target": "tower", "duration": "40 s"}),
    )
    mission = tmp_path / "mission.bpmn"
    mission.write_bytes(side_by_side(("uav1", flying), ("uav1/cam", looking)))
    flight = fly(programs, fleet, mission, tmp_path / "vehicles", 3.0)
    completed(flight)
    folder = tmp_path / "vehicles/uav1"

    level = [p for p in seen(flight, folder, "ptz_scan_sector") if at_the_height_of_the_scan(p)]
    headings = [p.heading_deg for p in level]
    said("ptz_scan_sector", f"headings {min(headings):.0f} to {max(headings):.0f} deg")
    assert -48 < min(headings) < -42
    assert 42 < max(headings) < 48

    ((_, _, pointed_s),) = flight.behaviors("ptz_point_at")
    pointed_s = boot_s(flight, pointed_s)
    pointed = next(each for each in pointings(folder, flight.origin) if each.boot_s > pointed_s)
    said("ptz_point_at", f"{pointed.off_deg:.1f} deg beside the tower at its end")
    assert pointed.off_deg < 2.0

    tracked = seen(flight, folder, "ptz_track")
    off = [each.off_deg for each in tracked if each.boot_s > tracked[0].boot_s + SETTLED_S]
    rms = math.sqrt(math.fsum(each**2 for each in off) / len(off))
    said("ptz_track", f"RMS {rms:.1f} deg, at most {max(off):.1f} deg")
    assert rms < 3.0
