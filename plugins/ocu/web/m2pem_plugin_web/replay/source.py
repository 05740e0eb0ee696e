"""Where the records of a replay come from: the journal, or a rehearsal in memory."""

from collections.abc import Mapping, Sequence
from typing import TypeAlias

from m2pem.api import Mission, MissionControl, RunId, RunSummary, StampedRecord
from m2pem.errors import M2pemError

_EARLIER = (100, 1000, 10_000, 100_000)
"""An input may have that many records: a journal is read from the first record of one."""


class JournalSource:
    """The records of a run of the journal that is over. `summary.records`: how many it has."""

    names: Mapping[str, str] | None = None
    """The names of what the mission defines, by id; None: `mission` has them."""

    def __init__(self, control: MissionControl, summary: RunSummary) -> None:
        self.summary = summary
        self._control = control

    async def mission(self) -> Mission | None:
        """Return the mission; None: there is none, or it cannot be read."""
        try:
            return await self._control.mission(self.summary.run)
        except M2pemError:
            return None

    async def between(self, after: int, last: int) -> Sequence[StampedRecord]:
        """Return the records after `after` up to and with `last`: of an input that begins before,
        the rest."""
        run: RunId = self.summary.run
        for earlier in (*_EARLIER, after):
            begin = max(0, after - earlier)
            found = list(await self._control.records(run, begin, last - begin))
            if not found or found[0].seq <= after + 1 or not begin:
                break
        while found and found[-1].seq < last:
            more = await self._control.records(run, found[-1].seq, last - found[-1].seq)
            if not more:
                break
            found += more
        return [each for each in found if after < each.seq <= last]


class ListSource:
    """Records in memory, which count from 1."""

    def __init__(
        self,
        summary: RunSummary,
        records: Sequence[StampedRecord],
        names: Mapping[str, str] | None = None,
    ) -> None:
        self.summary = summary
        self.names = names
        self._records = records

    async def mission(self) -> Mission | None:
        """See `JournalSource.mission`: the names are given."""
        return None

    async def between(self, after: int, last: int) -> Sequence[StampedRecord]:
        """See `JournalSource.between`."""
        return self._records[after:last]


RecordSource: TypeAlias = JournalSource | ListSource
