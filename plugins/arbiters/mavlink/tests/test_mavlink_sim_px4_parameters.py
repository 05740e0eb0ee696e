"""Parameters of a simulated PX4: whole numbers travel as their bytes."""

import math
import struct

import pytest
from mavlink_px4_bench import Px4Bench
from pymavlink.dialects.v20 import ardupilotmega as dialect

INT32, REAL32 = 6, 9


def read(bench: Px4Bench, name: str):
    (value,) = bench.tell(dialect.MAVLink_param_request_read_message(1, 1, name.encode(), -1))
    return value


def whole(value: float) -> int:
    return struct.unpack("<i", struct.pack("<f", value))[0]


def test_whole_numbers_are_bytes_and_others_are_numbers() -> None:
    bench = Px4Bench()
    action = read(bench, "GF_ACTION")
    assert (action.param_type, whole(action.param_value)) == (INT32, 2)
    height = read(bench, "RTL_RETURN_ALT")
    assert (height.param_type, height.param_value) == (REAL32, 60.0)
    assert whole(read(bench, "MAV_SYS_ID").param_value) == 1


@pytest.mark.parametrize("number", [0, 3, -1, 2**31 - 1])
def test_a_whole_number_is_set_by_its_bytes(number: int) -> None:
    bench = Px4Bench()
    value = struct.unpack("<f", struct.pack("<i", number))[0]
    message = dialect.MAVLink_param_set_message(1, 1, b"NAV_DLL_ACT", value, INT32)
    (answer,) = bench.tell(message)
    assert whole(answer.param_value) == number
    assert bench.autopilot.parameters["NAV_DLL_ACT"] == number


def test_a_number_that_is_none_is_not_set() -> None:
    bench = Px4Bench()
    bench.tell(dialect.MAVLink_param_set_message(1, 1, b"RTL_RETURN_ALT", math.nan, REAL32))
    assert bench.autopilot.parameters["RTL_RETURN_ALT"] == 60.0


def test_parameters_of_failsafes_are_there() -> None:
    bench = Px4Bench()
    for name in ("NAV_DLL_ACT", "COM_LOW_BAT_ACT", "COM_DL_LOSS_T", "MIS_TAKEOFF_ALT"):
        assert read(bench, name).param_id == name


def test_its_capabilities_say_how_numbers_travel() -> None:
    capabilities = Px4Bench().report(148).capabilities
    assert capabilities & dialect.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE
    assert not capabilities & dialect.MAV_PROTOCOL_CAPABILITY_PARAM_FLOAT
