import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from m2pem.geo.geojson import GeometryError, as_geojson, kind_of, parse_geojson
from m2pem.mission.geometry import Area, Point, Route, VehiclePosition

SQUARE = [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]


def test_a_line_string_is_a_route_with_latitude_first() -> None:
    route = parse_geojson({"type": "LineString", "coordinates": [[-77, 38], [-77.5, 38.5, 12]]})
    assert route == Route(((38.0, -77.0, None), (38.5, -77.5, 12.0)))


def test_a_multi_point_is_a_route_of_even_one_waypoint() -> None:
    assert parse_geojson({"type": "MultiPoint", "coordinates": [[1, 2]]}) == Route(
        ((2.0, 1.0, None),)
    )


def test_a_polygon_is_an_area_with_its_holes() -> None:
    hole = [[0.2, 0.2], [0.4, 0.2], [0.4, 0.4], [0.2, 0.2]]
    area = parse_geojson({"type": "Polygon", "coordinates": [SQUARE, hole]})
    assert isinstance(area, Area)
    assert [len(ring) for ring in area.rings] == [5, 4]
    assert area.rings[0][1] == (0.0, 1.0, None)


def test_heights_above_the_ellipsoid_are_read_as_altitudes_above_mean_sea_level() -> None:
    # Mean sea level is 33.97 m below the ellipsoid in Virginia, 17.16 m above it at 0, 0.
    def read(kind: str, coordinates: object) -> Any:
        properties = {"altitude_frame": "ellipsoid"}
        geometry = {"type": kind, "coordinates": coordinates}
        return parse_geojson({"type": "Feature", "properties": properties, "geometry": geometry})

    point = read("Point", [-77.3192, 38.1075, 60])
    assert point == Point((38.1075, -77.3192, pytest.approx(93.97, abs=0.01)), "amsl")
    route = read("LineString", [[-77.3192, 38.1075, 60], [0, 0, 20], [1, 1]])
    heights = [each[2] for each in route.waypoints]
    assert heights == [pytest.approx(93.97, abs=0.01), pytest.approx(2.84, abs=0.01), None]
    area = read("Polygon", [[[*corner, 20] for corner in SQUARE]])
    assert area.rings[0][0][2] == pytest.approx(2.84, abs=0.01)
    assert {point.altitude_frame, route.altitude_frame, area.altitude_frame} == {"amsl"}


def test_the_altitude_frame_is_a_property_of_the_feature() -> None:
    feature = {
        "type": "Feature",
        "properties": {"altitude_frame": "amsl"},
        "geometry": {"type": "Point", "coordinates": [1, 2, 3]},
    }
    expected = Point((2.0, 1.0, 3.0), "amsl")
    assert parse_geojson(feature) == expected
    assert parse_geojson({"type": "FeatureCollection", "features": [feature]}) == expected


