"""Files of other programs: what is read, and which problem names what."""

import json
import zipfile
from collections.abc import Mapping, Sequence
from io import BytesIO
from typing import Any

import fastkml
import pygeoif
import pytest
import shapefile
from hypothesis import given
from hypothesis import strategies as st
from pyproj import CRS

from m2pem.findings import Severity
from m2pem.geo.geometry_files import GeometryFile, read_geometry_file
from m2pem.geo.geometry_files.contents import MAX_FEATURES, MAX_PROBLEMS
from m2pem.mission.geometry import Area, Point, Route

WGS84 = CRS("EPSG:4326").to_wkt("WKT1_ESRI")


def read(name: str, content: bytes | str) -> GeometryFile:
    return read_geometry_file(name, content.encode() if isinstance(content, str) else content)


def problems(name: str, content: bytes | str) -> list[str]:
    file = read(name, content)
    assert file.geometries == ()
    assert all(each.severity is Severity.ERROR for each in file.problems)
    return [str(each) for each in file.problems]


def kml(body: str) -> str:
    return f'<kml xmlns="http://www.opengis.net/kml/2.2"><Document>{body}</Document></kml>'


def archive(members: Mapping[str, bytes]) -> bytes:
    file = BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as out:
        for name, content in members.items():
            out.writestr(name, content)
    return file.getvalue()


# --- any file -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("a.dwg", b"", "has the suffix '.dwg'; one of .geojson"),
        ("a", b"", "its name has no suffix"),
        ("a.shp", b"", "put it into one .zip with its .dbf"),
        ("a.geojson", b"\xff", "is not UTF-8 text"),
        ("a.geojson", b"{", "line 1: is not JSON"),
        ("a.geojson", b'{"type": "Point", "coordinates": [1, NaN]}', "holds NaN"),
        ("a.geojson", b"[" * 100_000, "nested too deep"),
        ("a.geojson", b'{"type": "FeatureCollection", "features": []}', "has no route, area"),
        ("a.geojson", b" " * 10_000_001, "is larger than 10 MB; split it"),
        ("a.kml", b"<kml>", "is not XML"),
        ("a.kml", b"<gpx/>", "its root is 'gpx'"),
        ("a.kml", b'<!DOCTYPE kml [<!ENTITY a "b">]><kml>&a;</kml>', "has a document type"),
        ("a.kmz", b"PK", "is no ZIP archive"),
        ("a.kmz", archive({"readme.txt": b""}), "has no .kml"),
        ("a.zip", archive({"readme.txt": b""}), "has no .shp"),
        ("a.plan", b"{}", "'fileType' is not 'Plan'"),
        ("a.waypoints", b"QGC WPL 100\n", "line 1 is not 'QGC WPL 110'"),
        ("a.txt", b"notes\n", "line 1 is not 'QGC WPL 110'"),
        ("a.mission", b"{}", "line 1 is not 'QGC WPL 110'"),
        ("a.csv", b"name;speed\n", "there is no column 'lat'"),
    ],
)
def test_a_file_that_cannot_be_read_says_why(name: str, content: bytes, says: str) -> None:
    (problem,) = problems(name, content)
    assert says in problem


def test_names_become_valid_and_unique() -> None:
    point = {"type": "Point", "coordinates": [1, 2]}
    features = [
        {"type": "Feature", "properties": properties, "geometry": point}
        for properties in ({"name": "Nord/Süd 1"}, {"name": "Nord/Süd 1"}, None, {"name": "///"})
    ]
    file = read(
        "my places.geojson", json.dumps({"type": "FeatureCollection", "features": features})
    )
    names = [each.name for each in file.geometries]
    assert names == ["Nord_Süd_1", "Nord_Süd_1_2", "my_places", "my_places_2"]


# --- GeoJSON ------------------------------------------------------------------------------------


def test_each_part_of_a_collection_is_one() -> None:
    square = [[[0, 0], [0, 1], [1, 1], [0, 0]]]
    geometry = {
        "type": "GeometryCollection",
        "geometries": [
            {"type": "MultiPolygon", "coordinates": [square, square]},
            {"type": "MultiLineString", "coordinates": [[[0, 0], [1, 1]], [[2, 2], [3, 3]]]},
            {"type": "Point", "coordinates": [1, 2, 3]},
        ],
    }
    file = read("a.geojson", json.dumps(geometry))
    kinds = [type(each.geometry) for each in file.geometries]
    assert kinds == [Area, Area, Route, Route, Point]
    assert file.problems == ()


