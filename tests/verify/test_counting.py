"""What a mission counts is counted in its verification: no alarm is false, and none is missing."""

from collections.abc import Callable, Iterable
from random import Random

import pytest

from m2pem.engine import inputs as i
from m2pem.engine import records as r
from m2pem.engine.run import MissionRun
from m2pem.engine.state import RunStatus
from m2pem.errors import MissionError
from m2pem.fleet.default_fleet import fleet_for
from m2pem.mission.mission import Mission
from m2pem.verify.check import Report, check
from m2pem.verify.properties.results import BEYOND, Verdict
from m2pem.verify.search.explore import Limits
from tests.bpmn.bpmn_text import definitions, load
from tests.seeds import named, seeds_for
from tests.verify.conformance import START_US
from tests.verify.random_counting import ROOTS, Draft, counting, event

ENDS = ("no-deadlock", "can-complete", "completes-if-fair", "no-livelock")
LIMITS = Limits(states=20_000, seconds=10.0, tokens=3)
LONG_S = 600.0
MOST_STEPS = 40


def completes(mission: Mission) -> tuple[bool, set[str]] | None:
    """Whether the engine completes a mission in which only timers come from outside, and the
    elements that it reaches; None: it goes on for ever."""
    run, now_us = MissionRun(mission, fleet_for(mission), "r1", 200), START_US
    steps = [run.receive(i.StartRun("MAIN"), now_us)]
    while run.wants_continue or (run.state.status is RunStatus.RUNNING and run.next_due_us):
        if len(steps) > MOST_STEPS:
            return None
        now_us = max(now_us, run.next_due_us or 0)
        item = i.Continue() if run.wants_continue else i.Tick()
        steps.append(run.receive(item, now_us))
    reached = {
        record.element
        for step in steps
        for record in step.records
        if isinstance(record, r.TokenLeft)
    }
    return run.state.outcome is r.RunOutcome.COMPLETED, reached


def verdicts(report: Report) -> dict[str, Verdict]:
    return {each.property: each.verdict for each in report.results}


def differs(mission: Mission) -> str:
    """What verification says of a mission for certain and the engine does otherwise."""
    played = completes(mission)
    if played is None:
        return ""
    done, reached = played
    report = check(mission, limits=LIMITS)
    said = verdicts(report)
    if done and (false := [each for each in ENDS if said[each] is Verdict.VIOLATED]):
        return f"{', '.join(false)} violated, and it completes"
    exact = not report.net.approximations and not report.found.lost
    if not done and exact and said["no-deadlock"] is said["can-complete"] is Verdict.HOLDS:
        return "it never completes, and nothing is found"
    dead = {
        element
        for each in report.results
        if each.property == "no-dead-element" and each.verdict is Verdict.VIOLATED
        for violation in each.violations
        if not violation.doubt
        for element in violation.elements
    }
    return f"{', '.join(sorted(dead & reached))} dead, and reached" if dead & reached else ""


def check_seeds(seeds: Iterable[int]) -> None:
    for seed in seeds:
        with named(seed):
            try:
                mission = counting(Random(seed))
            except MissionError:
                continue
            assert differs(mission) == ""


def test_the_engine_does_what_is_said_of_random_missions_that_count() -> None:
    check_seeds(range(20))


@pytest.mark.long
@pytest.mark.timeout(3600)
def test_the_engine_does_what_is_said_of_many_missions_that_count() -> None:
    check_seeds(seeds_for(LONG_S))


# --- what is counted ----------------------------------------------------------------------------


def throws(count: int, message: str = "m1") -> list[str]:
    what = f"message {message}"
    return [event("intermediateThrowEvent", f"t{message}{n}", what) for n in range(count)]


def receives(count: int, message: str = "m1") -> str:
    return in_turn("receiveTask", f"r{message}", count, message)


def in_turn(kind: str, name: str, count: int, message: str) -> str:
    return (
        f'<{kind} id="{name}" messageRef="{message}"><multiInstanceLoopCharacteristics'
        f' isSequential="true"><loopCardinality>{count}</loopCardinality>'
        f"</multiInstanceLoopCharacteristics></{kind}>"
    )


def whole(pieces: list[str], beside: str = "", other: str = "") -> Mission:
    main = Draft(Random(0)).row(pieces)
    process = f'<process id="MAIN" isExecutable="true">{main}{beside}</process>'
    return load(definitions(f"{ROOTS}{process}{other}"))


