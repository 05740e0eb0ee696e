"""The robotic mission patterns on pairs of missions: one keeps to the pattern, one does not.

Both are asked where no behavior fails, and where any may; both engines answer.
"""

import pytest

from m2pem.fleet.default_fleet import fleet_for
from m2pem.mission.mission import Mission
from m2pem.verify.assumptions import NO_FAILURES, NOTHING, Assumptions
from m2pem.verify.ltl.model_check import Result
from m2pem.verify.requirements import Names, parse_spec
from m2pem.verify.requirements.check import check_requirement, net_for
from m2pem.verify.requirements.patterns import PATTERNS
from m2pem.verify.requirements.patterns.robotic import AVOIDANCE, REACTIONS, VISITS
from m2pem.verify.requirements.requirement import Requirement
from m2pem.verify.search.explore import explore
from m2pem.verify.spin import ltl_claims
from m2pem.verify.spin.search import search
from m2pem.verify.translate import Options
from tests.engine.notation import mission as notation

A = "completed(A) || completed(A2)"
B = "completed(B) || completed(B2)"


def task(name: str, vehicle: str = "uav1") -> str:
    return f'<scriptTask id="{name}">do goto {vehicle} target={name.lower()}</scriptTask>'


def row(*names: str, **vehicles: str) -> str:
    """The tasks one after the other. `vehicles`: that of a task, uav1 otherwise."""
    tasks = "".join(task(each, vehicles.get(each, "uav1")) for each in names)
    chain = " -> ".join(("s", *names, "e"))
    return f'<startEvent id="s"/>{tasks}<endEvent id="e"/>\n{chain}'


def round_of(*names: str, first: tuple[str, ...] = ()) -> str:
    """The tasks one after the other for ever, after those of `first`."""
    tasks = "".join(map(task, (*first, *names)))
    chain = " -> ".join(("s", *first, "x", *names, "x"))
    return f'<startEvent id="s"/><exclusiveGateway id="x"/>{tasks}\n{chain}'


def fork(*names: str) -> str:
    """The tasks at once, each by another vehicle."""
    tasks = "".join(task(each, f"uav{n}") for n, each in enumerate(names))
    flows = "\n".join(f"f -> {each} -> j" for each in names)
    gateways = '<parallelGateway id="f"/><parallelGateway id="j"/>'
    return f'<startEvent id="s"/>{gateways}{tasks}<endEvent id="e"/>\ns -> f\n{flows}\nj -> e'


def choice(*names: str) -> str:
    """One of the tasks, as an operator decides; "-": none."""
    tasks = "".join(task(each) for each in names if each != "-")
    asks = f'<userTask id="q">ask {" ".join(f"d{n}" for n in range(len(names)))}</userTask>'
    gateways = '<exclusiveGateway id="x"/><exclusiveGateway id="m"/>'
    flows = "\n".join(
        f"x -> {each} if user.decision == 'd{n}'\n{each} -> m"
        if each != "-"
        else f"x -> m if user.decision == 'd{n}'"
        for n, each in enumerate(names)
    )
    ends = '<startEvent id="s"/><endEvent id="e"/>'
    return f"{ends}{asks}{gateways}{tasks}\ns -> q -> x\nm -> e\n{flows}"


def noted_after(*names: str) -> str:
    """The tasks one after the other, then one that completes as soon as it is activated."""
    tasks = "".join(map(task, names))
    chain = " -> ".join(("s", *names, "T", "e"))
    return f'<startEvent id="s"/>{tasks}<task id="T"/><endEvent id="e"/>\n{chain}'


AB, BA = row("A", "B"), row("B", "A")
OWN = row("A", "B", B="uav2")
"""uav1 does A, and uav2 does B."""

