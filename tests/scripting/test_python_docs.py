"""The Python code of some pages runs, and prints what its comments say."""

import re
from pathlib import Path

import pytest

from tests.console import REPOSITORY, environment, first_unprinted, make_workspace, run_preloaded

PAGES = ("python.md", "campaigns.md")
TEXTS = {page: (REPOSITORY / "docs" / page).read_text(encoding="utf-8") for page in PAGES}
BLOCKS = {
    f"{page}:{text.count(chr(10), 0, found.start()) + 1}": found[1]
    for page, text in TEXTS.items()
    for found in re.finditer(r"^```python\n(.*?)^```$", text, re.M | re.S)
}


def output(code: str) -> tuple[str, ...]:
    """What a block says that it prints: comments of their own, and behind a `print`."""
    said = [re.search(r"^# (.*)$|^print\(.*\)  # (.*)$", line) for line in code.splitlines()]
    return tuple(found[1] or found[2] for found in said if found)


def test_comments_are_read_as_output() -> None:
    assert output("x = 1  # one\nprint(x)  # 1\n# two\n    # no\n") == ("1", "two")
    assert len(BLOCKS) >= 7
    assert sum(bool(output(code)) for code in BLOCKS.values()) >= 5


@pytest.mark.parametrize("place", BLOCKS)
def test_a_block_does_what_it_says(place: str, tmp_path: Path) -> None:
    workspace = make_workspace(tmp_path / "workspace")
    done = run_preloaded(["-c", BLOCKS[place]], workspace, environment(tmp_path / "home"))
    assert done.returncode == 0, done.stdout
    expected = output(BLOCKS[place])
    if expected:
        missing = first_unprinted(expected, done.stdout)
        assert missing is None, f"{done.stdout}\nnot as shown: {missing}"
