"""What an executive says of its runs: records, telemetry, questions and summaries."""

from collections.abc import AsyncIterator, Sequence
from typing import TYPE_CHECKING, Protocol, TypeAlias, Union

from m2pem.api.alerts import AlertsChanged
from m2pem.api.allocation import SharedSpaceChanged
from m2pem.api.people import OperatorsChanged
from m2pem.api.runs import Alert, OpenPrompt, PromptClosed, RunId, RunSummary, StampedRecord
from m2pem.api.schedule import ScheduleChanged
from m2pem.api.telemetry import Telemetry

if TYPE_CHECKING:
    from m2pem.mission.mission import Mission


ControlEvent: TypeAlias = Union[
    StampedRecord,
    OpenPrompt,
    PromptClosed,
    Alert,
    AlertsChanged,
    ScheduleChanged,
    SharedSpaceChanged,
    OperatorsChanged,
]
"""What a subscriber gets: records and prompts in order, after they were committed, alerts and
changes of the schedule at once, those of shared space within a second."""


class WatchControl(Protocol):
    """The operations of `MissionControl` that watch runs."""

    def subscribe(
        self, run: RunId | None = None, size: int = 10_000
    ) -> AsyncIterator[ControlEvent]:
        """Yield the prompts that are open, and then all events from this call on."""

    def telemetry(self, size: int = 100) -> AsyncIterator[Telemetry]:
        """Telemetry from now on, and first the states of what is lost, as the executive holds it.
        The oldest waiting is dropped when a reader is slow."""

    async def records(
        self, run: RunId, after_seq: int = 0, limit: int = 1000
    ) -> Sequence[StampedRecord]:
        """The records after `after_seq`, about `limit` of them: a page ends with all records of
        an input, so it may be longer. `after_seq` is 0, or the last of a page."""

    async def runs(self) -> Sequence[RunSummary]:
        """Every run of the journal."""

    def prompts(self) -> Sequence[OpenPrompt]:
        """The prompts that are open."""

    async def mission(self, run: RunId) -> "Mission":
        """The mission of a run, also of one that has ended: its elements with their names."""

    async def mission_time_s(self, run: RunId) -> float:
        """Seconds from the start of a run that has not ended; does not advance during a pause."""

    async def wait(self, run: RunId) -> RunSummary:
        """Wait until the run has ended and its vehicles are released."""
