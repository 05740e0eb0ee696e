"""Records tracks of every run that this executive drives, while the page is served.

The executive does not wait for it. It reads the latest states of the fleet a few times in a second
of mission time; a thread writes the new ones once a second.
"""

import asyncio
import logging
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

import msgspec

from m2pem.api import (
    Detection,
    MissionControl,
    PayloadState,
    RunId,
    RunStatus,
    RunView,
    VehicleState,
)
from m2pem.errors import M2pemError
from m2pem_plugin_web.live.latest_states import FleetStates
from m2pem_plugin_web.tracks.detections import DetectionEntry, Found
from m2pem_plugin_web.tracks.stores import HeldError, TrackStore
from m2pem_plugin_web.tracks.thinning import SPACING_S, Sample, State
from m2pem_plugin_web.tracks.track import Head, Track, head_of

LOOK_S = 0.25
"""Seconds of mission time between two samples, but at least `QUICKEST_S` of the wall clock."""
QUICKEST_S = 0.05

WRITE_S = 1.0
AGAIN_S = 2.0
"""Seconds until a retry."""

MOST_WAITING = 2000
"""Most samples of a run that wait for the disk."""

MOST_PROBLEMS = 100

LONGEST_HEAD = 1000

GOES_ON = (RunStatus.RUNNING, RunStatus.PAUSED)

Announce: TypeAlias = Callable[[RunId, Sequence[DetectionEntry], int], None]
"""Is called with new entries of a run, and how many detections it has without an entry."""

_encode = msgspec.json.Encoder().encode
log = logging.getLogger("m2pem.ocu.web")


@dataclass(slots=True, eq=False)
class _Writing:
    """An open track, and the samples to write."""

    track: Track
    waiting: list[Sample] = field(default_factory=list)
    last_s: float = 0.0
    """The mission time of the last sample."""
    turn: asyncio.Lock = field(default_factory=asyncio.Lock)


