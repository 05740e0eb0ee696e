"""`m2pem.verify`: the report of the command line as an object."""

import json
from pathlib import Path

import pytest

import m2pem
from tests.cli.conftest import Invoke
from tests.cli.test_verify import wide
from tests.command_line import FLEET, MISSION
from tests.console import REPOSITORY

BROKEN = REPOSITORY / "docs" / "broken" / "join_fed_by_one_branch.bpmn"


def test_what_holds_is_said_property_by_property() -> None:
    proof = m2pem.verify(m2pem.load_mission(MISSION), m2pem.load_fleet(FLEET))
    assert (proof.holds, proof.verdict) == (True, "holds")
    assert {"no-deadlock", "one-behavior"} <= {each["property"] for each in proof.properties}
    assert "no-deadlock" in proof._repr_html_()
    assert str(proof).splitlines()[-1].startswith(f"{MISSION}: VIGNETTE1: everything holds")


def test_a_violation_has_its_run_and_its_picture(invoke: Invoke) -> None:
    proof = m2pem.verify(BROKEN)
    assert (proof.holds, proof.verdict) == (False, "violated")
    violation = proof.violations[0]
    assert violation["property"] == "no-deadlock"
    assert violation["steps"]
    assert violation["elements"]
    html = proof.to_html()
    assert "<svg" in html
    assert all(step["text"] in html for step in violation["steps"] if "'" not in step["text"])
    assert f'data-element-id="{violation["elements"][0]}"' in proof.diagram
    status, out, _ = invoke("verify", BROKEN, "--format", "json")
    assert status == 1
    printed = json.loads(out)
    del printed["coverage"]
    data = proof.to_dict()
    del data["coverage"]
    assert json.loads(json.dumps(data)) == printed


def test_requirements_are_added_and_limits_end_the_search() -> None:
    held = m2pem.verify(
        MISSION, requirements=b"requirements: [{id: never, ltl: '[] !completed(Reverse)'}]"
    )
    assert held.verdict == "violated"
    assert m2pem.verify(wide(12).encode(), max_states=1500).verdict == "undecided"


def test_what_check_refuses_is_refused_with_all_findings(tmp_path: Path) -> None:
    mission = tmp_path / "mission.bpmn"
    text = MISSION.read_text(encoding="utf-8")
    mission.write_text(text.replace('vehicle="evsg1"', 'vehicle="evsg9"'))
    with pytest.raises(m2pem.MissionError) as refused:
        m2pem.verify(mission, FLEET)
    assert refused.value.findings == tuple(m2pem.check(mission, FLEET))


def test_an_engine_that_does_not_exist_is_not_replaced_by_another() -> None:
    with pytest.raises(ValueError, match="no engine 'Spin': builtin or spin"):
        m2pem.verify(MISSION, engine="Spin")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="add engine='spin'"):
        m2pem.verify(MISSION, storage="collapse")


async def test_a_running_event_loop_does_not_matter() -> None:
    assert m2pem.verify(MISSION).holds
