"""Home and origin, on links that lose, double, delay and reorder."""

import math
from collections.abc import Sequence
from typing import Any

import pytest
from m2pem_plugin_mavlink.microservices.home import (
    GroundPlace,
    ReadHome,
    ReadOrigin,
    SetOrigin,
    set_home,
)
from m2pem_plugin_mavlink.protocol.messages import Message, message_type
from m2pem_plugin_mavlink.protocol.transaction import RETRIES, ExchangeError, NoAnswerError
from mavlink_lossy import VEHICLE, Played, Silent, play_table, run
from mavlink_peers import Commanded, ack
from pymavlink.dialects.v20 import ardupilotmega as dialect

PLACE = GroundPlace(47.397742, -8.545594, 488.25)
AT = {"latitude": 473977420, "longitude": -85455940, "altitude": 488_250}


@pytest.mark.parametrize(
    ("read", "name"), [(ReadHome, "HOME_POSITION"), (ReadOrigin, "GPS_GLOBAL_ORIGIN")]
)
def test_home_and_origin_are_read_or_it_fails_clearly_whatever_the_link_does(
    read: Any, name: str
) -> None:
    def gives(command: Any, vehicle: Commanded) -> Sequence[Message]:
        assert command.param1 == message_type(name).id
        return ack(command.command), message_type(name).make(**AT)

    def check(played: Played, _: Commanded) -> None:
        assert played.result == (PLACE if played.error is None else None)

    play_table(lambda: (read(VEHICLE), Commanded(gives)), check, lambda _: RETRIES.bound_s)


def test_home_is_set_to_a_place_or_to_where_the_vehicle_is() -> None:
    vehicle = Commanded(lambda command, _: (ack(command.command),))
    assert run(set_home(VEHICLE, PLACE), vehicle).error is None
    assert run(set_home(VEHICLE, None), vehicle).error is None
    there, here = vehicle.received
    assert (there.TYPE.name, there.x, there.y, there.z) == (
        "COMMAND_INT",
        AT["latitude"],
        AT["longitude"],
        488.25,
    )
    assert (there.param1, there.frame) == (0, dialect.MAV_FRAME_GLOBAL)
    assert (here.TYPE.name, here.param1) == ("COMMAND_LONG", 1)


class Origin(Silent):
    """Takes its origin once, and says where it is."""

    def __init__(self) -> None:
        self.places: list[tuple[int, int, int]] = []

    def hear(self, message: Message, now_s: float) -> Sequence[Message]:
        if not self.places:
            self.places.append((message.latitude, message.longitude, message.altitude))
        return (message_type("GPS_GLOBAL_ORIGIN").make(*self.places[0]),)


def test_the_origin_is_set_once_or_it_fails_clearly_whatever_the_link_does() -> None:
    def check(played: Played, vehicle: Origin) -> None:
        assert played.result == (PLACE if played.error is None else None)
        assert vehicle.places in ([], [tuple(AT.values())])

    play_table(lambda: (SetOrigin(VEHICLE, PLACE), Origin()), check, lambda _: RETRIES.bound_s)
    assert isinstance(run(SetOrigin(VEHICLE, PLACE), Silent()).error, NoAnswerError)


@pytest.mark.parametrize(
    "place", [GroundPlace(math.nan, 8.0, 0.0), GroundPlace(47.0, 8.0, math.inf)]
)
def test_an_origin_that_is_no_place_is_not_sent(place: GroundPlace) -> None:
    played = run(SetOrigin(VEHICLE, place), Origin())
    assert type(played.error) is ExchangeError
    assert played.sent == []
