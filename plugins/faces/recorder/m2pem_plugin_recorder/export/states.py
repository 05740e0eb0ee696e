"""The telemetry of an exported run: from its recording, or else from the web page's tracks."""

from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import msgspec

from m2pem.api import US_PER_S, ExportedRun, PayloadState, Telemetry, VehicleState
from m2pem_plugin_recorder.reading import telemetry_of
from m2pem_plugin_recorder.recording import RecordedRun, recording_files
from m2pem_plugin_recorder.settings import folder_beside, folder_named


class _Sample(msgspec.Struct):
    """A line of a track (`journal.db-tracks`): the states at one mission time."""

    t: float
    vehicles: dict[str, msgspec.Raw] = msgspec.field(default_factory=dict)
    payloads: dict[str, msgspec.Raw] = msgspec.field(default_factory=dict)


class _Head(msgspec.Struct):
    """The first line of a track."""

    run: str
    started_us: int


_head = msgspec.json.Decoder(_Head)
_sample = msgspec.json.Decoder(_Sample)
_vehicle = msgspec.json.Decoder(VehicleState)
_payload = msgspec.json.Decoder(PayloadState)


def files_of(run: ExportedRun, folder: Path | None) -> list[Path]:
    """Return the files of a run's recording, which are in one folder. `folder` None: the one that
    the fleet file names, or else the one beside the journal."""
    stem = RecordedRun(run.summary.run, run.summary.mission, run.summary.started_us).stem
    found = ([each.path for each in recording_files(one, stem)] for one in _folders(run, folder))
    return next(filter(None, found), [])


def no_recording(run: ExportedRun, folder: Path | None) -> str:
    """Say that a run has no recording, and where it was looked for."""
    where = " or ".join(map(str, _folders(run, folder)))
    other = " (--recordings names another folder)" if where and folder is None else ""
    return f"{run.summary.run}: there is no recording{' in ' if where else ''}{where}{other}"


def _folders(run: ExportedRun, folder: Path | None) -> list[Path]:
    """Return where the recording of a run may be."""
    fleet, journal = run.fleet, run.journal
    if folder is not None:
        return [folder]
    settings = {} if fleet is None else fleet.faces.get("recorder", {})
    of_file = None if fleet is None else folder_named(fleet, settings.get("folder"))
    beside = None if journal is None else folder_beside(journal)
    return [each for each in (of_file, beside) if each is not None]


class States:
    """The states of runs; `remarks` says where they come from, if not from a recording."""

    def __init__(self, folder: Path | None) -> None:
        self.remarks: list[str] = []
        self._folder = folder

    def of(self, run: ExportedRun) -> Iterator[Telemetry]:
        """Yield the states of a run.

        Raises:
            OSError: a file cannot be read.
        """
        files = files_of(run, self._folder)
        if files:
            yield from telemetry_of(files)
            return
        found = False
        for state in _tracked(run):
            found = True
            yield state
        rest = (
            "positions are those that the web page kept"
            if found
            else "there is no telemetry (the face `recorder` makes recordings)"
        )
        self.remarks.append(f"{no_recording(run, self._folder)}; {rest}")


def _tracked(run: ExportedRun) -> Iterator[Telemetry]:
    if run.journal is None:
        return
    path = run.journal.with_name(f"{run.journal.name}-tracks") / f"{run.summary.run}.jsonl"
    try:
        head, *lines = path.read_bytes().split(b"\n")
    except (FileNotFoundError, NotADirectoryError):
        return
    try:
        if _head.decode(head).started_us != run.summary.started_us:
            return
    except (ValueError, msgspec.DecodeError):
        return
    decoders: tuple[tuple[str, Any], ...] = (("vehicles", _vehicle), ("payloads", _payload))
    for line in lines:
        try:
            sample = _sample.decode(line)
            for kind, decoder in decoders:
                for raw in getattr(sample, kind).values():
                    yield decoder.decode(raw)
        except (ValueError, msgspec.DecodeError):  # a torn line
            continue


def iso_time(time_us: int) -> str:
    """Return a time in microseconds since the Unix epoch as ISO 8601 has it, in UTC."""
    seconds, rest_us = divmod(time_us, US_PER_S)
    time = datetime.fromtimestamp(seconds, UTC).replace(microsecond=rest_us)
    return time.isoformat(timespec="milliseconds")
