"""LTL claims: ask Spin whether a mission meets its author's requirements."""

import time
from collections.abc import Callable

from m2pem.errors import InternalError
from m2pem.fleet.fleet import Fleet
from m2pem.mission.mission import Mission
from m2pem.verify.ltl import propositions
from m2pem.verify.ltl.formula import needs_steps
from m2pem.verify.ltl.model_check import Move, Result, Run, breaks
from m2pem.verify.net.encoding import Encoding
from m2pem.verify.requirements.check import Answer
from m2pem.verify.requirements.propositions import Labels, UnknownDataError
from m2pem.verify.requirements.requirement import Requirement
from m2pem.verify.search.explore import Limits, Progress, Stopped
from m2pem.verify.spin.never_claim import NeverClaim
from m2pem.verify.spin.programs import CheckerFolder, TooLongError
from m2pem.verify.spin.promela import Assertions, text_of
from m2pem.verify.spin.queries import ErrorKind, SpinQueries, Storage
from m2pem.verify.spin.search import SpinExploration
from m2pem.verify.spin.trail import Trail, TrailSystem, check_cycle, replay
from m2pem.verify.spin.trail import read as read_trail

_STEPS = "it is about single steps, which Spin is not asked: the built-in engine is"
_FAIRNESS = (
    "the run that Spin finds passes over something possible for ever, and such runs do not count; "
    "whether there is another, Spin is not asked: the built-in engine is"
)

BEYOND_SPIN = frozenset({_STEPS, _FAIRNESS})
"""Reasons for which Spin has no answer but the built-in search has."""


def check_requirement(
    found: SpinExploration,
    mission: Mission,
    fleet: Fleet,
    requirement: Requirement,
    *,
    limits: Limits | None = None,
    storage: Storage = Storage.EXACT,
    progress: Callable[[Progress], None] | None = None,
) -> Answer:
    """Check whether a requirement holds of a net that Spin has searched.

    Spin does not leave unfair runs out. If all runs meet a requirement, so do the fair ones; if one
    violates it, that run is checked for fairness.

    Raises:
        SpinMissingError: Spin or a compiler is not installed.
        InternalError: Spin's answer is wrong.
    """
    if found.stopped is Stopped.TOKENS:
        why = f"the search stopped at {found.stopped}"
        return Answer(requirement, Result.UNDECIDED, why=why)
    if needs_steps(requirement.formula):
        return Answer(requirement, Result.UNDECIDED, why=_STEPS)
    try:
        labels = Labels(found.net, mission, fleet, propositions(requirement.formula))
        asker = _ClaimQuery(found.encoding, labels, requirement)
        return asker.query(limits or Limits(), storage, progress)
    except UnknownDataError as error:
        return Answer(requirement, Result.UNDECIDED, why=str(error))


class _ClaimQuery:
    def __init__(self, encoding: Encoding, labels: Labels, requirement: Requirement) -> None:
        self.encoding = encoding
        self.labels = labels
        self.requirement = requirement
        self.watch = NeverClaim(requirement.formula, labels, encoding)

    def query(
        self, limits: Limits, storage: Storage, progress: Callable[[Progress], None] | None
    ) -> Answer:
        net = self.encoding.net
        model = text_of(net, self.encoding, Assertions(), self.watch)
        with CheckerFolder() as shop:
            queries = SpinQueries(shop, limits, storage, time.monotonic(), progress)
            try:
                result = queries.query(model, cycles=True)
            except TooLongError as error:
                return Answer(self.requirement, Result.UNDECIDED, why=str(error))
            states, seconds = result.report.states, queries.began_ago()
            if result.report.found is None:
                if result.stopped is None:
                    return self._answer(Result.HOLDS, states, seconds)
                why = f"the search stopped at {result.stopped}"
                return self._answer(Result.UNDECIDED, states, seconds, why)
            trail = read_trail(shop.trail(), model.transition_at)
        run = self._run(trail, whatever=result.report.found is ErrorKind.ASSERTION)
        if (
            self.requirement.fair
            and run.cycle
            and not TrailSystem(self.encoding, self.labels).fair(run)
        ):
            return self._answer(Result.UNDECIDED, states, seconds, _FAIRNESS)
        return self._answer(Result.VIOLATED, states, seconds, run=run)

    def _run(self, trail: Trail, *, whatever: bool) -> Run:
        check_cycle(self.encoding, trail)
        states = replay(self.encoding, trail.prefix + trail.cycle)
        moves = [
            Move(transition, state)
            for transition, state in zip(trail.prefix + trail.cycle, states[1:], strict=True)
        ]
        back_to = len(trail.prefix)
        run = Run(states[0], tuple(moves[:back_to]), tuple(moves[back_to:]), whatever)
        if not breaks(
            TrailSystem(self.encoding, self.labels), self.requirement.formula, run, steps=False
        ):
            raise InternalError("Spin found a run that does not break the formula")
        return run

    def _answer(
        self, result: Result, states: int, seconds: float, why: str = "", run: Run | None = None
    ) -> Answer:
        transitions = self.encoding.net.transitions
        return Answer(
            self.requirement,
            result,
            run,
            tuple(transitions[move.transition] for move in run.prefix) if run else (),
            tuple(transitions[move.transition] for move in run.cycle) if run else (),
            why,
            states,
            seconds,
        )
