"""What `m2pem verify` says of formulas with mistakes, and of what it cannot wholly express."""

from pathlib import Path

import pytest

from tests.cli.conftest import Invoke
from tests.command_line import REPOSITORY

PAIR = (
    REPOSITORY / "missions" / "survey_pair.bpmn",
    "--fleet",
    REPOSITORY / "fleet_configs" / "survey_pair.yaml",
)
ATOMS = (
    "a formula can ask for active(E), completed(E), commanded(RESOURCE, BEHAVIOR), ended, "
    "count(...) >= N, distance(A, B) < 5 m, altitude(V) > 10 m, speed(V) > 1 m/s, "
    "battery(V) < 20 %, link(V) == lost and comparisons of data"
)


def refused(invoke: Invoke, tmp_path: Path, *requirements: str) -> list[str]:
    """The lines that are said of a spec file; nothing is checked, and the status is 2."""
    spec = tmp_path / "spec.yaml"
    text = "\n".join(f"  - {each}" for each in requirements)
    spec.write_text(f"requirements:\n{text}\n", encoding="utf-8")
    status, out, err = invoke("verify", *PAIR, "--spec", spec)
    assert (status, out) == (2, "")
    return err.splitlines()


@pytest.mark.parametrize(
    ("formula", "under", "says"),
    [
        ("[](activ(SurveyWest) -> <> ended)", "activ(", f"{ATOMS}; did you mean 'active'?"),
        ("<> finish(SurveyWest)", "finish", ATOMS),
        ("[](active(SurveyWest) => <> ended)", "=>", "write '->' for \"implies\""),
        ("[] !commanded(uav1, ared_survey)", "ared_survey", "did you mean 'area_survey'"),
        ("<> commanded(uaw1)", "uaw1", "did you mean 'uav1'"),
        ("<> completed(SurvyWest)", "SurvyWest", "did you mean 'SurveyWest' or 'SurveyEast'?"),
        ("<> completed('AREA SURVEY WST')", "'AREA", "did you mean 'AREA SURVEY WEST'"),
        ("<> west.surveyd == true", "west.surveyd", "did you mean 'west.surveyed'"),
        ("[] battery(uav1) > 20", "20", "20 is no charge of a battery; write 20 %, or 0.2"),
    ],
)
def test_a_mistake_in_a_formula_is_pointed_at(
    invoke: Invoke, tmp_path: Path, formula: str, under: str, says: str
) -> None:
    _, finding, quoted, pointer = refused(invoke, tmp_path, f'{{id: wrong, ltl: "{formula}"}}')
    assert f"{tmp_path / 'spec.yaml'}:2: requirements[0].ltl: error: wrong: " in finding
    assert says in finding
    assert quoted.strip() == formula
    assert quoted[pointer.index("^") :].startswith(under)
    assert f"at column {formula.index(under) + 1} " in finding


def test_of_a_long_formula_the_part_around_the_mistake_is_shown(
    invoke: Invoke, tmp_path: Path
) -> None:
    formula = " && ".join(["[] !ended(failed)"] * 20 + ["<> activ(SurveyWest)"])
    *_, quoted, pointer = refused(invoke, tmp_path, f'{{id: long, ltl: "{formula}"}}')
    assert quoted.startswith("    ... ")
    assert len(quoted) < 110
    assert quoted[pointer.index("^") :] == "activ(SurveyWest)"


def test_of_several_lines_the_one_with_the_mistake_is_shown(invoke: Invoke, tmp_path: Path) -> None:
    written = "id: lines\n    ltl: |\n      [](active(SurveyWest)\n      -> <> ende)\n"
    _, finding, quoted, pointer = refused(invoke, tmp_path, written)
    assert "at column 7 of line 2 of the formula" in finding
    assert (quoted.strip(), pointer.index("^")) == ("-> <> ende)", quoted.index("ende"))


def test_every_mistake_is_pointed_at_at_once(invoke: Invoke, tmp_path: Path) -> None:
    lines = refused(
        invoke,
        tmp_path,
        '{id: a, ltl: "<> completd(SurveyWest)"}',
        "{id: b, pattern: visit, args: {locations: [SurveyWest, 'activ(SurveyEast)']}}",
        "{id: c, pattern: vist}",
    )
    assert sum(line.strip() == "^" for line in lines) == 2
    assert any("did you mean 'visit'" in line for line in lines)


def test_a_formula_in_the_mission_is_pointed_at_too(invoke: Invoke, tmp_path: Path) -> None:
    mission = tmp_path / "mission.bpmn"
    mission.write_text(
        """<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"
  xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="own"><process id="Own">
  <extensionElements>
    <m2pem:requirement id="over" ltl="&lt;&gt; endet"/>
  </extensionElements>
  <startEvent id="Start"/><endEvent id="End"/>
  <sequenceFlow id="flow" sourceRef="Start" targetRef="End"/></process></definitions>""",
        encoding="utf-8",
    )
    status, _, err = invoke("verify", mission)
    assert status == 2
    assert f"{mission}:4: over: error: the mission has no data 'endet'" in err
    assert err.splitlines()[-2:] == ["    <> endet", "       ^"]


@pytest.mark.parametrize(
    ("example", "places", "note"),
    [
        (
            "t06_timers",
            "1 place",
            "note: EveryMinute (every minute): it begins again only when it has ended; "
            "what holds, holds up to that",
        ),
        (
            "t07_data",
            "3 places",
            "note: Enough (Enough laps?): a condition reads what nothing in the mission writes; "
            "an alarm may be false",
        ),
    ],
)
def test_an_element_that_cannot_be_wholly_expressed_is_named_with_the_reason(
    invoke: Invoke, example: str, places: str, note: str
) -> None:
    _, out, _ = invoke("verify", REPOSITORY / "examples" / example / "mission.bpmn")
    assert note in out.splitlines()
    assert f"at {places} the net is not exactly the mission" in out.splitlines()[-1]


def test_only_some_of_many_such_elements_are_listed(invoke: Invoke, tmp_path: Path) -> None:
    ways = "".join(
        f'<exclusiveGateway id="Way{n}"/><exclusiveGateway id="Met{n}"/>'
        f'<sequenceFlow id="a{n}" sourceRef="Way{n}" targetRef="Met{n}"/>'
        f'<sequenceFlow id="b{n}" sourceRef="Way{n}" targetRef="Met{n}"/>'
        f'<sequenceFlow id="c{n}" sourceRef="Met{n}" targetRef="Way{n + 1}"/>'
        for n in range(8)
    )
    mission = tmp_path / "many.bpmn"
    mission.write_text(
        f"""<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"
  targetNamespace="many"><process id="Many"><startEvent id="Start"/><endEvent id="Way8"/>
  <sequenceFlow id="first" sourceRef="Start" targetRef="Way0"/>{ways}</process></definitions>""",
        encoding="utf-8",
    )
    status, out, _ = invoke("verify", mission, "--report", tmp_path / "many.md")
    assert status == 0
    assert sum(line.startswith("note: Way") for line in out.splitlines()) == 5
    assert "note: and 3 more like these" in out
    report = (tmp_path / "many.md").read_text(encoding="utf-8")
    assert all(f"- `Way{n}` (more): no flow has a condition" in report for n in range(8))
