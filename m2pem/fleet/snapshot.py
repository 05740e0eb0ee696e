"""A fleet as self-contained JSON: what a journal keeps, so that a run needs no fleet file later.

Connection settings are part of it, and so is a password that stands in them.
"""

from typing import Any, get_type_hints

import msgspec

from m2pem.errors import JournalError
from m2pem.fleet.fleet import Fleet
from m2pem.geo.geojson import kind_of
from m2pem.mission.geometry import Area, Geometry, Point, Route, VehiclePosition

VERSION = 1

_TYPES: dict[str, type[Geometry]] = {
    "point": Point,
    "route": Route,
    "area": Area,
    "vehicle": VehiclePosition,
}


def dump(fleet: Fleet) -> bytes:
    """The whole fleet, with its geometries."""
    content = {field: getattr(fleet, field) for field in fleet.__dataclass_fields__}
    content["geometries"] = {
        name: {"kind": kind_of(geometry), "geometry": geometry}
        for name, geometry in fleet.geometries.items()
    }
    return msgspec.json.encode({"version": VERSION, "fleet": content})


def restore(content: bytes) -> Fleet:
    """The fleet that `dump` was given.

    Raises:
        JournalError: not a snapshot, or one of a newer version.
    """
    try:
        snapshot: dict[str, Any] = msgspec.json.decode(content, type=dict[str, Any])
        version = snapshot.get("version")
        if version != VERSION:
            raise JournalError(f"fleet snapshot of version {version!r}; {VERSION} is expected")
        fields = snapshot["fleet"]
        geometries = {
            name: msgspec.convert(entry["geometry"], _TYPES[entry["kind"]])
            for name, entry in fields.pop("geometries").items()
        }
        hints = get_type_hints(Fleet)
        values = {name: msgspec.convert(value, hints[name]) for name, value in fields.items()}
        return Fleet(**values, geometries=geometries)
    except (msgspec.MsgspecError, KeyError, TypeError, AttributeError) as error:
        raise JournalError(f"not a fleet snapshot: {error}") from error
