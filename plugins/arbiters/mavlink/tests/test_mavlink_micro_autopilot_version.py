"""What an autopilot is."""

from collections.abc import Sequence
from typing import Any

import pytest
from m2pem_plugin_mavlink.microservices.message_requests import (
    ReadAutopilotVersion,
    version_of,
)
from m2pem_plugin_mavlink.microservices.parameters import ParameterEncoding
from m2pem_plugin_mavlink.protocol.messages import Message, message_type
from m2pem_plugin_mavlink.protocol.transaction import RETRIES
from mavlink_lossy import VEHICLE, Played, play_table
from mavlink_peers import Commanded, ack
from pymavlink.dialects.v20 import ardupilotmega as dialect

VERSION = message_type("AUTOPILOT_VERSION")
CAST = dialect.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST
BYTEWISE = dialect.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE


def test_the_version_is_read_or_it_fails_clearly_whatever_the_link_does() -> None:
    def gives(command: Any, vehicle: Commanded) -> Sequence[Message]:
        return ack(command.command), VERSION.make(flight_sw_version=0x040600FF, uid=9)

    def check(played: Played, _: Commanded) -> None:
        assert played.error is not None or (str(played.result), played.result.uid) == ("4.6.0", 9)

    play_table(
        lambda: (ReadAutopilotVersion(VEHICLE), Commanded(gives)),
        check,
        lambda _: RETRIES.bound_s,
    )


@pytest.mark.parametrize(
    ("number", "words"),
    [
        (0x040700_00, "4.7.0-dev"),
        (0x011003_80, "1.16.3-beta"),
        (0x010200_C0, "1.2.0-rc"),
        (0x010200_07, "1.2.0-7"),
    ],
)
def test_versions_in_words(number: int, words: str) -> None:
    assert str(version_of(VERSION.make(flight_sw_version=number))) == words


def test_capabilities_tell_how_parameters_are_carried() -> None:
    assert version_of(VERSION.make(capabilities=CAST)).parameter_encoding is (
        ParameterEncoding.C_CAST
    )
    both = version_of(VERSION.make(capabilities=BYTEWISE | 1))
    assert both.parameter_encoding is ParameterEncoding.BYTEWISE
    assert both.has(dialect.MAV_PROTOCOL_CAPABILITY_MISSION_FLOAT)
    assert version_of(VERSION.make()).parameter_encoding is None
