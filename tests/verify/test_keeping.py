"""Vehicles that a run keeps between its tasks: the net follows who has them, and until when."""

from dataclasses import replace
from random import Random

import pytest

from m2pem.verify.assumptions import NO_FAILURES
from m2pem.verify.check import Report, check
from m2pem.verify.net.petri_net import Action, Exactness
from m2pem.verify.net.simplify import simplify
from m2pem.verify.properties.commands import watch_interruptions
from m2pem.verify.properties.results import Verdict
from m2pem.verify.report.data import as_data
from m2pem.verify.report.findings import findings_of
from m2pem.verify.search.explore import Limits, explore
from m2pem.verify.translate import translate
from tests.engine.notation import mission as notation
from tests.engine.random_missions import structured
from tests.verify.keeping_walk import KeepingWalk
from tests.verify.random_keeping import ALIKE, KEEPING, PAIRS, again, keeping
from tests.verify.random_needs import OPEN, branches_with_needs, fleet_of, net_of
from tests.verify.test_roles_by_need import (
    AIR,
    SMALL,
    _task,
    assert_pools_are_whole,
    explained,
    fork,
    messages,
    play,
    report_of,
    row,
    verdict,
)
from tests.verify.test_spin_agreement import one_answer, same
from tests.verify.trace_mapping import TooManyStatesError

CLOSED = replace(OPEN, open_world=False)
WITHOUT_FAILURES = replace(CLOSED, assumed=NO_FAILURES)


def kept(text: str, vehicles: int = 2, *, failures: bool = True) -> Report:
    """What is found of a mission with some vehicles that nothing but the mission distinguishes."""
    tags = {f"uav{number}": "red" for number in range(1, vehicles + 1)}
    return report_of(text, CLOSED if failures else WITHOUT_FAILURES, **tags)


def subprocess(name: str, *tasks: str) -> str:
    names = [part.split('id="')[1].split('"')[0] for part in tasks]
    body = "\n".join([f'<startEvent id="{name}s"/>', *tasks, " -> ".join((f"{name}s", *names))])
    return f'<subProcess id="{name}">\n{body}\n</subProcess>'


def beside(*parts: str) -> str:
    """Elements in parallel."""
    names = [part.split('id="')[1].split('"')[0] for part in parts]
    lines = ['<startEvent id="s"/><parallelGateway id="f"/><parallelGateway id="j"/>']
    lines += ['<endEvent id="e"/>', "s -> f", "j -> e", *parts]
    return "\n".join([*lines, *(f"f -> {name} -> j" for name in names)])


WAITS = f"{AIR};wait=unlimited"

# --- missions whose answer is known ---------------------------------------------------------------


def circle(keep: str) -> str:
    """Each of two subprocesses has one vehicle, and then needs the other."""
    one, two = "need:vehicle=uav1;wait=unlimited", "need:vehicle=uav2;wait=unlimited"
    return beside(
        subprocess("North", _task("A", f"{one};keep={keep}"), _task("B", two)),
        subprocess("South", _task("C", f"{two};keep={keep}"), _task("D", one)),
    )


@pytest.mark.parametrize(
    ("keep", "expected"),
    [("subprocess", Verdict.VIOLATED), ("process", Verdict.HOLDS), ("task", Verdict.HOLDS)],
)
def test_subprocesses_that_keep_what_the_other_needs_are_a_deadlock(
    keep: str, expected: Verdict
) -> None:
    report = kept(circle(keep))
    assert verdict(report, "no-deadlock") is expected
    assert verdict(report, "can-complete") is expected


def test_a_circle_is_named_with_its_tasks_and_vehicles() -> None:
    text = circle("subprocess")
    assert messages(text, kept(text), "no-deadlock") == [
        "script task B waits for uav2, uav2 is kept by script task C until subprocess South ends; "
        "script task D waits for uav1, uav1 is kept by script task A until subprocess North ends"
    ]
    (message,) = messages(text, kept(text), "can-complete")
    assert "uav2 is held by script task C and kept until subprocess South ends" in message


