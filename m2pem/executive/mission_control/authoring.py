"""Operations on missions that are written: check, verify, rehearse, estimate and approve them."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from m2pem.api.approval import MissionApproval
from m2pem.api.authoring import (
    Draft,
    Editable,
    MissionSource,
    Outline,
)
from m2pem.api.estimates import MissionEstimate
from m2pem.api.runs import SimulationResult
from m2pem.editing.editable import editable
from m2pem.editing.outline import outline
from m2pem.errors import MissionError, OperatorError
from m2pem.executive.loading import library_of, load_source
from m2pem.executive.mission_control.parts import ControlParts
from m2pem.executive.verification_worker import verify_in_subprocess
from m2pem.findings import Finding


class AuthoringOperations(ControlParts):
    """See `m2pem.api.mission_control.authoring.AuthoringControl`."""

    def check(
        self, mission: MissionSource, *, process: str | None = None, data: Iterable[str] = ()
    ) -> Sequence[Finding]:
        try:
            loaded = load_source(mission, self._supervisor.settings.search_path)
        except MissionError as error:
            return error.findings
        return self._starter.findings(loaded, process, tuple(data))

    def estimate(self, mission: MissionSource, *, process: str | None = None) -> MissionEstimate:
        if self._estimate is None:
            raise OperatorError("this executive cannot estimate missions")
        loaded = load_source(mission, self._supervisor.settings.search_path)
        return self._estimate(loaded, self._supervisor.fleet_now, process)

    async def simulate(self, mission: MissionSource, **options: Any) -> SimulationResult:
        supervisor = self._supervisor
        if self._rehearse is None:
            raise OperatorError("this executive cannot rehearse missions")
        settings = {"search_path": supervisor.settings.search_path, **options}
        return await self._rehearse(mission, supervisor.fleet_now, **settings)

    async def verify(self, mission: MissionSource, **options: Any) -> Mapping[str, Any]:
        supervisor = self._supervisor
        settings = {"search_path": supervisor.settings.search_path, **options}
        return await verify_in_subprocess(mission, supervisor.fleet_now, **settings)

    def editable(self, mission: bytes, *, anew: bool = False) -> Editable:
        return editable(mission, anew=anew)

    def outline(self, mission: bytes | Draft) -> Outline:
        draft = mission if isinstance(mission, Draft) else Draft(Path("mission.bpmn"), mission)
        library = library_of(mission, self._supervisor.settings.search_path)
        return outline(draft.source, library, self.services())

    def services(self) -> Mapping[str, Sequence[str]]:
        return self._supervisor.plugins.service_writes()

    async def approval(self, mission: MissionSource) -> MissionApproval:
        loaded = await self._starter.read(mission)
        return await self._starter.approvals.state(loaded.file, loaded.source, loaded.library)

    async def approve(
        self, mission: MissionSource, *, digest: str = "", by: str = ""
    ) -> MissionApproval:
        loaded = await self._starter.read(mission)
        approvals = self._starter.approvals
        return await approvals.approve(loaded.file, loaded.source, loaded.library, by, digest)

    async def withdraw_approval(self, mission: MissionSource, *, by: str = "") -> MissionApproval:
        loaded = await self._starter.read(mission)
        approvals = self._starter.approvals
        return await approvals.withdraw(loaded.file, loaded.source, loaded.library, by)

    async def note_edit(self, digest: str, *, by: str = "") -> None:
        await self._starter.approvals.note_edit(digest, by)
