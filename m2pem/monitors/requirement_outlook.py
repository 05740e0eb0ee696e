"""What follows for the requirements that a run is monitored for, judged on what was explored.

    reader = OpenRequirements(run.state, fleet)
    for item, records in journal: run.replay(records, item); reader.observe(records)
    found = outlook(run, now_us, choice, reader=reader)
    reader.judge(found.explored)

A monitor knows what came before. It is followed from its state through all that was explored: so
a requirement is judged from the present on, not from the beginning of the mission. As in the
outlook of the run, what is possible again and again is taken to come at some time.
"""

from collections.abc import Sequence

from m2pem.api.runs import RequirementOutlook, RequirementProspect
from m2pem.engine import records as r
from m2pem.engine.inputs import RequirementDecided
from m2pem.engine.state import RunState
from m2pem.fleet.fleet import Fleet
from m2pem.monitors.anticipation import Verdict
from m2pem.monitors.moments import Moments, MomentTables
from m2pem.monitors.product import Position, own_letter
from m2pem.monitors.run_monitors import RunMonitors
from m2pem.verify.ltl import Proposition
from m2pem.verify.outlook import ROUND_AND_ROUND, StateSpace, leading_to

MOST_STEPS_SHOWN = 8
HAS_TIMES = "its times are not explored"
READS_TELEMETRY = "what telemetry will say is not known"


class _Reading:
    """The letters of what follows one state."""

    def __init__(
        self,
        state: RunState,
        propositions: Sequence[Proposition],
        fleet: Fleet | None,
        tables: MomentTables,
    ) -> None:
        self.letters: list[int] = []
        self._moments = Moments.after(state, propositions, fleet, self._add, tables)

    def _add(self, letter: int, _: int) -> None:
        self.letters.append(letter)

    def read(self, records: Sequence[r.Record]) -> None:
        self._moments.read(records)

    @property
    def letter(self) -> int:
        return self._moments.letter


class OpenRequirements:
    """Reads the records of a run up to a choice, and of what may follow it
    (`m2pem.verify.outlook.MomentReader`)."""

    def __init__(self, state: RunState, fleet: Fleet | None) -> None:
        """`state`: of the run, to which records are applied before they are observed."""
        self._state = state
        self._fleet = fleet
        self._monitors = RunMonitors(state, fleet)
        self._tables: MomentTables | None = None

    def observe(self, records: Sequence[r.Record]) -> None:
        """Read the records of one input."""
        # Their times matter to requirements with times alone, which are not judged.
        self._monitors.observe(0, records)

    def reading(self, state: RunState) -> _Reading:
        """Read what follows a state."""
        known = self._monitors.propositions
        if self._tables is None:
            self._tables = MomentTables(known, state.mission)
        return _Reading(state, known, self._fleet, self._tables)

    def judge(self, explored: StateSpace) -> tuple[RequirementOutlook, ...]:
        """Return what follows for each requirement that nothing had decided before the choice."""
        found: dict[str, tuple[RequirementProspect, str]] = {}
        for item in self._monitors.take():  # the choice itself has decided them
            prospect = RequirementProspect.UNKNOWN
            if isinstance(item, RequirementDecided):
                violated = item.verdict is r.RequirementVerdict.VIOLATED
                prospect = (
                    RequirementProspect.WILL_BE_VIOLATED if violated else RequirementProspect.HOLDS
                )
            found[item.requirement] = (prospect, item.because)
        monitored = self._state.requirements
        for name, position in self._monitors.positions().items():
            if position is None:
                found[name] = (RequirementProspect.UNKNOWN, HAS_TIMES)
            elif monitored[name].conditions:
                found[name] = (RequirementProspect.UNKNOWN, READS_TELEMETRY)
            elif not explored.letters:
                found[name] = (RequirementProspect.UNKNOWN, explored.why_incomplete)
            else:
                found[name] = _Judge(position, explored).judge()
        return tuple(
            RequirementOutlook(name, monitored[name].english, *found[name])
            for name in monitored
            if name in found
        )