@pytest.mark.parametrize(
    ("vehicles", "expected"), [(2, Verdict.VIOLATED), (3, Verdict.HOLDS), (4, Verdict.HOLDS)]
)
def test_alike_vehicles_are_kept_by_their_number(vehicles: int, expected: Verdict) -> None:
    """Each of two subprocesses keeps one, and then needs another one beside it."""
    pair = "need:count=2;requires=vehicle.domain=='air';wait=unlimited"
    parts = [
        subprocess(name, _task(f"{name}1", f"{WAITS};keep=subprocess"), _task(f"{name}2", pair))
        for name in "PQ"
    ]
    report = kept(beside(*parts), vehicles)
    assert verdict(report, "no-deadlock") is expected


def test_as_many_states_for_eight_alike_vehicles_as_for_four() -> None:
    parts = [
        subprocess(name, _task(f"{name}1", f"{WAITS};keep=subprocess"), _task(f"{name}2", WAITS))
        for name in "PQ"
    ]
    few, many = kept(beside(*parts), 4), kept(beside(*parts), 8)
    assert few.states == many.states
    assert few.states < 150


@pytest.mark.parametrize(
    ("keep", "expected"),
    [
        ("", Verdict.HOLDS),
        (";keep=task", Verdict.HOLDS),
        (";keep=subprocess", Verdict.VIOLATED),
        (";keep=process", Verdict.HOLDS),
    ],
)
def test_a_task_of_another_scope_that_does_not_wait_fails_for_what_is_kept(
    keep: str, expected: Verdict
) -> None:
    """B comes when A has ended, and C is what goes on in the subprocess then."""
    look = '<userTask id="look">ask on</userTask>'
    text = f"""
    <startEvent id="s"/><endEvent id="e"/><endEvent id="o"/>
    {subprocess("P", _task("A", f"{AIR}{keep}"), "<manualTask id='m'/>".replace("'", '"'), look)}
    <boundaryEvent id="b" attachedToRef="P" cancelActivity="false">signal now</boundaryEvent>
    {_task("B", "uav1")}
    s -> P -> e
    b -> B -> o
    """
    thrown = '<intermediateThrowEvent id="m">signal now</intermediateThrowEvent>'
    report = kept(text.replace('<manualTask id="m"/>', thrown), 1)
    assert verdict(report, "errors-caught") is expected
    assert verdict(report, "one-behavior") is Verdict.HOLDS


def test_it_is_kept_no_longer_than_its_subprocess() -> None:
    first = subprocess("P", _task("A", f"{WAITS};keep=subprocess"))
    text = row(first, _task("B", AIR))
    assert verdict(kept(text, 1), "errors-caught") is Verdict.HOLDS
    text = row(subprocess("P", _task("A", f"{WAITS};keep=process")), _task("B", AIR))
    assert verdict(kept(text, 1), "errors-caught") is Verdict.HOLDS


def test_it_is_kept_however_its_scope_ends() -> None:
    inside = subprocess(
        "P", _task("A", f"{WAITS};keep=subprocess"), '<userTask id="look">ask on</userTask>'
    )
    text = f"""
    <startEvent id="s"/><endEvent id="e"/><endEvent id="o"/>
    {inside}
    <boundaryEvent id="b" attachedToRef="P">signal stop</boundaryEvent>
    {_task("B", AIR)}
    s -> P -> e
    b -> B -> o
    """
    report = report_of(text, replace(OPEN, assumed=NO_FAILURES), uav1="red")
    assert verdict(report, "errors-caught") is Verdict.HOLDS


HANDLED = """
<startEvent id="s"/><parallelGateway id="f"/><endEvent id="e"/><endEvent id="o"/>
<subProcess id="P"><startEvent id="ps"/><userTask id="look">ask on</userTask>
{keeps}
ps -> A -> look
<subProcess id="H" triggeredByEvent="true"><startEvent id="hs">signal stop</startEvent>
<userTask id="then">ask on</userTask>
{ends}
hs -> {first}then
</subProcess>
</subProcess>
{other}
<userTask id="wait">ask on</userTask>
s -> f -> P -> e
f -> wait -> B -> o
"""


