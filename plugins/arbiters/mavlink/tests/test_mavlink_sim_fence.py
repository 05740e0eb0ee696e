"""The fence of a simulated vehicle."""

import pytest
from m2pem_plugin_mavlink.simulator.specification import Kind
from mavlink_bench import Bench, item
from mavlink_px4_bench import GROUND_M, NAN, REPOSITION, Px4Bench
from pymavlink.dialects.v20 import ardupilotmega as dialect

STATUS = 162
BOX = ((-50, -50), (50, -50), (50, 50), (-50, 50))
ON = {"FENCE_ENABLE": 1, "FENCE_TYPE": 4}


def polygon(bench: Bench, command: int, corners: tuple[tuple[int, int], ...], first: int = 0):
    return [
        item(first + n, command, bench.offset(*corner), 0, len(corners), frame=0, kind=1)
        for n, corner in enumerate(corners)
    ]


def circle(bench: Bench, command: int, north_m: float, east_m: float, radius_m: float):
    return item(0, command, bench.offset(north_m, east_m), 0, radius_m, frame=0, kind=1)


def fly(bench: Bench, north_mps: float, east_mps: float, seconds: float) -> None:
    """By velocity, which no fence refuses."""
    for _ in range(round(seconds)):
        bench.tell(
            dialect.MAVLink_set_position_target_local_ned_message(
                0, 1, 1, 1, 0xDC7, 0, 0, 0, north_mps, east_mps, 0, 0, 0, 0, 0, 0
            )
        )
        bench.run(1)


def test_leaving_an_inclusion_polygon_is_told_and_ends_in_rtl() -> None:
    bench = Bench(parameters=ON).airborne()
    assert bench.upload(polygon(bench, 5001, BOX)) == 0
    fly(bench, 8, 0, 4)
    assert bench.report(STATUS).breach_status == 0
    fly(bench, 8, 0, 4)
    assert bench.autopilot.modes.mode.name == "RTL"
    assert "Polygon fence breached" in bench.texts()
    (told, *_) = [m for m in bench.received if m.get_msgId() == STATUS and m.breach_status]
    assert (told.breach_count, told.breach_type) == (1, dialect.FENCE_BREACH_BOUNDARY)
    assert told.breach_time > 0
    bench.run_until(lambda: not bench.autopilot.arming.armed)
    assert bench.report(STATUS).breach_status == 0
    assert bench.report(STATUS).breach_count == 1


@pytest.mark.parametrize(("action", "mode"), [(0, "GUIDED"), (2, "LAND"), (4, "BRAKE")])
def test_what_happens_at_a_breach_is_set_by_a_parameter(action: int, mode: str) -> None:
    bench = Bench(parameters={**ON, "FENCE_ACTION": action}).airborne()
    bench.upload([circle(bench, 5003, 0, 0, 30)])
    fly(bench, 8, 0, 6)
    assert bench.autopilot.modes.mode.name == mode
    assert "Polygon fence breached" in bench.texts()


def test_an_exclusion_is_not_to_be_entered() -> None:
    bench = Bench(parameters=ON).airborne()
    bench.upload([circle(bench, 5004, 60, 0, 20)])
    fly(bench, 8, 0, 4)
    assert bench.autopilot.modes.mode.name == "GUIDED"
    fly(bench, 8, 0, 3)
    assert bench.autopilot.modes.mode.name == "RTL"


def test_an_exclusion_polygon_within_an_inclusion() -> None:
    bench = Bench(parameters=ON).airborne()
    hole = ((20, -10), (40, -10), (40, 10), (20, 10))
    items = polygon(bench, 5001, BOX) + polygon(bench, 5002, hole, first=4)
    assert bench.upload(items) == 0
    assert len(bench.autopilot.plans[1]) == 8
    assert bench.command_int(192, -1, 0, at=(*bench.offset(30, 0), 20)) == 4
    assert bench.command_int(192, -1, 0, at=(*bench.offset(30, 20), 20)) == 0
    assert bench.command_int(192, -1, 0, at=(*bench.offset(60, 20), 20)) == 4


def test_height_and_distance_from_home_are_fences_too() -> None:
    high = Bench(parameters={"FENCE_ENABLE": 1, "FENCE_TYPE": 1, "FENCE_ALT_MAX": 30}).airborne()
    high.tell(
        dialect.MAVLink_set_position_target_local_ned_message(
            0, 1, 1, 1, 0xDC7, 0, 0, 0, 0, 0, -5, 0, 0, 0, 0, 0
        )
    )
    high.run_until(lambda: high.autopilot.modes.mode.name != "GUIDED", limit_s=10)
    assert "Max Alt fence breached" in high.texts()
    far = Bench(parameters={"FENCE_ENABLE": 1, "FENCE_TYPE": 2, "FENCE_RADIUS": 40}).airborne()
    fly(far, 0, 8, 7)
    assert "Circle fence breached" in far.texts()


def test_a_disabled_fence_holds_nobody_until_it_is_enabled() -> None:
    bench = Bench().airborne()
    bench.upload([circle(bench, 5003, 0, 0, 30)])
    fly(bench, 8, 0, 6)
    assert bench.autopilot.modes.mode.name == "GUIDED"
    assert bench.command(dialect.MAV_CMD_DO_FENCE_ENABLE, 1) == 0
    bench.run(1)
    assert bench.autopilot.modes.mode.name == "RTL"


def test_beyond_the_fence_it_is_not_armed() -> None:
    bench = Bench(parameters=ON)
    bench.run(10)
    bench.upload([circle(bench, 5003, 100, 0, 30)])
    bench.command(176, 1, 4)
    assert bench.command(400, 1) == 4
    assert bench.texts()[-1] == "Arm: Vehicle breaching Polygon fence"


def test_a_polygon_whose_upload_was_abandoned_is_no_fence() -> None:
    bench = Bench(parameters=ON).airborne()
    corners = polygon(bench, 5001, BOX)
    bench.tell(dialect.MAVLink_mission_count_message(1, 1, 4, 1))
    bench.tell(corners[0])
    bench.tell(corners[1])
    bench.run(10)
    fly(bench, 8, 0, 8)
    assert bench.autopilot.modes.mode.name == "GUIDED"


def test_a_rover_holds_or_returns() -> None:
    bench = Bench(Kind.ROVER, parameters={**ON, "FENCE_ACTION": 2}).ready()
    bench.upload([circle(bench, 5003, 0, 0, 10)])
    fly(bench, 2, 0, 8)
    assert bench.autopilot.modes.mode.name == "HOLD"


def test_px4_holds_at_a_fence_that_was_uploaded() -> None:
    bench = Px4Bench().airborne()
    bench.upload([circle(bench, 5003, 0, 0, 30)])
    for _ in range(50):
        bench.velocity(5)
        bench.run(0.2)
        if bench.mode == "AUTO.LOITER" and bench.autopilot.body.north_m < 1:
            assert bench.enter(6) == 0
    assert bench.mode == "AUTO.LOITER"
    assert "Geofence exceeded (Polygon)" in bench.texts()


def test_px4_accepts_a_place_outside_and_then_says_that_it_does_not_go_there() -> None:
    bench = Px4Bench().airborne()
    bench.upload([circle(bench, 5003, 0, 0, 30)])
    place = (*bench.offset(50, 0), GROUND_M + 20)
    assert bench.command_int(REPOSITION, -1, 1, 0, NAN, at=place) == 0
    assert bench.texts()[-1] == "Reposition is outside geofence"
    bench.run(10)
    assert bench.autopilot.body.north_m < 1
