"""Asking Spin whether a mission does what its author requires."""

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
from m2pem.verify.spin.never_claim import Watch
from m2pem.verify.spin.programs import TooLongError, Workshop
from m2pem.verify.spin.promela import Asks, text_of
from m2pem.verify.spin.queries import Asking, Storage
from m2pem.verify.spin.queries import Found as Kind
from m2pem.verify.spin.search import Found
from m2pem.verify.spin.trail import Trail, Walking, check_cycle, replay
from m2pem.verify.spin.trail import read as read_trail

_STEPS = "it is about single steps, which Spin is not asked: the built-in engine is"
_FAIRNESS = (
    "the run that Spin finds passes over something possible for ever, and such runs do not count; "
    "whether there is another, Spin is not asked: the built-in engine is"
)

BEYOND_SPIN = frozenset({_STEPS, _FAIRNESS})
"""What stands in the way of an answer where the built-in engine has one."""


def check_requirement(
    found: Found,
    mission: Mission,
    fleet: Fleet,
    requirement: Requirement,
    *,
    limits: Limits | None = None,
    storage: Storage = Storage.EXACT,
    progress: Callable[[Progress], None] | None = None,
) -> Answer:
    """Whether a requirement holds of a system that Spin has searched.

    Runs that pass over something for ever are not left out by Spin: if all runs keep to a
    requirement, so do the fair ones; if one breaks it, it is looked at whether that one is fair.

    Raises:
        SpinMissingError: Spin or a compiler is not installed.
        InternalError: Spin says something that is not so.
    """
    if found.stopped is Stopped.TOKENS:
        why = f"the search stopped at {found.stopped}"
        return Answer(requirement, Result.UNDECIDED, why=why)
    if needs_steps(requirement.formula):
        return Answer(requirement, Result.UNDECIDED, why=_STEPS)
    try:
        labels = Labels(found.system, mission, fleet, propositions(requirement.formula))
        asker = _Asker(found.encoding, labels, requirement)
        return asker.ask(limits or Limits(), storage, progress)
    except UnknownDataError as error:
        return Answer(requirement, Result.UNDECIDED, why=str(error))


class _Asker:
    def __init__(self, encoding: Encoding, labels: Labels, requirement: Requirement) -> None:
        self.encoding = encoding
        self.labels = labels
        self.requirement = requirement
        self.watch = Watch(requirement.formula, labels, encoding)

    def ask(
        self, limits: Limits, storage: Storage, progress: Callable[[Progress], None] | None
    ) -> Answer:
        system = self.encoding.system
        model = text_of(system, self.encoding, Asks(), self.watch)
        with Workshop() as shop:
            asking = Asking(shop, limits, storage, time.monotonic(), progress)
            try:
                told = asking.ask(model, cycles=True)
            except TooLongError as error:
                return Answer(self.requirement, Result.UNDECIDED, why=str(error))
            states, seconds = told.report.states, asking.began_ago()
            if told.report.found is None:
                if told.stopped is None:
                    return self._answer(Result.HOLDS, states, seconds)
                why = f"the search stopped at {told.stopped}"
                return self._answer(Result.UNDECIDED, states, seconds, why)
            trail = read_trail(shop.trail(), model.rule_at)
        run = self._run(trail, whatever=told.report.found is Kind.ASSERTION)
        if (
            self.requirement.fair
            and run.cycle
            and not Walking(self.encoding, self.labels).fair(run)
        ):
            return self._answer(Result.UNDECIDED, states, seconds, _FAIRNESS)
        return self._answer(Result.VIOLATED, states, seconds, run=run)

    def _run(self, trail: Trail, *, whatever: bool) -> Run:
        check_cycle(self.encoding, trail)
        states = replay(self.encoding, trail.prefix + trail.cycle)
        moves = [
            Move(rule, state)
            for rule, state in zip(trail.prefix + trail.cycle, states[1:], strict=True)
        ]
        back_to = len(trail.prefix)
        run = Run(states[0], tuple(moves[:back_to]), tuple(moves[back_to:]), whatever)
        if not breaks(
            Walking(self.encoding, self.labels), self.requirement.formula, run, steps=False
        ):
            raise InternalError("Spin found a run that does not break the formula")
        return run

    def _answer(
        self, result: Result, states: int, seconds: float, why: str = "", run: Run | None = None
    ) -> Answer:
        rules = self.encoding.system.rules
        return Answer(
            self.requirement,
            result,
            run,
            tuple(rules[move.rule] for move in run.prefix) if run else (),
            tuple(rules[move.rule] for move in run.cycle) if run else (),
            why,
            states,
            seconds,
        )
