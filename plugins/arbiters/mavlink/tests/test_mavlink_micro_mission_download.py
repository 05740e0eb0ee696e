"""Downloading missions on links that lose, double, delay and reorder."""

import math
from collections.abc import Sequence
from typing import ClassVar

import pytest
from m2pem_plugin_mavlink.microservices.mission_download import (
    BASE_S,
    COUNT_RETRIES,
    ITEM_RETRIES,
    MOST_ITEMS,
    PER_ITEM_S,
    DownloadMission,
)
from m2pem_plugin_mavlink.microservices.mission_items import (
    MissionItem,
    MissionType,
    item_message,
)
from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type
from m2pem_plugin_mavlink.protocol.transaction import ExchangeError, NoAnswerError, RefusedError
from mavlink_lossy import GROUND, VEHICLE, Answers, Played, Silent, play_table, run
from mavlink_peers import Stored, mission_ack
from pymavlink.dialects.v20 import ardupilotmega as dialect

RELATIVE: int = dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT
ITEMS = tuple(
    MissionItem(dialect.MAV_CMD_NAV_WAYPOINT, RELATIVE, (1.0, 2.0, 0.0, 0.5), 47.0 + n, -8.5, 20.0)
    for n in range(5)
)
BOUND_S = BASE_S + PER_ITEM_S * len(ITEMS)


def storing(items: Sequence[MissionItem] = ITEMS, type_: int = 0, **how: str) -> Stored:
    vehicle = Stored(**how)
    stored_as = MissionType(type_)
    vehicle.stored[type_] = [item_message(e, n, VEHICLE, stored_as) for n, e in enumerate(items)]
    return vehicle


def counted(count: int, system: int = GROUND.system) -> Message:
    return message_type("MISSION_COUNT").make(
        count=count, target_system=system, target_component=GROUND.component
    )


@pytest.mark.parametrize("gives", ["MISSION_ITEM_INT", "MISSION_ITEM"])
def test_what_is_stored_comes_or_it_fails_clearly_whatever_the_link_does(gives: str) -> None:
    def check(played: Played, vehicle: Stored) -> None:
        if played.error is None:
            assert len(played.result) == len(ITEMS)
            assert all(map(MissionItem.same_as, ITEMS, played.result)) or gives == "MISSION_ITEM"
            near = [(round(e.latitude_deg, 5), round(e.longitude_deg, 5)) for e in played.result]
            assert near == [(e.latitude_deg, e.longitude_deg) for e in ITEMS]
        else:
            assert isinstance(played.error, NoAnswerError)

    play_table(lambda: (DownloadMission(VEHICLE), storing(gives=gives)), check, lambda _: BOUND_S)


def test_without_faults_each_item_is_asked_for_once_and_the_vehicle_is_thanked() -> None:
    vehicle = storing()
    played = run(DownloadMission(VEHICLE), vehicle)
    assert played.result == ITEMS
    names = [each.TYPE.name for each in played.sent]
    assert names == ["MISSION_REQUEST_LIST", *["MISSION_REQUEST_INT"] * 5, "MISSION_ACK"]
    assert vehicle.acknowledged == [dialect.MAV_MISSION_ACCEPTED]


def test_a_link_that_doubles_makes_it_ask_no_more_often() -> None:
    played = run(DownloadMission(VEHICLE), storing(), lambda *_: (0.0, 0.0))
    assert played.result == ITEMS
    assert len(played.sent) == 1 + len(ITEMS) + 1


def test_an_empty_mission_has_no_items() -> None:
    assert run(DownloadMission(VEHICLE), storing(())).result == ()


def test_a_fence_is_asked_for_as_one() -> None:
    vehicle = storing(ITEMS[:2], 1)
    assert run(DownloadMission(VEHICLE), vehicle).result == ()
    assert run(DownloadMission(VEHICLE, MissionType.FENCE), vehicle).result == ITEMS[:2]


def test_a_silent_vehicle_ends_it() -> None:
    played = run(DownloadMission(VEHICLE), Silent())
    assert isinstance(played.error, NoAnswerError)
    assert played.error.reason == "download of the mission: no answer after 5 requests"
    assert played.ended_s == COUNT_RETRIES.bound_s