class Recorder:
    """Records tracks. `views`: the runs; `fleet`: the latest states of vehicles and payloads.

    `announce`: sends new detections of a run to those who watch it.
    """

    def __init__(
        self,
        control: MissionControl,
        views: Mapping[RunId, RunView],
        fleet: FleetStates,
        store: TrackStore,
        announce: Announce = lambda _run, _entries, _more: None,
    ) -> None:
        self.store = store
        self._announce = announce
        self._found: dict[RunId, Found] = {}
        fleet.detected.append(self._detected)
        self.problems: dict[RunId, str] = {}
        """Why tracks of runs have gaps, as text."""
        self._control = control
        self._views = views
        self._fleet = fleet
        self._before: list[State] = []
        """The states at the last sample."""
        self._soon_s = SPACING_S + control.speed()
        self._writing: dict[RunId, _Writing] = {}
        self._not_before: dict[RunId, float] = {}

    async def run(self) -> None:
        """Record until cancelled, then write the remaining samples."""
        try:
            await self._forget_runs_of_before()
            async with asyncio.TaskGroup() as tasks:
                tasks.create_task(self._look(), name="web: where vehicles are")
                tasks.create_task(self._write(), name="web: tracks")
        except* Exception as group:  # the page works without tracks
            log.error("tracks are no longer recorded", exc_info=group)
        finally:
            for run in list(self._writing):
                await self._close(run)

    async def flush(self, run: RunId) -> None:
        """Write the remaining samples of a run."""
        writing = self._writing.get(run)
        if writing is None:
            return
        async with writing.turn:
            samples = list(writing.waiting)
            if not samples:
                return

            def write() -> None:
                writing.track.append(samples)
                del writing.waiting[: len(samples)]

            try:
                await _to_the_end(write)
            except OSError as error:
                self._log_once(run, error)

    # --- sampling -------------------------------------------------------------------------------

    async def _look(self) -> None:
        loop = asyncio.get_running_loop()
        every_s = max(QUICKEST_S, LOOK_S / self._control.speed())
        while True:
            for run, view in list(self._views.items()):
                if view.status in GOES_ON and view.summary.started_us:
                    if loop.time() >= self._not_before.get(run, 0.0):
                        await self._look_at(run, view)
                elif run in self._writing:
                    await self._close(run)
            for run in self._found.keys() - self._writing.keys() - self._going_on():
                del self._found[run]
            for run in self._writing.keys() - self._views.keys():
                await self._close(run)
            self._before = self._states()
            await asyncio.sleep(every_s)

    async def _look_at(self, run: RunId, view: RunView) -> None:
        try:
            t_s = await self._control.mission_time_s(run)
            writing = self._writing.get(run)
            if writing is None:
                writing = await self._open(run, view.summary.started_us, t_s)
                t_s = await self._control.mission_time_s(run)
                if writing is not None and writing.track.is_new and t_s <= self._soon_s:
                    self._take(writing, 0.0, self._before, with_detections=False)
        except M2pemError:
            self._leave_alone(run)  # another executive executes the run, or it has just ended
            return
        if writing is not None and len(writing.waiting) < MOST_WAITING:
            self._take(writing, t_s, self._states())

    def _states(self) -> list[State]:
        """Return the latest states of vehicles and payloads."""
        latest = (*self._fleet.vehicles.states.values(), *self._fleet.payloads.states.values())
        return [each for each in latest if isinstance(each, VehicleState | PayloadState)]

    def _take(
        self,
        writing: _Writing,
        t_s: float,
        states: Iterable[State],
        *,
        with_detections: bool = True,
    ) -> None:
        """Add the states that are new, and detections, to the samples of a run."""
        thinner = writing.track.thinner
        fresh: dict[str, dict[str, msgspec.Raw]] = {"vehicles": {}, "payloads": {}}
        for state in states:
            if thinner.wants(t_s, state):
                thinner.keep(t_s, state)
                kind = "vehicles" if isinstance(state, VehicleState) else "payloads"
                fresh[kind][state.resource] = msgspec.Raw(_encode(state))
        run = writing.track.run
        found = self._found.pop(run, None) if with_detections else None
        entries, more = writing.track.numbering.enter(t_s, found) if found else ((), 0)
        if any(fresh.values()) or entries or more:
            writing.waiting.append(Sample(t_s, **fresh, detections=entries, more_detections=more))
            writing.last_s = t_s
        if entries or more:
            self._announce(run, entries, writing.track.numbering.more)

    def _detected(self, detection: Detection) -> None:
        """Note a detection for each run that goes on at that time."""
        for run in self._going_on():
            self._found.setdefault(run, Found()).add(detection)

    def _going_on(self) -> set[RunId]:
        """Return the runs that go on."""
        return {
            run
            for run, view in self._views.items()
            if view.status in GOES_ON and view.summary.started_us
        }

    async def _open(self, run: RunId, started_us: int, t_s: float) -> _Writing | None:
        try:
            track = await asyncio.to_thread(Track, self.store, Head(run, started_us), t_s)
        except HeldError:
            self._leave_alone(run)
            return None
        except OSError as error:
            self._log_once(run, error)
            self._leave_alone(run)
            return None
        self._writing[run] = _Writing(track, last_s=track.last_s)
        return self._writing[run]

    def _leave_alone(self, run: RunId) -> None:
        self._not_before[run] = asyncio.get_running_loop().time() + AGAIN_S

    # --- writing --------------------------------------------------------------------------------

    async def _write(self) -> None:
        while True:
            await asyncio.sleep(WRITE_S)
            for run in list(self._writing):
                await self.flush(run)

    async def _close(self, run: RunId) -> None:
        if (writing := self._writing.get(run)) is not None:
            # A detection may end a run at once.
            view = self._views.get(run)
            self._take(writing, max(view.t_s if view is not None else 0.0, writing.last_s), ())
        await self.flush(run)
        writing = self._writing.pop(run, None)
        if writing is not None:
            async with writing.turn:
                await asyncio.to_thread(writing.track.close)

    def _log_once(self, run: RunId, error: OSError) -> None:
        """Log an error once; the path of the file is in the log only."""
        text = f"the track of {run} cannot be written: {error.strerror}"
        if self.problems.get(run) == text:
            return
        log.warning("the track of %s cannot be written: %s", run, error)
        self.problems[run] = text
        while len(self.problems) > MOST_PROBLEMS:
            del self.problems[next(iter(self.problems))]

    async def _forget_runs_of_before(self) -> None:
        """Remove tracks of runs that the journal does not have."""
        try:
            kept = await asyncio.to_thread(self._heads)
            there = {each.run: each.started_us for each in await self._control.runs()}
            for run, started_us in kept.items():
                if run not in there or (started_us and started_us != there[run]):
                    await asyncio.to_thread(self.store.remove, run)
        except (OSError, M2pemError) as error:
            log.warning("tracks of removed runs cannot be deleted: %s", error)

    def _heads(self) -> dict[RunId, int]:
        """Return when each run with a track began; 0 if the head of its track cannot be read."""
        heads = {run: head_of(self.store.read(run, LONGEST_HEAD)) for run in self.store.runs()}
        return {run: head.started_us if head is not None else 0 for run, head in heads.items()}


async def _to_the_end(work: Callable[[], None]) -> None:
    """Call `work` in a thread; a cancelled task ends only when the call has returned."""
    doing = asyncio.ensure_future(asyncio.to_thread(work))
    try:
        await asyncio.shield(doing)
    except asyncio.CancelledError:
        await asyncio.wait([doing])
        raise
