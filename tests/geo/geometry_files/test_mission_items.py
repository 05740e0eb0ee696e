"""What becomes of the items of a mission: carried over, left out with a warning, or refused."""

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import pytest
from pymavlink import mavutil, mavwp
from pymavlink.dialects.v20 import ardupilotmega

from m2pem.findings import Severity
from m2pem.geo.geometry_files import GeometryFile, read_geometry_file
from m2pem.geo.local_frame import LocalFrame
from m2pem.mission.geometry import Area, Point, Route

HOME = "0 1 0 16 0 0 0 0 38.1075 -77.3192 60 1"
A = "3 16 0 0 0 0 38.1085 -77.3192 30"
B = "3 16 0 0 0 0 38.1085 -77.3180 40"
PLACES = ((38.1085, -77.3192, 30.0), (38.1085, -77.3180, 40.0))


def read(*items: str, header: str = "QGC WPL 110") -> GeometryFile:
    """A file with a home position and items: frame, command, parameters, perhaps autoContinue."""
    rows = [
        f"{n} 0 {item}{'' if len(item.split()) == 10 else ' 1'}" for n, item in enumerate(items, 1)
    ]
    return read_geometry_file("m.waypoints", "\n".join([header, HOME, *rows]).encode())


def said(file: GeometryFile, severity: Severity) -> list[str]:
    return [str(each) for each in file.problems if each.severity is severity]


def route(file: GeometryFile) -> Route:
    assert said(file, Severity.ERROR) == []
    (found,) = (each.geometry for each in file.geometries if isinstance(each.geometry, Route))
    return found


# --- left out with a warning --------------------------------------------------------------------


def test_a_take_off_at_the_beginning_and_a_landing_at_the_end_are_left_out_with_a_warning() -> None:
    file = read("3 22 0 0 0 0 0 0 20", A, B, "3 21 0 0 0 0 38.108 -77.318 0")
    assert route(file) == Route(PLACES)
    assert said(file, Severity.WARNING) == [
        "item 1 (to 20 m): MAV_CMD_NAV_TAKEOFF is left out; a task `takeoff` before it",
        "item 4 (at 38.1080000, -77.3180000): MAV_CMD_NAV_LAND is left out; a task `goto` to its "
        "place, then `land`",
    ]


@pytest.mark.parametrize(
    ("item", "warning"),
    [
        ("2 20 0 0 0 0 0 0 0", "item 2: MAV_CMD_NAV_RETURN_TO_LAUNCH is left out; a task `return"),
        ("3 85 0 0 0 0 0 0 0", "item 2: MAV_CMD_NAV_VTOL_LAND is left out; a task `goto`"),
        ("2 93 12 0 0 0 0 0 0", "item 2 (12 s): MAV_CMD_NAV_DELAY is left out; a task `hold`"),
        ("2 112 5 0 0 0 0 0 0", "item 2 (5 s): MAV_CMD_CONDITION_DELAY is left out; what follows"),
        ("2 115 90 0 0 0 0 0 0", "item 2 (90 deg): MAV_CMD_CONDITION_YAW is left out; `heading`"),
        ("3 201 0 0 0 0 38 -77 0", "item 2 (at 38.0000000, -77.0000000): MAV_CMD_DO_SET_ROI is"),
        ("2 206 20 0 0 0 0 0 0", "item 2 (every 20 m): MAV_CMD_DO_SET_CAM_TRIGG_DIST is left out;"),
        (
            "2 183 9 1900 0 0 0 0 0",
            "item 2 (9 to 1900): MAV_CMD_DO_SET_SERVO is left out; a task `d",
        ),
        ("2 189 0 0 0 0 0 0 0", "item 2: MAV_CMD_DO_LAND_START is left out; a task `land`"),
        ("2 177 1 0 0 0 0 0 0", "item 2 (to 1, 0 times): MAV_CMD_DO_JUMP is left out; it is never"),
        ("2 44444 0 0 0 0 0 0 0", "item 2: MAV_CMD_44444, which is not known, is left out; draw"),
        ("2 178 2 3 0 0 0 0 0", "item 2 (climbing 3 m/s): MAV_CMD_DO_CHANGE_SPEED is left out;"),
        ("2 178 1 -2 0 0 0 0 0", "item 2 (-2 m/s): MAV_CMD_DO_CHANGE_SPEED is left out; `spee"),
        ("2 178 1 4 0 1 0 0 0", "item 2 (relative 4 m/s): MAV_CMD_DO_CHANGE_SPEED is left out;"),
        ("2 178 1 -1 60 0 0 0 0", "item 2 (60 %): MAV_CMD_DO_CHANGE_SPEED: the throttle is left"),
    ],
)
def test_what_does_not_change_the_way_is_named_with_its_number(item: str, warning: str) -> None:
    is_end = item.split()[1] in ("20", "85")
    file = read(A, B, item) if is_end else read(A, item, B)
    assert route(file).waypoints == PLACES
    (found,) = said(file, Severity.WARNING)
    assert found.startswith(warning.replace("item 2", "item 3") if is_end else warning)


