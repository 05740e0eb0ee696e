"""Finds the missions that are to be tested, and tests them."""

import os
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from m2pem.coverage.mission_test import MissionReport, MissionTest
from m2pem.coverage.scenario_file import SUFFIX, ScenarioError, no_scenarios, read_scenarios
from m2pem.errors import FindingsError
from m2pem.findings import Finding, Severity
from m2pem.plugins import PluginManager
from m2pem.verify.search.explore import Limits

LIMITS = Limits(states=500_000, seconds=60.0, tokens=3)
"""Of the search of each mission, unless said otherwise."""

BPMN = ".bpmn"
_NOT_SEARCHED = frozenset({"node_modules", "__pycache__"})


@dataclass(frozen=True, slots=True)
class Target:
    """A mission, and the file of its scenarios; None: it has none. `named`: not only its folder."""

    mission: Path
    scenarios: Path | None
    named: bool = True


@dataclass(frozen=True, slots=True)
class Unusable:
    """A mission that could not be tested, and why."""

    mission: Path
    scenarios: Path | None
    error: str


def find_targets(paths: Iterable[Path]) -> list[Target]:
    """Return the missions that are named, and those in folders that are named, by path.

    Of a folder, hidden folders and those of packages are left out.

    Raises:
        ScenarioError: a file is neither a mission nor scenarios, or there is no such file.
    """
    found: dict[Path, Target] = {}
    for path in paths:
        for each in _in_folder(path) if path.is_dir() else [path]:
            target = replace(target_of(each), named=not path.is_dir())
            if target.named or target.mission not in found:
                found[target.mission] = target
    return [found[mission] for mission in sorted(found)]


def _in_folder(folder: Path) -> Iterator[Path]:
    for here, folders, files in os.walk(folder):
        folders[:] = [f for f in folders if not f.startswith(".") and f not in _NOT_SEARCHED]
        for name in files:
            if name.endswith((BPMN, SUFFIX)):
                yield Path(here, name)


def target_of(path: Path) -> Target:
    """Return the target of a mission file or a file of scenarios.

    Raises:
        ScenarioError: it is neither, or one of them is not there.
    """
    is_scenarios = path.name.endswith(SUFFIX)
    mission = path.with_name(path.name.removesuffix(SUFFIX) + BPMN) if is_scenarios else path
    if not is_scenarios and path.suffix != BPMN:
        raise _refusal(path, f"is neither a mission (*{BPMN}) nor scenarios (*{SUFFIX})")
    if not mission.is_file():
        beside = f"; {path} has its scenarios" if is_scenarios else ""
        raise _refusal(mission, f"there is no such mission{beside}")
    scenarios = mission.with_suffix(SUFFIX)
    return Target(mission, scenarios if scenarios.is_file() else None)


def _refusal(path: Path, message: str) -> ScenarioError:
    finding = Finding(Severity.ERROR, str(path), 0, "", "no-mission", message)
    return ScenarioError("there is nothing to test", [finding])


@dataclass(frozen=True, slots=True)
class Wanted:
    """What is done with each mission. `fleet`: of missions without a file of scenarios.

    `complete`: what is neither seen nor named is an error. `suggest`: look for answers files that
    see it.
    """

    limits: Limits = LIMITS
    fleet: str = "sim"
    complete: bool = False
    suggest: bool = False


def reports_on(
    targets: Iterable[Target],
    wanted: Wanted,
    plugins: PluginManager,
    progress: Callable[[str], None] = lambda _: None,
) -> Iterator[MissionReport | Unusable]:
    """Test missions one after the other, and yield what was found as soon as it is known.

    A file of a folder that has no scenarios is left out if a mission with scenarios calls it: it is
    tested there. So missions with scenarios come first.
    """
    called: set[Path] = set()
    for target in sorted(targets, key=lambda each: (each.scenarios is None, each.mission)):
        if not target.named and target.scenarios is None and target.mission.resolve() in called:
            continue
        try:
            report = report_on(target, wanted, plugins, progress)
        except FindingsError as error:
            yield Unusable(target.mission, target.scenarios, str(error))
            continue
        called |= {Path(name).resolve() for name in report.called}
        yield report


def report_on(
    target: Target,
    wanted: Wanted,
    plugins: PluginManager,
    progress: Callable[[str], None] = lambda _: None,
) -> MissionReport:
    """Rehearse the scenarios of a mission, and return what was found.

    Raises:
        FindingsError: the mission, its fleet or its scenarios cannot be used.
    """
    if target.scenarios is None:
        file = no_scenarios(target.mission, wanted.fleet)
    else:
        file = read_scenarios(target.scenarios)
    test = MissionTest(target.mission, file, plugins)
    outcomes = []
    for number, scenario in enumerate(file.model.scenarios):
        progress(f"{target.mission}: {scenario.scenario}")
        outcomes.append(test.play(number))
    return test.report(
        outcomes,
        wanted.limits,
        suggest=wanted.suggest,
        complete=wanted.complete,
        progress=progress,
    )
