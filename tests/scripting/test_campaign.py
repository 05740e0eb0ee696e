from pathlib import Path

import pytest

import m2pem
from m2pem.campaign.runs import order_of, rehearse_runs
from m2pem.errors import AnswersError

MISSION, FLEET = "missions/vignette1.bpmn", "fleet_configs/vignette1.yaml"
BLOCKED = {"DriveRoute": {"fails": {"probability": 0.5, "after": "10 s", "error": "BLOCKED"}}}
REPOSITORY = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def _in_the_repository(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(REPOSITORY)


def test_a_campaign_has_the_rows_and_what_they_say(tmp_path: Path) -> None:
    found = m2pem.campaign(MISSION, FLEET, runs=20, seed=7, variations={"behaviors": BLOCKED})
    mission = m2pem.load_mission(MISSION)
    text = b'{"behaviors": {"DriveRoute": {"fails": {"probability": 0.5, "after": "10 s", '
    order = order_of(mission, m2pem.load_fleet(FLEET), text + b'"error": "BLOCKED"}}}}', 7)
    assert found.rows == rehearse_runs(order, range(20))
    failed = sum(row["end"] == "BLOCKED" for row in found.rows)
    assert 0 < failed < 20
    assert found.ends["failed", "BLOCKED"] == found.failure
    assert found.failure.count == failed
    assert found.effects[0].failure == 1
    found.write(tmp_path / "out")
    written = (tmp_path / "out/report.md").read_text().splitlines()
    assert "## Worst runs" in written
    assert set(found.report.splitlines()) <= set(written)
    assert found.to_html().startswith("<!DOCTYPE html>")


def test_variations_come_from_a_file_which_is_named_when_it_is_wrong(tmp_path: Path) -> None:
    file = tmp_path / "faults.yaml"
    file.write_text("links: [{vehicle: evsg1, at: 20 s}]")
    found = m2pem.campaign(MISSION, FLEET, runs=2, variations=file)
    assert [row["end"] for row in found.rows] == ["LINK_LOST"] * 2
    file.write_text("link: []")
    with pytest.raises(AnswersError, match=r"faults\.yaml:1"):
        m2pem.campaign(MISSION, FLEET, runs=2, variations=file)
