"""Tests on real autopilots run where their programs are; elsewhere one line each says so."""

import os

import pytest

PROGRAMS = ("M2PEM_ARDUCOPTER", "M2PEM_ARDUROVER", "M2PEM_PX4")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    absent = [item for item in items if _program_of(item) and _program_of(item) not in os.environ]
    if absent:
        config.hook.pytest_deselected(items=absent)
        items[:] = [item for item in items if item not in set(absent)]


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    unset = [name for name in PROGRAMS if name not in os.environ]
    if unset:
        terminalreporter.write_line(
            f"no tests on real autopilots: {', '.join(unset)} unset (docs/mavlink.md)"
        )


def _program_of(item: pytest.Item) -> str:
    marker = item.get_closest_marker("sitl")
    return str(marker.args[0]) if marker is not None else ""
