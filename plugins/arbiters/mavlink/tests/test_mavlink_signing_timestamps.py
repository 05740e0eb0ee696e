"""Timestamps of signatures: none is sent twice, and none is accepted twice."""

import sqlite3
import time
from itertools import pairwise
from pathlib import Path

import pytest
from m2pem_plugin_mavlink.signing.key_file import SigningError
from m2pem_plugin_mavlink.signing.timestamps import (
    AHEAD,
    FILE,
    UNITS_PER_S,
    Timestamps,
    TimestampStore,
    clock_timestamp,
)

T0 = 3_700_000_000_000


class Clock:
    """A clock of the computer, which may be set."""

    def __init__(self, now: int = T0) -> None:
        self.now = now

    def __call__(self) -> int:
        return self.now


def keep(store: TimestampStore, times: Timestamps) -> None:
    change = times.change()
    store.write([change])
    times.stored(change)


def test_a_timestamp_counts_10_us_since_2015() -> None:
    unix_s = clock_timestamp() / 100_000 + 1_420_070_400
    assert unix_s == pytest.approx(time.time(), abs=5)


def test_each_is_later_than_the_one_before_also_when_the_clock_goes_back() -> None:
    clock = Clock()
    times = Timestamps(None, "k", clock)
    sent = []
    for now in (T0, T0, T0 + 50, T0 - 3600 * UNITS_PER_S, T0 + 60):
        clock.now = now
        sent += [times.next() for _ in range(3)]
    assert all(before < after for before, after in pairwise(sent))
    assert sent[6] == T0 + 50 and sent[-1] == T0 + 62


def test_after_a_crash_none_is_used_again(tmp_path: Path) -> None:
    clock = Clock()
    times = Timestamps(TimestampStore(tmp_path), "k", clock)
    sent = [times.next() for _ in range(3)]
    clock.now += 3 * AHEAD
    sent += [times.next() for _ in range(3)]
    clock.now = T0 - 3600 * UNITS_PER_S  # it is set back, and nothing else is written
    again = Timestamps(TimestampStore(tmp_path), "k", clock)
    assert again.next() > max(sent)
    assert Timestamps(TimestampStore(tmp_path), "another", clock).next() == clock.now


def test_a_reservation_in_time_spares_the_disk_later(tmp_path: Path) -> None:
    clock, store = Clock(), TimestampStore(tmp_path)
    times = Timestamps(store, "k", clock)
    times.next()
    assert not times.is_due
    clock.now += AHEAD // 2 + 1
    assert times.is_due
    keep(store, times)
    assert not times.is_due
    store.close()  # a write would fail from now on
    clock.now += AHEAD - 1
    assert times.next() == clock.now


def test_two_processes_on_one_folder_never_lower_what_the_other_has_written(
    tmp_path: Path,
) -> None:
    ahead, behind = Clock(T0 + 100 * AHEAD), Clock()
    first, second = TimestampStore(tmp_path), TimestampStore(tmp_path)
    one, two = Timestamps(first, "k", ahead), Timestamps(second, "k", behind)
    one.received[1, 0], two.received[1, 0] = 9, 5
    keep(first, one)
    keep(second, two)
    later = Timestamps(TimestampStore(tmp_path), "k", behind)
    assert later.next() >= T0 + 101 * AHEAD
    assert later.received == {(1, 0): 9}


def test_a_disk_that_fails_stops_no_commands(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    store = TimestampStore(tmp_path)
    times = Timestamps(store, "k", Clock())
    store.close()
    assert (times.next(), times.next()) == (T0, T0 + 1)
    assert caplog.text.count(f"{tmp_path / FILE}, which keeps the timestamps of signatures") == 1


def test_a_database_that_is_none_is_refused_by_name(tmp_path: Path) -> None:
    (tmp_path / FILE).write_text("no database, but a text of some length" * 30)
    with pytest.raises(SigningError, match=f"{FILE}, which keeps the timestamps .* not a database"):
        TimestampStore(tmp_path)


def test_the_database_is_for_its_owner_and_does_not_have_the_key(tmp_path: Path) -> None:
    store = TimestampStore(tmp_path)
    keep(store, Timestamps(store, "fingerprint", Clock()))
    store.close()
    assert (tmp_path / FILE).stat().st_mode & 0o777 == 0o600
    with sqlite3.connect(tmp_path / FILE) as database:
        assert database.execute("SELECT key FROM reserved").fetchall() == [("fingerprint",)]
