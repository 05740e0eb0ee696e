"""A wheel for all tests of authors, and an author for each."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.authoring.author import Author, build_wheel


@pytest.fixture(scope="session")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build_wheel(tmp_path_factory.mktemp("wheel"))


@pytest.fixture
def author(tmp_path: Path, wheel: Path) -> Iterator[Author]:
    folder = tmp_path / "m2pem-plugin"
    folder.mkdir()
    author = Author(folder, wheel)
    yield author
    author.leave()
