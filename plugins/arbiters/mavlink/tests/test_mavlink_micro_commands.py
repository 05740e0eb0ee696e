"""Commands on links that lose, double, delay and reorder."""

import math
from collections.abc import Sequence
from typing import Any

import pytest
from m2pem_plugin_mavlink.microservices.commands import (
    LONGEST_S,
    PROGRESS_S,
    REASON_S,
    Command,
    CommandPosition,
)
from m2pem_plugin_mavlink.microservices.message_requests import RequestMessage
from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type
from m2pem_plugin_mavlink.protocol.transaction import (
    RETRIES,
    ExchangeError,
    NoAnswerError,
    RefusedError,
)
from mavlink_lossy import GROUND, VEHICLE, Answers, Played, Silent, play_table, run
from mavlink_peers import Commanded, Slow, ack, takes_off, text
from pymavlink.dialects.v20 import ardupilotmega as dialect

TAKEOFF: int = dialect.MAV_CMD_NAV_TAKEOFF
ARM: int = dialect.MAV_CMD_COMPONENT_ARM_DISARM
BOUND_S = RETRIES.bound_s + REASON_S


def test_a_takeoff_is_done_once_or_fails_clearly_whatever_the_link_does() -> None:
    def check(played: Played, vehicle: Commanded) -> None:
        assert len(vehicle.effects) <= 1
        if played.error is None:
            assert vehicle.effects == ["takeoff"]
        else:
            assert isinstance(played.error, NoAnswerError)
            assert "NAV_TAKEOFF: no answer" in played.error.reason

    play_table(
        lambda: (Command(VEHICLE, TAKEOFF, (0, 0, 0, 0, 0, 0, 30)), Commanded(takes_off)),
        check,
        lambda _: BOUND_S,
    )


def test_confirmation_counts_up_and_the_parameters_stay() -> None:
    played = run(Command(VEHICLE, TAKEOFF, (0, 0, 0, math.nan, 0, 0, 30)), Silent())
    assert [each.confirmation for each in played.sent] == [0, 1, 2, 3, 4]
    assert all((each.param7, each.command) == (30.0, TAKEOFF) for each in played.sent)
    assert all(math.isnan(each.param4) for each in played.sent)
    assert played.ended_s == RETRIES.bound_s


def test_a_place_is_sent_in_whole_numbers() -> None:
    place = CommandPosition(47.3977420, -8.5455941, math.nan, dialect.MAV_FRAME_GLOBAL_INT)
    vehicle = Answers([ack(dialect.MAV_CMD_DO_REPOSITION)])
    reposition = Command(VEHICLE, dialect.MAV_CMD_DO_REPOSITION, (-1, 1), place=place)
    assert run(reposition, vehicle).error is None
    (heard,) = vehicle.received
    assert heard.TYPE.name == "COMMAND_INT"
    assert (heard.x, heard.y, heard.frame) == (473977420, -85455941, dialect.MAV_FRAME_GLOBAL_INT)
    assert (heard.param1, heard.param2) == (-1.0, 1.0)
    assert math.isnan(heard.z)


@pytest.mark.parametrize(
    ("place", "params", "says"),
    [
        (CommandPosition(math.nan, 8.0, 1.0), (), "nan, 8.0 is not a position"),
        (CommandPosition(47.0, math.inf, 1.0), (), "47.0, inf is not a position"),
        (CommandPosition(91.0, 8.0, 1.0), (), "91.0, 8.0 is not a position"),
        (CommandPosition(47.0, 8.0, math.inf), (), "the altitude is infinite"),
        (None, (math.inf,), "a parameter is infinite"),
        (None, (0,) * 8, "seven parameters, not 8"),
    ],
)
def test_what_cannot_be_sent_is_not_sent(
    place: CommandPosition | None, params: Sequence[float], says: str
) -> None:
    played = run(Command(VEHICLE, TAKEOFF, params, place=place), Answers([ack(TAKEOFF)]))
    assert not played.sent
    assert played.error is not None
    assert says in played.error.reason


