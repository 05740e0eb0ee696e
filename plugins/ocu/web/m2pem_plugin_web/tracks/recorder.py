"""Records tracks of every run that this executive drives, while the page is served.

The executive does not wait for it. It reads the latest states of the fleet a few times in a second
of mission time; a thread writes the new ones once a second.
"""

import asyncio
import logging
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias

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
from m2pem_plugin_web.tracks.detections import MOST_DETECTIONS, DetectionEntry, Found
from m2pem_plugin_web.tracks.pictures import FullError, PictureStore
from m2pem_plugin_web.tracks.snapshots import CameraAnswer, Snapshot, Snapshots
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

MOST_SHARED = 50
"""Most pictures of a run that later entries may still share."""

LONGEST_HEAD = 1000

GOES_ON = (RunStatus.RUNNING, RunStatus.PAUSED)

Announce: TypeAlias = Callable[[RunId, Sequence[DetectionEntry], int], None]
"""Is called with new entries of a run, and how many detections it has without an entry."""

Keeping: TypeAlias = asyncio.Task[Mapping[str, Any]]
"""Waits for a picture and keeps it; gives what entries say of it."""

_encode = msgspec.json.Encoder().encode
log = logging.getLogger("m2pem.ocu.web")


@dataclass(slots=True, eq=False)
class _Writing:
    """An open track, and the samples to write."""

    track: Track
    waiting: list[Sample] = field(default_factory=list)
    last_s: float = 0.0
    """The mission time of the last sample."""
    awaited: list[tuple[DetectionEntry, Snapshot, Keeping]] = field(default_factory=list)
    """Entries whose pictures are asked for."""
    kept: dict[asyncio.Task[CameraAnswer], Keeping] = field(default_factory=dict)
    """The newest pictures, which later entries may share."""
    turn: asyncio.Lock = field(default_factory=asyncio.Lock)


