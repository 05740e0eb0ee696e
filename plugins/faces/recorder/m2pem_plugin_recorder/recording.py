"""The MCAP files of one run: `RUN-START.mcap`, then `RUN-START.2.mcap`, ... (docs/recording.md).

A file ends when it is full, or with the executive; the next one goes on where it ended. Together
they have each record of the run once. The functions wait for the disk: call them in a thread.
"""

import hashlib
import os
import re
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import IO

from mcap.writer import CompressionType, Writer

import m2pem
from m2pem.api import US_PER_S, MissionFile, RunId
from m2pem_plugin_recorder.channels import Channel, ChannelMessage, Schema

CHUNK_BYTES = 512 * 1024
NS_PER_US = 1000

METADATA = "m2pem"
"""The name of the metadata about the run."""

SUFFIX = ".mcap"
_NAME = re.compile(r"(?P<run>r[1-9][0-9]{0,17})-(?P<start>\d{8}-\d{6})(?:\.(?P<part>\d+))?\.mcap")


@dataclass(frozen=True, slots=True)
class RecordedRun:
    """What a recording says of its run. `fleet`: as JSON. `diagram`: SVG, "" if there is none."""

    run: RunId
    mission: str
    started_us: int
    files: tuple[MissionFile, ...] = ()
    fleet: bytes = b""
    fleet_name: str = ""
    diagram: str = ""

    @property
    def mission_sha256(self) -> str:
        """The hash of the mission's own file, in hexadecimal digits; "" if it is not known."""
        return hashlib.sha256(self.files[0].source).hexdigest() if self.files else ""

    @property
    def stem(self) -> str:
        """What the names of the run's files begin with."""
        start = datetime.fromtimestamp(self.started_us / US_PER_S, UTC)
        return f"{self.run}-{start:%Y%m%d-%H%M%S}"


@dataclass(frozen=True, slots=True)
class RecordingFile:
    """A file of a recording, by its name."""

    path: Path
    run: RunId
    part: int


def recording_files(folder: Path, stem: str = "") -> list[RecordingFile]:
    """Return the files of recordings in a folder, in order of their parts. `stem`: of one run."""
    found = []
    for path in folder.glob(f"*{SUFFIX}"):
        match = _NAME.fullmatch(path.name)
        if match and (not stem or stem == f"{match['run']}-{match['start']}"):
            found.append(RecordingFile(path, match["run"], int(match["part"] or 1)))
    return sorted(found, key=lambda each: (each.path.name.partition(".")[0], each.part))


class McapFile:
    """MCAP that is written to a file. Methods raise OSError."""

    def __init__(self, file: IO[bytes], run: RecordedRun, part: int = 1) -> None:
        self._file = file
        self._written = _CountedWrites(file)
        self._writer = Writer(
            self._written,  # type: ignore[arg-type]  # it has all that the writer uses
            chunk_size=CHUNK_BYTES,
            compression=CompressionType.ZSTD,
        )
        self._channels: dict[Channel, int] = {}
        self._schemas: dict[Schema, int] = {}
        self._begin(run, part)

    @property
    def size(self) -> int:
        """The bytes in the file so far."""
        return self._written.count

    def write(self, message: ChannelMessage) -> None:
        """Add a message; it is in the file at the next `flush` at the latest."""
        channel = self._channels.get(message.channel)
        if channel is None:
            channel = self._register(message.channel)
        at_ns = max(0, message.time_us) * NS_PER_US
        self._writer.add_message(channel, at_ns, message.data, at_ns, message.sequence)

    def flush(self) -> None:
        """End the chunk: who ends the process now leaves a file with all messages so far."""
        self._writer.flush()  # type: ignore[no-untyped-call]

    def finish(self) -> None:
        """Write the index; the file stays open."""
        self._writer.finish()  # type: ignore[no-untyped-call]

    def close(self) -> None:
        """Write the index, and close the file."""
        try:
            self.finish()
        finally:
            self._file.close()

    def abandon(self) -> None:
        """Close the file as it is, without an index: the disk takes no more."""
        with suppress(OSError):  # what is still buffered does not fit, either
            self._file.close()

    def _begin(self, run: RecordedRun, part: int) -> None:
        self._writer.start(library=f"m2pem {m2pem.__version__}")
        self._writer.add_metadata(
            METADATA,
            {
                "run": run.run,
                "mission": run.mission,
                "mission_sha256": run.mission_sha256,
                "fleet": run.fleet_name,
                "started_us": str(run.started_us),
                "part": str(part),
                "m2pem": m2pem.__version__,
            },
        )
        at_ns = run.started_us * NS_PER_US
        for name, media_type, data in _attachments(run):
            self._writer.add_attachment(at_ns, at_ns, name, media_type, data)
        self._writer.flush()  # type: ignore[no-untyped-call]

    def _register(self, channel: Channel) -> int:
        schema = self._schemas.get(channel.schema)
        if schema is None:
            kind = channel.schema
            schema = self._writer.register_schema(kind.name, kind.encoding, kind.data)
            self._schemas[kind] = schema
        number = self._writer.register_channel(channel.topic, channel.encoding, schema)
        self._channels[channel] = number
        return number


