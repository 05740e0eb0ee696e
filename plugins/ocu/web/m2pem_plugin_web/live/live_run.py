"""The view of a run, with its elements and newest records as JSON for browsers."""

from typing import Any

import msgspec

from m2pem.api import RequirementState, RunView
from m2pem.api import records as r
from m2pem.api.run_view import NEWEST, Behavior, Changes, Place
from m2pem_plugin_web.live.messages import record_of

_encode = msgspec.json.Encoder().encode


class LiveRun:
    """Notes changes only while a browser watches, so that memory is bounded."""

    def __init__(self, view: RunView) -> None:
        self.view = view
        self._encoded: dict[Place, msgspec.Raw] = {}
        self._records: dict[int, msgspec.Raw] = {}

    def begin_changes(self) -> None:
        """Start to note changes."""
        if self.view.changes is None:
            self.view.changes = Changes()
            self._encoded.clear()

    def clear_changes(self) -> None:
        """Drop the changes: all viewers have received them."""
        if self.view.changes is not None:
            for place in self.view.changes.elements:
                self._encoded.pop(place, None)
            self.view.changes.clear()

    def end_changes(self) -> None:
        """Stop noting changes: no browser watches."""
        self.view.changes = None

    def encoded(self, place: Place) -> msgspec.Raw:
        """Return the state of an element as JSON, encoded once for all browsers."""
        known = self._encoded.get(place)
        if known is None:
            known = self._encoded[place] = msgspec.Raw(_encode(self.view.elements[place]))
        return known

    def newest_after(self, seq: int) -> list[msgspec.Raw]:
        """Return the newest records after one, as JSON, encoded once for all browsers."""
        kept, newest = self._records, self.view.newest
        for stamped in newest:
            if stamped.seq > seq and stamped.seq not in kept:
                kept[stamped.seq] = msgspec.Raw(record_of(stamped, self.view))
        found = [kept[each.seq] for each in newest if each.seq > seq]
        if len(kept) > 2 * NEWEST:
            self._records = {each.seq: kept[each.seq] for each in newest if each.seq in kept}
        return found


def command(behavior: Behavior) -> dict[str, Any]:
    """Return a behavior that has not ended, for JSON."""
    return {
        "name": behavior.name,
        "resources": behavior.resources,
        "process": behavior.process,
        "element": behavior.element,
        "since": behavior.since_s,
    }


def requirement(state: RequirementState) -> dict[str, Any]:
    """Return a requirement that the run is monitored for, for JSON."""
    return {
        "english": state.english,
        "formula": state.formula,
        "elements": state.elements,
        "on_violation": state.on_violation,
        "verdict": state.verdict,
        "since": state.since_s,
        "recorded": state.recorded_s,
        "because": state.reason,
    }


def debugging(view: RunView) -> dict[str, Any] | None:
    """Return where the run is paused to look at it, for JSON; None: nowhere."""
    if view.breakpoints is None and view.reached is None and not view.stepping:
        return None
    there = view.breakpoints or r.BreakpointsSet()
    return {
        "elements": there.elements,
        "conditions": there.conditions,
        "stepping": view.stepping,
        "reached": _stop(view, view.reached) if view.reached is not None else None,
    }


def _stop(view: RunView, reached: r.BreakpointReached) -> dict[str, Any]:
    """A stop. `within`: the subprocesses and calls around what is next, from the outside in."""
    token = view.tokens.get(reached.token)
    node = view.mission.elements.get(reached.element) if view.mission is not None else None
    behavior = getattr(node, "behavior", None)  # of the kinds of tasks that command
    return {
        "reason": reached.reason,
        "condition": reached.condition,
        "process": reached.process,
        "element": reached.element,
        "token": reached.token,
        "scope": reached.scope,
        "instance": token.instance if token is not None else None,
        "within": _around(view, reached.scope),
        "resources": [each.resource for each in behavior.roles if each.resource]
        if behavior is not None
        else [],
    }


def _around(view: RunView, number: int) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = []
    scope = view.scopes.get(number)
    while scope is not None and scope.token is not None and scope.parent is not None:
        owner = view.tokens.get(scope.token)
        # A token that waits around the instances of its activity is none of them.
        if owner is not None and not owner.is_around:
            place = {"process": owner.process, "element": owner.element}
            found.insert(0, {**place, "instance": owner.instance})
        scope = view.scopes.get(scope.parent)
    return found
