"""The behaviors of an m2pem node and their statuses. It needs neither ROS nor a clock."""

from collections.abc import Callable, Mapping
from dataclasses import replace

from m2pem.api import BehaviorState, EpochFence, Value
from m2pem_plugin_ros.interfaces.behavior_status import Status

REMEMBERED = 10_000


class BehaviorJournal:
    """Runs one behavior at a time, and publishes each change of a status once, with a number that
    rises.

    Ids are kept until 10,000 later behaviors have ended. `epochs`: of the runs, seen so far.
    """

    def __init__(self, publish: Callable[[Status], None], epochs: EpochFence | None = None) -> None:
        self._publish_status = publish
        self._last: dict[str, Status] = {}
        self.epochs = EpochFence() if epochs is None else epochs
        self.current = ""
        """The id of the current behavior, or ""."""

    def last(self, id_: str) -> Status:
        """Return the last status; UNKNOWN with number 0 if there is none."""
        reason = "this vehicle does not have the behavior"
        return self._last.get(id_) or Status(id_, 0, BehaviorState.UNKNOWN, reason=reason)

    def knows(self, id_: str) -> bool:
        """Whether the behavior was accepted or rejected before."""
        return id_ in self._last

    def repeat(self, id_: str) -> None:
        """Publish the last status again."""
        self._publish_status(self.last(id_))

    def reject(self, id_: str, code: str, reason: str) -> None:
        """Reject a behavior. The current one goes on."""
        self._note(Status(id_, 1, BehaviorState.REJECTED, code, reason))

    def accept(self, id_: str) -> None:
        """Accept a behavior. It replaces the current one, which is cancelled."""
        before, self.current = self.current, id_
        if before:
            number = self._last[before].number + 1
            reason = f"{id_} has replaced it"
            self._note(Status(before, number, BehaviorState.CANCELLED, reason=reason))
        self._note(Status(id_, 1, BehaviorState.ACCEPTED))

    def progress(self, id_: str) -> None:
        """Publish RUNNING once."""
        if id_ == self.current and self._last[id_].state is BehaviorState.ACCEPTED:
            self._note(Status(id_, 2, BehaviorState.RUNNING))

    def remains(self, id_: str, remaining: Mapping[str, Value]) -> None:
        """Publish what is left of the current behavior, where that has changed."""
        last = self._last.get(id_)
        if last is None or id_ != self.current or last.state is not BehaviorState.RUNNING:
            return
        if last.remaining != remaining:
            self._note(replace(last, number=last.number + 1, remaining=dict(remaining)))

    def end(
        self,
        id_: str,
        state: BehaviorState,
        code: str = "",
        reason: str = "",
        outputs: Mapping[str, Value] | None = None,
    ) -> None:
        """End the current behavior. An id that is not current is ignored."""
        if id_ and id_ == self.current:
            self.current = ""
            number = self._last[id_].number + 1
            self._note(Status(id_, number, state, code, reason, outputs=outputs or {}))

    def _note(self, status: Status) -> None:
        self._last.pop(status.id, None)
        self._last[status.id] = status
        if len(self._last) > REMEMBERED:
            del self._last[next(id_ for id_ in self._last if id_ != self.current)]
        self._publish_status(status)
