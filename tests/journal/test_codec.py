import dataclasses
import enum
import json
from types import NoneType, UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from m2pem.engine.inputs import Input, StartRun, Tick
from m2pem.engine.records import (
    DataWritten,
    InputIgnored,
    Record,
    RunEnded,
    RunOutcome,
    RunStarted,
    TokenEntered,
)
from m2pem.errors import InternalError, JournalError
from m2pem.journal.base import Entry
from m2pem.journal.codec import decode_body, encode_body, record_line, run_id, run_number

INT_64 = st.integers(-(2**63), 2**64 - 1)
FLOATS = st.floats(allow_nan=False, allow_infinity=False)
VALUES = st.recursive(
    st.none() | st.booleans() | INT_64 | FLOATS | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=5,
)
OF_TYPE = {
    Any: VALUES,
    str: st.text(),
    int: INT_64,
    float: FLOATS,
    bool: st.booleans(),
    bytes: st.binary(),
    NoneType: st.none(),
}


def of_type(kind):
    """Anything that a field of this type may hold."""
    if kind in OF_TYPE:
        return OF_TYPE[kind]
    origin, arguments = get_origin(kind), get_args(kind)
    if origin in (Union, UnionType):
        return st.one_of(*map(of_type, arguments))
    if origin is dict:
        return st.dictionaries(of_type(arguments[0]), of_type(arguments[1]), max_size=3)
    if origin is tuple and arguments[-1] is not ...:
        return st.tuples(*map(of_type, arguments))
    if origin is tuple:
        return st.lists(of_type(arguments[0]), max_size=3).map(tuple)
    if issubclass(kind, enum.Enum):
        return st.sampled_from(kind)
    if dataclasses.is_dataclass(kind):
        types = get_type_hints(kind)
    else:
        assert issubclass(kind, msgspec.Struct), kind
        types = {field.name: field.type for field in msgspec.structs.fields(kind)}
    return st.builds(kind, **{name: of_type(each) for name, each in types.items()})


def an_entry(given, *records):
    return Entry("r1", 1, 1, 0, 0, given, records)


def assert_comes_back(given, *records):
    back = decode_body(encode_body(an_entry(given, *records)))
    # Beyond equality: 1, 1.0 and True are equal, and so are 0.0 and -0.0.
    assert back == (given, records)
    assert repr(back) == repr((given, records))


@pytest.mark.parametrize("kind", get_args(Input), ids=lambda kind: kind.__name__)
def test_every_input_comes_back_equal(kind):
    @given(of_type(kind))
    def check(item):
        assert_comes_back(item)

    check()


@pytest.mark.parametrize("kind", get_args(Record), ids=lambda kind: kind.__name__)
def test_every_record_comes_back_equal(kind):
    @given(of_type(kind))
    def check(record):
        assert_comes_back(Tick(), record)

    check()


@pytest.mark.long
@given(of_type(Input), st.lists(of_type(Record), max_size=20))
def test_whole_entries_come_back_equal(given, records):
    assert_comes_back(given, *records)


@pytest.mark.parametrize("value", [0.1, 5e-324, 1.7976931348623157e308, -0.0, 2**53 + 1, 2**64])
def test_numbers_are_exact(value):
    assert_comes_back(StartRun("P", {"k": [value]}))


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -float("inf"), "\ud800", {1}])
def test_a_value_that_json_cannot_say_is_refused_rather_than_changed(value):
    with pytest.raises(InternalError, match="r1, record 1: cannot be written"):
        encode_body(an_entry(Tick(), DataWritten(1, "P", "E", 1, "k", [None, value], 1)))


@pytest.mark.parametrize(
    "body",
    [
        b"",
        b"[]",
        b'[{"input":"Tick"},[]',
        b'[{"input":"Nod"},[]]',
        b'[{"input":"Tick"},[{"record":"NotYetKnown"}]]',
        b'[{"input":"Tick"},[{"record":"InputIgnored"}]]',
        b'[{"input":"Tick"},[{"record":"InputIgnored","reason":7}]]',
        b'[{"input":"Tick"},[{"record":"InputIgnored","reason":"\xff"}]]',
    ],
)
def test_a_body_that_is_not_one_is_refused(body):
    with pytest.raises(JournalError, match="damaged, or written by a newer m2pem"):
        decode_body(body)


def test_a_record_with_a_field_of_a_newer_release_is_read():
    body = b'[{"input":"Tick"},[{"record":"InputIgnored","reason":"late","weight":7}]]'
    assert decode_body(body) == (Tick(), (InputIgnored("late"),))


def test_a_record_line_is_as_published():
    line = record_line("r1", 7, 12_500_000, TokenEntered(3, "DETECTION", "DriveRoute", 2))
    assert line == (
        b'{"run":"r1","seq":7,"t":12.5,"record":"TokenEntered",'
        b'"token":3,"process":"DETECTION","element":"DriveRoute","scope":2}'
    )


def test_a_record_line_has_its_own_names_first():
    line = record_line("r1", 1, 0, RunEnded(RunOutcome.FAILED, "Jöin"))
    assert list(json.loads(line)) == ["run", "seq", "t", "record", "outcome", "detail"]
    assert line.endswith('"outcome":"failed","detail":"Jöin"}'.encode())


@pytest.mark.parametrize(
    ("t_us", "text"),
    [
        (0, b"0.0"),
        (1, b"1e-6"),
        (12_500_000, b"12.5"),
        (100_000, b"0.1"),
        (300_000, b"0.3"),
        (86_400_000_001, b"86400.000001"),
        (3_155_760_000_123_457, b"3155760000.123457"),
    ],
)
def test_mission_time_prints_without_dust(t_us, text):
    line = record_line("r1", 1, t_us, RunStarted("P", 0))
    assert b'"t":' + text + b"," in line
    assert round(json.loads(line)["t"] * 1_000_000) == t_us


def test_run_names_count_from_one():
    assert [run_id(1), run_id(12)] == ["r1", "r12"]
    assert [run_number("r1"), run_number("r12")] == [1, 12]


@pytest.mark.parametrize(
    "run", ["", "r", "1", "r0", "r01", "r-1", "r1\n", "r\u0661", "r" + "1" * 19]
)
def test_what_is_no_name_of_a_run_is_refused(run):
    with pytest.raises(JournalError, match="the journal has no run"):
        run_number(run)
