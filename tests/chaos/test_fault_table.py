"""The rows of the table of faults are played, and are on the page."""

from pathlib import Path

import pytest

from tests.chaos.fault_table import (
    ARBITERS,
    JOURNALS,
    PLAYED,
    ROWS,
    Fault,
    Row,
    as_markdown,
    check,
)
from tests.chaos.kill_points import POSTGRES, SQLITE
from tests.chaos.worlds import OF_ROS
from tests.command_line import REPOSITORY

TWO = [
    (Fault.FULL, SQLITE.name, "mavlink"),
    (Fault.DATABASE_KILLED, POSTGRES.name, "simulated"),
]
"""Those of `make test`."""


def _case(row: Row) -> object:
    key = (row.fault, row.journal, row.arbiter)
    marks = () if key in TWO else (pytest.mark.long, pytest.mark.timeout(600))
    return pytest.param(row, id=row.id, marks=marks)


# test_ros_chaos.py plays those of ROS.
@pytest.mark.parametrize("row", [_case(row) for row in PLAYED if row.arbiter not in OF_ROS])
def test_a_fault_comes_to_what_the_table_says(row: Row, tmp_path: Path) -> None:
    check(row, tmp_path)


def test_each_case_is_one_row() -> None:
    cases = [(row.fault, row.journal, row.arbiter) for row in ROWS]
    assert len(set(cases)) == len(cases) == len(Fault) * len(JOURNALS) * len(ARBITERS)


def test_the_page_has_the_table() -> None:
    page = (REPOSITORY / "docs/journal.md").read_text(encoding="utf-8")
    assert as_markdown() in page
