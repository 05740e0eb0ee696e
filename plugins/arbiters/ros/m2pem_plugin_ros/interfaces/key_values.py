"""m2pem_interfaces/msg/KeyValue: parameters and outputs of behaviors, as JSON and GeoJSON.

Data that is read comes from a network, and is checked. An error names the wrong key.
"""

import json
import math
from collections.abc import Iterable, Mapping
from typing import Any

from m2pem.api import Area, Point, ResolvedValue, Route, Value, VehiclePosition

Coordinate = tuple[float, float, float | None]
"""Latitude and longitude in degrees, altitude in metres or None."""

ALTITUDE_FRAMES = ("relative", "amsl", "terrain")
LONGEST = 4_000_000
"""Characters of a value. A route of 50,000 waypoints has about as many."""


class WireError(ValueError):
    """A value cannot be sent, or a received one cannot be read."""


def encode_parameters(parameters: Mapping[str, ResolvedValue]) -> list[tuple[str, str]]:
    """Return keys and their values as JSON. Values that are None are left out.

    Raises:
        WireError: a value cannot be encoded, such as NaN.
    """
    return [(key, _encoded(key, value)) for key, value in parameters.items() if value is not None]


def decode_parameters(pairs: Iterable[tuple[str, str]]) -> dict[str, ResolvedValue]:
    """Return the values by key.

    Raises:
        WireError: a value is not JSON, is not finite, or breaks the rules of msg/KeyValue.msg.
    """
    values: dict[str, ResolvedValue] = {}
    for key, text in pairs:
        if not key:
            raise WireError("a parameter has no name")
        if key in values:
            raise WireError(f"there are two parameters '{key}'")
        try:
            values[key] = _decoded(text)
        except WireError as error:
            raise WireError(f"parameter '{key}': {error}") from None
    return values


# --- out ------------------------------------------------------------------------------------------


def _encoded(key: str, value: ResolvedValue) -> str:
    match value:
        case VehiclePosition(vehicle):
            tree: Any = {"vehicle": vehicle}
        case Point(position, frame):
            tree = _feature("Point", _lonlat(position), frame)
        case Route(waypoints, frame) if len(waypoints) == 1:  # a LineString has two or more
            tree = _feature("MultiPoint", [_lonlat(waypoints[0])], frame)
        case Route(waypoints, frame) if waypoints:
            frames = list(value.altitude_frames) or frame
            tree = _feature("LineString", [_lonlat(point) for point in waypoints], frames)
        case Area(rings, frame) if rings:
            tree = _feature("Polygon", [[_lonlat(corner) for corner in r] for r in rings], frame)
        case bool() | int() | float() | str():
            tree = value
        case _:
            raise WireError(f"parameter '{key}': {value!r} cannot be sent")
    try:
        return json.dumps(tree, allow_nan=False, separators=(",", ":"))
    except ValueError:
        raise WireError(f"parameter '{key}': {value!r} is not finite") from None


def _feature(kind: str, coordinates: Any, frame: str | list[str]) -> dict[str, Any]:
    return {
        "type": "Feature",
        "geometry": {"type": kind, "coordinates": coordinates},
        "properties": {"altitude_frame": frame},
    }


def _lonlat(position: Coordinate) -> list[float]:
    latitude, longitude, altitude = position
    return [longitude, latitude] if altitude is None else [longitude, latitude, altitude]


# --- in -------------------------------------------------------------------------------------------


def _decoded(text: str) -> ResolvedValue:
    if len(text) > LONGEST:
        raise WireError(f"{len(text)} characters are too many; {LONGEST} are allowed")
    try:
        value = json.loads(text, parse_constant=_no_number)
    except WireError:
        raise
    except (ValueError, RecursionError) as error:
        raise WireError(f"{_short(text)} is not JSON ({error})") from None
    if isinstance(value, float) and not math.isfinite(value):
        raise WireError(f"{_short(text)} is too large")
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, dict) and value.get("type") == "Feature":
        return _geometry(value)
    if isinstance(value, dict) and set(value) == {"vehicle"}:
        if isinstance(value["vehicle"], str) and value["vehicle"]:
            return VehiclePosition(value["vehicle"])
        raise WireError("'vehicle' must be the name of a vehicle")
    raise WireError(
        f"{_short(text)} is neither a number, text, true nor false, nor a GeoJSON Feature, "
        'nor {"vehicle": NAME}'
    )


def _no_number(name: str) -> float:
    raise WireError(f"{name} is not a number of JSON")


