"""States of vehicles, alerts and geometries as Foxglove's well-known messages, in protobuf.

Frames: `map` is the local east-north-up frame of the fleet's origin (REP-105), `VEHICLE/base_link`
that of a vehicle (REP-103: x forward, y left, z up). The altitude of a LocationFix is above the
WGS-84 ellipsoid, as that of the NavSatFix that it is modelled on: its schema says "in meters" only.
"""

import math
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from typing import Any

import msgspec
from foxglove import messages as fg

from m2pem.api import (
    US_PER_S,
    Alert,
    Area,
    GeoPosition,
    LocalFrame,
    PayloadState,
    Point,
    ResourceId,
    Route,
    VehicleState,
    as_geojson,
    ellipsoidal_m,
)
from m2pem_plugin_recorder.channels import (
    GEOMETRIES,
    LOG,
    SCENE,
    TRANSFORMS,
    Channel,
    ChannelMessage,
    Schema,
)

_Enu = tuple[float, float, float]
MAP = "map"
LINE_PX = 2.0
LABEL_PX = 14.0
_ORANGE = fg.Color(r=1.0, g=0.55, b=0.0, a=1.0)
_GREEN = fg.Color(r=0.1, g=0.6, b=0.2, a=1.0)
_RED = fg.Color(r=0.85, g=0.1, b=0.1, a=1.0)
_BLUE = fg.Color(r=0.1, g=0.4, b=0.9, a=1.0)


@cache
def foxglove_channel(topic: str, type_: Any) -> Channel:
    """Return a channel of a type of `foxglove.messages`."""
    schema = type_.get_schema()
    return Channel(topic, "protobuf", Schema(schema.name, schema.encoding, schema.data))


def timestamp(time_us: int) -> fg.Timestamp:
    """Return a time in microseconds since the Unix epoch as Foxglove has it."""
    seconds, rest_us = divmod(time_us, US_PER_S)
    return fg.Timestamp(seconds, rest_us * 1000)


def base_link(vehicle: ResourceId) -> str:
    """Return the frame of a vehicle."""
    return f"{vehicle}/base_link"


def rotation(roll: float, pitch: float, yaw: float) -> tuple[float, float, float, float]:
    """Return the quaternion (x, y, z, w) of roll, pitch and yaw (radians, REP-103)."""
    cr, sr = math.cos(roll / 2), math.sin(roll / 2)
    cp, sp = math.cos(pitch / 2), math.sin(pitch / 2)
    cy, sy = math.cos(yaw / 2), math.sin(yaw / 2)
    return (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )


def vehicle_messages(state: VehicleState, frame: LocalFrame) -> Iterator[ChannelMessage]:
    """Yield location, pose and transform of a vehicle whose position is known.

    Without a heading, pose and transform point east.
    """
    if (place := finite(state.position)) is None:
        return
    at, us, name = timestamp(state.time_us), state.time_us, state.resource
    location = fg.LocationFix(
        timestamp=at,
        frame_id=base_link(name),
        latitude=place.latitude_deg,
        longitude=place.longitude_deg,
        altitude=ellipsoidal_m(*place.latlon, place.altitude_m),
    )
    yield ChannelMessage(
        foxglove_channel(f"/{name}/location", fg.LocationFix), us, location.encode()
    )
    east, north, up = frame.to_enu(place.latitude_deg, place.longitude_deg, place.altitude_m)
    x, y, z, w = rotation(state.roll_rad, state.pitch_rad, state.yaw_rad or 0.0)
    translation, turn = fg.Vector3(x=east, y=north, z=up), fg.Quaternion(x=x, y=y, z=z, w=w)
    pose = fg.PoseInFrame(
        timestamp=at, frame_id=MAP, pose=fg.Pose(position=translation, orientation=turn)
    )
    yield ChannelMessage(foxglove_channel(f"/{name}/pose", fg.PoseInFrame), us, pose.encode())
    transform = fg.FrameTransform(
        timestamp=at,
        parent_frame_id=MAP,
        child_frame_id=base_link(name),
        translation=translation,
        rotation=turn,
    )
    yield ChannelMessage(foxglove_channel(TRANSFORMS, fg.FrameTransform), us, transform.encode())


def footprint_messages(state: PayloadState, frame: LocalFrame) -> Iterator[ChannelMessage]:
    """Yield what a payload sees of the ground, as a part of the scene."""
    if state.footprint:
        corners = [
            frame.to_enu(p.latitude_deg, p.longitude_deg, p.altitude_m) for p in state.footprint
        ]
        line = _line(corners, _BLUE, closed=True)
        yield _scene(f"footprint {state.resource}", state.time_us, [line], [])


def scene_messages(
    geometries: Mapping[str, object], frame: LocalFrame, fence: str, time_us: int
) -> Iterator[ChannelMessage]:
    """Yield routes, areas and points, for the 3D panel and for the map. `fence`: its name."""
    for name, geometry in geometries.items():
        entity = scene_message(name, geometry, frame, time_us, is_fence=name == fence)
        if entity is not None:
            yield entity
    yield geojson_message(geometries, time_us)


