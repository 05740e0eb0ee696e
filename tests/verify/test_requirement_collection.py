import pytest

from m2pem.fleet.default_fleet import fleet_for
from m2pem.verify.ltl import show
from m2pem.verify.requirements import (
    Names,
    RequirementsError,
    collect,
    parse_spec,
    read_mission_requirements,
)
from tests.verify.missions import approval, in_a_row, pair, survey


def names(mission=None) -> Names:
    mission = mission or approval()
    return Names(mission, fleet_for(mission))


def spec(text: str, around: Names | None = None):
    return parse_spec(text.encode(), "spec.yaml", around or names())


def test_a_file_holds_formulas_and_patterns() -> None:
    found = spec(
        """requirements:
  - id: asked
    text: nobody drives unasked
    ltl: "[](active(Drive) -> once(user.decision == 'go'))"
  - {id: ends, pattern: reaches_proper_end}
  - {id: ends-always, pattern: reaches_proper_end, fair: false}
"""
    )
    assert [each.id for each in found] == ["asked", "ends", "ends-always"]
    assert (found[0].text, found[0].file, found[0].line) == (
        "nobody drives unasked",
        "spec.yaml",
        2,
    )
    assert [each.fair for each in found] == [False, True, False]
    assert found[0].english == (
        "Whenever 'DRIVE' is active, at some time before (or now) user.decision == 'go'."
    )


def test_each_is_every_vehicle_of_the_fleet() -> None:
    found = spec(
        """requirements:
  - {id: two, pattern: visits_at_least, args: {resource: each, behavior: area_survey, times: 2}}
""",
        names(pair()),
    )
    assert [(each.id, each.resource) for each in found] == [
        ("two/uav1", "uav1"),
        ("two/uav2", "uav2"),
    ]
    assert found[1].english == "uav2 completes area_survey at 2 different places at least."
    assert (
        show(found[0].formula) == "<>(count(once(completed(North)), once(completed(South))) >= 2)"
    )


def test_an_element_is_named_by_its_id_or_by_its_name() -> None:
    (found,) = spec("requirements: [{id: a, ltl: \"<> completed('DRIVE')\"}]")
    assert show(found.formula) == "<>completed(Drive)"


@pytest.mark.parametrize(
    ("entry", "says"),
    [
        ("{id: a, ltl: '[] activ(Drive)'}", "did you mean 'active'? at column 4"),
        ("{id: a, ltl: '[] finished(Drive)'}", "active(E), completed(E), commanded(RESOURCE"),
        ("{id: a, ltl: '<> completed(Driv)'}", "no element 'Driv'; did you mean 'Drive'"),
        ("{id: a, ltl: '<> completed(Ask-Which)'}", "is a sequence flow"),
        ("{id: a, ltl: '<> commanded(rovr, goto)'}", "did you mean 'rover'? at column 14"),
        ("{id: a, ltl: '<> commanded(rover, got)'}", "did you mean 'goto'? at column 21"),
        ("{id: a, ltl: '<> user.decisio == 1'}", "did you mean 'user.decision'? at column 4"),
        ("{id: a, ltl: '<> Drive'}", "write active(Drive) or completed(Drive)"),
        ("{id: a, ltl: '<> ended', pattern: visit}", "either 'ltl' or 'pattern'"),
        ("{id: a}", "either 'ltl' or 'pattern'"),
        ("{id: a, ltl: '<> ended', args: {x: y}}", "only a pattern takes arguments"),
        ("{id: a, pattern: vist}", "did you mean 'visit'"),
        (
            "{id: a, pattern: visit}",
            "needs 'locations'; write locations: [SurveyNorth,",
        ),
        ("{id: a, pattern: visit, args: {locations: [Drive]}}", "a list of two or more"),
        ("{id: a, pattern: visit, args: {locations: [Drive, Asc]}}", "did you mean 'Ask'"),
        ("{id: a, pattern: visit, args: {location: [Drive, Ask]}}", "did you mean 'locations'"),
        ("{id: a, pattern: absence, args: {what: 3}}", "3 is no text"),
        ("{id: a, pattern: absence, args: {what: Drive, until: Ask}}", "stands beside 'after'"),
        (
            "{id: a, pattern: bounded_existence, args: {what: Drive, times: two}}",
            "'two' is no whole number from 0 to 100",
        ),
        (
            "{id: a, pattern: visits_at_least, args: {resource: rover, behavior: goto, times: 1,"
            " revisits: maybe}}",
            "'maybe' is neither true nor false",
        ),
        (
            "{id: a, pattern: operator_in_the_loop, args: {ask: Drive, decision: go, before: E}}",
            "'Drive' is no user task",
        ),
        (
            "{id: a, pattern: operator_in_the_loop, args: {ask: Ask, decision: got, before: E}}",
            "no decision 'got'; did you mean 'go'",
        ),
        ("{ltl: '<> ended'}", "has no id"),
        ("{id: a, ltl: '<> ended', fairr: true}", "did you mean 'fair'"),
        ("{id: a, ltl: '<> ended', fair: 3}", "'fair' is true or false"),
        ("{id: a, ltl: 3}", "'ltl' is no text"),
        ("just a text", "is no requirement"),
    ],
)
def test_what_is_wrong_is_told_with_its_line(entry: str, says: str) -> None:
    with pytest.raises(RequirementsError) as refused:
        spec(f"# of the pilot\nrequirements:\n  - {entry}\n")
    assert says in str(refused.value)
    assert str(refused.value.findings[0]).startswith("spec.yaml:3:")
    assert refused.value.exit_status == 2


