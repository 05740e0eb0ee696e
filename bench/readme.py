"""The ratios and plots in the README, between two comments."""

import re
from collections.abc import Iterator, Sequence

from bench.engines import M2PEM, Figure
from bench.table import STOCK, Results
from bench.targets import WORK, Work

BEGIN, END = "<!-- written by make bench -->", "<!-- up to here -->"
_BLOCK = re.compile(f"{re.escape(BEGIN)}.*?{re.escape(END)}", re.S)


def rewritten(readme: str, results: Results, peers: Sequence[str]) -> str:
    """The README with new figures."""
    block = "\n".join([BEGIN, *_lines(results, peers), END])
    return _BLOCK.sub(lambda _: block, readme)


def _lines(results: Results, peers: Sequence[str]) -> Iterator[str]:
    shown = [name for name in peers if not name.endswith(STOCK)]
    yield ""
    yield f"| CPU time, in that of m2pem | {' | '.join(shown)} |"
    yield f"|{'---|' * (len(shown) + 1)}"
    for work in WORK:
        cells = [_cell(work, name, results.get(work.name, {})) for name in shown]
        yield f"| {work.title} | {' | '.join(cells)} |"
    yield ""
    for work in WORK:
        yield f"![{work.title}: time and memory over size](bench/results/{work.name}.svg)"
    yield ""


def _cell(work: Work, peer: str, sizes: dict[int, dict[str, Figure]]) -> str:
    """The ratio at the largest size that both bear, and the size that the peer does not."""
    cell, no_more = "-", ""
    for size, engines in sizes.items():
        figure = engines.get(peer)
        if figure is None:
            continue
        if figure.wrong:
            no_more = f"; fails at {size:,}"
        elif engines[M2PEM].values:
            ratio = figure.values["cpu_s"] / engines[M2PEM].values["cpu_s"]
            cell = f"{float(f'{ratio:.2g}'):,.4g}x ({size:,} {work.unit})"
    return cell + no_more