@pytest.mark.parametrize(
    ("ends", "expected"),
    [("", Verdict.VIOLATED), ("need:vehicle=uav1;keep=task", Verdict.VIOLATED)],
)
def test_what_an_event_subprocess_interrupts_is_still_kept(ends: str, expected: Verdict) -> None:
    text = HANDLED.format(
        keeps=_task("A", "need:vehicle=uav1;wait=unlimited;keep=subprocess"),
        ends=_task("X", ends) if ends else "",
        first="X -> " if ends else "",
        other=_task("B", "uav1"),
    )
    report = report_of(text, replace(OPEN, assumed=NO_FAILURES), uav1="red")
    assert verdict(report, "errors-caught") is expected
    found = next(each for each in report.results if each.property == "errors-caught").violations
    labels = {report.net.transitions[number].element for each in found for number in each.run}
    assert "B" in labels
    states = {
        frozenset(report.net.places[p].element for p in report.found.marking(n).tokens)
        for n in range(len(report.found.states))
        if any(report.net.places[p].kept for p in report.found.marking(n).tokens)
    }
    assert any("then" in each for each in states) is (not ends)


AGAIN = """
<startEvent id="s"/><exclusiveGateway id="m"/><exclusiveGateway id="g"/><endEvent id="e"/>
<userTask id="ask">ask again enough</userTask>
<exclusiveGateway id="n"/>
{task}
s -> m -> {name} -> n -> ask -> g
g -> m if user.decision == 'again'
g -> e if user.decision == 'enough'
"""


def most_kept(report: Report, *, idle: bool = False) -> int:
    """How many vehicles are kept at most; `idle`: of those that no task has."""
    found, places = report.found, report.net.places
    keeping = {place.index for place in places if place.kept}
    counted = {
        place.index
        for place in places
        if place.kept or (not idle and not keeping.isdisjoint(place.returns))
    }
    return max(
        sum(n for p, n in found.marking(state).tokens.items() if p in counted)
        for state in range(len(found.states))
    )


@pytest.mark.parametrize("vehicles", [2, 3])
def test_a_task_that_is_executed_again_keeps_one_vehicle(vehicles: int) -> None:
    text = AGAIN.format(task=_task("A", f"{AIR};keep=process"), name="A")
    report = kept(text, vehicles)
    assert most_kept(report) == most_kept(report, idle=True) == 1
    takings = {number for number in report.found.fired if _gives(report, number)}
    assert len(takings) == 2  # it has the same again, or another one


def _gives(report: Report, number: int) -> bool:
    steps = report.net.transitions[number].steps
    return any(step.action is Action.ALLOCATED and step.detail for step in steps)


def test_what_it_had_before_is_kept_no_more_though_another_task_has_it_now() -> None:
    """Beside A, which is executed again, B has what A keeps, and gives it back."""
    again = AGAIN.format(task=_task("A", f"{AIR};keep=process"), name="A")
    beside_it = f"""
    <parallelGateway id="f"/><parallelGateway id="j"/><userTask id="look">ask on</userTask>
    {_task("B", WAITS)}
    f -> look -> B -> j"""
    text = again.replace("s -> m", "s -> f -> m").replace("-> e if", "-> j if")
    report = kept(f"{text}{beside_it}\nj -> e", 2)
    assert most_kept(report) == 1


@pytest.mark.parametrize("vehicles", [2, 3])
def test_a_subprocess_that_begins_again_keeps_one_more_each_time(vehicles: int) -> None:
    """Its tokens are others each time, and what earlier ones kept is kept."""
    text = AGAIN.format(task=subprocess("P", _task("A", f"{AIR};keep=process")), name="P")
    report = kept(text, vehicles)
    assert most_kept(report) == vehicles
    assert verdict(report, "errors-caught") is Verdict.HOLDS


@pytest.mark.parametrize(
    ("keep", "parallel", "expected"),
    [("process", True, 2), ("subprocess", True, 2), ("process", False, 2), ("task", True, 0)],
)
def test_instances_of_a_task_keep_one_each(keep: str, parallel: bool, expected: int) -> None:
    each = "<each>2</each>" if parallel else '<each isSequential="true">2</each>'
    task = f'<scriptTask id="A">do drive_stop {AIR};keep={keep}{each}</scriptTask>'
    report = kept(row(task, '<userTask id="ask">ask on</userTask>'), 3)
    assert most_kept(report) == expected


OTHER = """
<process id="MAIN" isExecutable="true">
<startEvent id="s"/><endEvent id="e">message begin</endEvent>
{keeps}
s -> A -> e
</process>
<process id="OTHER"><startEvent id="os">message begin</startEvent>{other}
os -> B
</process>
"""


