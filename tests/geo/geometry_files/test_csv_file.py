"""Tables as other programs and drone planners write them."""

import pytest

from m2pem.findings import Severity
from m2pem.geo.geometry_files import GeometryFile, read_geometry_file
from m2pem.geo.geometry_files.contents import MAX_POSITIONS
from m2pem.geo.geometry_files.csv_file import MAX_COLUMNS
from m2pem.mission.geometry import Area, Point, Route

FT, FT_US = 0.3048, 1200 / 3937
MPH, KN = 1609.344 / 3600, 1852 / 3600


def read(*lines: str) -> GeometryFile:
    return read_geometry_file("a.csv", "\n".join(lines).encode())


@pytest.mark.parametrize(
    ("header", "metres", "frame"),
    [
        ("alt_ft", FT, "relative"),
        ("Altitude [ft]", FT, "relative"),
        ("alt(m)", 1.0, "relative"),
        ("altitude(meters)", 1.0, "relative"),
        ("Height (metres)", 1.0, "relative"),
        ("z [m]", 1.0, "relative"),
        ("alt feet", FT, "relative"),
        ("alt_ft_us", FT_US, "relative"),
        ("Altitude (US survey feet)", FT_US, "relative"),
        ("Elevation (ft)", FT, "relative"),
        ("height_above_takeoff(feet)", FT, "relative"),
        ("relative_altitude_m", 1.0, "relative"),
        ("Altitude AGL (ft)", FT, "terrain"),
        ("height above ground [m]", 1.0, "terrain"),
        ("altitude_above_seaLevel(feet)", FT, "amsl"),
        ("alt_amsl_m", 1.0, "amsl"),
        ("Altitude (AMSL)", 1.0, "amsl"),
        ("Height (m a.s.l.)", 1.0, "amsl"),
        ("altitude [m AMSL]", 1.0, "amsl"),
        ("alt (ft AGL)", FT, "terrain"),
        ("Alt(m) AGL", 1.0, "terrain"),
        ("altitude_ft_agl", FT, "terrain"),
        ("ALT_FT_MSL", FT, "amsl"),
    ],
)
def test_units_and_frames_of_heights_in_headers(header: str, metres: float, frame: str) -> None:
    (point,) = read(f"lat,lon,{header}", "53,7,100").geometries
    assert isinstance(point.geometry, Point)
    assert point.geometry.position[2] == pytest.approx(100 * metres)
    assert point.geometry.altitude_frame == frame


@pytest.mark.parametrize(
    ("header", "scale"),
    [
        ("speed_m_s", 1.0),
        ("Speed (m/s)", 1.0),
        ("speed(mps)", 1.0),
        ("speed_km_h", 1 / 3.6),
        ("Speed [km/h]", 1 / 3.6),
        ("speed kph", 1 / 3.6),
        ("speed(mph)", MPH),
        ("speed_kn", KN),
        ("speed (kt)", KN),
        ("Ground Speed [knots]", KN),
    ],
)
def test_units_of_speeds_in_headers(header: str, scale: float) -> None:
    (route,) = read(f"lat,lon,{header}", "53,7,10", "54,8,").geometries
    assert isinstance(route.geometry, Route)
    first, second = route.geometry.speeds_m_s
    assert first == pytest.approx(10 * scale)
    assert second is None


@pytest.mark.parametrize(
    ("header", "right"),
    [
        ("alt_furlong", "write alt_m or alt_ft, and in a column altitude_frame one of"),
        ("altitude (fathoms)", "write alt_m or alt_ft"),
        ("WaypointAltitude", "write alt_m or alt_ft"),
        ("depth_m", "write alt_m or alt_ft"),
        ("Flughöhe (m)", "write alt_m or alt_ft"),
        ("Geschwindigkeit", "write speed_m_s"),
        ("vel", "write speed_m_s"),
        ("MAV_FRAME", "write in a column altitude_frame"),
        ("epsg", "positions are WGS 84; convert them"),
        ("height_above_ground_at_drone_location(feet)", "write alt_m or alt_ft"),
        ("altitude_reference", "write alt_m or alt_ft, and in a column altitude_frame"),
        ("speed", "write speed_m_s or speed_km_h"),
        ("speed_furlongs", "write speed_m_s or speed_km_h"),
        ("airspeed_m_s", "write speed_m_s or speed_km_h"),
        ("mode", "write in a column altitude_frame one of relative, amsl, terrain"),
    ],
)
def test_a_height_speed_or_mode_that_cannot_be_read_stops_the_import(
    header: str, right: str
) -> None:
    file = read(f"lat,lon,alt_m,{header}", "53,7,10,5", "54,8,10,6")
    assert file.geometries == ()
    (problem,) = map(str, file.problems)
    assert problem.startswith(f"line 1: column {header!r} cannot be read; ")
    assert right in problem


