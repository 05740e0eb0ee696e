"""The table of what was measured beside what it must reach, and the list of what went wrong."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from bench.engines import M2PEM, Figure, graph
from bench.targets import LINEAR, MEMORY_GROWTH, PROGRAMS, SQLITE_PER_S, WORK, Goal, Work

Results = dict[str, dict[int, dict[str, Figure]]]
"""Of the graphs: by work, size and engine."""

STOCK = ", stock"
JOURNALS = {"m2pem, memory journal": "memory", "m2pem, SQLite journal": "sqlite"}


@dataclass(frozen=True, slots=True)
class Line:
    """A line of the table. `peers`: by name, what stands in their columns."""

    work: str
    size: str
    value: float | None
    goal: Goal
    peers: dict[str, str]


def table(results: Results, programs: dict[str, Figure], peers: Sequence[str]) -> str:
    """Markdown."""
    shown = [name for name in peers if not name.endswith(STOCK)]
    head = ["work", "size", M2PEM, "target", "met", *shown]
    lines = [f"| {' | '.join(head)} |", f"|{'---|' * len(head)}"]
    for line in [*_graph_lines(results, shown), *_program_lines(programs)]:
        cells = [line.work, line.size, *_figures(line), *(line.peers.get(n, "") for n in shown)]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def wrongs(results: Results, programs: dict[str, Figure]) -> str:
    """What did not end with the right result, with its size."""
    found = [
        f"- {engine}, {work}, {size:,}: {figure.wrong}"
        for work, sizes in results.items()
        for size, engines in sizes.items()
        for engine, figure in engines.items()
        if figure.wrong
    ]
    found += [f"- {M2PEM}, {name}: {each.wrong}" for name, each in programs.items() if each.wrong]
    return "\n".join(found) + "\n" if found else ""


def _figures(line: Line) -> tuple[str, str, str]:
    goal = line.goal
    bound = ""
    if goal.bound is not None:
        bound = f"{'at least' if goal.at_least else 'at most'} {_number(goal.bound, goal.unit)}"
    if line.value is None:
        return "failed", bound, "no" if bound else ""
    met = goal.met(line.value)
    return _number(line.value, goal.unit), bound, "" if met is None else "yes" if met else "**no**"


def _number(value: float, unit: str) -> str:
    text = f"{value:,.0f}" if value >= 1000 else f"{value:.3g}"
    return f"{text} {unit}".replace(" /s", "/s").replace(" %", " %").strip()


def _graph_lines(results: Results, peers: Sequence[str]) -> Iterator[Line]:
    for work in WORK:
        sizes = results.get(work.name, {})
        for size, engines in sizes.items():
            goal = Goal("", "", "elements/s", None, at_least=True)
            if size >= work.measured_from:
                goal = Goal("", "", "elements/s", work.elements_per_s, at_least=True)
            mine = engines[M2PEM]
            ratios = {name: _ratio(engines.get(name), mine) for name in peers}
            rate = _rate(work, size, mine, "cpu_s")
            yield Line(work.title, f"{size:,} {work.unit}", rate, goal, ratios)
            for name, kind in JOURNALS.items():
                if name in engines:
                    sqlite = kind == "sqlite"
                    bound = SQLITE_PER_S if sqlite else work.elements_per_s
                    rate = _rate(work, size, engines[name], "wall_s" if sqlite else "cpu_s")
                    title = f"{work.title}, {name.removeprefix('m2pem, ')}"
                    goal = Goal("", "", "elements/s", bound, at_least=True)
                    yield Line(title, f"{size:,} {work.unit}", rate, goal, {})
        yield from _growth(work, {size: engines[M2PEM] for size, engines in sizes.items()})


def _growth(work: Work, mine: dict[int, Figure]) -> Iterator[Line]:
    """How the time of an element, and of a loop the memory, differ with size."""
    sizes = [size for size in mine if size >= work.measured_from and mine[size].values]
    if len(sizes) < 2:
        return
    first, last = sizes[0], sizes[-1]
    span = f"{last:,} to {first:,}"
    rates = [_rate(work, size, mine[size], "cpu_s") for size in (first, last)]
    assert rates[0] and rates[1]
    goal = Goal("", "", "times", LINEAR)
    yield Line(f"{work.title}: time of an element", span, rates[0] / rates[1], goal, {})
    if work.name == "loop":
        peaks = [mine[size].values["peak_kb"] for size in (first, last)]
        goal = Goal("", "", "times", MEMORY_GROWTH)
        yield Line(f"{work.title}: peak memory", span, peaks[1] / peaks[0], goal, {})


def _rate(work: Work, size: int, figure: Figure, key: str) -> float | None:
    if not figure.values:
        return None
    made = graph(work.name, size)
    return made.elements * made.instances / figure.values[key]


def _ratio(peer: Figure | None, mine: Figure) -> str:
    """How many times as long the peer took, and how much more memory."""
    if peer is None:
        return "not tried"
    if peer.wrong:
        return "**wrong**" if peer.wrong.startswith("wrong") else f"**{_kind(peer.wrong)}**"
    if not mine.values:
        return "right"
    times, memory = (peer.values[key] / mine.values[key] for key in ("cpu_s", "peak_kb"))
    return f"{_number(times, '')}x time, {_number(memory, '')}x memory"


def _kind(words: str) -> str:
    if words.startswith("no answer"):
        return "over 60 s"
    # Node's word for it: nothing is left to do, and what was awaited has not come.
    return "never ends" if words.endswith("(exit status 13)") else "crash"


def _program_lines(programs: dict[str, Figure]) -> Iterator[Line]:
    for program in PROGRAMS:
        figure = programs.get(program.name)
        if figure is None:
            continue
        for goal in program.goals:
            if figure.values and goal.key not in figure.values:
                continue  # kept from a time when it was not measured yet
            yield Line(goal.title, program.size, figure.values.get(goal.key), goal, {})
