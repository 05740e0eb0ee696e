"""Shapefiles as pyshp writes them: pyshp 3.1.6's `__geo_interface__` has no Z values of lines."""

import struct
import zipfile
from collections.abc import Callable
from io import BytesIO

import pytest
import shapefile
from pyproj import CRS

from m2pem.geo.geometry_files import GeometryFile, read_geometry_file
from m2pem.mission.geometry import Area, Point, Route

WGS84 = CRS("EPSG:4326").to_wkt("WKT1_ESRI")

Draw = Callable[[shapefile.Writer], object]


def read(
    shape_type: int,
    *shapes: Draw,
    frame: str = "",
    projection: str = WGS84,
    field: str = "ALT_FRAME",
) -> GeometryFile:
    """Read an archive with a layer of these shapes, all with this `frame` in this field."""
    shp, shx, dbf = BytesIO(), BytesIO(), BytesIO()
    with shapefile.Writer(shp=shp, shx=shx, dbf=dbf, shapeType=shape_type) as out:
        out.field(field, "C")
        for draw in shapes:
            draw(out)
            out.record(frame)
    content = BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for suffix, part in (("shp", shp), ("shx", shx), ("dbf", dbf)):
            archive.writestr(f"a.{suffix}", part.getvalue())
        archive.writestr("a.prj", projection)
    return read_geometry_file("a.zip", content.getvalue())


def test_a_line_keeps_its_heights_where_it_passes_a_place_twice() -> None:
    line = [[7, 53, 10], [7, 53, 40], [7.1, 53.1, 40], [7, 53, 25]]
    file = read(shapefile.POLYLINEZ, lambda out: out.linez([line]), frame="relative")
    assert file.problems == ()
    places = ((53.0, 7.0, 10.0), (53.0, 7.0, 40.0), (53.1, 7.1, 40.0), (53.0, 7.0, 25.0))
    assert [each.geometry for each in file.geometries] == [Route(places)]


def test_parts_of_a_line_and_multipoints_keep_their_heights() -> None:
    parts = [[[7, 53, 1], [7.1, 53, 2]], [[7.1, 53, 3], [7, 53, 4]]]
    file = read(shapefile.POLYLINEZ, lambda out: out.linez(parts))
    assert [each.geometry for each in file.geometries] == [
        Route(((53.0, 7.0, 1.0), (53.0, 7.1, 2.0)), "amsl"),
        Route(((53.0, 7.1, 3.0), (53.0, 7.0, 4.0)), "amsl"),
    ]
    points = [[7, 53, 10], [7, 53, 40]]
    file = read(shapefile.MULTIPOINTZ, lambda out: out.multipointz(points))
    assert file.geometries[0].geometry == Route(((53.0, 7.0, 10.0), (53.0, 7.0, 40.0)), "amsl")
    file = read(shapefile.POINTZ, lambda out: out.pointz(7, 53, 10))
    assert file.geometries[0].geometry == Point((53.0, 7.0, 10.0), "amsl")


@pytest.mark.parametrize("clockwise", [True, False])
def test_rings_keep_their_heights_when_holes_are_sorted_to_their_polygons(
    clockwise: bool,
) -> None:
    """Outer rings are clockwise in shapefiles; drawn the other way round, each is a polygon."""
    far = [[17, 53, 5], [17, 54, 6], [18, 54, 7], [17, 53, 8]]
    outer = [[7, 53, 1], [7, 54, 2], [8, 54, 3], [8, 53, 4], [7, 53, 1]]
    hole = [[7.2, 53.2, 5], [7.4, 53.2, 6], [7.4, 53.4, 7], [7.2, 53.2, 8]]
    rings = [far, outer, hole] if clockwise else [far[::-1], outer[::-1]]
    file = read(shapefile.POLYGONZ, lambda out: out.polyz(rings))
    heights = [
        [[corner[2] for corner in ring] for ring in each.geometry.rings]
        for each in file.geometries
        if isinstance(each.geometry, Area)
    ]
    if clockwise:
        assert heights == [[[5, 6, 7, 8, 5]], [[1, 2, 3, 4, 1], [5, 6, 7, 8, 5]]]
    else:
        assert heights == [[[8, 7, 6, 5, 8]], [[1, 4, 3, 2, 1]]]


@pytest.mark.parametrize("none", [float("nan"), -1e38, -1.7e308])
def test_a_height_that_is_no_data_is_none_with_a_warning(none: float) -> None:
    line = [[7, 53, 10], [7.1, 53.1, none], [7.2, 53.2, 30]]
    file = read(shapefile.POLYLINEZ, lambda out: out.linez([line]), frame="terrain")
    places = ((53.0, 7.0, 10.0), (53.1, 7.1, None), (53.2, 7.2, 30.0))
    assert file.geometries[0].geometry == Route(places, "terrain")
    assert [str(each) for each in file.problems] == ["a.shp shape 1: has no height at position 2"]


