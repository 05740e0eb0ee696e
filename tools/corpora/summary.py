"""Counts what became of many files."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from tools.corpora.examination import Examination, Outcome


@dataclass(slots=True)
class Summary:
    """Counts over files; `rules` and `ends` count files (and rehearsals), not findings."""

    files: int = 0
    outcomes: Counter[Outcome] = field(default_factory=Counter)
    rules: Counter[str] = field(default_factory=Counter)
    ends: Counter[str] = field(default_factory=Counter)
    problems: list[tuple[Path, str]] = field(default_factory=list)

    def add(self, path: Path, found: Examination) -> None:
        """Count one file."""
        self.files += 1
        self.outcomes[found.outcome] += 1
        self.rules.update(found.rules.keys())
        self.ends.update(found.ends)
        self.problems += [(path, problem) for problem in found.problems]

    def lines(self) -> Iterator[str]:
        """The counts, as text."""
        counted = ", ".join(f"{self.outcomes[each]} {each}" for each in Outcome)
        yield f"{self.files} files: {counted}"
        yield from _table("refused by rule (files)", self.rules)
        yield from _table("rehearsals", self.ends)
        yield f"problems of m2pem: {len(self.problems)}"
        for path, problem in self.problems:
            yield f"  {path}: {problem}"


def _table(title: str, counts: Counter[str]) -> Iterator[str]:
    if counts:
        yield f"{title}:"
    for name, count in sorted(counts.items(), key=lambda item: (-item[1], item[0])):
        yield f"  {count:6} {name}"
