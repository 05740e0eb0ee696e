"""Operations on the versions of running missions."""

from collections.abc import Mapping

from m2pem.api.authoring import MissionSource
from m2pem.api.revision import RevisionPreview
from m2pem.api.runs import IncidentVerdict, RunId
from m2pem.errors import StuckError
from m2pem.executive.ended_runs import refuse_ended
from m2pem.executive.mission_control.parts import ControlParts


class RevisionOperations(ControlParts):
    """See `m2pem.api.mission_control.revisions.RevisionControl`."""

    async def plan_revision(
        self, run: RunId, mission: MissionSource, *, moves: Mapping[str, str] | None = None
    ) -> RevisionPreview:
        """What it would do to a run to go on with a new version of its mission."""
        async with self._explain_end("plan_revision", run):
            refuse_ended(self._supervisor.runner(run))
            prepared = await self._revisions.prepare(run, mission, moves or {}, "")
            return await self._revisions.preview(run, prepared)

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
        """Go on with a new version of a run's mission."""
        async with self._explain_end("revise", run):
            refuse_ended(self._supervisor.runner(run))
            prepared = await self._revisions.prepare(run, mission, moves or {}, by)
            await self._revisions.refuse(run, prepared, plan)
        if not even_if_stuck:
            outlook = await self._revisions.outlook(run, prepared)
            if outlook.verdict is IncidentVerdict.CANNOT_COMPLETE:
                raise StuckError(f"{run} is not revised: {outlook}")
        await self._ask("revise", run, prepared.item)
        self._revisions.hand_over(run, prepared)
