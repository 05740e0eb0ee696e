"""Flipped bits and cuts in the files of a journal whose executive was killed: never silent."""

import random
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from m2pem.errors import JournalError
from m2pem.journal import Entry, RunInfo
from m2pem.journal.sqlite import SqliteJournal
from m2pem.testing.contracts.journal_harness import opened, written
from tests.wal import commits


@dataclass
class Content:
    """What a journal has, and what it says is wrong with it."""

    lines: dict[str, RunInfo] = field(default_factory=dict)
    entries: dict[str, list[Entry]] = field(default_factory=dict)
    told: list[str] = field(default_factory=list)


async def look(path: Path) -> Content:
    content = Content()
    try:
        async with opened(lambda: SqliteJournal.open(path)) as journal:
            for line in await journal.runs():
                content.lines[line.run] = line
                if line.loss is not None:
                    content.told.append(f"{line.run}: {line.loss}")
            for run in content.lines:
                content.entries[run] = await written(journal, run)
    except JournalError as error:
        content.told.append(str(error))
    return content


def assert_told_or_whole(found: Content, before: Content, acknowledged: Mapping[str, int]) -> bool:
    """Returns whether something was told."""
    if found.told:
        return True
    for run, last_seq in acknowledged.items():
        line, whole = found.lines[run], before.lines[run]
        assert line.header == whole.header
        assert line.last_seq >= last_seq
        assert found.entries[run] == before.entries[run][: len(found.entries[run])]
        assert found.entries[run][-1].seq >= last_seq
        assert (line.epoch, line.started_us, line.outcome, line.detail, line.paused) == (
            whole.epoch, whole.started_us, whole.outcome, whole.detail, whole.paused,
        )  # fmt: skip
    return False


def copied(files: Sequence[Path], folder: Path) -> Path:
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    for file in files:
        shutil.copy(file, folder)
    return folder / "journal.db"


@dataclass(frozen=True)
class Killed:
    """The files that a killed executive left, and what it had acknowledged."""

    files: Sequence[Path]
    content: Content
    acknowledged: Mapping[str, int]


def kill_executive(path: Path, lines: int) -> dict[str, int]:
    """Four runs, killed after `lines` entries; the last acknowledged entry of each."""
    command = [sys.executable, str(Path(__file__).with_name("driving.py")), str(path), "4"]
    acknowledged = {}
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout is not None
        for _ in range(lines):
            run, seq = child.stdout.readline().split()
            acknowledged[run] = int(seq)
        child.kill()
        child.communicate()
    return acknowledged


async def killed(folder: Path, lines: int, *, closed: bool) -> Killed:
    """`closed`: the log was moved into the database file since."""
    path = folder / "journal.db"
    acknowledged = kill_executive(path, lines)
    if closed:
        async with opened(lambda: SqliteJournal.open(path)):
            pass
    files = [path.with_name(f"journal.db{suffix}") for suffix in ("", "-lock", "-mark")]
    files += [] if closed else [path.with_name("journal.db-wal")]
    content = await look(copied(files, folder / "whole"))
    assert content.told == []
    assert_told_or_whole(content, content, acknowledged)
    return Killed(files, content, acknowledged)


async def harm(left: Killed, folder: Path, suffix: str, seed: int, *, flips: int, cuts: int) -> int:
    """How often something was told. Each harm is done to a fresh copy."""
    chance = random.Random(seed)
    told = 0
    for number in range(flips + cuts):
        path = copied(left.files, folder)
        target = path.with_name(path.name + suffix)
        content = bytearray(target.read_bytes())
        size = commits(bytes(content))[-1] if suffix else len(content)
        place = chance.randrange(size)
        if number < flips:
            content[place] ^= 1 << chance.randrange(8)
        else:
            del content[place:]
        target.write_bytes(content)
        found = await look(path)
        try:
            told += assert_told_or_whole(found, left.content, left.acknowledged)
        except AssertionError as error:
            raise AssertionError(
                f"seed {seed}, harm {number} at byte {place} of {target}"
            ) from error
    return told


@pytest.mark.parametrize(
    ("flips", "cuts"), [(16, 4), pytest.param(160, 40, marks=pytest.mark.long)]
)
async def test_damage_to_the_log_is_told(tmp_path, flips, cuts):
    left = await killed(tmp_path, 150, closed=False)
    told = await harm(left, tmp_path / "copy", "-wal", 1, flips=flips, cuts=cuts)
    assert told >= (flips + cuts) // 2


@pytest.mark.parametrize(
    ("flips", "cuts"), [(16, 4), pytest.param(160, 40, marks=pytest.mark.long)]
)
async def test_damage_to_the_file_is_told(tmp_path, flips, cuts):
    left = await killed(tmp_path, 300, closed=True)
    told = await harm(left, tmp_path / "copy", "", 2, flips=flips, cuts=cuts)
    assert told >= cuts
