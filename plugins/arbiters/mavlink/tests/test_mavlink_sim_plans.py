import math

import pytest
from mavlink_bench import Bench, item
from pymavlink.dialects.v20 import ardupilotmega as dialect

HOME = item(0, 16, frame=0)
HERE = (47.398, 8.546)
PLAN = [HOME, item(1, 22, z=20.0), item(2, 16, HERE, 20.0), item(3, 20)]


def count(number: int, kind: int = 0) -> object:
    return dialect.MAVLink_mission_count_message(1, 1, number, kind)


def types(answers: list[object]) -> list[str]:
    return [a.get_type() for a in answers]  # type: ignore[attr-defined]


def test_an_upload_is_asked_for_item_by_item() -> None:
    bench = Bench()
    (request,) = bench.tell(count(4))
    assert (request.get_type(), request.seq) == ("MISSION_REQUEST", 0)
    for each in PLAN[:3]:
        (request,) = bench.tell(each)
        assert request.get_type() == "MISSION_REQUEST"
    answers = bench.tell(PLAN[3])
    assert answers[0].get_type() == "MISSION_ACK"
    assert answers[0].type == 0
    assert "Flight plan received" in bench.texts()
    assert bench.autopilot.parameters["MIS_TOTAL"] == 4


def test_a_download_gives_back_what_was_uploaded_behind_the_own_home() -> None:
    bench = Bench()
    bench.run(10)
    assert bench.upload(PLAN) == 0
    (answer,) = bench.tell(dialect.MAVLink_mission_request_list_message(1, 1))
    assert answer.count == 4
    (home,) = bench.tell(dialect.MAVLink_mission_request_int_message(1, 1, 0))
    assert (home.x, home.y, home.frame) == (473977420, 85455940, 0)
    (second,) = bench.tell(dialect.MAVLink_mission_request_int_message(1, 1, 2))
    assert second.get_type() == "MISSION_ITEM_INT"
    assert (second.x, second.y, second.z, second.command) == (473980000, 85460000, 20.0, 16)


def test_a_lost_item_is_asked_for_each_second_and_the_upload_cancelled_after_eight() -> None:
    bench = Bench()
    bench.tell(count(4))
    bench.received.clear()
    bench.run(8.5)
    requests = [m for m in bench.received if m.get_type() == "MISSION_REQUEST"]
    assert len(requests) in (7, 8)
    assert {m.seq for m in requests} == {0}
    assert "Mission upload timeout" in bench.texts()
    assert bench.received[-1].get_type() in ("MISSION_ACK", "HEARTBEAT")
    assert [m.type for m in bench.received if m.get_type() == "MISSION_ACK"] == [15]


def test_a_second_uploader_is_denied_and_the_first_goes_on() -> None:
    bench = Bench()
    bench.tell(count(2))
    (denied,) = bench.tell(count(5), system=254, peer="other")
    assert (denied.type, denied.target_system) == (14, 254)
    assert types(bench.tell(PLAN[0])) == ["MISSION_REQUEST"]
    assert types(bench.tell(PLAN[1]))[0] == "MISSION_ACK"


def test_the_same_uploader_may_begin_anew() -> None:
    bench = Bench()
    bench.tell(count(4))
    bench.tell(PLAN[0])
    (request,) = bench.tell(count(3))
    assert (request.get_type(), request.seq) == ("MISSION_REQUEST", 0)


def test_items_out_of_turn_are_refused_and_the_upload_goes_on() -> None:
    bench = Bench()
    bench.tell(count(4))
    (ack,) = bench.tell(PLAN[2])
    assert ack.type == 13
    assert types(bench.tell(PLAN[0])) == ["MISSION_REQUEST"]


def test_an_item_without_an_upload_is_an_error() -> None:
    (ack,) = Bench().tell(PLAN[0])
    assert ack.type == 1


@pytest.mark.parametrize(
    ("bad", "result"),
    [
        (item(1, 30_000), 3),
        (item(1, 16, HERE, 20.0, frame=200), 2),
        (item(1, 16, (95.0, 0.0), 20.0), 10),
        (item(1, 16, (0.0, 190.0), 20.0), 11),
        (item(1, 16, HERE, math.nan), 12),
        (item(1, 16, HERE, 20.0, math.inf), 6),
        (item(1, 16, HERE, 20.0, 0.0, math.nan), 7),
    ],
)
def test_an_unsound_item_ends_the_upload_with_its_fault(bad: object, result: int) -> None:
    bench = Bench()
    bench.tell(count(3))
    bench.tell(HOME)
    (ack,) = bench.tell(bad)
    assert ack.type == result
    assert bench.autopilot.missions.upload is None


def test_too_many_items_find_no_space() -> None:
    (ack,) = Bench().tell(count(65535))
    assert ack.type == 4


def test_an_abandoned_upload_leaves_the_items_that_came() -> None:
    bench = Bench()
    bench.upload(PLAN)
    bench.tell(count(2))
    bench.tell(HOME)
    bench.run(9)
    (answer,) = bench.tell(dialect.MAVLink_mission_request_list_message(1, 1))
    assert answer.count == 2


def test_plans_are_cleared_one_or_all() -> None:
    bench = Bench()
    bench.upload(PLAN)
    fence = [
        item(n, 5001, (47.39 + n % 2 / 100, 8.54 + n // 2 / 100), 0, 4, kind=1) for n in range(4)
    ]
    rally = [item(0, 5100, HERE, 30.0, frame=3, kind=2)]
    assert bench.upload(fence) == bench.upload(rally) == 0
    assert [len(bench.autopilot.plans[kind]) for kind in range(3)] == [4, 4, 1]
    assert bench.autopilot.parameters["FENCE_TOTAL"] == 4
    (ack,) = bench.tell(dialect.MAVLink_mission_clear_all_message(1, 1, 1))
    assert (ack.type, ack.mission_type) == (0, 1)
    assert [len(bench.autopilot.plans[kind]) for kind in range(3)] == [4, 0, 1]
    bench.tell(dialect.MAVLink_mission_clear_all_message(1, 1, 255))
    assert [len(bench.autopilot.plans[kind]) for kind in range(3)] == [0, 0, 0]


def test_a_plan_of_an_unknown_kind_is_unsupported() -> None:
    bench = Bench()
    for message in (count(2, 7), dialect.MAVLink_mission_request_list_message(1, 1, 7)):
        (ack,) = bench.tell(message)
        assert ack.type == 3


def test_a_request_beyond_the_end_is_out_of_sequence() -> None:
    (ack,) = Bench().tell(dialect.MAVLink_mission_request_int_message(1, 1, 3))
    assert ack.type == 13


def test_the_uploader_may_give_up() -> None:
    bench = Bench()
    bench.tell(count(4))
    bench.tell(dialect.MAVLink_mission_ack_message(1, 1, 15))
    bench.received.clear()
    bench.run(9)
    assert "MISSION_REQUEST" not in types(bench.received)
