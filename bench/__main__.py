"""`python -m bench`: measure everything, print the table, write bench/results/ and README.md."""

import argparse
import importlib.util
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from bench.engines import (
    M2PEM,
    REPOSITORY,
    Engine,
    Figure,
    graph,
    measure,
    own,
    peers,
    play,
    play_once,
)
from bench.figures import Figures, OtherError, kept
from bench.machine import machine
from bench.plots import plot
from bench.readme import rewritten
from bench.table import JOURNALS, STOCK, table, wrongs
from bench.targets import PROGRAMS, WORK, Program, Work
from bench.verification import measuring, page

README = REPOSITORY / "README.md"
RESULTS = REPOSITORY / "bench" / "results"
SPIFFWORKFLOW = REPOSITORY / ".conformance" / "bin" / "python"
MODULES = REPOSITORY / "tests" / "js" / "node_modules"
ROS = REPOSITORY / ".venv-ros" / "bin" / "python"
OWN_RUNS, PEER_RUNS = 5, 3
STOCK_SIZES = 2
"""Enough to see where SpiffWorkflow gives up when its users do not lift the limit of recursion."""

VERIFICATION = "verification"
"""The name of `bench.verification`, and of the folder of its results in that of all others."""

NAMES = [
    *dict.fromkeys([*(w.name for w in WORK), *(p.command[0] for p in PROGRAMS)]),
    VERIFICATION,
]
FIGURES = "figures.json"

JOURNALS_FROM = 10_000
JOURNALS_UP_TO = 100_000


def main(words: Sequence[str] | None = None) -> int:
    """The command; `words`: those of the process, unless others are given."""
    parser = argparse.ArgumentParser(prog="python -m bench", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="only: does all run, and rightly?")
    parser.add_argument("--up-to", type=int, default=10**9, metavar="SIZE", help="of the graphs")
    parser.add_argument("--results", type=Path, default=RESULTS, help="where they are written")
    parser.add_argument(
        "--only",
        type=_names,
        metavar="NAME[,NAME]",
        help=f"measure these again and keep the other figures: {', '.join(NAMES)}",
    )
    asked = parser.parse_args(words)
    others = peers(SPIFFWORKFLOW, MODULES)
    names: Sequence[str] = asked.only or NAMES
    works = [work for work in WORK if work.name in names]
    # A quick look must not depend on another environment, which may be out of date.
    ros = ros_python(only_own=asked.quick)
    wanted = [program for program in PROGRAMS if program.command[0] in names]
    programs = [program for program in wanted if ros or not program.ros]
    if len(programs) < len(wanted):
        print("bench: ROS is not installed here, and its programs are left out")
    verifies = VERIFICATION in names
    if asked.quick:
        wrong = quick(others, works, programs)
        return wrong | quick_verification() if verifies else wrong
    found = machine(SPIFFWORKFLOW, MODULES, Path(ros))
    wrong = 0
    if works or programs:
        try:
            figures = kept(asked.results / FIGURES, found, names) if asked.only else Figures(found)
        except OtherError as error:
            parser.error(str(error))
        wrong = measure_all(figures, others, works, programs, asked.up_to, asked.results)
    return wrong | measure_verification(asked.results, found) if verifies else wrong


def ros_python(only_own: bool) -> str:
    """The Python that runs what needs ROS: this one if it has ROS, or that of `make ros`; or ""."""
    if importlib.util.find_spec("rclpy"):
        return sys.executable
    return str(ROS) if ROS.exists() and not only_own else ""


def _python(program: Program) -> str:
    return ros_python(only_own=False) if program.ros else sys.executable


def _names(text: str) -> list[str]:
    names = text.split(",")
    unknown = [name for name in names if name not in NAMES]
    if unknown:
        raise argparse.ArgumentTypeError(f"there is no {unknown[0]!r}; known: {', '.join(NAMES)}")
    return names


