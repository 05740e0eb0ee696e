"""A broker for each test, and a judge at it: no message of a test may break the protocol."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from vda_world import Judge, Mosquitto


@pytest.fixture
def broker(tmp_path: Path) -> Iterator[Mosquitto]:
    """A mosquitto that runs."""
    made = Mosquitto(tmp_path)
    made.start()
    yield made
    made.stop()


@pytest.fixture
def judge(broker: Mosquitto) -> Iterator[Judge]:
    """Validates all messages of the test."""
    made = Judge(broker.port)
    yield made
    made.close()
    assert made.problems == []
