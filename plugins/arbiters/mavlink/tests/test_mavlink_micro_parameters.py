"""Reading parameters on links that lose, double, delay and reorder."""

import struct
from collections.abc import Sequence

import pytest
from m2pem_plugin_mavlink.microservices.parameters import ParameterEncoding, ReadParameter
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
CAST, BYTEWISE = ParameterEncoding.C_CAST, ParameterEncoding.BYTEWISE


def vehicle() -> Parameters:
    return Parameters({"RTL_ALT": (1500.0, REAL), "FS_GCS": (1.0, INT8)})


def test_a_parameter_is_read_or_it_fails_clearly_whatever_the_link_does() -> None:
    def check(played: Played, _: Parameters) -> None:
        if played.error is None:
            assert played.result == 1500.0
        else:
            assert isinstance(played.error, NoAnswerError)

    play_table(
        lambda: (ReadParameter(VEHICLE, "RTL_ALT", CAST), vehicle()),
        check,
        lambda _: RETRIES.bound_s,
    )


def test_a_parameter_that_is_not_there_is_answered_by_silence_or_an_error() -> None:
    played = run(ReadParameter(VEHICLE, "NONE", CAST), vehicle())
    assert isinstance(played.error, NoAnswerError)
    said = "parameter NONE: no answer: perhaps it has no such parameter"
    assert played.error.reason == said
    assert played.ended_s == RETRIES.bound_s

    error = message_type("PARAM_ERROR").make(
        param_id=b"NONE", error=dialect.MAV_PARAM_ERROR_DOES_NOT_EXIST
    )
    played = run(ReadParameter(VEHICLE, "NONE", CAST), Answers([error]))
    assert isinstance(played.error, RefusedError)
    assert played.error.reason == "parameter NONE: it has no such parameter"
    assert played.error.result == dialect.MAV_PARAM_ERROR_DOES_NOT_EXIST


def test_other_parameters_and_other_components_are_not_meant() -> None:
    class Other(Silent):
        def hear(self, message: Message, now_s: float) -> Sequence[Message]:
            return (message_type("PARAM_VALUE").make(param_id=b"RTL_ALT2", param_value=1.0),)

    assert isinstance(run(ReadParameter(VEHICLE, "RTL_ALT", CAST), Other()).error, NoAnswerError)
    gimbal = Address(VEHICLE.system, 154)
    played = run(ReadParameter(VEHICLE, "RTL_ALT", CAST), vehicle(), sender=gimbal)
    assert isinstance(played.error, NoAnswerError)


@pytest.mark.parametrize("name", ["", "SEVENTEEN_LETTERS", "ÄHNLICH", "A\0B"])
def test_a_name_that_none_can_have_is_not_asked_for(name: str) -> None:
    played = run(ReadParameter(VEHICLE, name, CAST), vehicle())
    assert type(played.error) is ExchangeError
    assert "is not a parameter name" in played.error.reason
    assert played.sent == []


@pytest.mark.parametrize("encoding", [CAST, BYTEWISE])
@pytest.mark.parametrize(
    ("type_", "layout", "value"),
    [
        (dialect.MAV_PARAM_TYPE_UINT8, "<B3x", 255),
        (dialect.MAV_PARAM_TYPE_INT8, "<b3x", -128),
        (dialect.MAV_PARAM_TYPE_UINT16, "<H2x", 65535),
        (dialect.MAV_PARAM_TYPE_INT16, "<h2x", -32768),
        (dialect.MAV_PARAM_TYPE_UINT32, "<I", 2**31),
        (dialect.MAV_PARAM_TYPE_INT32, "<i", -1),
        (dialect.MAV_PARAM_TYPE_INT32, "<i", 12_345_678),
        (dialect.MAV_PARAM_TYPE_REAL32, "<f", 0.25),
        (dialect.MAV_PARAM_TYPE_REAL32, "<f", -(2.0**90)),
    ],
)
def test_a_value_is_read_as_its_type_and_encoding_say(
    type_: int, layout: str, value: float, encoding: ParameterEncoding
) -> None:
    carried = float(value)
    if encoding is BYTEWISE:
        (carried,) = struct.unpack("<f", struct.pack(layout, value))
    message = message_type("PARAM_VALUE").make(
        param_value=carried, param_type=type_, param_id=b"RTL_ALT"
    )
    read = run(ReadParameter(VEHICLE, "RTL_ALT", encoding), Answers([message])).result
    assert (read, type(read)) == (value, type(value))
