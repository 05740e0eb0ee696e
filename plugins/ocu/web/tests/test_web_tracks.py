"""What is kept of where vehicles were, and what becomes of it when files are torn or disks full."""

import errno
import json
import math
import os
from itertools import pairwise
from pathlib import Path
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from m2pem_plugin_web.tracks.stores import FolderStore, HeldError, MemoryStore, TrackStore
from m2pem_plugin_web.tracks.thinning import Sample, Thinner, differs, thinned
from m2pem_plugin_web.tracks.track import Head, Track, page_of

from m2pem.api import GeoPosition, LinkState, PayloadState, VehicleState
from m2pem.mission.catalogue import ResourceId

HEAD = Head("r1", 1_000)
M = 1 / 111_320.0
"""Degrees of latitude."""

Steps = st.lists(
    st.tuples(
        st.floats(0, 3),
        st.floats(-3, 3),
        st.floats(-math.pi, math.pi),
        st.sampled_from(("hold", "drive")),
        st.floats(0, 1),
        st.sampled_from(LinkState),
    ),
    max_size=60,
)


def at(north_m: float = 0.0, **more: Any) -> VehicleState:
    return VehicleState(ResourceId("v"), 0, GeoPosition(38 + north_m * M, -77, 60), **more)


def sample(t_s: float, north_m: float, *, who: str = "v") -> Sample:
    state = VehicleState(ResourceId(who), 0, at(north_m).position)
    return Sample(t_s, {who: msgspec.Raw(msgspec.json.encode(state))}, {})


def north_of(each: Any) -> float:
    state = json.loads(bytes(each.vehicles["v"]))
    return round((state["position"]["latitude_deg"] - 38) / M, 1)


@pytest.fixture(params=["folder", "memory"])
def store(request: pytest.FixtureRequest, tmp_path: Path) -> TrackStore:
    return (
        FolderStore(tmp_path / "tracks", 20_000)
        if request.param == "folder"
        else MemoryStore(2, 20_000)
    )


@pytest.fixture
def folder(tmp_path: Path) -> FolderStore:
    return FolderStore(tmp_path / "tracks")


def written(store: TrackStore, *samples: Sample, now_s: float = math.inf) -> Track:
    track = Track(store, HEAD, now_s)
    track.append(samples)
    return track


def kept(store: TrackStore, after_s: float | None = None, limit: int = 1000) -> list[Sample]:
    return list(page_of(store, "r1", HEAD.started_us, after_s, limit).samples)


# --- what says something ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("now", "news"),
    [
        (at(0.4), False),
        (at(0.6), True),
        (at(yaw_rad=math.radians(4)), True),  # it was not known
        (at(mode="drive"), True),
        (at(link=LinkState.LOST), True),
        (at(battery_fraction=0.5), True),
        (at(armed=True, behavior="b1"), False),
        (at(velocity_enu_m_s=(1.0, 0.0, 0.0)), True),  # it was not known
        (VehicleState(ResourceId("v"), 9, None), True),
    ],
)
def test_only_news_are_kept(now: VehicleState, news: bool) -> None:
    assert differs(at(), now) is news


def test_a_turn_counts_from_five_degrees_on_also_across_the_cut() -> None:
    west, nearly = at(yaw_rad=math.radians(179)), at(yaw_rad=math.radians(-177))
    assert not differs(west, nearly)
    assert differs(west, at(yaw_rad=math.radians(-175)))
    assert not differs(at(yaw_rad=math.nan), at(yaw_rad=math.inf))
    assert differs(at(yaw_rad=0.0), at(yaw_rad=math.nan))


def test_the_antimeridian_is_no_distance() -> None:
    def here(longitude: float) -> VehicleState:
        return VehicleState(ResourceId("v"), 0, GeoPosition(0, longitude, 0))

    assert not differs(here(180.0), here(-180.0))
    assert differs(here(179.99), here(-179.99))


def test_a_battery_counts_by_whole_percents() -> None:
    assert not differs(at(battery_fraction=0.501), at(battery_fraction=0.504))
    assert differs(at(battery_fraction=0.504), at(battery_fraction=0.494))


def test_what_is_plotted_counts_as_news() -> None:
    assert not differs(at(velocity_enu_m_s=(3.0, 4.0, 0.0)), at(velocity_enu_m_s=(4.0, 3.0, 0.2)))
    assert differs(at(velocity_enu_m_s=(3.0, 4.0, 0.0)), at(velocity_enu_m_s=(0.0, 4.0, 0.0)))
    assert differs(at(velocity_enu_m_s=(0.0, 0.0, 0.0)), at())
    assert not differs(at(altitude_above_home_m=10.0), at(altitude_above_home_m=10.4))
    assert differs(at(altitude_above_home_m=10.0), at(altitude_above_home_m=11.0))
    assert differs(at(), at(pitch_rad=0.2))
    assert differs(at(roll_rad=-0.2), at())