class Recorder:
    """Records tracks. `views`: the runs; `fleet`: the latest states of vehicles and payloads.

    `pictures`: where pictures of detections are kept. `announce`: sends new detections of a run to
    those who watch it, and their pictures when these have come.
    """

    def __init__(
        self,
        control: MissionControl,
        views: Mapping[RunId, RunView],
        fleet: FleetStates,
        store: TrackStore,
        pictures: PictureStore,
        announce: Announce,
    ) -> None:
        self.store = store
        self.pictures = pictures
        self._storing = asyncio.Lock()
        self._snapshots = Snapshots(control.fleet)
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
            await self._snapshots.close()

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
                    await self._end(run)
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
        new, more = writing.track.numbering.enter(t_s, found) if found else ((), 0)
        entries = (*self._pictured(writing), *new)
        self._await_pictures(writing, new, found.snapshots if found else ())
        if any(fresh.values()) or entries or more:
            writing.waiting.append(Sample(t_s, **fresh, detections=entries, more_detections=more))
            writing.last_s = t_s
        if entries or more:
            self._announce(run, entries, writing.track.numbering.more)

    def _detected(self, detection: Detection) -> None:
        """Note a detection for each run that goes on at that time, and ask for its picture."""
        snapshot: Snapshot | None = None
        now_s = asyncio.get_running_loop().time()
        for run in self._going_on():
            found = self._found.setdefault(run, Found())
            writing = self._writing.get(run)
            last = writing.track.numbering.last if writing is not None else 0
            has_room = last + len(found.detections) < MOST_DETECTIONS
            if snapshot is None and has_room and now_s >= self._not_before.get(run, 0.0):
                snapshot = self._snapshots.of(detection.source)
            found.add(detection, snapshot)

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
        writing = self._writing[run] = _Writing(track, last_s=track.last_s)
        await self._forget_pictures(run, track.numbering.last)
        return writing

    def _leave_alone(self, run: RunId) -> None:
        self._not_before[run] = asyncio.get_running_loop().time() + AGAIN_S

    # --- pictures -------------------------------------------------------------------------------

    def _await_pictures(
        self,
        writing: _Writing,
        entries: Sequence[DetectionEntry],
        snapshots: Sequence[Snapshot | None],
    ) -> None:
        """Have the pictures of new entries kept when they come; several entries may share one."""
        for entry, snapshot in zip(entries, snapshots, strict=False):  # some have no entry
            if snapshot is None:
                continue
            keeping = writing.kept.get(snapshot.coming)
            if keeping is None:
                keep = self._keep_picture(writing.track.run, entry.number, snapshot.coming)
                keeping = asyncio.create_task(keep, name="web: keep a picture")
                writing.kept[snapshot.coming] = keeping
                for old in list(writing.kept)[:-MOST_SHARED]:
                    del writing.kept[old]
            writing.awaited.append((entry, snapshot, keeping))

    async def _keep_picture(
        self, run: RunId, number: int, coming: asyncio.Task[CameraAnswer]
    ) -> Mapping[str, Any]:
        """Wait for a picture and keep it. Return what entries say of it."""
        answer = await asyncio.shield(coming)  # other runs want it, too
        picture = answer.picture
        if picture is None:
            return {"no_picture": answer.why}
        try:
            async with self._storing:
                await _to_the_end(lambda: self.pictures.put(run, number, picture))
        except FullError as error:
            return {"no_picture": str(error)}
        except OSError as error:
            log.warning("a picture of %s cannot be kept: %s", run, error)
            return {"no_picture": f"it cannot be kept: {error.strerror}"}
        return {"picture": number}

    def _pictured(self, writing: _Writing) -> list[DetectionEntry]:
        """Return the entries whose pictures are kept, or will not come, as they are now."""
        done = [each for each in writing.awaited if each[2].done()]
        writing.awaited = [each for each in writing.awaited if not each[2].done()]
        return [_with_picture(*each) for each in done]

    async def _forget_pictures(self, run: RunId, after: int) -> None:
        """Remove pictures of detections that the track of a run does not have."""
        try:
            async with self._storing:
                await _to_the_end(lambda: self.pictures.remove(run, after))
        except OSError as error:
            log.warning("pictures of %s cannot be deleted: %s", run, error)

    # --- writing --------------------------------------------------------------------------------

    async def _write(self) -> None:
        while True:
            await asyncio.sleep(WRITE_S)
            for run in list(self._writing):
                await self.flush(run)

    async def _end(self, run: RunId) -> None:
        """Close the track of a run that has ended, unless pictures are still to come."""
        writing = self._writing[run]
        self._take_last(writing)
        if not writing.awaited:
            await self._close(run)

    def _take_last(self, writing: _Writing) -> None:
        """Add what has come since the last sample: a detection may end a run at once."""
        view = self._views.get(writing.track.run)
        self._take(writing, max(view.t_s if view is not None else 0.0, writing.last_s), ())

    async def _close(self, run: RunId) -> None:
        if (writing := self._writing.get(run)) is not None:
            self._take_last(writing)
            keeping = {each[2] for each in writing.awaited}
            for task in keeping:
                task.cancel()
            if keeping:
                await asyncio.wait(keeping)
            self._take_last(writing)
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
            tracked = await asyncio.to_thread(self.store.runs)
            for run in set(await asyncio.to_thread(self.pictures.runs)).difference(tracked):
                await self._forget_pictures(run, 0)
        except (OSError, M2pemError) as error:
            log.warning("tracks of removed runs cannot be deleted: %s", error)

    def _heads(self) -> dict[RunId, int]:
        """Return when each run with a track began; 0 if the head of its track cannot be read."""
        heads = {run: head_of(self.store.read(run, LONGEST_HEAD)) for run in self.store.runs()}
        return {run: head.started_us if head is not None else 0 for run, head in heads.items()}


def _with_picture(entry: DetectionEntry, snapshot: Snapshot, keeping: Keeping) -> DetectionEntry:
    if keeping.cancelled():
        return msgspec.structs.replace(entry, no_picture="m2pem ended before it came")
    said = dict(keeping.result())
    if "picture" in said:
        after_s = snapshot.coming.result().at_s - snapshot.since_s
        said["picture_after_s"] = round(max(0.0, after_s), 3)
    return msgspec.structs.replace(entry, **said)


async def _to_the_end(work: Callable[[], None]) -> None:
    """Call `work` in a thread; a cancelled task ends only when the call has returned."""
    doing = asyncio.ensure_future(asyncio.to_thread(work))
    try:
        await asyncio.shield(doing)
    except asyncio.CancelledError:
        await asyncio.wait([doing])
        raise
