from pathlib import Path

import pytest

from m2pem.geo import files as geofiles
from m2pem.geo.files import GeometryError, read_geometry
from m2pem.geo.geometry_files import (
    FileFormat,
    FileProblem,
    NamedGeometry,
    write_geometry_file,
)
from m2pem.mission.geometry import Area, Point, Route

from ..fleet.fleets import LINE, POINT, SQUARE, write_json
from .geometry_files.test_mission_plans import ROWS, SURVEY, item, plan


def test_the_suffix_says_how_to_read(tmp_path: Path) -> None:
    (tmp_path / "a.waypoints").write_text(f"QGC WPL 110\n{ROWS}")
    write_json(tmp_path / "a.plan", plan(SURVEY))
    assert isinstance(read_geometry(tmp_path / "a.waypoints", "route"), Route)
    assert isinstance(read_geometry(tmp_path / "a.plan", "area"), Area)
    assert isinstance(read_geometry(write_json(tmp_path / "a.geojson", POINT), "point"), Point)
    assert isinstance(read_geometry(write_json(tmp_path / "a.json", SQUARE), "area"), Area)
    (tmp_path / "a.csv").write_text("lat_deg,lon_deg\n1,2\n")
    assert isinstance(read_geometry(tmp_path / "a.csv", "point"), Point)


def test_a_table_that_m2pem_has_written_is_read(tmp_path: Path) -> None:
    route = Route(((38.1, -77.3, 2.0), (38.2, -77.3, 3.0)), "amsl", (2.5, None))
    table = write_geometry_file(FileFormat.CSV, [NamedGeometry("road", route)])
    (tmp_path / "a.csv").write_bytes(table)
    assert read_geometry(tmp_path / "a.csv", "route") == route


def test_a_height_without_a_unit_is_a_warning(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("lat_deg,lon_deg,alt\n1,2,3\n")
    warnings: list[FileProblem] = []
    read_geometry(tmp_path / "a.csv", "point", warnings.append)
    assert "column 'alt' has no unit: taken as metres" in str(warnings[0])


def test_geojson_of_another_reference_system_is_converted(tmp_path: Path) -> None:
    def written(name: str) -> Path:
        crs = {"type": "name", "properties": {"name": name}}
        geometry = {"type": "Point", "coordinates": [500_000, 0], "crs": crs}
        return write_json(tmp_path / "a.geojson", geometry)

    found = read_geometry(written("EPSG:32631"), "point")
    assert isinstance(found, Point)
    assert found.position[:2] == pytest.approx((0.0, 3.0))
    with pytest.raises(GeometryError, match="'EPSG:999999' is not known to PROJ"):
        read_geometry(written("EPSG:999999"), "point")


def test_another_kind_of_geometry_is_refused(tmp_path: Path) -> None:
    path = write_json(tmp_path / "a.geojson", LINE)
    with pytest.raises(GeometryError, match=r"a\.geojson: holds a route; an area is expected"):
        read_geometry(path, "area")


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.gpx", "", "has another suffix than .geojson"),
        ("a.geojson", "{\n\n x}", "line 3: is not JSON"),
        ("a.geojson", "[]", "a JSON object is expected"),
        ("a.geojson", '{"type": "Point", "coordinates": [NaN, 1]}', "holds NaN"),
        ("a.geojson", "[" * 100_000, "is nested too deep"),
        ("a.geojson", '{"type": ' + "9" * 5000 + "}", "is not JSON"),
        ("a.geojson", b"\xff", "is not UTF-8 text"),
        ("a.plan", "{}", "is not a QGroundControl plan"),
    ],
)
def test_an_unusable_file_is_named(
    tmp_path: Path, name: str, content: str | bytes, message: str
) -> None:
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(GeometryError) as refused:
        read_geometry(path, "route")
    assert str(refused.value).startswith(f"{path}: ")
    assert message in str(refused.value)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(GeometryError, match="cannot be read: No such file"):
        read_geometry(tmp_path / "none.geojson", "route")


