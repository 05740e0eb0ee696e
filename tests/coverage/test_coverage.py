"""What scenarios do not see, and what is suggested for it."""

from pathlib import Path

from m2pem.bpmn import parse_mission
from m2pem.coverage.adding import add_scenarios, yaml_of
from m2pem.coverage.items import Kind, items_of, seen_in
from m2pem.coverage.mission_test import MissionReport, MissionTest
from m2pem.coverage.reach import Reach
from m2pem.coverage.scenario_file import read_scenarios
from m2pem.coverage.suggesting import suggest_answers
from m2pem.coverage.suite import LIMITS, Target, Wanted, find_targets, report_on, reports_on
from m2pem.fleet.default_fleet import fleet_for
from m2pem.plugins import PluginManager
from m2pem.rehearsal.rehearsal import rehearse
from tests.coverage.conftest import GOOD, MISSION, write_scenarios


def report(
    mission: Path, text: str | None = None, *, complete: bool = False, suggest: bool = False
) -> MissionReport:
    scenarios = write_scenarios(mission, text) if text is not None else None
    wanted = Wanted(complete=complete, suggest=suggest)
    return report_on(Target(mission, scenarios), wanted, PluginManager())


def never(found: MissionReport) -> dict[str, str]:
    return {each.item.key: each.reason for each in found.never}


def test_items_are_all_elements_and_flows_by_kind() -> None:
    items = items_of(parse_mission(MISSION, "drive.bpmn"))
    assert {kind: [each.id for each in items if each.kind is kind] for kind in Kind} == {
        Kind.ELEMENT: ["Start", "Ask", "Which", "Drive"],
        Kind.FLOW: [
            *("ToAsk", "ToWhich", "ToDrive", "ToStayed", "ToDriven", "ToNoAnswer", "ToGivenUp")
        ],
        Kind.END: ["Driven", "Stayed", "NoAnswer", "GivenUp"],
        Kind.EVENT: ["TooLate", "OnBlocked"],
        Kind.ERROR: [],
    }


def test_what_no_scenario_sees_is_named(mission: Path) -> None:
    found = report(mission, GOOD)
    assert set(never(found)) == {
        *("TooLate", "NoAnswer", "ToNoAnswer", "OnBlocked", "GivenUp", "ToGivenUp", "error FAILED")
    }
    assert set(never(found).values()) == {"a run reaches it, and no scenario does"}
    assert found.seen_of(Kind.END) == (2, 4)
    assert found.passed


def test_a_complete_file_sees_all_or_names_it(mission: Path) -> None:
    assert not report(mission, GOOD, complete=True).passed
    assert not report(mission, f"complete: true\n{GOOD}").passed
    named = [
        *("TooLate", "NoAnswer", "ToNoAnswer", "OnBlocked", "GivenUp", "ToGivenUp", "error FAILED")
    ]
    text = "complete: true\nunreached: {" + ", ".join(f"{key}: rare" for key in named) + "}\n"
    found = report(mission, text + GOOD)
    assert found.passed
    assert never(found) == dict.fromkeys(named, "rare")


def test_what_is_called_unreached_and_is_reached_fails(mission: Path) -> None:
    found = report(mission, f"unreached: {{Stayed: never}}\n{GOOD}")
    assert found.stale == ("Stayed",)
    assert not found.passed


def test_what_no_run_reaches_is_named_so(mission: Path) -> None:
    text = mission.read_text(encoding="utf-8")
    mission.write_text(text.replace('== "go"', '== "went"'), encoding="utf-8")
    found = report(mission, "scenarios: [{scenario: a, then: completed}]", suggest=True)
    reasons = never(found)
    for key in ("ToDrive", "Drive", "ToDriven", "Driven", "OnBlocked", "GivenUp"):
        assert reasons[key] == "no run reaches it"
    assert "error FAILED" not in found.items
    assert {each.item.key for each in found.unnamed} == {"TooLate", "NoAnswer", "ToNoAnswer"}
    assert [each.entered for each in found.suggestions] == [("TooLate", "NoAnswer")]


