import logging
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from m2pem.cli.group import run_command_line
from tests.command_line import CommandLine, command_line

Invoke = Callable[..., tuple[int, str, str]]


@pytest.fixture
def m2pem(tmp_path: Path) -> Iterator[CommandLine]:
    yield from command_line(tmp_path)


@pytest.fixture
def invoke(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Iterator[Invoke]:
    """Runs a command line in this process: exit status, standard output, standard error."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    logger = logging.getLogger("m2pem")
    before = (logger.handlers[:], logger.propagate, logger.level)

    def run(*words: object) -> tuple[int, str, str]:
        status = run_command_line([str(word) for word in words])
        out, err = capsys.readouterr()
        return status, out, err

    yield run
    logger.handlers[:], logger.propagate, logger.level = before