def test_an_item_that_does_not_come_is_named() -> None:
    class Withholds(Stored):
        def hear(self, message: Message, now_s: float) -> Sequence[Message]:
            is_third = message.TYPE.name == "MISSION_REQUEST_INT" and message.seq == 3
            return () if is_third else super().hear(message, now_s)

    vehicle = Withholds()
    vehicle.stored = storing().stored
    played = run(DownloadMission(VEHICLE), vehicle)
    assert isinstance(played.error, NoAnswerError)
    assert "item 3 of 5 was not received after 8 requests" in played.error.reason
    assert vehicle.acknowledged == [dialect.MAV_MISSION_OPERATION_CANCELLED]
    assert played.ended_s == pytest.approx(ITEM_RETRIES.bound_s, abs=0.5)


@pytest.mark.parametrize("count", [65535, MOST_ITEMS + 1])
def test_a_count_that_cannot_be_is_not_believed(count: int) -> None:
    played = run(DownloadMission(VEHICLE), Answers([counted(count)]))
    assert type(played.error) is ExchangeError
    assert played.error.reason == f"download of the mission: {count} items are impossible"
    assert len(played.sent) == 2


def test_counts_and_items_for_others_are_not_ours() -> None:
    played = run(DownloadMission(VEHICLE), Answers([counted(2, system=250)]))
    assert isinstance(played.error, NoAnswerError)
    elsewhere = Address(VEHICLE.system, 2)
    assert run(DownloadMission(VEHICLE), storing(), sender=elsewhere).error is not None


def test_items_that_were_not_asked_for_do_no_harm() -> None:
    class Chatty(Stored):
        def _request(self, message: object, now_s: float) -> Sequence[Message]:
            (item,) = super()._request(message, now_s)
            beyond = item._replace(seq=60000, command=1)  # type: ignore[attr-defined]
            return beyond, item, item, beyond

        HEARS: ClassVar = {**Stored.HEARS, "MISSION_REQUEST_INT": _request}

    vehicle = Chatty()
    vehicle.stored = storing().stored
    assert run(DownloadMission(VEHICLE), vehicle).result == ITEMS


def test_a_mission_that_changes_while_it_is_read_is_read_anew_and_not_for_ever() -> None:
    late = Answers([counted(2)], [counted(5)])
    stored = storing()

    class Late(Stored):
        def hear(self, message: Message, now_s: float) -> Sequence[Message]:
            return late.answers.pop(0) if late.answers else stored.hear(message, now_s)

    assert run(DownloadMission(VEHICLE), Late()).result == ITEMS

    changing = Answers(*[[counted(n)] for n in range(1, 99)])
    played = run(DownloadMission(VEHICLE), changing)
    assert type(played.error) is ExchangeError
    assert "the mission changes during the download: 3 items, then 4" in played.error.reason


def test_a_refusal_says_at_which_item() -> None:
    denied = mission_ack(dialect.MAV_MISSION_DENIED)
    accepted = mission_ack(dialect.MAV_MISSION_ACCEPTED)  # from an earlier upload
    played = run(DownloadMission(VEHICLE), Answers([accepted, counted(5)], [denied]))
    assert isinstance(played.error, RefusedError)
    assert played.error.temporary
    assert played.error.reason.endswith("another ground station may be uploading, at item 0 of 5")


def test_a_cancelled_download_is_begun_anew_and_not_for_ever() -> None:
    cancelled = mission_ack(dialect.MAV_MISSION_OPERATION_CANCELLED)
    played = run(DownloadMission(VEHICLE), Answers(*[[cancelled]] * 99))
    assert isinstance(played.error, RefusedError)
    assert played.error.temporary


def test_places_that_are_none_are_told_as_they_are() -> None:
    item = item_message(ITEMS[0], 0, GROUND, MissionType.MISSION)
    strange = message_type("MISSION_ITEM").make(*item)._replace(x=math.nan, y=math.inf)
    played = run(DownloadMission(VEHICLE), Answers([counted(1)], [strange]))
    assert played.error is None
    assert "nan, inf is not a position" in played.result[0].problem()
