"""Uploading missions on links that lose, double, delay and reorder."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, ClassVar

import pytest
from m2pem_plugin_mavlink.microservices.mission_items import MissionItem, MissionType, item_of
from m2pem_plugin_mavlink.microservices.mission_upload import (
    COUNT_RETRIES,
    PASSES,
    REPEATS,
    SILENCE_S,
    TOO_SOON_S,
    UploadMission,
)
from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type
from m2pem_plugin_mavlink.protocol.transaction import ExchangeError, NoAnswerError, RefusedError
from mavlink_lossy import GROUND, VEHICLE, Answers, Played, Silent, play_table, run
from mavlink_peers import Stored, mission_ack
from pymavlink.dialects.v20 import ardupilotmega as dialect

RELATIVE: int = dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT
WAYPOINT: int = dialect.MAV_CMD_NAV_WAYPOINT
ITEMS = tuple(
    MissionItem(WAYPOINT, RELATIVE, (0.0, 2.0, 0.0, math.nan), 47.3977 + n / 1e4, 8.5456, 20.0 + n)
    for n in range(5)
)
FENCE = tuple(
    replace(each, command=dialect.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION) for each in ITEMS
)


def request(sequence: int, name: str = "MISSION_REQUEST_INT", **more: Any) -> Message:
    system, component = GROUND
    named = {"target_system": system, "target_component": component, **more}
    return message_type(name).make(seq=sequence, **named)


def is_stored(vehicle: Stored, items: Sequence[MissionItem], type_: int = 0) -> bool:
    stored = [item_of(each) for each in vehicle.stored[type_]]
    in_order = [each.seq for each in vehicle.stored[type_]] == list(range(len(items)))
    return in_order and len(stored) == len(items) and all(map(MissionItem.same_as, stored, items))


@pytest.mark.parametrize("asks", ["MISSION_REQUEST", "MISSION_REQUEST_INT"])
@pytest.mark.parametrize("complains", [True, False])
def test_what_was_sent_is_stored_or_it_fails_clearly_whatever_the_link_does(
    asks: str, complains: bool
) -> None:
    def check(played: Played, vehicle: Stored) -> None:
        if played.error is None:
            assert is_stored(vehicle, ITEMS)
        else:
            assert isinstance(played.error, NoAnswerError | RefusedError)
            assert is_stored(vehicle, ITEMS) or is_stored(vehicle, ())

    play_table(
        lambda: (UploadMission(VEHICLE, ITEMS), Stored(asks, complains=complains)),
        check,
        lambda upload: upload.bound_s,
    )


def test_without_faults_each_item_is_sent_once() -> None:
    vehicle = Stored()
    played = run(UploadMission(VEHICLE, ITEMS), vehicle)
    names = [each.TYPE.name for each in played.sent]
    assert names == ["MISSION_COUNT", *["MISSION_ITEM_INT"] * len(ITEMS)]
    assert [each.current for each in vehicle.stored[0]] == [1, 0, 0, 0, 0]
    assert all(math.isnan(each.param4) for each in vehicle.stored[0])
    assert (vehicle.uploads, played.ended_s) == (1, pytest.approx(0.24))


def test_a_silent_vehicle_is_asked_as_the_specification_says() -> None:
    played = run(UploadMission(VEHICLE, ITEMS), Silent())
    assert isinstance(played.error, NoAnswerError)
    assert played.error.reason == "upload of the mission: no answer after 5 attempts"
    assert played.ended_s == COUNT_RETRIES.bound_s


@pytest.mark.parametrize("type_", [MissionType.FENCE, MissionType.RALLY])
def test_fences_and_rally_points_are_stored_apart(type_: MissionType) -> None:
    vehicle = Stored()
    assert run(UploadMission(VEHICLE, FENCE, type_), vehicle).error is None
    assert is_stored(vehicle, FENCE, type_)
    assert vehicle.stored[0] == []
    assert all(each.current == 0 for each in vehicle.stored[type_])


def test_a_lost_acknowledgement_is_not_taken_for_granted() -> None:
    vehicle = Stored()
    last_to_ground = len(ITEMS)
    played = run(
        UploadMission(VEHICLE, ITEMS),
        vehicle,
        lambda direction, number: () if (direction, number) == (1, last_to_ground) else (0.0,),
    )
    assert played.error is None
    assert vehicle.uploads == 2
    assert is_stored(vehicle, ITEMS)


def test_acknowledgements_that_never_come_are_an_error_that_leaves_no_doubt() -> None:
    class Mute(Stored):
        def _take(self) -> Sequence[Message]:
            super()._take()
            return ()

    vehicle = Mute()
    played = run(UploadMission(VEHICLE, ITEMS), vehicle)
    assert isinstance(played.error, NoAnswerError)
    said = "upload of the mission: no answer after item 4; the stored items are not known"
    assert played.error.reason == said
    assert vehicle.uploads == PASSES
    assert vehicle.acknowledged == [dialect.MAV_MISSION_OPERATION_CANCELLED]
    assert played.ended_s < PASSES * (SILENCE_S + 1.0)


def test_an_early_acknowledgement_is_of_something_else() -> None:
    class Hasty(Stored):
        def _ask(self, now_s: float) -> Sequence[Message]:
            return (mission_ack(dialect.MAV_MISSION_ACCEPTED), *super()._ask(now_s))

    vehicle = Hasty()
    assert run(UploadMission(VEHICLE, ITEMS), vehicle).error is None
    assert is_stored(vehicle, ITEMS)

    accepted = mission_ack(dialect.MAV_MISSION_ACCEPTED)
    played = run(UploadMission(VEHICLE, ITEMS), Answers(*[[accepted]] * 99))
    assert isinstance(played.error, NoAnswerError)


@pytest.mark.parametrize(
    ("result", "says"),
    [
        (dialect.MAV_MISSION_INVALID_PARAM2, "item 3 (NAV_WAYPOINT): param2 is not valid"),
        (dialect.MAV_MISSION_UNSUPPORTED, "item 3 (NAV_WAYPOINT): not supported"),
        (dialect.MAV_MISSION_UNSUPPORTED_FRAME, "item 3 (NAV_WAYPOINT): its frame is not"),
        (dialect.MAV_MISSION_NO_SPACE, "there is no space for so many items, at item 3"),
        (99, "refused with result 99, at item 3"),
    ],
)
def test_a_refused_item_is_named(result: int, says: str) -> None:
    vehicle = Stored(refuses={3: result})
    vehicle.stored[0] = before = [*vehicle.stored[0]]
    played = run(UploadMission(VEHICLE, ITEMS), vehicle)
    assert isinstance(played.error, RefusedError)
    assert played.error.reason.startswith(f"mission refused: {says}")
    assert (played.error.result, played.error.temporary) == (result, False)
    assert vehicle.stored[0] == before


@pytest.mark.parametrize("result", [dialect.MAV_MISSION_DENIED, dialect.MAV_MISSION_ERROR])
def test_a_busy_vehicle_may_be_asked_later(result: int) -> None:
    played = run(UploadMission(VEHICLE, ITEMS), Answers([mission_ack(result)]))
    assert isinstance(played.error, RefusedError)
    assert played.error.temporary
    assert played.ended_s < 0.1


def test_a_cancelled_upload_is_begun_anew_and_not_for_ever() -> None:
    cancelled = mission_ack(dialect.MAV_MISSION_OPERATION_CANCELLED)
    played = run(UploadMission(VEHICLE, ITEMS), Answers(*[[cancelled]] * 99))
    assert isinstance(played.error, RefusedError)
    assert played.error.temporary
    assert played.error.reason == "mission refused: cancelled by the vehicle"
    assert len(played.sent) == PASSES

    class Once(Stored):
        cancels = 1

        def _item(self, message: Any, now_s: float) -> Sequence[Message]:
            if message.seq == 2 and self.cancels:
                self.cancels = 0
                return self._stop(dialect.MAV_MISSION_OPERATION_CANCELLED)
            return super()._item(message, now_s)

        HEARS: ClassVar = {**Stored.HEARS, "MISSION_ITEM_INT": _item}

    vehicle = Once()
    assert run(UploadMission(VEHICLE, ITEMS), vehicle).error is None
    assert is_stored(vehicle, ITEMS)


@pytest.mark.parametrize(
    ("answer", "sender"),
    [
        (request(0, target_system=250), VEHICLE),  # of another ground station
        (request(0, mission_type=1), VEHICLE),  # of a fence
        (request(0), Address(VEHICLE.system, 2)),  # of another component
    ],
)
def test_requests_that_are_not_ours_are_not_answered(answer: Message, sender: Address) -> None:
    played = run(UploadMission(VEHICLE, ITEMS), Answers(*[[answer]] * 99), sender=sender)
    assert isinstance(played.error, NoAnswerError)
    assert {each.TYPE.name for each in played.sent} == {"MISSION_COUNT", "MISSION_ACK"}


def test_requests_beyond_the_count_are_not_answered_and_told_of() -> None:
    vehicle = Answers(*[[request(65535), request(5)]] * 99)
    played = run(UploadMission(VEHICLE, ITEMS), vehicle)
    assert isinstance(played.error, NoAnswerError)
    assert "no answer after 5 attempts (the vehicle requested item 5 of 5)" in played.error.reason


def test_items_may_be_asked_for_in_any_order() -> None:
    answers = [[request(n)] for n in (4, 2, 0, 1, 3)]
    vehicle = Answers(*answers, [mission_ack(dialect.MAV_MISSION_ACCEPTED)])
    assert run(UploadMission(VEHICLE, ITEMS), vehicle).error is None
    assert [each.seq for each in vehicle.received[1:]] == [4, 2, 0, 1, 3]


def test_an_item_that_is_asked_for_over_and_over_is_an_end() -> None:
    class Deaf(Silent):
        def hear(self, message: Message, now_s: float) -> Sequence[Message]:
            self.next_s = now_s
            return ()

        def wake(self, now_s: float) -> Sequence[Message]:
            self.next_s = now_s + 0.01
            return (request(1),)

    played = run(UploadMission(VEHICLE, ITEMS), Deaf())
    assert isinstance(played.error, NoAnswerError)
    assert f"the vehicle requested item 1 {REPEATS} times" in played.error.reason
    assert len(played.sent) == REPEATS + 2
    assert played.ended_s > REPEATS * TOO_SOON_S


def test_a_vehicle_that_asks_slowly_and_for_ever_is_left_in_time() -> None:
    class Drips(Silent):
        next_s = 1.0

        def wake(self, now_s: float) -> Sequence[Message]:
            self.next_s = now_s + SILENCE_S - 0.1
            return (request(int(now_s / 60) % 5),)

    upload = UploadMission(VEHICLE, ITEMS)
    played = run(upload, Drips())
    assert isinstance(played.error, NoAnswerError)
    assert played.error.reason == "upload of the mission: not done within 75 s"
    assert played.ended_s == upload.bound_s == 75.0


@pytest.mark.parametrize(
    ("bad", "says"),
    [
        ({"latitude_deg": math.nan}, "item 2: nan, 8.5456 is not a position"),
        ({"longitude_deg": -math.inf}, "item 2: 47.3979, -inf is not a position"),
        ({"latitude_deg": 91.0}, "item 2: 91.0, 8.5456 is not a position"),
        ({"altitude_m": math.nan}, "item 2: altitude nan m"),
        ({"params": (0.0, math.inf, 0.0, 0.0)}, "item 2: a parameter is infinite"),
        ({"frame": dialect.MAV_FRAME_LOCAL_NED}, "item 2: frame 1 is not a global one"),
        ({"command": 70_000}, "item 2: command 70000 does not exist"),
    ],
)
def test_items_that_make_no_sense_are_refused_before_anything_is_sent(
    bad: dict[str, Any], says: str
) -> None:
    items = [*ITEMS[:2], replace(ITEMS[2], **bad), *ITEMS[3:]]
    played = run(UploadMission(VEHICLE, items), Stored())
    assert played.sent == []
    assert type(played.error) is ExchangeError
    assert played.error.reason == f"mission not sent: {says}"


def test_an_empty_mission_can_be_stored() -> None:
    vehicle = Stored()
    run(UploadMission(VEHICLE, ITEMS), vehicle)
    assert run(UploadMission(VEHICLE, ()), vehicle).error is None
    assert is_stored(vehicle, ())


def test_after_a_failure_the_next_upload_succeeds() -> None:
    vehicle = Stored()
    lost = run(UploadMission(VEHICLE, ITEMS), vehicle, lambda way, n: () if n > 3 else (0.0,))
    assert lost.error is not None
    other = [replace(each, altitude_m=99.0) for each in ITEMS[:2]]
    assert run(UploadMission(VEHICLE, other), vehicle).error is None
    assert is_stored(vehicle, other)
