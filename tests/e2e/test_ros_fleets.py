"""Fleets over ROS can be rehearsed without ROS: what they say for its simulation is understood."""

import pytest

from m2pem.api.runs import RunStatus
from m2pem.fleet.fleet_file import load_fleet
from m2pem.plugins import PluginManager
from m2pem.rehearsal.rehearsal import rehearse
from tests.command_line import ANSWERS, FLEET, MISSION


@pytest.mark.parametrize(
    ("mission", "fleet", "answers", "status"),
    [
        ("vignette1", "vignette1_ros", "vignette1_detection", RunStatus.TERMINATED),
        ("vignette1", "vignette1_ros", "vignette1_route", RunStatus.TERMINATED),
        ("mehds_vignette_1", "mehds_ros", "mehds_vignette_1_swept", RunStatus.COMPLETED),
    ],
)
def test_a_fleet_over_ros_can_be_rehearsed(
    mission: str, fleet: str, answers: str, status: RunStatus
) -> None:
    result = rehearse(
        MISSION.with_name(f"{mission}.bpmn"),
        load_fleet(FLEET.with_name(f"{fleet}.yaml")),
        plugins=PluginManager(),
        answers=ANSWERS / f"{answers}.yaml",
    )
    assert result.summary.status is status
