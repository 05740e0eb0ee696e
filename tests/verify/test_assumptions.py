"""Assumptions leave out runs, and nothing else; both engines answer alike under them."""

from collections import deque
from collections.abc import Callable
from dataclasses import replace
from random import Random

import pytest

from m2pem.fleet.allocation import AllocationError, allocate
from m2pem.fleet.default_fleet import fleet_for
from m2pem.fleet.fleet import Fleet
from m2pem.mission import elements as e
from m2pem.mission.mission import Mission
from m2pem.verify.assumptions import (
    NO_FAILURES,
    NOTHING,
    AssumptionError,
    Assumptions,
    parse,
    refuse_unknown,
)
from m2pem.verify.net.petri_net import Transition, Trigger
from m2pem.verify.search.explore import Exploration, Limits, explore
from m2pem.verify.translate import Options, translate
from m2pem.verify.translate.context import behavior_of
from tests.engine.notation import mission as notation
from tests.engine.random_missions import graph, structured
from tests.verify import random_space
from tests.verify.missions import pair
from tests.verify.random_needs import OPEN, branches_with_needs, fleet_of
from tests.verify.test_spin_agreement import one_answer, same

FEW = Limits(states=2_500, tokens=3)
MANY = replace(FEW, states=6 * FEW.states)
"""Of the same missions, where failures are counted up to four."""
MOST_TRANSITIONS = 600
"""Of the random missions that Spin checks too: see `test_spin_agreement`."""

# --- texts ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "found", "english"),
    [
        ("no-failures", NO_FAILURES, "no behavior fails"),
        ("failures <= 0", NO_FAILURES, "no behavior fails"),
        ("failures<=1", Assumptions(failures=1), "behaviors fail once at most"),
        ("failures ≤ 3", Assumptions(failures=3), "behaviors fail 3 times at most"),
        (
            "reliable(uav2, uav1)",
            Assumptions(reliable=frozenset({"uav1", "uav2"})),
            "uav1 and uav2 do not fail",
        ),
        (
            "operators-answer, messages-within 2 min",
            Assumptions(operators_answer=True, messages_within_us=120_000_000),
            "operators answer in time and awaited signals and messages come within 120 s",
        ),
        (
            "failures <= 2, reliable(a), failures <= 1, reliable(b)",
            Assumptions(failures=1, reliable=frozenset({"a", "b"})),
            "behaviors fail once at most and a and b do not fail",
        ),
    ],
)
def test_a_text_says_what_is_assumed(text: str, found: Assumptions, english: str) -> None:
    assert parse(text) == found
    assert parse(str(found)) == found
    assert parse([text, str(found)]) == found
    assert found.english == english


def test_nothing_is_assumed_where_nothing_is_written() -> None:
    assert parse([]) == NOTHING
    assert not NOTHING
    assert str(NOTHING) == NOTHING.english == ""


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "nothing is written"),
        ("no-failures,", "between two commas"),
        ("no-failure", "did you mean 'no-failures'?"),
        ("failures < 2", "'failures < 2' is no assumption"),
        ("failures <= many", "'many' is no whole number from 0 to 100"),
        ("failures <= 1000", "no whole number from 0 to 100"),
        ("reliable()", "names no vehicle"),
        ("reliable(uav1", "is no assumption"),
        ("messages-within soon", "messages-within soon"),
        ("messages-within 3 m", "messages-within 30 s"),
        ("messages-within -3 s", "no time is negative"),
        ("operators", "did you mean 'operators-answer'?"),
    ],
)
def test_what_is_no_assumption_is_refused_with_what_would_be_right(text: str, said: str) -> None:
    with pytest.raises(AssumptionError) as raised:
        parse(text)
    assert said in str(raised.value)


def test_a_name_that_the_fleet_lacks_is_refused() -> None:
    fleet = fleet_for(pair())
    refuse_unknown(parse("reliable(uav1)"), fleet)
    with pytest.raises(AssumptionError, match=r"no vehicle, payload or team 'uav3'.*'uav1'"):
        refuse_unknown(parse("reliable(uav3)"), fleet)


def test_a_vehicle_includes_its_payloads_and_a_team_its_members() -> None:
    lines = (
        '<startEvent id="s"/>',
        '<scriptTask id="t">do look evsg1/ptz team:alpha</scriptTask>',
        "s -> t",
    )
    fleet = fleet_for(notation("\n".join(lines)))
    assert parse("reliable(evsg1)").resources(fleet) == {"evsg1", "evsg1/ptz"}
    members = {*fleet.teams["alpha"].members}
    assert members <= parse("reliable(alpha)").resources(fleet)


# --- the runs that are left -----------------------------------------------------------------------

State = frozenset[tuple[str, int]]


def states_of(found: Exploration) -> list[State]:
    """The states of an exploration, by the names of places and variables; without the place that
    counts failures."""
    net = found.net

    def named(number: int) -> State:
        marking = found.marking(number)
        tokens = {
            (net.places[p].name, n)
            for p, n in marking.tokens.items()
            if net.places[p].name != "failures~left"
        }
        return frozenset(tokens | {(net.variables[v].name, n) for v, n in marking.values.items()})

    return [named(n) for n in range(len(found.states))]


