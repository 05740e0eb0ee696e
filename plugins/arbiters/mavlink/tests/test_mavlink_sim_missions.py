import pytest
from m2pem_plugin_mavlink.simulator.specification import Kind
from mavlink_bench import Bench, item
from pymavlink.dialects.v20 import ardupilotmega as dialect

HOME = item(0, 16, frame=0)
START, MODE = dialect.MAV_CMD_MISSION_START, dialect.MAV_CMD_DO_SET_MODE
SET_CURRENT = dialect.MAV_CMD_DO_SET_MISSION_CURRENT


def progress(bench: Bench) -> tuple[int, int, int]:
    """Item, state and mode, as MISSION_CURRENT has them."""
    current = bench.report(42)
    return current.seq, current.mission_state, current.mission_mode


def reached(bench: Bench) -> list[int]:
    return [m.seq for m in bench.received if m.get_type() == "MISSION_ITEM_REACHED"]


def reached_at_last(bench: Bench) -> list[int]:
    """The same, with the last one, which comes a moment later."""
    bench.run(0.2)
    return reached(bench)


def fly(bench: Bench, *items: object, limit_s: float = 300) -> Bench:
    """Upload, start in the way of the kind, and fly until the mission is complete."""
    assert bench.upload([HOME, *items]) == 0
    assert bench.command(START) == 0
    bench.run_until(lambda: bench.autopilot.mission.complete, limit_s)
    return bench


def test_a_copter_takes_off_flies_its_mission_and_comes_home() -> None:
    bench = Bench().ready()
    ahead, aside = bench.offset(60, 0), bench.offset(60, 60)
    fly(bench, item(1, 22, z=15.0), item(2, 16, ahead, 15.0), item(3, 16, aside, 25.0), item(4, 20))
    assert reached_at_last(bench) == [1, 2, 3, 4]
    assert not bench.autopilot.arming.armed
    assert bench.autopilot.position.distance_m(bench.autopilot.home.point) < 1
    assert bench.autopilot.log.counts["takeoff"] == 1
    assert bench.autopilot.log.counts["mission"] == 1
    assert progress(bench) == (0, 5, 1)


def test_auto_from_the_ground_needs_a_takeoff() -> None:
    bench = Bench().ready()
    bench.upload([HOME, item(1, 16, bench.offset(60, 0), 15.0)])
    assert bench.command(START) == 4
    assert bench.texts()[-2:] == [
        "Auto: Missing Takeoff Cmd",
        "Mode change to AUTO failed: init failed",
    ]


def test_the_mode_alone_does_not_take_off_but_mission_start_does() -> None:
    bench = Bench().ready()
    bench.upload([HOME, item(1, 22, z=15.0), item(2, 17)])
    assert bench.command(MODE, 1, 3) == 0
    bench.run(5)
    assert bench.autopilot.body.on_ground
    assert bench.command(START) == 0
    bench.run(5)
    assert not bench.autopilot.body.on_ground


def test_progress_is_told_with_the_total_and_the_state() -> None:
    bench = Bench().airborne()
    assert bench.report(42).mission_state == 1
    bench.upload([HOME, item(1, 16, bench.offset(200, 0), 20.0), item(2, 17)])
    assert (bench.report(42).total, bench.report(42).mission_state) == (2, 2)
    bench.command(START)
    bench.run(2)
    assert progress(bench) == (1, 3, 1)
    assert bench.report(42).total == 2
    bench.command(MODE, 1, 5)
    assert progress(bench) == (1, 2, 0)


def marked(bench: Bench) -> list[object]:
    """Home, a speed, a waypoint, a speed, a servo, a waypoint, a speed, a servo."""
    near, far = bench.offset(20, 0), bench.offset(40, 0)
    return [
        HOME,
        item(1, 178, (0, 0), 0, 1, 5.0),
        item(2, 16, near, 20.0),
        item(3, 178, (0, 0), 0, 1, 4.0),
        item(4, 183, (0, 0), 0, 9, 1700),
        item(5, 16, far, 20.0),
        item(6, 178, (0, 0), 0, 1, 3.0),
        item(7, 183, (0, 0), 0, 9, 1800),
    ]


