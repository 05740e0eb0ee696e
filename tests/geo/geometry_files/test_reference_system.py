"""Coordinate reference systems: GDAL (by rasterio) is the judge of what PROJ is asked for here."""

import math

import pytest
import rasterio.crs
from pyproj import CRS
from rasterio.warp import transform

from m2pem.geo.geojson import GeometryError
from m2pem.geo.geometry_files.contents import Contents
from m2pem.geo.geometry_files.reference_system import system_named, system_of_wkt

BESSEL = 'SPHEROID["Bessel_1841",6377397.155,299.1528128]'
WGS84 = 'SPHEROID["WGS_1984",6378137.0,298.257223563]'


def geographic(datum: str, spheroid: str, name: str = "GCS_unknown") -> str:
    tail = 'PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]]'
    return f'GEOGCS["{name}",DATUM["{datum}",{spheroid}],{tail}'


SHIFTED = (
    CRS("EPSG:4326").to_wkt("WKT1_ESRI")
    + ',VERTCS["NAVD_1988",VDATUM["North_American_Vertical_Datum_1988"],'
    + 'PARAMETER["Vertical_Shift",{}],PARAMETER["Direction",1.0],UNIT["Meter",1.0]]'
)


def named(name: str) -> dict[str, object]:
    return {"type": "name", "properties": {"name": name}}


@pytest.mark.tried_with(
    "GDAL",
    "converts positions of 19 reference systems, named in WKT of GDAL, Esri and WKT 2",
    kind="Maps and geodesy",
    result="the same positions",
    package="rasterio",
)
@pytest.mark.parametrize("version", ["WKT1_ESRI", "WKT1_GDAL", "WKT2_2019"])
@pytest.mark.parametrize(
    ("code", "longitude", "latitude"),
    [
        (4326, 5, 5),
        (32756, 153, -28),  # UTM
        (3857, 5, 5),  # the web's Mercator
        (25832, 9, 50),  # ETRS89
        (26918, -77, 38),  # NAD83
        (4267, -77, 38),  # NAD27
        (2263, -73.9, 40.7),  # in feet
        (27700, -1, 52),
        (28992, 5, 52),
        (2154, 3, 47),
        (27572, 3, 47),  # from the meridian of Paris, in grads
        (4230, 2.35, 48.85),  # ED50
        (31467, 9, 50),  # Bessel; its axes are north, east
        (5514, 15, 50),  # axes to the south and west
        (2056, 8, 47),
        (7844, 150, -33),
        (2193, 173, -41),
        (4301, 139, 36),
        (4490, 116, 40),  # PROJ knows no transformation: WGS 84 by its definition
    ],
)
def test_positions_are_where_gdal_has_them(
    code: int, longitude: float, latitude: float, version: str
) -> None:
    xs, ys = transform("EPSG:4326", f"EPSG:{code}", [longitude], [latitude])
    wkt = CRS.from_epsg(code).to_wkt(version)
    (east,), (north,) = transform(rasterio.crs.CRS.from_wkt(wkt), "EPSG:4326", xs, ys)
    ((found_east, found_north),) = system_of_wkt(wkt).to_wgs84([(xs[0], ys[0])])
    off_m = 111_320 * math.hypot(
        found_north - north, (found_east - east) * math.cos(math.radians(latitude))
    )
    assert off_m < 0.01
    away_m = 111_320 * math.hypot(found_north - latitude, found_east - longitude)
    assert away_m < 1.0


def test_a_datum_with_parameters_in_the_file_is_moved_by_them() -> None:
    towgs84 = f"{BESSEL},TOWGS84[598.1,73.7,418.2,0.202,0.045,-2.455,6.7]"
    wkt = geographic("Bessel", towgs84)
    (east,), (north,) = transform(rasterio.crs.CRS.from_wkt(wkt), "EPSG:4326", [10.0], [50.0])
    ((longitude, latitude),) = system_of_wkt(wkt).to_wgs84([(10.0, 50.0)])
    assert [longitude, latitude] == pytest.approx([east, north], abs=1e-8)
    assert abs(north - 50.0) > 0.001


@pytest.mark.parametrize(
    ("wkt", "why"),
    [
        # GDAL 3.12.4 writes the parameters of a system that has no name into the datum's name.
        (
            geographic("D_Unknown_based_on_Bessel_1841_ellipsoid_using_towgs84_598_1_73", BESSEL),
            "of its datum 'D_Unknown_based_on_Bessel_1841_ellipsoid_using_towgs84_598_1_73' no",
        ),
        (geographic("D_Unknown_based_on_WGS84_ellipsoid_using_towgs84_-87", WGS84), "no transf"),
        (geographic("D_Unknown", BESSEL), "no transformation to WGS 84 is known"),
        ('LOCAL_CS["works",UNIT["Meter",1]]', "'works', which cannot be converted: is neither geo"),
        ("PROJCS[", "cannot be read"),
        ("hello", "cannot be read"),
        (geographic("D_X", f'{WGS84},EXTENSION["PROJ4_GRIDS","/etc/passwd"]'), "refers to a grid"),
        (SHIFTED.format(-2.5), "'GCS_WGS_1984' shifts heights by -2.5, which PROJ leaves out"),
    ],
)
def test_what_cannot_be_converted_is_refused_by_its_name(wkt: str, why: str) -> None:
    with pytest.raises(GeometryError, match=r"\w") as error:
        system_of_wkt(wkt)
    assert why in str(error.value)