def test_a_feature_with_one_bad_part_is_left_out_whole() -> None:
    lines = [[[0, 0], [1, 1]], [[0, 95], [1, 1]]]
    feature = {
        "type": "Feature",
        "properties": {"name": "two"},
        "geometry": {"type": "MultiLineString", "coordinates": lines},
    }
    (problem,) = problems(
        "a.geojson", json.dumps({"type": "FeatureCollection", "features": [feature]})
    )
    assert "features[0] 'two'" in problem
    assert "latitude 95" in problem


def with_crs(name: str, *coordinates: Sequence[float], **properties: str) -> str:
    geometry = {"type": "LineString", "coordinates": coordinates}
    feature = {"type": "Feature", "properties": properties, "geometry": geometry}
    crs = {"type": "name", "properties": {"name": name}}
    return json.dumps({"type": "FeatureCollection", "crs": crs, "features": [feature]})


def test_positions_of_another_reference_system_are_converted() -> None:
    """GeoJSON of 2008 had a member `crs`; QGIS and GDAL still write it."""
    line = ((500_000, 0, 5), (500_000, 0, 6))
    (route,) = read("a.geojson", with_crs("urn:ogc:def:crs:EPSG::32631", *line)).geometries
    assert isinstance(route.geometry, Route)
    for found, height in zip(route.geometry.waypoints, (5.0, 6.0), strict=True):
        assert found == pytest.approx((0.0, 3.0, height))
    assert route.geometry.altitude_frame == "relative"


def test_heights_above_the_ellipsoid_are_converted_unless_they_have_a_frame() -> None:
    places = ((-77.3192, 38.1075, 10), (-77.318, 38.1085, 10))
    (route,) = read("a.geojson", with_crs("EPSG:4979", *places)).geometries
    assert isinstance(route.geometry, Route)
    assert route.geometry.waypoints[0][2] == pytest.approx(43.97, abs=0.05)
    assert route.geometry.altitude_frame == "amsl"
    own = with_crs("EPSG:4979", *places, altitude_frame="relative")
    assert read("a.geojson", own).geometries[0].geometry == Route(
        ((38.1075, -77.3192, 10.0), (38.1085, -77.318, 10.0))
    )


@pytest.mark.parametrize("name", ["urn:ogc:def:crs:OGC:1.3:CRS84", "EPSG:4326"])
def test_what_is_wgs_84_anyway_is_read_as_it_is(name: str) -> None:
    (route,) = read("a.geojson", with_crs(name, (7, 53), (8, 54))).geometries
    assert route.geometry == Route(((53.0, 7.0, None), (54.0, 8.0, None)))
    point = {"type": "Point", "coordinates": [7, 53], "crs": name}
    assert read("a.geojson", json.dumps(point)).geometries[0].geometry == Point((53.0, 7.0, None))


@pytest.mark.parametrize(
    ("name", "place", "says"),
    [
        ("EPSG:104326", [7, 53], "its 'crs' 'EPSG:104326' is not known to PROJ"),
        ("EPSG:25832", ["a", 1], "longitude 'a' is not a number"),
        ("EPSG:25832", [1, 2, 3, 4], "coordinates[0]: a position is [longitude, latitude]"),
        ("EPSG:25832", [], "coordinates[0]: a position is [longitude, latitude]"),
        ("EPSG:25832", [1e30, 1e30], "no transformation to WGS 84 is known for (1e+30, 1e+30)"),
    ],
)
def test_positions_that_cannot_be_converted_are_problems(
    name: str, place: Sequence[Any], says: str
) -> None:
    (problem,) = problems("a.geojson", with_crs(name, place, place))
    assert says in problem


def test_a_file_beyond_the_limit_of_positions_is_refused_before_it_is_parsed() -> None:
    """A million lists are hundreds of megabytes: the rest of this is not JSON, and never read."""
    many = '{"type": "LineString", "coordinates": [' + "[7, 53]," * 200_001 + "never"
    (problem,) = problems("a.geojson", many)
    assert problem == "the file has more than 200,000 positions; simplify its lines"


