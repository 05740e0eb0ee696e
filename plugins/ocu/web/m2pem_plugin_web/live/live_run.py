"""The view of a run, with its elements and newest records as JSON for browsers."""

from typing import Any

import msgspec

from m2pem.api import RequirementState, RunView
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
