"""Every mission of the repository holds on the fleet that it is flown with."""

from pathlib import Path

import pytest

from m2pem.model.bpmn import read_mission
from m2pem.plugins import PluginManager
from m2pem.resources.fleet_file import load_fleet
from m2pem.verify.check import check
from m2pem.verify.derive import Options
from m2pem.verify.results import Verdict

ROOT = Path(__file__).parents[2]
FLEETS = {
    "mehds_vignette_1": "mehds",
    "mehds_vignette_2": "mehds",
    "mehds_vignette_3": "mehds",
    "mehds_vignette_4": "mehds",
    "survey_pair": "survey_pair",
    "team_column": "mehds_mixed",
    "vignette1": "vignette1",
}


def test_no_mission_is_forgotten() -> None:
    assert {path.stem for path in (ROOT / "missions").glob("*.bpmn")} == FLEETS.keys()


@pytest.mark.parametrize("name", FLEETS)
def test_a_mission_holds_on_its_fleet(name: str) -> None:
    plugins = PluginManager()
    writes = {each: tuple(plugins.service(each)().writes) for each in plugins.services()}
    report = check(
        read_mission(ROOT / "missions" / f"{name}.bpmn"),
        load_fleet(ROOT / "fleet_configs" / f"{FLEETS[name]}.yaml"),
        options=Options(service_writes=writes),
    )
    assert report.found.complete
    assert {each.property for each in report.results if each.verdict is not Verdict.HOLDS} <= {
        "failures-handled"
    }