def test_actions_are_reported_but_servos_and_behind_the_last_item_one_is_begun() -> None:
    bench = Bench().airborne()
    bench.upload(marked(bench))
    assert bench.command(START) == 0
    bench.received.clear()
    bench.run_until(lambda: bench.autopilot.mission.complete)
    assert reached_at_last(bench) == [1, 3, 5]
    assert bench.texts() == [
        "Reached command #2",
        "Mission: 3 ChangeSpeed",
        "Mission: 5 WP",
        "Mission: 4 SetServo",
        "Reached command #5",
        "Mission: 6 ChangeSpeed",
    ]
    assert bench.autopilot.payload.servos_us == {9: 1700}


def test_an_action_that_is_set_is_answered_by_the_next_item_of_navigation() -> None:
    bench = Bench().airborne()
    bench.upload(marked(bench))
    bench.received.clear()
    assert bench.command(SET_CURRENT, 1) == 0
    bench.tell(dialect.MAVLink_mission_set_current_message(1, 1, 3))
    assert [m.seq for m in bench.received if m.get_type() == "MISSION_CURRENT"] == [2, 3]
    assert progress(bench) == (5, 2, 0)
    bench.received.clear()
    bench.command(START)
    bench.run_until(lambda: bench.autopilot.mission.complete)
    assert reached_at_last(bench) == [3, 5]
    assert bench.command(SET_CURRENT, 6) == 4


@pytest.mark.parametrize("kind", [Kind.COPTER, Kind.ROVER, Kind.BOAT])
def test_a_completed_mission_is_not_begun_anew_before_the_mode_was_left(kind: Kind) -> None:
    bench = Bench(kind).airborne() if kind is Kind.COPTER else Bench(kind).ready()
    fly(bench, item(1, 16, bench.offset(12, 0), 20.0))
    assert progress(bench) == (1, 5, 1)
    assert bench.upload([HOME, item(1, 16, bench.offset(24, 0), 20.0)]) == 0
    assert bench.command(MODE, 1, bench.auto) == 0
    bench.run(5)
    assert progress(bench) == (1, 5, 1)
    assert bench.command(SET_CURRENT, 1) == 0
    assert bench.command(MODE, 1, bench.auto) == 0
    bench.run(5)
    assert progress(bench) == (1, 2, 1)
    if kind is not Kind.COPTER:
        assert bench.command(START) == 0
        bench.run(5)
        assert progress(bench) == (1, 2, 1)
    assert not bench.autopilot.body.moving
    bench.command(MODE, 1, bench.guided)
    bench.command(MODE, 1, bench.auto)
    assert progress(bench) == (1, 3, 1)
    bench.run_until(lambda: bench.autopilot.mission.complete)
    assert bench.autopilot.body.north_m == pytest.approx(24, abs=3)


def test_a_copters_start_begins_a_completed_mission() -> None:
    bench = Bench().airborne()
    fly(bench, item(1, 16, bench.offset(12, 0), 20.0))
    bench.upload([HOME, item(1, 16, bench.offset(24, 0), 20.0)])
    assert bench.command(START) == 0
    assert progress(bench) == (1, 3, 1)


def test_a_mission_is_begun_in_its_mode_by_what_is_not_armed_too_and_forgotten_when_disarmed() -> (
    None
):
    bench = Bench()
    bench.run(10)
    bench.upload([HOME, item(1, 22, z=15.0), item(2, 20)])
    assert progress(bench) == (0, 2, 0)
    assert bench.command(MODE, 1, bench.auto) == 0
    assert progress(bench) == (1, 3, 1)
    bench.ready()
    assert progress(bench) == (1, 2, 0)
    bench.command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 0)
    assert progress(bench) == (0, 2, 0)


def test_a_rover_enters_auto_with_a_mission_only() -> None:
    bench = Bench(Kind.ROVER)
    bench.run(10)
    assert bench.command(MODE, 1, bench.auto) == 4
    assert bench.texts() == ["No Mission. Can't set AUTO.", "Flight mode change failed"]


