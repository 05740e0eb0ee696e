"""`m2pem check` says where the speeds of a route's waypoints are ignored."""

from pathlib import Path

from m2pem.scripting.checking import check
from tests.fleet.test_terrain_check import FLEET, MISSION, ROUTE

LANE = (
    '{"type": "Feature", "properties": {"speeds_m_s": [null, 2]}, "geometry": '
    '{"type": "LineString", "coordinates": [[-77.3, 38.10], [-77.3, 38.11]]}}'
)


def ignored(folder: Path, properties: str = ROUTE) -> list[str]:
    (folder / "fleet.yaml").write_text(FLEET.format(clearance=""))
    (folder / "m.bpmn").write_text(
        MISSION.format(lane=LANE, properties=properties, vehicle="rover")
    )
    findings = check(folder / "m.bpmn", folder / "fleet.yaml")
    return [str(each) for each in findings if each.rule == "waypoint-speeds-ignored"]


def test_simulated_vehicles_keep_the_speeds_of_waypoints(tmp_path: Path) -> None:
    assert ignored(tmp_path) == []


FORMATION = (
    '<m2pem:property name="route" value="lane"/><m2pem:property name="shape" value="column"/>'
)


def of_a_team(folder: Path, properties: str) -> list[str]:
    fleet = FLEET.format(clearance="") + "teams: {both: {members: [rover, rover2], lead: rover}}\n"
    rover2 = "  rover2: {domain: ground, arbiter: sim}\n  uav:"
    (folder / "fleet.yaml").write_text(fleet.replace("  uav:", rover2))
    mission = MISSION.format(lane=LANE, properties=properties, vehicle="both")
    mission = mission.replace('type="vehicle" name="single_vehicle_routing"', TEAM)
    (folder / "m.bpmn").write_text(mission.replace('vehicle="both"', 'team="both"'))
    findings = check(folder / "m.bpmn", folder / "fleet.yaml")
    return [str(each) for each in findings if each.rule == "waypoint-speeds-ignored"]


TEAM = 'type="team" name="formation"'


def test_a_behavior_that_ignores_them_is_named(tmp_path: Path) -> None:
    [found] = of_a_team(tmp_path, FORMATION)
    assert "parameter 'route': 'formation' ignores the speeds of the route's waypoints" in found


def test_a_speed_of_the_task_is_the_author_s_choice(tmp_path: Path) -> None:
    speed = '<m2pem:property name="speed" value="3 m/s"/>'
    assert of_a_team(tmp_path, FORMATION + speed) == []
