"""The table of conformance as Markdown, between two marks of a page."""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

from tests.cases import Case
from tools.conformance.verdict import Verdict

PAGE = Path(__file__).parents[2] / "docs" / "bpmn-support.md"
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
_WORDS = {"same": "yes", "n.a.": "-"}

Verdicts = Mapping[str, Sequence[Verdict]]
"""What each engine, by name and version, did in each of the cases."""


def render(cases: Sequence[Case], verdicts: Verdicts) -> str:
    """Counts first, then a table for each chapter."""
    parts = [_summary(verdicts)]
    for chapter in dict.fromkeys(case.topic.parent.name for case in cases):
        rows = [number for number, case in enumerate(cases) if case.topic.parent.name == chapter]
        parts.append(f"### {_title(chapter)}\n\n{_chapter(rows, cases, verdicts)}")
    return "\n".join(parts)


def own_column(cases: Sequence[Case], own: Sequence[Verdict]) -> list[tuple[str, str, str]]:
    """Element, variant and m2pem's cell of each row, as `read_own_column` finds them."""
    return [
        (_plain(case.element), _variant(case), _cell(verdict))
        for case, verdict in zip(cases, own, strict=True)
    ]


def read_own_column(page: str) -> list[tuple[str, str, str]]:
    """The first three cells of the rows of the page's tables by chapter."""
    tables = page.partition(_BEGIN)[2].partition(_END)[0].partition("### ")[2]
    rows = [re.split(r"(?<!\\)\|", line)[1:4] for line in tables.splitlines() if line[:1] == "|"]
    cells = [tuple(cell.strip() for cell in row) for row in rows]
    return [(a, b, c) for a, b, c in cells if a not in ("element", "---")]


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


def _chapter(rows: Sequence[int], cases: Sequence[Case], verdicts: Verdicts) -> str:
    lines = [
        f"| element | variant | {' | '.join(verdicts)} |",
        "|---|---|" + "---|" * len(verdicts),
    ]
    for row in rows:
        cells = " | ".join(_cell(found[row]) for found in verdicts.values())
        lines.append(f"| {_plain(cases[row].element)} | {_variant(cases[row])} | {cells} |")
    return "\n".join(lines) + "\n"


def _variant(case: Case) -> str:
    return _plain(f"{case.variant} [{case.extension}]" if case.extension else case.variant)


def _cell(verdict: Verdict) -> str:
    word = _WORDS.get(verdict.kind, verdict.kind)
    if verdict.kind == "n.a." and verdict.words:
        return _plain(f"{word} ({verdict.words})")
    return _plain(f"{word}: {verdict.words}" if verdict.words else word)


def _plain(text: str) -> str:
    """Text that means itself in a cell."""
    return re.sub(r"([|<>*_\[\]])", r"\\\1", " ".join(text.split()))
