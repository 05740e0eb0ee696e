"""Cases of the static rules, in a short notation: a file that breaks one rule, and how to mend it.

    # lone-condition | f | the only flow
    <task id="A"/> [S>A]
    ! <sequenceFlow id="f" sourceRef="A" targetRef="E">
    ~ "E"/> => "E" name="x"/>

The first line has the rule, the element that its finding names and a part of what it says, then
rules that may break along. The lines after it stand in a process; those with `^` stand
behind the process, in `definitions`. `!` marks the line of the finding (else it is that of the
process), `[A>B]` is a sequence flow, `*` a start event, an end event and the flow between, `*T` the
same with the element T between. `~` says which text, replaced by which, makes the file keep the
rule; `~~` goes on with such a line.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass

from bpmn_text import definitions, findings, flow, line_of

from m2pem.bpmn.rules.registry import RULES

BY_SLUG = {rule.slug: rule for rule in RULES}
PLAIN = f'<startEvent id="S"/><endEvent id="E"/>{flow("S", "E")}'
_FLOW = re.compile(r"\[(\w+)>(\w+)\]")


@dataclass(frozen=True, slots=True)
class Case:
    """A file that breaks a rule, where the finding is, and its twin that keeps the rule."""

    rule: str
    element: str
    says: str
    also: tuple[str, ...]
    line: int
    broken: bytes
    kept: bytes


def read_cases(text: str) -> list[Case]:
    """All cases of a text."""
    return [_case(block) for block in re.split(r"^# ", text, flags=re.M)[1:]]


def _case(block: str) -> Case:
    head, *lines = block.strip().replace("\n~~ ", "").splitlines()
    rule, element, says, *also = (part.strip() for part in head.split("|"))
    changes = [line[2:].partition(" =>") for line in lines if line.startswith("~ ")]
    drawn = [line for line in lines if not line.startswith("~ ")]
    if all(line.startswith("^") for line in drawn):
        drawn.insert(0, "*")
    inside = [line for line in drawn if not line.startswith("^")]
    behind = [line[1:].lstrip(" ") for line in drawn if line.startswith("^")]
    marked = ["", *inside, "", *behind]  # the process's tags are lines of their own
    line = next((number for number, each in enumerate(marked, 2) if each.startswith("!")), 2)
    body, roots = "\n".join(_expanded(inside)), "\n".join(_expanded(behind))
    xml = f'<process id="P" isExecutable="true">\n{body}\n</process>\n{roots}'
    mended = xml
    for old, _, new in changes:
        assert old in mended, f"{rule}: {old}"
        mended = mended.replace(old, new.removeprefix(" "))
    assert changes, rule
    return Case(rule, element, says, tuple(also), line, definitions(xml), definitions(mended))


def _expanded(lines: list[str]) -> Iterator[str]:
    for line in lines:
        text = line.removeprefix("! ")
        if text == "*":
            yield PLAIN
        elif text.startswith("*"):
            yield line_of(text[1:])
        else:
            yield _FLOW.sub(lambda ends: flow(ends[1], ends[2]), text)


def names(cases: list[Case]) -> list[str]:
    """Names for a table of cases."""
    return [f"{case.rule}-{number}" for number, case in enumerate(cases)]


def assert_breaks_its_rule_alone(case: Case) -> None:
    """The rule is found once, with its number, place and sentence; and not in the twin."""
    rule = BY_SLUG[case.rule]
    broken, kept = findings(case.broken), findings(case.kept)
    (found,) = (each for each in broken if each.rule == case.rule)
    assert (found.line, found.element) == (case.line, case.element)
    assert found.number == rule.code
    assert case.says in found.message
    assert found.remedy
    more = {each.rule for each in broken} - {each.rule for each in kept}
    assert {each for each in more if BY_SLUG[each].code[0] == "B"} <= {case.rule, *case.also}
    assert case.rule not in {each.rule for each in kept}