def removal_messages(names: Iterable[str], time_us: int) -> Iterator[ChannelMessage]:
    """Yield what removes geometries from the scene."""
    deletions = [
        fg.SceneEntityDeletion(
            timestamp=timestamp(time_us), type=fg.SceneEntityDeletionType.MatchingId, id=name
        )
        for name in names
    ]
    if deletions:
        update = fg.SceneUpdate(deletions=deletions, entities=[])
        yield ChannelMessage(scene_channels()[0], time_us, update.encode())


def scene_message(
    name: str, geometry: object, frame: LocalFrame, time_us: int, *, is_fence: bool = False
) -> ChannelMessage | None:
    """Return a geometry as an entity of the scene; None: it has no place of its own."""
    colour = _RED if is_fence else _GREEN if isinstance(geometry, Area) else _ORANGE
    match geometry:
        case Route(waypoints=waypoints):
            frames = geometry.frames
            way = [_enu(*each, frame) for each in zip(waypoints, frames, strict=True)]
            lines, corner = [_line(way, colour, closed=False)], way[0]
        case Area(rings, above):
            outlines = [[_enu(each, above, frame) for each in ring[:-1]] for ring in rings]
            lines, corner = [_line(each, colour, closed=True) for each in outlines], outlines[0][0]
        case Point(position, above):
            lines, corner = [], _enu(position, above, frame)
        case _:
            return None
    x, y, z = corner
    label = fg.TextPrimitive(
        pose=fg.Pose(
            position=fg.Vector3(x=x, y=y, z=z), orientation=fg.Quaternion(x=0, y=0, z=0, w=1)
        ),
        billboard=True,
        font_size=LABEL_PX,
        scale_invariant=True,
        color=colour,
        text=name,
    )
    return _scene(name, time_us, lines, [label])


def geojson_message(geometries: Mapping[str, object], time_us: int) -> ChannelMessage:
    """Return all geometries as one FeatureCollection."""
    features = []
    for name, geometry in geometries.items():
        if isinstance(geometry, Point | Route | Area):
            feature = as_geojson(geometry)
            feature["properties"]["name"] = name
            features.append(feature)
    text = msgspec.json.encode({"type": "FeatureCollection", "features": features}).decode()
    channel = foxglove_channel(GEOMETRIES, fg.GeoJson)
    return ChannelMessage(channel, time_us, fg.GeoJson(geojson=text).encode())


def log_message(alert: Alert, time_us: int) -> ChannelMessage:
    """Return an alert as a line of the log."""
    line = fg.Log(
        timestamp=timestamp(time_us),
        level=fg.LogLevel.Warning,
        message=f"{alert.run}: {alert.text}" if alert.run else alert.text,
        name=alert.code,
    )
    return ChannelMessage(log_channel(), time_us, line.encode())


def log_channel() -> Channel:
    """The channel of alerts."""
    return foxglove_channel(LOG, fg.Log)


def scene_channels() -> tuple[Channel, Channel, Channel]:
    """The channels of the scene, of geometries as GeoJSON, and of the frames of vehicles."""
    return (
        foxglove_channel(SCENE, fg.SceneUpdate),
        foxglove_channel(GEOMETRIES, fg.GeoJson),
        foxglove_channel(TRANSFORMS, fg.FrameTransform),
    )


def finite(place: GeoPosition | None) -> GeoPosition | None:
    """Return a position; None if it is unknown: devices send NaN for that."""
    if place is None:
        return None
    numbers = (place.latitude_deg, place.longitude_deg, place.altitude_m)
    return place if all(map(math.isfinite, numbers)) else None


def _scene(name: str, time_us: int, lines: list[Any], texts: list[Any]) -> ChannelMessage:
    entity = fg.SceneEntity(
        timestamp=timestamp(time_us), frame_id=MAP, id=name, lines=lines, texts=texts
    )
    update = fg.SceneUpdate(entities=[entity])
    return ChannelMessage(foxglove_channel(SCENE, fg.SceneUpdate), time_us, update.encode())


def _line(corners: Iterable[_Enu], colour: fg.Color, *, closed: bool) -> fg.LinePrimitive:
    kinds = fg.LinePrimitiveLineType
    return fg.LinePrimitive(
        type=kinds.LineLoop if closed else kinds.LineStrip,
        pose=fg.Pose(
            position=fg.Vector3(x=0, y=0, z=0), orientation=fg.Quaternion(x=0, y=0, z=0, w=1)
        ),
        thickness=LINE_PX,
        scale_invariant=True,
        points=[fg.Point3(x=x, y=y, z=z) for x, y, z in corners],
        color=colour,
    )


def _enu(place: tuple[float, float, float | None], altitude_frame: str, frame: LocalFrame) -> _Enu:
    """Return a place in `map`; altitudes from home or the ground are drawn above the origin."""
    latitude_deg, longitude_deg, altitude_m = place
    is_above_sea = altitude_m is not None and altitude_frame == "amsl"
    base_m = 0.0 if is_above_sea else frame.origin[2]
    return frame.to_enu(latitude_deg, longitude_deg, base_m + (altitude_m or 0.0))