def quick(others: Sequence[Engine], works: Sequence[Work], programs: Sequence[Program]) -> int:
    """Everything once, at its smallest; no time is looked at."""
    names = {each.name for each in others}
    for name in {"SpiffWorkflow", "bpmn-elements", "bpmn-engine"} - names if works else ():
        print(f"bench: {name} is not installed, and left out")

    smallest = [(work.name, work.sizes[0]) for work in works]
    players = [[each] for each in others if not each.name.endswith(STOCK)]
    players.append([own(), own("memory"), own("sqlite")])
    players = players if works else []
    commands = {program.quick: _python(program) for program in programs}
    with ThreadPoolExecutor(2) as pool:
        played = pool.map(lambda each: play_once(each, smallest), players)
        figures = pool.map(lambda each: measure(each, 1, commands[each]), commands)
        wrong = {each[0].name: said for each, said in zip(players, played, strict=True) if said}
        wrong |= {
            " ".join(command): figure.wrong
            for command, figure in zip(commands, figures, strict=True)
            if figure.wrong
        }
    for name, said in wrong.items():
        print(f"bench: {name}: {said}", file=sys.stderr)
    return bool(wrong)


def measure_all(
    figures: Figures,
    others: Sequence[Engine],
    works: Sequence[Work],
    programs: Sequence[Program],
    up_to: int,
    folder: Path,
) -> int:
    """Measure, print, and write after each step: an interrupted measurement is not lost."""
    installed = [peer.name for peer in others]
    text = ""
    for work in works:
        played = play_all(work, [size for size in work.sizes if size <= up_to], others)
        figures.add(work.name, played, installed)
        text = write(folder, figures, installed)
    for program in programs:
        figures.programs[program.name] = measure(program.command, PEER_RUNS, _python(program))
        print(f"{program.name}: done", file=sys.stderr)
        text = write(folder, figures, installed)
    print(text)
    mine = [each[M2PEM] for sizes in figures.graphs.values() for each in sizes.values()]
    return int(any(figure.wrong for figure in [*mine, *figures.programs.values()]))


def quick_verification() -> int:
    """Each kind of verification once; no time is looked at."""
    wrong = measuring.quick()
    for each in wrong:
        print(f"bench: verification: {each}", file=sys.stderr)
    return bool(wrong)


def measure_verification(results: Path, found: dict[str, str]) -> int:
    """Verify everything, print, and write after each step, into a folder of its own."""
    folder = results if results.name == VERIFICATION else results / VERIFICATION
    verified = measuring.measure(found, lambda so_far: page.write(folder, so_far))
    print(page.write(folder, verified))
    return bool(verified.wrongs())


def play_all(
    work: Work, sizes: Sequence[int], others: Sequence[Engine]
) -> dict[int, dict[str, Figure]]:
    """A graph at all sizes, with every engine up to the first size at which it fails."""
    by_size: dict[int, dict[str, Figure]] = {}
    failed: set[str] = set()
    for size in sizes:
        engines = by_size[size] = {M2PEM: play(own(), work.name, size, OWN_RUNS)}
        if JOURNALS_FROM <= size <= JOURNALS_UP_TO:
            for name, kind in JOURNALS.items():
                engines[name] = play(own(kind), work.name, size, PEER_RUNS)
        for peer in others:
            stock = peer.name.endswith(STOCK)
            if peer.name in failed or (stock and size not in work.sizes[:STOCK_SIZES]):
                continue
            engines[peer.name] = play(peer, work.name, size, PEER_RUNS)
            if engines[peer.name].wrong:
                failed.add(peer.name)
        print(f"{work.title}, {size:,}: done", file=sys.stderr)
        graph.cache_clear()
    return by_size


def write(folder: Path, figures: Figures, installed: Sequence[str]) -> str:
    """The files of a measurement, and the README if they are those that it shows; the page."""
    folder.mkdir(parents=True, exist_ok=True)
    results, names = figures.graphs, figures.peers(installed)
    drawn_table = table(results, figures.programs, names)
    text = _page(figures.machine, drawn_table, wrongs(results, figures.programs))
    (folder / "table.md").write_text(text, encoding="utf-8")
    drawn = [M2PEM, *(name for name in names if not name.endswith(STOCK))]
    for work in WORK:
        drawing = plot(work, results.get(work.name, {}), drawn)
        (folder / f"{work.name}.svg").write_text(drawing, encoding="utf-8")
    figures.save(folder / FIGURES)
    if folder == RESULTS:
        old = README.read_text(encoding="utf-8")
        README.write_text(rewritten(old, results, names), encoding="utf-8")
    return text


def _page(described: dict[str, str], figures: str, failures: str) -> str:
    words = ", ".join(f"{name}: {value}" for name, value in described.items())
    text = f"# Measured\n\n{words}.\n\n{figures}"
    if failures:
        text += f"\n## What did not end with the right result\n\n{failures}"
    return text


if __name__ == "__main__":
    sys.exit(main())