@pytest.mark.parametrize(
    ("waypoint", "warning"),
    [
        ("3 16 30 0 0 0 38 -77 30", "item 1 (30 s): MAV_CMD_NAV_WAYPOINT: a hold time is left out"),
        ("3 16 0 8 0 0 38 -77 30", "item 1 (8 m): MAV_CMD_NAV_WAYPOINT: an acceptance radius"),
        ("3 16 0 0 25 0 38 -77 30", "item 1 (25 m): MAV_CMD_NAV_WAYPOINT: a pass radius"),
        ("3 16 0 0 0 45 38 -77 30", "item 1 (45 deg): MAV_CMD_NAV_WAYPOINT: a heading"),
        ("3 19 10 0 0 0 38 -77 30", "item 1 (10 s): MAV_CMD_NAV_LOITER_TIME: the wait is left out"),
        ("3 16 0 0 0 0 38 -77 30 0", "item 1: does not go on by itself (autoContinue)"),
    ],
)
def test_what_a_waypoint_says_beside_its_place_is_named(waypoint: str, warning: str) -> None:
    file = read(waypoint, B)
    assert route(file).waypoints == ((38.0, -77.0, 30.0), PLACES[1])
    (found,) = said(file, Severity.WARNING)
    assert found.startswith(warning)


def test_many_items_of_a_kind_are_one_warning() -> None:
    file = read(*(each for _ in range(10) for each in (A, "2 203 0 0 0 0 0 0 0")))
    (found,) = said(file, Severity.WARNING)
    assert found.startswith("items 2, 4, 6, 8, 10, 12, 14, 16 and 2 more: MAV_CMD_DO_DIGICAM_CON")


def test_a_landing_section_behind_the_end_of_the_mission_is_left_out() -> None:
    file = read(A, B, "2 20 0 0 0 0 0 0 0", "2 189 0 0 0 0 0 0 0", A, "3 21 0 0 0 0 38 -77 0")
    assert route(file) == Route(PLACES)
    assert (
        "items 4, 5, 6: of a landing that the mission does not come to"
        in said(file, Severity.WARNING)[1]
    )


def test_a_place_to_stay_at_the_end_is_a_waypoint() -> None:
    file = read(A, B.replace("16", "17", 1))
    assert route(file) == Route(PLACES)
    assert said(file, Severity.WARNING) == [
        "item 2: MAV_CMD_NAV_LOITER_UNLIM: that it stays there is left out; a task `hold`, or "
        "`orbit` for a plane"
    ]