Allowed = Callable[[Exploration, int, Transition], bool]


def left(found: Exploration, allowed: Allowed, most: int | None = None) -> set[State]:
    """The states of a full net that are reached by transitions that an assumption allows; those
    that it does not allow fire `most` times at most."""
    assert found.edge_start is not None
    assert found.edge_transition is not None
    assert found.edge_state is not None
    names = states_of(found)
    seen = {(0, 0)}
    waiting = deque(seen)
    while waiting:
        state, count = waiting.popleft()
        for at in range(found.edge_start[state], found.edge_start[state + 1]):
            transition = found.net.transitions[found.edge_transition[at]]
            more = 0 if allowed(found, state, transition) else 1
            after = (found.edge_state[at], count + more)
            if count + more <= (most or 0) and after not in seen:
                seen.add(after)
                waiting.append(after)
    return {names[state] for state, _ in seen}


def not_failing(found: Exploration, state: int, transition: Transition) -> bool:
    return transition.trigger is not Trigger.FAILS


def of_unreliable(mission: Mission, fleet: Fleet, reliable: frozenset[str]) -> Allowed:
    """Failures of tasks that have something that may fail, by what they hold in that state."""

    def allowed(found: Exploration, state: int, transition: Transition) -> bool:
        if transition.trigger is not Trigger.FAILS:
            return True
        node = mission.elements[transition.element]
        assert isinstance(node, e.FlowNode)
        behavior = behavior_of(node)
        if behavior is None or not behavior.roles:
            return True
        places, tokens = found.net.places, found.marking(state).tokens
        taken = {p for p, _ in transition.consume} | {*transition.read}
        held = {
            each
            for p in tokens
            if places[p].holder in taken
            for each in places[p].resources or places[places[p].returns[0]].free
        }
        if not held:
            try:
                held = {*allocate(behavior, fleet).resources}
            except AllocationError:
                return True
        return not held <= reliable

    return allowed


def without_timers_of_prompts(mission: Mission) -> Allowed:
    asking = {node.id for node in mission.nodes if isinstance(node, e.UserTask)}
    asking |= {
        node.id
        for node in mission.nodes
        if isinstance(node, e.BoundaryEvent) and isinstance(node.attached_to, e.UserTask)
    }

    def allowed(found: Exploration, state: int, transition: Transition) -> bool:
        return transition.trigger is not Trigger.TIMER or transition.element not in asking

    return allowed


def agree(mission: Mission, fleet: Fleet, options: Options, text: str) -> bool:
    """Whether the restricted net has just the states that the full net has without what the
    assumption excludes; False: the mission is too large to be looked at whole."""
    assumed = parse(text)
    reliable = assumed.resources(fleet)
    options = replace(options, distinguished=reliable)
    full = explore(translate(mission, fleet, options=options), FEW)
    if not full.complete:
        return False
    found = explore(translate(mission, fleet, options=replace(options, assumed=assumed)), MANY)
    if assumed.failures is not None:
        expected = left(full, not_failing, assumed.failures)
    elif assumed.reliable:
        expected = left(full, of_unreliable(mission, fleet, reliable))
    else:
        expected = left(full, without_timers_of_prompts(mission))
    assert found.complete
    assert set(states_of(found)) == expected
    return True


TEXTS = ("no-failures", "failures <= 1", "failures <= 4", "reliable(uav1)", "operators-answer")


@pytest.mark.parametrize("text", TEXTS)
def test_the_runs_left_of_random_missions_are_those_without_what_is_excluded(text: str) -> None:
    looked_at = 0
    for seed in range(40):
        dice = Random(seed)
        mission = notation(dice.choice((structured, graph))(dice))
        fleet = fleet_for(mission)
        if "uav1" not in text or "uav1" in fleet.vehicles:
            looked_at += agree(mission, fleet, Options(open_world=True), text)
    assert looked_at >= 5


@pytest.mark.parametrize("text", ["failures <= 1", "reliable(uav1)", "reliable(uav1, uav4)"])
def test_so_are_those_of_missions_whose_tasks_choose_their_vehicles(text: str) -> None:
    looked_at = 0
    for seed in range(25):
        mission = notation(branches_with_needs(Random(seed)))
        looked_at += agree(mission, fleet_of(mission), OPEN, text)
    assert looked_at >= 5


def stuck(found: Exploration) -> set[State]:
    names = states_of(found)
    ends = {found.net.places[p].name for p in found.net.ends}
    return {names[n] for n in found.terminals if not any(name in ends for name, _ in names[n])}


@pytest.mark.parametrize("text", [*TEXTS, "reliable(ugv1, ugv2)", "messages-within 1 s"])
def test_an_assumption_makes_no_deadlock(text: str) -> None:
    """Also where a behavior was refused a shared space, and can only fail."""
    looked_at = 0
    for seed in range(30):
        dice = Random(seed)
        if seed % 2:
            mission = notation(dice.choice((structured, graph))(dice))
            fleet, options = fleet_for(mission), Options(open_world=True)
        else:
            fleet = random_space.random_fleet(dice)
            mission = notation(random_space.random_mission(dice))
            options = random_space.options_of(fleet)
        assumed = parse(text)
        if not assumed.reliable <= {*fleet.vehicles}:
            continue
        options = replace(options, distinguished=assumed.resources(fleet))
        full = explore(translate(mission, fleet, options=options), FEW)
        net = translate(mission, fleet, options=replace(options, assumed=assumed))
        found = explore(net, MANY)
        if full.complete and found.complete:
            assert stuck(found) <= stuck(full)
            looked_at += 1
    assert looked_at >= 2