def test_left_and_entered_again_it_goes_on_where_it_was() -> None:
    bench = Bench().airborne()
    bench.upload(
        [HOME, *(item(n, 16, bench.offset(30 * n, 0), 20.0) for n in (1, 2, 3)), item(4, 17)]
    )
    bench.command(START)
    bench.run_until(lambda: reached(bench) == [1])
    bench.command(MODE, 1, 5)
    bench.run(5)
    bench.command(MODE, 1, 3)
    bench.run_until(lambda: len(reached(bench)) == 3)
    assert reached_at_last(bench) == [1, 2, 3]
    assert bench.autopilot.log.counts["mission"] == 1


def test_in_a_new_plan_it_goes_on_at_the_same_number_or_if_there_is_none_at_the_beginning() -> None:
    bench = Bench().airborne()
    places = [item(n, 16, bench.offset(20 * n, 0), 20.0) for n in range(1, 5)]
    bench.upload([HOME, *places])
    bench.command(START)
    bench.run_until(lambda: reached(bench) == [1, 2])
    bench.command(MODE, 1, 5)
    bench.upload([HOME, *places])
    bench.command(START)
    bench.run_until(lambda: reached(bench) == [1, 2, 3])
    bench.command(MODE, 1, 5)
    bench.upload([HOME, places[0]])
    bench.command(START)
    bench.run_until(lambda: bench.autopilot.mission.complete)
    assert reached_at_last(bench) == [1, 2, 3, 1]


def test_set_up_so_it_begins_again() -> None:
    bench = Bench(parameters={"MIS_RESTART": 1}).airborne()
    bench.upload([HOME, *(item(n, 16, bench.offset(30 * n, 0), 20.0) for n in (1, 2)), item(3, 17)])
    bench.command(START)
    bench.run_until(lambda: reached(bench) == [1])
    bench.command(MODE, 1, 5)
    bench.command(MODE, 1, 3)
    bench.run_until(lambda: len(reached(bench)) == 3)
    assert reached_at_last(bench) == [1, 1, 2]
    assert bench.autopilot.log.counts["mission"] == 2


def test_the_current_item_can_be_set_before_and_on_the_way() -> None:
    bench = Bench().airborne()
    bench.upload([HOME, *(item(n, 16, bench.offset(20 * n, 0), 20.0) for n in range(1, 6))])
    bench.tell(dialect.MAVLink_mission_set_current_message(1, 1, 2))
    bench.command(START)
    bench.run_until(lambda: reached(bench) == [2])
    assert bench.command(SET_CURRENT, 5) == 0
    bench.run_until(lambda: bench.autopilot.mission.complete)
    assert reached_at_last(bench) == [2, 5]
    assert bench.command(SET_CURRENT, 9) == 2


def test_a_mission_that_is_flown_is_not_cleared() -> None:
    bench = Bench().airborne()
    bench.upload([HOME, item(1, 17)])
    bench.command(START)
    bench.run(1)
    (ack,) = bench.tell(dialect.MAVLink_mission_clear_all_message(1, 1))
    assert ack.type == 1
    assert len(bench.autopilot.plans[0]) == 2


def test_jumps_are_counted() -> None:
    bench = Bench().airborne()
    near, far = bench.offset(10, 0), bench.offset(20, 0)
    fly(bench, item(1, 16, near, 20.0), item(2, 16, far, 20.0), item(3, 177, (0, 0), 0, 1, 2))
    assert reached_at_last(bench) == [1, 2, 1, 2, 1, 2]


def test_jumps_in_a_circle_without_navigation_end() -> None:
    bench = Bench().airborne()
    fly(bench, item(1, 178, (0, 0), 0, 1, 5), item(2, 177, (0, 0), 0, 1, -1))
    assert reached_at_last(bench) == []


def test_actions_are_done_on_the_way() -> None:
    bench = Bench().airborne()
    fly(
        bench,
        item(1, 16, bench.offset(20, 0), 20.0),
        item(2, 178, (0, 0), 0, 1, 2.0),
        item(3, 183, (0, 0), 0, 9, 1700),
        item(4, 16, bench.offset(40, 0), 20.0),
    )
    assert bench.autopilot.payload.servos_us == {9: 1700}
    kinds = [event.kind for event in bench.autopilot.log.events]
    assert kinds.index("servo") > kinds.index("reached")
    assert bench.autopilot.modes.speed_mps == 2.0


