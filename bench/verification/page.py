"""Tables and drawings of what was measured."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from bench.engines import Figure
from bench.plots import Panel, draw
from bench.verification.checkers import Found
from bench.verification.measuring import BUILT_IN, Verified
from bench.verification.published import PUBLISHED_MS
from bench.verification.works import CASES, subjects

HOW = """\
Times are CPU time, that of Spin and of its compiler in them, without the start of Python; wall
time beside it says how much else the machine did. `whole`: from the text of the file to all
verdicts. Work that takes less than half a second is done up to nine times, and medians count.
"""
OVERLAP = """\
Models of the published figures: so many branches of so many tasks, and rows of blocks. In each
cell: states, and milliseconds of the search. For m2pem that is without reading the file and making
its rules, and for the others without reading the file. SNAKES builds the state graph of a Petri net
that is made of the model; pm4py tests soundness with Woflan, which tells no number of states.
In m2pem, a task without a type, as in the blocks, takes no time, and no state of its own.
rust_bpmn_analyzer, published: by its author, on a Ryzen 7 7700X; all else on the machine above.
"""


def write(folder: Path, found: Verified) -> str:
    """The files of a measurement; the page."""
    folder.mkdir(parents=True, exist_ok=True)
    text = page(found)
    (folder / "table.md").write_text(text, encoding="utf-8")
    (folder / "branches.svg").write_text(drawing(found), encoding="utf-8")
    found.save(folder / "figures.json")
    return text


def page(found: Verified) -> str:
    """Markdown."""
    words = ", ".join(f"{name}: {value}" for name, value in found.machine.items())
    parts = [f"# Verification, measured\n\n{words}.\n\n{HOW}"]
    if found.cases:
        parts.append(f"## Branches of three tasks\n\n{_lines(_cases(found))}")
    if found.branches:
        parts.append(f"![states and time over branches](branches.svg)\n\n{_lines(_sizes(found))}")
    if found.overlap:
        parts.append(f"## Beside other checkers\n\n{OVERLAP}\n{_lines(_overlap(found))}")
    if found.missions:
        parts.append(f"## Missions of the repository\n\n{_lines(_missions(found))}")
    if wrong := found.wrongs():
        listed = "".join(f"- {each}\n" for each in wrong)
        parts.append(f"## What did not come to its verdict\n\n{listed}")
    return "\n".join(parts)


def drawing(found: Verified) -> str:
    """States and time over branches, a line for each checker."""
    panels = (
        Panel("States over branches of three tasks", _states, ""),
        Panel("CPU seconds of the search", _search_s, "s"),
    )
    return draw("Branches", panels, found.branches, _names(found.branches))


def _states(figure: Figure) -> float | None:
    return figure.values.get("states")


def _search_s(figure: Figure) -> float | None:
    # Less than the clock can tell: there is no logarithm of nothing.
    return max(figure.values["search_s"], 1e-5)


def _names(by_size: Mapping[int, Mapping[str, Found]]) -> list[str]:
    return list(dict.fromkeys(name for each in by_size.values() for name in each))


def _lines(rows: Iterator[Sequence[str]]) -> str:
    head, *rest = rows
    lines = [head, ["---"] * len(head), *rest]
    return "".join(f"| {' | '.join(each)} |\n" for each in lines)


def _cases(found: Verified) -> Iterator[Sequence[str]]:
    yield "work", "states", "search, s", "target, s", "met", "whole, s", "wall, s"
    for case in CASES:
        each, goal = found.cases.get(case.name), case.goal
        if each is None:
            continue
        bound = "" if goal.bound is None else f"at most {goal.bound:g}"
        name = f"{case.name}".replace("|", "\\|")
        if each.wrong:
            yield name, "", each.wrong, bound, "**no**" if bound else "", "", ""
            continue
        met = {None: "", True: "yes", False: "**no**"}[goal.met(each.values[goal.key])]
        times = [_seconds(each.values[key]) for key in ("search_s", "all_s", "wall_s")]
        states = f"{each.values['states']:,.0f}"
        yield name, states, times[0], bound, met, times[1], times[2]


def _sizes(found: Verified) -> Iterator[Sequence[str]]:
    names = _names(found.branches)
    yield "branches", *names
    for size, engines in found.branches.items():
        yield f"{size:,}", *(_cell(engines.get(name)) for name in names)


def _overlap(found: Verified) -> Iterator[Sequence[str]]:
    names = list(dict.fromkeys(name for each in found.overlap.values() for name in each))
    yield "model", *names, "rust_bpmn_analyzer, published"
    for title, engines in found.overlap.items():
        published = PUBLISHED_MS.get(title, "")
        yield title, *(_cell(engines.get(name)) for name in names), published


def _cell(found: Found | None) -> str:
    """States, and milliseconds of the search."""
    if found is None:
        return ""
    if found.wrong:
        return found.wrong
    took = f"{_milliseconds(found.values['search_s'])} ms"
    states = found.values.get("states")
    return took if states is None else f"{states:,.0f}, {took}"


def _missions(found: Verified) -> Iterator[Sequence[str]]:
    head = ("rules, ms", "search, ms", "all, ms", "target, ms", "met")
    yield "mission", "states", *head, "verdict", "Spin: states", "search, ms", "all, ms", "verdict"
    for subject in subjects():
        engines = found.missions.get(subject.file)
        if engines is None:
            continue
        mine, spin = engines[BUILT_IN], engines.get("spin")
        if mine.wrong:
            yield subject.file, *[""] * 6, mine.wrong, "", "", "", ""
            continue
        bound, met = "", ""
        if subject.bound_s is not None:
            bound = f"at most {_milliseconds(subject.bound_s)}"
            met = "yes" if mine.values["all_s"] <= subject.bound_s else "**no**"
        row = [subject.file, f"{mine.values['states']:,.0f}"]
        row += [_milliseconds(mine.values[key]) for key in ("derive_s", "search_s", "all_s")]
        row += [bound, met, mine.verdict]
        if spin is None or spin.wrong:
            row += ["", "", "", spin.wrong if spin else "not installed"]
        else:
            row.append(f"{spin.values['states']:,.0f}")
            row += [_milliseconds(spin.values[key]) for key in ("search_s", "all_s")]
            row.append("the same" if spin.verdict == mine.verdict else spin.verdict)
        yield row


def _milliseconds(seconds: float) -> str:
    value = seconds * 1000
    return f"{value:,.0f}" if value >= 99.5 else f"{value:.2g}"


def _seconds(seconds: float) -> str:
    return f"{seconds:.3g}"
