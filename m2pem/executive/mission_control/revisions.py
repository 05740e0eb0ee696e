"""Operations on the versions of running missions."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from m2pem.api.authoring import MissionFiles, MissionSource
from m2pem.api.operations import mission_files
from m2pem.api.revision import RevisionPreview, RunVersion
from m2pem.api.runs import IncidentVerdict, RunId
from m2pem.engine.state import RunStatus
from m2pem.errors import OperatorError, StuckError
from m2pem.executive.ended_runs import refuse_ended
from m2pem.executive.mission_control.parts import ControlParts
from m2pem.executive.run_versions import files_of, versions_of
from m2pem.mission.mission import version_of


class RevisionOperations(ControlParts):
    """See `m2pem.api.mission_control.revisions.RevisionControl`."""

    async def versions(self, run: RunId) -> Sequence[RunVersion]:
        now: dict[str, list[RunId]] = {}
        for other in self._supervisor.runners.values():
            state = other.run.state
            if other.id != run and state.status is not RunStatus.ENDED:
                now.setdefault(version_of(state.mission), []).append(other.id)
        found = await self._had(run)
        return [replace(had, shared_with=tuple(now.get(had.version, ()))) for had, _ in found]

    async def version_files(self, run: RunId, version: str) -> MissionFiles:
        return files_of(await self._had(run), run, version)

    async def _had(self, run: RunId) -> list[tuple[RunVersion, MissionFiles]]:
        journal, runner = self._supervisor.journal, self._supervisor.runners.get(run)
        # The files of all runs are read only for one that this executive does not have.
        for line in await journal.runs(files=runner is None):
            if line.run != run:
                continue
            if line.gone:
                raise OperatorError(f"{run}: {line.loss}")
            begun_with = None if runner is None else mission_files(runner.run.begun_with)
            return await versions_of(journal, line, begun_with)
        raise OperatorError(f"the journal has no run {run}")

    async def plan_revision(
        self, run: RunId, mission: MissionSource, *, moves: Mapping[str, str] | None = None
    ) -> RevisionPreview:
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
