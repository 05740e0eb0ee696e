"""Waylines as DJI's Cloud API says of `waylines.wpml`, version 1.0.2."""

import zipfile
from io import BytesIO

import pytest

from m2pem.findings import Severity
from m2pem.geo.geoid import mean_sea_level_m
from m2pem.geo.geometry_files import GeometryFile, read_geometry_file
from m2pem.mission.geometry import Route

WPML = 'xmlns:wpml="http://www.dji.com/wpmz/1.0.2"'


def wpml(folders: str, config: str = "<wpml:finishAction>noAction</wpml:finishAction>") -> str:
    config = f"<wpml:missionConfig>{config}</wpml:missionConfig>"
    root = f'kml xmlns="http://www.opengis.net/kml/2.2" {WPML}'
    return f"<{root}><Document>{config}{folders}</Document></kml>"


def wayline(waypoints: str, mode: str = "relativeToStartPoint", number: int = 0) -> str:
    return (
        f"<Folder><wpml:waylineId>{number}</wpml:waylineId>"
        f"<wpml:executeHeightMode>{mode}</wpml:executeHeightMode>"
        f"<wpml:autoFlightSpeed>8</wpml:autoFlightSpeed>{waypoints}</Folder>"
    )


def waypoint(index: object, place: str, rest: str = "") -> str:
    point = f"<Point><coordinates>{place}</coordinates></Point>"
    return f"<Placemark>{point}<wpml:index>{index}</wpml:index>{rest}</Placemark>"


def height(metres: object, speed: object = 4) -> str:
    return (
        f"<wpml:executeHeight>{metres}</wpml:executeHeight>"
        f"<wpml:waypointSpeed>{speed}</wpml:waypointSpeed>"
    )


TWO = waypoint(1, "-77.318,38.1085", height(35, 3)) + waypoint(0, "-77.3192,38.1075", height(30))


def read(document: str) -> GeometryFile:
    return read_geometry_file("a.kml", document.encode())


def archive(*names: str, **members: str) -> GeometryFile:
    file = BytesIO()
    with zipfile.ZipFile(file, "w") as out:
        for name, text in zip(names, members.values(), strict=True):
            out.writestr(name, text)
    return read_geometry_file("a.kmz", file.getvalue())


@pytest.mark.tried_with(
    "DJI's WPML",
    "waylines of a `.kmz` as its documentation describes them are read",
    kind="Maps and geodesy",
    result="heights, speeds and order",
    note="actions and turns are named as left out",
    version="1.0.2",
)
def test_an_archive_is_read_as_it_is_flown_in_the_order_of_its_indices() -> None:
    file = archive(
        "wpmz/template.kml", "wpmz/waylines.wpml", template=wpml(""), waylines=wpml(wayline(TWO))
    )
    (route,) = file.geometries
    assert route.name == "wayline_0"
    assert route.geometry == Route(
        ((38.1075, -77.3192, 30.0), (38.1085, -77.318, 35.0)), "relative", (4.0, 3.0)
    )
    assert file.problems == ()


@pytest.mark.parametrize(
    ("mode", "frame"),
    [
        ("relativeToStartPoint", "relative"),
        ("EGM96", "amsl"),
        ("WGS84", "amsl"),
        ("realTimeFollowSurface", "terrain"),
    ],
)
def test_what_heights_are_above(mode: str, frame: str) -> None:
    (route,) = read(wpml(wayline(TWO, mode))).geometries
    assert isinstance(route.geometry, Route)
    assert route.geometry.altitude_frame == frame
    ellipsoid = mean_sea_level_m(38.1075, -77.3192, 30.0)
    assert route.geometry.waypoints[0][2] == (ellipsoid if mode == "WGS84" else 30.0)
    assert ellipsoid == pytest.approx(30.0 + 33.97, abs=0.05)


def test_several_waylines_are_several_routes() -> None:
    file = read(wpml(wayline(TWO) + wayline(TWO, "EGM96", 1)))
    assert [each.name for each in file.geometries] == ["wayline_0", "wayline_1"]


