"""Which behaviors a vehicle was given, and what was said of them; needs neither ROS nor a clock."""

from collections.abc import Callable, Mapping

from m2pem.api import BehaviorState, Value
from m2pem_plugin_ros.interfaces.behavior_status import Status

REMEMBERED = 10_000


class Book:
    """One behavior goes on at a time; each change of one is said once, with a number that rises.

    An id that was seen is known for ever, which is until 10,000 later ones have ended.
    """

    def __init__(self, say: Callable[[Status], None]) -> None:
        self._say = say
        self._last: dict[str, Status] = {}
        self._epochs: dict[str, int] = {}
        self._current = ""

    @property
    def current(self) -> str:
        """The id of what goes on, or ""."""
        return self._current

    def last(self, id_: str) -> Status:
        """What was said last; UNKNOWN, with number 0, if nothing was."""
        reason = "this vehicle knows no such behavior"
        return self._last.get(id_) or Status(id_, 0, BehaviorState.UNKNOWN, reason=reason)

    def knows(self, id_: str) -> bool:
        """Whether it was accepted or rejected before."""
        return id_ in self._last

    def is_past(self, run: str, epoch: int) -> bool:
        """Whether another executive has taken the run over; a higher epoch is remembered."""
        highest = max(epoch, self._epochs.pop(run, epoch))
        self._epochs[run] = highest
        if len(self._epochs) > REMEMBERED:
            del self._epochs[next(iter(self._epochs))]
        return epoch < highest

    def again(self, id_: str) -> None:
        """Say the last status once more."""
        self._say(self.last(id_))

    def reject(self, id_: str, code: str, reason: str) -> None:
        """It will not be done, and nothing has changed."""
        self._note(Status(id_, 1, BehaviorState.REJECTED, code, reason))

    def accept(self, id_: str) -> None:
        """It goes on from now on; what went on before has ended."""
        before, self._current = self._current, id_
        if before:
            number = self._last[before].number + 1
            reason = f"{id_} took over"
            self._note(Status(before, number, BehaviorState.CANCELLED, reason=reason))
        self._note(Status(id_, 1, BehaviorState.ACCEPTED))

    def progress(self, id_: str) -> None:
        """The vehicle does it: said the first time."""
        if id_ == self._current and self._last[id_].state is BehaviorState.ACCEPTED:
            self._note(Status(id_, 2, BehaviorState.RUNNING))

    def end(
        self,
        id_: str,
        state: BehaviorState,
        code: str = "",
        reason: str = "",
        outputs: Mapping[str, Value] | None = None,
    ) -> None:
        """It has ended; nothing happens if it is not what goes on."""
        if id_ and id_ == self._current:
            self._current = ""
            number = self._last[id_].number + 1
            self._note(Status(id_, number, state, code, reason, outputs=outputs or {}))

    def _note(self, status: Status) -> None:
        self._last.pop(status.id, None)
        self._last[status.id] = status
        if len(self._last) > REMEMBERED:
            del self._last[next(id_ for id_ in self._last if id_ != self._current)]
        self._say(status)
