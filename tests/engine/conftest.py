"""Every play of every test must replay, and be decided again, to the same state."""

from collections.abc import Iterator

import pytest

from tests.engine.kit import Play


@pytest.fixture(autouse=True)
def _verify_plays() -> Iterator[None]:
    Play.made.clear()
    yield
    plays, Play.made = Play.made, []
    for play in plays:
        play.verify()
