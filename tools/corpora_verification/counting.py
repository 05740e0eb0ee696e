"""Counts what was said of many files, and what it took."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from tools.corpora_verification.judging import Terms
from tools.corpora_verification.measuring import Measured

_SHOWN = 10
"""Files of which one is told by name, of each kind."""


@dataclass(slots=True)
class Counts:
    """Over files. `wrong`: what should never be, a crash or more than the limits."""

    terms: Terms
    files: list[Measured] = field(default_factory=list)
    kinds: Counter[str] = field(default_factory=Counter)
    refused: Counter[str] = field(default_factory=Counter)
    filled: Counter[str] = field(default_factory=Counter)
    violated: Counter[str] = field(default_factory=Counter)
    undecided: Counter[str] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)

    def add(self, found: Measured) -> None:
        """Count one file."""
        self.files.append(found)
        said = found.judgement
        if said is None:
            self.kinds["crashed"] += 1
            self.wrong.append(f"{found.path}: {found.crash}")
            return
        if said.cpu_s > self.terms.seconds:
            self.wrong.append(f"{found.path}: {said.cpu_s:.2f} s of the processor's time")
        if found.peak_mb > self.terms.memory_mb:
            self.wrong.append(f"{found.path}: {found.peak_mb:.0f} MB")
        if said.refused:
            self.kinds["refused"] += 1
            self.refused.update(said.refused)
            return
        self.filled.update(said.filled)
        self.kinds["read as drawn" if not said.filled else "read, filled in"] += 1
        self.kinds["undecided" if said.undecided else "decided"] += 1
        self.kinds["no violation" if not said.violated else "violated"] += 1
        self.violated.update(said.violated.keys())
        self.undecided.update(
            {why.partition("stopped by ")[2] or why for why in said.undecided.values()}
        )

    def lines(self) -> Iterator[str]:
        """The counts, as text."""
        yield f"{len(self.files)} files"
        yield from _table("what became of them", self.kinds)
        yield from _table("refused by rule", self.refused)
        yield from _table("filled in, by rule", self.filled)
        yield from _table("violated, by property", self.violated)
        yield from _table("undecided", Counter(dict(self.undecided.most_common(_SHOWN * 3))))
        judged = [each.judgement for each in self.files if each.judgement is not None]
        yield _spread("processor", [each.cpu_s * 1e3 for each in judged], "ms")
        yield _spread("wall", [each.wall_s * 1e3 for each in judged], "ms")
        yield _spread("memory", [each.peak_mb for each in self.files], "MB")
        yield _spread("states", [each.states for each in judged if not each.refused], "")
        yield f"crashed, or beyond the limits: {len(self.wrong)}"
        yield from (f"  {each}" for each in self.wrong)


def _table(title: str, counts: Counter[str]) -> Iterator[str]:
    if counts:
        yield f"{title}:"
    for name, count in sorted(counts.items(), key=lambda item: (-item[1], item[0])):
        yield f"  {count:6} {name}"


def _spread(what: str, values: Sequence[float], unit: str) -> str:
    ordered = sorted(values) or [0.0]
    shares = [("median", 0.5), ("95 %", 0.95), ("99 %", 0.99)]
    said = [f"{name} {ordered[int(share * (len(ordered) - 1))]:.1f}" for name, share in shares]
    return f"{what}, {unit}: {', '.join(said)}, most {ordered[-1]:.1f}"
