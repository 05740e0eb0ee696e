"""The tables of conformance as Markdown: counts by element in a page, each case in the results.

m2pem has no column: a test sees to it that m2pem does as BPMN says in each case.
"""

import re
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TypeAlias

from tests.cases import Case
from tools.conformance.verdict import Verdict

REPOSITORY = Path(__file__).parents[2]
PAGE = REPOSITORY / "docs" / "bpmn-support.md"
RESULTS = REPOSITORY / "bench" / "results" / "conformance.md"
_BEGIN, _END = "<!-- begin: make conformance -->", "<!-- end: make conformance -->"
_CHAPTERS = {
    "8-9": "Messages and pools (chapters 8 and 9)",
    "10.3": "Activities (10.3)",
    "10.4": "Data (10.4)",
    "10.5": "Events (10.5)",
    "10.6": "Gateways (10.6)",
    "10.7": "Compensation (10.7)",
    "10.8": "Lanes (10.8)",
    "13.2": "Processes (13.2)",
}
_KINDS = ("same", "differs", "refuses", "hangs", "crashes", "n.a.")
_WORDS = {"same": "yes", "n.a.": "-", "differs": ""}
_NOISE = re.compile(r"ValidationException: (NotImplementedError\(')?|: %r'| with id [0-9a-f-]{36}")
"""Of the words of engines: what says nothing, and what differs from run to run."""

Verdicts = Mapping[str, Sequence[Verdict]]
"""What each engine, by name and version, did in each of the cases."""


def summary(cases: Sequence[Case], verdicts: Verdicts) -> str:
    """Counts of all cases, then by element how many an engine does as BPMN says."""
    return _render(cases, verdicts, _counted)


def details(cases: Sequence[Case], verdicts: Verdicts) -> str:
    """The file of results: each case; those of an element that all treat alike share a row."""
    head = """# Conformance, case by case

Written by `make conformance`; [BPMN support](../../docs/bpmn-support.md) says what is compared.
`yes`: as BPMN says. `lacks`, `adds`: at the first step that differed, elements that were not
entered, or were entered besides. `-`: not asked, as the case needs what is in brackets.

"""
    return head + _render(cases, verdicts, _alike)


def _render(cases: Sequence[Case], verdicts: Verdicts, rows_of: "_Rows") -> str:
    others = [name for name in verdicts if name != "m2pem"]
    parts = [_summary(verdicts)]
    for chapter in dict.fromkeys(case.topic.parent.name for case in cases):
        rows = [number for number, case in enumerate(cases) if case.topic.parent.name == chapter]
        lines = [
            f"| element | variants | {' | '.join(others)} |",
            "|---|---|" + "---|" * len(others),
            *rows_of(rows, cases, [verdicts[name] for name in others]),
        ]
        parts.append("\n".join([f"### {_title(chapter)}\n", *lines, ""]))
    return "\n".join(parts)


def names(cases: Sequence[Case]) -> list[tuple[str, str]]:
    """Element and variant of each case, as `read_names` finds them."""
    return sorted((_plain(case.element), _plain(case.variant)) for case in cases)


def read_names(page: str) -> list[tuple[str, str]]:
    """Element and variant of each case in the page's tables by chapter."""
    tables = page.partition(_BEGIN)[2].partition(_END)[0].partition("### ")[2]
    rows = re.findall(r"^\| (?!element|---)(.*?) \| (.*?) \|", tables, re.M)
    return sorted((element, each) for element, variants in rows for each in variants.split("; "))


def write(page: str, table: str) -> str:
    """The page with the table between its marks."""
    before, rest = page.split(_BEGIN)
    return f"{before}{_BEGIN}\n\n{table}\n{_END}{rest.split(_END)[1]}"


def _title(chapter: str) -> str:
    number = re.match(r"[\d.-]+\d", chapter)
    return _CHAPTERS.get(number[0] if number else "", chapter)


def _summary(verdicts: Verdicts) -> str:
    head = "| | as BPMN says | differs | refuses | hangs | crashes | not asked |"
    lines = [head, "|---|---|---|---|---|---|---|"]
    for name, found in verdicts.items():
        counts = Counter(verdict.kind for verdict in found)
        lines.append(f"| {name} | " + " | ".join(str(counts[kind]) for kind in _KINDS) + " |")
    return "\n".join(lines) + "\n"


_Rows: TypeAlias = Callable[
    [Sequence[int], Sequence[Case], Sequence[Sequence[Verdict]]], Iterable[str]
]


def _counted(
    rows: Sequence[int], cases: Sequence[Case], verdicts: Sequence[Sequence[Verdict]]
) -> Iterator[str]:
    """A row for each element."""
    elements: dict[str, list[int]] = defaultdict(list)
    for row in rows:
        elements[_plain(cases[row].element)].append(row)
    for element, those in elements.items():
        variants = "; ".join(_plain(cases[row].variant) for row in those)
        counts = (_count([found[row].kind for row in those]) for found in verdicts)
        yield f"| {element} | {variants} | {' | '.join(counts)} |"


def _count(kinds: Sequence[str]) -> str:
    asked = [kind for kind in kinds if kind != "n.a."]
    return f"{asked.count('same')} of {len(asked)}" if asked else "-"


def _alike(
    rows: Sequence[int], cases: Sequence[Case], verdicts: Sequence[Sequence[Verdict]]
) -> Iterator[str]:
    """Rows for each element, with what each engine did."""
    alike: dict[str, dict[str, list[str]]] = defaultdict(lambda: defaultdict(list))
    for row in rows:
        case = cases[row]
        why = f" {_plain(f'[{case.extension}]')}" if case.extension else ""
        cells = " | ".join([why, *(_cell(found[row]) for found in verdicts)])
        alike[_plain(case.element)][cells].append(_plain(case.variant))
    for element, variants in alike.items():
        first = element
        for cells, those in variants.items():
            yield f"| {first} | {'; '.join(those)}{cells} |"
            first = ""


def _cell(verdict: Verdict) -> str:
    word = _WORDS.get(verdict.kind, verdict.kind)
    words = "" if verdict.kind == "n.a." else _NOISE.sub("", verdict.words)
    return _plain(": ".join(part for part in (word, words) if part))


def _plain(text: str) -> str:
    """Text that means itself in a cell."""
    return re.sub(r"([|<>*_\[\]])", r"\\\1", " ".join(text.split()))
