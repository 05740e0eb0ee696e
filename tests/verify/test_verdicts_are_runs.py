"""A verdict is what the engine does: each run of a violation leads there, and what holds is so.

The runs are played to the engine by `tests.verify.conformance`, which has nothing of the execution
with which verification itself confirms them; what holds is tried by plays that dice drive.
"""

from collections import Counter
from collections.abc import Iterable, Iterator
from random import Random

import pytest

from m2pem.engine import inputs as i
from m2pem.engine import records as r
from m2pem.engine.run import MissionRun
from m2pem.engine.state import BehaviorPhase, RunStatus
from m2pem.errors import MissionError
from m2pem.fleet.default_fleet import fleet_for
from m2pem.fleet.fleet import Fleet
from m2pem.mission.catalogue import BehaviorState
from m2pem.mission.mission import Mission
from m2pem.mission.values import Value
from m2pem.verify.check import Report, check
from m2pem.verify.net.petri_net import Exactness
from m2pem.verify.properties.results import Verdict, Violation
from m2pem.verify.search.explore import Limits
from m2pem.verify.translate import Options
from tests.engine.notation import mission as notation
from tests.engine.random_missions import graph, structured
from tests.seeds import named, seeds_for
from tests.verify.conformance import START_US, Played, play
from tests.verify.random_counting import counting
from tests.verify.random_verified import DATA, verified
from tests.verify.trace_mapping import TooManyStatesError

LIMITS = Limits(states=2_000, seconds=10.0, tokens=3)
LONG_S = 900.0
FEW = 120
MOST_INPUTS = 40
MOST_TOKENS = 200
PLAYS = 2
STUCK = frozenset({"no-deadlock", "can-complete", "completes-if-fair", "no-livelock"})
LEFT_OPEN = frozenset(
    {
        "no flow has a condition, so any of them may be taken",
        "a condition reads what nothing in the mission writes",
    }
)
"""Where a mission leaves a choice open, the engine makes one, and verification each of them."""
UNCAUGHT = frozenset({"errors-caught", "failures-handled"})
NO_FLOW = "decisions-handled"


class Engine:
    """A run of the engine, into which goes what verification lets come from outside."""

    def __init__(self, mission: Mission, fleet: Fleet) -> None:
        self.run, self.now_us, self.steps = MissionRun(mission, fleet, "r1", 200), START_US, 0
        self.reached: set[str] = set()
        self.thrown: set[str] = set()
        self.source = {flow.id: flow.source.id for flow in mission.flows}

    def give(self, item: i.Input, now_us: int) -> None:
        self.now_us = max(self.now_us, now_us)
        self.steps += 1
        step = self.run.receive(item, self.now_us)
        for record in step.records:
            if isinstance(record, r.FlowTaken):
                self.reached |= {record.flow, self.source[record.flow]}
            elif isinstance(record, r.ErrorThrown):
                self.thrown.add(record.code)
        few = len(self.run.state.tokens) < MOST_TOKENS
        if self.run.wants_continue and self.steps < MOST_INPUTS and few:
            self.give(i.Continue(), self.now_us)

    @property
    def stuck(self) -> bool:
        state = self.run.state
        if state.status is RunStatus.ENDED:
            return state.detail.startswith("stuck")
        return not self.run.wants_continue and not [*self.things()]

    @property
    def failed(self) -> bool:
        state = self.run.state
        return bool(state.incidents) or state.outcome is r.RunOutcome.FAILED

    def things(self) -> Iterator[i.Input]:
        """What may come from outside now."""
        state = self.run.state
        for prompt in state.prompts.values():
            answers = [each["value"] for each in prompt.decisions] or [""]
            yield from (i.PromptAnswer(prompt.id, each) for each in answers)
        for behavior in state.behaviors.values():
            ends = behavior.phase is BehaviorPhase.CANCELLING
            how = BehaviorState.CANCELLED if ends else BehaviorState.SUCCEEDED
            yield i.BehaviorReported(behavior.id, behavior.number + 1, how)
        yield from (i.ServiceCompleted(each) for each in state.services)
        if self.run.next_due_us is not None:
            yield i.Tick()

    def release(self) -> None:
        """Let the behaviors end that are being cancelled: no token is on their tasks any more."""
        for behavior in list(self.run.state.behaviors.values()):
            if behavior.phase is BehaviorPhase.CANCELLING:
                ended = i.BehaviorReported(
                    behavior.id, behavior.number + 1, BehaviorState.CANCELLED
                )
                self.give(ended, self.now_us)

    def goes_on(self, dice: Random) -> bool:
        """Let one thing happen; whether there was any."""
        things = [] if self.run.state.status is RunStatus.ENDED else [*self.things()]
        if not things or self.run.wants_continue:
            return False
        item = dice.choice(things)
        due = self.run.next_due_us if isinstance(item, i.Tick) else None
        self.give(item, due or self.now_us)
        return True


