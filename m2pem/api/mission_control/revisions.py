"""Operations on the versions of running missions."""

from collections.abc import Mapping, Sequence
from typing import Protocol

from m2pem.api.authoring import MissionFiles, MissionSource
from m2pem.api.revision import RevisionPreview, RunVersion
from m2pem.api.runs import RunId


class RevisionControl(Protocol):
    """The operations of `MissionControl` on the versions of running missions."""

    async def versions(self, run: RunId) -> Sequence[RunVersion]:
        """Return each version of its mission that a run has had, the present one last; also of a
        run that has ended.

        Raises:
            OperatorError: the journal has no such run.
        """

    async def version_files(self, run: RunId, version: str) -> MissionFiles:
        """Return the files of a version that a run has had: to look at, or to revise it back.

        Raises:
            OperatorError: the journal has no such run, or it has not had that version.
        """

    async def plan_revision(
        self, run: RunId, mission: MissionSource, *, moves: Mapping[str, str] | None = None
    ) -> RevisionPreview:
        """What it would do to a run to go on with a new version of its mission; nothing is done.

        `moves`: where the token on an element goes first, by the ids of elements or, at a join, of
        sequence flows; "": it ends there. What follows is explored in a process of its own.

        Raises:
            MissionError: with every finding, when the new version cannot be read.
            OperatorError: the run has ended, or is one behavior that was commanded.
        """

    async def revise(
        self,
        run: RunId,
        mission: MissionSource,
        plan: str,
        *,
        moves: Mapping[str, str] | None = None,
        by: str = "",
        even_if_stuck: bool = False,
    ) -> None:
        """Go on with a new version of a run's mission.

        `plan`: that of a `RevisionPreview` which an operator has seen; `moves` as for it.
        `even_if_stuck`: an operator has confirmed that the mission cannot complete after it.

        Raises:
            MissionError: with every finding, when the new version is not well or does not fit the
                fleet.
            NotApprovedError: the fleet asks for approvals, and persons must give them before.
            StuckError: the mission cannot complete after it, and that was not confirmed.
            OperatorError: it is refused, or the run has gone on so that the plan is another one.
        """
