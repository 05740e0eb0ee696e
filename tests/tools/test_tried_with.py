"""docs/tried-with.md says what the tests say; its versions are those that the tests run with."""

import shutil
import subprocess
from collections.abc import Sequence

import pytest

from tools.tried_with import PAGE, MarkError, Row, page, pins, rows, rows_of

LEAST = 40
SAYS_ITS_VERSION = {
    "mosquitto": ("mosquitto", "-h"),
    "PostgreSQL": ("postgres", "--version"),
    "Spin": ("spin", "-V"),
    "systemd": ("systemd-analyze", "--version"),
}
"""How what is no pinned package says which one is installed."""


def marked(*marks: str, above: str = "") -> Row:
    (row,) = rows_of("tests/test_it.py", "\n".join((above, *marks, "def test_it(): ...")))
    return row


def tried(words: str) -> str:
    return f"@pytest.mark.tried_with('pyshp', 'writes', kind='ROS 2', result='read', {words})"


def test_the_page_says_what_the_tests_say() -> None:
    written = PAGE.read_text(encoding="utf-8")
    assert written == page(), "run: python -m tools.tried_with > docs/tried-with.md"


def test_there_are_enough_rows_and_none_is_there_twice() -> None:
    found = [(row.program, row.did) for row in rows()]
    assert len(set(found)) == len(found) >= LEAST


@pytest.mark.parametrize("program", SAYS_ITS_VERSION)
def test_what_is_installed_has_the_version_of_its_rows(program: str) -> None:
    command: Sequence[str] = SAYS_ITS_VERSION[program]
    if shutil.which(command[0]) is None:
        pytest.skip(f"{command[0]} is not installed")
    said = subprocess.run(command, capture_output=True, text=True, check=False)
    versions = {row.version for row in rows() if row.program == program}
    assert versions
    assert all(f" {version}" in said.stdout + said.stderr for version in versions)


def test_a_version_is_the_pinned_one() -> None:
    assert marked(tried("note='n'")).version == f"{pins()['pyshp']} (`pyshp`)"
    assert marked(tried("package='vite'")).version == f"{pins()['vite']} (`vite`)"


@pytest.mark.parametrize(
    ("marks", "when"),
    [
        ([tried("")], "each `make test`"),
        (["@pytest.mark.long", tried("")], "each `make test-long`"),
        (["@pytest.mark.sitl('A', 'B')", tried("on='2026-11'")], "2026-11, with `A` and `B`"),
        ([tried("on='2026-11', needs='a lidar'")], "2026-11, with a lidar"),
    ],
)
def test_what_a_test_needs_says_when_it_was_done(marks: Sequence[str], when: str) -> None:
    assert marked(*marks).when == when


def test_marks_of_the_module_count_for_its_tests() -> None:
    row = marked(tried("on='2026-11'"), above="pytestmark = [pytest.mark.sitl('A')]")
    assert (row.when, row.test) == ("2026-11, with `A`", "tests/test_it.py::test_it")


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("version='3.1'", "the version of pyshp is pinned: leave it out"),
        ("package='no-such'", "the package no-such is pinned nowhere"),
        ("on='2026-11'", "'on' is given where more than"),
        ("needs='a lidar'", "'on' is given where more than"),
        ("by='me'", "unexpected keyword argument 'by'"),
    ],
)
def test_a_mark_that_cannot_be_used_is_named_with_its_test(words: str, says: str) -> None:
    with pytest.raises(MarkError, match=f"^tests/test_it.py::test_it: tried_with: .*{says}"):
        marked(tried(words))


def test_a_program_that_is_pinned_nowhere_needs_its_version() -> None:
    mark = "@pytest.mark.tried_with('X', 'x', kind='TAK', result='x')"
    with pytest.raises(MarkError, match="X is pinned nowhere: give its 'version'"):
        marked(mark)
    with pytest.raises(MarkError, match="there is no kind 'SQL'; one of Autopilots"):
        marked(mark.replace("TAK", "SQL"))
