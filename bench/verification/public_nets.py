"""Measures `m2pem verify` on the IBM collection: `python -m bench.verification.public_nets FOLDER`.

The collection has 1,386 workflow nets of industrial business processes, in five libraries, whose
soundness is published (Fahland et al.: Analysis on demand: Instantaneous soundness checking of
industrial business process models. Data & Knowledge Engineering 70, 2011). FOLDER is that of a copy
with PNML files: `artifact/benchmark/IBM_SAP_bench` of the repository p-offtermatt/FastForward. It
has `ibm/lib_*/pnml/*.pnml`, and `all-ibm.txt` with the verdicts: the last column is 1 for sound.

Each net is written as BPMN (`nets`) and verified in another process. Times are CPU time, from
the text of the file to all verdicts.
"""

import argparse
import json
import os
import resource
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from bench.engines import REPOSITORY
from bench.verification.nets import UnfitError, bpmn_of
from m2pem.bpmn import parse_mission
from m2pem.executive.verification import SearchEngine, search
from m2pem.scripting.verification import search_request
from m2pem.verify.properties.results import Result, Verdict
from m2pem.verify.search.explore import Limits

RESULTS = REPOSITORY / "bench" / "results" / "verification"
MOST_S, MOST_MB = 10.0, 500.0
"""Each net must be decided within these."""
FIRST_S, FIRST_SHARE = 2.0, 0.99
"""This share of the unsound nets must have its first violation within that time."""


@dataclass(frozen=True, slots=True)
class Checked:
    """What came of a net. `sound`: as published; `first_s`: until a violation was certain."""

    library: str
    name: str
    sound: bool
    verdict: str
    seconds: float
    first_s: float | None
    states: int
    peak_mb: float
    undecided: tuple[str, ...]

    @property
    def agrees(self) -> bool:
        """Whether the verdict is the published one."""
        return self.verdict == ("holds" if self.sound else "violated")


def nets(folder: Path) -> Iterator[tuple[str, str, bool, str]]:
    """Library, name, whether it is sound, and BPMN text of each net that fits."""
    rows = (line.split() for line in (folder / "all-ibm.txt").read_text().splitlines())
    sound = {Path(row[0]).name: row[-1] == "1" for row in rows if row}
    for file in sorted(folder.glob("ibm/lib_*/pnml/*.pnml")):
        try:
            text = bpmn_of(file.read_bytes())
        except UnfitError as error:
            print(f"left out: {file.stem}: {error}")
            continue
        library = file.parts[-3].removeprefix("lib_")
        yield library, file.stem.removesuffix(".lola"), sound[file.stem], text


def checked(library: str, name: str, sound: bool, text: str) -> Checked:
    """Verify one net, in another process: its memory is measured alone."""
    reading, writing = os.pipe()
    child = os.fork()
    if not child:
        try:
            answer = json.dumps(asdict(_check(library, name, sound, text)))
            os.write(writing, answer.encode())
        finally:
            os._exit(0)
    os.close(writing)
    with os.fdopen(reading) as answers:
        answer = answers.read()
    os.waitpid(child, 0)
    found = json.loads(answer)
    return Checked(**{**found, "undecided": tuple(found["undecided"])})


def _check(library: str, name: str, sound: bool, text: str) -> Checked:
    began = time.process_time()
    first_s: list[float] = []

    def decided(result: Result) -> None:
        if result.verdict is Verdict.VIOLATED and not result.warning and not first_s:
            first_s.append(time.process_time() - began)

    request = search_request(parse_mission(text.encode(), f"{name}.bpmn"), None, None, {})
    engine = SearchEngine("builtin", "exact", Limits(tokens=3))
    found = search(request, engine, strict=False, decided=decided)
    seconds = time.process_time() - began
    return Checked(
        library,
        name,
        sound,
        found.verdict.value,
        seconds,
        first_s[0] if first_s else None,
        found.coverage.states,
        resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        tuple(each.property for each in found.results if each.verdict is Verdict.UNDECIDED),
    )


def page(found: Sequence[Checked]) -> str:
    """Return the table, and what was not reached, as Markdown."""
    lines = [f"# Verification of public nets, measured\n\n{_about()}\n"]
    head = "library | nets | sound | verdict as published | CPU s, median | 99 % | most"
    head = f"| {head} | first violation, 99 % | most | most states | most MB |"
    lines += [head, "|" + " --- |" * (head.count("|") - 1)]
    libraries = dict.fromkeys(each.library for each in found)
    for library in libraries:
        lines.append(_row(library, [each for each in found if each.library == library]))
    lines.append(_row("all", found))
    open_of = [each for each in found if each.undecided]
    lines.append(
        f"\nOf {len(open_of)} unsound nets, some properties are left undecided, as the search ends"
        " soon after a violation, or a place gets more and more tokens."
    )
    wrong = _wrong(found)
    lines.append("\nAll bounds are kept." if not wrong else "\n".join(["\nNot reached:\n", *wrong]))
    return "\n".join(lines) + "\n"


def _about() -> str:
    return (
        "1,380 of the 1,386 nets of the IBM collection, as BPMN: a user task for each task,"
        " gateways for the rest. Six are left out,\nas they have transitions without an input or"
        " an output."
        f" Each must be decided within {MOST_S:g} s and {MOST_MB:g} MB, and the first violation\n"
        f"be certain within {FIRST_S:g} s for {FIRST_SHARE:.0%}. Times are CPU time of one process,"
        " from the text of the file on. See `bench/verification/public_nets.py`.\n"
    )


def _row(name: str, found: Sequence[Checked]) -> str:
    took = sorted(each.seconds for each in found)
    first = sorted(each.first_s for each in found if each.first_s is not None)
    cells = [
        name,
        f"{len(found):,}",
        f"{sum(each.sound for each in found):,}",
        f"{sum(each.agrees for each in found):,}",
        *(f"{_at(took, share):.2g}" for share in (0.5, 0.99, 1.0)),
        *(f"{_at(first, share):.2g}" for share in (0.99, 1.0)),
        f"{max(each.states for each in found):,}",
        f"{max(each.peak_mb for each in found):.0f}",
    ]
    return f"| {' | '.join(cells)} |"


def _at(values: Sequence[float], share: float) -> float:
    return values[min(len(values) - 1, int(share * len(values)))] if values else 0.0


def _wrong(found: Sequence[Checked]) -> list[str]:
    wrong = [f"- {each.name}: {each.verdict}" for each in found if not each.agrees]
    wrong += [f"- {e.name}: {e.seconds:.1f} s" for e in found if e.seconds > MOST_S]
    wrong += [f"- {e.name}: {e.peak_mb:.0f} MB" for e in found if e.peak_mb > MOST_MB]
    first = [each.first_s for each in found if each.first_s is not None]
    soon = sum(each <= FIRST_S for each in first)
    if soon < FIRST_SHARE * len(first):
        wrong.append(f"- a first violation within {FIRST_S:g} s: {soon} of {len(first)}")
    return wrong


def main(words: Sequence[str] | None = None) -> int:
    """The command; `words`: those of the process, unless others are given."""
    parser = argparse.ArgumentParser(prog="python -m bench.verification.public_nets")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--results", type=Path, default=RESULTS)
    asked = parser.parse_args(words)
    found = [checked(*each) for each in nets(asked.folder)]
    asked.results.mkdir(parents=True, exist_ok=True)
    text = page(found)
    (asked.results / "public_nets.md").write_text(text, encoding="utf-8")
    print(text)
    return 1 if _wrong(found) else 0


if __name__ == "__main__":
    raise SystemExit(main())