def test_a_refusal_has_the_words_that_follow_it() -> None:
    class Refuses(Silent):
        def hear(self, message: Message, now_s: float) -> Sequence[Message]:
            self.next_s = now_s + 0.2
            return (
                text("EKF3 is using GPS", dialect.MAV_SEVERITY_INFO),
                ack(ARM, dialect.MAV_RESULT_FAILED),
            )

        def wake(self, now_s: float) -> Sequence[Message]:
            self.next_s = None
            long = "PreArm: the compass is not calibrated and the board is too cold"
            return (
                text("Arm: Need Position Estimate"),
                text(long[:50], id=5),
                text(long[50:], id=5, chunk_seq=1),
            )

    played = run(Command(VEHICLE, ARM, (1,)), Refuses())
    assert isinstance(played.error, RefusedError)
    assert played.error.result == dialect.MAV_RESULT_FAILED
    assert not played.error.temporary
    assert played.error.reason == (
        "COMPONENT_ARM_DISARM: failed (Arm: Need Position Estimate; "
        "PreArm: the compass is not calibrated and the board is too cold)"
    )
    assert len(played.sent) == 1


@pytest.mark.parametrize(
    ("result", "words", "temporary"),
    [
        (dialect.MAV_RESULT_TEMPORARILY_REJECTED, "not possible now", True),
        (dialect.MAV_RESULT_DENIED, "denied, in this state or with these values", False),
        (dialect.MAV_RESULT_UNSUPPORTED, "not supported", False),
        (6, "cancelled", False),
        (200, "refused with result 200", False),
    ],
)
def test_each_result_has_its_words(result: int, words: str, temporary: bool) -> None:
    played = run(Command(VEHICLE, ARM, (1,)), Answers([ack(ARM, result)]))
    assert isinstance(played.error, RefusedError)
    assert played.error.reason == f"COMPONENT_ARM_DISARM: {words}"
    assert (played.error.result, played.error.temporary) == (result, temporary)


@pytest.mark.parametrize(
    ("answer", "sender"),
    [
        (ack(TAKEOFF), VEHICLE),  # another command
        (ack(ARM), Address(VEHICLE.system, 154)),  # another component
        (ack(ARM, target_system=250), VEHICLE),  # another ground station
        (ack(ARM, target_component=191), VEHICLE),  # another component of ours
    ],
)
def test_answers_that_are_not_ours_are_ignored(answer: Message, sender: Address) -> None:
    played = run(Command(VEHICLE, ARM, (1,)), Answers(*[[answer]] * 9), sender=sender)
    assert isinstance(played.error, NoAnswerError)


def test_an_answer_to_nobody_in_particular_is_ours() -> None:
    answer = ack(ARM, target_system=0, target_component=0)
    assert run(Command(VEHICLE, ARM, (1,)), Answers([answer])).error is None


def test_nothing_is_sent_while_a_command_is_in_progress() -> None:
    slow = Slow(dialect.MAV_CMD_PREFLIGHT_CALIBRATION)
    played = run(Command(VEHICLE, slow.command), slow)
    assert played.error is None
    assert len(played.sent) == 1
    assert played.ended_s == pytest.approx(20.0, abs=0.1)


def test_a_slow_command_is_begun_once_whatever_the_link_does() -> None:
    def check(played: Played, vehicle: Slow) -> None:
        assert vehicle.effects <= 1
        assert (played.error is None) <= (vehicle.done == 100)

    command = dialect.MAV_CMD_PREFLIGHT_CALIBRATION
    play_table(
        lambda: (Command(VEHICLE, command), Slow(command)),
        check,
        lambda _: LONGEST_S + PROGRESS_S,
        recovers=False,  # from the loss of the last word it does not
    )
    played = run(
        Command(VEHICLE, command),
        Slow(command),
        lambda direction, number: () if (direction, number) == (1, 10) else (0.0,),
    )
    assert isinstance(played.error, NoAnswerError)
    assert (
        played.error.reason == "PREFLIGHT_CALIBRATION: in progress, but no more messages about it"
    )


