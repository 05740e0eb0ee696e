"""Files of scenarios: what they may say, and whether a rehearsal does what they expect."""

from pathlib import Path
from typing import Any

import pytest
from ruamel.yaml import YAML

from m2pem.coverage.mission_test import MissionTest
from m2pem.coverage.scenario_file import ScenarioError, read_scenarios
from m2pem.errors import AnswersError, FindingsError, FleetError
from m2pem.plugins import PluginManager
from tests.coverage.conftest import GOOD, write_scenarios


def read(mission: Path, text: str) -> MissionTest:
    return MissionTest(mission, read_scenarios(write_scenarios(mission, text)), PluginManager())


def differences(mission: Path, text: str) -> list[tuple[str, ...]]:
    test = read(mission, text)
    return [test.play(number).differences for number in range(len(test.file.model.scenarios))]


def test_scenarios_pass_if_all_is_as_expected(mission: Path) -> None:
    assert differences(mission, GOOD) == [(), ()]


ALL = """\
scenarios:
  - scenario: blocked
    given: {data: {speed: 2}}
    when:
      behaviors: {Drive: [{after: 5 s, end: failed, error: BLOCKED}]}
    then:
      ended: completed
      entered: Start Drive OnBlocked GivenUp
      not_entered: Driven Stayed
      throws: error BLOCKED
      data: {decision.Ask: go, speed: 2, nothing: null}
      commanded: {rover: drive_stop}
      within: 5 s
"""


@pytest.mark.parametrize(
    ("as_it_is", "wrong", "difference"),
    [
        ("ended: completed", "ended: failed", "ended: expected failed, got completed"),
        ("ended: completed", "detail: x", "detail: expected 'x' in ''"),
        ("Start Drive OnBlocked", "Drive Start OnBlocked", "entered: expected Start after Drive;"),
        ("Drive OnBlocked GivenUp", "Drive Driven", "entered: expected Driven after Drive;"),
        ("Driven Stayed", "Driven GivenUp", "not_entered: a token entered GivenUp at 5 s"),
        ("error BLOCKED\n", "error OTHER\n", "throws: expected error OTHER; thrown was error BLO"),
        ("Ask: go", "Ask: stay", "data: decision.Ask: expected 'stay', got 'go'"),
        ("speed: 2, n", "speed: 3, n", "data: speed: expected 3, got 2"),
        ("nothing: null", "nothing: 1", "data: nothing: expected 1, nothing has written it"),
        ("rover: drive_stop", "rover: hold", "commanded: rover: expected hold, got drive_stop"),
        ("within: 5 s", "within: 4 s", "within: expected at most 4 s, took 5 s"),
    ],
)
def test_a_scenario_says_what_is_not_as_expected(
    mission: Path, as_it_is: str, wrong: str, difference: str
) -> None:
    assert differences(mission, ALL) == [()]
    ((found,),) = differences(mission, ALL.replace(as_it_is, wrong))
    assert found.startswith(difference)


def test_a_scenario_may_expect_verdicts_on_requirements(mission: Path) -> None:
    text = mission.read_text(encoding="utf-8").replace(
        '<startEvent id="Start"/>',
        "<extensionElements>"
        '<m2pem:requirement id="stays" ltl="[] !active(Drive)"/></extensionElements>'
        '<startEvent id="Start"/>',
    )
    mission.write_text(text, encoding="utf-8")
    one = "scenarios: [{scenario: a, then: {requirements: {stays: violated}}}]"
    assert differences(mission, one) == [()]
    (((found),),) = differences(mission, one.replace("violated", "satisfied"))
    assert found == "requirements: stays: expected satisfied, got violated"
    ((found,),) = differences(mission, one.replace("stays", "other"))
    assert "not monitored for 'other'; it is for: stays" in found


def test_when_may_name_an_answers_file(mission: Path) -> None:
    mission.with_name("stay.yaml").write_text("answers: {Ask: [stay]}", encoding="utf-8")
    text = "scenarios: [{scenario: a, when: stay.yaml, then: {entered: Stayed}}]"
    assert differences(mission, text) == [()]


def test_a_scenario_has_its_own_fleet_before_that_of_the_file(mission: Path) -> None:
    text = "fleet: none.yaml\nscenarios: [{scenario: a, given: {fleet: sim}, then: completed}]"
    assert differences(mission, text) == [()]
    with pytest.raises(FleetError, match=r"none\.yaml"):
        read(mission, text.replace("given: {fleet: sim}, ", "")).play(0)


def test_everything_wrong_in_a_file_is_found_with_its_line(mission: Path) -> None:
    with pytest.raises(ScenarioError) as caught:
        read(
            mission,
            "complet: true\n"
            "scenarios:\n"
            "  - scenario: a\n"
            "    then: complete\n"
            "  - then: completed\n"
            "  - scenario: b\n"
            "    when: {answers: {Ask: 1}}\n"
            "    then: {within: 3 m}\n",
        )
    found = {(each.line, each.element, each.rule) for each in caught.value.findings}
    assert found == {
        (1, "complet", "unknown-key"),
        (4, "scenarios[0].then.ended", "bad-value"),
        (5, "scenarios[1].scenario", "missing-key"),
        (7, "scenarios[2].when.answers.Ask", "bad-value"),
        (8, "scenarios[2].then.within", "bad-value"),
    }


def test_titles_are_unique_and_answers_come_from_one_place(mission: Path) -> None:
    with pytest.raises(ScenarioError) as caught:
        read(
            mission,
            "scenarios:\n"
            "  - {scenario: a, then: completed}\n"
            "  - {scenario: a, when: {file: b.yaml, answers: {}}, then: completed}\n",
        )
    assert [each.message for each in caught.value.findings] == [
        "another scenario has this title, too",
        "it has an answers file ('file') and other answers",
    ]


def test_what_the_mission_does_not_have_is_refused_with_the_line(mission: Path) -> None:
    with pytest.raises(ScenarioError) as caught:
        read(
            mission,
            "process: MIAN\n"
            "unreached: {Drve: it does not}\n"
            "scenarios:\n"
            "  - scenario: a\n"
            "    then:\n"
            "      entered: Start Stay\n"
            "      throws: BLOCKED\n",
        )
    findings = {each.line: each for each in caught.value.findings}
    assert findings[1].remedy == "did you mean 'MAIN'?"
    assert findings[2].message == "the mission has no element or flow 'Drve'"
    assert findings[6].element == "scenarios[0].then.entered[1]"
    assert "error BLOCKED" in findings[7].remedy


def test_answers_that_do_not_fit_are_refused_with_the_line(mission: Path) -> None:
    test = read(
        mission,
        "scenarios:\n"
        "  - scenario: a\n"
        "    when:\n"
        "      answers:\n"
        "        Ask: [gone]\n"
        "    then: completed\n",
    )
    with pytest.raises(AnswersError) as caught:
        test.play(0)
    (finding,) = caught.value.findings
    assert (finding.line, finding.rule) == (5, "unknown-decision")
    assert finding.file.endswith("drive.test.yaml")


def test_a_mission_that_cannot_be_read_is_refused(mission: Path) -> None:
    mission.write_text("<definitions", encoding="utf-8")
    with pytest.raises(FindingsError):
        read(mission, GOOD)


def test_yaml_reads_what_the_docs_show() -> None:
    page = Path(__file__).parents[2] / "docs" / "testing-missions.md"
    blocks: Any = page.read_text(encoding="utf-8").split("```yaml\n")[1:]
    assert blocks
    for block in blocks:
        YAML(typ="safe").load(block.partition("```")[0])