# --- refused ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("item", "error"),
    [
        ("3 21 0 0 0 0 0 0 0", "item 2: MAV_CMD_NAV_LAND, with waypoints behind it, is no part of"),
        ("2 20 0 0 0 0 0 0 0", "item 2: MAV_CMD_NAV_RETURN_TO_LAUNCH, with waypoints behind it"),
        ("3 17 0 0 0 0 38 -77 9", "item 2: MAV_CMD_NAV_LOITER_UNLIM, with waypoints behind it"),
        ("3 18 2 0 9 0 38 -77 9", "item 2 (2 turns, radius 9 m): MAV_CMD_NAV_LOITER_TURNS, with"),
        (
            "3 31 0 0 0 0 38 -77 9",
            "item 2 (to 9 m at 38.0000000, -77.0000000): MAV_CMD_NAV_LOITER_TO_ALT, with waypoints",
        ),
        (
            "3 94 0 0 0 0 38 -77 9",
            "item 2 (at 38.0000000, -77.0000000): MAV_CMD_NAV_PAYLOAD_PLACE, with",
        ),
        ("2 179 1 0 0 0 0 0 0", "item 2: MAV_CMD_DO_SET_HOME, with waypoints behind it"),
        ("3 22 0 0 0 0 0 0 20", "item 2 (to 20 m): MAV_CMD_NAV_TAKEOFF cannot be flown as part"),
        ("3 82 0 0 0 0 38 -77 9", "item 2: MAV_CMD_NAV_SPLINE_WAYPOINT cannot be flown as part"),
        ("2 177 1 3 0 0 0 0 0", "item 2 (to 1, 3 times): MAV_CMD_DO_JUMP cannot be flown as part"),
        ("2 601 1 -1 0 0 0 0 0", "item 2 (to tag 1, -1 times): MAV_CMD_DO_JUMP_TAG cannot be"),
        ("2 92 1 0 0 0 0 0 0", "item 2: MAV_CMD_NAV_GUIDED_ENABLE cannot be flown as part"),
        ("2 83 9 0 0 0 0 0 0", "item 2: MAV_CMD_NAV_ALTITUDE_WAIT cannot be flown as part"),
        ("3 30 0 0 0 0 0 0 50", "item 2: MAV_CMD_NAV_CONTINUE_AND_CHANGE_ALT cannot be flown"),
        ("3 31001 0 0 0 0 38 -77 9", "item 2: MAV_CMD_31001, which is not known, cannot be flown"),
    ],
)
def test_where_the_vehicle_would_fly_otherwise_there_is_no_route(item: str, error: str) -> None:
    file = read(A, item, B)
    (found,) = said(file, Severity.ERROR)
    assert found.startswith(error)
    assert file.geometries == ()


def test_all_that_is_refused_is_said_at_once() -> None:
    file = read(A, "3 82 0 0 0 0 38 -77 9", "2 177 1 3 0 0 0 0 0", "2 20 0 0 0 0 0 0 0", B)
    assert len(said(file, Severity.ERROR)) == 3


# --- places -------------------------------------------------------------------------------------


@pytest.mark.parametrize("here", ["0 0", "nan nan"])
def test_no_place_is_the_place_before_at_an_altitude_of_its_own(here: str) -> None:
    file = read(A, f"3 16 0 0 0 0 {here} 50", f"3 19 5 0 0 0 {here} 0", f"0 16 0 0 0 0 {here} 95")
    here_ = PLACES[0][:2]
    assert route(file) == Route.of(
        ((*here_, 30.0), (*here_, 50.0), (*here_, 95.0)), ("relative", "relative", "amsl")
    )


def test_no_place_at_the_beginning_is_where_the_vehicle_is() -> None:
    file = read("3 22 0 0 0 0 0 0 20", "3 16 0 0 0 0 0 0 50", A, B)
    assert route(file) == Route(PLACES)
    assert (
        "item 2: is where the vehicle is then, which is no waypoint"
        in said(file, Severity.WARNING)[1]
    )


