"""Messages as MAVSDK hands them over."""

import math

import pytest
from m2pem_plugin_mavlink.mavsdk_driver import json_fields
from m2pem_plugin_mavlink.protocol.messages import message_type

HEARTBEAT = message_type("HEARTBEAT")
TEXT = message_type("STATUSTEXT")
HOME = message_type("HOME_POSITION")


def test_fields_are_read_by_their_names_whatever_their_order():
    read = json_fields.read(
        HEARTBEAT, '{"type": 2, "message_id": 0, "custom_mode": 4, "autopilot": 3}'
    )
    assert (read.type, read.autopilot, read.custom_mode) == (2, 3, 4)
    assert read.base_mode == 0
    assert read.TYPE is HEARTBEAT


def test_null_is_not_a_number_alone_and_in_an_array():
    read = json_fields.read(HOME, '{"x": null, "q": [1.0, null, 0.0, 0.0]}')
    assert math.isnan(read.x)
    assert read.q[0] == 1.0
    assert math.isnan(read.q[1])


def test_texts_are_bytes():
    assert json_fields.read(TEXT, '{"text": "h\\u00f6he"}').text == "höhe".encode()


@pytest.mark.parametrize("junk", ["", "[]", "7", '{"text"', "nonsense"])
def test_what_is_no_message_is_an_error(junk):
    with pytest.raises(ValueError):
        json_fields.read(TEXT, junk)


def test_what_is_written_is_read_as_it_was():
    home = HOME.make(
        latitude=473977420, longitude=-85455940, altitude=-488000, q=(1.0, 0.5, 0.25, 0.0), x=-4.5
    )
    assert json_fields.read(HOME, json_fields.written(home)) == home
    text = TEXT.make(severity=6, text="höhe".encode(), id=7)
    assert json_fields.read(TEXT, json_fields.written(text)) == text


@pytest.mark.parametrize("number", [math.nan, math.inf, -math.inf])
def test_what_is_no_number_is_written_as_null(number):
    command = message_type("COMMAND_LONG").make(command=400, param1=number)
    assert '"param1": null' in json_fields.written(command)