@pytest.mark.parametrize("header", ["Height above ellipsoid (m)", "hae_m", "ellipsoid height [m]"])
def test_heights_above_the_ellipsoid_become_altitudes_above_mean_sea_level(header: str) -> None:
    (point,) = read(f"lat,lon,{header}", "38.1075,-77.3192,100").geometries
    assert isinstance(point.geometry, Point)
    assert point.geometry.altitude_frame == "amsl"
    assert point.geometry.position[2] == pytest.approx(133.97, abs=0.05)


@pytest.mark.parametrize(
    "header", ["Latitude (dms),Longitude (dms)", "lat_rad,lon_rad", "Latitude (N),Longitude (W)"]
)
def test_positions_of_another_unit_or_sign_are_refused(header: str) -> None:
    file = read(header, "53,7")
    assert file.geometries == ()
    assert "there is no column" in str(file.problems[0])


@pytest.mark.parametrize(
    ("header", "text"),
    [
        ("command", "LAND"),
        ("MAV_CMD", "21"),
        ("cmd", "NAV_LOITER_TIME"),
        ("action", "Takeoff"),
        ("Task", "rtl"),
        ("action", "Return to home"),
        ("command", "MAV_CMD_NAV_VTOL_LAND"),
    ],
)
def test_a_row_that_is_no_waypoint_stops_the_import(header: str, text: str) -> None:
    file = read(f"lat,lon,alt_m,{header}", "53,7,10,", f"54,8,0,{text}")
    assert file.geometries == ()
    assert str(file.problems[-1]) == (
        f"line 3: {header} {text!r} is no waypoint; leave its row out, and draw it as a task of "
        "the mission"
    )


def test_commands_that_are_waypoints_are_a_route() -> None:
    file = read("lat,lon,alt_m,command", "53,7,10,16", "54,8,10,MAV_CMD_NAV_WAYPOINT", "54,9,10,")
    assert len(file.geometries) == 1
    file = read("lat,lon,alt_m,action,cmd_id", "53,7,10,landscape,77", "54,8,10,take a photo,78")
    assert len(file.geometries) == 1


@pytest.mark.parametrize(
    ("header", "why"),
    [
        ("alt_m,height_ft", "columns 'alt_m' and 'height_ft' hold the same"),
        ("x,y", "columns 'lon' and 'x' hold the same"),
        ("alt_agl_m,altitude_frame", "two columns say what heights are above"),
    ],
)
def test_two_columns_that_may_differ_stop_the_import(header: str, why: str) -> None:
    file = read(f"lat,lon,{header}", "53,7,1,amsl")
    assert file.geometries == ()
    assert why in str(file.problems[0])


def test_columns_of_something_else_are_named_and_left_out() -> None:
    file = read("lat,lon,colour,wind_speed,salt", "53,7,red,3,1")
    assert len(file.geometries) == 1
    assert str(file.problems[0]) == "line 1: columns that are not read: colour, wind_speed, salt"


def test_an_elevation_without_a_frame_is_above_home_with_a_warning() -> None:
    (problem,) = read("lat,lon,ele_m", "53,7,3").problems
    assert problem.severity is Severity.WARNING
    assert "'ele_m' is taken as heights above home" in str(problem)
    assert read("lat,lon,ele_m,altitude_frame", "53,7,3,amsl").problems == ()


@pytest.mark.parametrize(
    ("word", "frame"),
    [("AGL", "terrain"), ("relativeToGround", "terrain"), ("absolute", "amsl"), ("MSL", "amsl")],
)
def test_altitude_modes_of_other_programs(word: str, frame: str) -> None:
    (point,) = read("lat,lon,alt_m,Altitude Mode", f"53,7,3,{word}").geometries
    assert point.geometry == Point((53.0, 7.0, 3.0), frame)


def test_a_mission_of_litchi_is_its_route_without_what_it_commands() -> None:
    """Columns of Litchi's Mission Hub in imperial units: mode 1 is above ground, and a speed of 0
    is that of the mission, which is not in the file."""
    actions = [
        f"{word}{number}" for number in range(1, 16) for word in ("actiontype", "actionparam")
    ]
    before = ["latitude", "longitude", "altitude(ft)", "heading(deg)", "curvesize(ft)"]
    before += ["rotationdir", "gimbalmode", "gimbalpitchangle"]
    after = ["altitudemode", "speed(mph)", "poi_latitude", "poi_longitude", "poi_altitude(ft)"]
    after += ["poi_altitudemode", "photo_timeinterval", "photo_distinterval"]
    rows = (
        [*place, "0", "9", "0", "2", "-90", *["-1", "0"] * 15, "1", speed, *"00001", "-1"]
        for place, speed in ((("53", "7", "100"), "0"), (("54", "8", "200"), "10"))
    )
    file = read(*(",".join(row) for row in ([*before, *actions, *after], *rows)))
    (route,) = file.geometries
    assert route.geometry == Route(
        ((53.0, 7.0, 100 * FT), (54.0, 8.0, 200 * FT)), "terrain", (None, 10 * MPH)
    )
    (problem,) = file.problems
    assert str(problem) == (
        "line 1: columns that command more than a place are not read: heading(deg), "
        "curvesize(ft), rotationdir, gimbalmode, gimbalpitchangle, actiontype, actionparam, "
        "poi_latitude, poi_longitude, poi_altitude(ft), poi_altitudemode, photo_timeinterval, "
        "photo_distinterval; draw it in the mission"
    )


