"""Maps: the tracks of vehicles, detections, and the routes, areas and points of a run, as GeoJSON
(RFC 7946) or KML 2.3."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, BinaryIO

import msgspec
from lxml import etree

from m2pem.api import (
    Area,
    Detection,
    ExportedRun,
    ExportOptions,
    FileFormat,
    GeoPosition,
    NamedGeometry,
    PayloadState,
    Point,
    Route,
    VehicleState,
    as_geojson,
    parse_geojson,
    write_geometry_file,
)
from m2pem.api import records as r
from m2pem.errors import M2pemError
from m2pem_plugin_recorder.export.states import States, iso_time
from m2pem_plugin_recorder.export.xes import xml_text
from m2pem_plugin_recorder.foxglove_messages import finite


@dataclass(slots=True, eq=False)
class Places:
    """What a run has on a map. `tracks`: places with their times, by vehicle."""

    geometries: dict[str, Point | Route | Area] = field(default_factory=dict)
    tracks: dict[str, list[tuple[int, GeoPosition]]] = field(default_factory=dict)
    detections: list[Detection] = field(default_factory=list)


def geometries_of(run: ExportedRun) -> dict[str, Point | Route | Area]:
    """Return the geometries of a run by name: those of the fleet file, in place of them those of
    the mission's files, and in place of both those that were handed over."""
    known = {
        **(run.fleet.geometries if run.fleet is not None else {}),
        **(run.mission.geometries if run.mission is not None else {}),
    }
    found = {
        name: geometry
        for name, geometry in known.items()
        if isinstance(geometry, Point | Route | Area)
    }
    for each in run.records:
        if isinstance(each.record, r.GeometryReceived):
            try:
                found[each.record.name] = parse_geojson(each.record.geometry)
            except M2pemError:  # one of an older release that this one does not read
                continue
    return found


def places_of(run: ExportedRun, states: States) -> Places:
    """Return what a run has on a map."""
    places = Places(geometries_of(run))
    for state in states.of(run):
        if isinstance(state, VehicleState):
            place = finite(state.position)
            track = places.tracks.setdefault(state.resource, [])
            # Records of two parts, or a clock that was set back, must not fold a track.
            if place is not None and (not track or track[-1][0] < state.time_us):
                track.append((state.time_us, place))
        elif isinstance(state, PayloadState):
            places.detections += state.detections
    places.tracks = {name: track for name, track in places.tracks.items() if track}
    return places


class GeoJsonExporter:
    """A FeatureCollection. Tracks have their times in the property `coordTimes`."""

    def __init__(self, output: BinaryIO, options: ExportOptions) -> None:
        self._output = output
        self._states = States(options.recordings)
        self._features: list[dict[str, Any]] = []

    def add(self, run: ExportedRun) -> None:
        """Add the features of a run."""
        self._features += _features(run.summary.run, places_of(run, self._states))

    def close(self) -> Sequence[str]:
        """See `m2pem.api.Exporter.close`."""
        collection = {"type": "FeatureCollection", "features": self._features}
        self._output.write(msgspec.json.encode(collection) + b"\n")
        return self._states.remarks


def _features(run: str, places: Places) -> Iterator[dict[str, Any]]:
    for name, geometry in places.geometries.items():
        feature = as_geojson(geometry)
        feature["properties"] |= {"run": run, "kind": "geometry", "name": name}
        yield feature
    for vehicle, track in places.tracks.items():
        coordinates = [_coordinates(place) for _, place in track]
        is_line = len(coordinates) > 1
        yield {
            "type": "Feature",
            "properties": {
                "run": run,
                "kind": "track",
                "name": vehicle,
                "altitude_frame": "amsl",
                "coordTimes": [iso_time(time_us) for time_us, _ in track],
            },
            "geometry": {
                "type": "LineString" if is_line else "Point",
                "coordinates": coordinates if is_line else coordinates[0],
            },
        }
    for each in places.detections:
        yield {
            "type": "Feature",
            "properties": {
                "run": run,
                "kind": "detection",
                "name": each.type,
                "source": each.source,
                "time": iso_time(each.time_us),
                "altitude_frame": "amsl",
            },
            "geometry": {"type": "Point", "coordinates": _coordinates(each.position)},
        }


def _coordinates(place: GeoPosition) -> list[float]:
    return [place.longitude_deg, place.latitude_deg, place.altitude_m]


_KML = "http://www.opengis.net/kml/2.2"
_GX = "http://www.google.com/kml/ext/2.2"
_PREFIXES: dict[Any, str] = {None: _KML, "gx": _GX}


class KmlExporter:
    """A folder for each run; tracks are `gx:Track`, so that a time slider moves the vehicles."""

    def __init__(self, output: BinaryIO, options: ExportOptions) -> None:
        self._output = output
        self._states = States(options.recordings)
        self._kml = etree.Element(f"{{{_KML}}}kml", nsmap=_PREFIXES)
        self._document = _kml(self._kml, "Document")
        _kml(self._document, "name", "m2pem")

    def add(self, run: ExportedRun) -> None:
        """Add the folder of a run."""
        places = places_of(run, self._states)
        folder = _kml(self._document, "Folder")
        _kml(folder, "name", f"{run.summary.run} {run.summary.mission}".strip())
        named = [NamedGeometry(xml_text(name), each) for name, each in places.geometries.items()]
        if named:
            drawn = etree.fromstring(write_geometry_file(FileFormat.KML, named))
            folder.extend(drawn.iter(f"{{{_KML}}}Placemark"))
        for vehicle, track in places.tracks.items():
            element = etree.SubElement(_placemark(folder, vehicle), f"{{{_GX}}}Track")
            _kml(element, "altitudeMode", "absolute")  # above mean sea level
            for time_us, _ in track:
                _kml(element, "when", iso_time(time_us).replace("+00:00", "Z"))
            for _, place in track:
                coordinates = etree.SubElement(element, f"{{{_GX}}}coord")
                coordinates.text = " ".join(map(str, _coordinates(place)))
        for each in places.detections:
            placemark = _placemark(folder, each.type)
            stamp = _kml(placemark, "TimeStamp")
            _kml(stamp, "when", iso_time(each.time_us).replace("+00:00", "Z"))
            point = _kml(placemark, "Point")
            _kml(point, "coordinates", ",".join(map(str, _coordinates(each.position))))

    def close(self) -> Sequence[str]:
        """See `m2pem.api.Exporter.close`."""
        tree = etree.ElementTree(self._kml)
        tree.write(self._output, encoding="UTF-8", xml_declaration=True, pretty_print=True)
        return self._states.remarks


def _placemark(folder: etree._Element, name: str) -> etree._Element:
    placemark = _kml(folder, "Placemark")
    _kml(placemark, "name", name)
    return placemark


def _kml(parent: etree._Element, name: str, text: str | None = None) -> etree._Element:
    element = etree.SubElement(parent, f"{{{_KML}}}{name}")
    element.text = None if text is None else xml_text(text)
    return element
