"""Operations on a run that is debugged: breakpoints, single steps, data that is changed."""

from collections.abc import Mapping, Sequence
from typing import Protocol

from m2pem.api.runs import ExpressionValue, RunId, ScopeData
from m2pem.mission.values import Value


class DebugControl(Protocol):
    """The operations of `MissionControl` on a run that is debugged (docs/debugging.md).

    All but `data` and `evaluate` raise OperatorError where the fleet does not allow it
    (`Fleet.may_be_debugged`): it does where all of it is simulated, or the fleet file says
    `debugging: true`.
    """

    async def set_breakpoints(
        self,
        run: RunId,
        elements: Sequence[str] = (),
        conditions: Sequence[str] = (),
        *,
        by: str = "",
    ) -> None:
        """Pause a run from now on where a token has come to one of `elements`, before the element
        does anything, and when one of `conditions` has become true; in place of the breakpoints
        before. A pause holds its vehicles.

        Raises:
            OperatorError: the mission has no such element, or a condition cannot be read.
        """

    async def step(self, run: RunId, *, by: str = "") -> None:
        """Let a paused run execute one token: it is paused again before the next."""

    async def set_data(
        self, run: RunId, data: Mapping[str, Value], *, scope: int = 0, by: str = ""
    ) -> None:
        """Change data of a paused run, where a scope sees it; 0: the process that it began with."""

    async def data(self, run: RunId) -> Sequence[ScopeData]:
        """The data of a run that goes on: of its data stores, then of each active process,
        and of each active subprocess and task that has some, from the outside in."""

    async def evaluate(self, run: RunId, expression: str, *, token: int = 0) -> ExpressionValue:
        """The value of an expression over the data of a run that goes on, as the element sees it
        that a token is on; 0: the process that it began with. It changes nothing.

        Raises:
            OperatorError: it cannot be read or evaluated, or there is no such token.
        """
