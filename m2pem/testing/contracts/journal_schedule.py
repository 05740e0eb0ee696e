"""The contract of journals: the schedule of missions."""

import asyncio
from dataclasses import replace

import pytest

from m2pem.errors import JournalError, StaleAlertsError, StaleDrawingsError, StaleEntryError
from m2pem.journal.base import Journal
from m2pem.scheduling.entry import (
    EntryChange,
    EntryState,
    EntryStatus,
    Hold,
    SettledTime,
    Settlement,
)
from m2pem.testing.contracts.contract import needs
from m2pem.testing.contracts.journal_harness import (
    HEADER,
    PLAN,
    JournalFixtures,
    OpenJournal,
    entry,
    opened,
    outcomes,
)

STARTED = SettledTime(9, 10, Settlement.STARTED)

_NOTIFIED_WITHIN_S = 30.0


class JournalSchedule(JournalFixtures):
    """Tests of the schedule: its entries, their changes and starts, and what is held."""

    async def test_an_entry_of_the_schedule_comes_back_as_it_was(self, journal: Journal) -> None:
        """Also after the journal was closed, where it is durable; ids are given in their order."""
        first = await journal.schedule(PLAN, EntryState(5))
        second = await journal.schedule(PLAN, EntryState(6))
        assert (first.id, second.id) == ("s1", "s2")
        assert await journal.entries() == [first, second]
        changed = EntryState(7, hold=Hold("anna", "rain", 8), revision=1)
        await journal.change_entry(EntryChange("s1", changed))
        assert [each.state for each in await journal.entries()] == [changed, EntryState(6)]

    async def test_a_run_and_its_entry_are_written_together_or_not_at_all(
        self, journal: Journal
    ) -> None:
        """So that no time of an entry starts two runs."""
        await journal.schedule(PLAN, EntryState(5))
        started = EntryState(9, times=(STARTED,), revision=1)
        run = await journal.create(HEADER, EntryChange("s1", started))
        (entry,) = await journal.entries()
        assert (entry.state.run, entry.state.times[-1].run) == (run, run)
        with pytest.raises(StaleEntryError):
            await journal.create(HEADER, EntryChange("s1", started))
        with pytest.raises(JournalError):
            await journal.create(HEADER, EntryChange("s2", started))
        assert [found.run for found in await journal.runs()] == [run]
        assert await journal.entries() == [entry]

    async def test_of_two_changes_at_once_the_second_is_refused(self, journal: Journal) -> None:
        """It would undo the first one."""
        await journal.schedule(PLAN, EntryState(5))
        changes = [
            journal.change_entry(EntryChange("s1", EntryState(number, revision=1)))
            for number in (6, 7)
        ]
        failed = [type(each) for each in await outcomes(*changes) if each is not None]
        assert failed == [StaleEntryError]
        assert (await journal.entries())[0].state.settled_us in (6, 7)

    async def test_a_run_that_never_began_is_deleted_with_the_start_of_its_entry(
        self, journal: Journal
    ) -> None:
        """One that has begun stays, and so does the state of the entry."""
        await journal.schedule(PLAN, EntryState(5))
        started = EntryChange("s1", EntryState(9, times=(STARTED,), revision=1))
        run = await journal.create(HEADER, started)
        back = EntryChange("s1", EntryState(5, revision=2))
        with pytest.raises(JournalError, match="driven"):
            await journal.change_entry(back, deletes=run)
        await journal.release(run)
        await journal.change_entry(back, deletes=run)
        assert await journal.runs() == []
        assert [each.run for each in await journal.deletions()] == [run]
        again = EntryChange("s1", EntryState(9, times=(STARTED,), revision=3))
        begun = await journal.create(HEADER, again)
        await journal.append([entry(begun, 1)])
        await journal.release(begun)
        with pytest.raises(JournalError, match="has begun"):
            await journal.change_entry(EntryChange("s1", EntryState(5, revision=4)), deletes=begun)
        assert (await journal.entries())[0].state.run == begun

    async def test_only_entries_that_are_over_are_removed(self, journal: Journal) -> None:
        """And their ids are not given again."""
        for _ in range(2):
            await journal.schedule(PLAN, EntryState(5))
        cancelled = EntryState(5, status=EntryStatus.CANCELLED, revision=1)
        await journal.change_entry(EntryChange("s2", cancelled))
        with pytest.raises(JournalError, match="may still start"):
            await journal.remove_entries(["s2", "s1"])
        await journal.remove_entries(["s2"])
        assert [each.id for each in await journal.entries()] == ["s1"]
        assert (await journal.schedule(PLAN, EntryState(5))).id == "s3"

    async def test_a_change_of_the_schedule_shows_in_its_revisions(self, journal: Journal) -> None:
        """Each entry that is added, changed, has started a run, or is removed."""
        assert await journal.schedule_revisions() == {}
        await journal.schedule(PLAN, EntryState(5))
        await journal.schedule(PLAN, EntryState(6))
        assert await journal.schedule_revisions() == {"s1": 0, "s2": 0}
        await journal.create(HEADER, EntryChange("s1", EntryState(9, times=(STARTED,), revision=1)))
        assert await journal.schedule_revisions() == {"s1": 1, "s2": 0}
        cancelled = EntryState(6, status=EntryStatus.CANCELLED, revision=1)
        await journal.change_entry(EntryChange("s2", cancelled))
        assert await journal.schedule_revisions() == {"s1": 1, "s2": 1}
        await journal.remove_entries(["s2"])
        assert await journal.schedule_revisions() == {"s1": 1}

    @needs("durability", "notification")
    async def test_a_change_by_another_executive_is_notified(
        self, open_journal: OpenJournal
    ) -> None:
        """Of the schedule, of its hold, and of who serves a fleet. What runs do is not."""
        async with opened(open_journal) as one, opened(open_journal) as two:
            seen = await asyncio.wait_for(one.changed(0), _NOTIFIED_WITHIN_S)
            cancelled = EntryState(5, status=EntryStatus.CANCELLED, revision=1)
            for change in (
                lambda: two.schedule(PLAN, EntryState(5)),
                lambda: two.change_entry(EntryChange("s1", cancelled)),
                lambda: two.remove_entries(["s1"]),
                lambda: two.hold_schedule("north", Hold("anna", "rain", 8)),
                lambda: two.hold_schedule("north", None),
                lambda: two.serve_fleet("north", ["ugv1"]),
                lambda: two.leave_fleet("north"),
            ):
                waiting = asyncio.ensure_future(one.changed(seen))
                await change()
                before, seen = seen, await asyncio.wait_for(waiting, _NOTIFIED_WITHIN_S)
                assert seen > before

    async def test_a_schedule_is_held_for_each_fleet(self, journal: Journal) -> None:
        """Until it is released."""
        await journal.hold_schedule("north", Hold("anna", "rain", 8))
        assert await journal.schedule_hold("north") == Hold("anna", "rain", 8)
        assert await journal.schedule_hold("south") is None
        await journal.hold_schedule("north", None)
        assert await journal.schedule_hold("north") is None

    async def test_what_is_held_starts_no_run(self, journal: Journal) -> None:
        """Also when another one holds it; what another fleet holds does not matter."""
        await journal.schedule(PLAN, EntryState(5))
        started = EntryChange("s1", EntryState(9, times=(STARTED,), revision=1))
        await journal.hold_schedule(PLAN.fleet, Hold("anna", "rain", 8))
        with pytest.raises(StaleEntryError, match="s1 starts nothing: the schedule is held"):
            await journal.create(HEADER, started)
        assert await journal.runs() == []
        await journal.hold_schedule(PLAN.fleet, None)
        await journal.hold_schedule("another", Hold("anna", "rain", 8))
        assert await journal.create(HEADER, started) == "r1"

    async def test_runs_are_listed_without_their_files(self, journal: Journal) -> None:
        """All else of them is the same."""
        await journal.create(HEADER)
        (whole,) = await journal.runs()
        (line,) = await journal.runs(files=False)
        assert line.header == whole.header.without_files()
        assert replace(line, header=whole.header) == whole

    async def test_alerts_are_kept_for_each_fleet_by_their_numbers(self, journal: Journal) -> None:
        """Until they are removed."""
        assert await journal.alerts("north") == {}
        await journal.write_alerts("north", {2: "two", 1: "one"})
        await journal.write_alerts("south", {1: "another"})
        await journal.write_alerts("north", {2: "two, acknowledged", 3: "three"})
        assert list((await journal.alerts("north")).items()) == [
            (1, "one"),
            (2, "two, acknowledged"),
            (3, "three"),
        ]
        await journal.write_alerts("north", {1: None, 2: None, 9: None})
        assert await journal.alerts("north") == {3: "three"}
        assert await journal.alerts("south") == {1: "another"}

    @needs("durability")
    async def test_what_operators_did_about_alerts_outlives_the_journal_that_wrote_it(
        self, open_journal: OpenJournal
    ) -> None:
        """The next executive reads it."""
        async with opened(open_journal) as journal:
            await journal.write_alerts("north", {1: "acknowledged by anna"})
        async with opened(open_journal) as journal:
            assert await journal.alerts("north") == {1: "acknowledged by anna"}

    @needs("durability")
    async def test_versions_of_drawings_outlive_the_journal_that_wrote_them(
        self, open_journal: OpenJournal
    ) -> None:
        """Of each fleet, by their numbers, until they are removed."""
        async with opened(open_journal) as journal:
            assert await journal.drawings("north") == {}
            await journal.write_drawings("north", {2: "two", 1: "one", 3: "three"})
            await journal.write_drawings("south", {1: "another"})
            await journal.write_drawings("north", {1: None, 3: "three again"})
        async with opened(open_journal) as journal:
            kept = await journal.drawings("north")
            assert list(kept.items()) == [(2, "two"), (3, "three again")]
            assert await journal.drawings("south") == {1: "another"}

    @pytest.mark.parametrize(
        ("kind", "error"), [("alerts", StaleAlertsError), ("drawings", StaleDrawingsError)]
    )
    async def test_of_two_writers_that_have_read_the_same_one_is_refused(
        self, journal: Journal, kind: str, error: type[JournalError]
    ) -> None:
        """The last number is compared, and alerts or drawings are written, in one transaction."""
        write, read = getattr(journal, f"write_{kind}"), getattr(journal, kind)
        await write("north", {1: "one"}, last=0)
        written = await asyncio.gather(
            write("north", {2: "two"}, last=1),
            write("north", {1: None, 2: "other"}, last=1),
            write("south", {1: "another"}, last=0),
            return_exceptions=True,
        )
        assert [type(each) for each in written] == [type(None), error, type(None)]
        assert await read("north") == {1: "one", 2: "two"}
        assert await read("south") == {1: "another"}

    @needs("durability")
    async def test_each_of_two_journals_sees_what_the_other_does_with_the_schedule(
        self, open_journal: OpenJournal
    ) -> None:
        """Entries that it adds, changes and removes, and holds of all."""
        async with opened(open_journal) as one, opened(open_journal) as two:
            assert await two.schedule_revisions() == {}
            added = await one.schedule(PLAN, EntryState(5))
            assert await two.schedule_revisions() == {"s1": 0}
            assert await two.entries() == [added]
            cancelled = EntryState(6, status=EntryStatus.CANCELLED, revision=1)
            await one.change_entry(EntryChange("s1", cancelled))
            assert await two.schedule_revisions() == {"s1": 1}
            await two.remove_entries(["s1"])
            assert await one.schedule_revisions() == {}
            await one.hold_schedule(PLAN.fleet, Hold("anna", "rain", 8))
            assert await two.schedule_hold(PLAN.fleet) == Hold("anna", "rain", 8)