def test_suggestions_reach_all_that_runs_reach(mission: Path) -> None:
    found = report(mission, suggest=True)
    reached = [item.key for each in found.suggestions for item in each.reaches]
    assert sorted(reached) == sorted(found.items)
    assert len(reached) == len(set(reached))
    for each in found.suggestions:
        loaded = parse_mission(MISSION, "drive.bpmn")
        result = rehearse(
            loaded,
            fleet_for(loaded),
            plugins=PluginManager(),
            answers=yaml_of(each.answers).encode(),
        )
        assert {item.key for item in each.reaches} <= seen_in(r.record for r in result.records)
        assert result.summary.status.value == each.ended


def test_scenarios_that_are_added_pass_and_see_all(mission: Path) -> None:
    file = mission.with_suffix(".test.yaml")
    assert add_scenarios(file, "sim", report(mission, suggest=True).suggestions) == 5
    found = report_on(Target(mission, file), Wanted(complete=True), PluginManager())
    assert found.passed
    assert found.never == ()
    assert len(found.outcomes) == 5


def test_adding_keeps_what_is_there(mission: Path) -> None:
    file = write_scenarios(mission, f"# by hand\n{GOOD}")
    add_scenarios(file, "sim", report(mission, f"# by hand\n{GOOD}", suggest=True).suggestions)
    text = file.read_text(encoding="utf-8")
    assert text.startswith(f"# by hand\n{GOOD}")
    assert report_on(Target(mission, file), Wanted(complete=True), PluginManager()).passed


def test_what_was_not_looked_for_in_time_says_so(mission: Path) -> None:
    target = Target(mission, write_scenarios(mission, GOOD))
    test = MissionTest(target.mission, read_scenarios(target.scenarios or mission), PluginManager())
    reach = Reach(test.mission, test.rehearser(None).fleet, "MAIN", {}, {}, LIMITS)
    items = items_of(test.mission)
    found, unscripted = suggest_answers(reach, test.rehearser(None), {}, items, -1.0)
    assert found == ()
    assert set(unscripted) == {item.key for item in items}


def test_an_item_that_only_unknown_data_reaches_says_so(mission: Path) -> None:
    text = mission.read_text(encoding="utf-8").replace(
        "<timerEventDefinition>\n      <timeDuration>PT60S</timeDuration></timerEventDefinition>",
        "<conditionalEventDefinition><condition>wind.speed > 12</condition>"
        "</conditionalEventDefinition>",
    )
    assert "conditionalEventDefinition" in text
    mission.write_text(text, encoding="utf-8")
    found = report(mission, GOOD, suggest=True)
    assert "nothing in the mission writes" in never(found)["NoAnswer"]
    assert {"NoAnswer", "TooLate", "ToNoAnswer"} <= {each.item.key for each in found.unnamed}


def test_of_a_folder_all_missions_are_tested_but_files_that_they_call(mission: Path) -> None:
    inner = b'<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"><process id="INNER">'
    inner += b'<startEvent id="S"/><endEvent id="E"/><sequenceFlow id="F" sourceRef="S"'
    inner += b' targetRef="E"/></process></definitions>'
    mission.with_name("inner.bpmn").write_bytes(inner)
    mission.with_name("alone.bpmn").write_bytes(inner.replace(b"INNER", b"ALONE"))
    text = mission.read_text(encoding="utf-8")
    text = text.replace(
        '<endEvent id="Stayed"/>', '<callActivity id="Stayed" calledElement="INNER"/>'
    )
    mission.write_text(text, encoding="utf-8")
    write_scenarios(mission, "scenarios: [{scenario: a, then: completed}]")
    reports = list(reports_on(find_targets([mission.parent]), Wanted(), PluginManager()))
    assert [each.mission.name for each in reports] == ["drive.bpmn", "alone.bpmn"]
    named = find_targets([mission.parent, mission.with_name("inner.bpmn")])
    names = [each.mission.name for each in reports_on(named, Wanted(), PluginManager())]
    assert names == ["drive.bpmn", "alone.bpmn", "inner.bpmn"]
