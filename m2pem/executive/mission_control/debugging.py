"""Operations on a run that is debugged: breakpoints, single steps, data that is changed."""

from collections.abc import Mapping, Sequence

from m2pem.api.runs import ExpressionValue, RunId, ScopeData
from m2pem.engine import inputs as i
from m2pem.engine.breakpoints import ROOT
from m2pem.engine.data import reader
from m2pem.engine.state import RunState
from m2pem.engine.state import RunStatus as EngineStatus
from m2pem.errors import ExpressionError, ExpressionSyntaxError, OperatorError
from m2pem.executive.ended_runs import refuse_ended
from m2pem.executive.mission_control.parts import ControlParts, bounded
from m2pem.mission.elements import Process
from m2pem.mission.expression import parse
from m2pem.mission.expression.temporal import NOW
from m2pem.mission.timers import date_text
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
        if elements or conditions:
            self._refuse_debugging()
        wanted = i.SetBreakpoints(tuple(elements), tuple(conditions), by)
        await self._ask("set_breakpoints", run, wanted)

    async def step(self, run: RunId, *, by: str = "") -> None:
        self._refuse_debugging()
        async with self._explain_end("step", run):
            state = self._supervisor.runner(run).run.state
            if state.status is EngineStatus.RUNNING:
                raise OperatorError(f"{run}: {_why_no_step(state)}")
        await self._ask("step", run, i.StepRun(by))

    async def set_data(
        self, run: RunId, data: Mapping[str, Value], *, scope: int = 0, by: str = ""
    ) -> None:
        self._refuse_debugging()
        await self._ask("set_data", run, i.SetData(bounded(data), scope, by))

    async def data(self, run: RunId) -> Sequence[ScopeData]:
        async with self._explain_end("data", run):
            runner = self._supervisor.runner(run)
            refuse_ended(runner)
            return data_of(runner.run.state)

    async def evaluate(self, run: RunId, expression: str, *, token: int = 0) -> ExpressionValue:
        async with self._explain_end("evaluate", run):
            runner = self._supervisor.runner(run)
            refuse_ended(runner)
            now_us = self._supervisor.clock.now_us()
            return evaluate_at(runner.run.state, expression, now_us, token)

    def _refuse_debugging(self) -> None:
        fleet = self._supervisor.fleet
        if not fleet.may_be_debugged:
            raise OperatorError(
                f"fleet {fleet.name} has vehicles that are not simulated, and its file does not "
                "say 'debugging: true': rehearse the mission with `m2pem debug`"
            )


def data_of(state: RunState) -> list[ScopeData]:
    """The data of a run from the outside in: what is not empty, and that of each process."""
    found: list[ScopeData] = []
    if state.shared.data:
        found.append(ScopeData("", "", dict(state.shared.data), ROOT))
    inside = {scope.owner.id: scope.id for scope in state.scopes.values() if scope.owner}
    for scope in sorted(state.scopes.values(), key=lambda each: (each.depth, each.id)):
        container = scope.container
        instance = scope.owner.instance if scope.owner is not None else None
        if scope.data or (scope.loop is None and isinstance(container, Process)):
            data = dict(scope.data)
            place = container.process.id, container.id
            found.append(ScopeData(*place, data, scope.id, instance))
        for token in scope.tokens.values():
            if token.own:
                place = container.process.id, token.node.id
                # What is seen in a subprocess is changed as it is seen there.
                at = inside.get(token.id)
                found.append(ScopeData(*place, dict(token.own), at, token.instance, token.id))
    return found


def evaluate_at(state: RunState, text: str, now_us: int, token: int = 0) -> ExpressionValue:
    """See `DebugControl.evaluate`; `now_us`: what the expression reads as the present time.

    Raises:
        OperatorError: it cannot be read or evaluated, or there is no such token.
    """
    tokens = (each.tokens.get(token) for each in state.scopes.values())
    place = next(filter(None, tokens), None) if token else state.scopes.get(ROOT)
    if place is None:
        raise OperatorError(f"{state.run}: token {token} is not there")
    seen = reader(place)

    def read(name: str) -> Value:
        return date_text(now_us) if name == NOW else seen(name)

    try:
        expression = parse(text)
        value = expression.evaluate(read)
    except (ExpressionError, ExpressionSyntaxError) as error:
        raise OperatorError(str(error)) from None
    return ExpressionValue(
        value, expression.kind(read), expression.why_null(read) if value is None else ""
    )


def _why_no_step(state: RunState) -> str:
    """Why a run that goes on makes no step, and what an operator can do."""
    if not state.stepping:
        return (
            "it is not paused: pause it, or set a breakpoint, and make a step when it has stopped"
        )
    awaited = ", ".join(state.awaited())
    waits = f"; its tokens wait for {awaited}" if awaited else ""
    return (
        f"it makes a step already{waits}. It is paused again as soon as a token moves; "
        "pause it to end the step before that"
    )
