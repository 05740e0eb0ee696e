"""Mission items and the messages that carry them."""

import math

import pytest
from m2pem_plugin_mavlink.microservices.mission_items import (
    MissionItem,
    MissionType,
    item_message,
    item_of,
)
from m2pem_plugin_mavlink.protocol.messages import message_type
from mavlink_lossy import VEHICLE, over_the_wire
from pymavlink.dialects.v20 import ardupilotmega as dialect

ITEM = MissionItem(
    dialect.MAV_CMD_NAV_WAYPOINT,
    dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT,
    (1.0, 2.0, 3.0, 4.0),
    -47.3977421,
    179.9999999,
    488.25,
    autocontinue=False,
)


def test_an_item_survives_the_wire() -> None:
    message = over_the_wire(item_message(ITEM, 3, VEHICLE, MissionType.MISSION))
    assert (message.seq, message.current, message.mission_type) == (3, 0, 0)
    assert (message.x, message.y) == (-473977421, 1799999999)
    assert item_of(message) == ITEM


def test_what_has_no_place_keeps_its_numbers() -> None:
    item = MissionItem(
        dialect.MAV_CMD_DO_SET_HOME, dialect.MAV_FRAME_MISSION, latitude_deg=5, longitude_deg=-6
    )
    message = over_the_wire(item_message(item, 0, VEHICLE, MissionType.MISSION))
    assert (message.x, message.y) == (5, -6)
    assert item_of(message) == item


def test_a_message_with_floats_is_read_as_well() -> None:
    message = message_type("MISSION_ITEM").make(x=47.5, y=-8.25, z=20.0, command=16, frame=3)
    item = item_of(over_the_wire(message))
    assert (item.latitude_deg, item.longitude_deg, item.altitude_m) == (47.5, -8.25, 20.0)


@pytest.mark.parametrize(
    ("change", "same"),
    [
        ({"frame": dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT}, True),
        ({"frame": dialect.MAV_FRAME_GLOBAL}, False),
        ({"latitude_deg": -47.3977422}, True),
        ({"latitude_deg": -47.3977431}, False),
        ({"altitude_m": 488.255}, True),
        ({"altitude_m": 489.0}, False),
        ({"command": dialect.MAV_CMD_NAV_LAND}, False),
    ],
)
def test_items_are_the_same_but_for_what_storing_changes(
    change: dict[str, float], same: bool
) -> None:
    other = MissionItem(
        **{  # type: ignore[arg-type]
            "command": ITEM.command,
            "frame": ITEM.frame,
            "latitude_deg": ITEM.latitude_deg,
            "longitude_deg": ITEM.longitude_deg,
            "altitude_m": ITEM.altitude_m,
            **change,
        }
    )
    assert ITEM.same_as(other) is same
    assert other.same_as(ITEM) is same


def test_parameters_that_stay_as_they_are_are_no_problem() -> None:
    nan = math.nan
    item = MissionItem(dialect.MAV_CMD_NAV_WAYPOINT, dialect.MAV_FRAME_GLOBAL, (0, nan, nan, nan))
    assert item.problem() == ""
    assert MissionItem(16, dialect.MAV_FRAME_MISSION, latitude_deg=nan).problem() != ""
    assert MissionItem(16, dialect.MAV_FRAME_MISSION, latitude_deg=2.0**31).problem() != ""
