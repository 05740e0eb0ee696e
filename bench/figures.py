"""The figures of a measurement, and the file that keeps them."""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from bench.engines import M2PEM, Figure
from bench.table import JOURNALS, Results
from bench.targets import PROGRAMS, WORK

AGAIN = "measured again"
LOAD = "load before"
_MAY_DIFFER = {AGAIN, LOAD, "m2pem"}


class OtherError(Exception):
    """What is kept does not go together with what would be measured now."""


@dataclass(slots=True)
class Figures:
    """What was measured so far. `machine`: on and with what, by name."""

    machine: dict[str, str]
    graphs: Results = field(default_factory=dict)
    programs: dict[str, Figure] = field(default_factory=dict)

    def add(self, work: str, sizes: dict[int, dict[str, Figure]], installed: Iterable[str]) -> None:
        """Put in the figures of a graph.

        Older ones stay for other sizes, and for engines that are not installed any more.
        """
        engines = {M2PEM, *JOURNALS, *installed}
        known = self.graphs.get(work, {})
        for size, measured in sizes.items():
            older = {name: f for name, f in known.get(size, {}).items() if name not in engines}
            known[size] = older | measured
        self.graphs[work] = dict(sorted(known.items()))

    def peers(self, installed: Iterable[str]) -> list[str]:
        """All other engines: those that are installed, and those whose figures were kept."""
        every = [each for sizes in self.graphs.values() for each in sizes.values()]
        names = dict.fromkeys([*installed, *(name for each in every for name in each)])
        return [name for name in names if name != M2PEM and name not in JOURNALS]

    def save(self, file: Path) -> None:
        """Write them."""
        content = {
            "machine": self.machine,
            "graphs": {work: _as_data(sizes) for work, sizes in self.graphs.items()},
            "programs": {name: asdict(figure) for name, figure in self.programs.items()},
        }
        file.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


def kept(file: Path, machine: dict[str, str], again: Sequence[str]) -> Figures:
    """The figures of a file, of which those of `again` are about to be measured anew.

    There are none without the file.

    Raises:
        OtherError: they cannot be read, or were measured on another machine or with others.
    """
    if not file.exists():
        return Figures(machine)
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
        before: dict[str, str] = content["machine"]
        figures = Figures(before | machine, _graphs(content["graphs"]))
        for program in PROGRAMS:
            if program.name in content["programs"]:
                figures.programs[program.name] = Figure(**content["programs"][program.name])
    except (OSError, ValueError, TypeError, KeyError, AttributeError) as error:
        raise OtherError(f"{file} cannot be read ({error!r}): measure everything") from error
    for name in sorted((before.keys() & machine.keys()) - _MAY_DIFFER):
        if before[name] != machine[name]:
            raise OtherError(
                f"{file} was measured with {name} {before[name]}, and this is {machine[name]}: "
                "measure everything"
            )
    earlier = before[AGAIN].split(" and ") if AGAIN in before else []
    figures.machine[AGAIN] = " and ".join(sorted({*earlier, *again}))
    figures.machine[LOAD] = max(before.get(LOAD, "0"), machine.get(LOAD, "0"), key=float)
    return figures


def _graphs(data: Mapping[str, Any]) -> Results:
    return {
        work.name: {
            int(size): {name: Figure(**figure) for name, figure in engines.items()}
            for size, engines in data[work.name].items()
        }
        for work in WORK
        if work.name in data
    }


def _as_data(sizes: Mapping[int, Mapping[str, Figure]]) -> dict[int, Any]:
    return {
        size: {name: asdict(figure) for name, figure in engines.items()}
        for size, engines in sizes.items()
    }
