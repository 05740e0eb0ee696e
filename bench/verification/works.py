"""What is verified, and the time that it may take."""

import os
from dataclasses import dataclass
from pathlib import Path

from bench.engines import REPOSITORY
from bench.targets import Goal

FLEETS = {
    "mehds_vignette_1": "mehds",
    "mehds_vignette_2": "mehds",
    "mehds_vignette_3": "mehds",
    "mehds_vignette_4": "mehds",
    "survey_pair": "survey_pair",
    "team_column": "mehds_mixed",
    "vignette1": "vignette1",
}
"""By mission of the folder `missions`: the fleet of `fleet_configs` that it is flown with."""

TASKS = 3
"""Of a branch."""

SHAPES = {
    "plain": "",
    "timer": ", interrupted by a timer",
    "error": ", interrupted by an error end event",
    "failures": ", interrupted by any failure",
}
HOW = {"whole": "nothing left out", "reduced": "reduced", "spin": "Spin"}

BOTH_DONE = "(!completed(e) W completed(t0_2)) && (!completed(e) W completed(t1_2))"
AT_LAST = "(<> completed(t0_2)) && (<> completed(t1_2))"

VIGNETTE_S = 0.1
BOUNDS_S = {("whole", 10): 10.0, ("reduced", 100): 0.05, ("reduced", 1_000): 5.0}


@dataclass(frozen=True, slots=True)
class Subject:
    """A mission of the repository; paths from there. `bound_s`: of all, by the built-in search."""

    file: str
    fleet: str | None
    bound_s: float | None = None


@dataclass(frozen=True, slots=True)
class Case:
    """So many branches. `step`: whose time must keep to the bound."""

    count: int
    how: str
    shape: str = "plain"
    requirement: str = ""
    step: str = "search_s"

    @property
    def name(self) -> str:
        """What it is, in a table."""
        asked = f", {self.requirement}" if self.requirement else ""
        return f"{self.count:,} branches{SHAPES[self.shape]}{asked}, {HOW[self.how]}"

    @property
    def goal(self) -> Goal:
        """What must be reached."""
        return Goal(self.step, self.name, "s", BOUNDS_S.get((self.how, self.count)))


def subjects() -> list[Subject]:
    """Every mission of the repository."""
    found = []
    for file in sorted(REPOSITORY.glob("missions/*.bpmn")):
        fleet = f"fleet_configs/{FLEETS[file.stem]}.yaml"
        bound_s = VIGNETTE_S if file.stem == "vignette1" else None
        found.append(Subject(f"missions/{file.name}", fleet, bound_s))
    for file in sorted(REPOSITORY.glob("examples/*/mission.bpmn")):
        fleet_file = file.with_name("fleet.yaml")
        own = str(fleet_file.relative_to(REPOSITORY)) if fleet_file.exists() else None
        found.append(Subject(str(file.relative_to(REPOSITORY)), own))
    for file in sorted(REPOSITORY.glob("docs/broken/*.bpmn")):
        found.append(Subject(f"docs/broken/{file.name}", None))
    return found


CASES = (
    Case(10, "whole"),
    Case(10, "whole", "timer"),
    *(Case(count, "reduced", shape) for shape in SHAPES for count in (10, 100, 1_000)),
    *(
        Case(count, "reduced", requirement=asked)
        for asked in (BOTH_DONE, AT_LAST)
        for count in (10, 100, 1_000)
    ),
)

SIZES = (1, 2, 4, 6, 8, 10, 20, 50, 100, 200, 500, 1_000)
"""Branches of the plots."""

OVERLAP = ((10, 1), (15, 1), (16, 1), (17, 1), (20, 1), (5, 5), (3, 20))
"""Branches and tasks of models whose figures the author of a peer has published."""

CORPORA = {"400 blocks": "400.bpmn", "500 blocks": "500.bpmn"}
"""Models of the peer's own, in the folder that M2PEM_CORPORA names."""


def corpora() -> dict[str, str]:
    """The text of those of them that are there."""
    folder = os.environ.get("M2PEM_CORPORA")
    if not folder:
        return {}
    found = {}
    for title, name in CORPORA.items():
        for file in sorted(Path(folder).rglob(f"benchmark_input/{name}")):
            found[title] = file.read_text(encoding="utf-8")
    return found
