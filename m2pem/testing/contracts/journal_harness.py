"""The harness of journal tests: what they write, and how they read it.

`JournalFixtures` has what authors override.
"""

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping, Sequence
from contextlib import asynccontextmanager
from typing import ClassVar, TypeAlias

import pytest
import pytest_asyncio

from m2pem.engine.inputs import Input, Tick
from m2pem.engine.records import InputIgnored, Record, RunEnded, RunOutcome, RunStarted
from m2pem.journal.base import Entry, Journal, RunHeader, RunInfo
from m2pem.mission.library import Source
from m2pem.scheduling.entry import SchedulePlan, When
from m2pem.testing.contracts.contract import Contract

HEADER = RunHeader(
    mission_name="vignette1.bpmn",
    mission="<définitions/>".encode(),
    process="PATROL",
    fleet=b"\x00\xff fleet",
    simulated=True,
    speed=2.5,
    created_us=1_767_225_600_000_001,
    library=(
        Source("lib/süd.bpmn", b"\x00\xff", (("call", "SEARCH", ""), ("import", "a.bpmn", "m"))),
        Source("b.bpmn", b""),
    ),
)

PLAN = SchedulePlan(
    "vignette1.bpmn",
    HEADER.mission,
    "PATROL",
    "north",
    1_767_225_600_000_001,
    When(cron="0 8 * * *", time_zone="Europe/Berlin"),
    HEADER.library,
    {"a": [1, 2.5, None, "ü"]},
    simulated=False,
    priority=-3,
    by="anna",
)

ENDED = (RunStarted("PATROL", 5), RunEnded(RunOutcome.COMPLETED, ""))
"""Records of a run that has ended."""

OpenJournal: TypeAlias = Callable[[], Journal]


@asynccontextmanager
async def opened(open_journal: OpenJournal) -> AsyncIterator[Journal]:
    """Open a journal, and close it in the end."""
    journal = open_journal()
    try:
        yield journal
    finally:
        await journal.close()


def entry(
    run: str, seq: int, *records: Record, given: Input | None = None, epoch: int = 1
) -> Entry:
    """An entry with these records, else with one `InputIgnored` that says its number."""
    some = records or (InputIgnored(f"nr {seq}"),)
    at_us = HEADER.created_us + seq
    return Entry(run, epoch, seq, at_us, seq * 10, Tick() if given is None else given, some)


async def written(journal: Journal, run: str, after_seq: int = 0) -> list[Entry]:
    """Return all entries that the journal has of a run."""
    return [found async for found in journal.read(run, after_seq)]


async def info(journal: Journal, run: str) -> RunInfo:
    """Return the information of `runs` about one run."""
    (found,) = [some for some in await journal.runs() if some.run == run]
    return found


async def outcomes(*calls: Awaitable[None]) -> Sequence[BaseException | None]:
    """Return what each of several concurrent calls raised."""
    return await asyncio.gather(*calls, return_exceptions=True)


class JournalFixtures(Contract):
    """The fixture that authors override, and what they may declare unsupported."""

    m2pem_contract: ClassVar[str] = "JournalContract"
    subjects: ClassVar[Mapping[str, str]] = {
        "durability": "a journal that is opened again, or twice, has what was written",
        "notification": "a journal is notified of what other executives change",
    }

    @pytest.fixture
    def open_journal(self) -> OpenJournal:
        """Opens a journal; each call on the same storage, which is empty at first."""
        raise NotImplementedError("override this fixture")

    @pytest_asyncio.fixture
    async def journal(self, open_journal: OpenJournal) -> AsyncIterator[Journal]:
        """A journal that is closed after the test."""
        async with opened(open_journal) as journal:
            yield journal
