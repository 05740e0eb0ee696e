"""The rows of the table of faults that no other test plays; the others name the test that does."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.chaos.fault_table import (
    ARBITERS,
    JOURNALS,
    PLAYED,
    ROWS,
    Fault,
    Outcome,
    Row,
    as_markdown,
    play,
)
from tests.chaos.kill_points import POSTGRES, SQLITE
from tests.command_line import REPOSITORY

TWO = [
    (Fault.FULL, SQLITE.name, "mavlink"),
    (Fault.DATABASE_KILLED, POSTGRES.name, "simulated"),
]
"""Those of `make test`."""


def _case(row: Row) -> object:
    key = (row.fault, row.journal, row.arbiter)
    marks = () if key in TWO else (pytest.mark.long, pytest.mark.timeout(600))
    return pytest.param(
        row, id=f"{row.fault.name.lower()}-{row.journal}-{row.arbiter}", marks=marks
    )


@pytest.mark.parametrize("row", [_case(row) for row in PLAYED])
def test_a_fault_comes_to_what_the_table_says(row: Row, tmp_path: Path) -> None:
    assert isinstance(row.outcome, Outcome)
    verdict, said = play(row, tmp_path)
    assert not verdict.faults
    reads = (*row.outcome.reads, *row.outcome.later)
    assert [each for each in reads if each not in said] == []
    ends = {name: end for name, (end, _) in verdict.ends.items()}
    if row.outcome.failed:
        # The other mission may need the same vehicle.
        assert ends.pop("in_turn.bpmn") in ("completed", "failed")
        assert ends == {"two_ways.bpmn": "failed"}
    else:
        assert ends == {"two_ways.bpmn": "completed", "in_turn.bpmn": "completed"}


def test_each_case_is_one_row_that_is_played_once_or_says_why_there_is_none() -> None:
    cases = [(row.fault, row.journal, row.arbiter) for row in ROWS]
    assert len(set(cases)) == len(cases) == len(Fault) * len(JOURNALS) * len(ARBITERS)
    named = [row.test for row in ROWS if row.test]
    assert len(set(named)) == len(named)
    assert not any(row.test for row in ROWS if isinstance(row.outcome, str))


def test_the_tests_that_rows_name_are_there() -> None:
    named = [row.test for row in ROWS if row.test]
    command = [sys.executable, "-m", "pytest", "--collect-only", "-q", "-m", "long or not long"]
    found = subprocess.run(
        [*command, "-p", "no:cacheprovider", *named],
        cwd=REPOSITORY, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert found.returncode == 0, found.stdout + found.stderr


def test_the_page_has_the_table() -> None:
    page = (REPOSITORY / "docs/journal.md").read_text(encoding="utf-8")
    assert as_markdown() in page
