"""A run as it is sent to browsers: its view, and its elements as JSON."""

from typing import Any

import msgspec

from m2pem.api import RunView
from m2pem.api.run_view import Behavior, Changes, Place

_encode = msgspec.json.Encoder().encode


class LiveRun:
    """What changes is noted only while a browser watches, so that nothing grows unwatched."""

    def __init__(self, view: RunView) -> None:
        self.view = view
        self._encoded: dict[Place, msgspec.Raw] = {}

    def begin_changes(self) -> None:
        """Note what changes from now on, if that is not noted already."""
        if self.view.changes is None:
            self.view.changes = Changes()
            self._encoded.clear()

    def clear_changes(self) -> None:
        """Forget the changes, which all who watch know."""
        if self.view.changes is not None:
            for place in self.view.changes.elements:
                self._encoded.pop(place, None)
            self.view.changes.clear()

    def end_changes(self) -> None:
        """Note no changes any more: no browser watches."""
        self.view.changes = None

    def encoded(self, place: Place) -> msgspec.Raw:
        """Return the state of an element as JSON, encoded once for all browsers."""
        known = self._encoded.get(place)
        if known is None:
            known = self._encoded[place] = msgspec.Raw(_encode(self.view.elements[place]))
        return known


def command(behavior: Behavior) -> dict[str, Any]:
    """Return a behavior that has not ended, for JSON."""
    return {
        "name": behavior.name,
        "resources": behavior.resources,
        "process": behavior.process,
        "element": behavior.element,
        "since": behavior.since_s,
    }
