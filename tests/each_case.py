"""One test for a table of many cheap cases: it goes through all and reports all that fail."""

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TypeVar

import pytest

Case = TypeVar("Case")


def failures(check: Callable[[Case], None], cases: Iterable[Case]) -> list[str]:
    """What is wrong, a text for each case in which `check` raises anything."""
    wrong = []
    for case in cases:
        try:
            check(case)
        except Exception as error:
            wrong.append(f"{case}: {type(error).__name__}: {error}")
    return wrong


def every_file(
    own: Iterable[Path], foreign: Iterable[Path]
) -> Callable[[Callable[[Path], None]], Callable[[list[Path]], None]]:
    """Make of a check of one file a test of all files of the repository, and a long one of others'.

    The check takes the file alone, no fixture.
    """

    def test_of(check: Callable[[Path], None]) -> Callable[[list[Path]], None]:
        @pytest.mark.parametrize(
            "files",
            [
                pytest.param(list(own), id="own"),
                pytest.param(list(foreign), id="foreign", marks=pytest.mark.long),
            ],
        )
        def test(files: list[Path]) -> None:
            assert failures(check, files) == []

        return test

    return test_of
