"""Reading all parameters on links that lose, double, delay and reorder."""

from collections.abc import Sequence

from m2pem_plugin_mavlink.microservices.parameters import (
    BASE_S,
    GAP_RETRIES,
    LIST_RETRIES,
    MOST,
    PER_PARAMETER_S,
    ReadParameters,
)
from m2pem_plugin_mavlink.protocol.messages import Message, message_type
from m2pem_plugin_mavlink.protocol.transaction import ExchangeError, NoAnswerError
from mavlink_lossy import VEHICLE, Answers, Played, Silent, play_table, run
from mavlink_peers import Parameters
from pymavlink.dialects.v20 import ardupilotmega as dialect

VALUES = {f"P_{n}": (float(n), dialect.MAV_PARAM_TYPE_REAL32) for n in range(50)}
BOUND_S = BASE_S + PER_PARAMETER_S * len(VALUES)


def test_all_parameters_are_read_or_it_fails_clearly_whatever_the_link_does() -> None:
    def check(played: Played, vehicle: Parameters) -> None:
        if played.error is None:
            values = {name: each.value for name, each in played.result.items()}
            assert values == {name: each for name, (each, _) in VALUES.items()}
        else:
            assert isinstance(played.error, NoAnswerError)

    play_table(lambda: (ReadParameters(VEHICLE), Parameters(VALUES)), check, lambda _: BOUND_S)


def test_without_faults_they_are_asked_for_once() -> None:
    played = run(ReadParameters(VEHICLE), Parameters(VALUES))
    assert [each.TYPE.name for each in played.sent] == ["PARAM_REQUEST_LIST"]
    assert list(played.result) == list(VALUES)


def test_gaps_are_asked_for_by_index() -> None:
    lost = {3, 7, 49}
    played = run(
        ReadParameters(VEHICLE),
        Parameters(VALUES),
        lambda direction, number: () if direction and number in lost else (0.0,),
    )
    assert played.error is None
    assert {each.param_index for each in played.sent[1:]} == lost


def test_silence_ends_it() -> None:
    played = run(ReadParameters(VEHICLE), Silent())
    assert isinstance(played.error, NoAnswerError)
    assert played.error.reason == "reading the parameters: no answer after 5 requests"
    assert played.ended_s == LIST_RETRIES.bound_s


def test_a_parameter_that_never_comes_ends_it() -> None:
    class Withholds(Parameters):
        def _value(self, name: str) -> Message:
            return super()._value("P_0" if name == "P_4" else name)

    played = run(ReadParameters(VEHICLE), Withholds(VALUES))
    assert isinstance(played.error, NoAnswerError)
    reason = "reading the parameters: the others were not received (49 of 50 received)"
    assert played.error.reason == reason
    assert len(played.sent) == 1 + GAP_RETRIES.tries


def test_a_count_that_cannot_be_is_not_believed() -> None:
    value = message_type("PARAM_VALUE").make(param_id=b"P", param_count=65535)
    played = run(ReadParameters(VEHICLE), Answers([value]))
    assert type(played.error) is ExchangeError
    assert played.error.reason == "reading the parameters: 65535 parameters are impossible"


def test_a_vehicle_that_gets_more_parameters_is_read_to_the_end() -> None:
    class Grows(Parameters):
        def wake(self, now_s: float) -> Sequence[Message]:
            if len(self._listing) == 40:
                self.values["P_NEW"] = (1.0, dialect.MAV_PARAM_TYPE_REAL32)
            return super().wake(now_s)

    played = run(ReadParameters(VEHICLE), Grows(VALUES))
    assert played.error is None
    assert len(played.result) == 51


def test_a_vehicle_that_lies_about_its_count_is_left_in_time() -> None:
    class Lies(Silent):
        def hear(self, message: Message, now_s: float) -> Sequence[Message]:
            self.next_s = now_s + 1.0
            return ()

        def wake(self, now_s: float) -> Sequence[Message]:
            self.next_s = now_s + 1.0
            count = 2 + int(now_s) % 2
            return (message_type("PARAM_VALUE").make(param_id=b"P", param_count=count),)

    played = run(ReadParameters(VEHICLE), Lies())
    assert played.error is not None
    assert played.ended_s <= BASE_S + PER_PARAMETER_S * MOST
