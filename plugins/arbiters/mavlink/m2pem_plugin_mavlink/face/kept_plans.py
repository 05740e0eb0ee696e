"""Uploaded plans as geometries of the executive, which its journal keeps.

They are `VEHICLE.plan`, `VEHICLE.rally` and `VEHICLE.fence`, as GeoJSON features whose properties
have the items. Who changes or deletes the geometry has the items forgotten, too.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from m2pem.api import Area, Route, Value, as_geojson
from m2pem_plugin_mavlink.protocol.messages import Message, types_by_id

_ITEMS, _NUMBER = "mission_items", "number"
_TYPES = (39, 73)
"""MISSION_ITEM and MISSION_ITEM_INT."""

KeptItems = tuple[Sequence[Message], int]
"""Items of a plan, and the number that `as_feature` was given."""


def as_feature(geometry: Area | Route, items: Sequence[Message], number: int = 0) -> dict[str, Any]:
    """Return the GeoJSON feature of a geometry that has the items of a plan, and a number that
    belongs to them."""
    feature = as_geojson(geometry)
    packed = [f"{each.TYPE.id}:{each.TYPE.pack(each).hex()}" for each in items]
    feature["properties"] |= {_ITEMS: packed, _NUMBER: number}
    return feature


def items_of(geometry: Mapping[str, Value]) -> KeptItems:
    """Return the items of a feature; none: it has none, or what an operator has put there."""
    properties = geometry.get("properties")
    if not isinstance(properties, Mapping):
        return (), 0
    packed, number = properties.get(_ITEMS), properties.get(_NUMBER)
    try:
        found = [str(each).split(":") for each in packed]  # type: ignore[union-attr]
        types = types_by_id()
        items = [types[int(id_)].unpack(bytes.fromhex(content)) for id_, content in found]
    except (TypeError, ValueError, KeyError):
        return (), 0
    if any(each.TYPE.id not in _TYPES for each in items):
        return (), 0
    return items, number if isinstance(number, int) else 0
