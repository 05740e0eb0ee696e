"""Geometries as GeoJSON (RFC 7946): how fleets, editors and operators name places.

Positions are WGS-84 `[longitude, latitude, altitude]`, in degrees and metres. Altitudes are
relative to home unless a Feature's properties say `"altitude_frame": "amsl"`, `"terrain"` or
`"ellipsoid"`; those above the WGS-84 ellipsoid are read as altitudes above mean sea level. A
route's property `"speeds_m_s"` has a speed or null for each position (`Route.speeds_m_s`).
"""

import json
import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NoReturn

from m2pem.errors import M2pemError
from m2pem.geo.geoid import mean_sea_level_m
from m2pem.geo.polygon import mended, ring_problem
from m2pem.mission.geometry import Area, Coordinate, Geometry, Point, Route
from m2pem.suggestions import suggest
from m2pem.units import article

ALTITUDE_FRAMES = ("relative", "amsl", "terrain")
FILE_FRAMES = (*ALTITUDE_FRAMES, "ellipsoid")
"""What a file may say; `above_sea_level` makes the last of it "amsl"."""

KML_FRAMES = {"relativeToGround": "terrain", "absolute": "amsl"}
"""By the `altitudeMode` of KML."""

KML_CLAMPED = ("clampToGround", "clampToSeaFloor")
"""The modes of KML in which altitudes do not count."""

FRAME_KEYS = ("altitude_frame", "alt_frame", "altitude_f", "altitudemode", "altitudemo")
"""The properties with a frame. The fields of shapefiles have ten characters; the last two are what
GDAL makes of KML."""

SPEEDS, FRAMES = "speeds_m_s", "altitude_frames"
"""The properties, and the extended data of KML, with a value for each waypoint of a route."""

_ROUNDING_DEG = 1e-9
"""Within it a longitude beyond 180 degrees is 180: that of Natural Earth is 180.00000000000014."""

_TYPES = ("LineString", "MultiPoint", "Polygon", "Point", "Feature", "FeatureCollection")


class GeometryError(M2pemError, ValueError):
    """A geometry cannot be used; the message says where in it, why, and what would be right.

    `remedy`: what would be right, where a list of problems has it apart from the message.
    """

    exit_status = 2

    def __init__(self, message: str, remedy: str = "") -> None:
        super().__init__(message)
        self.remedy = remedy


def parse_geojson(
    value: Mapping[str, Any], said: Callable[[str], object] | None = None
) -> Point | Route | Area:
    """Read a GeoJSON geometry, Feature, or FeatureCollection of one feature.

    A LineString or MultiPoint is a `Route`, a Polygon an `Area`, a Point a `Point`. `said`: takes
    what was changed of it, so that it is valid.

    Raises:
        GeometryError: not GeoJSON, another type, a position out of range, a ring not closed.
    """
    return above_sea_level(_parse(value, "relative", 0, said))


def above_sea_level(geometry: Point | Route | Area) -> Point | Route | Area:
    """Return a geometry whose altitudes count from the ellipsoid with those above mean sea level;
    any other one as it is."""
    match geometry:
        case Point(position, "ellipsoid"):
            return Point(_lowered(position), "amsl")
        case Area(rings, "ellipsoid"):
            return Area(tuple(tuple(map(_lowered, ring)) for ring in rings), "amsl")
        case Route(waypoints) if "ellipsoid" in geometry.frames:
            frames = ["amsl" if each == "ellipsoid" else each for each in geometry.frames]
            places = map(_lowered, waypoints, geometry.frames)
            return Route.of(places, frames, geometry.speeds_m_s)
    return geometry


def _lowered(place: Coordinate, frame: str = "ellipsoid") -> Coordinate:
    latitude_deg, longitude_deg, height_m = place
    if height_m is None or frame != "ellipsoid":
        return place
    return latitude_deg, longitude_deg, mean_sea_level_m(latitude_deg, longitude_deg, height_m)