class _Judge:
    """Follows one monitor through the product of the states of the run and its own (*pairs*)."""

    def __init__(self, position: Position, explored: StateSpace) -> None:
        self._monitor, self._bits, start = position
        self._explored = explored
        self._pairs = [(0, start)]
        self._from = [(-1, "")]
        self._following: list[list[int]] = []
        self._good: list[int] = []
        self._bad: list[int] = []
        self._unexplored: list[int] = []
        self._loops: set[int] = set()

    def judge(self) -> tuple[RequirementProspect, str]:
        """Return the verdict and its reason."""
        self._follow()
        round_and_round = self._look_at_loops()
        if self._bad:
            others = (*self._good, *self._unexplored, *round_and_round)
            kind = RequirementProspect.WILL_BE_VIOLATED
            if 0 in leading_to(others, self._following):
                kind = RequirementProspect.MAY_BE_VIOLATED
            return kind, self._path_to(self._bad[0])
        if self._unexplored:
            return RequirementProspect.UNKNOWN, self._explored.why_incomplete
        if round_and_round:
            return RequirementProspect.UNKNOWN, ROUND_AND_ROUND
        return RequirementProspect.HOLDS, ""

    def _follow(self) -> None:
        numbers = {self._pairs[0]: 0}
        explored, monitor = self._explored, self._monitor
        while len(self._following) < len(self._pairs):
            pair = len(self._following)
            following: list[int] = []
            self._following.append(following)
            run, state = self._pairs[pair]
            verdict = monitor.verdicts[state]
            if not verdict.is_certain and run in explored.final:
                verdict = monitor.at_end(state, self._own(explored.letters[run]))
            if verdict.is_certain:
                (self._bad if verdict is Verdict.VIOLATED else self._good).append(pair)
                continue
            if run >= explored.expanded or run in explored.undecided:
                self._unexplored.append(pair)
            for step in explored.transitions[run]:
                after = state
                for letter in step.letters:
                    after = monitor.step(after, self._own(letter))
                number = numbers.setdefault((step.target, after), len(self._pairs))
                if number == len(self._pairs):
                    self._pairs.append((step.target, after))
                    self._from.append((pair, step.text))
                following.append(number)

    def _own(self, letter: int) -> int:
        return own_letter(self._bits, letter)

    def _look_at_loops(self) -> list[int]:
        """Judge the pairs from which runs can only go round for ever; return those whose verdict
        differs from run to run."""
        decided = leading_to((*self._good, *self._bad, *self._unexplored), self._following)
        left_open = []
        for pair, (run, state) in enumerate(self._pairs):
            if pair in decided:
                continue
            verdict = self._monitor.in_loops(state, run, self._transitions)
            self._loops.add(pair)
            if verdict is Verdict.OPEN:
                left_open.append(pair)
            else:
                (self._bad if verdict is Verdict.VIOLATED else self._good).append(pair)
        return left_open

    def _transitions(self, run: int) -> list[tuple[list[int], int]]:
        same = (self._explored.letters[run],)
        return [
            ([self._own(each) for each in step.letters or same], step.target)
            for step in self._explored.transitions[run]
        ]

    def _path_to(self, pair: int) -> str:
        """What comes before, for people."""
        last = ""
        if pair in self._loops:
            last = ROUND_AND_ROUND
        elif self._pairs[pair][0] in self._explored.final:
            last = "nothing more comes"
        steps: list[str] = []
        while pair:
            pair, text = self._from[pair]
            steps.append(text)
        steps.reverse()
        left_out = len(steps) - MOST_STEPS_SHOWN
        shown = ", ".join(steps[max(left_out, 0) :])
        if left_out > 0:
            shown = f"{left_out} steps, then {shown}"
        if not steps:
            return last or "at once"
        return f"after {shown}{f', when {last}' if last else ''}"
