"""Each verdict is given under its assumptions and without them, from the file to the reports."""

import json
import re
from pathlib import Path

import pytest

from m2pem.mission.mission import Mission
from m2pem.scripting.verification import VerificationResult, verify
from m2pem.verify.properties.results import Result, Verdict
from m2pem.verify.requirements.requirement import RequirementsError
from tests.engine.notation import mission as notation
from tests.verify.missions import approval, in_a_row, pair, survey, task

TWO_EACH = (
    "{id: two, pattern: visits_at_least, args: {resource: each, behavior: area_survey, times: 2}}"
)
END = "{id: end, ltl: '<> completed(E)'}"
"""The two requirements that the paper of M2PEM has as examples."""

ENGINES = ("builtin", "spin")


def spec(*entries: str, assume: str = "") -> bytes:
    first = f"assume: {assume}\n" if assume else ""
    return f"{first}requirements: [{', '.join(entries)}]".encode()


def asked(found: VerificationResult, name: str) -> Result:
    return next(each for each in found.findings.results if each.property == name)


def line_of(found: VerificationResult, name: str) -> str:
    """What the text says of a property: two lines of it."""
    lines = str(found).splitlines()
    at = next(n for n, line in enumerate(lines) if f"  {name} " in line)
    return "\n".join(lines[at : at + 2])


@pytest.mark.parametrize("engine", ENGINES)
def test_the_two_requirements_of_the_paper_come_out_as_a_reader_expects(engine: str) -> None:
    both = spec(TWO_EACH, END)
    found = verify(pair(), requirements=both, assume="no-failures", engine=engine)  # type: ignore[arg-type]
    assert found.holds
    for name in ("two/uav1", "two/uav2", "end"):
        assert asked(found, name).verdict is Verdict.HOLDS
        said = line_of(found, name)
        assert said.startswith("holds ")
        assert "if no behavior fails; without that: violated, by a run in which" in said
        assert "fails with FAILED" in said

    less = verify(pair(again=True), requirements=both, assume="no-failures", engine=engine)  # type: ignore[arg-type]
    assert less.verdict == "violated"
    assert asked(less, "two/uav1").verdict is Verdict.VIOLATED
    assert line_of(less, "two/uav1").endswith("if no behavior fails; without that: violated")
    assert asked(less, "two/uav2").verdict is Verdict.HOLDS


@pytest.mark.parametrize("engine", ENGINES)
def test_without_an_assumption_it_is_said_what_would_hold_if_nothing_failed(engine: str) -> None:
    found = verify(pair(again=True), requirements=spec(TWO_EACH, END), engine=engine)  # type: ignore[arg-type]
    assert found.verdict == "violated"
    assert "it holds if no behavior fails" in line_of(found, "two/uav2")
    assert "it holds if no behavior fails" in line_of(found, "end")
    assert not asked(found, "two/uav1").would_hold_if  # two surveys of one place are not two places


@pytest.mark.parametrize(
    ("fails", "said"),
    [
        (False, "it holds if only fair runs count (fair true)"),
        (
            True,
            "it holds if no behavior fails and only fair runs count "
            "(assume no-failures, fair true)",
        ),
    ],
)
def test_of_a_loop_it_is_said_that_it_ends_in_fair_runs(fails: bool, said: str) -> None:
    lines = approval().source
    if not fails:
        lines = re.sub(rb"<script>.*?</script>", b"", lines, flags=re.S)
        lines = lines.replace(b"scriptTask", b"task")
    found = verify(reread(lines), requirements=spec("{id: r, ltl: '<> ended(completed)'}"))
    assert asked(found, "r").verdict is Verdict.VIOLATED
    assert line_of(found, "r").endswith(said)


def test_a_violation_without_a_failure_has_no_such_remark() -> None:
    never = spec("{id: r, ltl: '[] !completed(North)'}")
    found = verify(pair(), requirements=never)
    assert asked(found, "r").verdict is Verdict.VIOLATED
    assert not asked(found, "r").would_hold_if


