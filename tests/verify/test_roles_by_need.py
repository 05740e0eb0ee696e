"""Roles by need: the net follows every choice, refusal and wait of a mission."""

from collections.abc import Sequence
from dataclasses import replace
from random import Random
from typing import Any

import pytest

from m2pem.engine.records import RunOutcome
from m2pem.fleet.check import check_mission
from m2pem.fleet.default_fleet import fleet_for
from m2pem.fleet.fleet import Fleet, SharedSpace
from m2pem.mission.mission import Mission
from m2pem.verify.check import Report, check
from m2pem.verify.conformance_run import ConformanceRun
from m2pem.verify.ltl.model_check import Result as Answered
from m2pem.verify.net.choices import in_words, read
from m2pem.verify.net.petri_net import Action, Exactness, Flag, PetriNet, Step, Trigger
from m2pem.verify.net.simplify import simplify
from m2pem.verify.properties.results import Verdict
from m2pem.verify.report.data import as_data
from m2pem.verify.report.findings import findings_of
from m2pem.verify.requirements import Names, parse_spec
from m2pem.verify.requirements.check import check_requirement, net_for
from m2pem.verify.search.explore import Exploration, Limits, explore
from m2pem.verify.translate import Options, translate
from tests.engine.notation import mission as notation
from tests.engine.random_missions import structured
from tests.verify.allocator import Allocator, offers_all, with_vehicles
from tests.verify.models import Walk
from tests.verify.random_needs import NEEDS, OPEN, branches_with_needs, fleet_of, net_of
from tests.verify.trace_mapping import TooManyStatesError

SMALL = Limits(states=3_000, tokens=3)


def walked(mission: Mission, net: PetriNet, seeds: range) -> str:
    fleet = fleet_of(mission)
    for seed in seeds:
        try:
            walk = Walk(mission, fleet, net, seed, Allocator(fleet, Random(seed)))
            lost = walk.go()
        except TooManyStatesError:
            continue
        if lost and not explained(walk, net):
            return f"seed {seed}: {lost}"
    return ""


def explained(walk: Walk, net: PetriNet) -> bool:
    """What docs/verification-internals.md says of where the net stops short of the engine."""
    if any(each.exactness is Exactness.BOUNDED for each in net.approximations):
        return True
    if "EXPRESSION" in walk.run.state.detail:
        return True
    if walk.run.state.detail.startswith("stuck"):
        return any("may become true" in each.what for each in net.approximations)
    return bool(explore(simplify(net), Limits(states=20_000, tokens=3)).overflows)


# --- what may be chosen ---------------------------------------------------------------------------

AIR = "need:requires=vehicle.domain=='air'"


def fork(*tasks: str, after: str = "") -> str:
    """Parallel branches of one task each: A, B, ...; then perhaps a task Z."""
    names = [chr(ord("A") + number) for number in range(len(tasks))]
    lines = ['<startEvent id="s"/><parallelGateway id="f"/><parallelGateway id="j"/>', "s -> f"]
    lines += [_task(name, text) for name, text in zip(names, tasks, strict=True)]
    lines += [f"f -> {name} -> j" for name in names]
    lines.append('<endEvent id="e"/>')
    return "\n".join([*lines, _task("Z", after), "j -> Z -> e"] if after else [*lines, "j -> e"])


def _task(name: str, roles: str) -> str:
    return f'<scriptTask id="{name}">do drive_stop {roles}</scriptTask>'


def row(*parts: str) -> str:
    """Elements one after the other; each text begins with the id."""
    names = [part.split('id="')[1].split('"')[0] for part in parts]
    ends = '<startEvent id="s"/><endEvent id="e"/>'
    return "\n".join([ends, *parts, " -> ".join(("s", *names, "e"))])


def fleet(mission: Mission, **tags: str) -> Fleet:
    return with_vehicles(fleet_for(mission), **tags)


