from pathlib import Path

import pytest

from m2pem.bpmn import read_mission
from m2pem.fleet.default_fleet import fleet_for
from m2pem.mission.mission import Mission
from m2pem.verify.assumptions import NO_FAILURES
from m2pem.verify.ltl import parse, propositions
from m2pem.verify.ltl.model_check import Result
from m2pem.verify.net.petri_net import Action
from m2pem.verify.requirements import Names, parse_spec
from m2pem.verify.requirements.check import Answer
from m2pem.verify.requirements.propositions import Labels
from m2pem.verify.search.explore import Limits
from m2pem.verify.translate import Options, translate
from tests.engine.notation import mission as notation
from tests.verify.answers import check_mission
from tests.verify.missions import approval, in_a_row, pair, survey, task

HOLDS, VIOLATED, UNDECIDED = Result.HOLDS, Result.VIOLATED, Result.UNDECIDED
CERTAIN = Options(assumed=NO_FAILURES)
TWO_EACH = (
    "{id: a, pattern: visits_at_least, args: {resource: each, behavior: area_survey, times: 2}}"
)


def check(mission: Mission, entry: str, options: Options = CERTAIN, **more: object) -> list[Answer]:
    fleet = fleet_for(mission)
    names = Names(mission, fleet, data=options.data)
    found = parse_spec(f"requirements: [{entry}]".encode(), "spec.yaml", names)
    return check_mission(mission, fleet, found, options=options, **more)  # type: ignore[arg-type]


def ltl(mission: Mission, formula: str, options: Options = CERTAIN) -> Answer:
    return check(mission, f'{{id: a, ltl: "{formula}"}}', options)[0]


def test_each_robot_surveys_at_least_two_locations() -> None:
    assert [each.result for each in check(pair(), TWO_EACH)] == [HOLDS, HOLDS]
    assert [each.result for each in check(pair(again=True), TWO_EACH)] == [VIOLATED, HOLDS]
    revisits = TWO_EACH.replace("2}}", "2, revisits: true}}")
    assert [each.result for each in check(pair(again=True), revisits)] == [HOLDS, HOLDS]


def test_what_fails_breaks_what_must_come() -> None:
    answer = check(pair(), TWO_EACH, Options())[0]
    assert answer.result is VIOLATED
    assert answer.prefix[-1].element in ("North", "South", "East", "West")


@pytest.mark.parametrize(
    ("formula", "result"),
    [
        ("[](active(Drive) -> once(user.decision == 'go'))", HOLDS),
        ("[](active(Drive) -> user.decision == 'go')", HOLDS),
        ("[](active(Drive) -> user.decision == 'stop')", VIOLATED),
        ("<> ended", VIOLATED),
        ("[] count(completed(Drive)) <= 2", VIOLATED),
        ("[](completed(Drive) -> <> active(Ask))", HOLDS),
        ("[](commanded(rover, goto) <-> commanded(rover))", HOLDS),
        ("!commanded(rover) W completed(Ask)", HOLDS),
        ("[] !(active(Ask) && commanded(rover))", HOLDS),
        ("active(P) && [](ended -> !active(P))", HOLDS),
        ("[](completed(P) -> ended(completed))", HOLDS),
        ("(!active(Drive) since active(Ask)) || true", HOLDS),
    ],
)
def test_formulas_are_about_what_the_mission_does(formula: str, result: Result) -> None:
    assert ltl(approval(), formula).result is result


DATA = Path(__file__).parents[1] / "data"


@pytest.mark.parametrize(
    ("file", "formula"),
    [
        ("10.5-events/timer_duration.bpmn", "<> completed(wait)"),
        ("10.3-activities/call_process.bpmn", "[](active(in) -> active(P))"),
        ("10.6-gateways/exclusive_none_true.bpmn", "[](completed(which) -> !ended)"),
    ],
    ids=["a catch event completes", "a called process is active", "a gateway without a way fails"],
)
def test_what_completes_and_is_active_is_what_records_say(file: str, formula: str) -> None:
    assert ltl(read_mission(DATA / file), formula).result is HOLDS


def test_a_catch_event_that_nothing_follows_completes() -> None:
    waits = notation("""<startEvent id="start"/>
    start -> wait
    <intermediateCatchEvent id="wait">timer PT5S</intermediateCatchEvent>""")
    assert ltl(waits, "<> completed(wait)").result is HOLDS


def test_a_broken_requirement_comes_with_the_transitions_of_a_run() -> None:
    answer = ltl(approval(), "[] !completed(Drive)")
    done = [
        transition.element for transition in answer.prefix if transition.element in ("Ask", "Drive")
    ]
    assert done[-1] == "Drive"
    assert answer.run is not None
    assert answer.run.whatever_follows
    answer = ltl(approval(), "<> ended")
    assert {"Ask", "Drive"} <= {transition.element for transition in answer.cycle}


def test_with_fairness_the_operator_says_stop_at_some_time() -> None:
    assert check(approval(), "{id: a, pattern: reaches_proper_end}")[0].result is HOLDS
    unfair = "{id: a, pattern: reaches_proper_end, fair: false}"
    assert check(approval(), unfair)[0].result is VIOLATED
    assert check(approval(), "{id: a, ltl: '<> ended', fair: true}")[0].result is HOLDS


def test_one_answer_is_good_for_one_time() -> None:
    entry = (
        "{id: a, pattern: operator_in_the_loop, args: {ask: Ask, decision: go, before: "
        "active(Drive)}}"
    )
    assert check(approval(), entry)[0].result is HOLDS
    assert check(approval(), entry.replace("go", "stop"))[0].result is VIOLATED


def test_the_next_step_is_the_next_transition() -> None:
    mission = in_a_row(
        task("A", "rover", "goto", target="x"), task("B", "rover", "goto", target="y")
    )
    prompt = "{id: a, pattern: prompt_reaction, args: {when: A, then: %s}}"
    assert check(mission, prompt % "active(B)")[0].result is HOLDS
    assert check(mission, prompt % "commanded(rover)")[0].result is VIOLATED


def test_data_that_the_run_is_started_with_is_known() -> None:
    mission = in_a_row(survey("North", "uav1", "${mission.area}"))
    options = Options(data={"mission.area": "north"}, assumed=NO_FAILURES)
    assert ltl(mission, "[] mission.area == 'north'", options).result is HOLDS
    assert ltl(mission, "[] mission.area == 'south'", options).result is VIOLATED
    answer = ltl(mission, "[] mission.area == 'north'")
    assert answer.result is UNDECIDED
    assert "the value of 'mission.area' is not known from the mission" in answer.why


def test_of_a_search_cut_short_what_is_broken_is_broken_and_the_rest_undecided() -> None:
    formula = '{id: a, ltl: "%s"}'
    nothing = Limits(seconds=0)
    assert check(pair(), formula % "[] ended", limits=nothing)[0].result is VIOLATED
    answer = check(pair(), formula % "[] !ended(failed)", limits=nothing)[0]
    assert answer.result is UNDECIDED
    assert answer.why == "the search stopped at the limit of time"


def test_transitions_that_cannot_change_what_a_formula_asks_are_not_visible() -> None:
    mission = pair()
    fleet = fleet_for(mission)
    net = translate(mission, fleet, options=CERTAIN)
    formula = parse("[](completed(North) -> <> commanded(uav1))")
    visible = Labels(net, mission, fleet, propositions(formula)).visible_transitions()
    completing = {
        transition.element: transition.index in visible
        for transition in net.transitions
        if transition.steps[0].action is Action.COMPLETED
    }
    assert completing["North"]
    assert completing["South"]
    assert not completing["East"]
    assert not completing["West"]
