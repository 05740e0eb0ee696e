"""Clearing missions, choosing the current item and reading one item, on links that lose."""

from collections.abc import Sequence
from typing import Any

import pytest
from m2pem_plugin_mavlink.microservices.mission_items import MissionItem, MissionType, item_message
from m2pem_plugin_mavlink.microservices.missions import (
    CLEAR_RETRIES,
    ClearMission,
    ReadMissionItem,
    SetCurrentItem,
)
from m2pem_plugin_mavlink.protocol.messages import Message, message_type
from m2pem_plugin_mavlink.protocol.transaction import RETRIES, NoAnswerError, RefusedError
from mavlink_lossy import VEHICLE, Answers, Played, Silent, play_table, run
from mavlink_peers import Commanded, Stored, ack, mission_ack
from pymavlink.dialects.v20 import ardupilotmega as dialect

HOME = MissionItem(dialect.MAV_CMD_NAV_WAYPOINT, dialect.MAV_FRAME_GLOBAL, altitude_m=488.0)
CURRENT = message_type("MISSION_CURRENT")


def storing() -> Stored:
    vehicle = Stored()
    for type_ in MissionType:
        vehicle.stored[type_] = [item_message(HOME, 0, VEHICLE, type_)]
    return vehicle


def test_a_mission_is_cleared_or_it_fails_clearly_whatever_the_link_does() -> None:
    def check(played: Played, vehicle: Stored) -> None:
        assert vehicle.clears <= 1
        assert played.error is not None or vehicle.stored[0] == []
        assert played.error is None or isinstance(played.error, NoAnswerError)

    play_table(lambda: (ClearMission(VEHICLE), storing()), check, lambda _: CLEAR_RETRIES.bound_s)


def test_only_what_was_meant_is_cleared() -> None:
    vehicle = storing()
    assert run(ClearMission(VEHICLE, MissionType.FENCE), vehicle).error is None
    assert [len(vehicle.stored[type_]) for type_ in MissionType] == [1, 0, 1]


def test_clearing_may_be_refused() -> None:
    cancelled = mission_ack(dialect.MAV_MISSION_OPERATION_CANCELLED)  # of an upload before
    fence = mission_ack(dialect.MAV_MISSION_ACCEPTED, 1)
    refused = mission_ack(dialect.MAV_MISSION_ERROR)
    played = run(ClearMission(VEHICLE), Answers([cancelled, fence, refused]))
    assert isinstance(played.error, RefusedError)
    assert played.error.reason == "clearing the mission: not accepted, or not now"
    assert played.error.temporary
    assert run(ClearMission(VEHICLE), Silent()).ended_s == CLEAR_RETRIES.bound_s


def goes_to(command: Any, vehicle: Commanded) -> Sequence[Message]:
    assert command.command == dialect.MAV_CMD_DO_SET_MISSION_CURRENT
    vehicle.effects = [command.param1]
    return (ack(command.command),)


def test_the_current_item_is_set_or_it_fails_clearly_whatever_the_link_does() -> None:
    def check(played: Played, vehicle: Commanded) -> None:
        assert played.error is not None or vehicle.effects == [3]
        assert played.error is None or isinstance(played.error, NoAnswerError)

    play_table(
        lambda: (SetCurrentItem(VEHICLE, 3), Commanded(goes_to)),
        check,
        lambda _: RETRIES.bound_s,
    )


class KnowsNoCommand(Silent):
    """An autopilot of before DO_SET_MISSION_CURRENT."""

    def __init__(self) -> None:
        self.current = 0

    def hear(self, message: Message, now_s: float) -> Sequence[Message]:
        if message.TYPE.name == "COMMAND_LONG":
            return (ack(message.command, dialect.MAV_RESULT_UNSUPPORTED),)
        before, self.current = self.current, message.seq
        return CURRENT.make(seq=before), CURRENT.make(seq=self.current)


def test_where_the_command_is_not_known_the_message_sets_it() -> None:
    def check(played: Played, vehicle: KnowsNoCommand) -> None:
        assert played.error is not None or vehicle.current == 3
        assert played.error is None or isinstance(played.error, NoAnswerError)

    play_table(
        lambda: (SetCurrentItem(VEHICLE, 3), KnowsNoCommand()),
        check,
        lambda _: 2 * RETRIES.bound_s,
    )
    played = run(
        SetCurrentItem(VEHICLE, 3),
        Answers(
            [ack(dialect.MAV_CMD_DO_SET_MISSION_CURRENT, dialect.MAV_RESULT_UNSUPPORTED)],
            *[[CURRENT.make(seq=2)]] * 9,
        ),
    )
    assert isinstance(played.error, NoAnswerError)
    assert (
        played.error.reason
        == "current item 3: MISSION_CURRENT does not confirm it after 5 requests"
    )


def test_an_item_that_is_not_there_cannot_be_the_current_one() -> None:
    command = dialect.MAV_CMD_DO_SET_MISSION_CURRENT
    played = run(SetCurrentItem(VEHICLE, 9), Answers([ack(command, dialect.MAV_RESULT_FAILED)]))
    assert isinstance(played.error, RefusedError)
    assert played.error.reason == "current item 9: failed"


def test_one_item_is_read_or_it_fails_clearly_whatever_the_link_does() -> None:
    def check(played: Played, vehicle: Stored) -> None:
        assert played.result == (HOME if played.error is None else None)
        assert played.error is None or isinstance(played.error, NoAnswerError)

    play_table(lambda: (ReadMissionItem(VEHICLE, 0), storing()), check, lambda _: RETRIES.bound_s)


def test_an_item_that_is_not_there_is_told() -> None:
    played = run(ReadMissionItem(VEHICLE, 7), storing())
    assert isinstance(played.error, RefusedError)
    assert played.error.reason == "item 7: out of sequence"


@pytest.mark.parametrize("exchange", [ClearMission(VEHICLE), ReadMissionItem(VEHICLE, 0)])
def test_exchanges_of_missions_wait_for_each_other(exchange: Any) -> None:
    assert exchange.key == ("mission", VEHICLE)
