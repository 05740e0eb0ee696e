"""Breakpoints: where a run is paused so that its author can look at it, and change its data.

The run is paused as soon as a token is on an element with a breakpoint: the element's events are
armed, so that nothing which is thrown now is missed, and it has done nothing else. A condition
pauses the run when it becomes true, in the step that made it true. `StepRun` lets one token be
executed: the run is paused before the next one.
"""

from collections import deque

from m2pem.engine import records as r
from m2pem.engine.data import reader
from m2pem.engine.execution import Execution
from m2pem.engine.inputs import SetBreakpoints, SetData
from m2pem.engine.records import StopReason
from m2pem.engine.state import Scope, Token
from m2pem.errors import ExpressionError, ExpressionSyntaxError
from m2pem.mission.expression import parse
from m2pem.mission.mission import Mission
from m2pem.suggestions import suggest

ROOT = 1
"""The scope of the process that a run begins with."""


class Pausing:
    """Whether the run is paused before the next step; made for each input of a debugged run."""

    def __init__(self, x: Execution) -> None:
        self._x = x
        self.steps = 0
        """Steps that are executed before the run is paused, if it is stepping."""
        there = x.state.breakpoints
        self._true = {
            condition: _holds(x, condition)
            for condition in (there.conditions if there is not None else ())
        }

    def pauses_before(self, queue: "deque[Token | Scope]") -> bool:
        """Pause the run if a token is at a breakpoint, a condition has become true, or `queue`
        begins with a token that is beyond the step."""
        if self.pauses(queue):
            return True
        token = _next_token(self._x, queue)
        if self._x.state.stepping and token is not None:
            if self.steps <= 0:
                self._pause(token, StopReason.STEP)
                return True
            self.steps -= 1
        return False

    def pauses(self, queue: "deque[Token | Scope]") -> bool:
        """The same without regard to steps: a batch may end before its next step is executed."""
        x = self._x
        for token in x.at_breakpoints:
            if x.is_active(token):
                x.at_breakpoints.clear()
                self._pause(token, StopReason.BREAKPOINT)
                return True
        x.at_breakpoints.clear()
        became = [name for name, before in self._true.items() if _holds(x, name) and not before]
        for name in self._true:
            self._true[name] = _holds(x, name)
        if became:
            tokens = (each for each in queue if type(each) is Token and x.is_active(each))
            self._pause(next(tokens, None), StopReason.CONDITION, became[0])
            return True
        return False

    def _pause(self, token: Token | None, reason: StopReason, condition: str = "") -> None:
        x = self._x
        place = (
            (token.id, x.process_of(token.node), token.node.id, token.scope.id)
            if token is not None
            else (0, "", "", 0)
        )
        x.emit(r.BreakpointReached(reason, *place, condition))
        x.emit(r.RunPaused(x.now_us))


def _next_token(x: Execution, queue: "deque[Token | Scope]") -> Token | None:
    """The token that is executed next; None: a scope is looked at before, or nothing is there."""
    for item in queue:
        if type(item) is not Token:
            return None
        if x.is_active(item):
            return item
    return None


def _holds(x: Execution, condition: str) -> bool:
    """Whether a condition holds in a process or subprocess that is active. Where it cannot be
    evaluated it does not: what it reads may come later."""
    parsed = parse(condition)
    for scope in x.state.scopes.values():
        try:
            if parsed.holds(reader(scope)):
                return True
        except ExpressionError:
            continue
    return False


def why_refused(mission: Mission, item: SetBreakpoints) -> str:
    """Return why breakpoints cannot be set, and what would be right; "" if they can."""
    known = {node.id for node in mission.nodes}
    for element in item.elements:
        if element not in known:
            hint = suggest(element, sorted(known), "elements")
            return f"a breakpoint is at an element; the mission has no {element!r}: {hint}"
    for condition in item.conditions:
        try:
            parse(condition)
        except ExpressionSyntaxError as error:
            return f"{condition!r} is no condition: {error}"
    return ""


def set_breakpoints(x: Execution, item: SetBreakpoints) -> None:
    """Set breakpoints in place of those that are set."""
    if refusal := why_refused(x.mission, item):
        x.ignore(refusal)
    else:
        x.emit(r.BreakpointsSet(item.elements, item.conditions, x.state.stepping, item.by))


def set_data(x: Execution, item: SetData) -> None:
    """Write what an operator gives."""
    number = item.scope or ROOT
    scope = x.state.scopes.get(number)
    if scope is None:
        x.ignore(f"scope {number} is not open")
        return
    container = scope.container
    x.emit(r.OperatorSetData(container.process.id, container.id, scope.id, item.by))
    x.write_at(scope, container.process.id, container.id, item.data)
