"""Operations on a run that is debugged: breakpoints, single steps, data that is changed."""

from collections.abc import Mapping, Sequence

from m2pem.api.runs import RunId
from m2pem.engine import inputs as i
from m2pem.errors import OperatorError
from m2pem.executive.mission_control.parts import ControlParts, bounded
from m2pem.mission.values import Value


class DebugOperations(ControlParts):
    """See `m2pem.api.mission_control.debugging.DebugControl`."""

    async def set_breakpoints(
        self,
        run: RunId,
        elements: Sequence[str] = (),
        conditions: Sequence[str] = (),
        *,
        by: str = "",
    ) -> None:
        """Set breakpoints in place of those before; they can be deleted on any fleet."""
        if elements or conditions:
            self._refuse_debugging()
        wanted = i.SetBreakpoints(tuple(elements), tuple(conditions), by)
        await self._ask("set_breakpoints", run, wanted)

    async def step(self, run: RunId, *, by: str = "") -> None:
        """Execute one token of a paused run."""
        self._refuse_debugging()
        await self._ask("step", run, i.StepRun(by))

    async def set_data(
        self, run: RunId, data: Mapping[str, Value], *, scope: int = 0, by: str = ""
    ) -> None:
        """Change data of a paused run."""
        self._refuse_debugging()
        await self._ask("set_data", run, i.SetData(bounded(data), scope, by))

    def _refuse_debugging(self) -> None:
        fleet = self._supervisor.fleet
        if not (fleet.simulated or fleet.debugging):
            raise OperatorError(
                f"fleet {fleet.name} has vehicles that are not simulated, and its file does not "
                "say 'debugging: true': rehearse the mission with `m2pem debug`"
            )