# --- KML ----------------------------------------------------------------------------------------


@pytest.mark.tried_with(
    "fastkml", "writes KML that m2pem reads", kind="Maps and geodesy", result="the same geometries"
)
def test_what_fastkml_writes_is_read() -> None:
    document = fastkml.Document(name="d")
    for name, shape in (
        ("line", pygeoif.LineString([(7.0, 53.0), (7.1, 53.1)])),
        ("place", pygeoif.Point(7.0, 53.0, 12.0)),
        (
            "field",
            pygeoif.Polygon(
                [(7, 53), (8, 53), (8, 54), (7, 53)],
                [[(7.6, 53.2), (7.8, 53.2), (7.8, 53.4), (7.6, 53.2)]],
            ),
        ),
    ):
        document.append(fastkml.Placemark(name=name, geometry=shape))
    text = fastkml.KML(features=[document]).to_string()
    found = {each.name: each.geometry for each in read("a.kml", text).geometries}
    assert found["line"] == Route(((53.0, 7.0, None), (53.1, 7.1, None)))
    assert found["place"] == Point((53.0, 7.0, None)), "clamped to the ground: no altitude"
    field = found["field"]
    assert isinstance(field, Area)
    assert len(field.rings) == 2


def test_altitude_modes_tracks_and_links() -> None:
    body = """
    <Folder><Placemark><name>high</name><Point><altitudeMode>absolute</altitudeMode>
      <coordinates> 7.0, 53.0, 99 </coordinates></Point></Placemark>
    <Placemark><name>track</name><gx:Track xmlns:gx="http://www.google.com/kml/ext/2.2">
      <altitudeMode>relativeToGround</altitudeMode><when>2026-01-01T00:00:00Z</when>
      <gx:coord>7 53 5</gx:coord><gx:coord>7.1 53.1 6</gx:coord></gx:Track></Placemark>
    <Placemark><name>bad</name><Point><coordinates>53.0</coordinates></Point></Placemark>
    <NetworkLink><name>more</name></NetworkLink></Folder>"""
    file = read("a.kml", kml(body))
    assert [each.geometry for each in file.geometries] == [
        Point((53.0, 7.0, 99.0), "amsl"),
        Route(((53.0, 7.0, 5.0), (53.1, 7.1, 6.0)), "terrain"),
    ]
    bad, link = map(str, file.problems)
    assert bad == "placemark 'bad': position 1: '53.0' is no position; write longitude,latitude"
    assert link.startswith("NetworkLink 'more': what it refers to is not in this file")


def test_a_kmz_is_read_and_a_bomb_is_not_unpacked() -> None:
    point = "<Placemark><name>p</name><Point><coordinates>7,53</coordinates></Point></Placemark>"
    file = read("a.kmz", archive({"files/icon.png": b"", "doc.kml": kml(point).encode()}))
    assert [each.name for each in file.geometries] == ["p"]
    bomb = archive({"doc.kml": b" " * 60_000_000})
    assert len(bomb) < 100_000
    (problem,) = problems("a.kmz", bomb)
    assert "doc.kml is larger than 50 MB unpacked" in problem


def test_the_members_of_an_archive_are_bounded_together() -> None:
    shapes = {f"{name}.shp": b"\0" for name in "abc"}
    layers = shapes | {f"{name}.prj": b"\0" * 20_000_000 for name in "abc"}
    assert str(read("a.zip", archive(layers)).problems[-1]) == (
        "c.shp: c.prj is larger than 50 MB unpacked with what was read before it; split it"
    )


def test_space_around_commas_is_read_and_a_megabyte_of_it_is_no_burden() -> None:
    """With a search that begins at each space it takes a quarter of an hour."""
    line = "<Placemark><name>a</name><LineString><coordinates>{}</coordinates></LineString>"
    spaced = kml(line.format("7 , 53 ,\n 5   8,54" + " " * 1_000_000 + "9,55") + "</Placemark>")
    (found,) = read("a.kml", spaced).geometries
    assert found.geometry == Route(((53.0, 7.0, None), (54.0, 8.0, None), (55.0, 9.0, None)))


