import pytest
from m2pem_plugin_mavlink.simulator.geometry import Point
from m2pem_plugin_mavlink.simulator.specification import Kind
from mavlink_bench import Bench, item


def flying() -> Bench:
    bench = Bench(Kind.PLANE)
    bench.run(10)
    assert bench.command(176, 1, 13) == 0
    assert bench.command(400, 1) == 0
    bench.run(40)
    return bench


def test_in_takeoff_mode_a_plane_climbs_to_its_height_and_circles() -> None:
    bench = flying()
    body = bench.autopilot.body
    assert body.up_m == pytest.approx(50, abs=3)
    assert body.ground_speed_mps == pytest.approx(22, abs=0.5)
    assert abs(body.roll_rad) > 0.2
    assert bench.autopilot.log.counts["takeoff"] == 1


def test_in_guided_a_plane_circles_the_place_it_was_sent_to() -> None:
    bench = flying()
    assert bench.command_int(192, -1, 1, at=(*bench.offset(500, 400), 90)) == 0
    bench.run(90)
    home = bench.autopilot.home.point
    there = Point(home.north_m + 500, home.east_m + 400, 90)
    assert bench.autopilot.position.distance_m(there) == pytest.approx(60, abs=6)
    assert bench.autopilot.body.up_m == pytest.approx(90, abs=2)


def test_rtl_brings_a_plane_home_where_it_circles() -> None:
    bench = flying()
    assert bench.command(20) == 0
    bench.run(120)
    distance_m = bench.autopilot.position.distance_m(bench.autopilot.home.point)
    assert distance_m == pytest.approx(60, abs=6)
    assert bench.autopilot.body.up_m == pytest.approx(100, abs=2)
    assert bench.autopilot.arming.armed


def test_a_plane_in_the_air_is_not_disarmed() -> None:
    assert flying().command(400, 0) == 4


def test_a_reposition_says_how_far_from_the_place_a_plane_circles() -> None:
    bench = flying()
    assert bench.command_int(192, -1, 1, 120, 0, at=(*bench.offset(500, 400), 90)) == 0
    bench.run(120)
    home = bench.autopilot.home.point
    there = Point(home.north_m + 500, home.east_m + 400, 90)
    assert bench.autopilot.position.distance_m(there) == pytest.approx(120, abs=6)


def test_at_the_end_of_its_mission_a_plane_goes_home() -> None:
    bench = flying()
    place = bench.offset(600, 0)
    assert bench.upload([item(0, 16), item(1, 16, place, 60.0)]) == 0
    assert bench.command(176, 1, 10) == 0
    bench.run_until(lambda: bench.autopilot.modes.mode.name == "RTL")
    assert "Mission complete, changing mode to RTL" in bench.texts()
