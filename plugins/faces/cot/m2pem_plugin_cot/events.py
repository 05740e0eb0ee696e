"""Events of Cursor on Target (version 2.0) that the face sends.

Positions are WGS-84, and `hae` is the height above the ellipsoid, of altitudes above mean sea level
by the geoid. Altitudes above home or ground have none.
"""

import math
from collections.abc import Sequence
from datetime import UTC, datetime

from lxml import etree

from m2pem.api import (
    US_PER_S,
    Area,
    Detection,
    Point,
    Route,
    VehicleState,
    ellipsoidal_m,
)

UNKNOWN = "9999999.0"
"""Of `hae`, `ce` and `le`: not known."""
TYPES = {"air": "a-f-A-M-H-Q", "ground": "a-f-G-E-V", "surface": "a-f-S-C-U", "subsurface": "a-f-U"}
"""By the domain of a vehicle, friendly: an unmanned rotary-wing aircraft, a ground vehicle, an
unmanned surface vehicle, something under water."""
SPOT, ROUTE, SHAPE, WAYPOINT = "b-m-p-s-m", "b-m-r", "u-d-f", "b-m-p-w"
CONTACT, CHAT = "a-f-G-U-C", "b-t-f"
DELETION = "t-x-d-d"
CHAT_STALE_S = 86_400.0
LATEST_US = 4_102_444_800 * US_PER_S
"""A device whose clock is wrong must not end the face: no calendar has all of its times."""
MACHINE, ENTERED = "m-g", "h-e"
"""How: by a machine with GPS; entered by a human."""

Coordinate = tuple[float, float, float | None]
"""Latitude, longitude and `hae`."""


def vehicle_event(
    uid: str, type_: str, state: VehicleState, stale_s: float, remarks: str
) -> bytes | None:
    """Return the event of a vehicle; None while its position is not known."""
    if state.position is None:
        return None
    at = _placed(*state.position.latlon, state.position.altitude_m)
    event, detail = _event(uid, type_, MACHINE, state.time_us, stale_s, at)
    _add(detail, "contact", callsign=str(state.resource))
    track = {}
    if state.velocity_enu_m_s is not None:
        east, north, _ = state.velocity_enu_m_s
        track["speed"] = f"{math.hypot(east, north):.2f}"
        track["course"] = _course(math.degrees(math.atan2(east, north)))
    if state.yaw_rad is not None:
        track["course"] = _course(90 - math.degrees(state.yaw_rad))
    if track:
        _add(detail, "track", **track)
    if state.battery_fraction is not None:
        _add(detail, "status", battery=f"{100 * state.battery_fraction:.0f}")
    _add(detail, "remarks").text = _printable(remarks)
    return etree.tostring(event)


def detection_event(uid: str, found: Detection, stale_s: float) -> bytes:
    """Return the event of something that a payload has detected."""
    at = _placed(*found.position.latlon, found.position.altitude_m)
    event, detail = _event(uid, SPOT, MACHINE, found.time_us, stale_s, at)
    _add(detail, "contact", callsign=_printable(found.type))
    _add(detail, "remarks").text = _printable(f"{found.type}, detected by {found.source}")
    return etree.tostring(event)


def geometry_event(
    uid: str, name: str, geometry: Point | Route | Area, now_us: int, stale_s: float
) -> bytes:
    """Return the event of a point, a route or an area (its outer ring) of the fleet."""
    match geometry:
        case Point(position, frame):
            at = _placed(*position, frame)
            return _shape(uid, SPOT, name, (at,), at, now_us, stale_s)
        case Route(waypoints):
            places = zip(waypoints, geometry.frames, strict=True)
            corners = [_placed(*each, frame) for each, frame in places]
            return _shape(uid, ROUTE, name, corners, corners[0], now_us, stale_s)
        case Area(rings):
            return _shape(uid, SHAPE, name, rings[0], _middle(rings[0]), now_us, stale_s)


def deletion_event(uid: str, now_us: int) -> bytes:
    """Return the event that deletes one from maps, as TAK's own clients send it; by then it is
    stale."""
    event, detail = _event(f"{uid}.deleted", DELETION, MACHINE, now_us, 0.0, (0.0, 0.0, None))
    _add(detail, "link", uid=_printable(uid), relation="none", type="none")
    _add(detail, "__forcedelete")
    return etree.tostring(event)


def contact_event(
    uid: str,
    callsign: str,
    software: tuple[str, str, str, str],
    at: tuple[float, float, float],
    now_us: int,
    stale_s: float,
) -> bytes:
    """Return the event of a contact. `software`: its name, version, system and device. `at`: its
    latitude, longitude and altitude above mean sea level."""
    event, detail = _event(uid, CONTACT, ENTERED, now_us, stale_s, _placed(*at))
    platform, version, system, device = software
    _add(detail, "takv", platform=platform, version=version, os=system, device=device)
    # The address by which a server sends to it over its connection.
    _add(detail, "contact", callsign=callsign, endpoint="*:-1:stcp")
    _add(detail, "uid", Droid=callsign)
    _add(detail, "__group", name="Cyan", role="HQ")
    return etree.tostring(event)