def random_mission(seed: int) -> tuple[Mission, dict[str, Value]] | None:
    """A random mission and what its run begins with; None: no such mission is read."""
    dice = Random(seed)
    try:
        match seed % 8:
            case 0 | 1 | 2 | 3 | 4:
                return notation(verified(dice)), dict(DATA)
            case 5:
                return counting(dice), {}
            case 6:
                return notation(structured(dice)), {"a": 1, "b": 1, "c": 0}
            case _:
                return notation(graph(dice)), {"a": 1, "b": 1, "c": 0}
    except MissionError:
        return None


class Judge:
    """Compares the verdicts on a mission with the engine; `counts` has what was compared."""

    def __init__(self, counts: Counter[str]) -> None:
        self.counts = counts

    def wrong(self, mission: Mission, data: dict[str, Value], seed: int) -> str:
        """What is said for certain, and the engine does otherwise."""
        fleet = fleet_for(mission)
        report = check(mission, fleet, options=Options(data=data), limits=LIMITS)
        for result in report.results:
            self.counts[result.verdict] += 1
            if result.verdict is not Verdict.VIOLATED:
                continue
            for each in result.violations:
                if not each.doubt and (each.run or each.cycle):
                    net = report.transitions_of(result)
                    played = play(mission, fleet, net, (*each.run, *each.cycle), data)
                    if why := self._unlike(report, result.property, each, played, mission, fleet):
                        return f"{result.property}: {each.message}: {why}"
        return self._what_holds(report, mission, fleet, data, seed)

    def _unlike(
        self,
        report: Report,
        name: str,
        violation: Violation,
        played: Played,
        mission: Mission,
        fleet: Fleet,
    ) -> str:
        left_open = any(each.what in LEFT_OPEN for each in report.net.approximations)
        if not played.agrees and (left_open or "nothing makes" in played.stopped):
            self.counts["not played"] += 1
            return ""
        if not played.agrees and replayed(mission, fleet, played).run.wants_continue:
            self.counts["never waits"] += 1
            return ""
        self.counts["played"] += 1
        if not played.agrees:
            return played.stopped
        if left_open or name not in STUCK | UNCAUGHT | {NO_FLOW}:
            return ""  # the engine alone chooses otherwise
        end = replayed(mission, fleet, played)
        if name == NO_FLOW:
            return "" if "NO_FLOW" in end.thrown else "a flow is true"
        if name in UNCAUGHT:
            return "" if end.failed else "nothing has failed"
        if name == "no-deadlock":
            end.release()
            return "" if end.stuck else f"the engine goes on: {end.run.state.detail}"
        if violation.cycle or end.stuck:
            return ""
        for number in range(PLAYS):  # no way leads to the end
            more, dice = replayed(mission, fleet, played), Random(number)
            while more.steps < MOST_INPUTS and more.goes_on(dice):
                pass
            if more.run.state.outcome in (r.RunOutcome.COMPLETED, r.RunOutcome.TERMINATED):
                return "the engine comes to an end"
        return ""

    def _what_holds(
        self, report: Report, mission: Mission, fleet: Fleet, data: dict[str, Value], seed: int
    ) -> str:
        said = {each.property: each for each in report.results}
        certain = not report.found.lost and not any(
            each.exactness is Exactness.BOUNDED for each in report.net.approximations
        )
        dead = {
            element
            for each in said["no-dead-element"].violations
            if not each.doubt
            for element in each.elements
        }
        safe = all(
            said[each].verdict is Verdict.HOLDS for each in (*UNCAUGHT, NO_FLOW, "one-behavior")
        )
        for number in range(PLAYS):
            engine, dice = Engine(mission, fleet), Random(seed * PLAYS + number)
            engine.give(i.StartRun(report.net.process, data), START_US)
            while engine.steps < MOST_INPUTS and engine.goes_on(dice):
                pass
            self.counts["plays"] += 1
            if engine.reached & dead:
                return f"never reached, and reached: {', '.join(sorted(engine.reached & dead))}"
            if not certain or "EXPRESSION" in engine.run.state.detail:
                continue
            if engine.stuck and said["no-deadlock"].verdict is Verdict.HOLDS:
                return f"nothing is stuck, and play {number} is: {engine.run.state.detail}"
            if engine.failed and not engine.stuck and safe:
                return f"nothing fails, and play {number} does: {engine.run.state.detail}"
        return ""


def replayed(mission: Mission, fleet: Fleet, played: Played) -> Engine:
    """The run of the engine to which a run was played."""
    engine = Engine(mission, fleet)
    for now_us, item in played.inputs:
        engine.give(item, now_us)
    return engine


def judge(seeds: Iterable[int]) -> Counter[str]:
    counts: Counter[str] = Counter()
    for seed in seeds:
        with named(seed):
            made = random_mission(seed)
            counts["missions" if made else "not read"] += 1
            try:
                assert made is None or Judge(counts).wrong(*made, seed) == ""
            except TooManyStatesError:
                counts["too much is open to be played"] += 1
    return counts


def test_what_is_said_of_random_missions_is_what_the_engine_does() -> None:
    counts = judge(range(FEW))
    assert counts[Verdict.VIOLATED] > FEW < counts["played"]
    assert counts[Verdict.HOLDS] > FEW


@pytest.mark.long
@pytest.mark.timeout(3600)
def test_what_is_said_of_many_random_missions_is_what_the_engine_does() -> None:
    judge(seeds_for(LONG_S))