def test_all_that_is_wrong_is_told_at_once() -> None:
    with pytest.raises(RequirementsError) as refused:
        spec(
            """requirements:
  - {id: a, ltl: "<> completed(Nothing)"}
  - {id: b, ltl: "<> ended"}
  - {id: b, ltl: "<> ended"}
  - id: c
    pattern: visits_at_least
    args:
      resource: nobody
      behavior: goto
      times: 2
"""
        )
    assert [each.line for each in refused.value.findings] == [2, 4, 8]


@pytest.mark.parametrize("text", ["", "requirement: []", "- a", "requirements: 3", "a: [", "x: 1"])
def test_a_file_without_requirements_is_refused(text: str) -> None:
    with pytest.raises(RequirementsError):
        spec(text)


def test_a_mission_holds_requirements() -> None:
    mission = in_a_row(
        survey("North", "uav1", "north"),
        survey("South", "uav1", "south"),
        requirements="""<m2pem:requirement id="both" pattern="ordered_visit" text="first north">
<m2pem:arg name="locations" value="North, South"/></m2pem:requirement>
<m2pem:requirement id="again" pattern="visit"><m2pem:arg name="locations" value="North"/>
<m2pem:arg name="locations" value="commanded(uav1, area_survey)"/></m2pem:requirement>
<m2pem:requirement id="end" ltl="&lt;&gt; ended"/>""",
    )
    found = read_mission_requirements(names(mission))
    assert [(each.id, each.line) for each in found] == [("both", 3), ("again", 5), ("end", 7)]
    assert show(found[1].formula) == "<>completed(North) && <>commanded(uav1, area_survey)"
    assert not mission.warnings


def test_what_is_wrong_in_a_mission_is_told_with_its_line() -> None:
    mission = in_a_row(
        survey("North", "uav1", "north"),
        requirements="""<m2pem:requirement id="a" ltl="&lt;&gt; completed(Nort)"/>
<m2pem:requirement id="a" ltl="true"/>
<m2pem:requirement id="b"/>""",
    )
    with pytest.raises(RequirementsError) as refused:
        read_mission_requirements(names(mission))
    told = [(each.file, each.line, each.element) for each in refused.value.findings]
    assert told == [("m.bpmn", 3, "a"), ("m.bpmn", 4, "a"), ("m.bpmn", 5, "b")]


def test_requirements_of_the_mission_and_beside_it_are_gathered(tmp_path) -> None:
    mission = in_a_row(
        survey("North", "uav1", "north"),
        requirements='<m2pem:requirement id="end" ltl="&lt;&gt; ended"/>',
    )
    beside = tmp_path / "spec.yaml"
    beside.write_text("requirements: [{id: north, ltl: '<> completed(North)'}]")
    assert [each.id for each in collect(names(mission), beside)] == ["end", "north"]
    beside.write_text("requirements: [{id: end, ltl: '<> completed(North)'}]")
    with pytest.raises(RequirementsError, match=r"m\.bpmn has a requirement of this id too"):
        collect(names(mission), beside)
    with pytest.raises(RequirementsError, match="cannot be read"):
        collect(names(mission), tmp_path / "absent.yaml")


@pytest.mark.parametrize(
    ("written", "said"),
    [
        (
            "pattern: response, args: {whn: Drive, then: Drive}",
            "response takes no 'whn', and needs 'when'; did you mean 'when' or 'within'?",
        ),
        (
            "pattern: response, args: {trigger: Drive, then: Drive}",
            "response takes no 'trigger', and needs 'when'; did you mean 'when'?",
        ),
        (
            "pattern: response, args: {trigger: Drive, effect: Drive}",
            "response takes no 'trigger' and no 'effect', and needs 'when' and 'then'; "
            "known arguments: when, then, within, for, before, after, until",
        ),
        (
            "pattern: response, args: {wen: Drive, thn: Drive}",
            "response takes no 'wen' and no 'thn', and needs 'when' and 'then'; "
            "'wen': did you mean 'when'?; 'thn': did you mean 'then'",
        ),
        (
            "pattern: existence, args: {what: Drive, times: 2}",
            "existence takes no 'times'; known arguments: what, within, for, before, after, until",
        ),
    ],
)
def test_wrong_arguments_are_named_with_those_that_were_meant(written: str, said: str) -> None:
    with pytest.raises(RequirementsError) as caught:
        spec(f"requirements: [{{id: a, {written}}}]\n")
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ("ltl: '[] true', monitor: false", "not monitored for it (monitor is false)"),
        (
            "pattern: bound_delay, args: {when: active(Drive), then: ended}",
            "not monitored for single steps",
        ),
    ],
)
def test_what_runs_are_not_monitored_for_throws_nothing(entry: str, message: str) -> None:
    with pytest.raises(RequirementsError) as raised:
        spec(f"requirements: [{{id: safe, {entry}, on_violation: 'error:UNSAFE'}}]")
    (found,) = raised.value.findings
    assert message in found.message
    assert found.element == "requirements[0].on_violation"
    assert spec(f"requirements: [{{id: safe, {entry}}}]")
