"""Everything that a report says, worked out once, whatever it is written as."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from m2pem.drawing import Marks
from m2pem.model.mission import Mission
from m2pem.model.values import Value
from m2pem.verify.answers import Answers
from m2pem.verify.report.stuck import why_stuck
from m2pem.verify.report.telling import Token, Told, encoding_of, tell, tokens_of
from m2pem.verify.report.words import Words
from m2pem.verify.results import Result, Verdict, Violation
from m2pem.verify.system import System


@dataclass(frozen=True, slots=True)
class Violated:
    """One way in which a property is violated, with its run told.

    `story`: the run; `loop`: what can then follow again and again. `tokens`: where they are at
    the end. `missing`: flows by which a token is waited for that never comes.
    """

    answer: Result
    found: Violation
    story: tuple[Told, ...]
    loop: tuple[Told, ...]
    tokens: tuple[Token, ...]
    missing: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Findings:
    """What was found about a mission. `violations`: those that count, then warnings.

    `given`: the data that the run begins with.
    """

    mission: Mission
    system: System
    answers: Answers
    violations: tuple[Violated, ...]
    strict: bool = False
    given: Mapping[str, Value] = field(default_factory=dict)

    def counts(self, answer: Result) -> bool:
        """Whether a violation of this property is one, and not a warning."""
        return self.strict or not answer.warning

    @property
    def exit_status(self) -> int:
        """Of the command line."""
        return self.answers.exit_status(strict=self.strict)

    @property
    def verdict(self) -> Verdict:
        """Of the mission as a whole."""
        by_status = {0: Verdict.HOLDS, 1: Verdict.VIOLATED, 3: Verdict.UNDECIDED}
        return by_status[self.exit_status]


def findings_of(
    mission: Mission,
    system: System,
    answers: Answers,
    *,
    strict: bool = False,
    given: Mapping[str, Value] | None = None,
) -> Findings:
    """Tells the runs of all that is violated."""
    words = Words(mission)
    told = [
        _told(system, words, answer, each)
        for answer in answers.answers
        for each in answer.violations
    ]
    told.sort(key=lambda each: each.answer.warning)
    return Findings(mission, system, answers, tuple(told), strict, given or {})


def marks_of(violation: Violated, unreached: frozenset[str] = frozenset()) -> Marks:
    """What a drawing shows of it."""
    steps: Sequence[Sequence[str]] = [told.passes for told in (*violation.story, *violation.loop)]
    wrong = dict.fromkeys(violation.found.elements, violation.found.message)
    waiting = {
        token.flow or token.element: f"{token.count} token{'s' if token.count > 1 else ''} here"
        for token in violation.tokens
        if token.element not in wrong and not token.flow
    }
    tokens = frozenset(token.flow or token.element for token in violation.tokens)
    return Marks(steps, wrong, waiting, tokens, frozenset(violation.missing), unreached)


def _told(system: System, words: Words, answer: Result, found: Violation) -> Violated:
    if not found.run and not found.cycle:
        return Violated(answer, found, (), (), ())
    story, state = tell(system, words, found.run)
    loop, state = tell(system, words, found.cycle, begin=len(story), at=state)
    tokens = tokens_of(encoding_of(system), state)
    stuck = why_stuck(words, story, tokens) if answer.property == "no-deadlock" else []
    missing = tuple(flow for each in stuck for flow in each.missing)
    return Violated(answer, found, story, loop, tokens, missing)