def as_geojson(geometry: Point | Route | Area) -> dict[str, Any]:
    """The GeoJSON Feature that `parse_geojson` reads back as the same geometry."""
    if isinstance(geometry, Point):
        kind, coordinates = "Point", _written(geometry.position)
    elif isinstance(geometry, Route):
        kind = "LineString" if len(geometry.waypoints) > 1 else "MultiPoint"
        coordinates = [_written(each) for each in geometry.waypoints]
    else:
        kind = "Polygon"
        coordinates = [[_written(each) for each in ring] for ring in geometry.rings]
    properties: dict[str, Any] = {"altitude_frame": geometry.altitude_frame}
    if isinstance(geometry, Route) and geometry.speeds_m_s:
        properties[SPEEDS] = list(geometry.speeds_m_s)
    if isinstance(geometry, Route) and geometry.altitude_frames:
        properties[FRAMES] = list(geometry.altitude_frames)
    return {
        "type": "Feature",
        "properties": properties,
        "geometry": {"type": kind, "coordinates": coordinates},
    }


def _written(place: Coordinate) -> list[Any]:
    latitude_deg, longitude_deg, altitude_m = place
    level = [longitude_deg, latitude_deg]
    return level if altitude_m is None else [*level, altitude_m]


def _parse(
    value: object, altitude_frame: str, depth: int, said: Callable[[str], object] | None
) -> Point | Route | Area:
    if not isinstance(value, Mapping):
        raise GeometryError("is not GeoJSON: an object with 'type' is expected")
    check_crs(value)
    kind = value.get("type")
    if kind == "FeatureCollection" and depth == 0:
        features = value.get("features")
        if not isinstance(features, list) or len(features) != 1:
            count = len(features) if isinstance(features, list) else "no"
            raise GeometryError(f"has {count} features; one geometry is expected")
        return _parse(features[0], altitude_frame, 1, said)
    if kind == "Feature" and depth <= 1:
        given = value.get("properties")
        properties: Mapping[str, Any] = given if isinstance(given, Mapping) else {}
        frame, member = stated_frame(properties), value.get("geometry")
        if frame in KML_CLAMPED:
            frame = ""
            if isinstance(member, Mapping):
                member = {**member, "coordinates": _level(member.get("coordinates"))}
        geometry = _parse(member, checked_frame(frame or "relative"), 2, said)
        geometry = with_frames(geometry, properties.get(FRAMES))
        return with_speeds(geometry, properties.get(SPEEDS))
    coordinates = value.get("coordinates")
    if kind == "Point":
        return Point(position(coordinates, "coordinates"), altitude_frame)
    if kind in ("LineString", "MultiPoint"):
        waypoints = _positions(coordinates, "coordinates", 2 if kind == "LineString" else 1)
        return Route(waypoints, altitude_frame)
    if kind == "Polygon":
        if not isinstance(coordinates, list | tuple) or not coordinates:
            raise GeometryError("coordinates: a Polygon is a list of rings")
        rings = tuple(_ring(ring, f"coordinates[{i}]") for i, ring in enumerate(coordinates))
        return Area(checked(rings, said), altitude_frame)
    hint = suggest(str(kind), _TYPES, "types")
    raise GeometryError(f"GeoJSON type {kind!r} is not a route, area or point; {hint}")


def check_crs(value: Mapping[str, Any]) -> None:
    """Refuse the old member 'crs' of an object where it names another system than WGS-84.

    Raises:
        GeometryError: it does.
    """
    if not is_wgs84(value.get("crs")):
        raise GeometryError("its 'crs' is not WGS-84; export it as WGS-84 longitude and latitude")


def crs_name(crs: object) -> str:
    """Return the name of a member `crs` of GeoJSON of 2008, such as EPSG:25832; "" without one."""
    properties = crs.get("properties") if isinstance(crs, Mapping) else {"name": crs}
    given = properties if isinstance(properties, Mapping) else {}
    return f"EPSG:{given['code']}" if "code" in given else str(given.get("name", "")).strip()


