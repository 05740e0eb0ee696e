"""What a verdict depends on: its assumptions, and the answer without them, in a sentence."""

from m2pem.verify.net.petri_net import Trigger
from m2pem.verify.properties.results import Result, Verdict
from m2pem.verify.report.findings import DescribedViolation, Findings

_MOST_STEPS = 2
_BREAKING = (Trigger.FAILS, Trigger.TIMER)
"""What comes from outside that assumptions are about."""


def condition_of(findings: Findings, answer: Result) -> str:
    """Return "if no behavior fails; without that: violated, by a run in which ..."; "" if there is
    nothing to be said.

    Of a property of every mission, nothing is said where it has one verdict with and without what
    the whole check assumes.
    """
    if answer.would_hold_if or answer.would_hold_if_fair:
        return _would_hold(answer)
    if not answer.assumed:
        return ""
    without = answer.without
    if without is None:
        return f"if {answer.assumed.english}"
    if not answer.required and without.verdict is answer.verdict:
        return ""
    said = f"if {answer.assumed.english}; without that: {_verdict(findings, without)}"
    violation = findings.violation_without(answer)
    if without.verdict is not Verdict.VIOLATED or violation is None:
        return said
    steps = breaking_steps(violation)
    if answer.verdict is Verdict.VIOLATED or not steps:
        return said
    shown = " and ".join(steps[:_MOST_STEPS]) + (", ..." if steps[_MOST_STEPS:] else "")
    return f"{said}, by a run in which {shown}"


def _would_hold(answer: Result) -> str:
    """Return when a requirement or property that is violated holds, and how that is written."""
    when, written = [], []
    if answer.would_hold_if:
        when.append(answer.would_hold_if.english)
        written.append(f"assume {answer.would_hold_if}")
    if answer.would_hold_if_fair:
        when.append("only fair runs count")
        written.append("fair true")
    return f"it holds if {' and '.join(when)} ({', '.join(written)})"


def _verdict(findings: Findings, answer: Result) -> str:
    if answer.verdict is Verdict.VIOLATED and not findings.counts(answer):
        return "warning"
    return answer.verdict.value


def breaking_steps(violation: DescribedViolation) -> list[str]:
    """The steps of a run that assumptions may exclude: failures and timers."""
    run = (*violation.run_steps, *violation.loop)
    return [each.text.partition("; ")[0] for each in run if each.trigger in _BREAKING]


def assumes(findings: Findings) -> bool:
    """Whether any verdict that holds depends on an assumption."""
    return any(
        each.assumed and each.verdict is Verdict.HOLDS
        for each in findings.results
        if each.without is None or each.without.verdict is not Verdict.HOLDS
    )
