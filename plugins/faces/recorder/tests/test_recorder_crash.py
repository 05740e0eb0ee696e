"""What is left of a recording when its process is killed, or the disk takes no more."""

import asyncio
import os
import resource
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import msgspec
import pytest
from m2pem_plugin_recorder.channels import RECORDS, TELEMETRY
from m2pem_plugin_recorder.reading import last_record, messages_of
from m2pem_plugin_recorder.recording import recording_files
from mcap.exceptions import McapError
from mcap.stream_reader import StreamReader
from recording_world import DRIVE, finished, m2pem, recorded, simulated_fleet, write_fleet

from m2pem.errors import PluginError
from m2pem.testing import run_executive
from m2pem.testing.harness import run_mission_on

WITHIN_S = 30.0


def until(condition: Callable[[], bool], process: subprocess.Popen[bytes]) -> None:
    """Wait for a condition; the process must not end before."""
    end = time.monotonic() + WITHIN_S
    while not condition():
        assert process.poll() is None, process.stdout.read() if process.stdout else ""
        assert time.monotonic() < end
        time.sleep(0.05)  # between two looks at the file


def numbers(*paths: Path) -> list[int]:
    return [message.sequence for path in paths for message in messages_of(path, (RECORDS,))]


def test_a_killed_process_leaves_a_readable_file_and_its_successor_goes_on(tmp_path: Path) -> None:
    write_fleet(tmp_path)
    folder = tmp_path / "journal.db-recordings"
    common = ("--journal", "journal.db", "--ocu", "none")

    def on_disk() -> bool:
        paths = list(folder.glob("*.mcap"))
        return bool(paths) and len(list(messages_of(paths[0], (TELEMETRY,)))) > 10

    with m2pem(tmp_path, "serve", "--fleet", "fleet.yaml", *common) as process:
        until(lambda: any((tmp_path / "journal.db-control").glob("*.sock")), process)
        finished(tmp_path, "start", "drive.bpmn", "--journal", "journal.db")
        until(on_disk, process)
        os.kill(process.pid, signal.SIGKILL)
    (torn,) = folder.glob("*.mcap")
    left = numbers(torn)
    assert left == list(range(1, len(left) + 1))
    assert len(left) > 5
    # The library itself reads it, too, up to where it is torn.
    read = 0
    with torn.open("rb") as file, pytest.raises(McapError):
        for _ in StreamReader(file).records:
            read += 1
    assert read > len(left)

    with m2pem(tmp_path, "serve", "--fleet", "fleet.yaml", *common) as serve:
        until(lambda: len(list(folder.glob("*.2.mcap"))) == 1, serve)
        finished(tmp_path, "stop", "r1", "--journal", "journal.db")
        serve.send_signal(signal.SIGTERM)
    assert serve.returncode == 0
    paths = [each.path for each in recording_files(folder)]
    assert len(paths) == 2
    exported = finished(tmp_path, "runs", "--export", "r1", "--journal", "journal.db")
    journal = [msgspec.json.decode(line) for line in exported.splitlines()[1:]]
    assert numbers(*paths) == [each["seq"] for each in journal]
    written = [msgspec.json.decode(m.data) for p in paths for m in messages_of(p, (RECORDS,))]
    assert written == journal


def test_the_last_record_is_found_without_reading_telemetry(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An executive that takes a run up does not wait for gigabytes of it, wherever they end."""

    async def main() -> None:
        async with (
            run_executive(simulated_fleet(), speed=20.0) as control,
            recorded(control, tmp_path),
        ):
            await run_mission_on(control, DRIVE)

    monkeypatch.setattr("m2pem_plugin_recorder.recording.CHUNK_BYTES", 2_000)
    asyncio.run(main())
    (path,) = tmp_path.glob("*.mcap")
    whole, torn = path.read_bytes(), tmp_path / "torn.mcap"
    found = []
    for size in (*range(0, len(whole), 997), len(whole)):
        torn.write_bytes(whole[:size])
        found.append((torn.read_bytes(), numbers(torn)))

    def read(*_: object) -> None:
        raise AssertionError("a message is read")

    monkeypatch.setattr("mcap.records.Message.read", read)
    for content, left in found:
        torn.write_bytes(content)
        assert last_record([torn]) == len(left)
    assert len({len(left) for _, left in found}) > 3


def test_a_full_disk_ends_the_recording_and_not_the_mission(tmp_path: Path) -> None:
    async def main() -> None:
        async with (
            run_executive(simulated_fleet(), speed=5.0) as control,
            recorded(control, tmp_path, min_free_mb=10**7) as face,
        ):
            result = await run_mission_on(control, DRIVE)
            with pytest.raises(PluginError, match="10000000 MB are free"):
                await face
        assert result.summary.status == "completed"

    asyncio.run(main())


def test_what_was_written_before_the_disk_was_full_can_be_read(tmp_path: Path) -> None:
    """The kernel refuses to let the file grow (EFBIG), as it refuses on a full disk (ENOSPC)."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    ignored = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)

    async def main() -> None:
        async with (
            run_executive(simulated_fleet(), speed=5.0) as control,
            recorded(control, tmp_path, rate_hz=1000.0) as face,
        ):
            running = asyncio.create_task(run_mission_on(control, DRIVE))
            resource.setrlimit(resource.RLIMIT_FSIZE, (150_000, hard))
            with pytest.raises(PluginError, match="File too large"):
                await face
            resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
            assert (await running).summary.status == "completed"

    try:
        asyncio.run(main())
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, ignored)
    (path,) = tmp_path.glob("*.mcap")
    assert numbers(path)[:3] == [1, 2, 3]


def test_records_that_do_not_fit_are_read_from_the_journal(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("m2pem_plugin_recorder.writing_thread.MOST_WAITING", 4)

    async def main() -> list[int]:
        async with (
            run_executive(simulated_fleet(), speed=20.0) as control,
            recorded(control, tmp_path),
        ):
            return [each.seq for each in (await run_mission_on(control, DRIVE)).stamped]

    wanted = asyncio.run(main())
    (path,) = tmp_path.glob("*.mcap")
    assert numbers(path) == wanted


def test_a_recorder_that_comes_late_reads_what_was_before(tmp_path: Path) -> None:
    async def main() -> list[int]:
        async with run_executive(simulated_fleet(), speed=5.0) as control:
            events = control.subscribe()
            running = asyncio.create_task(run_mission_on(control, DRIVE))
            async for event in events:
                if type(getattr(event, "record", None)).__name__ == "BehaviorProgressed":
                    break
            async with recorded(control, tmp_path):
                return [each.seq for each in (await running).stamped]

    wanted = asyncio.run(main())
    (path,) = tmp_path.glob("*.mcap")
    assert numbers(path) == wanted
