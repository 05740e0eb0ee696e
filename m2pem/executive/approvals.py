"""Approvals of missions: given, withdrawn, and asked for before a mission starts.

They are in the journal, so that a restart and a standby know them.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import PurePath

from m2pem.api.approval import EarlierApproval, GivenApproval, MissionApproval
from m2pem.errors import NotApprovedError, OperatorError
from m2pem.fleet.approval import MISSION_PART, Approval, Content, Edit, content_of, person_of
from m2pem.fleet.fleet import Fleet
from m2pem.fleet.operator_roles import why_not_allowed
from m2pem.journal.base import Journal
from m2pem.mission.geometry import Geometry
from m2pem.mission.library import Source

SHOWN_EARLIER = 5
"""How many approvals of earlier contents are told."""


@dataclass(eq=False)
class Approvals:
    """The approvals of missions for one fleet.

    `geometries`: those that missions may use now, by name; `drawn_by`: who has handed over which of
    them. `now_us`: the executive's clock. `say`: tells operators what was done.
    """

    _fleet: Fleet
    _journal: Journal
    _geometries: Callable[[], Mapping[str, Geometry]]
    _drawn_by: Callable[[], Mapping[str, str]]
    _now_us: Callable[[], int]
    _say: Callable[[str], None] = lambda _: None

    def _content(self, mission: bytes, library: Iterable[Source]) -> Content:
        return content_of(mission, library, self._geometries())

    async def state(
        self, file: str, mission: bytes, library: Iterable[Source] = ()
    ) -> MissionApproval:
        """Return who has approved a mission, and who must. `file`: the name of its file.

        Raises:
            JournalError: the journal cannot be read.
        """
        return await self._state(file, self._content(mission, library))

    async def _state(self, file: str, content: Content) -> MissionApproval:
        name, fleet = PurePath(file).name, self._fleet
        if not fleet.approval_persons:
            return MissionApproval(name, content.digest)
        edits = await self._journal.edits(content.files)
        drawn = self._drawn_by()
        makers = [edits[each].by for each in content.files if each in edits]
        makers += [drawn[each] for each in content.drawings if each in drawn]
        persons = {person_of(each) for each in makers}
        given = await self._journal.approvals(fleet.name)
        here = [each for each in given if each.digest == content.digest]
        allowed = [
            each for each in here if not why_not_allowed(fleet, fleet.approval_role, each.by)
        ]
        earlier = [each for each in given if each.mission == name and each not in here]
        return MissionApproval(
            name,
            content.digest,
            fleet.approval_persons,
            fleet.approval_role,
            tuple(dict.fromkeys(each for each in makers if each)),
            any(each not in edits for each in content.files) or not all(makers),
            tuple(GivenApproval(e.by, e.at_us) for e in allowed if e.person not in persons),
            tuple(GivenApproval(e.by, e.at_us) for e in allowed if e.person in persons),
            tuple(
                EarlierApproval(
                    each.by,
                    each.at_us,
                    content.changed_since(each.parts),
                    each.parts.get(MISSION_PART, ""),
                )
                for each in earlier[-SHOWN_EARLIER:]
            ),
        )

    def digest(self, mission: bytes, library: Iterable[Source]) -> str:
        """Return the hash of the content that a mission has now."""
        return self._content(mission, library).digest

    async def refuse_unapproved(self, file: str, mission: bytes, library: Iterable[Source]) -> str:
        """Check that a mission may start; returns the hash of the content that is approved; "":
        nobody must approve it.

        Raises:
            NotApprovedError: persons must approve it before.
            JournalError: the journal cannot be read.
        """
        if not self._fleet.approval_persons:
            return ""
        state = await self.state(file, mission, library)
        if not state.may_start:
            raise NotApprovedError(
                f"{state}. `m2pem approve {state.mission} --fleet {self._fleet.file}` does it, or "
                "the mission's page",
                state.missing,
            )
        return state.digest

    async def approve(
        self, file: str, mission: bytes, library: Iterable[Source], by: str, digest: str = ""
    ) -> MissionApproval:
        """Note that a person has approved a mission; returns how it stands then. `digest`: of the
        content that the person has looked at, if it is known.

        Raises:
            OperatorError: the fleet asks for none, this person may not approve it, or it has
                another content.
            JournalError: it cannot be written.
        """
        approval, before = await self._approval(file, mission, library, by)
        if digest and digest != approval.digest:
            raise OperatorError(
                f"{before.mission} is not approved: it was changed since {by} looked at it "
                f"(content {digest[:8]}; now {approval.digest[:8]})"
            )
        fleet = self._fleet
        if why := why_not_allowed(fleet, fleet.approval_role, by):
            raise OperatorError(f"{before.mission} is not approved: {why}")
        if approval.person in {person_of(each) for each in before.editors}:
            raise OperatorError(
                f"{before.mission} is not approved: {by} edited it, and what one has made others "
                "must approve"
            )
        await self._journal.approve(approval)
        after = await self.state(file, mission, library)
        left = "it may start" if after.may_start else f"{after.who()} must approve it"
        self._say(f"{by} has approved {after.mission} (content {after.digest[:8]}); {left}")
        return after

    async def withdraw(
        self, file: str, mission: bytes, library: Iterable[Source], by: str
    ) -> MissionApproval:
        """Note that a person's approval of a mission does not count any more; returns how the
        mission stands then. What runs goes on.

        Raises:
            OperatorError: this person has not approved it.
            JournalError: it cannot be written.
        """
        approval, before = await self._approval(file, mission, library, by)
        given = {person_of(each.by) for each in (*before.approvals, *before.not_counted)}
        if approval.person not in given:
            raise OperatorError(f"{by} has not approved this content of {before.mission}")
        await self._journal.withdraw_approval(approval)
        self._say(f"{by} has withdrawn the approval of {before.mission}")
        return await self.state(file, mission, library)

    async def _approval(
        self, file: str, mission: bytes, library: Iterable[Source], by: str
    ) -> tuple[Approval, MissionApproval]:
        fleet = self._fleet
        if not fleet.approval_persons:
            raise OperatorError(
                f"{fleet.file} asks for no approval: `approval: {{persons: 2}}` in it would"
            )
        if not person_of(by):
            raise OperatorError("an approval needs the name of who approves")
        content = self._content(mission, library)
        state = await self._state(file, content)
        approval = Approval(
            fleet.name, state.mission, state.digest, by, self._now_us(), dict(content.parts)
        )
        return approval, state

    async def note_edit(self, digest: str, by: str) -> None:
        """Note who has made a file what it is, by its hash, where the fleet asks for approvals.

        Raises:
            JournalError: it cannot be written.
        """
        if self._fleet.approval_persons:
            await self._journal.note_edit(Edit(digest, by, self._now_us()))