@pytest.mark.parametrize("beyond", [0, 1])
def test_rows_are_counted_before_they_are_read(beyond: int) -> None:
    """A bad row at the end: of a table that is too long it is never reached."""
    rows = ["53,7"] * (MAX_POSITIONS - 1 + beyond)
    (problem,) = read("# a comment", "lat,lon", *rows, "bad").problems
    assert ("more than 200,000 positions" in str(problem)) == bool(beyond)


def test_commas_are_no_rows() -> None:
    lines = ["lat,lon,note", *['53,7,"a\nb\n\nc"'] * 70_000]
    assert len(read(*lines).geometries) == 1


def read_as(kind: str, text: str) -> GeometryFile:
    return read_geometry_file("a.csv", text.encode(), kind)


def test_rows_that_do_not_say_what_they_are_become_what_is_asked_for() -> None:
    places = ((1.0, 2.0, None), (1.0, 3.0, None), (2.0, 3.0, None))
    text = "lat_deg,lon_deg\n1,2\n1,3\n2,3\n"
    for ring in (text, f"{text}1,2\n"):
        (area,) = read_as("area", ring).geometries
        assert area.geometry == Area(((*places, places[0]),))
    (route,) = read_as("route", text[:20]).geometries
    assert route.geometry == Route(places[:1])


def test_spaces_quotes_comments_and_empty_lines_are_no_positions() -> None:
    text = '# spring\n\nalt_m, "lon_deg", lat_deg\r\n# a gate\n 2, -77.3, "38.1"\r\n,,\n\n'
    (point,) = read(text).geometries
    assert point.geometry == Point((38.1, -77.3, 2.0))


@pytest.mark.parametrize(
    ("text", "kind", "message"),
    [
        ("", "", "line 1: there is no column 'lat' among ''; the header is, for example, name,"),
        ("lat_deg,alt_m\n1,2", "", "line 1: there is no column 'lon'"),
        ("lat_deg,lon_deg\n", "", "has no row below its header"),
        ("lat_deg,lon_deg\n1\n", "", "line 2: has 1 columns where the header has 2"),
        ("lat_deg,lon_deg\n1,2\n1,x\n", "", "line 3: lon 'x' is not a number"),
        ("lat_deg,lon_deg\n,2\n", "", "line 2: lat '' is not a number"),
        ('lat_deg,lon_deg\n"1,5",2\n', "", "decimals are written with a point"),
        ("lat_deg,lon_deg\n91,2\n", "", "line 2: latitude 91 is not within -90..90"),
        ("lat_deg,lon_deg\nnan,2\n", "", "line 2: latitude nan is not finite"),
        ('lat_deg,lon_deg\n"1,2\n', "", "line 2: is not CSV"),
        ("lat,lon,altitude_frame\n1,2,ellipse", "", "'ellipse' is not known; did you mean 'elli"),
        (
            "lat,lon,altitude_frame\n1,2,amsl\n1,3,terrain\n2,3,amsl",
            "area",
            "line 3: kind or altitude_frame differs from the rows before",
        ),
        ("lat_deg,lon_deg\n1,2\n3,4\n", "point", "has 2 positions; a point is one"),
        ("lat_deg,lon_deg\n1,2\n3,4\n1,2\n", "area", "at least three different corners"),
        (
            "lat,lon,ring,speed_m_s\n0,0,0,5\n0,9,0,\n9,9,0,\n1,2,1,\n1,3,1,\n2,3,1,",
            "area",
            "only a route has speeds, not an area",
        ),
    ],
)
def test_rows_that_cannot_be_read_are_refused_with_their_line(
    text: str, kind: str, message: str
) -> None:
    file = read_as(kind, text)
    assert file.geometries == ()
    assert message in str(file.problems[-1])


def test_a_table_of_too_many_columns_is_refused_before_they_are_read() -> None:
    (problem,) = read("lat,lon" + ",x" * MAX_COLUMNS, "1,2").problems
    assert str(problem) == "line 1: has more than 1000 columns; leave some out"


def test_a_single_row_with_a_speed_is_a_route() -> None:
    (route,) = read("lat,lon,alt_m,speed_m_s", "53,7,10,5").geometries
    assert route.geometry == Route(((53.0, 7.0, 10.0),), "relative", (5.0,))
