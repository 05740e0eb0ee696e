"""What a revision does to the work of a token on an activity: its behavior, prompt or service.

Work that the new version says in another way begins again, from the start of its task; but a
behavior of which only the speed changes goes on, if its arbiter can change that.
"""

from dataclasses import replace

from m2pem.engine.incidents import behavior_at
from m2pem.engine.revision.draft import PlanDraft
from m2pem.engine.revision.plan import Adjustment, EffectKind, called
from m2pem.engine.state import BehaviorPhase, RunState, Token
from m2pem.mission.behavior import Behavior
from m2pem.mission.difference import Plain, plain
from m2pem.mission.elements import Activity, FlowNode, ServiceTask, UserTask
from m2pem.mission.loops import MultiInstance, StandardLoop
from m2pem.mission.mission import Mission
from m2pem.mission.values import Value

_OF_INSTANCES = ("sequential", "cardinality", "collection", "item", "output_collection")
"""What cannot change while the instances of a multi-instance activity are under way."""


def same_instances(token: Token, old: Activity, new: Activity) -> str:
    """Return why the instances or rounds of an activity cannot go on as the new version says; "" if
    they can. Conditions, a maximum of rounds and what is thrown may change: they are read later."""
    begun = token.armed or _has_work(token)
    if not begun or (old.loop is None and new.loop is None):
        return ""
    if type(old.loop) is not type(new.loop):
        return f"{called(old)} has begun as {_name(old.loop)}, and is {_name(new.loop)} now"
    if isinstance(old.loop, MultiInstance):
        for name in _OF_INSTANCES:
            if plain(getattr(old.loop, name)) != plain(getattr(new.loop, name)):
                return f"{called(old)} has begun its instances, and their {name} changes"
    return ""


def _name(loop: StandardLoop | MultiInstance | None) -> str:
    if loop is None:
        return "a single activity"
    return "a loop" if isinstance(loop, StandardLoop) else "a multi-instance activity"


def _has_work(token: Token) -> bool:
    return bool(
        token.behavior
        or token.allocation
        or token.prompt
        or token.service
        or token.inner is not None
        or token.incident
    )


def has_begun(token: Token) -> bool:
    """Whether the activity that a token is on has begun, so that its events are armed already."""
    return token.armed or _has_work(token)


def plan_work(
    state: RunState, new: Mission, token: Token, again: FlowNode, draft: PlanDraft
) -> bool:
    """Plan for the work of a token that stays. Returns whether it begins again."""
    node = token.node
    if token.incident or not isinstance(node, Activity) or not isinstance(again, Activity):
        return False
    doing = _doing(state, token)
    if not doing:
        return False
    what = _what_differs(state, new, token, again)
    if not what:
        if _said(node, ("data_flow",)) != _said(again, ("data_flow",)):
            text = f"{doing} of {called(again)} goes on, with the data inputs that it has"
            draft.add(EffectKind.CHANGES, node.id, token.id, text)
        return False
    behavior = state.behaviors.get(token.behavior)
    if behavior is not None and behavior.phase is BehaviorPhase.UNSETTLED:
        text = f"answer prompt {token.prompt} first: it is not known what {doing} does"
        draft.refuse(node.id, f"{what} of {called(node)} changes: {text}", token.id)
        return False
    speed = "" if _geometry(state, new, token) else _speed(node, again)
    if speed and behavior is not None and behavior.id in draft.adjustable:
        text = f"the speed of {called(again)} becomes {speed}, and {doing} goes on"
        draft.add(EffectKind.ADJUSTS, node.id, token.id, text)
        draft.adjust(Adjustment(behavior.id, {_SPEED: speed}))
        return False
    text = f"{what} of {called(again)} changes: {doing} is cancelled and the task begins again"
    draft.add(EffectKind.RESTARTS, node.id, token.id, text)
    draft.restart(token)
    if not token.allocation:  # else the wait for resources ends with the request for them
        own = [wait for wait in (token.waits or {}).values() if wait.node is node]
        for wait in own:
            draft.disarm(wait)
    return True


_SPEED = "speed"


def _speed(node: Activity, again: Activity) -> str:
    """Return the speed in the new version, if that alone differs and both say it; else ""."""
    old, new = behavior_at(node), behavior_at(again)
    if old is None or new is None:
        return ""
    was = {each.name: each.value for each in old.parameters}
    now = {each.name: each.value for each in new.parameters}
    speed = now.get(_SPEED)
    if not isinstance(speed, str) or not isinstance(was.get(_SPEED), str):
        return ""
    return "" if _difference(_without_speed(old), _without_speed(new)) else speed


def _without_speed(behavior: Behavior) -> Behavior:
    others = tuple(each for each in behavior.parameters if each.name != _SPEED)
    return replace(behavior, parameters=others)


def _doing(state: RunState, token: Token) -> str:
    """Return what a token does on its task; "": nothing that could begin again."""
    if token.behavior:
        behavior = state.behaviors[token.behavior]
        return f"behavior {behavior.name} of {', '.join(behavior.resources)}"
    if token.allocation:
        return "the wait for resources"
    if token.service:
        return f"service {state.services[token.service].name}"
    if token.prompt and isinstance(token.node, UserTask):
        return f"prompt {token.prompt}"
    if behavior_at(token.node) is not None and _holds(token):
        return "the hold"
    return ""


def _holds(token: Token) -> bool:
    return any(wait.node is token.node for wait in (token.waits or {}).values())


def _said(node: Activity, names: tuple[str, ...]) -> Plain:
    return tuple(plain(getattr(node, name, None)) for name in names)


def _what_differs(state: RunState, new: Mission, token: Token, again: Activity) -> str:
    """Return what of the work is another one in the new version; "": nothing is."""
    node = token.node
    assert isinstance(node, Activity)
    old_behavior, new_behavior = behavior_at(node), behavior_at(again)
    if old_behavior is not None or new_behavior is not None:
        if old_behavior is None or new_behavior is None:
            return "the work"
        return _difference(old_behavior, new_behavior) or _geometry(state, new, token)
    if isinstance(node, UserTask) and isinstance(again, UserTask):
        return "" if plain(node.prompt) == plain(again.prompt) else "the prompt"
    if isinstance(node, ServiceTask) and isinstance(again, ServiceTask):
        return "" if plain(node.call) == plain(again.call) else "the service"
    return ""


def _difference(old: Behavior, new: Behavior) -> str:
    if (old.type, old.name) != (new.type, new.name):
        return "the behavior"
    if plain(old.roles) != plain(new.roles):
        return "who fills a role"
    was = {each.name: plain(each.value) for each in old.parameters}
    now = {each.name: plain(each.value) for each in new.parameters}
    names = [name for name in dict.fromkeys((*was, *now)) if was.get(name) != now.get(name)]
    return f"{'parameter' if len(names) == 1 else 'parameters'} {', '.join(names)}" if names else ""


def _geometry(state: RunState, new: Mission, token: Token) -> str:
    """Return which route, area or point of its file a behavior follows that is another one now.

    What operators have handed over under its name comes before it in both versions.
    """
    parameters: dict[str, Value] = {}
    if token.behavior:
        parameters = state.behaviors[token.behavior].parameters
    elif token.allocation:
        parameters = state.allocations[token.allocation].parameters
    for value in parameters.values():
        if not isinstance(value, str) or value in state.geometries:
            continue
        if state.mission.geometries.get(value) != new.geometries.get(value):
            return f"{value!r}"
    return ""