# --- timers while a message is awaited ------------------------------------------------------------


def timer_fires(text: str, timer: str, assumed: str) -> bool:
    """Whether a timer fires in any run, where all messages and signals come from outside."""
    options = Options(open_world=True, assumed=parse(assumed) if assumed else NOTHING)
    net = translate(notation(text), options=options)
    fired = explore(net).fired
    return any(
        net.transitions[n].trigger is Trigger.TIMER and net.transitions[n].element == timer
        for n in fired
    )


GATEWAY = """
    <startEvent id="s"/><eventBasedGateway id="g"/><endEvent id="e"/>
    <intermediateCatchEvent id="come">{what}</intermediateCatchEvent>
    <intermediateCatchEvent id="late">timer PT60S</intermediateCatchEvent>
    s -> g -> come -> e
    g -> late -> e
"""
RECEIVE = """
    <startEvent id="s"/><endEvent id="e"/><endEvent id="f"/>
    <receiveTask id="t" messageRef="M"/>
    <boundaryEvent id="late" attachedToRef="t">timer PT60S</boundaryEvent>
    <boundaryEvent id="other" attachedToRef="t">message M</boundaryEvent>
    s -> t -> e
    late -> f
    other -> f
"""
BEHAVIOR = """
    <startEvent id="s"/><endEvent id="e"/><endEvent id="f"/>
    <scriptTask id="t">do goto uav1 target=a</scriptTask>
    <boundaryEvent id="late" attachedToRef="t">timer PT60S</boundaryEvent>
    <boundaryEvent id="abort" attachedToRef="t">signal S</boundaryEvent>
    s -> t -> e
    late -> f
    abort -> f
"""
LOOP = RECEIVE.replace('messageRef="M"/>', 'messageRef="M"><each>3</each></receiveTask>')


@pytest.mark.parametrize(
    ("text", "assumed", "fires"),
    [
        (GATEWAY.format(what="message M"), "", True),
        (GATEWAY.format(what="message M"), "messages-within 30 s", False),
        (GATEWAY.format(what="signal S"), "messages-within 30 s", False),
        (GATEWAY.format(what="message M"), "messages-within 1 min", True),
        (GATEWAY.format(what="message M"), "operators-answer, no-failures", True),
        (RECEIVE, "messages-within 30 s", False),
        (RECEIVE, "messages-within 90 s", True),
        # The signal may interrupt the behavior; the token does not wait for it.
        (BEHAVIOR, "messages-within 30 s", True),
        # Three messages, each in time, may take longer than the timer of all.
        (LOOP, "messages-within 30 s", True),
    ],
)
def test_a_longer_timer_does_not_fire_before_the_message_that_a_token_waits_for(
    text: str, assumed: str, fires: bool
) -> None:
    assert timer_fires(text, "late", assumed) is fires


INSIDE = """
    <startEvent id="s"/><endEvent id="e"/><endEvent id="f"/>
    <subProcess id="both"><startEvent id="i"/><endEvent id="o"/><endEvent id="r"/>
    <userTask id="t">ask go stop</userTask>
    <boundaryEvent id="remind" attachedToRef="t" cancelActivity="false">timer PT5S</boundaryEvent>
    i -> t -> o
    remind -> r
    </subProcess>
    <boundaryEvent id="late" attachedToRef="both">timer PT60S</boundaryEvent>
    s -> both -> e
    late -> f
"""


def test_operators_answer_before_the_timers_of_their_task_alone() -> None:
    assert timer_fires(INSIDE, "remind", "")
    assert not timer_fires(INSIDE, "remind", "operators-answer")
    assert timer_fires(INSIDE, "late", "operators-answer")


# --- two engines ----------------------------------------------------------------------------------


@pytest.mark.parametrize("text", ["failures <= 1", "failures <= 3, reliable(uav1)"])
def test_both_engines_see_the_same_states_under_an_assumption(text: str) -> None:
    looked_at = 0
    for seed in range(12):
        dice = Random(1_000 + seed)
        mission = notation(branches_with_needs(dice) if seed % 2 else structured(dice))
        fleet = fleet_of(mission)
        net = translate(mission, fleet, options=replace(OPEN, assumed=parse(text)))
        if len(net.transitions) <= MOST_TRANSITIONS and explore(net, FEW).complete:
            same(net, FEW)
            looked_at += 1
    assert looked_at >= 4


@pytest.mark.parametrize("text", ["no-failures", "failures <= 2", "reliable(uav1)"])
def test_both_engines_answer_alike_under_an_assumption(text: str) -> None:
    one_answer(pair(), options=Options(assumed=parse(text)))