def report_of(text: str, options: Options = OPEN, **tags: str) -> Report:
    mission = notation(text)
    return check(mission, fleet(mission, **tags), options=options)


def given(net: PetriNet, element: str) -> set[str]:
    """What a task may be given, in words."""
    return {
        in_words(read(step.detail))
        for transition in net.transitions
        for step in transition.steps
        if step.element == element and step.action is Action.ALLOCATED and step.detail
    }


def verdict(report: Report, name: str) -> Verdict:
    return next(each.verdict for each in report.results if each.property == name)


def messages(text: str, report: Report, name: str) -> list[str]:
    found = findings_of(notation(text), report)
    return [each.found.message for each in found.violations if each.answer.property == name]


def test_every_vehicle_that_the_fleet_allows_is_a_choice() -> None:
    text = row(
        _task("A", AIR), _task("B", "uav1"), _task("C", "need:requires='red'in[vehicle.tags[0]]")
    )
    report = report_of(text, uav1="red", uav2="red", uav3="blue")
    assert given(report.net, "A") == {"uav1", "uav2", "uav3"}
    assert given(report.net, "C") == {"uav1", "uav2"}


def test_vehicles_that_nothing_distinguishes_are_one_pool() -> None:
    tags = {f"uav{number}": "red" for number in range(1, 9)}
    counts = []
    for text in (fork(*[AIR] * 4), fork(*[f"{AIR[:-1]}'"] * 4, "uav1")):
        report = report_of(text, **tags)
        counts.append(report.states)
        assert verdict(report, "errors-caught") is Verdict.HOLDS
    few, named = counts
    assert few < 200
    assert given(report_of(fork(AIR), **tags).net, "A") == {
        "one of uav1, uav2, uav3, uav4, uav5, uav6, uav7 and uav8"
    }
    assert few < named < 30 * few


@pytest.mark.parametrize(("vehicles", "held"), [(1, True), (2, True), (3, False)])
def test_a_task_fails_only_if_nothing_is_free(vehicles: int, held: bool) -> None:
    tags = {f"uav{number}": "red" for number in range(1, vehicles + 1)}
    report = report_of(fork(AIR, AIR, AIR), **tags)
    assert (verdict(report, "errors-caught") is Verdict.VIOLATED) is held


def test_a_task_that_waits_does_not_fail() -> None:
    report = report_of(fork(AIR, f"{AIR};wait=unlimited", f"{AIR};wait=unlimited"), uav1="red")
    assert (
        verdict(report, "errors-caught") is Verdict.VIOLATED
    )  # A may come last, and does not wait
    waits = f"{AIR};wait=unlimited"
    report = report_of(fork(waits, waits, waits), uav1="red")
    assert report.judged(strict=False) is Verdict.HOLDS


def test_the_greatest_priority_is_served_first() -> None:
    report = report_of(fork(f"{AIR};priority=1", f"{AIR};wait=unlimited"), uav1="red")
    assert verdict(report, "errors-caught") is Verdict.HOLDS


def test_the_end_of_a_wait_is_a_timer() -> None:
    text = fork(f"{AIR};wait=PT5S", f"{AIR};wait=PT5S")
    report = report_of(text, uav1="red")
    assert "A may fail (RESOURCE_UNAVAILABLE)" in " ".join(
        messages(text, report, "failures-handled")
    )
    timers = [each for each in report.net.transitions if each.trigger is Trigger.TIMER]
    assert {each.due_us for each in timers} == {5_000_000}
    assert all(each.index in report.found.fired for each in timers)
    alone = report_of(fork(f"{AIR};wait=PT5S", f"{AIR};wait=PT5S"), uav1="red", uav2="red")
    assert not any(
        alone.net.transitions[number].trigger is Trigger.TIMER for number in alone.found.fired
    )


