import math
from struct import pack, unpack_from

from m2pem_plugin_mavlink.simulator.specification import Kind
from mavlink_bench import Bench
from pymavlink.dialects.v20 import ardupilotmega as dialect


def values(bench: Bench) -> list[object]:
    return [m for m in bench.received if m.get_type() == "PARAM_VALUE"]


def test_a_list_has_each_parameter_once() -> None:
    bench = Bench()
    bench.tell(dialect.MAVLink_param_request_list_message(1, 1))
    bench.run(2)
    told = [m for m in bench.received if m.get_type() == "PARAM_VALUE"]
    assert [m.param_index for m in told] == list(range(len(bench.autopilot.parameters)))
    assert {m.param_count for m in told} == {len(told)}


def test_a_parameter_is_read_by_name_or_number() -> None:
    bench = Bench(system=1)
    (by_name,) = bench.tell(dialect.MAVLink_param_request_read_message(1, 1, b"RTL_ALT", -1))
    assert (by_name.param_id, by_name.param_value) == ("RTL_ALT", 1500)
    (by_number,) = bench.tell(
        dialect.MAVLink_param_request_read_message(1, 1, b"", by_name.param_index)
    )
    assert by_number.param_id == "RTL_ALT"


def test_what_is_unknown_gets_no_answer() -> None:
    bench = Bench()
    assert bench.tell(dialect.MAVLink_param_request_read_message(1, 1, b"NOPE", -1)) == []
    assert bench.tell(dialect.MAVLink_param_request_read_message(1, 1, b"", 9999)) == []
    assert bench.tell(dialect.MAVLink_param_set_message(1, 1, b"NOPE", 1, 9)) == []


def test_a_new_value_is_told_to_all() -> None:
    bench = Bench()
    answers = bench.tell(
        dialect.MAVLink_param_set_message(1, 1, b"RTL_ALT", 2500, 9), peer="another"
    )
    assert answers[0].param_value == 2500
    assert bench.autopilot.tuning.return_up_m == 25


def test_a_value_that_is_no_number_is_not_taken() -> None:
    bench = Bench()
    (answer,) = bench.tell(dialect.MAVLink_param_set_message(1, 1, b"RTL_ALT", math.nan, 9))
    assert answer.param_value == 1500


def test_each_kind_has_its_own_failsafe_parameters() -> None:
    assert "FS_THR_ENABLE" in Bench().autopilot.parameters
    assert "FS_ACTION" in Bench(Kind.ROVER).autopilot.parameters
    assert "THR_FAILSAFE" in Bench(Kind.PLANE).autopilot.parameters
    assert Bench(Kind.BOAT).autopilot.parameters["FRAME_CLASS"] == 2
    assert Bench(system=7).autopilot.parameters["MAV_SYSID"] == 7


def test_the_list_as_a_file_is_refused_at_once() -> None:
    bench = Bench()
    request = pack("<HBBBBBxI", 3, 9, 4, 19, 0, 0, 0) + b"@PARAM/param.pck?wi"
    ask = dialect.MAVLink_file_transfer_protocol_message(0, 1, 1, [*request.ljust(251, b"\0")])
    (answer,) = bench.tell(ask)
    assert (answer.target_system, answer.target_component) == (255, 190)
    nak, unknown_command = 129, 7
    assert unpack_from("<HBBBB", bytes(answer.payload)) == (4, 9, nak, 1, 4)
    assert answer.payload[12] == unknown_command
    assert bench.tell(answer) == []
