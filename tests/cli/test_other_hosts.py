"""On a journal in PostgreSQL, commands name the executive of another host that they would ask."""

import asyncio
import socket
from collections.abc import Iterator

import pytest

from m2pem.control_socket import client
from m2pem.journal import Journal, open_journal
from m2pem.scheduling.entry import EntryState
from m2pem.testing.contracts.journal_harness import HEADER, PLAN
from tests.cli.conftest import Invoke
from tests.command_line import MISSION
from tests.postgres_server import postgres, postgres_url

__all__ = ["postgres", "postgres_url"]

SERVES = "gcs2 serves north (process "
DRIVES = "gcs2 drives r1 (process "


@pytest.fixture
def served(postgres_url: str, monkeypatch: pytest.MonkeyPatch) -> Iterator[Journal]:
    """The journal of an executive on host gcs2, which serves fleet north and drives r1."""
    with monkeypatch.context() as there:
        there.setattr(socket, "gethostname", lambda: "gcs2")
        journal = open_journal(postgres_url)
        asyncio.run(journal.serve_fleet("north", ["evsg1"]))
        asyncio.run(journal.create(HEADER))
    yield journal
    asyncio.run(journal.close())


def test_a_command_says_which_host_has_what_it_asks_for(
    invoke: Invoke, served: Journal, postgres_url: str
) -> None:
    asyncio.run(served.schedule(PLAN, EntryState(0)))
    for words, found in (
        (("start", MISSION), SERVES),
        (("stop", "--all"), SERVES),
        (("stop", "r1"), DRIVES),
        (("attach",), SERVES),
        (("attach", "r1"), DRIVES),
        (("incidents",), SERVES),
        (("fleet", "--running"), SERVES),
        (("schedule", "start", "s1"), SERVES),
    ):
        status, _, err = invoke(*words, "--journal", postgres_url)
        assert status != 0
        said = err.splitlines()[-1]
        assert said.startswith(f"m2pem: {found}"), words
        assert said.endswith(": run the command there")
        assert "no executive" not in err
    assert SERVES in invoke("doctor", "--running", "--journal", postgres_url)[1]
    _, out, err = invoke("schedule", "--journal", postgres_url)
    assert "s1" in out
    assert err.splitlines()[-1].startswith(SERVES)


def test_the_schedule_that_another_host_serves_is_held_and_released_in_the_journal(
    invoke: Invoke, served: Journal, postgres_url: str
) -> None:
    assert invoke("schedule", "hold", "--journal", postgres_url)[2].endswith(
        "nothing is scheduled\n"
    )
    asyncio.run(served.schedule(PLAN, EntryState(0)))
    for word, held in (("hold", True), ("release", False)):
        assert invoke("schedule", word, "--journal", postgres_url)[0] == 0
        assert (asyncio.run(served.schedule_hold("north")) is not None) is held
    assert invoke("schedule", "release", "--journal", postgres_url)[2].endswith("is not held\n")


def test_a_stop_of_all_says_what_it_has_not_stopped(
    invoke: Invoke, served: Journal, postgres_url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(client, "ask_all", lambda *_, **__: ["r9"])
    status, out, err = invoke("stop", "--all", "--journal", postgres_url)
    assert status == 1
    assert out == "stopped: r9\n"
    said = err.splitlines()[-1]
    assert said.startswith(f"m2pem: what other hosts have is not stopped: {SERVES}")
