"""Tests on real autopilots run where their programs are; elsewhere one line each says so."""

import os

import pytest

PROGRAMS = ("M2PEM_ARDUCOPTER", "M2PEM_ARDUROVER", "M2PEM_ARDUPLANE", "M2PEM_PX4")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    absent = [item for item in items if not _programs_of(item) <= os.environ.keys()]
    if absent:
        config.hook.pytest_deselected(items=absent)
        items[:] = [item for item in items if item not in set(absent)]


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    unset = [name for name in PROGRAMS if name not in os.environ]
    if unset:
        terminalreporter.write_line(
            f"no tests on real autopilots: {', '.join(unset)} unset (docs/mavlink.md)"
        )


def _programs_of(item: pytest.Item) -> set[str]:
    marker = item.get_closest_marker("sitl")
    return set() if marker is None else set(marker.args)
