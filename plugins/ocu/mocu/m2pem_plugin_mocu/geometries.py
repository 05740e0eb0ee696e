"""Routes, areas and waypoints of requests, as the GeoJSON that the executive takes."""

import math
from collections.abc import Sequence
from typing import Any

from m2pem_plugin_ros import check_float

from m2pem.api import Value
from m2pem.errors import OperatorError

MOST_POINTS = 10_000
"""Of one geometry."""

FARTHEST_UP_M = 100_000.0
ALTITUDE_FRAMES = ("relative", "amsl", "terrain")

Position = list[Value]


def route(request: Any) -> dict[str, Value]:
    """Of a SetRoute request.

    Raises:
        OperatorError: it has too few or too many points, or one that is nowhere; the text says
            which.
    """
    positions = _positions(request.waypoints, "waypoints", 2)
    return _feature("LineString", list[Value](positions), request.altitude_frame)


def waypoints(request: Any) -> dict[str, Value]:
    """Of a SetWaypoints request: a point, if there is one only. Errors as for `route`."""
    positions = _positions(request.waypoints, "waypoints", 1)
    if len(positions) == 1:
        return _feature("Point", positions[0], request.altitude_frame)
    return _feature("MultiPoint", list[Value](positions), request.altitude_frame)


def area(request: Any) -> dict[str, Value]:
    """Of a SetArea request. Errors as for `route`."""
    _bound(len(request.outline.points) + sum(len(hole.points) for hole in request.holes))
    rings = [_ring(request.outline.points, "outline.points")]
    rings += [_ring(hole.points, f"holes[{i}].points") for i, hole in enumerate(request.holes)]
    return _feature("Polygon", list[Value](rings), request.altitude_frame)


def _feature(kind: str, coordinates: Value, altitude_frame: str) -> dict[str, Value]:
    frame = altitude_frame or "relative"
    if frame not in ALTITUDE_FRAMES:
        raise OperatorError(
            f"altitude_frame {altitude_frame!r} is not known; give one of: "
            f"{', '.join(ALTITUDE_FRAMES)}"
        )
    return {
        "type": "Feature",
        "properties": {"altitude_frame": frame},
        "geometry": {"type": kind, "coordinates": coordinates},
    }


def _ring(points: Sequence[Any], where: str) -> Value:
    positions = _positions(points, where, 3)
    if positions[0][:2] == positions[-1][:2]:  # it was closed already, and that does no harm
        positions.pop()
    if len({(place[0], place[1]) for place in positions}) < 3:
        raise OperatorError(f"{where} has fewer than three different corners, and encloses nothing")
    return [*positions, positions[0]]


def _positions(points: Sequence[Any], where: str, fewest: int) -> list[Position]:
    if len(points) < fewest:
        raise OperatorError(f"{where} has {len(points)} points; it needs {fewest} or more")
    _bound(len(points))
    return [_position(point, f"{where}[{place}]") for place, point in enumerate(points)]


def _bound(points: int) -> None:
    if points > MOST_POINTS:
        raise OperatorError(
            f"it has {points:,} points; {MOST_POINTS:,} are the most that it may have: leave out "
            "points that lie on a line"
        )


def _position(point: Any, where: str) -> Position:
    latitude = _within(point.latitude_deg, 90.0, f"{where}.latitude_deg")
    longitude = _within(point.longitude_deg, 180.0, f"{where}.longitude_deg")
    if math.isnan(point.altitude_m):
        return [longitude, latitude]
    return [longitude, latitude, _within(point.altitude_m, FARTHEST_UP_M, f"{where}.altitude_m")]


def _within(number: float, limit: float, where: str) -> float:
    check_float(where, number)
    if not abs(number) <= limit:
        raise OperatorError(f"{where} is {number:g}, which is not within -{limit:g} to {limit:g}")
    return number
