"""The table of conformance as Markdown, between two marks of a page.

Cases of an element that every engine treats alike share a row. m2pem has no column: a test sees to
it that m2pem does as BPMN says in each case. The page says whether an engine differs; how it does
is printed.
"""

import re
from collections import Counter, defaultdict
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
_WORDS = {"same": "yes", "n.a.": "-", "differs": ""}
_NOISE = re.compile(r"ValidationException: (NotImplementedError\(')?|: %r'| with id [0-9a-f-]{36}")
"""Of the words of engines: what says nothing, and what differs from run to run."""

Verdicts = Mapping[str, Sequence[Verdict]]
"""What each engine, by name and version, did in each of the cases."""


def render(cases: Sequence[Case], verdicts: Verdicts, *, details: bool) -> str:
    """Counts first, then a table for each chapter. `details`: with how engines differ, and why."""
    parts = [_summary(verdicts)]
    for chapter in dict.fromkeys(case.topic.parent.name for case in cases):
        rows = [number for number, case in enumerate(cases) if case.topic.parent.name == chapter]
        parts.append(f"### {_title(chapter)}\n\n{_chapter(rows, cases, verdicts, details)}")
    return "\n".join(parts)


def names(cases: Sequence[Case]) -> list[tuple[str, str]]:
    """Element and variant of each case, as `read_names` finds them."""
    return sorted((_plain(case.element), _plain(case.variant)) for case in cases)


def read_names(page: str) -> list[tuple[str, str]]:
    """Element and variant of each case in the page's tables by chapter."""
    tables = page.partition(_BEGIN)[2].partition(_END)[0].partition("### ")[2]
    found, element = [], ""
    for row in re.findall(r"^\| (?!element|---)(.*)", tables, re.M):
        first, variants = row.split(" | ")[:2]
        element = first.strip() or element
        found += [(element, variant) for variant in variants.partition(r" \[")[0].split("; ")]
    return sorted(found)


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


def _chapter(rows: Sequence[int], cases: Sequence[Case], verdicts: Verdicts, details: bool) -> str:
    others = [name for name in verdicts if name != "m2pem"]
    alike: dict[str, dict[str, list[str]]] = defaultdict(lambda: defaultdict(list))
    for row in rows:
        case = cases[row]
        why = f" {_plain(f'[{case.extension}]')}" if case.extension else ""
        cells = " | ".join([why, *(_cell(verdicts[name][row], details) for name in others)])
        alike[_plain(case.element)][cells].append(_plain(case.variant))
    lines = [f"| element | variants | {' | '.join(others)} |", "|---|---|" + "---|" * len(others)]
    for element, variants in alike.items():
        first = element
        for cells, those in variants.items():
            lines.append(f"| {first} | {'; '.join(those)}{cells} |")
            first = ""
    return "\n".join(lines) + "\n"


def _cell(verdict: Verdict, details: bool) -> str:
    if not details:
        return {"same": "yes", "n.a.": "-"}.get(verdict.kind, verdict.kind)
    word = _WORDS.get(verdict.kind, verdict.kind)
    words = "" if verdict.kind == "n.a." else _NOISE.sub("", verdict.words)
    return _plain(": ".join(part for part in (word, words) if part))


def _plain(text: str) -> str:
    """Text that means itself in a cell."""
    return re.sub(r"([|<>*_\[\]])", r"\\\1", " ".join(text.split()))
