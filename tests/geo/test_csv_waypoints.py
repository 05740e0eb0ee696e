import pytest

from m2pem.geo.csv_waypoints import parse_csv
from m2pem.geo.geojson import GeometryError
from m2pem.mission.geometry import Area, Point, Route


def test_heights_above_the_ellipsoid_are_read_as_altitudes_above_mean_sea_level() -> None:
    text = "lat_deg,lon_deg,alt_m,altitude_frame\n38.1075,-77.3192,60,ellipsoid\n"
    point = parse_csv(text, "point")
    assert isinstance(point, Point)
    assert point.altitude_frame == "amsl"
    assert point.position[2] == pytest.approx(93.97, abs=0.01)


def test_the_rows_of_a_route_are_its_waypoints_in_order() -> None:
    text = "lat_deg,lon_deg,alt_m\n38.1,-77.3,2\n38.2,-77.4,3.5\n"
    assert parse_csv(text, "route") == Route(((38.1, -77.3, 2.0), (38.2, -77.4, 3.5)))


def test_columns_may_stand_in_any_order_with_spaces_and_quotes() -> None:
    text = 'alt_m, "lon_deg", lat_deg\r\n 2, -77.3, "38.1"\r\n'
    assert parse_csv(text, "route") == Route(((38.1, -77.3, 2.0),))


def test_an_altitude_that_is_missing_is_not_zero() -> None:
    assert parse_csv("lat_deg,lon_deg\n1,2\n", "route") == Route(((1.0, 2.0, None),))
    rows = "lat_deg,lon_deg,alt_m\n1,2,\n3,4,5\n"
    assert parse_csv(rows, "route") == Route(((1.0, 2.0, None), (3.0, 4.0, 5.0)))


def test_an_altitude_in_feet_becomes_metres() -> None:
    point = parse_csv("lat_deg,lon_deg,alt_ft\n1,2,100\n", "point")
    assert isinstance(point, Point)
    assert point.position[2] == pytest.approx(30.48)


def test_the_frame_of_the_altitudes_is_kept() -> None:
    text = "lat_deg,lon_deg,alt_m,altitude_frame\n1,2,60,amsl\n3,4,61,amsl\n"
    assert parse_csv(text, "route").altitude_frame == "amsl"
    assert parse_csv("lat_deg,lon_deg\n1,2\n", "point").altitude_frame == "relative"
    mixed = parse_csv(text.replace("61,amsl", "61,"), "route")
    assert isinstance(mixed, Route)
    assert mixed.frames == ("amsl", "relative")


def test_a_comment_and_empty_lines_are_skipped() -> None:
    text = "# surveyed in spring\n\nlat_deg,lon_deg\n# the gate\n1,2\n,\n\n"
    assert parse_csv(text, "point") == Point((1.0, 2.0, None))


@pytest.mark.parametrize("last", ["", "1,2\n"])
def test_the_ring_of_an_area_is_closed(last: str) -> None:
    area = parse_csv(f"lat_deg,lon_deg\n1,2\n1,3\n2,3\n{last}", "area")
    corners = ((1.0, 2.0, None), (1.0, 3.0, None), (2.0, 3.0, None), (1.0, 2.0, None))
    assert area == Area((corners,))


@pytest.mark.parametrize(
    ("text", "kind", "message"),
    [
        ("", "route", "line 1: column '' is not known; known columns: lat_deg, lon_deg, alt_m"),
        ("lat,lon_deg\n", "route", "line 1: column 'lat' has no unit; write 'lat_deg'"),
        ("\nlat_deg,lon_deg,alt\n", "route", "line 2: column 'alt' has no unit; write 'alt_m'"),
        (
            "lat_rad,lon_deg\n",
            "route",
            "line 1: column 'lat_rad': positions are in degrees, 'lat_deg': convert it",
        ),
        ("lat_m,lon_m\n", "route", "'lat_m': positions are in degrees, 'lat_deg'"),
        (
            "lat_deg,lon_deg,alt_deg\n",
            "route",
            "column 'alt_deg': 'deg' is no length; known units of length: m, cm, km, ft, mi, nmi",
        ),
        ("Latitude,Longitude\n", "route", "'Latitude' is not known; did you mean 'lat_deg'?"),
        ("lat_deg,lon_deg,speed_m/s\n", "route", "column 'speed_m/s' is not known; known columns"),
        ("lat_deg,alt_m\n", "route", "line 1: there is no column 'lon_deg'"),
        ("lat_deg,lon_deg,lat_deg\n", "route", "line 1: two columns hold 'lat'"),
        ("lat_deg;lon_deg\n1;2\n", "route", "line 1: columns are separated by commas"),
        ("38.1,-77.3\n", "route", "line 1: column '38.1' is not known"),
        ("lat_deg,lon_deg\n", "route", "has no position below its header"),
        ("lat_deg,lon_deg\n1\n", "route", "line 2: has 1 columns where the header has 2"),
        ("lat_deg,lon_deg\n1,2\n1,x\n", "route", "line 3: lon 'x' is not a number"),
        ("lat_deg,lon_deg\n,2\n", "route", "line 2: lat '' is not a number"),
        ('lat_deg,lon_deg\n"1,5",2\n', "route", "decimals are written with a point"),
        ("lat_deg,lon_deg\n91,2\n", "route", "line 2: latitude 91 is not within -90..90"),
        ("lat_deg,lon_deg\nnan,2\n", "route", "line 2: latitude nan is not finite"),
        ('lat_deg,lon_deg\n"1,2\n', "route", "line 2: is not CSV"),
        (
            "lat_deg,lon_deg,altitude_frame\n1,2,ellipse\n",
            "route",
            "line 2: altitude_frame 'ellipse' is not known; did you mean 'ellipsoid'",
        ),
        (
            "lat_deg,lon_deg,altitude_frame\n1,2,amsl\n1,2,terrain\n",
            "area",
            "line 3: altitude_frame is 'terrain', but 'amsl' before",
        ),
        ("lat_deg,lon_deg\n1,2\n3,4\n", "point", "has 2 positions; a point is one"),
        ("lat_deg,lon_deg\n1,2\n3,4\n1,2\n", "area", "at least three different corners"),
    ],
)
def test_what_cannot_be_read_is_refused_with_its_line(text: str, kind: str, message: str) -> None:
    with pytest.raises(GeometryError) as refused:
        parse_csv(text, kind)
    assert message in str(refused.value)