def is_wgs84(crs: object) -> bool:
    """Whether a member `crs` says longitude and latitude of WGS-84, or nothing.

    With heights above the ellipsoid (EPSG:4979, CRS84h) it is another system.
    """
    return crs is None or bool(re.search(r"(^|\W)(CRS84|4326)$", crs_name(crs)))


def with_frames(geometry: Point | Route | Area, value: object) -> Point | Route | Area:
    """Return a route with the altitude frames of its waypoints: a list of texts; None: no list.

    Raises:
        GeometryError: it is no route, or the list does not fit it.
    """
    if value is None:
        return geometry
    route, given = _of_waypoints(geometry, value, FRAMES, "them", "one a position")
    return Route.of(route.waypoints, map(checked_frame, given), route.speeds_m_s)


def _of_waypoints(
    geometry: Point | Route | Area, value: object, key: str, what: str, each: str
) -> tuple[Route, Sequence[object]]:
    if not isinstance(geometry, Route):
        raise GeometryError(f"{key}: only a route has {what}, not {article(kind_of(geometry))}")
    count = len(geometry.waypoints)
    if not isinstance(value, list | tuple) or len(value) != count:
        raise GeometryError(f"{key}: a list of {count} is expected, {each}")
    return geometry, value


def with_speeds(geometry: Point | Route | Area, value: object) -> Point | Route | Area:
    """Return a route with the speeds of its waypoints: a list of numbers and nulls; None: no list.

    Raises:
        GeometryError: it is no route, or the list does not fit it.
    """
    if value is None:
        return geometry
    route, given = _of_waypoints(geometry, value, SPEEDS, "speeds", "a speed or null a position")
    speeds = tuple(
        None if each is None else _number(each, "speed", f"{SPEEDS}[{index}]")
        for index, each in enumerate(given)
    )
    for index, speed in enumerate(speeds):
        if speed is not None and speed <= 0:
            raise GeometryError(f"{SPEEDS}[{index}]: speed {speed:g} m/s is not above 0")
    is_given = any(speed is not None for speed in speeds)
    return replace(route, speeds_m_s=speeds if is_given else ())


def stated_frame(properties: Mapping[Any, Any]) -> str:
    """Return the frame that a feature's properties say; "": none."""
    lower = {str(key).lower(): value for key, value in properties.items()}
    said = next((str(lower[key]) for key in FRAME_KEYS if lower.get(key)), "")
    return KML_FRAMES.get(said, said)


def _level(coordinates: Any) -> Any:
    """Return coordinates without their altitudes."""
    if not isinstance(coordinates, list):
        return coordinates
    if coordinates and not isinstance(coordinates[0], list):
        return coordinates[:2]
    return [_level(each) for each in coordinates]


def checked_frame(frame: object, where: str = "") -> str:
    """Return an altitude frame; `where` is for the error.

    Raises:
        GeometryError: there is none of that name.
    """
    if frame not in FILE_FRAMES:
        hint = suggest(str(frame), FILE_FRAMES, "frames")
        raise GeometryError(f"{where}altitude_frame {frame!r} is not known; {hint}")
    return str(frame)


def _ring(value: object, where: str) -> tuple[Coordinate, ...]:
    ring = _positions(value, where, 4)
    if ring[0][:2] != ring[-1][:2]:
        raise GeometryError(f"{where}: a ring ends where it begins; repeat its first position")
    return closed_ring(ring, f"{where}: ")


def closed_ring(corners: Sequence[Coordinate], where: str = "") -> tuple[Coordinate, ...]:
    """Return corners as a ring that ends where it begins; `where` is for the error.

    Raises:
        GeometryError: fewer than three of them differ.
    """
    if len({corner[:2] for corner in corners}) < 3:
        raise GeometryError(f"{where}a ring has at least three different corners")
    is_closed = corners[0][:2] == corners[-1][:2]
    return tuple(corners) if is_closed else (*corners, corners[0])