def test_a_vertical_shift_of_nothing_is_read() -> None:
    assert system_of_wkt(SHIFTED.format("0.0")).to_wgs84([[5, 52, 12]]) == [[5, 52, 12]]


def test_a_position_outside_the_area_of_a_transformation_is_refused() -> None:
    """PROJ 9.5 takes a transformation for the Tarim basin near Beijing: 63 m off."""
    system = system_named(named("EPSG:4214"))
    with pytest.raises(GeometryError, match=r"no transformation .* known for .116, 40."):
        system.to_wgs84([(116.0, 40.0)])
    british = system_named(named("EPSG:27700"))
    with pytest.raises(GeometryError, match=r"no transformation"):
        british.to_wgs84([(1e30, 1e30)])


def test_a_line_over_areas_of_several_transformations_is_converted() -> None:
    system = system_named(named("EPSG:4267"))
    ends = [(-97.0, 48.9), (-97.0, 49.5)]  # NAD27 has others in Canada
    assert [round(each[1], 2) for each in system.to_wgs84(ends)] == [48.9, 49.5]


def test_how_right_a_transformation_is_becomes_a_warning_if_it_is_worse_than_a_metre() -> None:
    contents = Contents("a")
    for code, place in (("25832", (500_000, 5.5e6)), ("26918", (500_000, 4e6))):
        system = system_named(named(f"EPSG:{code}"))
        system.to_wgs84([place])
        system.warn_of_accuracy(contents, code)
    (only,) = [str(each) for each in contents.whole().problems if each.feature]
    assert only == (
        "26918: is converted from 'NAD83 / UTM zone 18N' by 'NAD83 to WGS 84 (1)' with an accuracy "
        "of 4 m"
    )


@pytest.mark.parametrize(
    ("code", "height_m"),
    [
        ("EPSG:4979", 100.0 + 33.97),  # above the ellipsoid: EGM96 is 33.97 m below it there
        ("EPSG:4326+5773", 100.0),
        ("EPSG:4326+5703", 100.0),
        ("EPSG:4326+8228", 30.48),  # feet
        ("EPSG:4326+6360", 30.48006096),  # US survey feet
        ("EPSG:4326+5715", -100.0),  # a depth
        ("EPSG:4326", 100.0),
    ],
)
def test_heights_are_metres_above_mean_sea_level(code: str, height_m: float) -> None:
    system = system_of_wkt(CRS(code).to_wkt("WKT1_ESRI"))
    ((_, _, height),) = system.to_wgs84([(-77.3192, 38.1075, 100.0)])
    assert height == pytest.approx(height_m, abs=0.05)


def test_heights_of_another_zero_are_refused_and_places_without_them_are_read() -> None:
    tidal = system_of_wkt(CRS("EPSG:4326+5861").to_wkt("WKT1_ESRI"))
    assert tidal.to_wgs84([(7, 53)]) == [[7, 53]]
    with pytest.raises(GeometryError, match="heights are of 'LAT depth', of which the distance"):
        tidal.to_wgs84([(7, 53, 30.0)])


def test_a_height_with_a_frame_beside_the_system_keeps_it_and_only_its_unit_changes() -> None:
    assert system_named(named("EPSG:4979")).to_wgs84([(7, 53, 30.0)], "relative") == [[7, 53, 30.0]]
    feet = system_of_wkt(CRS("EPSG:4326+8228").to_wkt("WKT1_ESRI"))
    assert feet.to_wgs84([(7, 53, 100.0)], "terrain")[0][2] == pytest.approx(30.48)


def test_a_system_in_feet_that_does_not_say_what_its_heights_are_keeps_only_zeros() -> None:
    system = system_named(named("EPSG:2263"))
    assert system.to_wgs84([(1e6, 2e5, 0.0)])[0][2] == 0.0
    with pytest.raises(GeometryError, match="in 'US survey foot' and does not say in which unit"):
        system.to_wgs84([(1e6, 2e5, 12.0)])


@pytest.mark.parametrize(
    "name",
    [
        "EPSG:25832",
        "urn:ogc:def:crs:EPSG::25832",
        "urn:ogc:def:crs:EPSG:6.9:25832",
        "http://www.opengis.net/def/crs/EPSG/0/25832",
    ],
)
def test_the_names_of_a_system_in_geojson(name: str) -> None:
    assert system_named(named(name)).name == "ETRS89 / UTM zone 32N"


@pytest.mark.parametrize(
    ("crs", "why"),
    [
        (named("ETRS89"), "'ETRS89' is not known; name it as EPSG:25832"),
        (named("EPSG:999999"), "'EPSG:999999' is not known to PROJ"),
        ({"type": "link", "properties": {"href": "a.prj"}}, "is not known"),
        ("ETRS89", "is not known"),
    ],
)
def test_a_system_that_is_not_known_is_refused(crs: object, why: str) -> None:
    with pytest.raises(GeometryError, match=r"\w") as error:
        system_named(crs)
    assert why in f"{error.value}; {getattr(error.value, 'remedy', '')}"