def test_a_file_that_is_too_large_is_not_parsed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(geofiles, "MAX_BYTES", 20)
    with pytest.raises(GeometryError, match="is larger than 20 bytes"):
        read_geometry(write_json(tmp_path / "a.geojson", POINT), "point")


def test_a_byte_order_mark_does_no_harm(tmp_path: Path) -> None:
    path = tmp_path / "a.geojson"
    path.write_text('{"type": "Point", "coordinates": [1, 2]}', encoding="utf-8-sig")
    assert read_geometry(path, "point") == Point((2.0, 1.0, None))


def test_a_kml_file_holds_one_of_the_kind_that_is_asked_for(tmp_path: Path) -> None:
    def placemark(name: str, kind: str, coordinates: str) -> str:
        shape = f"<{kind}><coordinates>{coordinates}</coordinates></{kind}>"
        return f"<Placemark><name>{name}</name>{shape}</Placemark>"

    parts = [placemark("a", "Point", "7,53"), placemark("b", "Point", "8,53")]
    parts.append(placemark("road", "LineString", "7,53 8,53"))
    path = tmp_path / "places.kml"
    path.write_text(f"<kml><Document>{''.join(parts)}</Document></kml>")
    assert read_geometry(path, "route") == Route(((53.0, 7.0, None), (53.0, 8.0, None)))
    with pytest.raises(GeometryError, match=r"places.kml: has 2 points \(a, b\); exactly one"):
        read_geometry(path, "point")
    with pytest.raises(GeometryError, match="has 0 areas; exactly one is expected"):
        read_geometry(path, "area")
    path.write_text("<kml><Placemark><name>x</name></Placemark></kml>")
    with pytest.raises(GeometryError, match="placemark 'x': has no point, line or polygon"):
        read_geometry(path, "route")


def test_what_is_left_out_of_a_plan_is_a_warning_for_the_kind_that_is_asked_for(
    tmp_path: Path,
) -> None:
    items = (item(22, None, None, 20), item(16, 38.0, -77.0, 30), SURVEY, item(21, 38.0, -77.0, 0))
    path = write_json(tmp_path / "a.plan", plan(*items))
    warnings: list[FileProblem] = []
    assert isinstance(read_geometry(path, "route", warnings.append), Route)
    left_out = [each.feature.partition(" (")[0] for each in warnings]
    assert left_out == ["item 3", "item 1", "item 4"]
    warnings.clear()
    assert isinstance(read_geometry(path, "area", warnings.append), Area)
    assert [each.feature for each in warnings] == ["item 3 (survey)"]


def test_a_plan_without_a_route_says_why_and_keeps_its_area(tmp_path: Path) -> None:
    curve = item(82, 38.1, -77.0, 30)
    path = write_json(tmp_path / "a.plan", plan(item(16, 38.0, -77.0, 30), curve, SURVEY))
    with pytest.raises(GeometryError, match=r"a\.plan: item 2: MAV_CMD_NAV_SPLINE_WAYPOINT cannot"):
        read_geometry(path, "route")
    assert isinstance(read_geometry(path, "area"), Area)


def test_a_fence_with_ponds_in_it_is_its_outer_polygon(tmp_path: Path) -> None:
    pond = {"polygon": [[38.01, -77.0], [38.02, -77.0], [38.02, -77.01]], "inclusion": False}
    both = {"polygons": [pond, {"polygon": SURVEY["polygon"]}]}
    path = write_json(tmp_path / "a.plan", plan(geoFence=both))
    area = read_geometry(path, "area")
    assert isinstance(area, Area)
    assert area.rings[0][0] == (38.0, -77.0, None)
    write_json(path, plan(geoFence={"polygons": [pond]}))
    assert isinstance(read_geometry(path, "area"), Area)