def test_a_camera_says_something_when_it_looks_elsewhere() -> None:
    def camera(**more: Any) -> PayloadState:
        return PayloadState(ResourceId("v/c"), 0, **more)

    corners = (GeoPosition(38, -77, 0), GeoPosition(38, -77.001, 0))
    moved = (GeoPosition(38 + M, -77, 0), GeoPosition(38, -77.001, 0))
    assert not differs(camera(pan_rad=0.0, zoom=1.0), camera(pan_rad=0.05, zoom=1.01))
    assert differs(camera(pan_rad=0.0), camera(pan_rad=0.1))
    assert differs(camera(zoom=1.0), camera(zoom=2.0))
    assert differs(camera(footprint=corners), camera(footprint=moved))
    assert differs(camera(), camera(footprint=corners))


@given(Steps)
def test_no_two_states_are_nearer_than_the_spacing_and_none_is_missed(steps: Any) -> None:
    thinner, t_s, north_m = Thinner(), 0.0, 0.0
    kept: list[tuple[float, VehicleState]] = []
    for passed_s, moved_m, yaw, mode, battery, link in steps:
        t_s, north_m = t_s + passed_s, north_m + moved_m
        now = at(north_m, yaw_rad=yaw, mode=mode, battery_fraction=battery, link=link)
        if thinner.wants(t_s, now):
            thinner.keep(t_s, now)
            if kept:
                assert t_s - kept[-1][0] >= 1.0 and differs(kept[-1][1], now)
            kept.append((t_s, now))
        else:
            assert t_s - kept[-1][0] < 1.0 or not differs(kept[-1][1], now)


# --- fewer of them ------------------------------------------------------------------------------


@given(st.lists(st.floats(1.0, 90.0), max_size=80), st.sampled_from((2.0, 4.0, 64.0)))
def test_fewer_samples_leave_vehicles_where_they_came_to_rest(
    gaps: list[float], spacing_s: float
) -> None:
    times = [sum(gaps[:count]) for count in range(1, len(gaps) + 1)]
    samples = [sample(t_s, float(number)) for number, t_s in enumerate(times)]
    fewer = thinned(samples, spacing_s)
    left = [each.t for each in fewer]
    assert left == sorted(left) and set(left) <= set(times)
    assert left[:1] == times[:1] and left[-1:] == times[-1:]
    for first, _, third in zip(left, left[1:], left[2:], strict=False):
        assert third - first > spacing_s
    for each in samples:  # at no time is it shown where it was long ago
        shown = max(t_s for t_s in left if t_s <= each.t)
        assert each.t - shown <= spacing_s


def test_a_vehicle_that_rests_is_kept_beside_one_that_moves() -> None:
    samples = [sample(0.0, 0.0, who="still")]
    samples += [sample(float(t_s), float(t_s)) for t_s in range(100)]
    fewer = thinned(samples, 10.0)
    assert [each.t for each in fewer if "still" in each.vehicles] == [0.0]
    assert 10 <= len([each for each in fewer if "v" in each.vehicles]) <= 12


def test_a_track_that_is_too_large_doubles_its_spacing(store: TrackStore) -> None:
    track = Track(store, HEAD, 0.0)
    for t_s in range(1000):
        track.append([sample(float(t_s), float(t_s))])
        assert len(store.read("r1")) <= store.most_bytes
    assert track.thinner.spacing_s > 1.0
    left = kept(store)
    assert left[0].t == 0.0 and left[-1].t == 999.0
    assert all(b.t - a.t <= 2 * track.thinner.spacing_s for a, b in pairwise(left))
    again = track.thinner.spacing_s
    track.close()
    assert Track(store, HEAD, 1000.0).thinner.spacing_s == again


# --- files --------------------------------------------------------------------------------------


def test_a_track_goes_on_after_a_restart(store: TrackStore) -> None:
    written(store, sample(0.0, 0.0), sample(1.0, 1.0)).close()
    track = Track(store, HEAD, 2.0)
    assert not track.is_new
    assert not track.thinner.wants(5.0, VehicleState(ResourceId("v"), 7, at(1.2).position))
    assert track.thinner.wants(5.0, VehicleState(ResourceId("v"), 7, at(2.0).position))
    track.append([sample(5.0, 2.0)])
    assert [north_of(each) for each in kept(store)] == [0.0, 1.0, 2.0]


