"""The report as Markdown, with a picture for each violation."""

from collections.abc import Iterator, Mapping, Sequence
from xml.sax.saxutils import escape

from m2pem.verify.properties.results import Verdict
from m2pem.verify.report.conditions import condition_of
from m2pem.verify.report.findings import DescribedViolation, Findings
from m2pem.verify.report.run_steps import RunStep
from m2pem.verify.report.text import covered


def as_markdown(findings: Findings, pictures: Mapping[int, Sequence[str]]) -> str:
    """The whole report. `pictures`: for each violation, from 0, the file names of its diagrams."""
    return "\n".join(_lines(findings, pictures)) + "\n"


def _lines(findings: Findings, pictures: Mapping[int, Sequence[str]]) -> Iterator[str]:
    yield f"# {_plain(findings.mission.file)}: {findings.verdict.value}"
    yield ""
    yield f"Process `{findings.net.process}`. {_sentence(covered(findings.coverage))}"
    for note in findings.coverage.notes:
        yield _plain(_sentence(note))
    yield ""
    yield "| property or requirement | verdict | what it says |"
    yield "|---|---|---|"
    for answer in findings.results:
        verdict = answer.verdict.value
        if answer.violations and not findings.counts(answer):
            verdict = "warning"
        said = [answer.text, *([f"({answer.covered})"] if answer.covered else [])]
        condition = condition_of(findings, answer)
        said += [_sentence(condition)] if condition else []
        said += [f"For: {answer.author}"] if answer.author else []
        yield f"| `{answer.property}` | {verdict} | {_plain(' '.join(said))} |"
    for number, violation in enumerate(findings.violations):
        yield ""
        yield from _violation(violation, pictures.get(number, ()))
    rough = findings.net.approximations
    if rough:
        yield ""
        yield "## Where the net is not exactly the mission"
        yield ""
        for each in rough:
            yield f"- `{each.element}` ({each.exactness.value}): {_plain(each.what)}"


def _violation(violation: DescribedViolation, pictures: Sequence[str]) -> Iterator[str]:
    doubt = violation.found.doubt
    kind = (Verdict.MAY_BE_VIOLATED if doubt else Verdict.VIOLATED).value
    if violation.answer.warning:
        kind = "warning"
    yield f"## {violation.answer.property}: {kind}"
    yield ""
    yield _plain(_sentence(violation.found.message))
    if doubt:
        yield _plain(_sentence(f"may be a false alarm: {doubt}"))
    if violation.found.elements:
        yield ""
        yield f"At {', '.join(f'`{each}`' for each in violation.found.elements)}."
    for picture in pictures:
        yield ""
        yield f"![{violation.answer.property}]({picture})"
    if violation.run_steps:
        yield ""
        yield from _steps(violation.run_steps)
    if violation.loop:
        yield ""
        yield "And then, again and again:"
        yield ""
        yield from _steps(violation.loop)


def _steps(run_steps: tuple[RunStep, ...]) -> Iterator[str]:
    for run_step in run_steps:
        yield f"{run_step.number}. {_plain(run_step.text)}"


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}."


def _plain(text: str) -> str:
    """Escape names: they come from people's files, and must not be read as Markdown or HTML."""
    marked = escape(text)
    for sign in "\\`*_[]|#":
        marked = marked.replace(sign, f"\\{sign}")
    return marked
