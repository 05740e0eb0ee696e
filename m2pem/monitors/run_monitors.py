"""The monitors of one run: they read its records, and find what is certain of its requirements.

    monitors = RunMonitors(mission, fleet)
    monitors.observe(step.t_us, step.records)       # after each input, also in a replay
    for item in monitors.take(): ...                # inputs for the run: `RequirementDecided`

Pure: a verdict depends on the records and their mission times alone, so a replay finds the same.
"""

from collections.abc import Iterable, Sequence

from m2pem.engine import records as r
from m2pem.engine.inputs import RequirementDecided
from m2pem.fleet.fleet import Fleet
from m2pem.mission.mission import Mission
from m2pem.monitors.anticipation import Verdict, anticipation
from m2pem.monitors.moments import Moments
from m2pem.verify.ltl import negated, parse
from m2pem.verify.ltl.formula import Proposition
from m2pem.verify.requirements.english import English

ENDED = "the run has ended"
BEGINNING = "from the beginning"


class Monitor:
    """The monitor of one requirement in one run.

    `known`: the propositions of the run's letters, by bit.
    """

    def __init__(
        self, monitored: r.RequirementMonitored, known: Sequence[Proposition], english: English
    ) -> None:
        self.id = monitored.requirement
        self.verdict = Verdict.OPEN
        self._anticipation = anticipation(parse(monitored.formula))
        own = self._anticipation.propositions
        self._bits = [(1 << known.index(each), 1 << n, each) for n, each in enumerate(own)]
        self.mask = sum(bit for bit, _, _ in self._bits)
        self._english = english
        self._letters: dict[int, int] = {}
        self._state = self._anticipation.start
        self._letter = 0

    def _own(self, letter: int) -> int:
        """The letter of the formula, given that of the run."""
        masked = letter & self.mask
        own = self._letters.get(masked)
        if own is None:
            own = sum(mine for theirs, mine, _ in self._bits if masked & theirs)
            self._letters[masked] = own
        return own

    def read(self, letter: int) -> bool:
        """Read the letter of a moment. True: the verdict is certain now."""
        own = self._own(letter)
        self._state = self._anticipation.step(self._state, own)
        self._letter = own
        self.verdict = self._anticipation.verdicts[self._state]
        return self.verdict is not Verdict.OPEN

    def end(self) -> bool:
        """The run has ended: its last moment remains for ever. True: the verdict is certain now."""
        self.verdict = self._anticipation.at_end(self._state, self._letter)
        return self.verdict is not Verdict.OPEN

    def changes(self, before: int, letter: int) -> str:
        """What became true or false from one letter of the run to the next, in words."""
        return ", ".join(
            self._english.of(each if letter & theirs else negated(each))
            for theirs, _, each in self._bits
            if (before ^ letter) & theirs
        )


class RunMonitors:
    """The monitors of one run. Records `RequirementMonitored` say which there are."""

    def __init__(self, mission: Mission, fleet: Fleet | None) -> None:
        self._mission = mission
        self._fleet = fleet
        self._moments: Moments | None = None
        self._open: dict[str, Monitor] = {}
        self._recorded: set[str] = set()
        self._found: dict[str, RequirementDecided] = {}
        self._letter = -1
        self._t_us = 0

    def observe(self, t_us: int, records: Sequence[r.Record]) -> None:
        """Read the records of one input. `t_us`: their mission time."""
        if self._moments is None:
            if not records or type(records[0]) is not r.RunStarted:
                return
            self._begin(records)
            if self._moments is None:
                return
        self._t_us = t_us
        self._moments.read(records)
        for record in records:
            if type(record) is r.RunEnded:
                self._end(record)
            elif type(record) is r.RequirementDecided:
                self._note(record.requirement)

    def take(self) -> list[RequirementDecided]:
        """Return what has become certain, and is not recorded yet; each once."""
        if not self._found:
            return []
        found, self._found = list(self._found.values()), {}
        return found

    def _begin(self, records: Iterable[r.Record]) -> None:
        monitored = [each for each in records if type(each) is r.RequirementMonitored]
        if not monitored:
            return
        formulas = [parse(each.formula) for each in monitored]
        known = tuple(
            dict.fromkeys(
                proposition
                for formula in formulas
                for proposition in anticipation(formula).propositions
            )
        )
        names = {each.id: each.name for each in (*self._mission.nodes, *self._mission.processes)}
        english = English(names)
        self._open = {each.requirement: Monitor(each, known, english) for each in monitored}
        self._moments = Moments(known, self._mission, self._fleet, self._read)

    def _read(self, letter: int) -> None:
        before = self._letter
        first = before < 0
        changed = letter ^ before
        if not (changed or first):
            return
        self._letter = letter
        certain = [
            each
            for each in self._open.values()
            if (first or changed & each.mask) and each.read(letter)
        ]
        for each in certain:
            because = each.changes(0 if first else before, letter)
            self._decide(each, because or BEGINNING)

    def _end(self, record: r.RunEnded) -> None:
        """Decide all, unless operators have stopped the run: it could have gone on."""
        if record.outcome is not r.RunOutcome.STOPPED:
            for each in [each for each in self._open.values() if each.end()]:
                self._decide(each, ENDED)
        self._open.clear()

    def _decide(self, monitor: Monitor, because: str) -> None:
        del self._open[monitor.id]
        if monitor.id not in self._recorded:
            verdict = r.RequirementVerdict(monitor.verdict.value)
            self._found[monitor.id] = RequirementDecided(monitor.id, verdict, self._t_us, because)

    def _note(self, requirement: str) -> None:
        """A verdict is recorded, perhaps by an earlier release: it stays."""
        self._recorded.add(requirement)
        self._found.pop(requirement, None)
        self._open.pop(requirement, None)
