"""The behaviors of cameras: one class for each, independent of the driver."""

from collections.abc import Mapping

from m2pem_plugin_ptz.behaviors.behavior import Behavior
from m2pem_plugin_ptz.behaviors.capture import RecordVideo, TakePicture
from m2pem_plugin_ptz.behaviors.pointing import PointAt, Track, Zoom
from m2pem_plugin_ptz.behaviors.scanning import ScanPolygon, ScanSector

BEHAVIORS: Mapping[str, type[Behavior]] = {
    each.name: each
    for each in (PointAt, Track, ScanSector, ScanPolygon, Zoom, TakePicture, RecordVideo)
}
"""By name of the behavior."""
