"""Values of parameters as they travel."""

import pytest
from m2pem_plugin_mavlink.microservices.parameters import (
    Parameter,
    ParameterEncoding,
    carried,
    parameter_of,
    same_value,
)
from m2pem_plugin_mavlink.protocol.messages import message_type
from mavlink_lossy import over_the_wire
from pymavlink.dialects.v20 import ardupilotmega as dialect

CAST, BYTEWISE = ParameterEncoding.C_CAST, ParameterEncoding.BYTEWISE


@pytest.mark.parametrize("encoding", [CAST, BYTEWISE])
@pytest.mark.parametrize(
    ("type_", "value"),
    [
        (dialect.MAV_PARAM_TYPE_UINT8, 255),
        (dialect.MAV_PARAM_TYPE_INT8, -128),
        (dialect.MAV_PARAM_TYPE_UINT16, 65535),
        (dialect.MAV_PARAM_TYPE_INT16, -32768),
        (dialect.MAV_PARAM_TYPE_UINT32, 2**31),
        (dialect.MAV_PARAM_TYPE_INT32, -1),
        (dialect.MAV_PARAM_TYPE_INT32, 12_345_678),
        (dialect.MAV_PARAM_TYPE_REAL32, 0.25),
        (dialect.MAV_PARAM_TYPE_REAL32, -1e30),
    ],
)
def test_values_come_back_as_they_were(
    type_: int, value: float, encoding: ParameterEncoding
) -> None:
    message = message_type("PARAM_VALUE").make(
        param_value=carried(value, type_, encoding), param_type=type_, param_id=b"P"
    )
    parameter = parameter_of(over_the_wire(message), encoding)
    assert same_value(parameter, value)
    assert isinstance(parameter.value, type(value))


def test_the_bytes_of_a_whole_number_are_those_of_the_float() -> None:
    assert carried(1, dialect.MAV_PARAM_TYPE_INT32, BYTEWISE) == pytest.approx(1.4e-45)
    assert carried(1, dialect.MAV_PARAM_TYPE_INT32, CAST) == 1.0
    exact = 123_456_789
    assert carried(exact, dialect.MAV_PARAM_TYPE_INT32, BYTEWISE)
    with pytest.raises(ValueError, match="more digits"):
        carried(exact, dialect.MAV_PARAM_TYPE_INT32, CAST)


def test_what_python_would_change_is_not_sent() -> None:
    signalling = -8_000_000  # the bytes of a NaN that is made another one
    with pytest.raises(ValueError, match="cannot be sent"):
        carried(signalling, dialect.MAV_PARAM_TYPE_INT32, BYTEWISE)


def test_a_value_that_was_not_listed_has_no_index() -> None:
    make = message_type("PARAM_VALUE").make
    alone = parameter_of(make(param_id=b"P", param_index=65535, param_count=900), CAST)
    assert (alone.index, alone.count) == (None, 0)
    listed = parameter_of(make(param_id=b"P", param_index=899, param_count=900), CAST)
    assert (listed.index, listed.count) == (899, 900)


def test_floats_are_the_same_but_for_lost_digits() -> None:
    kept = Parameter("P", 0.10000000149011612, dialect.MAV_PARAM_TYPE_REAL32)
    assert same_value(kept, 0.1)
    assert not same_value(kept, 0.1001)
