"""BPMN 2.0 chapter by chapter: every case of tests/data does what the specification says.

The cases are data (tests/data/README.md). `-k 10.6` runs those of one chapter.
"""

from collections import Counter
from pathlib import Path

import pytest

from tests.cases import DATA, read_cases, read_topic
from tests.cases.playing import differences
from tests.cases.reading import TOPICS


@pytest.mark.parametrize("topic", TOPICS, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_the_cases_go_as_the_specification_says(topic: Path) -> None:
    found = [wrong for case in read_topic(topic) if (wrong := differences(case))]
    if found:
        pytest.fail("\n\n".join(found), pytrace=False)


def test_every_file_belongs_to_a_case() -> None:
    used = {case.file for case in read_cases()}
    assert sorted(set(DATA.glob("[0-9]*/*.bpmn")) - used) == []


def test_no_two_cases_are_the_same_row_of_the_table() -> None:
    rows = Counter((case.element, case.variant) for case in read_cases())
    assert [row for row, times in rows.items() if times > 1] == []


def test_folders_are_named_after_chapters_of_the_specification() -> None:
    folders = [path for path in DATA.iterdir() if path.is_dir() and path.name != "model"]
    assert all(Path(path).name[0].isdigit() for path in folders), folders
