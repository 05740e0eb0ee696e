"""The contract of journals: approvals of missions, and who has edited their files."""

from m2pem.fleet.approval import Approval, Edit
from m2pem.journal.base import Journal
from m2pem.testing.contracts.contract import needs
from m2pem.testing.contracts.journal_harness import JournalFixtures, OpenJournal, opened

ANNA = Approval("north", "patrol.bpmn", "d1", "anna@gcs1", 5, {"the mission file": "f1"})
BOB = Approval("north", "patrol.bpmn", "d1", "bob", 6)
OTHER_CONTENT = Approval("north", "patrol.bpmn", "d2", "anna", 7)
OTHER_FLEET = Approval("south", "patrol.bpmn", "d1", "anna", 8)


class JournalApprovals(JournalFixtures):
    """Tests of approvals and edits."""

    async def test_approvals_come_back_as_they_were(self, journal: Journal) -> None:
        """Those of one fleet, the oldest first; one of each person and content."""
        for each in (OTHER_CONTENT, BOB, ANNA, OTHER_FLEET):
            await journal.approve(each)
        assert await journal.approvals("north") == [ANNA, BOB, OTHER_CONTENT]
        again = Approval("north", "renamed.bpmn", "d1", "Anna@gcs2", 9)
        await journal.approve(again)
        assert await journal.approvals("north") == [BOB, OTHER_CONTENT, again]
        assert await journal.approvals("west") == []

    async def test_a_withdrawn_approval_is_gone(self, journal: Journal) -> None:
        """Whatever host it is withdrawn from; others stay."""
        for each in (ANNA, BOB, OTHER_CONTENT):
            await journal.approve(each)
        await journal.withdraw_approval(Approval("north", "x.bpmn", "d1", "anna", 0))
        await journal.withdraw_approval(Approval("north", "x.bpmn", "d9", "bob", 0))
        assert await journal.approvals("north") == [BOB, OTHER_CONTENT]

    async def test_who_has_edited_a_file_first_counts(self, journal: Journal) -> None:
        """A file that nobody has edited is not known."""
        await journal.note_edit(Edit("f1", "anna", 5))
        await journal.note_edit(Edit("f1", "bob", 6))
        await journal.note_edit(Edit("f2", "bob", 7))
        assert await journal.edits(["f1", "f2", "f3"]) == {
            "f1": Edit("f1", "anna", 5),
            "f2": Edit("f2", "bob", 7),
        }

    @needs("durability")
    async def test_approvals_are_kept_and_seen_by_others(self, open_journal: OpenJournal) -> None:
        """Also when the journal is opened again."""
        async with opened(open_journal) as one, opened(open_journal) as two:
            await one.approve(ANNA)
            await one.note_edit(Edit("f1", "anna", 5))
            assert await two.approvals("north") == [ANNA]
            assert "f1" in await two.edits(["f1"])
        async with opened(open_journal) as journal:
            assert await journal.approvals("north") == [ANNA]
            await journal.withdraw_approval(ANNA)
            assert await journal.approvals("north") == []