def _geometry(feature: Mapping[str, Any]) -> Point | Route | Area:
    geometry = feature.get("geometry")
    if not isinstance(geometry, dict):
        raise WireError("the Feature has no geometry")
    kind, coordinates = geometry.get("type"), geometry.get("coordinates")
    properties = feature.get("properties")
    frames = properties.get("altitude_frame") if isinstance(properties, dict) else None
    if kind == "LineString" and isinstance(frames, list):
        waypoints = _positions(coordinates, 2)
        if len(frames) != len(waypoints):
            raise WireError(f"altitude_frame is a list of {len(frames)}, not one a position")
        return Route.of(waypoints, [_frame({"altitude_frame": each}) for each in frames])
    frame = _frame(properties)
    if kind == "Point":
        return Point(_position(coordinates), frame)
    if kind == "LineString":
        return Route(_positions(coordinates, 2), frame)
    if kind == "MultiPoint":
        return Route(_positions(coordinates, 1), frame)
    if kind == "Polygon":
        if not isinstance(coordinates, list) or not coordinates:
            raise WireError("a Polygon is a list of rings")
        return Area(tuple(_ring(ring) for ring in coordinates), frame)
    known = "Point, LineString, MultiPoint, Polygon"
    raise WireError(f"a geometry of type {_short(repr(kind))} is none of {known}")


def _frame(properties: Any) -> str:
    frame = properties.get("altitude_frame") if isinstance(properties, dict) else None
    if frame is None:
        return ALTITUDE_FRAMES[0]
    if frame not in ALTITUDE_FRAMES:
        known = ", ".join(ALTITUDE_FRAMES)
        raise WireError(f"altitude_frame {_short(repr(frame))} is none of {known}")
    return str(frame)


def _ring(value: Any) -> tuple[Coordinate, ...]:
    ring = _positions(value, 4)
    if ring[0][:2] != ring[-1][:2]:
        raise WireError("a ring ends where it begins: repeat its first position")
    return ring


def _positions(value: Any, least: int) -> tuple[Coordinate, ...]:
    if not isinstance(value, list) or len(value) < least:
        raise WireError(f"{least} or more positions are expected")
    return tuple(_position(position) for position in value)


def _position(value: Any) -> Coordinate:
    if not isinstance(value, list) or not 2 <= len(value) <= 3 or not all(map(_is_number, value)):
        raise WireError(
            f"{_short(repr(value))} is not a position: [longitude, latitude] or with an altitude"
        )
    longitude, latitude = float(value[0]), float(value[1])
    if abs(latitude) > 90.0 or abs(longitude) > 180.0:
        raise WireError(
            f"longitude {longitude:g}, latitude {latitude:g} is not on Earth; longitude is first"
        )
    return latitude, longitude, float(value[2]) if len(value) == 3 else None


def _is_number(value: Any) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:  # a whole number that is too large for a float
        return False


def _short(text: str) -> str:
    return text if len(text) <= 60 else f"{text[:57]}..."


MOST_OUTPUTS = 100
LONGEST_OUTPUT = 100_000
"""Characters of one value, as it goes into the journal."""

DEEPEST_OUTPUT = 20
LEAST_WHOLE, MOST_WHOLE = -(2**63), 2**63 - 1
"""Whole numbers of the data store have 64 bits."""


def encode_outputs(outputs: Mapping[str, Value]) -> list[tuple[str, str]]:
    """Return names and their values as JSON.

    Raises:
        WireError: a value cannot be encoded as JSON, such as NaN.
    """
    pairs = []
    for name, value in outputs.items():
        try:
            pairs.append((name, json.dumps(value, allow_nan=False, separators=(",", ":"))))
        except (ValueError, TypeError, RecursionError) as error:
            raise WireError(f"output '{name}' cannot be sent: {error}") from None
    return pairs


def decode_outputs(pairs: Iterable[tuple[str, str]]) -> tuple[dict[str, Value], list[str]]:
    """Return the values by name, and what is wrong with those that were left out."""
    values: dict[str, Value] = {}
    wrong: list[str] = []
    for name, text in pairs:
        if len(values) + len(wrong) >= MOST_OUTPUTS:
            wrong.append(f"there are more than {MOST_OUTPUTS} outputs")
            break
        try:
            if not name or name in values:
                raise WireError("the name is used twice" if name else "it has no name")
            values[name] = _decoded_output(text)
        except WireError as error:
            wrong.append(f"output '{name[:100]}' was left out: {error}")
    return values, wrong


def _decoded_output(text: str) -> Value:
    if len(text) > LONGEST_OUTPUT:
        raise WireError(f"it has {len(text)} characters; at most {LONGEST_OUTPUT} are allowed")
    try:
        value: Value = json.loads(text)
    except (ValueError, RecursionError):
        raise WireError(f"{text[:60]} is not JSON") from None
    _check_output(value, DEEPEST_OUTPUT)
    return value


def _check_output(value: Value, deep: int) -> None:
    """Raise WireError for values that the data store cannot hold, such as NaN."""
    if isinstance(value, float) and not math.isfinite(value):
        raise WireError("it has a number that is not finite")
    if isinstance(value, int) and not LEAST_WHOLE <= value <= MOST_WHOLE:
        raise WireError("it has a whole number of more than 64 bits")
    if isinstance(value, list | dict):
        if not deep:
            raise WireError(f"it is more than {DEEPEST_OUTPUT} levels deep")
        for each in value.values() if isinstance(value, dict) else value:
            _check_output(each, deep - 1)
