"""Every mission and example of the repository holds on the fleet that it is flown with."""

from pathlib import Path

import pytest

from bench.verification.works import FLEETS, Subject, subjects
from m2pem.bpmn import read_mission
from m2pem.fleet.fleet_file import load_fleet
from m2pem.plugins import PluginManager
from m2pem.verify.check import check
from m2pem.verify.properties.results import Verdict
from m2pem.verify.translate import Options

ROOT = Path(__file__).parents[2]
OURS = [each for each in subjects() if not each.file.startswith("docs/broken/")]


def test_no_mission_is_forgotten() -> None:
    assert {path.stem for path in (ROOT / "missions").glob("*.bpmn")} == FLEETS.keys()
    assert {each.file.split("/")[0] for each in OURS} == {"missions", "examples"}


@pytest.mark.parametrize("subject", OURS, ids=lambda each: each.file)
def test_a_mission_holds_on_its_fleet(subject: Subject) -> None:
    plugins = PluginManager()
    writes = {each: tuple(plugins.service(each)().writes) for each in plugins.services()}
    report = check(
        read_mission(ROOT / subject.file),
        load_fleet(ROOT / subject.fleet) if subject.fleet else None,
        options=Options(service_writes=writes),
    )
    assert report.found.complete
    assert {each.property for each in report.results if each.verdict is not Verdict.HOLDS} <= {
        "failures-handled"
    }
