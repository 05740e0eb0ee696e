"""Carrying a revision out: the records of an input `Revise`.

First the work ends that the new version does not have, and the tokens leave that are to be moved;
then `MissionRevised` binds the state to the new version; then tokens enter elements of it, events
are armed and tasks begin again.
"""

from collections.abc import Iterable

from m2pem.engine import records as r
from m2pem.engine.apply.tokens import is_join
from m2pem.engine.arming import arm_events
from m2pem.engine.elements.activities import activate_later
from m2pem.engine.execution import Execution
from m2pem.engine.inputs import Revise
from m2pem.engine.records import TokenOutcome
from m2pem.engine.requirements import monitor
from m2pem.engine.revision.plan import Arming, Move, RevisionPlan
from m2pem.engine.revision.planning import plan_revision
from m2pem.engine.scopes import stop_activity
from m2pem.engine.state import Scope, Token, TokenOrScope
from m2pem.engine.steps import Steps
from m2pem.engine.triggering import deliver_kept_messages
from m2pem.mission.elements import (
    ComplexGateway,
    FlowNode,
    InclusiveGateway,
    ParallelGateway,
    SequenceFlow,
)


def revise(x: Steps, item: Revise) -> None:
    """Revise the run if the plan that was shown is what the revision does now."""
    new = x.state.new_mission
    if new is None:
        x.ignore("the new version of the mission cannot be read")
        return
    plan = plan_revision(x.state, new, item.moves, x.now_us, item.adjustable)
    if plan.version != item.version:
        x.ignore(f"the files are not those of version {item.version}")
    elif plan.refusals:
        x.ignore(f"the revision is refused: {'; '.join(each.text for each in plan.refusals)}")
    elif plan.digest != item.plan:
        x.ignore("the run has gone on since the plan was made: look at the new plan")
    else:
        _carry_out(x, plan, item)


def _carry_out(x: Steps, plan: RevisionPlan, item: Revise) -> None:
    state = x.state
    x.reload_queue()  # what was left over before a pause goes on after it, as the rest
    for move in plan.moves:
        token = state.tokens[move.token]
        stop_activity(x, token, TokenOutcome.TERMINATED)
        x.leave(token, TokenOutcome.TERMINATED)
    for number in plan.restarted:
        stop_activity(x, state.tokens[number], TokenOutcome.TERMINATED)
    x.emit(
        r.MissionRevised(
            plan.version, plan.previous, item.by, plan.requested, plan.disarmed, plan.restarted
        )
    )
    x.read_mission()
    monitor(x, item)
    for move in plan.moves:
        _enter(x, move)
    for adjustment in plan.adjustments:
        x.emit(r.BehaviorAdjusted(adjustment.behavior, adjustment.parameters))
    restarted = [state.tokens[number] for number in plan.restarted]
    _arm(x, plan.armings)
    deliver_kept_messages(x)
    for token in restarted:
        if x.is_active(token):
            activate_later(x, token)
    x.queue.extend(state.scopes[each] for each in plan.rechecked if each in state.scopes)
    for scope in state.scopes.values():
        _look_at_joins(x, scope)
    x.joins_to_check.update(state.scopes)
    x.data_changed = True


def _enter(x: Execution, move: Move) -> None:
    """Put a token that has left its element where it is to go."""
    scope = x.state.scopes[move.scope]
    if not move.target:
        x.queue.append(scope)
        return
    element = x.mission.elements[move.target]
    if isinstance(element, SequenceFlow):
        process = x.process_of(element.source)
        x.emit(r.FlowTaken(move.token, process, element.source.id, scope.id, element.id))
        x.enter(move.token, element.target, scope, element)
    else:
        assert isinstance(element, FlowNode)
        x.enter(move.token, element, scope)


def _arm(x: Execution, armings: Iterable[Arming]) -> None:
    """Arm events as by tokens and scopes that come there: a scope's before those of its tokens."""
    events: dict[TokenOrScope, list[Arming]] = {}
    for each in sorted(armings, key=lambda each: (each.scope, each.token != 0)):
        holder = x.state.tokens[each.token] if each.token else x.state.scopes[each.scope]
        events.setdefault(holder, []).append(each)
    for holder, those in events.items():
        # An error in one of them moves a token on, or stops it until a retry arms all of them; one
        # that is stopped already stays.
        stopped = isinstance(holder, Token) and bool(holder.incident)
        there = x.state.tokens if isinstance(holder, Token) else x.state.scopes
        for each in those:
            gone = there.get(holder.id) is not holder
            node = x.mission.elements[each.element]
            assert isinstance(node, FlowNode)
            if gone or not (arm_events(x, holder, [node], since_us=each.since_us) or stopped):
                break


def _look_at_joins(x: Execution, scope: Scope) -> None:
    """Let tokens at joins go on that need to wait for fewer now, and those where nothing joins."""
    for node, join in scope.joins.items():
        if isinstance(node, ParallelGateway | ComplexGateway):
            x.queue.extend(next(reversed(join.by_flow.values()))[:1])
    for token in scope.tokens.values():
        if isinstance(token.node, _GATEWAYS) and not is_join(token.node):
            x.queue.append(token)


_GATEWAYS = (ComplexGateway, InclusiveGateway, ParallelGateway)