def test_of_many_problems_the_first_are_told() -> None:
    file = read("a.kml", kml("<Placemark/>\n" * 5_000))
    assert len(file.problems) == MAX_PROBLEMS + 1
    assert str(file.problems[-1]) == "has 4,900 problems more; mend these first"


@pytest.mark.parametrize("root", ["GroundOverlay", "NetworkLink", "gx:Tour"])
def test_a_document_may_be_one_feature_of_any_kind(root: str) -> None:
    problem = read("a.kml", f"<{root}/>").problems[0]
    assert problem.feature == root.removeprefix("gx:")


@pytest.mark.parametrize(
    ("name", "content"),
    [
        (
            "a.geojson",
            '{"type": "FeatureCollection", "features": [{"type": "Feature", "geometry": {"type":'
            ' "Point", "coordinates": [7, 53]}, "properties": {"speed_kn": 5, "hold": 3}}]}',
        ),
        (
            "a.kml",
            kml(
                "<Placemark><ExtendedData><Data name='speed_kn'/><SchemaData>"
                "<SimpleData name='hold'/></SchemaData></ExtendedData>"
                "<Point><coordinates>7,53</coordinates></Point></Placemark>"
            ),
        ),
    ],
)
def test_fields_that_say_how_to_fly_are_named(name: str, content: str) -> None:
    (problem,) = read(name, content).problems
    assert str(problem).startswith("fields that say how to fly are not read: speed_kn, hold;")


def test_nothing_is_read_behind_the_first_feature_beyond_the_limit() -> None:
    point = '{"type": "Feature", "geometry": {"type": "Point", "coordinates": [7, 53]}}'
    features = ",".join([point] * (MAX_FEATURES + 3))
    file = read("a.geojson", f'{{"type": "FeatureCollection", "features": [{features}]}}')
    assert len(file.geometries) == MAX_FEATURES
    assert [str(each) for each in file.problems] == [
        "features[1000]: is beyond the first 1000 features; split the file"
    ]


def test_a_problem_that_repeats_is_told_once() -> None:
    (problem, _) = read("a.kml", kml("<Update/>\n" * 200)).problems
    assert str(problem).startswith("Update: its changes of other features are not made")


# --- CSV ----------------------------------------------------------------------------------------


def test_columns_are_found_by_their_names() -> None:
    header = "Title;Longitude;Latitude;Altitude;colour"
    table = (header, "home;7.0;53.0;10;red", "home;7.1;53.1;;red", "gate;8;54;5;", "")
    file = read("a.csv", "\n".join(table))
    assert [(each.name, each.geometry) for each in file.geometries] == [
        ("home", Route(((53.0, 7.0, 10.0), (53.1, 7.1, None)))),
        ("gate", Point((54.0, 8.0, 5.0))),
    ]
    unit, left = map(str, file.problems)
    assert "column 'Altitude' has no unit: taken as metres" in unit
    assert left == "line 1: columns that are not read: colour"


def test_feet_are_read_and_one_bad_row_leaves_its_whole_geometry_out() -> None:
    table = "name,lat_deg,lon_deg,alt_ft\na,53,7,100\nb,53,7,1\na,53.1,7.1,200\nb,153,7,1\n"
    file = read("a.csv", table)
    assert [each.name for each in file.geometries] == ["a"]
    assert file.geometries[0].geometry == Route(((53.0, 7.0, 30.48), (53.1, 7.1, 60.96)))
    (problem,) = map(str, file.problems)
    assert problem == "line 3 'b': line 5: latitude 153 is not within -90..90"
    (problem,) = problems("a.csv", "lat,lon\n53,7\n53\n")
    assert problem == "line 3: has 1 columns where the header has 2"


# --- shapefiles ---------------------------------------------------------------------------------


def layer(
    shape_type: int, shapes: Sequence[tuple[str, Any]], projection: str = WGS84
) -> dict[str, bytes]:
    """The members of an archive with one layer, as pyshp writes them."""
    shp, shx, dbf = BytesIO(), BytesIO(), BytesIO()
    with shapefile.Writer(shp=shp, shx=shx, dbf=dbf, shapeType=shape_type) as out:
        out.field("NAME", "C")
        for name, geometry in shapes:
            if geometry["type"] == "Point":
                out.point(*geometry["coordinates"])
            elif shape_type == shapefile.POLYLINEZ:
                out.linez([geometry["coordinates"]])
            else:
                out.shape(geometry)
            out.record(name)
    parts = {"shp": shp, "shx": shx, "dbf": dbf}
    members = {f"my/layer.{suffix}": file.getvalue() for suffix, file in parts.items()}
    return {**members, "my/layer.prj": projection.encode()}


