"""What a camera can be asked for: one small class a behavior, none of which knows its camera."""

from collections.abc import Mapping

from m2pem_plugin_ptz.behaviors.aiming import PointAt, Track
from m2pem_plugin_ptz.behaviors.behavior import Behavior
from m2pem_plugin_ptz.behaviors.polygon import ScanPolygon
from m2pem_plugin_ptz.behaviors.recording import RecordVideo
from m2pem_plugin_ptz.behaviors.sector import ScanSector
from m2pem_plugin_ptz.behaviors.shooting import TakePicture
from m2pem_plugin_ptz.behaviors.zooming import Zoom

BEHAVIORS: Mapping[str, type[Behavior]] = {
    each.name: each
    for each in (PointAt, Track, ScanSector, ScanPolygon, Zoom, TakePicture, RecordVideo)
}
"""By name."""