def test_no_place_behind_the_last_waypoint_is_left_out_with_its_number() -> None:
    file = read(A, B, "3 16 0 0 0 0 0 0 0")
    assert route(file) == Route(PLACES)
    (warning,) = said(file, Severity.WARNING)
    assert warning.startswith("item 3: is where the vehicle is then")


def test_an_altitude_of_0_behind_a_take_off_is_doubtful() -> None:
    file = read("3 22 0 0 0 0 0 0 20", A.replace("30", "0"), B.replace("40", "0"))
    assert said(file, Severity.WARNING)[1].startswith("items 2, 3: is at 0 m, which to a copter")
    rover = read(A.replace("30", "0"), B.replace("40", "0"))
    assert said(rover, Severity.WARNING) == []


def test_an_altitude_of_0_below_others_is_doubtful() -> None:
    # ArduCopter 4.7 (mode_auto.cpp, loc_from_cmd) keeps its altitude there; PX4 descends.
    file = read(A, B.replace("40", "0"), "3 16 0 0 0 0 38.1 -77.3 30")
    assert route(file).waypoints[1][2] == 0.0
    assert said(file, Severity.WARNING) == [
        "item 2: is at 0 m, which to a copter of ArduPilot is the altitude that it has; give it "
        "the altitude that is meant"
    ]
    rover = "3 16 0 0 0 0 38.1085 -77.3192 0"
    assert read(rover, B.replace("40", "0")).problems == ()


def test_each_waypoint_keeps_its_altitude_frame() -> None:
    third = "10 16 0 0 0 0 38.109 -77.318 25"
    file = read(A, B.replace("3", "0", 1), third)
    assert route(file).frames == ("relative", "amsl", "terrain")
    same = read(A, B)
    assert route(same).altitude_frames == ()


@pytest.mark.parametrize("frame", ["1", "2", "4", "7"])
def test_a_waypoint_of_another_frame_is_refused(frame: str) -> None:
    (error,) = said(read(A, frame + B[1:]), Severity.ERROR)
    assert error == f"item 2 (line 4): MAV_FRAME {frame} is not global, relative or terrain"


