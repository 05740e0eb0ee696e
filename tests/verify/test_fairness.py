"""Whether a mission ends when nothing that can happen again and again is put off for ever."""

from random import Random

from m2pem.mission.mission import Mission
from m2pem.verify.check import Report, check
from m2pem.verify.ltl import propositions
from m2pem.verify.ltl.model_check import Result as Answer
from m2pem.verify.ltl.model_check import check as check_formula
from m2pem.verify.ltl.parser import parse
from m2pem.verify.net.petri_net import PetriNet, outcomes_of
from m2pem.verify.net.simplify import simplify
from m2pem.verify.properties import SearchedMission
from m2pem.verify.properties.results import Result, Verdict
from m2pem.verify.properties.soundness import IN_EACH_STATE, can_complete, completes_if_fair
from m2pem.verify.requirements.propositions import ExploredRuns, Labels
from m2pem.verify.search.explore import Exploration, Limits, explore
from m2pem.verify.search.fairness import FairCycles
from m2pem.verify.search.stubborn_sets import StubbornSets
from m2pem.verify.translate import translate
from tests.engine.notation import mission
from tests.engine.random_missions import graph, structured
from tests.verify.missions import approval
from tests.verify.random_nets import random_net

AGREE = """
<startEvent id="s"/><exclusiveGateway id="m"/>
<userTask id="first" m2pem:store="one">ask left right</userTask>
<userTask id="second" m2pem:store="other">ask left right</userTask>
<exclusiveGateway id="x" default="again"/><endEvent id="e"/>
s -> m -> first -> second -> x
x -> e if one == other
again: x -> m
"""
"""Two operators are asked until they agree: each may give both answers for ever, and never both
the same one."""

ASKED_AGAIN = """
<startEvent id="s"/><exclusiveGateway id="m"/><userTask id="ask">ask on stop</userTask>
<exclusiveGateway id="x" default="again"/><endEvent id="e"/>
s -> m -> ask -> x
x -> e if user.decision == 'stop'
again: x -> m
"""

ONCE = """
<startEvent id="s"/><userTask id="ask">ask on stop</userTask><endEvent id="e"/>
s -> ask -> e
"""


def of(report: Report, name: str) -> Result:
    return next(each for each in report.results if each.property == name)


def searched(text: Mission, found: Exploration) -> SearchedMission:
    return SearchedMission(text, found.net, found)


def assert_fair_lasso(found: Exploration, result: Result) -> None:
    """Its round comes back to where it began, reaches no end, and puts nothing off."""
    net, encoding = found.net, found.encoding
    number = {state: n for n, state in enumerate(found.states)}
    outcomes = outcomes_of(net)
    state = encoding.initial
    (violation,) = result.violations
    for transition in violation.run:
        assert transition in [r for r, _ in found.successors(number[state])]
        state, _ = encoding.fire(transition, state)
    begin, possible, passed = state, set(), set()
    for transition in violation.cycle:
        steps = dict(found.successors(number[state]))
        possible |= {o for r in steps if not net.transitions[r].flag for o in outcomes[r]}
        passed |= set(outcomes[transition])
        state = found.states[steps[transition]]
    assert violation.cycle
    assert state == begin
    assert possible <= passed


def test_answers_that_never_agree_are_fair_and_go_on_for_ever() -> None:
    text = mission(AGREE)
    report = check(text)
    assert of(report, "can-complete").verdict is Verdict.HOLDS
    result = of(report, "completes-if-fair")
    assert result.verdict is Verdict.VIOLATED
    assert set(result.violations[0].elements) >= {"first", "second"}
    assert_fair_lasso(report.found, result)


def test_an_answer_that_can_come_again_and_again_comes_at_last() -> None:
    for text in (mission(ASKED_AGAIN), approval()):
        report = check(text)
        assert of(report, "completes-if-fair").verdict is Verdict.HOLDS
        assert of(report, "completes-if-fair").covered == ""


def test_a_round_without_a_way_out_is_fair() -> None:
    text = mission(ASKED_AGAIN.replace("'stop'", "'nonsense'"))
    report = check(text)
    result = of(report, "completes-if-fair")
    assert result.verdict is Verdict.VIOLATED
    assert_fair_lasso(report.found, result)


def test_a_run_that_is_stuck_does_not_end() -> None:
    text = mission(
        '<startEvent id="s"/><exclusiveGateway id="x"/><task id="a"/><task id="b"/>'
        '<parallelGateway id="j"/><endEvent id="e"/>\n'
        "s -> x\nx -> a\nx -> b\na -> j\nb -> j\nj -> e\n"
    )
    result = of(check(text), "completes-if-fair")
    assert result.verdict is Verdict.VIOLATED
    assert "stuck at j" in result.violations[0].message
    assert not result.violations[0].cycle


def systems(count: int) -> list[PetriNet]:
    return [random_net(Random(seed)) for seed in range(count)]


def test_the_rounds_found_are_those_that_break_a_fair_requirement_to_end() -> None:
    ends = parse("<> ended")
    verdicts = []
    for net in systems(300):
        found = explore(net, Limits(states=2_000, tokens=3))
        if not found.complete:
            continue
        labels = Labels(net, mission(ASKED_AGAIN), None, propositions(ends))
        runs = ExploredRuns(found, labels)
        answer = check_formula(runs, ends, fair=runs.outcomes())
        stuck = any(not found.net.ends & found.marking(n).tokens.keys() for n in found.terminals)
        fair = FairCycles(found, lambda _: False).nearest() is not None
        assert (answer.result is Answer.VIOLATED) is (stuck or fair)
        verdicts.append((stuck, fair))
    assert {(False, False), (False, True), (True, False)} <= set(verdicts)


def test_what_always_ends_if_fair_can_end_from_everywhere() -> None:
    compared = rounds = 0
    for seed in range(40):
        text = mission((structured if seed % 2 else graph)(Random(seed)))
        limits = Limits(states=2_000, tokens=3)
        whole, small = (explore(s, limits) for s in (translate(text), simplify(translate(text))))
        if not whole.complete or not small.complete:
            continue
        compared += 1
        fair, of_small = (completes_if_fair(searched(text, each)) for each in (whole, small))
        if can_complete(searched(text, small)).verdict is Verdict.VIOLATED:
            assert of_small.verdict is Verdict.VIOLATED
        assert fair.verdict is of_small.verdict
        if of_small.verdict is Verdict.VIOLATED and of_small.violations[0].cycle:
            rounds += 1
            assert_fair_lasso(small, of_small)
    assert compared > 10, (compared, rounds)


def test_of_a_search_that_left_orders_out_it_says_in_what_sense_it_ends() -> None:
    for text, note in ((ASKED_AGAIN, IN_EACH_STATE), (AGREE, IN_EACH_STATE), (ONCE, "")):
        net = simplify(translate(mission(text)))
        found = explore(net, reduction=StubbornSets(net))
        result = completes_if_fair(searched(mission(text), found))
        assert result.verdict is Verdict.HOLDS
        assert result.covered == note