def test_a_longitude_of_180_degrees_with_an_error_of_rounding_is_180_degrees() -> None:
    point = parse_geojson({"type": "Point", "coordinates": [-180.00000000000014, 1]})
    assert point == Point((1.0, -180.0, None))


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ({"type": "Point", "coordinates": [38, -77]}, None),
        ({"type": "Point", "coordinates": [-77, 138]}, "are [longitude, latitude]"),
        ({"type": "Point", "coordinates": [181, 0]}, "longitude 181 is not within -180..180"),
        ({"type": "Point", "coordinates": [0]}, "a position is [longitude, latitude]"),
        ({"type": "Point", "coordinates": [0, "1"]}, "latitude '1' is not a number"),
        ({"type": "Point", "coordinates": [0, True]}, "latitude True is not a number"),
        ({"type": "Point", "coordinates": [0, 1, float("nan")]}, "altitude nan is not finite"),
        ({"type": "Point", "coordinates": [10**400, 1]}, "is not finite"),
        ({"type": "LineString", "coordinates": [[0, 0]]}, "at least 2 positions"),
        ({"type": "LineString", "coordinates": [[0, 0], [0, 95]]}, "coordinates[1]: latitude 95"),
        ({"type": "LineString"}, "at least 2 positions"),
        ({"type": "Polygon", "coordinates": []}, "a list of rings"),
        ({"type": "Polygon", "coordinates": [SQUARE[:-1]]}, "a ring ends where it begins"),
        ({"type": "Polygon", "coordinates": [[[0, 0]] * 4]}, "three different corners"),
        ({"type": "Poligon"}, "did you mean 'Polygon'"),
        ({"type": "GeometryCollection", "geometries": []}, "is not a route, area or point"),
        ({"type": ["Point"]}, "is not a route, area or point"),
        ({}, "type None"),
        ([], "an object with 'type' is expected"),
        ({"type": "Feature", "geometry": None}, "an object with 'type' is expected"),
        ({"type": "FeatureCollection", "features": []}, "has 0 features"),
        ({"type": "FeatureCollection"}, "has no features"),
        (
            {
                "type": "Feature",
                "properties": {"altitude_frame": "msl"},
                "geometry": {"type": "Point", "coordinates": [0, 0]},
            },
            "altitude_frame 'msl' is not known; did you mean 'amsl'?",
        ),
        (
            {
                "type": "Point",
                "coordinates": [0, 0],
                "crs": {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::3857"}},
            },
            "is not WGS-84",
        ),
    ],
)
def test_what_is_no_place_on_earth_is_refused(value: Any, message: str | None) -> None:
    if message is None:
        parse_geojson(value)
        return
    with pytest.raises(GeometryError) as refused:
        parse_geojson(value)
    assert message in str(refused.value)


def test_the_old_name_of_wgs_84_is_no_other_crs() -> None:
    crs = {"type": "name", "properties": {"name": "urn:ogc:def:crs:OGC:1.3:CRS84"}}
    assert parse_geojson({"type": "Point", "coordinates": [0, 0], "crs": crs})


positions = st.tuples(
    st.floats(-180, 180), st.floats(-90, 90), st.floats(-1e5, 1e5, allow_nan=False)
).map(list)


@given(st.lists(positions, min_size=2, max_size=20))
def test_a_route_keeps_every_position_exactly(line: list[list[float]]) -> None:
    written = json.loads(json.dumps({"type": "LineString", "coordinates": line}))
    route = parse_geojson(written)
    assert isinstance(route, Route)
    assert [[lon, lat, alt] for lat, lon, alt in route.waypoints] == line


json_values = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=4),
    max_leaves=12,
)


@given(st.sampled_from(["Point", "LineString", "MultiPoint", "Polygon", "Feature"]), json_values)
def test_any_coordinates_are_read_or_refused(kind: str, value: Any) -> None:
    data = {"type": kind, "coordinates": value, "geometry": value, "properties": value}
    try:
        geometry = parse_geojson(data)
    except GeometryError as error:
        assert str(error)
    else:
        assert parse_geojson(as_geojson(geometry)) == geometry


def test_kinds_have_the_names_that_people_use() -> None:
    place = (0.0, 0.0, None)
    assert kind_of(Point(place)) == "point"
    assert kind_of(Route((place,))) == "route"
    assert kind_of(Area(((place,),))) == "area"
    assert kind_of(VehiclePosition("evsg1")) == "vehicle"


@pytest.mark.parametrize(
    "geometry",
    [
        Point((38.1, -77.3, None), "amsl"),
        Route(((38.1, -77.3, 1.0), (38.2, -77.4, None)), "relative"),
        Route(((38.1, -77.3, None),), "relative"),
        Area((tuple((38.0 + x, -77.0 + x * x, None) for x in (0, 0.1, 0.2, 0)),)),
    ],
)
def test_a_geometry_is_read_back_as_it_was_written(geometry: Point | Route | Area) -> None:
    assert parse_geojson(as_geojson(geometry)) == geometry


LANE = {"type": "LineString", "coordinates": [[10, 50], [10.1, 50], [10.2, 50]]}