def test_a_task_that_names_its_vehicle_excludes_a_choice_of_it_and_the_other_way_round() -> None:
    text = fork("uav1", AIR)
    one = report_of(text, uav1="red")
    assert verdict(one, "errors-caught") is Verdict.VIOLATED  # B finds uav1 held by A
    assert verdict(one, "one-behavior") is Verdict.HOLDS
    report = report_of(LATE, uav1="red", uav2="red")
    assert messages(LATE, report, "one-behavior") == ["B wants uav1 while A commands it"]


LATE = """
<startEvent id="s"/><parallelGateway id="f"/><endEvent id="e"/>
<userTask id="ask">ask on</userTask>
<scriptTask id="A">do drive_stop need:requires=vehicle.domain=='air'</scriptTask>
<scriptTask id="B">do drive_stop uav1</scriptTask>
s -> f -> A -> e
f -> ask -> B -> e
"""


def test_a_wait_for_what_can_never_come_is_a_deadlock_that_names_it() -> None:
    text = row(_task("A", "need:same=scout;wait=unlimited"), _task("B", f"{AIR};store=scout"))
    report = report_of(text, uav1="red", uav2="red")
    assert messages(text, report, "no-deadlock") == [
        "script task A waits for uav1 or uav2, which it cannot get"
    ]


CIRCLE = """
<startEvent id="s"/><parallelGateway id="f"/><parallelGateway id="j"/><endEvent id="e"/>
<exclusiveGateway id="x"/>
<scriptTask id="A">do follow uav1 target=x</scriptTask>
<boundaryEvent id="a" attachedToRef="A">signal done</boundaryEvent>
<scriptTask id="B">do drive_stop need:vehicle=uav1;wait=unlimited</scriptTask>
<intermediateThrowEvent id="t">signal done</intermediateThrowEvent>
s -> f -> A -> x -> j
a -> x
f -> B -> t -> j
j -> e
"""


def test_waiting_in_a_circle_is_found_and_the_answer_names_what_holds_it() -> None:
    options = replace(OPEN, open_world=False)
    report = report_of(CIRCLE, options, uav1="red")
    assert verdict(report, "can-complete") is Verdict.VIOLATED
    (message,) = messages(CIRCLE, report, "can-complete")
    assert message.endswith("; script task B waits for uav1, uav1 is held by script task A")
    ending = CIRCLE.replace("target=x", "target=x duration=5")
    assert verdict(report_of(ending, options, uav1="red"), "can-complete") is Verdict.HOLDS


def test_same_is_the_vehicle_that_was_stored() -> None:
    text = row(_task("A", f"{AIR};store=scout"), _task("B", "need:same=scout"))
    report = report_of(text, uav1="red", uav2="red")
    assert verdict(report, "errors-caught") is Verdict.HOLDS
    runs = [
        chosen_in(report.found, run) for run in map(report.found.run_to, report.found.terminals)
    ]
    assert [each for each in runs if len(each) == 2 and len({*each}) > 1] == []
    assert {each for each in runs if len(each) == 2} <= {("uav1", "uav1"), ("uav2", "uav2")}
    chosen = {in_words(read(step.detail)) for step in fired_choices(report)}
    assert chosen == {"uav1", "uav2"}


def chosen_in(found: Exploration, run: Sequence[int]) -> tuple[str, ...]:
    """What is given in a run, in its order."""
    return tuple(
        in_words(read(step.detail))
        for number in run
        for step in found.net.transitions[number].steps
        if step.action is Action.ALLOCATED
    )


def fired_choices(report: Report) -> list[Step]:
    """The steps in which some run gives something to a task."""
    return [
        step
        for number in report.found.fired
        for step in report.net.transitions[number].steps
        if step.action is Action.ALLOCATED and step.detail
    ]


