"""What holds for the geometries of every format."""

import json
import zipfile
from io import BytesIO

import pytest
import shapefile

from m2pem.geo.geometry_files import read_geometry_file
from m2pem.mission.geometry import Point

WGS84 = 'GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",SPHEROID["WGS_1984",6378137.0,298.257223563]]]'


def layer() -> bytes:
    """A shapefile of one point whose field says what its height counts from."""
    shp, shx, dbf = BytesIO(), BytesIO(), BytesIO()
    with shapefile.Writer(shp=shp, shx=shx, dbf=dbf, shapeType=shapefile.POINTZ) as out:
        out.field("alt_frame", "C")
        out.pointz(-77.3192, 38.1075, 60)
        out.record("ellipsoid")
    archive = BytesIO()
    with zipfile.ZipFile(archive, "w") as members:
        for suffix, content in {"shp": shp, "shx": shx, "dbf": dbf}.items():
            members.writestr(f"a.{suffix}", content.getvalue())
        members.writestr("a.prj", WGS84)
    return archive.getvalue()


FILES = {
    "a.geojson": json.dumps(
        {
            "type": "Feature",
            "properties": {"altitude_frame": "ellipsoid"},
            "geometry": {"type": "Point", "coordinates": [-77.3192, 38.1075, 60]},
        }
    ).encode(),
    "a.csv": b"name,lat_deg,lon_deg,alt_m,altitude_frame\np,38.1075,-77.3192,60,ellipsoid\n",
    "a.kml": b'<kml xmlns="http://www.opengis.net/kml/2.2"><Placemark><ExtendedData>'
    b'<Data name="altitude_frame"><value>ellipsoid</value></Data></ExtendedData>'
    b"<Point><coordinates>-77.3192,38.1075,60</coordinates></Point></Placemark></kml>",
    "a.zip": layer(),
}


@pytest.mark.parametrize("name", FILES)
def test_heights_above_the_ellipsoid_are_read_as_altitudes_above_mean_sea_level(name: str) -> None:
    file = read_geometry_file(name, FILES[name])
    assert file.problems == ()
    (read,) = file.geometries
    height_m = pytest.approx(93.97, abs=0.01)
    assert read.geometry == Point((38.1075, -77.3192, height_m), "amsl")