class _CountedWrites:
    """A file for writing alone that knows its position without a system call."""

    def __init__(self, file: IO[bytes]) -> None:
        self._file = file
        self.count = 0

    def write(self, data: bytes) -> int:
        written = self._file.write(data)
        self.count += written
        return written

    def tell(self) -> int:
        return self.count

    def flush(self) -> None:
        self._file.flush()


def _attachments(run: RecordedRun) -> Iterator[tuple[str, str, bytes]]:
    for each in run.files:
        yield Path(each.name).name, "application/xml", each.source
    if run.diagram:
        yield f"{Path(run.mission).stem}.svg", "image/svg+xml", run.diagram.encode()
    if run.fleet:
        yield "fleet.json", "application/json", run.fleet


class RunRecording:
    """The files of one run, one after the other. Methods raise OSError.

    `most_bytes`: of a file. `first`: returns the messages with which a file begins, such as the
    scene, given the time of its first one.
    """

    def __init__(
        self,
        folder: Path,
        run: RecordedRun,
        most_bytes: int,
        first: Callable[[int], Iterable[ChannelMessage]] = lambda _: (),
    ) -> None:
        self.run = run
        self._first = first
        self._folder = folder
        self._most = most_bytes
        self._file: McapFile | None = None
        self.path: Path | None = None
        """The last file."""

    def write(self, messages: Iterable[ChannelMessage]) -> None:
        """Add messages."""
        for message in messages:
            file = self._file
            if file is None or file.size >= self._most:
                file = self._next(message.time_us)
            file.write(message)

    def flush(self) -> None:
        """See `McapFile.flush`."""
        if self._file is not None:
            self._file.flush()

    def close(self) -> None:
        """Close the last file."""
        file, self._file = self._file, None
        if file is not None:
            file.close()

    def abandon(self) -> None:
        """See `McapFile.abandon`."""
        file, self._file = self._file, None
        if file is not None:
            file.abandon()

    def _next(self, at_us: int) -> McapFile:
        self.close()
        before = recording_files(self._folder, self.run.stem)
        part = before[-1].part + 1 if before else 1
        name = f"{self.run.stem}{f'.{part}' if part > 1 else ''}{SUFFIX}"
        self.path = self._folder / name
        # Recordings show where vehicles are: they are their owner's, as the journal is.
        descriptor = os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
        self._file = McapFile(os.fdopen(descriptor, "wb"), self.run, part)
        for message in self._first(at_us):
            self._file.write(message)
        return self._file


def delete_oldest(folder: Path, most_bytes: int, keep: set[Path]) -> list[Path]:
    """Delete the oldest files of recordings until the rest has `most_bytes` at most.

    `keep`: files that are written now. Raises OSError.
    """
    files = [each.path for each in recording_files(folder)]
    sizes = {path: path.stat().st_size for path in files}
    total, deleted = sum(sizes.values()), []
    for path in sorted(files, key=lambda each: each.stat().st_mtime):
        if total <= most_bytes:
            break
        if path not in keep:
            path.unlink(missing_ok=True)
            total -= sizes[path]
            deleted.append(path)
    return deleted
