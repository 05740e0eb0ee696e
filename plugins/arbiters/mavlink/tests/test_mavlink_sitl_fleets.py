"""The fleets of real autopilots fit their missions; flying them needs the autopilots' programs."""

from collections import Counter
from itertools import pairwise

import pytest
from m2pem_plugin_mavlink.sitl.fleet import read_vehicles
from test_mavlink_demo import FLEETS

from m2pem import load_fleet
from m2pem.api import distance_m
from m2pem.api.runs import RunStatus
from m2pem.plugins import PluginManager
from m2pem.rehearsal.rehearsal import rehearse

MISSIONS = FLEETS.parent / "missions"


@pytest.mark.parametrize(
    ("fleet", "frames"),
    [
        ("survey_pair", {"quad": 2, "rover": 1}),
        ("mehds_sitl", {"quad": 1, "rover": 4}),
        ("mehds_mixed", {"quad": 1}),
    ],
)
def test_the_autopilots_of_a_fleet_can_be_started(fleet: str, frames: dict[str, int]) -> None:
    vehicles = read_vehicles(load_fleet(FLEETS / f"{fleet}.yaml"), 5.0)
    assert Counter(getattr(each.frame, "name", each.frame) for each in vehicles) == frames
    homes = [(each.start.latitude_deg, each.start.longitude_deg) for each in vehicles]
    assert all(distance_m(one, other) > 3.0 for one, other in pairwise(homes))


@pytest.mark.parametrize(
    ("mission", "answers"),
    [
        ("mehds_vignette_1", "mehds_vignette_1_swept"),
        ("mehds_vignette_2", "mehds_vignette_2_rejoined"),
        ("mehds_vignette_3", "mehds_vignette_3_crossed"),
        ("mehds_vignette_4", "mehds_vignette_4_route_driven"),
    ],
)
def test_a_fleet_of_autopilots_can_be_rehearsed(mission: str, answers: str) -> None:
    result = rehearse(
        MISSIONS / f"{mission}.bpmn",
        load_fleet(FLEETS / "mehds_sitl.yaml"),
        plugins=PluginManager(),
        answers=MISSIONS / "answers" / f"{answers}.yaml",
    )
    assert result.summary.status is RunStatus.COMPLETED
