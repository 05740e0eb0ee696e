"""Reading and setting parameters on links that lose, double, delay and reorder."""

import math
from collections.abc import Sequence

import pytest
from m2pem_plugin_mavlink.microservices.parameters import (
    ParameterEncoding,
    ReadParameter,
    SetParameter,
)
from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type
from m2pem_plugin_mavlink.protocol.transaction import (
    RETRIES,
    ExchangeError,
    NoAnswerError,
    RefusedError,
)
from mavlink_lossy import VEHICLE, Answers, Played, Silent, play_table, run
from mavlink_peers import Parameters
from pymavlink.dialects.v20 import ardupilotmega as dialect

REAL: int = dialect.MAV_PARAM_TYPE_REAL32
INT8: int = dialect.MAV_PARAM_TYPE_INT8
INT32: int = dialect.MAV_PARAM_TYPE_INT32
LONG_NAME = "SIXTEEN_LETTERS_"


def vehicle(*, bytewise: bool = False) -> Parameters:
    values = {"RTL_ALT": (1500.0, REAL), "FS_GCS": (1.0, INT8), LONG_NAME: (7.0, INT32)}
    return Parameters(values, bytewise=bytewise)


def test_a_parameter_is_read_or_it_fails_clearly_whatever_the_link_does() -> None:
    def check(played: Played, _: Parameters) -> None:
        if played.error is None:
            assert (played.result.value, played.result.index, played.result.count) == (1500, 0, 3)
        else:
            assert isinstance(played.error, NoAnswerError)

    play_table(
        lambda: (ReadParameter(VEHICLE, "RTL_ALT"), vehicle()), check, lambda _: RETRIES.bound_s
    )


@pytest.mark.parametrize("bytewise", [False, True])
def test_a_parameter_is_set_once_or_it_fails_clearly_whatever_the_link_does(
    bytewise: bool,
) -> None:
    encoding = ParameterEncoding.BYTEWISE if bytewise else ParameterEncoding.C_CAST

    def check(played: Played, vehicle: Parameters) -> None:
        assert vehicle.writes <= 1
        if played.error is None:
            assert vehicle.values[LONG_NAME][0] == played.result.value == -123456
        else:
            assert isinstance(played.error, NoAnswerError | RefusedError)

    play_table(
        lambda: (SetParameter(VEHICLE, LONG_NAME, -123456, encoding), vehicle(bytewise=bytewise)),
        check,
        lambda _: 2 * RETRIES.bound_s,
    )


def test_a_parameter_that_is_not_there_is_answered_by_silence_or_an_error() -> None:
    played = run(ReadParameter(VEHICLE, "NONE"), vehicle())
    assert isinstance(played.error, NoAnswerError)
    said = "parameter NONE: no answer: perhaps it has no such parameter"
    assert played.error.reason == said
    assert played.ended_s == RETRIES.bound_s

    error = message_type("PARAM_ERROR").make(
        param_id=b"NONE", error=dialect.MAV_PARAM_ERROR_DOES_NOT_EXIST
    )
    played = run(ReadParameter(VEHICLE, "NONE"), Answers([error]))
    assert isinstance(played.error, RefusedError)
    assert played.error.reason == "parameter NONE: it has no such parameter"
    assert played.error.result == dialect.MAV_PARAM_ERROR_DOES_NOT_EXIST


def test_other_parameters_and_other_components_are_not_meant() -> None:
    class Other(Silent):
        def hear(self, message: Message, now_s: float) -> Sequence[Message]:
            return (message_type("PARAM_VALUE").make(param_id=b"RTL_ALT2", param_value=1.0),)

    assert isinstance(run(ReadParameter(VEHICLE, "RTL_ALT"), Other()).error, NoAnswerError)
    gimbal = Address(VEHICLE.system, 154)
    played = run(ReadParameter(VEHICLE, "RTL_ALT"), vehicle(), sender=gimbal)
    assert isinstance(played.error, NoAnswerError)


@pytest.mark.parametrize("name", ["", "SEVENTEEN_LETTERS", "ÄHNLICH", "A\0B"])
def test_a_name_that_none_can_have_is_not_asked_for(name: str) -> None:
    played = run(ReadParameter(VEHICLE, name), vehicle())
    assert type(played.error) is ExchangeError
    assert "is not a parameter name" in played.error.reason
    assert played.sent == []


def test_what_it_has_already_is_not_written() -> None:
    played = run(SetParameter(VEHICLE, "RTL_ALT", 1500.0), vehicle())
    assert played.error is None
    assert [each.TYPE.name for each in played.sent] == ["PARAM_REQUEST_READ"]


def test_a_value_that_it_does_not_take_is_told() -> None:
    stubborn = vehicle()
    stubborn.read_only.add("RTL_ALT")
    played = run(SetParameter(VEHICLE, "RTL_ALT", 20.0), stubborn)
    assert isinstance(played.error, RefusedError)
    assert played.error.reason == "parameter RTL_ALT: it keeps 1500 and does not take 20"

    error = message_type("PARAM_ERROR").make(
        param_id=b"RTL_ALT", error=dialect.MAV_PARAM_ERROR_READ_ONLY
    )
    value = message_type("PARAM_VALUE").make(param_id=b"RTL_ALT", param_type=REAL)
    played = run(SetParameter(VEHICLE, "RTL_ALT", 20.0), Answers([value], [error]))
    assert isinstance(played.error, RefusedError)
    assert played.error.reason == "parameter RTL_ALT: it cannot be set"


def test_an_unanswered_set_leaves_the_value_unknown() -> None:
    value = message_type("PARAM_VALUE").make(param_id=b"RTL_ALT", param_type=REAL)
    played = run(SetParameter(VEHICLE, "RTL_ALT", 20.0), Answers([value]))
    assert isinstance(played.error, NoAnswerError)
    assert "set, but not answered; its value is not known" in played.error.reason


@pytest.mark.parametrize(
    ("name", "value", "says"),
    [
        ("FS_GCS", 300, "300 is outside of int8"),
        ("FS_GCS", 1.5, "1.5 is not a whole number, and the parameter is one (int8)"),
        (LONG_NAME, 16_777_217, "16777217 has more digits than this autopilot can receive"),
        ("RTL_ALT", math.nan, "nan is not a finite number"),
        ("RTL_ALT", 1e39, "1e+39 is too large for a float"),
    ],
)
def test_a_value_that_its_type_does_not_have_is_not_sent(
    name: str, value: float, says: str
) -> None:
    peer = vehicle()
    played = run(SetParameter(VEHICLE, name, value), peer)
    assert type(played.error) is ExchangeError
    assert played.error.reason == f"parameter {name}: {says}"
    assert peer.writes == 0