def test_a_gimbal_that_is_turned_on_the_way_is_left_out_with_a_warning() -> None:
    gimbal = "<wpml:waypointGimbalPitchAngle>{}</wpml:waypointGimbalPitchAngle>"
    down, level = (height(30) + gimbal.format(each) for each in ("-90", "0"))
    file = read(wpml(wayline(waypoint(0, "7,53", level) + waypoint(1, "8,54", down))))
    assert str(file.problems[0]).startswith(
        "wayline 0: gimbal pitch -90 is not read: of waypoint 1"
    )


def test_what_else_is_commanded_is_left_out_with_the_numbers_of_its_waypoints() -> None:
    action = "<wpml:actionGroup><wpml:action><wpml:actionActuatorFunc>{}"
    action += "</wpml:actionActuatorFunc></wpml:action></wpml:actionGroup>"
    turn = "<wpml:waypointTurnParam><wpml:waypointTurnMode>{}</wpml:waypointTurnMode>"
    turn += "</wpml:waypointTurnParam>"
    heading = "<wpml:waypointHeadingParam><wpml:waypointHeadingMode>{}</wpml:waypointHeadingMode>"
    heading += "</wpml:waypointHeadingParam>"
    first = height(30) + action.format("hover") + turn.format("coordinateTurn")
    second = height(30) + action.format("takePhoto") + action.format("hover")
    second += turn.format("toPointAndStopWithDiscontinuityCurvature") + heading.format("fixed")
    config = "<wpml:finishAction>goHome</wpml:finishAction>"
    config += "<wpml:takeOffSecurityHeight>20</wpml:takeOffSecurityHeight>"
    file = read(wpml(wayline(waypoint(0, "7,53", first) + waypoint(1, "8,54", second)), config))
    assert len(file.geometries) == 1
    assert {each.severity for each in file.problems} == {Severity.WARNING}
    assert [str(each).removesuffix("; draw it in the mission") for each in file.problems] == [
        "missionConfig: not read: finishAction goHome, takeOffSecurityHeight 20",
        "wayline 0: action hover is not read: of waypoint 0, 1",
        "wayline 0: action takePhoto is not read: of waypoint 1",
        "wayline 0: heading mode fixed is not read: of waypoint 1",
        "wayline 0: turn mode coordinateTurn is not read: of waypoint 0",
    ]


@pytest.mark.parametrize(
    ("folder", "why"),
    [
        (wayline(TWO, "barometer"), "height mode 'barometer' is not known; one of relative"),
        (wayline(waypoint(0, "7,53")), "waypoint 0: height '' cannot be flown"),
        (wayline(waypoint(0, "7,53", height("nan"))), "waypoint 0: height 'nan' cannot"),
        (wayline(waypoint(0, "7,53", height(1, 0))), "waypoint 0: speed '0' cannot be flown"),
        (wayline(waypoint(3, "7,93", height(1))), "latitude 93 is not within"),
        (wayline(waypoint(3, "", height(1))), "waypoint 3: has 0 positions"),
        (wayline(waypoint("1.5", "7,53", height(1))), "wpml:index 1.5 is not one whole number"),
        (wayline(TWO + TWO), "two waypoints have the same wpml:index"),
        (wayline(""), "has no waypoint"),
        *(
            (
                f"<Folder><wpml:templateType>{kind}</wpml:templateType><wpml:templateId>7"
                f"</wpml:templateId><wpml:autoFlightSpeed>8</wpml:autoFlightSpeed>{TWO}</Folder>",
                f"wayline 7: is a template of '{kind}'; export the KMZ with its waylines.wpml",
            )
            for kind in ("waypoint", "mapping2d")
        ),
    ],
)
def test_a_wayline_that_would_be_flown_otherwise_is_refused_whole(folder: str, why: str) -> None:
    file = read(wpml(folder))
    assert file.geometries == ()
    assert why in str(file.problems[0])


def test_a_wpml_file_is_read_without_its_archive() -> None:
    document = wpml(wayline(TWO)).replace(f" {WPML}", "")  # and without the declaration
    (route,) = read_geometry_file("waylines.wpml", document.encode()).geometries
    assert route.name == "wayline_0"
