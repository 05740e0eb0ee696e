"""Routes, areas, the fence, footprints of payloads and labels, for RViz and Foxglove.

Both topics are latched, and published when something has changed: `~/markers` has what stays, and
`~/footprints` what payloads see of the ground.
"""

from collections.abc import Iterable, Mapping, Sequence
from itertools import repeat
from typing import Any

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point as PointMessage
from rclpy.node import Node
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from m2pem.api import (
    Area,
    Fleet,
    GeoPosition,
    LinkState,
    LocalFrame,
    PayloadState,
    Point,
    ResourceId,
    Route,
)
from m2pem_plugin_ros.face.names import BASE, Names
from m2pem_plugin_ros.face.telemetry_messages import written
from m2pem_plugin_ros.frames import Quaternion, Vector, to_local
from m2pem_plugin_ros.interfaces.texts import sendable
from m2pem_plugin_ros.runtime import qos

LINE_M = 0.5
POINT_M = 2.0
TEXT_M = 3.0
LABEL_ABOVE_M = 3.0
MOST_POINTS = 10_000
"""Of a geometry. A longer one is drawn up to there."""

ROUTE_COLOR = (0.2, 0.6, 1.0, 1.0)
AREA_COLOR = (1.0, 0.8, 0.2, 1.0)
FENCE_COLOR = (1.0, 0.2, 0.2, 1.0)
POINT_COLOR = (0.9, 0.9, 0.9, 1.0)
FOOTPRINT_COLOR = (0.3, 1.0, 0.5, 0.8)
TEXT_COLOR = (1.0, 1.0, 1.0, 1.0)

Coordinate = tuple[float, float, float | None]
Geometry = Point | Route | Area


class MarkersPublisher:
    """Publishes markers. `look` is called about once a second."""

    def __init__(self, node: Node, fleet: Fleet, frame: LocalFrame, names: Names) -> None:
        self._fleet = fleet
        self._frame = frame
        self._names = names
        self._markers = node.create_publisher(MarkerArray, "~/markers", qos.STATUS)
        self._footprints = node.create_publisher(MarkerArray, "~/footprints", qos.STATUS)
        self._geometries: Mapping[str, Geometry] | None = None
        self._seen: dict[ResourceId, tuple[GeoPosition, ...]] = {}
        self._shown: dict[ResourceId, tuple[GeoPosition, ...]] | None = None

    def put(self, state: PayloadState) -> None:
        """Note what a payload sees; of one that is lost, nothing is shown."""
        self._seen[state.resource] = () if state.link is LinkState.LOST else state.footprint

    def look(self, geometries: Mapping[str, Geometry]) -> None:
        """Publish what has changed. `geometries`: those that are shown now, by name."""
        if geometries != self._geometries:
            self._geometries = dict(geometries)
            self._markers.publish(_whole(self._lasting(geometries)))
        if self._seen != self._shown:
            self._shown = dict(self._seen)
            self._footprints.publish(_whole(self._outlines()))

    def _lasting(self, geometries: Mapping[str, Geometry]) -> list[Any]:
        markers: list[Any] = []
        for name, geometry in geometries.items():
            markers += self._of_geometry(name, geometry)
        for vehicle in self._fleet.vehicles:
            label = self._marker("labels", Marker.TEXT_VIEW_FACING, TEXT_COLOR, TEXT_M)
            label.header.frame_id = self._names.frame(vehicle, BASE)
            label.frame_locked = True
            label.pose.position.z = LABEL_ABOVE_M
            label.text = sendable(vehicle)
            markers.append(label)
        return markers

    def _of_geometry(self, name: str, geometry: Any) -> list[Any]:
        match geometry:
            case Route(waypoints):
                lines = [self._line("routes", ROUTE_COLOR, waypoints, geometry.frames)]
            case Area(rings, altitude_frame):
                fence = name == self._fleet.fence
                namespace, color = ("fence", FENCE_COLOR) if fence else ("areas", AREA_COLOR)
                lines = [
                    self._line(namespace, color, ring, repeat(altitude_frame)) for ring in rings
                ]
            case Point(position, altitude_frame):
                sphere = self._marker("points", Marker.SPHERE, POINT_COLOR, POINT_M)
                sphere.pose.position = _point(self._place(position, altitude_frame))
                return [sphere, self._label(name, sphere.pose.position)]
            case _:
                return []
        return [*lines, self._label(name, lines[0].points[0])] if lines[0].points else []

    def _outlines(self) -> list[Any]:
        markers = []
        for corners in self._seen.values():
            if corners:
                line = self._marker("footprints", Marker.LINE_STRIP, FOOTPRINT_COLOR, LINE_M)
                line.points = [
                    _point(to_local(each, self._frame.origin)) for each in (*corners, corners[0])
                ]
                markers.append(line)
        return markers

    def _line(
        self, namespace: str, color: Any, places: Sequence[Coordinate], frames: Iterable[str]
    ) -> Any:
        line = self._marker(namespace, Marker.LINE_STRIP, color, LINE_M)
        of_each = zip(places[:MOST_POINTS], frames, strict=False)
        line.points = [_point(self._place(place, frame)) for place, frame in of_each]
        return line

    def _label(self, name: str, at: Any) -> Any:
        label = self._marker("names", Marker.TEXT_VIEW_FACING, TEXT_COLOR, TEXT_M)
        label.pose.position = PointMessage(x=at.x, y=at.y, z=at.z + LABEL_ABOVE_M)
        label.text = sendable(name)
        return label

    def _place(self, place: Coordinate, altitude_frame: str) -> Vector:
        """Altitudes that do not count from mean sea level are drawn above the origin."""
        latitude_deg, longitude_deg, altitude_m = place
        origin_m = self._frame.origin[2]
        if altitude_m is None:
            altitude_m = origin_m
        elif altitude_frame != "amsl":
            altitude_m += origin_m
        position = GeoPosition(latitude_deg, longitude_deg, altitude_m)
        return to_local(position, self._frame.origin)

    def _marker(self, namespace: str, kind: int, color: Any, size_m: float) -> Any:
        red, green, blue, alpha = color
        marker = Marker(ns=namespace, type=kind, action=Marker.ADD)
        marker.header.frame_id = self._names.map_frame
        marker.header.stamp = Time()  # the latest transform
        marker.pose.orientation = written(Quaternion(0.0, 0.0, 0.0, 1.0))
        marker.color = ColorRGBA(r=red, g=green, b=blue, a=alpha)
        marker.scale.x = marker.scale.y = marker.scale.z = size_m
        return marker


def _whole(markers: Sequence[Any]) -> Any:
    """Return an array that replaces the last one, also for who joins late."""
    for number, marker in enumerate(markers):
        marker.id = number
    return MarkerArray(markers=[Marker(action=Marker.DELETEALL), *markers])


def _point(place: Vector) -> Any:
    x, y, z = place
    return PointMessage(x=x, y=y, z=z)