def test_progress_without_end_ends() -> None:
    class Endless(Slow):
        def wake(self, now_s: float) -> Sequence[Message]:
            self.next_s = now_s + 2.0
            return (ack(self.command, dialect.MAV_RESULT_IN_PROGRESS, progress=255),)

    played = run(Command(VEHICLE, TAKEOFF), Endless(TAKEOFF))
    assert isinstance(played.error, NoAnswerError)
    assert played.ended_s == LONGEST_S


def test_the_other_form_is_tried_once_if_the_vehicle_wants_it() -> None:
    only_int = [ack(TAKEOFF, dialect.MAV_RESULT_COMMAND_INT_ONLY)]
    vehicle = Answers(only_int, [ack(TAKEOFF)])
    assert run(Command(VEHICLE, TAKEOFF, (0, 0, 0, 0, 5, 6, 7)), vehicle).error is None
    assert [each.TYPE.name for each in vehicle.received] == ["COMMAND_LONG", "COMMAND_INT"]
    assert (vehicle.received[1].x, vehicle.received[1].y, vehicle.received[1].z) == (5, 6, 7.0)

    only_long = [ack(TAKEOFF, dialect.MAV_RESULT_COMMAND_LONG_ONLY)]
    vehicle = Answers(only_long, [ack(TAKEOFF)])
    place = CommandPosition(47.0, 8.0, 30.0)
    assert run(Command(VEHICLE, TAKEOFF, place=place), vehicle).error is None
    assert [each.TYPE.name for each in vehicle.received] == ["COMMAND_INT", "COMMAND_LONG"]
    assert (vehicle.received[1].param5, vehicle.received[1].param6) == (47.0, 8.0)

    vehicle = Answers(only_int, only_long)
    assert isinstance(run(Command(VEHICLE, TAKEOFF), vehicle).error, RefusedError)
    assert len(vehicle.received) == 2

    params = (0, 0, 0, 0, math.nan, 0, 0)  # which COMMAND_INT cannot say
    played = run(Command(VEHICLE, TAKEOFF, params), Answers(only_int))
    assert isinstance(played.error, RefusedError)
    assert len(played.sent) == 1


def test_one_command_is_in_flight_for_each_target_and_command() -> None:
    gimbal = Address(VEHICLE.system, 154)
    assert Command(VEHICLE, ARM).key == Command(VEHICLE, ARM, (1,)).key
    assert Command(VEHICLE, ARM).key != Command(VEHICLE, TAKEOFF).key
    assert Command(VEHICLE, ARM).key != Command(gimbal, ARM).key


def test_what_is_over_stays_as_it_is() -> None:
    command = Command(VEHICLE, ARM, (1,))
    command.source = GROUND
    command.begin(0.0)
    command.outbox.clear()
    command.receive(ack(ARM), VEHICLE, 0.1)
    command.receive(ack(ARM, dialect.MAV_RESULT_FAILED), VEHICLE, 0.2)
    command.receive(ack(ARM, dialect.MAV_RESULT_IN_PROGRESS), VEHICLE, 0.3)
    assert command.outcome().result == dialect.MAV_RESULT_ACCEPTED
    assert (command.outbox, command.deadline_s) == ([], None)


def request() -> RequestMessage[Any]:
    return RequestMessage(VEHICLE, "HOME_POSITION", lambda each: each.altitude or None)


def gives_home(command: Any, vehicle: Commanded) -> Sequence[Message]:
    return ack(command.command), message_type("HOME_POSITION").make(altitude=488_000)


def test_a_request_is_answered_or_fails_clearly_whatever_the_link_does() -> None:
    def check(played: Played, vehicle: Commanded) -> None:
        assert played.result == (488_000 if played.error is None else None)

    play_table(lambda: (request(), Commanded(gives_home)), check, lambda _: BOUND_S)


def test_an_answer_that_never_comes_is_told_from_silence() -> None:
    command = dialect.MAV_CMD_REQUEST_MESSAGE
    played = run(request(), Answers(*[[ack(command)]] * 9))
    assert isinstance(played.error, ExchangeError)
    assert played.error.reason == "request for HOME_POSITION: accepted, but no answer was received"
    assert len(played.sent) == RETRIES.tries