def test_a_condition_may_read_what_was_stored() -> None:
    text = """
<startEvent id="s"/><exclusiveGateway id="g" default="other"/><endEvent id="e"/><endEvent id="o"/>
<scriptTask id="A">do drive_stop need:requires=vehicle.domain=='air';store=scout</scriptTask>
s -> A -> g
g -> e if scout == 'uav3'
other: g -> o
"""
    assert verdict(report_of(text, uav1="red", uav2="red"), "no-dead-element") is Verdict.VIOLATED
    report = report_of(text, uav1="red", uav2="red", uav3="red")
    assert verdict(report, "no-dead-element") is Verdict.HOLDS


def test_a_team_takes_as_many_as_are_free() -> None:
    team = "need:count=2..3;requires=vehicle.domain=='air'"
    report = report_of(fork(team, "evsg1"), uav1="red", uav2="red", uav3="red")
    all_three, two = "uav1, uav2 and uav3", "2 of uav1, uav2 and uav3"
    assert given(report.net, "A") == {all_three, two}
    assert {in_words(read(step.detail)) for step in fired_choices(report)} == {all_three}
    report = report_of(fork(team, AIR, AIR), uav1="red", uav2="red", uav3="red")
    assert verdict(report, "errors-caught") is Verdict.VIOLATED


def test_without_an_optional_role_a_task_begins_if_nothing_could_fill_it() -> None:
    text = fork(f"evsg1 {AIR}?", f"{AIR};wait=unlimited")
    report = report_of(text, uav1="red")
    assert verdict(report, "errors-caught") is Verdict.HOLDS
    assert given(report.net, "A") == {"evsg1 as role1 and uav1 as role2", "evsg1"}


def test_what_depends_on_telemetry_is_said_to_be_taken_to_hold() -> None:
    net = report_of(row(_task("A", "need:requires=vehicle.battery>0.5")), uav1="red").net
    assert [each.what for each in net.approximations] == [
        "role 'role1': what depends on vehicle.battery is taken to hold"
    ]


# --- interruptions and requirements ---------------------------------------------------------------

INTERRUPTED = """
<startEvent id="s"/><endEvent id="e"/><endEvent id="e2"/>
<scriptTask id="A">do drive_stop need:requires=vehicle.domain=='air'</scriptTask>
<boundaryEvent id="halt" attachedToRef="A">signal stop</boundaryEvent>
s -> A -> e
"""


@pytest.mark.parametrize(
    ("vehicles", "after", "expected"),
    [
        (1, AIR, []),
        (2, AIR, ["one of uav1, uav2 is interrupted by halt and not commanded again"]),
        (2, "uav1", ["uav2 is interrupted by halt and not commanded again"]),
    ],
)
def test_an_interrupted_vehicle_is_commanded_again_or_it_is_a_violation(
    vehicles: int, after: str, expected: list[str]
) -> None:
    text = f"{INTERRUPTED}\n{_task('B', after)}\nhalt -> B -> e2"
    tags = {f"uav{number}": "red" for number in range(1, vehicles + 1)}
    report = report_of(text, **tags)
    found = messages(text, report, "interrupted-commanded-again")
    assert [each.partition(":")[0] for each in found] == expected


@pytest.mark.parametrize(
    ("formula", "answer"),
    [
        ("[](commanded(uav1) -> active(A))", Answered.VIOLATED),
        ("[](commanded(uav1) -> active(A) || active(B))", Answered.HOLDS),
        ("[] !(commanded(uav1) && commanded(uav2) && !active(A))", Answered.HOLDS),
    ],
)
def test_a_requirement_about_a_vehicle_is_about_that_one_alone(
    formula: str, answer: Answered
) -> None:
    mission = notation(fork(AIR, AIR))
    vehicles = fleet(mission, uav1="red", uav2="red", uav3="red")
    entry = f'requirements: [{{id: a, ltl: "{formula}"}}]'
    requirements = parse_spec(entry.encode(), "spec.yaml", Names(mission, vehicles))
    net = net_for(mission, vehicles, requirements, options=OPEN)
    found = check_requirement(explore(net), mission, vehicles, requirements[0])
    assert found.result is answer


