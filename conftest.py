"""What all tests here go by: none fails because a computer is busy with something else."""

import gc
import os
import signal
import sys
import tempfile

import pytest
from hypothesis import HealthCheck, settings

from m2pem.cli import NEW_OBJECTS

# To collect the tests makes objects that stay: to look for garbage among them takes a fifth of its
# time. `pytest_collection_finish` ends this.
gc.disable()

# What a change has broken fails, and fails again: `make test` tries the same examples every time.
# The long tests try others, and more (`--hypothesis-profile random`).
settings.register_profile(
    "random", deadline=None, suppress_health_check=[HealthCheck.too_slow], print_blob=True
)
settings.register_profile(
    "repeatable", settings.get_profile("random"), derandomize=True, max_examples=40
)
settings.load_profile("repeatable")

# A shell that starts the tests in the background has them, and all that they start, ignore Ctrl-C.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# Tests start the same programs hundreds of times: these are compiled once, not at each start.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

# Executives that tests start are no concern of those that this user runs, nor of another worker's.
os.environ["M2PEM_RUNTIME_DIR"] = tempfile.mkdtemp(prefix="m2pem-tests-")

# Tests on real autopilots run where their programs are; elsewhere one line each says so.
_PROGRAMS = ("M2PEM_ARDUCOPTER", "M2PEM_ARDUROVER", "M2PEM_ARDUPLANE", "M2PEM_PX4")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out the tests of autopilots whose programs are not named.

    Of a class that says which of its tests are `quick`, the others are long.
    """
    for item in items:
        if isinstance(item, pytest.Function):
            name = item.name
            if name not in getattr(item.cls, "quick", (name,)):
                item.add_marker(pytest.mark.long)
    absent = [item for item in items if not _programs_of(item) <= os.environ.keys()]
    if absent:
        config.hook.pytest_deselected(items=absent)
        items[:] = [item for item in items if item not in set(absent)]


def pytest_collection_finish() -> None:
    """Let Python look for garbage as rarely as in m2pem, and not in what was imported for tests."""
    gc.freeze()
    gc.set_threshold(NEW_OBJECTS)
    gc.enable()


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Name the programs that would let the others run."""
    unset = [name for name in _PROGRAMS if name not in os.environ]
    if unset:
        terminalreporter.write_line(
            f"no tests on real autopilots: {', '.join(unset)} unset (docs/mavlink.md)"
        )


def _programs_of(item: pytest.Item) -> set[str]:
    marker = item.get_closest_marker("sitl")
    return set() if marker is None else set(marker.args)