def test_another_process_of_the_run_waits_until_the_first_has_ended() -> None:
    text = OTHER.format(keeps=_task("A", f"{AIR};keep=process"), other=_task("B", WAITS))
    report = kept(text, 1)
    assert verdict(report, "no-deadlock") is Verdict.HOLDS
    assert verdict(report, "can-complete") is Verdict.HOLDS
    waits = text.replace('<endEvent id="e">message begin</endEvent>', SENDS).replace("-> e", REST)
    report = kept(waits, 1)
    assert verdict(report, "no-deadlock") is Verdict.VIOLATED
    assert messages(waits, report, "no-deadlock") == [
        "a token waits at intermediate catch event c for what can no longer come; script task B "
        "waits for uav1, uav1 is kept by script task A until process MAIN ends"
    ]


SENDS = (
    '<intermediateThrowEvent id="t">message begin</intermediateThrowEvent>'
    '<intermediateCatchEvent id="c">message done</intermediateCatchEvent><endEvent id="e"/>'
)
REST = "-> t -> c -> e"


def test_a_vehicle_that_is_kept_and_interrupted_is_commanded_again_or_it_is_a_violation() -> None:
    inside = subprocess("P", _task("A", f"{AIR};keep=process"))
    text = f"""
    <startEvent id="s"/><endEvent id="e"/><endEvent id="o"/>
    {inside}
    <boundaryEvent id="b" attachedToRef="P">signal stop</boundaryEvent>
    s -> P -> e
    """
    options = replace(OPEN, assumed=NO_FAILURES)
    left = f"{text}\nb -> o"
    report = report_of(left, options, uav1="red", uav2="red")
    found = messages(left, report, "interrupted-commanded-again")
    assert [each.partition(":")[0] for each in found] == [
        "one of uav1, uav2 is interrupted by b and not commanded again"
    ]
    brought = f"{text}\n{_task('Back', 'need:count=2;requires=true')}\nb -> Back -> o"
    report = report_of(brought, options, uav1="red", uav2="red")
    assert messages(brought, report, "interrupted-commanded-again") == []


def test_a_lost_vehicle_is_kept_no_more_when_another_does_the_rest() -> None:
    role = f"{WAITS};keep=process;onLoss=reassign"
    text = row(_task("A", role), '<userTask id="ask">ask on</userTask>')
    assert most_kept(kept(text)) == 1
    caught = f"""
    <startEvent id="s"/><endEvent id="e"/><endEvent id="o"/>
    {_task("A", role)}
    <boundaryEvent id="b" attachedToRef="A">error LINK_LOST</boundaryEvent>
    {subprocess("P", '<userTask id="ask">ask on</userTask>')}
    s -> A -> e
    b -> P -> o
    """
    for text, most in ((caught, 0), (caught.replace(";onLoss=reassign", ""), 1)):
        report = kept(text, 1)
        found, places = report.found, report.net.places
        tokens = [found.marking(state).tokens for state in range(len(found.states))]
        asked = [each for each in tokens if any(places[p].element == "ask" for p in each)]
        assert {sum(n for p, n in each.items() if places[p].kept) for each in asked} == {most}


def test_without_keeping_there_are_as_many_states_as_before() -> None:
    for text in (fork(WAITS, WAITS, AIR), row(_task("A", AIR), _task("B", "uav1"))):
        plain, with_task = kept(text), kept(text.replace(f"{AIR}", f"{AIR};keep=task"))
        assert plain.states == with_task.states
        assert not any(place.kept for place in plain.net.places)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (row(_task("A", f"{AIR};keep=process")), set()),
        (row(_task("A", f"{AIR};keep=subprocess"), _task("B", f"{AIR};keep=task")), set()),
        (AGAIN.format(task=_task("A", f"{AIR};keep=process"), name="A"), set()),
        (
            f"""<startEvent id="s"/><exclusiveGateway id="m"/><parallelGateway id="p"/>
            <parallelGateway id="q"/>{_task("A", f"{AIR};keep=process")}
            {_task("B", AIR)}
            s -> m -> p -> A -> q -> m
            p -> B -> q""",
            {"what it keeps goes when it is executed again, also by another token"},
        ),
    ],
)
def test_what_is_not_followed_of_keeping_is_said(text: str, expected: set[str]) -> None:
    rough = kept(text).net.approximations
    assert {each.what for each in rough if "keep" in each.what} == expected
    assert all(each.exactness is Exactness.BOUNDED for each in rough)