def test_a_requirement_may_assume_more_than_its_file_and_the_whole_check() -> None:
    entries = (
        END.replace("}", ", assume: 'failures <= 0'}"),
        END.replace("end", "also"),
        "{id: safe, ltl: '[] !(commanded(uav1) && ended)', assume: [operators-answer]}",
    )
    found = verify(pair(), requirements=spec(*entries, assume="'failures <= 3'"))
    said = {each.property: str(each.assumed) for each in found.findings.results if each.required}
    assert said == {
        "end": "no-failures",
        "also": "failures <= 3",
        "safe": "failures <= 3, operators-answer",
    }
    assert asked(found, "end").verdict is Verdict.HOLDS
    assert asked(found, "also").verdict is Verdict.VIOLATED
    assert asked(found, "safe").verdict is Verdict.HOLDS
    assert not asked(found, "no-deadlock").assumed
    order = [each.property for each in found.findings.results if each.required]
    assert order == ["end", "also", "safe"]


def in_file(text: str = "", requirement: str = "") -> Mission:
    mission = in_a_row(
        task("A", "uav1", "goto", target="x"), survey("B", "uav1", "y"), requirements=requirement
    )
    assumed = f' m2pem:assume="{text}"' if text else ""
    return reread(mission.source.replace(b'<process id="P"', f'<process id="P"{assumed}'.encode()))


def reread(source: bytes) -> Mission:
    from m2pem.bpmn import parse_mission

    return parse_mission(source, "test.bpmn")


def test_the_mission_says_what_its_check_and_its_requirements_assume() -> None:
    requirement = '<m2pem:requirement id="r" ltl="&lt;&gt; completed(B)" assume="no-failures"/>'
    own = verify(in_file(requirement=requirement))
    assert own.holds
    assert asked(own, "r").without is not None
    whole = verify(in_file("failures &lt;= 1", requirement))
    assert str(whole.findings.assumed) == "failures <= 1"
    assert str(asked(whole, "r").assumed) == "no-failures"
    assert str(asked(whole, "failures-handled").assumed) == "failures <= 1"


def test_an_element_that_only_failures_reach_is_not_dead_where_nothing_fails() -> None:
    caught = notation("""
        <startEvent id="s"/><scriptTask id="A">do goto uav1 target=x</scriptTask><endEvent id="e"/>
        <boundaryEvent id="wrong" attachedToRef="A">error</boundaryEvent>
        <scriptTask id="Back">do return_to_launch uav1</scriptTask><endEvent id="f"/>
        s -> A -> e
        wrong -> Back -> f
    """)
    found = verify(caught, assume="no-failures")
    assert found.holds
    assert not found.findings.unreached
    assert not asked(found, "no-dead-element").assumed


def test_programs_get_the_assumption_and_both_answers() -> None:
    found = verify(pair(), requirements=spec(END), assume=["no-failures", "operators-answer"])
    data = json.loads(json.dumps(found.to_dict()))
    assert data["assumed"] == "no-failures, operators-answer"
    end = next(each for each in data["properties"] if each["property"] == "end")
    assert end["assumed"] == "no-failures, operators-answer"
    assert end["verdict"] == "holds"
    assert end["without"]["verdict"] == "violated"
    steps = end["without"]["violation"]["steps"]
    assert [each["trigger"] for each in steps][-1] == "fails"
    assert not data["violations"] or all(each["warning"] for each in data["violations"])


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"assume": "no-failure"}, "--assume: error: 'no-failure' is no assumption; did you mean"),
        ({"assume": "reliable(uav9)"}, "the fleet has no vehicle, payload or team 'uav9'"),
        (
            {"requirements": spec(END.replace("}", ", assume: soon}"))},
            "requirements.yaml:1: requirements[0].assume: error: end: 'soon' is no assumption",
        ),
        ({"requirements": spec(END, assume="soon")}, "requirements.yaml:1: assume: error:"),
        ({"requirements": spec(END, assume="[1, 2]")}, "is no text and no list of texts"),
        (
            {"requirements": spec(END.replace("}", ", assume: 3}"))},
            "'assume' is no text and no list of texts",
        ),
    ],
)
def test_a_mistake_in_an_assumption_is_found(given: dict[str, bytes], said: str) -> None:
    with pytest.raises(RequirementsError) as raised:
        verify(pair(), **given)  # type: ignore[arg-type]
    assert said in str(raised.value)


def test_check_warns_of_a_mistake_in_the_file(tmp_path: Path) -> None:
    from m2pem.scripting.checking import check

    file = tmp_path / "m.bpmn"
    file.write_bytes(in_file("no-failure").source)
    warnings = [str(each) for each in check(file)]
    assert any("P: warning: 'no-failure' is no assumption" in each for each in warnings), warnings
