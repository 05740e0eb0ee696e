"""Whatever is written beside a journal is its owner's alone: it says where vehicles are."""

import stat
from pathlib import Path

from tests.command_line import CommandLine

from .test_operator import driving


def test_every_file_beside_the_journal_is_its_owners_alone(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    program = driving(m2pem, speed="1")
    (journal,) = tmp_path.rglob("journal.db")
    files = {
        path.name.partition("journal.db")[2].rstrip("0123456789abcdef"): path
        for path in journal.parent.iterdir()
    }
    assert {"", "-wal", "-shm", "-lock", "-mark", "-control", "-sim-"} <= files.keys()
    for path in journal.parent.rglob("*"):
        mode = stat.S_IMODE(path.stat().st_mode)
        assert mode & 0o077 == 0, f"{path.name}: {mode:o}"
    program.type("stop")
    program.rest()
