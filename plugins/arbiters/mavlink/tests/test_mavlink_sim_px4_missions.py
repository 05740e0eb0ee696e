"""Missions of a simulated PX4."""

import pytest
from mavlink_bench import item
from mavlink_px4_bench import ACCEPTED, ARM, DENIED, LATER, START, Px4Bench
from pymavlink.dialects.v20 import ardupilotmega as dialect

AUTO, MISSION = 4, 4


def plan(bench: Px4Bench) -> list:
    return [
        item(0, 22, bench.offset(0, 0), 10),
        item(1, 16, bench.offset(30, 0), 10),
        item(2, 16, bench.offset(30, 30), 10),
    ]


def uploaded(wait_s: float = 3.0) -> Px4Bench:
    bench = Px4Bench()
    bench.run(10)
    assert bench.upload(plan(bench)) == 0
    bench.run(wait_s)
    return bench


def test_a_simulated_px4_asks_for_items_as_int_and_has_no_home_item() -> None:
    bench = Px4Bench()
    bench.run(10)
    bench.received.clear()
    bench.upload(plan(bench))
    requests = [each for each in bench.received if each.get_type().startswith("MISSION_REQUEST")]
    assert {each.get_type() for each in requests} == {"MISSION_REQUEST_INT"}
    assert [each.seq for each in requests] == [0, 1, 2]
    answers = bench.tell(dialect.MAVLink_mission_request_int_message(1, 1, 0))
    assert answers[-1].command == 22


def test_the_start_is_denied_until_the_mission_was_checked() -> None:
    bench = uploaded(wait_s=0.1)
    assert bench.command(START) == DENIED
    assert bench.texts()[-1] == "Mission start denied! No valid mission"
    bench.run(0.2)
    assert bench.command(START) == ACCEPTED


def test_in_the_air_the_mode_is_rejected_until_the_mission_was_checked() -> None:
    bench = Px4Bench().airborne(10)
    bench.upload(plan(bench))
    assert bench.enter(AUTO, MISSION) == LATER
    bench.run(0.3)
    assert bench.enter(AUTO, MISSION) == ACCEPTED


def test_without_a_mission_it_is_neither_started_nor_armed_to_fly_it() -> None:
    bench = Px4Bench()
    bench.run(10)
    assert bench.command(START) == DENIED
    assert bench.enter(AUTO, MISSION) == ACCEPTED
    assert bench.command(ARM, 1) == LATER
    assert "Preflight Fail: No valid mission available" in bench.texts()


def test_a_simulated_px4_arms_flies_to_the_end_and_holds_there() -> None:
    bench = uploaded()
    assert bench.command(START) == ACCEPTED
    assert bench.autopilot.arming.armed
    bench.run_until(lambda: bench.mode == "AUTO.LOITER")
    bench.run(5)
    reached = [each.seq for each in bench.received if each.get_type() == "MISSION_ITEM_REACHED"]
    assert reached == [0, 1, 2]
    assert bench.autopilot.position == pytest.approx((30, 30, 10), abs=2)
    current = bench.report(42)
    assert (current.total, current.mission_state) == (3, dialect.MISSION_STATE_COMPLETE)
    assert bench.autopilot.log.counts["mission"] == 1


def test_armed_in_the_mode_it_begins() -> None:
    bench = uploaded()
    assert bench.enter(AUTO, MISSION) == ACCEPTED
    assert bench.command(ARM, 1) == ACCEPTED
    bench.run_until(lambda: bench.autopilot.mission.current == 2)


def test_a_simulated_px4_begins_at_the_item_that_was_set() -> None:
    bench = Px4Bench().airborne(10)
    bench.upload(plan(bench))
    bench.run(3)
    bench.tell(dialect.MAVLink_mission_set_current_message(1, 1, 2))
    assert bench.enter(AUTO, MISSION) == ACCEPTED
    bench.received.clear()
    bench.run_until(lambda: bench.mode == "AUTO.LOITER")
    bench.run(1)
    reached = [each.seq for each in bench.received if each.get_type() == "MISSION_ITEM_REACHED"]
    assert reached == [2]


def test_a_plan_is_replaced_when_its_last_item_has_come() -> None:
    bench = uploaded()
    before = bench.autopilot.plans[0]
    bench.tell(dialect.MAVLink_mission_count_message(1, 1, 2, 0))
    bench.tell(item(0, 16, bench.offset(50, 0), 10))
    assert bench.autopilot.plans[0] == before
    bench.tell(item(1, 16, bench.offset(60, 0), 10))
    assert len(bench.autopilot.plans[0]) == 2


def test_the_last_item_once_more_is_acknowledged_once_more() -> None:
    bench = uploaded()
    for seq, result in ((2, dialect.MAV_MISSION_ACCEPTED), (1, dialect.MAV_MISSION_ERROR)):
        (ack,) = bench.tell(plan(bench)[seq])
        assert ack.type == result
