from m2pem_plugin_mavlink.microservices.mission_items import MissionItem
from m2pem_plugin_mavlink.vehicle.fixed_wing import landing, landing_begins, without_landing

DO_LAND_START, WAYPOINT, LAND = 189, 16, 21


def items(*commands: int) -> list[MissionItem]:
    return [MissionItem(command, 3) for command in commands]


def test_a_landing_begins_at_its_marker_and_goes_on_to_the_end() -> None:
    mission = items(WAYPOINT, DO_LAND_START, WAYPOINT, LAND)
    assert landing_begins(mission) == 1
    assert landing(mission) == tuple(mission[1:])
    assert without_landing(mission) == tuple(mission[:1])


def test_without_a_marker_it_is_the_item_that_lands() -> None:
    assert landing_begins(items(WAYPOINT, WAYPOINT, LAND)) == 2


def test_a_mission_may_have_none() -> None:
    mission = items(WAYPOINT, WAYPOINT)
    assert landing_begins(mission) is None
    assert landing(mission) == ()
    assert without_landing(mission) == tuple(mission)
