"""Verifying everything once, and keeping what came of it."""

import json
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from bench.engines import REPOSITORY, Engine
from bench.verification.checkers import OWN, Found, look, look_once, own, peers, spin_is_here
from bench.verification.models import branches
from bench.verification.works import (
    CASES,
    OVERLAP,
    SIZES,
    TASKS,
    Case,
    Subject,
    corpora,
    subjects,
)

OWN_LIMIT_S, PEER_LIMIT_S = 240.0, 60.0
CASE_LIMIT_S = 180.0
BUILT_IN = "builtin"
EXPECTED = "holds"
"""The verdict on all models of branches."""


@dataclass(slots=True)
class Verified:
    """What was measured so far.

    `missions`: by file and engine; `cases` by name; `branches`: by number and checker; `overlap`:
    by model and checker.
    """

    machine: dict[str, str]
    missions: dict[str, dict[str, Found]] = field(default_factory=dict)
    cases: dict[str, Found] = field(default_factory=dict)
    branches: dict[int, dict[str, Found]] = field(default_factory=dict)
    overlap: dict[str, dict[str, Found]] = field(default_factory=dict)

    def save(self, file: Path) -> None:
        """Write them."""
        file.write_text(json.dumps(asdict(self), indent=1) + "\n", encoding="utf-8")

    def wrongs(self) -> list[str]:
        """What did not come to its verdict, of m2pem alone."""
        found = [f"{name}: {each.wrong}" for name, each in self.cases.items() if each.wrong]
        for name, engines in self.missions.items():
            found += [f"{name}, {who}: {each.wrong}" for who, each in engines.items() if each.wrong]
            verdicts = {each.verdict for each in engines.values() if not each.wrong}
            if len(verdicts) > 1:
                found.append(f"{name}: the engines differ: {' / '.join(sorted(verdicts))}")
        return found


def measure(machine: dict[str, str], done: Callable[[Verified], object]) -> Verified:
    """Everything; `done` is called after each part."""
    found = Verified(machine)
    for subject in subjects():
        found.missions[subject.file] = verify(subject)
    _said("the missions", found, done)
    for case in CASES:
        found.cases[case.name] = search(case)
        _said(case.name, found, done)
    for size, by_name in growing([*own(), *peers()]):
        found.branches[size] = by_name
        _said(f"{size:,} branches with all checkers", found, done)
    for title, model in [*overlapping(), *corpora().items()]:
        found.overlap[title] = {each.name: _of(each, model) for each in [*own(), *peers()]}
        _said(title, found, done)
    return found


def quick() -> list[str]:
    """Each kind of work once, at its smallest; what went wrong."""
    subject = next(each for each in subjects() if each.bound_s)
    missions = _orders(subject)
    kinds = dict.fromkeys((case.shape, case.requirement) for case in CASES)
    cases = [Case(3, "reduced", shape, asked) for shape, asked in kinds]
    orders = {case.name: _order(case) for case in cases}
    orders |= {each.name: {"xml": branches(2, 2), **each.order} for each in own()}
    expected = [*("" for _ in missions), *(EXPECTED for _ in orders)]
    done = look_once([*missions.values(), *orders.values()], CASE_LIMIT_S, expected)
    found = Verified({})
    found.missions[subject.file] = dict(zip(missions, done[: len(missions)], strict=True))
    found.cases = dict(zip(orders, done[len(missions) :], strict=True))
    return found.wrongs()


def verify(subject: Subject) -> dict[str, Found]:
    """A mission, with each engine that is installed."""
    return {
        name: look(Engine(name, OWN), order, CASE_LIMIT_S, runs=1)
        for name, order in _orders(subject).items()
    }


def _orders(subject: Subject) -> dict[str, dict[str, Any]]:
    fleet = str(REPOSITORY / subject.fleet) if subject.fleet else None
    order = {"file": str(REPOSITORY / subject.file), "fleet": fleet}
    engines = [BUILT_IN, "spin"] if spin_is_here() else [BUILT_IN]
    return {name: {**order, "how": name} for name in engines}


def search(case: Case) -> Found:
    """So many branches."""
    return look(Engine(case.name, OWN), _order(case), CASE_LIMIT_S, expected=EXPECTED, runs=1)


def _order(case: Case) -> dict[str, Any]:
    order = {"how": case.how, "xml": branches(case.count, TASKS, case.shape)}
    return {**order, "requirement": case.requirement} if case.requirement else order


def overlapping() -> list[tuple[str, str]]:
    """Names and texts of the models whose figures are published."""
    return [(f"{count}x{tasks}", branches(count, tasks)) for count, tasks in OVERLAP]


def growing(engines: Sequence[Engine]) -> Iterator[tuple[int, dict[str, Found]]]:
    """More and more branches, with each checker up to the first number that it does not bear."""
    failed: set[str] = set()
    for size in SIZES:
        model = branches(size, TASKS)
        by_name: dict[str, Found] = {}
        for engine in engines:
            if engine.name not in failed:
                by_name[engine.name] = found = _of(engine, model, PEER_LIMIT_S)
                if found.wrong:
                    failed.add(engine.name)
        yield size, by_name


def _of(engine: Engine, model: str, limit_s: float = 0.0) -> Found:
    limit_s = limit_s or (OWN_LIMIT_S if engine.command == OWN else PEER_LIMIT_S)
    return look(engine, {"xml": model}, limit_s, expected=EXPECTED)


def _said(what: str, found: Verified, done: Callable[[Verified], object]) -> None:
    print(f"{what}: done", file=sys.stderr)
    done(found)