def with_speeds(speeds: object, geometry: object = LANE) -> dict[str, object]:
    return {"type": "Feature", "properties": {"speeds_m_s": speeds}, "geometry": geometry}


def test_the_speeds_of_waypoints_hold_until_another_one() -> None:
    route = parse_geojson(with_speeds([None, 2.5, None]))
    assert isinstance(route, Route)
    assert [route.speed_from(index) for index in (-1, 0, 1, 2)] == [None, None, 2.5, 2.5]
    assert parse_geojson(as_geojson(route)) == route
    assert parse_geojson(with_speeds([None, None, None])) == parse_geojson(LANE)
    assert "speeds_m_s" not in as_geojson(parse_geojson(LANE))["properties"]


@pytest.mark.parametrize(
    ("feature", "says"),
    [
        (with_speeds([1, 2]), "speeds_m_s: a list of 3 is expected"),
        (with_speeds(4), "speeds_m_s: a list of 3 is expected"),
        (with_speeds([1, 0, 2]), r"speeds_m_s\[1\]: speed 0 m/s is not above 0"),
        (with_speeds([1, "fast", 2]), r"speeds_m_s\[1\]: speed 'fast' is not a number"),
        (with_speeds([1, float("nan"), 2]), r"speeds_m_s\[1\]: speed nan is not finite"),
        (
            with_speeds([1], {"type": "Point", "coordinates": [10, 50]}),
            "only a route has speeds, not a point",
        ),
    ],
)
def test_speeds_that_cannot_be_meant_are_refused(feature: dict[str, object], says: str) -> None:
    with pytest.raises(GeometryError, match=says):
        parse_geojson(feature)


def with_frames(frames: object, geometry: object = LANE) -> dict[str, object]:
    return {"type": "Feature", "properties": {"altitude_frames": frames}, "geometry": geometry}


@pytest.mark.parametrize(
    ("mode", "height_m", "frame"),
    [
        ("absolute", 500.0, "amsl"),
        ("relativeToGround", 500.0, "terrain"),
        ("clampToGround", None, "relative"),
        (None, 500.0, "relative"),
    ],
)
def test_the_altitude_mode_that_gdal_hands_over_from_kml_is_the_frame(
    mode: str | None, height_m: float | None, frame: str
) -> None:
    # GDAL 3.12.4 (its driver LIBKML) makes it a field of that name.
    feature = {
        "type": "Feature",
        "properties": {"Name": "way", "altitudeMode": mode},
        "geometry": {"type": "LineString", "coordinates": [[8, 47, 500], [8.1, 47, 500]]},
    }
    route = parse_geojson(feature)
    assert isinstance(route, Route)
    assert route == Route(((47, 8, height_m), (47, 8.1, height_m)), frame)


def test_each_position_of_a_route_may_have_an_altitude_frame() -> None:
    route = parse_geojson(with_frames(["relative", "amsl", "terrain"]))
    assert isinstance(route, Route)
    assert (route.altitude_frame, route.frames) == ("relative", ("relative", "amsl", "terrain"))
    assert parse_geojson(as_geojson(route)) == route
    alike = parse_geojson(with_frames(["amsl", "amsl", "amsl"]))
    assert as_geojson(alike)["properties"] == {"altitude_frame": "amsl"}


@pytest.mark.parametrize(
    ("feature", "says"),
    [
        (with_frames(["amsl"]), "altitude_frames: a list of 3 is expected"),
        (with_frames("amsl"), "altitude_frames: a list of 3 is expected"),
        (with_frames(["amsl", "agl", "amsl"]), "altitude_frame 'agl' is not known"),
        (with_frames(["amsl", ["agl"], "amsl"]), "is not known"),
        (
            with_frames(["amsl"], {"type": "Point", "coordinates": [10, 50]}),
            "only a route has them, not a point",
        ),
    ],
)
def test_frames_that_cannot_be_meant_are_refused(feature: dict[str, object], says: str) -> None:
    with pytest.raises(GeometryError, match=says):
        parse_geojson(feature)
