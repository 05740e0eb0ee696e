from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.command_line import CommandLine, command_line
from tests.faults import Faults, with_faults


@pytest.fixture
def m2pem(tmp_path: Path) -> Iterator[CommandLine]:
    yield from command_line(tmp_path)


@pytest.fixture
def faults(tmp_path: Path) -> Faults:
    return Faults(tmp_path)


@pytest.fixture
def faulty(tmp_path: Path, faults: Faults) -> Iterator[CommandLine]:
    """m2pem whose processes have the faults."""
    made = CommandLine(tmp_path, faults.variables, with_faults())
    yield made
    made.end()