@pytest.mark.parametrize(
    ("command", "params", "shortest_s", "longest_s"),
    [(16, (8,), 8, 16), (19, (10,), 10, 18), (93, (12,), 12, 13)],
)
def test_waiting_takes_its_time(
    command: int, params: tuple[float, ...], shortest_s: float, longest_s: float
) -> None:
    bench = Bench().airborne()
    bench.upload([HOME, item(1, command, bench.offset(10, 0), 20.0, *params)])
    bench.command(START)
    took_s = bench.run_until(lambda: bench.autopilot.mission.complete)
    assert shortest_s <= took_s <= longest_s


def test_turns_are_flown_around_the_place() -> None:
    bench = Bench().airborne()
    centre = bench.offset(40, 0)
    bench.upload([HOME, item(1, 18, centre, 20.0, 2, 0, 15)])
    bench.command(START)
    point = bench.autopilot.home.point
    distances = []
    bench.run(15)
    while not bench.autopilot.mission.complete:
        bench.run(0.5)
        body = bench.autopilot.body
        distances.append(((body.north_m - point.north_m - 40) ** 2 + body.east_m**2) ** 0.5)
    assert min(distances) > 14
    assert max(distances) < 16


def test_a_copter_lands_where_the_mission_says_and_is_then_at_its_beginning() -> None:
    bench = Bench().airborne()
    bench.upload([HOME, item(1, 16, bench.offset(20, 10), 20.0), item(2, 21, bench.offset(30, 10))])
    bench.command(START)
    bench.run_until(lambda: not bench.autopilot.arming.armed)
    assert bench.autopilot.body.north_m == pytest.approx(30, abs=0.5)
    # As on real copters: the motors' stop comes before the item is done.
    assert reached_at_last(bench) == [1]
    assert progress(bench) == (1, 3, 1)


def test_a_rover_drives_its_mission_and_comes_home() -> None:
    bench = Bench(Kind.ROVER).ready()
    places = [bench.offset(20, 0), bench.offset(20, 20)]
    speed = item(1, 178, (0, 0), 0, 1, 3.0)
    fly(bench, speed, item(2, 16, places[0]), item(3, 16, places[1]), item(4, 20))
    assert reached_at_last(bench) == [1, 2, 3, 4]
    assert bench.texts()[-9:] == [
        "Mission: 1 ChangeSpeed",
        "speed: 3.0 m/s",
        "Mission: 2 WP",
        "Reached waypoint #2",
        "Mission: 3 WP",
        "Reached waypoint #3",
        "Mission: 4 RTL",
        "Reached destination",
        "Mission Complete",
    ]
    assert bench.autopilot.position.distance_m(bench.autopilot.home.point) < 2.5
    assert bench.autopilot.body.up_m == 0


def test_a_boat_keeps_its_station_at_the_end() -> None:
    bench = Bench(Kind.BOAT).ready()
    fly(bench, item(1, 16, bench.offset(25, 5)))
    bench.run(60)
    body = bench.autopilot.body
    assert (body.north_m, body.east_m) == pytest.approx((25, 5), abs=3)


def test_a_plane_takes_off_flies_and_lands() -> None:
    bench = Bench(Kind.PLANE)
    bench.run(10)
    bench.upload(
        [
            HOME,
            item(1, 22, z=60.0),
            item(2, 16, bench.offset(600, 300), 80.0),
            item(3, 18, bench.offset(0, 600), 80.0, 1),
            item(4, 16, bench.offset(-800, 0), 40.0),
            item(5, 21, bench.offset(0, 0)),
        ]
    )
    assert bench.command(START) == 0
    assert bench.command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 1) == 0
    bench.run_until(lambda: bench.autopilot.mission.complete, 600)
    assert reached_at_last(bench) == [1, 2, 3, 4, 5]
    assert not bench.autopilot.arming.armed
    assert any(text.startswith("Reached waypoint #2 dist ") for text in bench.texts())
    assert bench.autopilot.position.distance_m(bench.autopilot.home.point) < 120
