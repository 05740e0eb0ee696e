"""The pytest plugin: a summary of contracts, and fixtures for the tests of plugins.

It is loaded in every run of pytest where m2pem is installed, so it imports m2pem only when a
fixture is used.
"""

from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar

import pytest

if TYPE_CHECKING:
    from contextlib import AbstractAsyncContextManager

    from m2pem.api.clock import VirtualClock
    from m2pem.api.control import MissionControl

T = TypeVar("T")

pytest.register_assert_rewrite("m2pem.testing.contracts", "m2pem.testing.harness")

_PROPERTY = "m2pem_contract"
_NOT_SUPPORTED = "not supported: "  # as in contracts.contract, which would be imported by asking it
START_US = 1_767_225_600_000_000  # 2026-01-01T00:00:00Z


@pytest.fixture
def virtual() -> "Callable[[Callable[[VirtualClock], Awaitable[T]]], T]":
    """Runs a coroutine function in virtual time: `virtual(main)` awaits `main(clock)`.

    The clock begins at 2026-01-01T00:00:00Z. The coroutine cannot wait for real I/O.
    """
    from m2pem.api.clock import run_virtual  # noqa: PLC0415

    def run(main: "Callable[[VirtualClock], Awaitable[T]]") -> T:
        return run_virtual(main, START_US)

    return run


@pytest.fixture
def executive() -> "Callable[..., AbstractAsyncContextManager[MissionControl]]":
    """The function `run_executive`: `async with executive(fleet) as control`."""
    from m2pem.testing.harness import run_executive  # noqa: PLC0415

    return run_executive


def pytest_collection_modifyitems(items: Sequence[pytest.Item]) -> None:
    """Add the name of its contract to each test, as a property of its report."""
    for item in items:
        contract = getattr(getattr(item, "cls", None), _PROPERTY, "")
        if contract:
            item.user_properties.append((_PROPERTY, contract))


@dataclass(slots=True)
class _Tally:
    contract: str
    kept: int = 0
    broken: int = 0
    skipped: int = 0
    unsupported: dict[str, int] = field(default_factory=dict)


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Report for each contract how many tests pass, and what is declared unsupported, and why."""
    tallies = _tallies(terminalreporter.stats)
    if not tallies:
        return
    terminalreporter.section("m2pem contracts")
    for place, tally in sorted(tallies.items()):
        counts = [f"{tally.kept} kept"]
        counts += [f"{tally.broken} BROKEN"] if tally.broken else []
        counts += [f"{tally.skipped} skipped"] if tally.skipped else []
        if tally.unsupported:
            counts.append(f"{sum(tally.unsupported.values())} not supported")
        terminalreporter.line(f"{tally.contract} of {place}: {', '.join(counts)}")
        for what, tests in tally.unsupported.items():
            plural = "s" if tests > 1 else ""
            terminalreporter.line(f"  not supported: {what} ({tests} test{plural})")


def _tallies(stats: dict[str, list[Any]]) -> dict[str, _Tally]:
    tallies: dict[str, _Tally] = {}
    for outcome in ("passed", "failed", "error", "skipped"):
        for report in stats.get(outcome, ()):
            contract = dict(getattr(report, "user_properties", ())).get(_PROPERTY)
            if contract is None:
                continue
            place = report.nodeid.rpartition("::")[0]
            tally = tallies.setdefault(place, _Tally(str(contract)))
            if outcome == "passed":
                tally.kept += 1
            elif outcome != "skipped":
                tally.broken += 1
            elif what := _unsupported(report):
                tally.unsupported[what] = tally.unsupported.get(what, 0) + 1
            else:
                tally.skipped += 1
    return tallies


def _unsupported(report: Any) -> str:
    """Return what is not supported, and why, by a skipped test; "": it was skipped otherwise."""
    reason = report.longrepr[2] if isinstance(report.longrepr, tuple) else ""
    _, marker, what = str(reason).partition(_NOT_SUPPORTED)
    return what if marker else ""