@pytest.mark.tried_with(
    "pyshp", "writes shapefiles that m2pem reads", kind="Maps and geodesy", result="the same layers"
)
def test_layers_of_shapefiles_are_read() -> None:
    rings = [
        [(7.0, 53.0), (7.0, 54.0), (8.0, 54.0), (8.0, 53.0), (7.0, 53.0)],
        [(7.2, 53.2), (7.4, 53.2), (7.4, 53.4), (7.2, 53.2)],
    ]
    polygon = {"type": "Polygon", "coordinates": rings}
    file = read("a.zip", archive(layer(shapefile.POLYGON, [("Feld 1", polygon)])))
    assert file.problems == ()
    (field,) = file.geometries
    assert field.name == "Feld_1"
    assert isinstance(field.geometry, Area)
    assert [len(ring) for ring in field.geometry.rings] == [5, 4]
    line = {"type": "LineString", "coordinates": [(7.0, 53.0, 5.0), (7.1, 53.1, 6.0)]}
    file = read("a.zip", archive(layer(shapefile.POLYLINEZ, [("road", line)])))
    assert file.geometries[0].geometry == Route(((53.0, 7.0, 5.0), (53.1, 7.1, 6.0)), "amsl")
    assert "taken as altitudes above mean sea level" in str(file.problems[0])


# --- ground stations ----------------------------------------------------------------------------


def simple(command: int, latitude: float, longitude: float, altitude: float) -> dict[str, Any]:
    params = [0, 0, 0, 0, latitude, longitude, altitude]
    return {"type": "SimpleItem", "command": command, "frame": 3, "params": params}


# --- whatever is sent ---------------------------------------------------------------------------

GOOD = {
    "a.geojson": b'{"type": "Feature", "geometry": {"type": "Point", "coordinates": [1, 2]}}',
    "a.kml": kml("<Placemark><Point><coordinates>7,53</coordinates></Point></Placemark>").encode(),
    "a.kmz": archive({"doc.kml": kml("<Placemark/>").encode()}),
    "a.csv": b"name,kind,ring,lat_deg,lon_deg,alt_m,altitude_frame\na,route,0,1,2,3,amsl\n",
    "a.plan": json.dumps(
        {"fileType": "Plan", "mission": {"items": [simple(16, 1, 2, 3)]}, "rallyPoints": {}}
    ).encode(),
    "a.waypoints": b"QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t1\t2\t3\t1\n",
    "a.zip": archive(layer(shapefile.POINT, [("p", {"type": "Point", "coordinates": (1, 2)})])),
}


@pytest.mark.parametrize("name", GOOD)
@given(at=st.integers(0, 2_000), change=st.binary(max_size=8), cut=st.integers(0, 20))
def test_a_damaged_file_is_read_or_is_a_problem(
    name: str, at: int, change: bytes, cut: int
) -> None:
    content = GOOD[name]
    at %= len(content)
    file = read(name, content[:at] + change + content[at + cut :])
    assert file.geometries or file.problems


@pytest.mark.filterwarnings("ignore::shapefile.PossiblyCorruptFileHeader")
@pytest.mark.parametrize("part", ["shp", "shx", "dbf", "prj"])
@given(at=st.integers(0, 200), change=st.binary(min_size=1, max_size=8))
def test_a_damaged_layer_is_read_or_is_a_problem(part: str, at: int, change: bytes) -> None:
    line = {"type": "LineString", "coordinates": [(7.0, 53.0), (7.1, 53.1)]}
    members = layer(shapefile.POLYLINE, [("road", line)])
    content = members[f"my/layer.{part}"]
    at %= len(content)
    members[f"my/layer.{part}"] = content[:at] + change + content[at + len(change) :]
    file = read("a.zip", archive(members))
    assert file.geometries or file.problems
