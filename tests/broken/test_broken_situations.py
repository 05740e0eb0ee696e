"""What is found in the broken missions: the executive does it, and Spin finds it, until mended."""

from pathlib import Path

import pytest

from m2pem.bpmn import parse_mission
from m2pem.fleet.default_fleet import fleet_for
from m2pem.plugins import PluginManager
from m2pem.rehearsal.rehearsal import rehearse
from m2pem.verify.check import check
from m2pem.verify.report.findings import Findings, findings_of
from m2pem.verify.spin.check import check_with_spin
from m2pem.verify.translate import Options
from tests.broken.expected import EXPECTED, Expected
from tests.broken.situations import Records, Situation, situations

SITUATIONS = {each.name: each for each in situations()}
MOST_STEPS = 200
"""Of a rehearsal: a loop that is not left by then goes on for ever here."""

every_one = pytest.mark.parametrize("expected", EXPECTED, ids=lambda each: each.name)
every_situation = pytest.mark.parametrize("situation", SITUATIONS.values(), ids=lambda s: s.name)


def rehearsals(situation: Situation, text: str, folder: Path) -> list[Records]:
    """The records of the mission under each of the situation's answers."""
    mission = parse_mission(text.encode(), situation.name)
    found: list[Records] = []
    for number, answers in enumerate(situation.answers):
        file = folder / f"{number}.yaml"
        file.write_text(answers, encoding="utf-8")
        result = rehearse(
            mission,
            fleet_for(mission),
            plugins=PluginManager(),
            answers=file,
            max_steps=MOST_STEPS,
        )
        found.append([each.record for each in result.records])
    return found


def options() -> Options:
    plugins = PluginManager()
    return Options(
        service_writes={n: tuple(plugins.service(n)().writes) for n in plugins.services()}
    )


def findings(text: str, *, spin: bool = False) -> Findings:
    mission = parse_mission(text.encode(), "mission.bpmn")
    report = (check_with_spin if spin else check)(mission, options=options())
    return findings_of(mission, report)


def where(found: Findings, asked: str) -> list[frozenset[str]]:
    return [frozenset(v.found.elements) for v in found.violations if v.answer.property == asked]


def test_each_has_its_situation() -> None:
    assert SITUATIONS.keys() == {each.name for each in EXPECTED}


@every_situation
def test_the_executive_does_what_is_found(situation: Situation, tmp_path: Path) -> None:
    assert situation.shows(rehearsals(situation, situation.broken, tmp_path))


@every_situation
def test_the_executive_does_it_no_more_when_it_is_mended(
    situation: Situation, tmp_path: Path
) -> None:
    assert not situation.shows(rehearsals(situation, situation.mended, tmp_path))


@every_one
def test_nothing_of_the_kind_is_found_when_it_is_mended(expected: Expected) -> None:
    situation = SITUATIONS[expected.name]
    assert expected.elements in where(findings(situation.broken), expected.asked)
    assert where(findings(situation.mended), expected.asked) == []


@every_one
def test_spin_finds_it_at_the_same_elements(expected: Expected) -> None:
    text = SITUATIONS[expected.name].broken
    ours, spins = findings(text), findings(text, spin=True)
    assert where(spins, expected.asked) == where(ours, expected.asked)
    assert expected.elements in where(spins, expected.asked)


@every_one
def test_what_goes_on_in_a_run_has_begun_in_it(expected: Expected) -> None:
    found = findings(SITUATIONS[expected.name].broken)
    for violation in found.violations:
        begun: list[str] = []
        for run_step in (*violation.run_steps, *violation.loop):
            if run_step.trigger in ("succeeds", "fails", "answer"):
                name = found.mission.elements[run_step.element].name
                assert any(name in each for each in begun), (
                    f"{violation.found.message}: {run_step.text}"
                )
            if "begins" in run_step.text or "asks" in run_step.text:
                begun.append(run_step.text)