def test_a_past_that_did_not_come_about_is_dropped(store: TrackStore) -> None:
    written(store, sample(0.0, 0.0), sample(4.0, 4.0)).close()
    track = Track(store, HEAD, 3.0)
    track.append([sample(3.0, 1.0)])
    assert [(each.t, north_of(each)) for each in kept(store)] == [(0.0, 0.0), (3.0, 1.0)]


def test_a_track_of_another_journals_run_is_not_shown_and_gives_way(store: TrackStore) -> None:
    written(store, sample(0.0, 0.0)).close()
    assert page_of(store, "r1", 2_000, None, 10).samples == ()
    Track(store, Head("r1", 2_000), 5.0)
    assert kept(store) == []


@given(st.data())
def test_what_a_crash_has_torn_is_not_there(data: Any) -> None:
    store = MemoryStore()
    samples = [sample(float(t_s), float(t_s)) for t_s in range(5)]
    written(store, *samples)
    whole = store.read("r1")
    cut = data.draw(st.integers(0, len(whole)))
    store.open("r1").replace(whole[:cut])
    left = whole[:cut].count(b"\n") - 1
    assert kept(store) == samples[: max(0, left)]
    track = Track(store, HEAD, math.inf)
    track.append([sample(9.0, 9.0)])
    assert kept(store) == [*samples[: max(0, left)], sample(9.0, 9.0)]


@given(st.binary(max_size=300), st.integers(0, 400))
def test_damage_takes_no_more_than_what_it_hit(damage: bytes, where: int) -> None:
    store = MemoryStore()
    written(store, *(sample(float(t_s), float(t_s)) for t_s in range(8)))
    text = bytearray(store.read("r1"))
    text[where : where + len(damage)] = damage
    store.open("r1").replace(bytes(text))
    for each in kept(store):
        assert isinstance(each, Sample)
    written(store, sample(9.0, 9.0)).close()
    assert kept(store)[-1] == sample(9.0, 9.0)


def test_pages_hold_all_of_a_moment_together(store: TrackStore) -> None:
    two = [sample(1.0, 1.0), sample(1.0, 1.0, who="w")]
    written(store, sample(0.0, 0.0), *two, sample(2.0, 2.0))
    pages, after_s = [], None
    while True:
        page = page_of(store, "r1", HEAD.started_us, after_s, 2)
        pages.append([each.t for each in page.samples])
        if (after_s := page.after) is None:
            break
    assert pages == [[0.0, 1.0, 1.0], [2.0]]


def test_files_are_their_owners_alone_and_of_runs_alone(
    folder: FolderStore, tmp_path: Path
) -> None:
    written(folder, sample(0.0, 0.0))
    path = tmp_path / "tracks" / "r1.jsonl"
    assert path.stat().st_mode & 0o777 == 0o600
    assert path.parent.stat().st_mode & 0o777 == 0o700
    for name in ("../r1", "r1/../r2", "", "r0", "r01", "R1", "r1\n", "/r1", "r" + "9" * 30):
        with pytest.raises(OSError, match="is not the id of a run"):
            folder.read(name)
        with pytest.raises(OSError, match="is not the id of a run"):
            folder.remove(name)
    (path.parent / "notes.jsonl").touch()
    assert list(folder.runs()) == ["r1"]


def test_a_link_is_not_followed(folder: FolderStore, tmp_path: Path) -> None:
    (tmp_path / "tracks").mkdir()
    precious = tmp_path / "precious"
    precious.write_text("do not touch")
    (tmp_path / "tracks" / "r1.jsonl").symlink_to(precious)
    with pytest.raises(OSError, match="r1"):
        Track(folder, HEAD, 0.0)
    assert precious.read_text() == "do not touch"


def test_one_executive_writes_a_track_and_others_leave_it(folder: FolderStore) -> None:
    first = written(folder, sample(0.0, 0.0))
    with pytest.raises(HeldError):
        Track(folder, HEAD, 0.0)
    first.close()
    Track(folder, HEAD, 0.0).close()


def test_a_full_disk_takes_nothing_back_that_was_there(
    folder: FolderStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    track = written(folder, sample(0.0, 0.0))
    write = os.write

    def full(descriptor: int, text: bytes) -> int:
        if len(text) > 10:
            return write(descriptor, bytes(text)[:10])
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(os, "write", full)
        with pytest.raises(OSError, match="No space"):
            track.append([sample(1.0, 1.0)])
    track.append([sample(2.0, 2.0)])
    assert [each.t for each in kept(folder)] == [0.0, 2.0]


def test_memory_forgets_the_oldest_runs() -> None:
    store = MemoryStore(most=2)
    for run in ("r1", "r2", "r3"):
        Track(store, Head(run, 1), 0.0)
    assert list(store.runs()) == ["r2", "r3"]