def test_measures_are_no_heights() -> None:
    line = [[7, 53, 100], [7.1, 53.1, 200]]
    file = read(shapefile.POLYLINEM, lambda out: out.linem([line]))
    assert file.geometries[0].geometry == Route(((53.0, 7.0, None), (53.1, 7.1, None)))
    assert "its measures (M values) are not read" in str(file.problems[0])


def test_a_shape_of_another_kind_leaves_the_others_of_its_layer() -> None:
    triangle = [[[7, 53, 1], [7, 54, 2], [8, 54, 3]]]
    file = read(
        shapefile.MULTIPATCH,
        lambda out: out.multipatch(triangle, partTypes=[0]),
        lambda out: out.null(),
    )
    assert [str(each) for each in file.problems] == [
        "a.shp shape 1: is a MULTIPATCH; export points, multi-points, lines or polygons",
        "a.shp shape 2: has no geometry",
    ]


def test_a_layer_of_a_projection_is_converted_with_its_heights_in_feet() -> None:
    projection = CRS("EPSG:32631+8228").to_wkt("WKT1_ESRI")
    file = read(shapefile.POINTZ, lambda out: out.pointz(500_000, 0, 100), projection=projection)
    point = file.geometries[0].geometry
    assert isinstance(point, Point)
    assert point.position == pytest.approx((0.0, 3.0, 30.48))
    assert point.altitude_frame == "amsl"
    assert "are converted to altitudes above mean sea level" in str(file.problems[0])


def test_the_altitude_mode_that_gdal_hands_over_from_kml_is_the_frame() -> None:
    # GDAL 3.12.4 cuts the name of the field `altitudeMode` of its driver LIBKML to ten characters.
    def draw(out: shapefile.Writer) -> None:
        out.pointz(7, 53, 50)

    file = read(shapefile.POINTZ, draw, frame="relativeToGround", field="altitudeMo")
    assert file.problems == ()
    assert file.geometries[0].geometry == Point((53.0, 7.0, 50.0), "terrain")
    file = read(shapefile.POINTZ, draw, frame="clampToGround", field="altitudeMo")
    assert file.geometries[0].geometry == Point((53.0, 7.0, None))


def test_a_layer_beyond_the_limit_of_positions_is_refused_before_it_is_read() -> None:
    """By the headers of its records: here they promise more than there is."""
    header = struct.pack(">7i", 9994, 0, 0, 0, 0, 0, 72) + struct.pack("<2i8d", 1000, 3, *[0.0] * 8)
    box = struct.pack("<i4d", 3, 0.0, 0.0, 0.0, 0.0)
    record = struct.pack(">2i", 1, 24) + box + struct.pack("<3i", 1, 200_001, 0)
    content = BytesIO()
    with zipfile.ZipFile(content, "w") as archive:
        archive.writestr("a.shp", header + record)
        archive.writestr("a.prj", WGS84)
    (problem,) = read_geometry_file("a.zip", content.getvalue()).problems
    assert str(problem) == "a.shp: the file has more than 200,000 positions; simplify its lines"


def test_fields_that_say_how_to_fly_are_named() -> None:
    shp, shx, dbf = BytesIO(), BytesIO(), BytesIO()
    with shapefile.Writer(shp=shp, shx=shx, dbf=dbf) as out:
        for field in ("NAME", "ALT_M", "SPEED", "COLOUR"):
            out.field(field, "C")
        out.point(7, 53)
        out.record("a", "120", "5", "red")
    content = BytesIO()
    with zipfile.ZipFile(content, "w") as archive:
        for suffix, part in (("shp", shp), ("shx", shx), ("dbf", dbf)):
            archive.writestr(f"a.{suffix}", part.getvalue())
        archive.writestr("a.prj", WGS84)
    (problem,) = read_geometry_file("a.zip", content.getvalue()).problems
    assert "a.shp: fields that say how to fly are not read: ALT_M, SPEED;" in str(problem)


def test_a_layer_without_a_table_has_shapes_without_names() -> None:
    # pyshp 3.1.6 raises where `Reader.dbf` is asked for and there is none.
    shp, content = BytesIO(), BytesIO()
    with shapefile.Writer(shp=shp, shx=BytesIO(), dbf=BytesIO()) as out:
        out.field("NAME", "C")
        out.point(7, 53)
        out.record("a")
    with zipfile.ZipFile(content, "w") as archive:
        archive.writestr("a.shp", shp.getvalue())
        archive.writestr("a.prj", WGS84)
    (point,) = read_geometry_file("b.zip", content.getvalue()).geometries
    assert (point.name, point.geometry) == ("b", Point((53.0, 7.0, None)))


@pytest.mark.parametrize("none", [-9999.0, -32768.0, -1.5e38])
def test_what_is_written_for_no_height_is_none(none: float) -> None:
    file = read(shapefile.POLYLINEZ, lambda out: out.linez([[[7, 53, none], [7.1, 53, 40]]]))
    assert file.geometries[0].geometry == Route(((53.0, 7.0, None), (53.0, 7.1, 40.0)), "amsl")
    assert "has no height at position 1" in str(file.problems[-1])
