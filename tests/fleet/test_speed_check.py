"""`m2pem check` says where the speeds of a route's waypoints are ignored."""

from pathlib import Path

import pytest

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


def test_an_arbiter_that_ignores_them_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("m2pem.fleet.speed_check.KEEP_SPEEDS", frozenset())
    [found] = ignored(tmp_path)
    assert "arbiter 'sim' of rover ignores the speeds of the route's waypoints" in found


def test_a_speed_of_the_task_is_the_author_s_choice(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("m2pem.fleet.speed_check.KEEP_SPEEDS", frozenset())
    speed = '<m2pem:property name="speed" value="3 m/s"/>'
    assert ignored(tmp_path, ROUTE + speed) == []
