"""Message intervals and single messages on links that lose, double, delay and reorder."""

from collections.abc import Sequence
from typing import Any

import pytest
from m2pem_plugin_mavlink.microservices.commands import REASON_S
from m2pem_plugin_mavlink.microservices.message_requests import (
    SLOWER_TRIES,
    RequestMessage,
    SetMessageInterval,
)
from m2pem_plugin_mavlink.protocol.messages import Message, message_type
from m2pem_plugin_mavlink.protocol.transaction import RETRIES, NoAnswerError, RefusedError
from mavlink_lossy import VEHICLE, Answers, Played, Silent, play_table, run
from mavlink_peers import Commanded, ack
from pymavlink.dialects.v20 import ardupilotmega as dialect

ATTITUDE: int = message_type("ATTITUDE").id
FASTEST_US = 20_000
BOUND_S = (1 + SLOWER_TRIES) * RETRIES.bound_s + REASON_S


def streams(command: Any, vehicle: Commanded) -> Sequence[Message]:
    """As ArduPilot does: what is faster than its loop is denied."""
    if 0 < command.param2 < FASTEST_US or command.param1 != ATTITUDE:
        return (ack(command.command, dialect.MAV_RESULT_DENIED),)
    vehicle.effects.append(int(command.param2))
    return (ack(command.command),)


@pytest.mark.parametrize(("asked_s", "granted_s"), [(0.25, 0.25), (0.004, 0.032)])
def test_a_rate_is_set_or_it_fails_clearly_whatever_the_link_does(
    asked_s: float, granted_s: float
) -> None:
    def check(played: Played, vehicle: Commanded) -> None:
        if played.error is None:
            assert min(vehicle.effects) >= granted_s * 1e6
            assert played.result >= granted_s
        else:
            assert isinstance(played.error, NoAnswerError | RefusedError)

    play_table(
        lambda: (SetMessageInterval(VEHICLE, ATTITUDE, asked_s), Commanded(streams)),
        check,
        lambda _: BOUND_S,
        recovers=granted_s == asked_s,  # refusals that are doubled use up the slower rates
    )


def test_a_rate_that_is_denied_is_tried_slower() -> None:
    vehicle = Commanded(streams)
    played = run(SetMessageInterval(VEHICLE, ATTITUDE, 0.004), vehicle)
    assert played.result == 0.032
    assert [each.param2 for each in vehicle.received] == [4000, 8000, 16000, 32000]


def test_what_is_denied_at_any_rate_is_refused() -> None:
    vehicle = Commanded(streams)
    played = run(SetMessageInterval(VEHICLE, 33, 0.1), vehicle)
    assert isinstance(played.error, RefusedError)
    assert played.error.reason.startswith("SET_MESSAGE_INTERVAL of GLOBAL_POSITION_INT: denied")
    assert len(vehicle.received) == 1 + SLOWER_TRIES


@pytest.mark.parametrize("interval_s", [0.0, -1.0])
def test_default_and_never_are_said_as_they_are(interval_s: float) -> None:
    vehicle = Commanded(streams)
    assert run(SetMessageInterval(VEHICLE, ATTITUDE, interval_s), vehicle).result == interval_s
    assert vehicle.received[0].param2 == interval_s


def as_it_is(message: Message) -> Message:
    return message


def test_a_message_is_sent_once_or_it_fails_clearly_whatever_the_link_does() -> None:
    attitude = message_type("ATTITUDE").make(roll=0.5)

    def gives(command: Any, vehicle: Commanded) -> Sequence[Message]:
        assert (command.param1, command.param2) == (ATTITUDE, 3)
        return attitude, ack(command.command)

    def check(played: Played, vehicle: Commanded) -> None:
        assert played.result == (attitude if played.error is None else None)

    play_table(
        lambda: (
            RequestMessage(VEHICLE, "ATTITUDE", as_it_is, index=3),
            Commanded(gives),
        ),
        check,
        lambda _: RETRIES.bound_s,
    )


def test_a_message_that_is_not_there_is_told_of() -> None:
    failed = ack(dialect.MAV_CMD_REQUEST_MESSAGE, dialect.MAV_RESULT_FAILED)
    played = run(RequestMessage(VEHICLE, "ATTITUDE", as_it_is), Answers([failed]))
    assert isinstance(played.error, RefusedError)
    assert played.error.reason == "request for ATTITUDE: failed"
    silent = run(RequestMessage(VEHICLE, "ATTITUDE", as_it_is), Silent())
    assert isinstance(silent.error, NoAnswerError)
    assert silent.ended_s == RETRIES.bound_s
