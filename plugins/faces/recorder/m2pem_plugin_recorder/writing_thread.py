"""The thread that writes recordings. The event loop hands over what happens, and never waits."""

import logging
import os
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

from m2pem.api import (
    Alert,
    Area,
    LocalFrame,
    Mission,
    Point,
    Route,
    RunId,
    StampedRecord,
    Telemetry,
)
from m2pem_plugin_recorder.channels import ChannelMessage
from m2pem_plugin_recorder.diagrams import diagram_of
from m2pem_plugin_recorder.foxglove_messages import log_message, removal_messages, scene_messages
from m2pem_plugin_recorder.reading import last_record
from m2pem_plugin_recorder.record_messages import RecordEncoder
from m2pem_plugin_recorder.recording import (
    RecordedRun,
    RunRecording,
    delete_oldest,
    recording_files,
)
from m2pem_plugin_recorder.settings import MB, RecorderSettings
from m2pem_plugin_recorder.telemetry_messages import TelemetryEncoder

MOST_WAITING = 20_000
"""Most items that wait for the disk: records. Telemetry is dropped at half of it."""

FLUSH_S = 1.0
LOOK_AT_SIZE_S = 30.0
"""Seconds between two looks at the size of all recordings."""

END_S = 5.0
"""How long the end of an executive waits for the disk."""

log = logging.getLogger("m2pem.face.recorder")


@dataclass(frozen=True, slots=True)
class Begin:
    """A run has begun, or is taken up: its records follow, from the first on."""

    run: RunId
    mission_name: str
    started_us: int
    mission: Mission | None


@dataclass(frozen=True, slots=True)
class End:
    """A run has ended, and its vehicles are released."""

    run: RunId


@dataclass(frozen=True, slots=True)
class Geometries:
    """The routes, areas and points by name, as they are from `time_us` on."""

    found: Mapping[str, Point | Route | Area]
    time_us: int


@dataclass(frozen=True, slots=True)
class Warned:
    """An alert, and when it was raised."""

    alert: Alert
    time_us: int


Item: TypeAlias = Begin | End | Geometries | Warned | StampedRecord | Telemetry


@dataclass(slots=True)
class _Open:
    """A run that is recorded. `known`: the last record that earlier files have."""

    recording: RunRecording
    encoder: RecordEncoder
    known: int = 0