def test_a_run_says_what_each_task_is_given_and_can_be_played() -> None:
    text = fork(AIR, f"{AIR};wait=unlimited", "uav1")
    mission = notation(text)
    vehicles = fleet(mission, uav1="red", uav2="red")
    report = check(mission, vehicles, options=OPEN)
    violation = next(
        each
        for each in as_data(findings_of(mission, report))["violations"]
        if each["property"] == "errors-caught"
    )
    said = [step["text"] for step in violation["steps"]]
    assert "script task B is given uav2" in said
    assert said[-1].startswith("script task A gets nothing: too few of what could fill its roles")
    player = play(mission, vehicles, violation["steps"])
    assert player.run.state.outcome is RunOutcome.FAILED


# --- random missions ------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(25))
def test_the_net_can_do_what_the_engine_does_where_branches_need_the_same(seed: int) -> None:
    mission = notation(branches_with_needs(Random(seed)))
    assert walked(mission, net_of(mission), range(3)) == ""


@pytest.mark.parametrize("seed", range(1, 31, 2))
def test_the_net_can_do_what_the_engine_does_of_a_random_mission(seed: int) -> None:
    mission = notation(structured(Random(seed), NEEDS))
    assert walked(mission, net_of(mission), range(2)) == ""


@pytest.mark.parametrize("seed", range(15))
def test_the_engine_follows_the_runs_that_violate_a_property(seed: int) -> None:
    mission = notation(branches_with_needs(Random(seed)))
    fleet = fleet_of(mission)
    report = check(mission, fleet, options=OPEN, limits=SMALL)
    for violation in as_data(findings_of(mission, report))["violations"]:
        # The engine has its own order of timers, and of tasks that name what they need.
        ordered = violation["property"] == "one-behavior"
        if not ordered and not any(step["trigger"] == "timer" for step in violation["steps"]):
            play(mission, fleet, violation["steps"])


def play(mission: Mission, fleet: Fleet, steps: list[dict[str, Any]]) -> ConformanceRun:
    """Play the steps of a report to the engine, which must do all of them."""
    player = ConformanceRun(mission, fleet, "MAIN")
    for step in steps:
        player.play(step)
    assert not player.undone
    return player


@pytest.mark.parametrize("seed", range(25))
def test_what_is_taken_from_a_pool_is_given_back(seed: int) -> None:
    found = explore(net_of(notation(branches_with_needs(Random(seed)))), SMALL)
    assert found.overflows == {}
    for state in range(len(found.states)):
        assert_pools_are_whole(found, state)


def assert_pools_are_whole(found: Exploration, state: int) -> None:
    """Each resource of a pool is free, or held by one task, until the run is over."""
    tokens = found.marking(state).tokens
    if tokens.keys() & found.net.ends:
        return
    for pool in found.net.places:
        if pool.free:
            kept = {p.index for p in found.net.places if p.kept == pool.free}
            held = sum(
                tokens.get(p.index, 0)
                for p in found.net.places
                if not p.kept and not {pool.index, *kept}.isdisjoint(p.returns)
            )
            idle = sum(tokens.get(place, 0) for place in (pool.index, *kept))
            assert idle + held == len(pool.free), pool.name


@pytest.mark.parametrize("seed", range(40))
def test_what_the_static_check_says_of_tasks_that_compete_can_happen(seed: int) -> None:
    mission = notation(branches_with_needs(Random(seed), COMPETING))
    vehicles = fleet_of(mission)
    findings = check_mission(mission, vehicles, offers_all)
    # Another rule is about tasks that name one vehicle; it does not ask what the fleet has.
    findings = [each for each in findings if each.rule != "same-vehicle"]
    assert all(each.rule == "tasks-compete" for each in findings)
    net = translate(mission, vehicles, options=OPEN)
    found = explore(net, SMALL)
    fired = [net.transitions[number] for number in found.fired]
    if found.stopped or any(each.flag is Flag.CONFLICT for each in fired):
        return  # tasks that name one vehicle are in each other's way before
    unavailable = {
        step.element
        for transition in fired
        for step in transition.steps
        if "RESOURCE_UNAVAILABLE" in step.detail
    }
    assert {each.element for each in findings} <= unavailable


