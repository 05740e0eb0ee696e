from m2pem_plugin_mavlink.microservices.mission_items import MissionItem
from m2pem_plugin_mavlink.vehicle.fixed_wing import landing_items, landing_start, remove_landing

DO_LAND_START, WAYPOINT, LAND = 189, 16, 21


def items(*commands: int) -> list[MissionItem]:
    return [MissionItem(command, 3) for command in commands]


def test_a_landing_begins_at_its_marker_and_goes_on_to_the_end() -> None:
    mission = items(WAYPOINT, DO_LAND_START, WAYPOINT, LAND)
    assert landing_start(mission) == 1
    assert landing_items(mission) == tuple(mission[1:])
    assert remove_landing(mission) == tuple(mission[:1])


def test_without_a_marker_it_is_the_item_that_lands() -> None:
    assert landing_start(items(WAYPOINT, WAYPOINT, LAND)) == 2


def test_a_mission_may_have_none() -> None:
    mission = items(WAYPOINT, WAYPOINT)
    assert landing_start(mission) is None
    assert landing_items(mission) == ()
    assert remove_landing(mission) == tuple(mission)