@pytest.mark.tried_with(
    "pymavlink",
    "its `mavwp` reads `.waypoints` with frames that differ",
    kind="MAVLink clients",
    result="the same places and frames",
    package="pymavlink",
)
def test_places_and_frames_are_those_that_pymavlink_reads(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MAVLINK20", "1")  # another test of the process may have set it
    monkeypatch.setattr(mavutil, "mavlink", ardupilotmega)
    rows = ["# planned by hand", "", f"1 0 {A} 1", f"2 0 0{B[1:]} 1", f"3 0 10{A[1:]} 1"]
    path = tmp_path / "m.txt"
    path.write_text("\n".join(["QGC WPL 110", HOME, *rows, ""]))
    loader = mavwp.MAVWPLoader()
    assert loader.load(str(path)) == 4
    judged = [loader.wp(index) for index in range(1, 4)]
    found = route(read_geometry_file(path.name, path.read_bytes()))
    assert found.waypoints == tuple((each.x, each.y, each.z) for each in judged)
    numbers = {"relative": 3, "amsl": 0, "terrain": 10}
    assert [numbers[each] for each in found.frames] == [each.frame for each in judged]


@pytest.mark.parametrize(
    ("speed", "speeds"),
    [("178 0 5", (5.0, None)), ("178 1 5", (5.0, None)), ("178 1 -1", ()), ("178 3 5", ())],
)
def test_only_speeds_over_ground_or_through_the_air_are_read(
    speed: str, speeds: tuple[float | None, ...]
) -> None:
    assert route(read(A, f"2 {speed} 0 0 0 0 0", B)).speeds_m_s == speeds
    assert route(read(f"2 {speed} 0 0 0 0 0", A, B)).speeds_m_s == speeds


# --- fences and rally points --------------------------------------------------------------------


def polygon(command: int, *corners: str) -> Sequence[str]:
    return [f"0 {command} {len(corners)} 0 0 0 {corner} 0" for corner in corners]


def test_a_fence_file_is_areas_to_stay_in_and_out_of() -> None:
    square = polygon(5001, "38.10 -77.32", "38.12 -77.32", "38.12 -77.30", "38.10 -77.30")
    pond = polygon(5002, "38.110 -77.311", "38.112 -77.311", "38.111 -77.310")
    file = read(
        "3 5000 0 0 0 0 38.11 -77.31 40", *square, *pond, "0 5004 50 0 0 0 38.115 -77.315 0"
    )
    assert file.problems == ()
    assert [each.name for each in file.geometries] == [
        "fence_return",
        "fence",
        "keep_out",
        "keep_out_2",
    ]
    assert file.geometries[0].geometry == Point((38.11, -77.31, 40.0))
    fence = file.geometries[1].geometry
    assert isinstance(fence, Area)
    assert [each[:2] for each in fence.rings[0][:2]] == [(38.10, -77.32), (38.12, -77.32)]


def test_a_fence_that_ends_where_it_begins_has_that_corner_twice() -> None:
    corners = ("38.10 -77.32", "38.12 -77.32", "38.12 -77.30")
    open_, closed = (read(*polygon(5001, *each)) for each in (corners, (*corners, corners[0])))
    assert closed == open_


@pytest.mark.parametrize(("command", "least_m", "most_m"), [(5003, 49.9, 50.0), (5004, 50.0, 50.1)])
def test_a_circle_is_an_area_that_errs_to_the_safe_side(
    command: int, least_m: float, most_m: float
) -> None:
    (found,) = read(f"0 {command} 50 0 0 0 38.115 -77.315 0").geometries
    assert isinstance(found.geometry, Area)
    frame = LocalFrame((38.115, -77.315))
    corners = [frame.to_local(each[:2]) for each in found.geometry.rings[0]]
    sides = [((a[0] + b[0]) / 2, (a[1] + b[1]) / 2) for a, b in pairwise(corners)]
    reaches = [(e * e + n * n) ** 0.5 for e, n in (corners if command == 5003 else sides)]
    assert least_m - 1e-6 <= min(reaches)
    assert max(reaches) <= most_m + 1e-6


def test_a_polygon_with_another_number_of_corners_is_refused() -> None:
    square = polygon(5001, "38.10 -77.32", "38.12 -77.32", "38.12 -77.30", "38.10 -77.30")
    (error,) = said(read(*square[:3]), Severity.ERROR)
    assert error == "item 1 (line 3): a fence of 3 corners, where parameter 1 says another"


def test_corners_of_two_polygons_are_not_mixed() -> None:
    inner = polygon(5001, "38.10 -77.32", "38.12 -77.32", "38.12 -77.30", "38.10 -77.30")
    outer = polygon(5002, "38.110 -77.311", "38.112 -77.311", "38.111 -77.310")
    file = read(*inner[:2], *outer)
    assert said(file, Severity.ERROR) == [
        "item 1 (line 3): a fence of 2 corners, where parameter 1 says another"
    ]
    assert [each.name for each in file.geometries] == ["keep_out"]


def test_a_circle_without_a_radius_is_refused() -> None:
    (error,) = said(read("0 5003 0 0 0 0 38.115 -77.315 0"), Severity.ERROR)
    assert error == "item 1 (line 3): a radius of 0.0 m is not between 0 and 100000 m"


def test_a_rally_file_is_points() -> None:
    file = read("3 5100 0 0 0 0 38.1085 -77.3192 30", "0 5100 0 0 0 0 38.1095 -77.3192 90")
    assert [(each.name, each.geometry) for each in file.geometries] == [
        ("rally", Point((38.1085, -77.3192, 30.0))),
        ("rally_2", Point((38.1095, -77.3192, 90.0), "amsl")),
    ]
