"""What a mission counts is counted in its verification: no alarm is false, and none is missing."""

from collections.abc import Iterable
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
from m2pem.verify.properties.results import Verdict
from m2pem.verify.search.explore import Limits
from tests.seeds import named, seeds_for
from tests.verify.conformance import START_US
from tests.verify.random_counting import counting

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
    check_seeds(range(40))


@pytest.mark.long
@pytest.mark.timeout(3600)
def test_the_engine_does_what_is_said_of_many_missions_that_count() -> None:
    check_seeds(seeds_for(LONG_S))
