"""A round of each fault after which a standby takes over; `make chaos` is for many."""

from pathlib import Path

import pytest

from tests.chaos.takeovers import Fault, play
from tests.postgres_server import PostgresServer, postgres

__all__ = ["postgres"]


@pytest.mark.long
@pytest.mark.parametrize("fault", Fault, ids=lambda fault: fault.name.lower())
def test_a_standby_takes_over_in_time(
    fault: Fault, postgres: PostgresServer, tmp_path: Path
) -> None:
    play(fault, postgres, tmp_path)
