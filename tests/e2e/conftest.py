from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.command_line import CommandLine, command_line


@pytest.fixture
def m2pem(tmp_path: Path) -> Iterator[CommandLine]:
    yield from command_line(tmp_path)