def waiting(count: int) -> tuple[str, str]:
    """A process of which each instance waits for a signal, and answers."""
    draft = Draft(Random(0), number=1_000)
    begins = event("startEvent", "{}", "message m1")
    waits = event("intermediateCatchEvent", "w", "signal g")
    rest = draft.row([waits, event("intermediateThrowEvent", "a", "message m2")], begins)
    return receives(count, "m2"), f'<process id="OTHER" isExecutable="true">{rest}</process>'


def instances(begun: int, answered: int) -> Mission:
    answers, other = waiting(answered)
    timer, signal = (
        event("intermediateCatchEvent", "wait", "timer"),
        event("intermediateThrowEvent", "go", "signal g"),
    )
    return whole([in_turn("sendTask", "s", begun, "m1"), timer, signal, answers], other=other)


def tokens_at_a_signal(handled: int, answered: int) -> Mission:
    """A non-interrupting event begins so many handlings, which wait for one signal."""
    inside = Draft(Random(0), number=1_000)
    row = inside.row([*throws(handled), receives(answered, "m2")])
    sub = f'<subProcess id="W">{row}</subProcess>'
    boundary = event(
        "boundaryEvent", "{}", "message m1", ' attachedToRef="W" cancelActivity="false"'
    )
    waits = event("intermediateCatchEvent", "w", "signal g")
    answer = event("intermediateThrowEvent", "a", "message m2")
    handling = Draft(Random(0), number=2_000).row([waits, answer], boundary)
    timer = event("intermediateCatchEvent", "wait", "timer")
    signal = event("intermediateThrowEvent", "go", "signal g")
    return whole([sub], handling + Draft(Random(0), number=3_000).row([timer, signal]))


def undone(times: int, answered: int) -> Mission:
    """A task is done `times` times, in a row of subprocess rounds, and then undone."""
    twice = "true" if times == 2 else "false"
    pieces = Draft(Random(0), number=1_000).undone(0, twice, "message m1")
    return whole([*pieces, receives(answered, "m1")])


@pytest.mark.parametrize(
    "make",
    [
        pytest.param(lambda n, m: whole([*throws(n), receives(m)]), id="messages"),
        pytest.param(
            lambda n, m: whole([in_turn("sendTask", "s", n, "m1"), receives(m)]), id="in-turn"
        ),
        pytest.param(instances, id="instances"),
    ],
)
@pytest.mark.parametrize("count", [2, 3, 4, 10])
def test_so_many_are_counted_and_one_more_is_missed(
    make: Callable[[int, int], Mission], count: int
) -> None:
    assert check(make(count, count)).verdict is Verdict.HOLDS
    lacking = verdicts(check(make(count, count + 1)))
    assert {lacking[each] for each in ("no-deadlock", "can-complete", "no-dead-element")} == {
        Verdict.VIOLATED
    }


@pytest.mark.parametrize("kind", ["row", "in turn"])
def test_a_hundred_messages_are_counted(kind: str) -> None:
    sent = throws(100) if kind == "row" else [in_turn("sendTask", "s", 100, "m1")]
    assert check(whole([*sent, receives(100)])).verdict is Verdict.HOLDS
    assert check(whole([*sent, receives(101)])).verdict is Verdict.VIOLATED


@pytest.mark.parametrize("count", [2, 3, 4, 8])
def test_each_token_that_waits_for_a_signal_is_let_go_on(count: int) -> None:
    assert check(tokens_at_a_signal(count, count)).verdict is Verdict.HOLDS
    lacking = verdicts(check(tokens_at_a_signal(count, count + 1)))
    assert lacking["no-deadlock"] is Verdict.VIOLATED


@pytest.mark.parametrize("times", [1, 2])
def test_what_was_done_twice_is_undone_twice(times: int) -> None:
    assert verdicts(check(undone(times, times)))["no-deadlock"] is Verdict.HOLDS
    assert verdicts(check(undone(times, times + 1)))["no-deadlock"] is Verdict.VIOLATED


def test_beyond_what_is_counted_an_alarm_may_be_false() -> None:
    mission = whole([in_turn("sendTask", "s", 128, "m1"), receives(128)])
    assert completes(mission) is not None
    report = check(mission)
    assert report.verdict is Verdict.MAY_BE_VIOLATED
    (alarm,) = [each for each in report.results if each.property == "no-deadlock"]
    assert alarm.violations[0].doubt == BEYOND
    assert [each.what for each in report.net.approximations] == [
        "not all copies of message m1 that are kept are counted"
    ]


def test_a_bound_that_is_not_reached_is_no_approximation() -> None:
    assert check(whole([*throws(3), receives(3)])).net.approximations == ()