def chat_event(
    uid: str, callsign: str, to: tuple[str, str], number: int, text: str, now_us: int
) -> bytes:
    """Return a message of chat. `uid`, `callsign`: who sends it; `to`: those of the contact, or
    twice the name of the room, to whom."""
    to_uid, to_callsign = to
    message = f"{uid}.{now_us}.{number}"
    nowhere = (0.0, 0.0, None)
    event, detail = _event(
        f"GeoChat.{uid}.{to_uid}.{message}", CHAT, "h-g-i-g-o", now_us, CHAT_STALE_S, nowhere
    )
    chat = _add(
        detail,
        "__chat",
        parent="RootContactGroup",
        groupOwner="false",
        messageId=message,
        chatroom=_printable(to_callsign),
        id=_printable(to_uid),
        senderCallsign=callsign,
    )
    _add(chat, "chatgrp", uid0=uid, uid1=_printable(to_uid), id=_printable(to_uid))
    _add(detail, "link", uid=uid, type=CONTACT, relation="p-p")
    remarks = {"source": f"BAO.F.ATAK.{uid}", "to": _printable(to_uid), "time": _written(now_us)}
    _add(detail, "remarks", **remarks).text = _printable(text)
    if to_uid != to_callsign:
        _add(_add(detail, "marti"), "dest", callsign=_printable(to_callsign))
    return etree.tostring(event)


def _shape(
    uid: str,
    type_: str,
    name: str,
    corners: Sequence[Coordinate],
    at: Coordinate,
    now_us: int,
    stale_s: float,
) -> bytes:
    event, detail = _event(uid, type_, ENTERED, now_us, stale_s, at)
    for number, (lat, lon, hae_m) in enumerate(corners if len(corners) > 1 else ()):
        place = f"{lat:.7f},{lon:.7f}"
        if type_ == ROUTE:
            place += "" if hae_m is None else f",{hae_m:.1f}"
            link = {"uid": f"{uid}.{number}", "type": WAYPOINT, "relation": "c"}
            _add(detail, "link", **link, point=place, callsign=f"{name} {number + 1}")
        else:
            _add(detail, "link", point=place)
    if type_ == ROUTE:
        _add(
            detail,
            "link_attr",
            method="Driving",
            routetype="Primary",
            order="Ascending Check Points",
        )
    _add(detail, "contact", callsign=_printable(name))
    _add(detail, "remarks")
    return etree.tostring(event)


def _placed(lat: float, lon: float, up_m: float | None, frame: str = "amsl") -> Coordinate:
    return lat, lon, None if up_m is None or frame != "amsl" else ellipsoidal_m(lat, lon, up_m)


def _middle(ring: Sequence[Coordinate]) -> Coordinate:
    corners = ring[:-1] or ring
    lats, lons = [each[0] for each in corners], [each[1] for each in corners]
    return sum(lats) / len(lats), sum(lons) / len(lons), None


def _event(
    uid: str,
    type_: str,
    how: str,
    time_us: int,
    stale_s: float,
    at: Coordinate,
) -> tuple[etree._Element, etree._Element]:
    event = etree.Element("event", version="2.0", uid=_printable(uid), type=type_, how=how)
    event.set("time", _written(time_us))
    event.set("start", _written(time_us))
    event.set("stale", _written(time_us + round(stale_s * US_PER_S)))
    lat, lon, hae_m = at
    hae = f"{hae_m:.1f}" if hae_m is not None and math.isfinite(hae_m) else UNKNOWN
    _add(event, "point", lat=f"{lat:.7f}", lon=f"{lon:.7f}", hae=hae, ce=UNKNOWN, le=UNKNOWN)
    return event, _add(event, "detail")


def _add(parent: etree._Element, tag: str, /, **attributes: str) -> etree._Element:
    return etree.SubElement(parent, tag, attributes)


def _course(degrees: float) -> str:
    """Degrees from true north, clockwise: 0.0 to 359.9."""
    return f"{round(degrees, 1) % 360:.1f}"


def _written(time_us: int) -> str:
    """A moment as xs:dateTime, UTC, in milliseconds; one beyond the year 2100, as that."""
    moment = datetime.fromtimestamp(min(max(time_us, 0), LATEST_US) / US_PER_S, UTC)
    return f"{moment:%Y-%m-%dT%H:%M:%S}.{moment.microsecond // 1000:03d}Z"


def _printable(text: str) -> str:
    """A text without the characters that XML cannot hold."""
    return "".join(each if each.isprintable() else " " for each in text)
