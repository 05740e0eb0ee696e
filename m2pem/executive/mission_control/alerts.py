"""Operations on alerts and incidents."""

from collections.abc import Mapping, Sequence

from m2pem.api.alerts import OperatorAlert
from m2pem.api.runs import IncidentPreview, IncidentVerdict, OpenIncident, RunId
from m2pem.engine import inputs as i
from m2pem.errors import StuckError
from m2pem.executive.ended_runs import refuse_ended
from m2pem.executive.incidents import open_incidents
from m2pem.executive.mission_control.parts import ControlParts, bounded
from m2pem.mission.values import Value


class AlertOperations(ControlParts):
    """See `m2pem.api.mission_control.alerts.AlertControl`."""

    async def incidents(self) -> Sequence[OpenIncident]:
        return open_incidents(self._supervisor.runners.values(), self._supervisor.fleet)

    async def preview_incident(
        self,
        run: RunId,
        incident: str,
        choice: str,
        *,
        data: Mapping[str, Value] | None = None,
        to: str = "",
        roles: Mapping[str, Sequence[str]] | None = None,
    ) -> IncidentPreview:
        async with self._explain_end("preview_incident", run):
            refuse_ended(self._supervisor.runner(run))
            item = self._choices.checked(run, incident, choice, bounded(data), to, roles or {})
        return await self._choices.outlook(run, item)

    async def resolve_incident(
        self,
        run: RunId,
        incident: str,
        choice: str,
        *,
        data: Mapping[str, Value] | None = None,
        to: str = "",
        roles: Mapping[str, Sequence[str]] | None = None,
        by: str = "",
        even_if_stuck: bool = False,
    ) -> None:
        async with self._explain_end("resolve_incident", run):
            refuse_ended(self._supervisor.runner(run))
            item = self._choices.checked(run, incident, choice, bounded(data), to, roles or {}, by)
            known = self._supervisor.runner(run).run.state.incidents[item.incident]
            self._refuse_others(item.incident, known.operator_role, by)
        ends_or_stays = item.choice in (i.IncidentChoice.END, i.IncidentChoice.SET_DATA)
        if not (even_if_stuck or ends_or_stays):
            preview = await self._choices.outlook(run, item)
            if preview.verdict is IncidentVerdict.CANNOT_COMPLETE:
                raise StuckError(f"{run}: {choice} was not done: {preview}")
        await self._ask("resolve_incident", run, item)

    async def alerts(self, *, over: bool = False) -> Sequence[OperatorAlert]:
        return self._alerts.alerts(over=over)

    async def acknowledge_alert(self, alert: str, *, by: str = "") -> None:
        await self._alerts.acknowledge(alert, by)

    async def own_alert(self, alert: str, *, owner: str | None = None, by: str = "") -> None:
        await self._alerts.own(alert, by if owner is None else owner)