def checked(
    rings: tuple[tuple[Coordinate, ...], ...], said: Callable[[str], object] | None = None
) -> tuple[tuple[Coordinate, ...], ...]:
    """The closed rings of an area, without parts that have no area: an edge that goes out and back.

    `said`: takes what was changed.

    Raises:
        GeometryError: an edge crosses another or the antimeridian, or a hole lies outside.
    """
    problem = ring_problem(rings)
    if not problem:
        return rings
    valid = mended(rings)
    if valid is None:
        raise GeometryError(problem)
    if said is not None:
        said(f"{problem.partition(';')[0]}: mended, its area is the same")
    return valid


def _positions(value: object, where: str, minimum: int) -> tuple[Coordinate, ...]:
    if not isinstance(value, list | tuple) or len(value) < minimum:
        raise GeometryError(f"{where}: at least {minimum} positions are expected")
    return tuple(position(item, f"{where}[{index}]") for index, item in enumerate(value))


def position(value: object, where: str) -> Coordinate:
    """Read a GeoJSON position `[longitude, latitude, altitude]`; `where` is for the error."""
    if not isinstance(value, list | tuple) or not 2 <= len(value) <= 3:
        raise GeometryError(f"{where}: a position is [longitude, latitude] or with an altitude")
    longitude, latitude = value[0], value[1]
    altitude = value[2] if len(value) == 3 else None
    swapped = "; GeoJSON positions are [longitude, latitude]"
    return coordinate(latitude, longitude, altitude, where, hint=swapped)


def coordinate(
    latitude: object, longitude: object, altitude: object, where: str, hint: str = ""
) -> Coordinate:
    """Check a WGS-84 position in degrees and metres; `altitude` None: not given.

    Raises:
        GeometryError: not numbers, not finite, latitude beyond 90 or longitude beyond 180 deg.
    """
    latitude_deg = _number(latitude, "latitude", where)
    longitude_deg = _number(longitude, "longitude", where)
    if abs(latitude_deg) > 90.0:
        raise GeometryError(f"{where}: latitude {latitude_deg:g} is not within -90..90{hint}")
    if 180.0 < abs(longitude_deg) < 180.0 + _ROUNDING_DEG:
        longitude_deg = math.copysign(180.0, longitude_deg)
    if abs(longitude_deg) > 180.0:
        raise GeometryError(f"{where}: longitude {longitude_deg:g} is not within -180..180{hint}")
    altitude_m = None if altitude is None else _number(altitude, "altitude", where)
    return (latitude_deg, longitude_deg, altitude_m)


def _number(value: object, what: str, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise GeometryError(f"{where}: {what} {value!r} is not a number")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise GeometryError(f"{where}: {what} {value!r} is not finite")
    return number


def decoded(content: bytes) -> str:
    """Return the text of a file in UTF-8, with or without a byte order mark.

    Raises:
        GeometryError: it is not UTF-8.
    """
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise GeometryError("is not UTF-8 text") from None


def parsed_json(text: str) -> Any:
    """Return the value of a JSON text.

    Raises:
        GeometryError: it is not JSON, holds NaN or Infinity, or is nested too deep.
    """
    try:
        return json.loads(text, parse_constant=_refuse_constant)
    except json.JSONDecodeError as error:
        raise GeometryError(f"line {error.lineno}: is not JSON: {error.msg}") from None
    except RecursionError:
        raise GeometryError("is nested too deep") from None
    except GeometryError:
        raise
    except ValueError as error:  # a whole number of thousands of digits
        raise GeometryError(f"is not JSON: {error}") from None


def _refuse_constant(name: str) -> NoReturn:
    raise GeometryError(f"holds {name}, which is not a finite number")


def kind_of(geometry: Geometry) -> str:
    """What people call it: "route", "area", "point" or "vehicle"."""
    if isinstance(geometry, Route):
        return "route"
    if isinstance(geometry, Area):
        return "area"
    return "point" if isinstance(geometry, Point) else "vehicle"
