"""Spin and the built-in search see the same, and say the same."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from random import Random
from typing import Any

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from m2pem.bpmn import read_mission
from m2pem.fleet.default_fleet import fleet_for
from m2pem.fleet.fleet import Fleet
from m2pem.mission.mission import Mission
from m2pem.verify.assumptions import NO_FAILURES
from m2pem.verify.check import check
from m2pem.verify.ltl import Formula, propositions
from m2pem.verify.ltl.formula import (
    Active,
    Always,
    Completed,
    Eventually,
    Historically,
    Once,
    Since,
    Until,
    WeakUntil,
    needs_steps,
    rebuilt,
    walk,
)
from m2pem.verify.ltl.model_check import Result
from m2pem.verify.ltl.model_check import check as check_formula
from m2pem.verify.net.encoding import Marking
from m2pem.verify.net.petri_net import Flag, PetriNet
from m2pem.verify.net.simplify import simplify
from m2pem.verify.properties import ALL
from m2pem.verify.properties.commands import watch_interruptions
from m2pem.verify.properties.results import Verdict
from m2pem.verify.requirements import Names, parse_spec
from m2pem.verify.requirements.check import check_requirement, conditions
from m2pem.verify.requirements.propositions import ExploredRuns, Labels
from m2pem.verify.requirements.requirement import Requirement
from m2pem.verify.search.explore import Exploration, Limits, Stopped, explore
from m2pem.verify.spin import ltl_claims
from m2pem.verify.spin.check import check_with_spin
from m2pem.verify.spin.queries import QueryResult, SpinQueries
from m2pem.verify.spin.search import SpinExploration, WantedRuns, search
from m2pem.verify.spin.trail import replay
from m2pem.verify.translate import Options, translate
from tests.engine.notation import mission as notation
from tests.engine.random_missions import graph, structured
from tests.seeds import examples, named, seeds_for
from tests.verify import formulas
from tests.verify.missions import approval, pair
from tests.verify.random_needs import OPEN, branches_with_needs, fleet_of, net_of
from tests.verify.random_nets import random_net
from tests.verify.test_properties import (
    JOIN_FED_BY_ONE,
    ROUND,
    TWO_ON_ONE,
    UNHANDLED,
    UNJOINED,
    UNSENT,
)

ROOT = Path(__file__).parents[2]
MISSIONS = sorted([*ROOT.glob("missions/*.bpmn"), *ROOT.glob("examples/**/*.bpmn")])
SHORT = {"vignette1.bpmn", "survey_pair.bpmn", "team_column.bpmn"}
BROKEN = (JOIN_FED_BY_ONE, TWO_ON_ONE, UNJOINED, UNSENT, UNHANDLED, ROUND)
SMALL = Limits(states=3_000, tokens=3)
FEW = 12
LONG_S = 600.0
MOST_TRANSITIONS = 2_000
MOST_RESETS = 100_000
"""Spin takes half a minute to write the checker of a larger net, for each question: the time grows
with the square of the statements, of which each place that a transition resets is one."""

ODD_MISSIONS, ODD_TRANSITIONS = (
    (18, 27, 234, 251, 356),
    (1, 19, 176, 203, 540, 728866273, 983159541),
)
"""Seeds at which one of the two was wrong once."""


def stuck(found: Exploration) -> list[Marking]:
    ends = found.net.ends
    markings = [found.marking(n) for n in found.terminals]
    return [each for each in markings if not ends & each.tokens.keys()]


def same(net: PetriNet, limits: Limits = SMALL) -> tuple[Exploration, SpinExploration]:
    """What both see of a net without reduction; it must be the same."""
    ours = explore(net, limits)
    assume_small(ours)
    spins = search(net, limits)
    assert spins.states == len(ours.states)
    # Spin counts the initial state, and goes on where nothing can happen any more.
    assert spins.transitions == ours.transitions + len(ours.terminals) + 1
    assert spins.fired == ours.fired.keys()
    assert spins.stopped is ours.stopped
    assert spins.beyond == ours.beyond
    assert spins.overflow_runs.keys() == ours.overflows.keys()
    assert bool(spins.stuck_runs) == bool(stuck(ours))
    for run in spins.stuck_runs:
        assert spins.encoding.marking(replay(spins.encoding, run)[-1]) in stuck(ours)
    for transition, state in ours.flagged.items():
        # Spin's are short in its own steps, of which what comes from outside takes more.
        assert len(spins.transition_runs[transition]) >= len(ours.run_to(state)) + 1
    return ours, spins


def assume_small(found: Exploration) -> None:
    if len(found.states) > SMALL.states:
        pytest.skip("too large to look at whole")


@pytest.mark.parametrize(
    "file",
    [
        pytest.param(
            file,
            marks=() if file.name in SHORT else pytest.mark.long,
            id=str(file.relative_to(ROOT)),
        )
        for file in MISSIONS
    ],
)
def test_the_missions_of_the_repository_have_one_answer(file: Path) -> None:
    one_answer(read_mission(file))


@pytest.mark.parametrize("text", BROKEN)
def test_broken_missions_have_one_answer(text: str) -> None:
    assert one_answer(notation(text)) is Verdict.VIOLATED


def one_answer(
    mission: Mission, fleet: Fleet | None = None, options: Options | None = None
) -> Verdict:
    ours = check(mission, fleet, options=options)
    spins = check_with_spin(mission, fleet, options=options)
    assert spins.states == ours.states
    assert spins.engine == "spin"
    assert len(spins.results) == len(ALL)
    for one, other in zip(ours.results, spins.results, strict=True):
        assert (one.property, one.verdict) == (other.property, other.verdict)
        assert len(one.violations) == len(other.violations), one.property
        assert {each.elements[:1] for each in one.violations} == {
            each.elements[:1] for each in other.violations
        }, one.property
    assert spins.judged(strict=True) is ours.judged(strict=True)
    return ours.verdict


@pytest.mark.parametrize("file", ["vignette1.bpmn", "mehds_vignette_4.bpmn"])
def test_the_transitions_as_derived_have_the_same_states(file: str) -> None:
    ours, _ = same(translate(read_mission(ROOT / "missions" / file)))
    assert len(ours.states) > 30


# --- random ones ----------------------------------------------------------------------------------


def seeds(odd: tuple[int, ...]) -> list[object]:
    """The odd ones and some others, of which most are long."""
    short = {0, *odd}
    return [
        pytest.param(seed, marks=() if seed in short else pytest.mark.long)
        for seed in sorted({*range(FEW), *odd})
    ]


def too_large_for_spin(net: PetriNet) -> bool:
    resets = sum(len(each.reset) for each in net.transitions)
    return len(net.transitions) > MOST_TRANSITIONS or resets > MOST_RESETS


def _random_mission(seed: int) -> PetriNet:
    text = (structured if seed % 2 else graph)(Random(seed))
    return (simplify if seed % 3 else lambda net: net)(translate(notation(text)))


@pytest.mark.parametrize("seed", range(3))
def test_random_missions_with_roles_by_need_have_the_same_states(seed: int) -> None:
    mission = notation(branches_with_needs(Random(seed)))
    net = simplify(net_of(mission)) if seed % 3 else net_of(mission)
    watched = watch_interruptions(net, fleet_of(mission).vehicles)
    same(watched[0] if watched is not None and seed % 2 else net)


@pytest.mark.parametrize("seed", range(2))
def test_missions_with_roles_by_need_have_one_answer(seed: int) -> None:
    mission = notation(branches_with_needs(Random(seed)))
    one_answer(mission, fleet_of(mission), OPEN)


@pytest.mark.parametrize("seed", seeds(ODD_MISSIONS))
def test_random_missions_have_the_same_states(seed: int) -> None:
    same(_random_mission(seed))


@pytest.mark.parametrize("seed", seeds(ODD_TRANSITIONS))
def test_random_transitions_have_the_same_states(seed: int) -> None:
    same(random_net(Random(seed)))


@pytest.mark.long
@pytest.mark.timeout(3_600)
@pytest.mark.parametrize("made", [_random_mission, lambda seed: random_net(Random(seed))])
def test_many_random_ones_have_the_same_states(made) -> None:  # type: ignore[no-untyped-def]
    """All but a few: about one mission of a hundred is too large for Spin, one of thirteen has too
    many states."""
    tried, compared = 0, 0
    for seed in seeds_for(LONG_S):
        tried += 1
        net = made(seed)
        if too_large_for_spin(net) or len(explore(net, SMALL).states) > SMALL.states:
            continue
        with named(seed):
            same(net)
        compared += 1
    assert compared >= tried // 2, f"{tried - compared} of {tried} were left out"


def test_a_mission_for_which_spin_takes_minutes_is_left_out() -> None:
    assert too_large_for_spin(_random_mission(666362223))


def test_no_more_is_asked_when_the_time_is_over(monkeypatch: pytest.MonkeyPatch) -> None:
    made = random_net(Random(13))
    net = replace(
        made,
        transitions=tuple(
            replace(transition, flag=Flag.CONFLICT) for transition in made.transitions
        ),
    )
    assert len(search(net, SMALL).transition_runs) > 1
    asked: list[object] = []
    query = SpinQueries.query

    def counted(self: SpinQueries, *words: Any, **options: Any) -> QueryResult:
        asked.append(words)
        return query(self, *words, **options)

    monkeypatch.setattr(SpinQueries, "query", counted)
    monkeypatch.setattr(SpinQueries, "began_ago", lambda self: 0.0 if len(asked) < 2 else 1e9)
    found = search(net, SMALL, wanted=replace(WantedRuns.of(net), stuck=False))
    assert found.stopped is Stopped.TIME
    assert len(found.transition_runs) <= 1
    assert len(asked) <= 3


# --- requirements ---------------------------------------------------------------------------------


def answers(mission: Mission, required: Sequence[Requirement]) -> list[tuple[Result, Result]]:
    fleet = fleet_for(mission)
    options = Options(assumed=NO_FAILURES, conditions=conditions(required))
    net = translate(mission, fleet, options=options)
    found, spins = explore(net), search(net)
    return [
        (
            check_requirement(found, mission, fleet, each).result,
            ltl_claims.check_requirement(spins, mission, fleet, each).result,
        )
        for each in required
    ]


def required(mission: Mission, *entries: str) -> list[Requirement]:
    names = Names(mission, fleet_for(mission), data={})
    return parse_spec(f"requirements: [{','.join(entries)}]".encode(), "spec.yaml", names)


def test_requirements_have_one_answer() -> None:
    texts = [
        "[](active(Drive) -> once(user.decision == 'go'))",
        "[](active(Drive) -> user.decision == 'stop')",
        "<> ended",
        "[] count(completed(Drive)) <= 2",
        "[](completed(Drive) -> <> active(Ask))",
        "!commanded(rover) W completed(Ask)",
        "active(P) && [](ended -> !active(P))",
        "historically(!active(Drive)) U completed(Ask)",
        "[](completed(Drive) -> (!active(Drive) since completed(Ask)))",
    ]
    entries = [f'{{id: a{n}, ltl: "{text}"}}' for n, text in enumerate(texts)]
    found = answers(approval(), required(approval(), *entries))
    assert [one for one, _ in found] == [other for _, other in found]
    assert {one for one, _ in found} == {Result.HOLDS, Result.VIOLATED}


@pytest.mark.parametrize("again", [True, False])
def test_each_robot_surveys_two_locations_to_both(again: bool) -> None:
    entry = "{id: a, pattern: visits_at_least, args: {resource: each, behavior: area_survey}}"
    two = entry.replace("}}", ", times: 2}}")
    found = answers(pair(again=again), required(pair(again=again), two))
    expected = Result.VIOLATED if again else Result.HOLDS
    assert found == [(expected, expected), (Result.HOLDS, Result.HOLDS)]


def test_an_unfair_run_is_no_violation_where_fairness_is_assumed() -> None:
    entry = "{id: a, pattern: reaches_proper_end, fair: %s}"
    unfair = required(approval(), entry % "false")
    assert answers(approval(), unfair) == [(Result.VIOLATED, Result.VIOLATED)]
    fair = required(approval(), entry % "true")
    assert answers(approval(), fair) == [(Result.HOLDS, Result.UNDECIDED)]
    always = required(approval(), "{id: a, ltl: '[] !commanded(rover)', fair: true}")
    assert answers(approval(), always) == [(Result.VIOLATED, Result.VIOLATED)]


def _on_elements(formula: Formula, names: dict[str, str]) -> Formula:
    if isinstance(formula, Active | Completed):
        return replace(formula, element=names[formula.element])
    return rebuilt(formula, lambda each: _on_elements(each, names))


TEMPORAL = (Always, Eventually, Until, WeakUntil, Once, Historically, Since)


@given(formulas.formulas, st.integers(0, 10_000))
@settings(
    max_examples=examples(6, 25),
    deadline=None,
    suppress_health_check=list(HealthCheck),
    derandomize=True,
)
def test_random_formulas_have_one_answer(formula: Formula, seed: int) -> None:
    assume(not needs_steps(formula))
    # Spin's automaton of a formula grows exponentially with its temporal operators.
    assume(sum(isinstance(each, TEMPORAL) for each in walk(formula)) <= 2)
    dice = Random(seed)
    mission = notation(structured(dice))
    net = simplify(translate(mission))
    assume(not too_large_for_spin(net))
    found = explore(net, SMALL)
    assume(found.complete)
    elements = sorted(net.elements)
    asked = _on_elements(formula, {each: dice.choice(elements) for each in "abc"})
    fleet = fleet_for(mission)
    labels = Labels(net, mission, fleet, propositions(asked))
    ours = check_formula(ExploredRuns(found, labels), asked)
    spins = ltl_claims.check_requirement(
        search(net, SMALL), mission, fleet, Requirement("r", asked, "")
    )
    assert spins.result is ours.result