PAIRS: dict[str, tuple[str, str, str, bool]] = {
    "visit": ("locations: [A, B]", fork("A", "B"), choice("A", "B"), True),
    "sequenced_visit": ("locations: [A, B]", AB, BA, True),
    "ordered_visit": ("locations: [A, B]", AB, BA, True),
    "strict_ordered_visit": (
        f"locations: ['{A}', B]",
        row("A", "B", "A2"),
        row("A", "A2", "B"),
        True,
    ),
    "fair_visit": (f"locations: ['{A}', B]", row("A", "B", "A2"), row("A", "A2", "B"), True),
    "patrolling": ("locations: [A, B]", round_of("A", "B"), round_of("A", first=("B",)), True),
    "sequenced_patrolling": ("locations: [A, B]", round_of("A", "B"), AB, True),
    "ordered_patrolling": ("locations: [A, B]", round_of("A", "B"), round_of("B", "A"), True),
    "strict_ordered_patrolling": (
        f"locations: ['{A}', '{B}']",
        round_of("A", "B", "A2", "B2"),
        round_of("A", "A2", "B", "B2"),
        True,
    ),
    "fair_patrolling": (
        f"locations: ['{A}', '{B}']",
        round_of("A", "B", "A2", "B2"),
        round_of("A", "A2", "B", "B2"),
        True,
    ),
    "past_avoidance": ("avoid: A, until: B", BA, AB, True),
    "global_avoidance": ("avoid: active(A) && active(B)", AB, fork("A", "B"), False),
    "future_avoidance": ("avoid: A, when: B", AB, BA, False),
    "upper_restricted_avoidance": (
        f"avoid: '{A}', times: 1",
        choice("A", "A2"),
        row("A", "A2"),
        False,
    ),
    "lower_restricted_avoidance": (
        f"avoid: '{A}', times: 2",
        row("A", "A2"),
        choice("A", "A2"),
        True,
    ),
    "exact_restricted_avoidance": (
        f"avoid: '{A}', times: 1",
        choice("A", "A2"),
        row("A", "A2"),
        True,
    ),
    "instantaneous_reaction": ("when: commanded(uav1), then: active(A)", OWN, AB, False),
    "delayed_reaction": ("when: A, then: B", AB, BA, True),
    "prompt_reaction": ("when: A, then: active(B)", AB, row("A", "C", "B"), False),
    "bound_reaction": (
        "when: commanded(uav1), then: commanded(uav1) && active(A)",
        OWN,
        AB,
        False,
    ),
    "bound_delay": ("when: A, then: T", noted_after("A"), noted_after("A", "C"), False),
    "wait": ("hold: '!active(B)', until: A", AB, BA, True),
}
"""By pattern: its arguments, a mission that keeps to it and one that does not, and whether the
first one does so only if no behavior fails."""


def test_each_robotic_pattern_has_a_pair_of_missions() -> None:
    assert [*PAIRS] == [each.name for each in (*VISITS, *AVOIDANCE, *REACTIONS)]
    assert len(PAIRS) == 22


def both_engines(mission: Mission, written: Requirement, assumed: Assumptions) -> Result:
    fleet = fleet_for(mission)
    net = net_for(mission, fleet, [written], options=Options(assumed=assumed))
    answer = check_requirement(explore(net), mission, fleet, written).result
    spins = ltl_claims.check_requirement(search(net), mission, fleet, written)
    if spins.why in ltl_claims.BEYOND_SPIN:
        assert PATTERNS[written.pattern].steps
    else:
        assert spins.result is answer
    return answer


@pytest.mark.parametrize(("pattern", "case"), PAIRS.items())
def test_one_mission_keeps_to_the_pattern_and_the_other_does_not(
    pattern: str, case: tuple[str, str, str, bool]
) -> None:
    arguments, good, bad, if_nothing_fails = case
    for text, keeps in ((good, True), (bad, False)):
        mission = notation(text)
        entry = f"requirements: [{{id: r, pattern: {pattern}, args: {{{arguments}}}}}]"
        names = Names(mission, fleet_for(mission))
        (written,) = parse_spec(entry.encode(), "spec.yaml", names)
        expected = Result.HOLDS if keeps else Result.VIOLATED
        assert both_engines(mission, written, NO_FAILURES) is expected
        if keeps and if_nothing_fails:
            expected = Result.VIOLATED
        assert both_engines(mission, written, NOTHING) is expected