# --- random missions: the engine ------------------------------------------------------------------


@pytest.mark.parametrize("part", range(4))
def test_the_net_can_do_what_the_engine_does_and_keeps_the_same(part: int) -> None:
    for seed in range(part, 24, 4):
        walked(keeping(Random(seed)), seed)


OPEN_NETS = {6, 11, 16}
"""Seeds of missions whose nets leave so much open that no run of the engine can be followed."""


@pytest.mark.parametrize("part", range(2))
def test_the_net_can_do_what_the_engine_does_of_structured_missions(part: int) -> None:
    for seed in {*range(part, 12, 2)} - OPEN_NETS:
        walked(structured(Random(seed), (KEEPING, ALIKE)[part]), seed)


@pytest.mark.parametrize("seed", [7, 9, 11])
def test_the_net_follows_which_role_keeps_what_when_a_task_is_executed_again(seed: int) -> None:
    walked(again(Random(seed), (*PAIRS, WAITS)), seed, walks=4)


@pytest.mark.long
@pytest.mark.parametrize("part", range(10))
def test_the_net_can_do_what_the_engine_does_of_many_missions(part: int) -> None:
    for seed in range(20 + part, 500, 10):
        walked(keeping(Random(seed)), seed)
    for seed in {*range(10 + part, 60, 10)} - OPEN_NETS:
        walked(structured(Random(seed), (KEEPING, ALIKE)[part % 2]), seed)


def walked(text: str, seed: int, walks: int = 3) -> None:
    mission = notation(text)
    fleet = fleet_of(mission)
    net = net_of(mission)
    for number in range(walks):
        try:
            walk = KeepingWalk(mission, fleet, net, number)
            lost = walk.go(40)
        except TooManyStatesError:
            continue
        assert not lost or explained(walk, net), (seed, number, lost)


@pytest.mark.parametrize("part", range(4))
def test_the_engine_follows_the_runs_that_violate_a_property(part: int) -> None:
    played = 0
    for seed in range(part, 12, 4):
        text = keeping(Random(seed)) if seed % 2 else branches_with_needs(Random(seed), KEEPING)
        mission = notation(text)
        fleet = fleet_of(mission)
        report = check(mission, fleet, options=OPEN, limits=SMALL)
        rough = any(each.exactness is Exactness.BOUNDED for each in report.net.approximations)
        if rough or "callActivity" in text:  # steps do not say in which of two calls they are
            continue
        for violation in as_data(findings_of(mission, report))["violations"]:
            ordered = violation["property"] == "one-behavior"
            if not ordered and not any(step["trigger"] == "timer" for step in violation["steps"]):
                play(mission, fleet, violation["steps"])
                played += 1
    assert played


@pytest.mark.parametrize("part", range(3))
def test_each_vehicle_is_free_kept_or_held_by_one_task(part: int) -> None:
    for seed in range(part, 18, 3):
        found = explore(net_of(notation(keeping(Random(seed)))), Limits(states=1_000, tokens=3))
        if not found.overflows:
            for state in range(len(found.states)):
                assert_pools_are_whole(found, state)


# --- Spin -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", [4, 5, 11, 15, 23])
def test_spin_sees_the_same_states(seed: int) -> None:
    mission = notation(keeping(Random(seed)))
    net = simplify(net_of(mission)) if seed % 3 else net_of(mission)
    watched = watch_interruptions(net, fleet_of(mission).vehicles)
    same(watched[0] if watched is not None and seed % 2 else net)


@pytest.mark.parametrize("text", [circle("subprocess"), circle("task")])
def test_spin_has_the_same_answers(text: str) -> None:
    mission = notation(text)
    fleet = replace(fleet_of(mission))
    expected = Verdict.VIOLATED if "subprocess;" in text or "keep=subprocess" in text else None
    found = one_answer(mission, fleet, CLOSED)
    assert expected is None or found is expected
    assert len(translate(mission, fleet, options=CLOSED).transitions) > 10