COMPETING = tuple(each for each in NEEDS if "same" not in each and "count" not in each)

# --- vehicles that are lost -----------------------------------------------------------------------

LOSING = tuple(f"{each};onLoss=reassign" for each in NEEDS[:6])


@pytest.mark.parametrize(
    ("role", "answer"),
    [(f"{AIR};onLoss=reassign", Answered.VIOLATED), (AIR, Answered.HOLDS)],
)
def test_another_may_do_the_rest_of_what_a_lost_vehicle_did(role: str, answer: Answered) -> None:
    mission = notation(row(_task("A", role)))
    vehicles = fleet(mission, uav1="red", uav2="red")
    formula = "[](commanded(uav2) -> !once(commanded(uav1)))"
    entry = f'requirements: [{{id: a, ltl: "{formula}"}}]'
    requirements = parse_spec(entry.encode(), "spec.yaml", Names(mission, vehicles))
    net = net_for(mission, vehicles, requirements, options=OPEN)
    found = check_requirement(explore(net), mission, vehicles, requirements[0])
    assert found.result is answer


def test_it_is_said_that_one_loss_is_followed() -> None:
    report = report_of(row(_task("A", f"{AIR};onLoss=reassign")), uav1="red", uav2="red")
    (found,) = [each for each in report.net.approximations if "is reassigned" in each.what]
    assert found.exactness is Exactness.BOUNDED
    assert verdict(report, "no-deadlock") is Verdict.HOLDS
    assert verdict(report, "failures-handled") is Verdict.VIOLATED


@pytest.mark.parametrize("seed", range(10))
def test_the_engine_follows_runs_in_which_vehicles_are_lost(seed: int) -> None:
    mission = notation(branches_with_needs(Random(seed), LOSING))
    fleet = fleet_of(mission)
    report = check(mission, fleet, options=OPEN, limits=SMALL)
    for violation in as_data(findings_of(mission, report))["violations"]:
        ordered = violation["property"] == "one-behavior"
        if not ordered and not any(step["trigger"] == "timer" for step in violation["steps"]):
            play(mission, fleet, violation["steps"])


def test_a_task_that_may_wait_for_space_is_said_to_have_it_at_once() -> None:
    go = (
        '<scriptTask id="go"><extensionElements><m2pem:behavior type="vehicle" name="goto">'
        '<m2pem:properties><m2pem:property name="target" value="[0.01, 0.0, 0]"/>'
        '</m2pem:properties><m2pem:resources><m2pem:role name="driver" vehicle="ugv1"/>'
        "</m2pem:resources></m2pem:behavior></extensionElements></scriptTask>"
    )
    mission = notation(f'<startEvent id="s"/>{go}<endEvent id="e"/>\ns -> go -> e')
    shared = replace(fleet_for(mission), shared_space={"bridge": SharedSpace("bridge", 1)})
    report = check(mission, shared)
    (rough,) = [each for each in report.net.approximations if "space" in each.what]
    assert (rough.element, rough.exactness) == ("go", Exactness.BOUNDED)
    assert report.states == check(mission, fleet_for(mission)).states


@pytest.mark.parametrize("role", [f"{AIR};onLoss=ask", "need:vehicle=uav1;onLoss=ask"])
def test_it_is_said_that_no_operator_is_asked_about_a_loss(role: str) -> None:
    report = report_of(row(_task("A", role)), uav1="red", uav2="red")
    (found,) = [each for each in report.net.approximations if "operator is asked" in each.what]
    assert (found.element, found.exactness) == ("A", Exactness.BOUNDED)
