"""The report for a terminal: a line a property, then each violation with its run."""

from collections.abc import Callable, Collection, Iterator

from m2pem.verify.net.petri_net import Exactness
from m2pem.verify.properties.results import Result, Verdict
from m2pem.verify.report.conditions import assumes, condition_of
from m2pem.verify.report.findings import Coverage, DescribedViolation, Findings
from m2pem.verify.report.run_steps import RunStep

_MOST_ROUGH = 5
"""Most approximations that are listed; a report file has them all."""
_MEANING = {
    Exactness.MORE: "an alarm may be false",
    Exactness.BOUNDED: "what holds, holds up to that",
}

Paint = Callable[[str, str], str]
"""A text in a colour (`green`, `red`, `yellow`, `cyan`)."""

WARNING = "warning"
"""The word for a violation of what is only a warning."""
_COLOUR = {"holds": "green", "violated": "red"}
_MOST_STEPS = 40
"""Most steps of a run that are printed; the beginning of a longer one is left out."""


def plain(text: str, _: str) -> str:
    """Return a text without colours."""
    return text


def as_text(
    findings: Findings, paint: Paint = plain, *, printed: Collection[str] = frozenset()
) -> str:
    """Return the whole report. `printed`: properties and requirements without a line in it."""
    lines = [*_properties(findings, paint, printed)]
    for violation in findings.violations:
        if violation.answer.warning and not findings.strict:
            continue
        lines += ["", *_violation(violation, paint)]
    warnings = [v for v in findings.violations if v.answer.warning and not findings.strict]
    if warnings:
        lines.append("")
        lines += [
            f"{paint('warning', 'yellow')}: {_shown(v.found.message)}{_shown(_doubt(v, ' (', ')'))}"
            for v in warnings
        ]
    lines.append("")
    lines += [f"note: {_shown(each)}" for each in (*findings.coverage.notes, *_rough(findings))]
    lines.append(_summary(findings, paint))
    return "\n".join(lines)


def _rough(findings: Findings) -> Iterator[str]:
    approximations = findings.net.approximations
    for each in approximations[:_MOST_ROUGH]:
        element = findings.mission.elements.get(each.element)
        name = f" ({element.name})" if element is not None and element.name.strip() else ""
        yield f"{each.element}{name}: {each.what}; {_MEANING[each.exactness]}"
    if len(approximations) > _MOST_ROUGH:
        yield f"and {len(approximations) - _MOST_ROUGH} more like these"


def _properties(findings: Findings, paint: Paint, printed: Collection[str]) -> Iterator[str]:
    width = max(len(answer.property) for answer in findings.results)
    for answer in findings.results:
        condition = condition_of(findings, answer)
        if answer.property not in printed:
            yield from result_lines(answer, width, paint, strict=findings.strict, note=condition)
        elif condition:
            yield f"{answer.property}: {_shown(condition)}"


def word_of(answer: Result, *, strict: bool) -> str:
    """Return the verdict, or "warning". `strict`: warnings are violations."""
    if answer.warning and not strict and answer.violations:
        return WARNING
    return answer.verdict.value


def result_lines(
    answer: Result, width: int, paint: Paint, *, strict: bool, note: str = ""
) -> Iterator[str]:
    """Return the line of a property or requirement, and what its author says of it.

    `width`: of the column of names. `strict`: warnings are violations. `note`: on what its verdict
    depends.
    """
    word = word_of(answer, strict=strict)
    colour = _COLOUR.get(word, "yellow")
    extent = f" ({answer.covered})" if answer.covered else ""
    run_step = _shown(f"{answer.property:<{width}}  {answer.text}{extent}")
    yield f"{paint(f'{word:<9}', colour)}  {run_step}"
    if note:
        yield f"{'':<{width + 13}}{_shown(note)}"
    if answer.author:
        yield f"{'':<{width + 13}}for: {_shown(answer.author)}"


def _doubt(violation: DescribedViolation, before: str, after: str = "") -> str:
    doubt = violation.found.doubt
    return f"{before}may be a false alarm: {doubt}{after}" if doubt else ""


def _violation(violation: DescribedViolation, paint: Paint) -> Iterator[str]:
    colour = "yellow" if violation.found.doubt else "red"
    yield f"{paint(violation.answer.property, colour)}: {_shown(violation.found.message)}"
    if violation.found.doubt:
        yield f"  {_shown(_doubt(violation, ''))}"
    if violation.found.elements:
        yield f"  at {_shown(', '.join(violation.found.elements))}"
    if violation.run_steps or violation.loop:
        yield "  the run:"
        yield from _steps(violation.run_steps)
    if violation.loop:
        yield "  and then, again and again:"
        yield from _steps(violation.loop)


def _steps(run_steps: tuple[RunStep, ...]) -> Iterator[str]:
    if len(run_steps) > _MOST_STEPS:
        yield f"       ... {len(run_steps) - _MOST_STEPS} steps before"
    for run_step in run_steps[-_MOST_STEPS:]:
        yield f"  {run_step.number:>4}. {_shown(run_step.text)}"


def _shown(text: str) -> str:
    """Remove control characters: names come from other people's files."""
    return "".join(each if each.isprintable() else "?" for each in text)


def covered(coverage: Coverage) -> str:
    """Return the extent of the search as text."""
    found = f"{coverage.states:,} states and {coverage.transitions:,} steps"
    by = " by Spin" if coverage.engine == "spin" else ""
    took = f"in {coverage.seconds * 1000:.0f} ms{by}"
    if coverage.stopped:
        return f"{found} were searched {took}; then {coverage.stopped} ended the search"
    return f"{found}, all that there are, were searched {took}"


def _summary(findings: Findings, paint: Paint) -> str:
    verdict = findings.verdict
    colour = _COLOUR.get(verdict.value, "yellow")
    said = {
        Verdict.HOLDS: "everything holds" + (" as assumed" if assumes(findings) else ""),
    }.get(verdict, verdict.value)
    process = findings.net.process
    summary = f"{_shown(findings.mission.file)}: {process}: {paint(said, colour)}"
    text = f"{summary}; {covered(findings.coverage)}"
    rough = len(findings.net.approximations)
    if rough:
        places = "place" if rough == 1 else "places"
        text += f"; at {rough} {places} the net is not exactly the mission (see --report)"
    return text
