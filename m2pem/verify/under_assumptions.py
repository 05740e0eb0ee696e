"""Answer each property and requirement under its assumptions, and without them.

The answer that counts is the one under the assumptions. Beside it is the answer where nothing is
assumed, with the run that violates it. Where nothing is assumed and something is violated because a
behavior fails, a short search says whether it would hold if no behavior failed; of a requirement
about all runs, another one whether it holds of fair ones.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

from m2pem.verify.assumptions import NO_FAILURES, NOTHING, Assumptions
from m2pem.verify.check import Report
from m2pem.verify.ltl.formula import needs_steps
from m2pem.verify.net.petri_net import Trigger
from m2pem.verify.properties.results import Result, Verdict, Violation
from m2pem.verify.requirements.requirement import Requirement
from m2pem.verify.search.explore import Limits, Stopped

REACHABLE = "no-dead-element"
"""The property that is judged without assumptions: what follows a failure is not dead because an
author assumes that nothing fails."""

WOULD_HOLD = frozenset(
    {"no-deadlock", "proper-completion", "can-complete", "completes-if-fair", "no-livelock"}
)
"""Properties of every mission of which it is said whether they would hold if no behavior failed.
Of the others that is no news: they are about failures, or about what is drawn."""

SMALL_STATES = 20_000
"""States up to which that is searched."""
SMALL_SECONDS = 5.0


class Checks(Protocol):
    """The checks of one mission by one engine."""

    def properties(self, assumed: Assumptions, limits: Limits) -> Report:
        """Check every property of missions."""

    def requirements(
        self, report: Report, asked: Sequence[Requirement], assumed: Assumptions, limits: Limits
    ) -> Report:
        """Return the report with the results of requirements added."""


def check_under_assumptions(
    checks: Checks,
    requirements: Sequence[Requirement],
    assumed: Assumptions,
    limits: Limits,
    *,
    short: Checks | None = None,
) -> Report:
    """Check all of a mission. `assumed`: what the whole check assumes; each requirement may assume
    more. `short`: the engine of short searches; None: that of all.

    All searches together end at the limit of time. An interrupted search is the last one.
    """
    return _Check(checks, short or checks, requirements, assumed, limits).report()


@dataclass(slots=True)
class _Check:
    checks: Checks
    short: Checks
    asked: Sequence[Requirement]
    assumed: Assumptions
    limits: Limits
    began: float = 0.0

    def report(self) -> Report:
        self.began = time.monotonic()
        groups: dict[Assumptions, list[Requirement]] = {self.assumed: []}
        for each in self.asked:
            groups.setdefault(self.assumed & each.assumed, []).append(each)
        report = self.checks.properties(self.assumed, self.limits)
        for assumed, group in groups.items():
            report = self._answer(report, group, assumed)
        results = [self._with_net(report, each) for each in report.results]
        without = self._without(report)
        if without is not None:
            plain = {_key(each): self._with_net(without, each) for each in without.results}
            results = [_beside(each, plain.get(_key(each))) for each in results]
        elif self.assumed:
            results = [_not_begun(each) for each in results]
        order = {each.id: n for n, each in enumerate(self.asked)}
        results.sort(key=lambda each: order[each.property] if each.required else -1)
        report = replace(report, results=tuple(results), assumed=self.assumed)
        if self.assumed:
            report = replace(report, without=without)
        return self._with_fair_hints(self._with_hints(report))

    def _answer(self, report: Report, group: Sequence[Requirement], under: Assumptions) -> Report:
        """Add the answers to requirements that make the same assumptions."""
        if not group:
            return report
        known = [self._with_net(report, each) for each in report.results]
        report = replace(report, results=tuple(known))
        found = self.checks.requirements(report, group, under, self._rest())
        own = [
            replace(self._with_net(found, each), assumed=under)
            for each in found.results[len(known) :]
        ]
        return replace(found, results=(*known, *own))

    def _with_net(self, report: Report, result: Result) -> Result:
        """Note what a result numbers, and what it assumes: other searches follow."""
        net = result.net or report.transitions_of(result)
        assumed = result.assumed if result.required else self.assumed
        return replace(result, net=net, assumed=assumed)

    def _without(self, report: Report) -> Report | None:
        """Check what assumes something once more, without that; None: nothing does, or a person has
        ended the search."""
        asked = [each for each in self.asked if self.assumed & each.assumed]
        if report.interrupted or not (self.assumed or asked):
            return None
        if self.assumed:
            plain = self.checks.properties(NOTHING, self._rest())
        else:
            plain = replace(report, results=())
        if not asked:
            return plain
        known = plain.results
        found = self.checks.requirements(plain, asked, NOTHING, self._rest())
        own = found.results[len(known) :]
        with_nets = (replace(each, net=found.transitions_of(each)) for each in own)
        return replace(found, results=(*known, *with_nets))

    def _rest(self) -> Limits:
        seconds = max(0.0, self.limits.seconds - (time.monotonic() - self.began))
        return replace(self.limits, seconds=seconds)

    # --- what would hold if no behavior failed ----------------------------------------------------

    def _with_hints(self, report: Report) -> Report:
        doubtful = {_key(each) for each in report.results if self._may_hold_without_failures(each)}
        small = self._small()
        if not doubtful or report.interrupted or report.states > SMALL_STATES:
            return report
        found = replace(report, results=(), engine="builtin")
        if any(not required for _, required in doubtful):
            found = self.short.properties(NO_FAILURES, small)
        asked = [each for each in self.asked if (each.id, True) in doubtful]
        found = self.short.requirements(found, asked, NO_FAILURES, small)
        holding = {_key(each) for each in found.results if each.verdict is Verdict.HOLDS}
        would_hold = doubtful & holding
        results = (
            replace(each, would_hold_if=NO_FAILURES) if _key(each) in would_hold else each
            for each in report.results
        )
        return replace(report, results=tuple(results))

    def _with_fair_hints(self, report: Report) -> Report:
        """Say which requirements about all runs hold of fair ones, maybe if no behavior fails."""
        violated = {each.property for each in report.results if _may_hold_of_fair_runs(each)}
        asked = [
            replace(each, fair=True)
            for each in self.asked
            if each.id in violated and not each.fair and not needs_steps(each.formula)
        ]
        for under in (NOTHING, NO_FAILURES):
            small = self._small()
            if not asked or report.interrupted or report.states > SMALL_STATES:
                break
            plain = replace(report, results=(), engine="builtin")
            found = self.short.requirements(plain, asked, under, small).results
            holding = {each.property for each in found if each.verdict is Verdict.HOLDS}
            results = (
                replace(each, would_hold_if=under, would_hold_if_fair=True)
                if each.required and each.property in holding
                else each
                for each in report.results
            )
            report = replace(report, results=tuple(results))
            asked = [each for each in asked if each.id not in holding]
        return report

    def _small(self) -> Limits:
        rest = self._rest()
        seconds = min(rest.seconds, SMALL_SECONDS)
        return replace(rest, states=min(rest.states, SMALL_STATES), seconds=seconds)

    def _may_hold_without_failures(self, result: Result) -> bool:
        """Whether all runs that are known to violate it have a failure, and nothing is assumed."""
        if result.assumed or not (result.required or result.property in WOULD_HOLD):
            return False
        return result.verdict is Verdict.VIOLATED and all(
            _has_failure(result, violation) for violation in result.violations
        )


def _has_failure(result: Result, violation: Violation) -> bool:
    net = result.net
    return net is not None and any(
        net.transitions[n].trigger is Trigger.FAILS for n in (*violation.run, *violation.cycle)
    )


def _may_hold_of_fair_runs(result: Result) -> bool:
    """Whether a requirement is violated, where nothing is assumed, by runs that go on for ever, or
    have a failure: each other run has fair ones that begin with it."""
    if not result.required or result.assumed or result.would_hold_if:
        return False
    return result.verdict is Verdict.VIOLATED and all(
        violation.cycle or _has_failure(result, violation) for violation in result.violations
    )


def _key(result: Result) -> tuple[str, bool]:
    return result.property, result.required


def _beside(result: Result, without: Result | None) -> Result:
    """Put the answer without assumptions beside the one that counts."""
    if without is None:
        return result
    without = replace(without, assumed=NOTHING)
    if not result.required and result.property == REACHABLE:
        return without
    return replace(result, without=without)


def _not_begun(result: Result) -> Result:
    if result.required or result.property != REACHABLE:
        return result
    why = f"not begun without the assumptions, after {Stopped.INTERRUPTED}"
    return replace(result, verdict=Verdict.UNDECIDED, violations=(), covered=why, assumed=NOTHING)