class WritingThread:
    """Writes items to the recordings of their runs, and telemetry to those of all.

    `fleet`: as JSON; `fence`: the name of its fence. `room`: called from the thread when there is
    room again after `put` was refused, and when a write has failed, which ends the recording.
    """

    def __init__(
        self,
        settings: RecorderSettings,
        frame: LocalFrame,
        fleet: bytes,
        fleet_name: str,
        fence: str,
        room: Callable[[], None],
    ) -> None:
        self.dropped = 0
        """States that were not recorded because the disk was too slow."""
        self.failure = ""
        """Why the recording has stopped before its time."""
        self._folder = settings.folder
        self._settings = settings
        self._frame = frame
        self._fleet, self._fleet_name, self._fence = fleet, fleet_name, fence
        self._room = room
        self._telemetry = TelemetryEncoder(frame, ros=settings.ros)
        self._waiting: deque[Item] = deque()
        self._refused = False
        self._news = threading.Event()
        self._ending = False
        self._runs: dict[RunId, _Open] = {}
        self._geometries: Geometries | None = None
        self._thread = threading.Thread(target=self._run, name="recorder", daemon=True)

    def start(self) -> None:
        self._thread.start()

    def put(self, item: Item) -> bool:
        """Hand over an item; False: too many wait. Once it has failed, all are thrown away."""
        if self.failure:
            return True
        if len(self._waiting) >= MOST_WAITING:
            self._refused = True
            return False
        self._waiting.append(item)
        self._news.set()
        return True

    def put_state(self, state: Telemetry) -> None:
        """Hand over a state; it is dropped if half as many items as possible wait."""
        if len(self._waiting) >= MOST_WAITING // 2:
            self.dropped += 1
        else:
            self.put(state)

    def end(self) -> None:
        """Write what waits, and close all files; called in another thread, it waits for that."""
        self._ending = True
        self._news.set()
        self._thread.join(END_S)

    # --- in the thread --------------------------------------------------------------------------

    def _run(self) -> None:
        try:
            self._folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            self._write_all()
            for each in self._runs.values():
                each.recording.close()
        except OSError as error:
            self._stop(f"{error.strerror}: {error.filename or self._folder}")
        except Exception:  # the executive goes on without a recording
            log.exception("the recording has broken")
            self._stop("an error in the recorder, which is in the log")

    def _write_all(self) -> None:
        flush_at = time.monotonic() + FLUSH_S
        look_at = 0.0
        while True:
            while self._waiting and (now := time.monotonic()) < flush_at:
                self._take(self._waiting.popleft())
                if self._refused and len(self._waiting) < MOST_WAITING // 4:
                    self._refused = False
                    self._room()
            if (now := time.monotonic()) >= flush_at:
                for each in self._runs.values():
                    each.recording.flush()
                self._check_free()
                if now >= look_at:
                    self._make_room()
                    look_at = now + LOOK_AT_SIZE_S
                flush_at = now + FLUSH_S
            if self._waiting:
                continue
            if self._ending:
                return
            self._news.clear()
            if not self._waiting and not self._ending:
                self._news.wait(max(0.0, flush_at - time.monotonic()))

    def _take(self, item: Item) -> None:
        match item:
            case StampedRecord():
                self._take_record(item)
            case Begin():
                self._begin(item)
            case End(run=run):
                if (ended := self._runs.pop(run, None)) is not None:
                    ended.recording.close()
            case Geometries():
                before = self._geometries.found if self._geometries is not None else {}
                gone = removal_messages(before.keys() - item.found.keys(), item.time_us)
                self._geometries = item
                scene = [*gone, *self._scene(item.time_us)]
                for each in self._runs.values():
                    each.recording.write(scene)
            case Warned(alert=alert, time_us=time_us):
                for run, each in self._runs.items():
                    if alert.run in ("", run):
                        each.recording.write((log_message(alert, time_us),))
            case _:
                if self._runs:
                    messages = self._telemetry.messages(item)
                    for each in self._runs.values():
                        each.recording.write(messages)

    def _take_record(self, stamped: StampedRecord) -> None:
        found = self._runs.get(stamped.run)
        if found is None or stamped.seq <= found.encoder.seq:
            return
        if stamped.seq <= found.known:
            found.encoder.take(stamped)
        else:
            found.recording.write(found.encoder.messages(stamped))

    def _begin(self, begin: Begin) -> None:
        if begin.run in self._runs:
            return
        mission = begin.mission
        run = RecordedRun(
            begin.run,
            begin.mission_name,
            begin.started_us,
            () if mission is None else tuple(mission.files()),
            self._fleet,
            self._fleet_name,
            "" if mission is None else diagram_of(mission),
        )
        recording = RunRecording(self._folder, run, self._settings.file_bytes, self._scene)
        before = [each.path for each in recording_files(self._folder, run.stem)]
        self._runs[begin.run] = _Open(recording, RecordEncoder(begin.run), last_record(before))

    def _scene(self, time_us: int) -> list[ChannelMessage]:
        if (geometries := self._geometries) is None:
            return []
        return list(scene_messages(geometries.found, self._frame, self._fence, time_us))

    def _check_free(self) -> None:
        status = os.statvfs(self._folder)
        free, least = status.f_bavail * status.f_frsize, self._settings.min_free_bytes
        if self._runs and free < least:
            raise OSError(0, f"less than {least // MB} MB are free (min_free_mb)", self._folder)

    def _make_room(self) -> None:
        if (most := self._settings.total_bytes) is None:
            return
        paths = {each.recording.path for each in self._runs.values()}
        for path in delete_oldest(self._folder, most, {path for path in paths if path}):
            log.info("deleted %s: recordings have more than %d MB", path, most // MB)

    def _stop(self, why: str) -> None:
        for each in self._runs.values():
            each.recording.abandon()
        self._runs.clear()
        self._waiting.clear()
        self.failure = why
        self._room()
