"""A run is the same at any moment, through snapshots and through all of its records."""

import asyncio
import json
import random
from collections.abc import Callable
from contextlib import AsyncExitStack
from pathlib import Path
from typing import Any

import msgspec
import pytest
from m2pem_plugin_web.replay.files import IndexFiles
from m2pem_plugin_web.replay.index import Index, IndexBuilder, Stop, bars, with_overview
from m2pem_plugin_web.replay.replay import Replay, state_of
from m2pem_plugin_web.replay.replays import Making, Recordings, Replays
from m2pem_plugin_web.replay.source import JournalSource, ListSource
from m2pem_plugin_web.replay.spans import Span, SpanFolder, SpanWindow
from m2pem_plugin_web.rest.record_pages import new_view, page_of
from test_web_telemetry import begun
from web_replayed import FIXTURE, RUNS, fixture, looping, rehearsed, run_of
from web_world import MakeWorld

from m2pem.api import (
    MissionControl,
    RunStatus,
    RunSummary,
    RunView,
    SimulationResult,
    StampedRecord,
)
from m2pem.api import records as r

PAGE = 7
"""Records of a page: short runs have many, too."""


def builder_of(
    result: SimulationResult, count: int, page: int = PAGE
) -> tuple[IndexBuilder, RunView]:
    """What has indexed the first records of a run."""
    view, builder = new_view(result.summary), IndexBuilder(result.summary.run, page)
    for stamped in result.records[:count]:
        view.apply(stamped)
        builder.add(view, stamped)
    return builder, view


async def replay_of(result: SimulationResult, known: Index | None = None) -> Replay:
    if known is None:
        builder, view = builder_of(result, len(result.records))
        known = with_overview(builder.index(view))
    return await Replay.open(ListSource(result.summary, result.records), known, lambda _: None)


def pages_through_all(result: SimulationResult) -> list[dict[str, Any]]:
    """Each record with what it changes, by applying all of them in turn."""
    content = page_of(result.records, new_view(result.summary), len(result.records))
    found: list[dict[str, Any]] = json.loads(content)["records"]
    return found


async def test_stops_of_a_debugged_run_are_kept_with_their_records() -> None:
    at_a = r.BreakpointsSet(("A",))
    stop = r.BreakpointReached(r.StopReason.BREAKPOINT, 1, "P", "A", 1)
    facts = [at_a, stop, r.RunPaused(5, "anna"), r.RunResumed(9), *[stop, r.RunResumed(9)] * 300]
    records = [StampedRecord("r1", seq, seq / 2, each) for seq, each in enumerate(facts, 1)]
    summary = RunSummary("r1", "m.bpmn", "P", RunStatus.STOPPED, 0, records=len(records))
    result = SimulationResult(summary, records, (), None)
    replay = await replay_of(result)
    expected = Stop(2, 1.0, r.StopReason.BREAKPOINT, "P", "A", "")
    assert replay.head()["stops"][0] == expected
    assert len(replay.head()["stops"]) == 301
    known, _ = builder_of(result, 100)
    half = known.index(new_view(summary))
    builder, _view = IndexBuilder.resumed(half, None)
    assert builder.index(new_view(summary)).stops == [each for each in half.stops if each.seq <= 84]
    page = json.loads(await replay.page(0))
    assert page["view"]["debugging"] is None
    changes = [each.get("changes", {}).get("debugging", "same") for each in page["records"]]
    assert changes[0]["elements"] == ["A"]
    assert changes[1]["reached"]["element"] == "A"
    assert (changes[2], changes[3]["reached"]) == ("same", None)


@pytest.mark.parametrize("name", RUNS)
async def test_any_page_is_as_if_all_records_before_it_had_been_applied(name: str) -> None:
    result = rehearsed(name)
    replay = await replay_of(result)
    records = pages_through_all(result)
    count = len(records)
    chance = random.Random(name)
    numbers = [0, (count - 1) // PAGE, *(chance.randrange(0, count // PAGE) for _ in range(8))]
    for number in numbers:
        page = json.loads(await replay.page(number))
        start = number * PAGE
        assert page["records"] == records[start : start + PAGE]
        view = new_view(result.summary)
        for stamped in result.records[:start]:
            view.apply(stamped)
        assert page["view"] == json.loads(msgspec.json.encode(state_of(view)))


@pytest.mark.parametrize("name", RUNS)
async def test_an_index_that_is_gone_on_with_is_as_one_that_was_made_at_once(name: str) -> None:
    result = rehearsed(name)
    whole = (await replay_of(result)).index
    chance = random.Random(name)
    for count in {0, 1, len(result.records) - 1, chance.randrange(len(result.records))}:
        builder, view = builder_of(result, count)
        gone_on = (await replay_of(result, builder.index(view))).index
        assert msgspec.to_builtins(gone_on) == msgspec.to_builtins(whole), count


@pytest.mark.parametrize("name", RUNS)
async def test_the_bars_of_a_window_are_those_of_all_records(name: str) -> None:
    result = rehearsed(name)
    folder = SpanFolder()
    for stamped in result.records:
        folder.add(stamped)
    every = [*folder.finished, *(each for key in folder.going_on.open.values() for each in key)]
    assert every
    index = (await replay_of(result)).index
    assert sorted(index.rows) == sorted({each.row for each in every})
    for from_s, to_s in ((0.0, index.t_s), (index.t_s / 3, index.t_s / 2), (0.0, 0.0)):
        found, is_thinned = bars(index, from_s, to_s)
        expected = [
            each for each in every if each.from_ <= to_s and (each.to is None or each.to >= from_s)
        ]
        assert not is_thinned
        assert sorted(map(repr, found)) == sorted(map(repr, expected))
    assert sorted(map(repr, index.overview)) == sorted(map(repr, every))


def bar(number: int, from_s: float, to_s: float | None, end: str = "succeeded") -> Span:
    return Span(f"behavior:b{number}:v1", "behavior", "v1", "goto", "P", "Go", from_s, to_s, end)


def test_many_short_bars_are_merged_and_counted_and_long_ones_are_kept() -> None:
    short = [bar(number, number, number + 0.5) for number in range(10_000)]
    short[5_000].end = "failed"
    long = bar(-1, 100.0, 5_000.0)
    open_ = bar(-2, 9_000.0, None, "")
    window = SpanWindow(0.0, 10_000.0, 200)
    for start in range(0, len(short), 100):
        window.add(short[start : start + 100])
    window.add([long, open_])
    found = window.result()
    assert window.is_thinned
    assert len(found) <= 200
    assert long in found and open_ in found
    assert sum(each.count for each in found) == 10_002
    assert [each.count for each in found if each.end == "failed"] != [1]
    assert sum(each.end == "failed" for each in found) == 1
    assert [each.from_ for each in found] == sorted(each.from_ for each in found)
    # A smaller window has them one by one.
    close = SpanWindow(4_990.0, 5_010.0, 200)
    close.add(short)
    assert [each.count for each in close.result()] == [1] * 21
    assert not close.is_thinned


def test_more_bars_that_go_on_than_are_drawn_are_all_kept() -> None:
    window = SpanWindow(0.0, 100.0, 10)
    window.add(bar(number, 1.0, None, "") for number in range(100))
    assert len(window.result()) == 100


async def test_records_within_a_long_input_are_found(world: MakeWorld) -> None:
    async with world() as here:
        run = await run_of(here.control, looping(2000))
        (summary,) = [each for each in await here.control.runs() if each.run == run]
        every: list[StampedRecord] = []
        while page := await here.control.records(run, len(every)):
            every += page
        source = JournalSource(here.control, summary)
        chance = random.Random(1)
        for _ in range(20):
            after = chance.randrange(len(every))
            last = min(len(every), after + chance.randrange(1, 3000))
            assert await source.between(after, last) == every[after:last]


async def read(browser: Any, path: str) -> Any:
    answer = await browser.http.get(path)
    assert answer.status_code == 200, answer.text
    return answer.json()


async def ready(browser: Any, run: str) -> Any:
    async with asyncio.timeout(60):
        while (head := await read(browser, f"/api/runs/{run}/replay"))["state"] == "making":
            assert 0 <= head["done"] <= head["records"]
    return head


async def test_an_ended_run_is_replayed_over_http(world: MakeWorld) -> None:
    async with world() as here:
        run = await run_of(here.control, looping(2000))
        browser = await here.browser()
        head = await ready(browser, run)
        assert head["records"] > 10_000
        assert len(head["times"]) == head["records"] // head["page"]
        records, after = [], 0
        while after is not None:
            page = await read(browser, f"/api/runs/{run}/records?after={after}&limit=5000")
            records += page["records"]
            after = page["next"]
        for number in (0, 3, 4, 6, 5, head["records"] // head["page"]):
            page = await read(browser, f"/api/runs/{run}/replay/pages/{number}")
            start = number * head["page"]
            assert page["records"] == records[start : start + head["page"]], number
            assert page["view"]["seq"] == start
        none = await browser.http.get(f"/api/runs/{run}/replay/pages/1000000")
        assert none.status_code == 404
        assert "has no page 1000000" in none.json()["detail"]
        assert (await browser.http.get("/api/runs/r99/replay")).status_code == 404


async def test_a_run_that_goes_on_cannot_be_replayed(world: MakeWorld) -> None:
    async with world() as here:
        prompt = await here.asked()
        browser = await here.browser()
        for path in ("", "/pages/0", "/spans"):
            refused = await browser.http.get(f"/api/runs/{prompt.run}/replay{path}")
            assert refused.status_code == 409
            assert "goes on" in refused.json()["detail"]
        await here.control.answer(prompt.run, prompt.prompt, "abort", by="anna")
        await here.control.wait(prompt.run)
        head = await ready(browser, prompt.run)
        (answered,) = head["notable"]
        assert (answered["record"], answered["by"]) == ("PromptAnswered", "anna")
        (asked,) = (await read(browser, f"/api/runs/{prompt.run}/replay/spans"))["spans"]
        assert asked == head["spans"][0]
        assert (asked["row"], asked["end"]) == ("prompts", "succeeded")


def index_of(result: SimulationResult) -> Index:
    builder, view = builder_of(result, len(result.records))
    return with_overview(builder.index(view))


def test_a_file_that_is_damaged_or_of_another_run_is_as_none(tmp_path: Path) -> None:
    index = index_of(rehearsed("detection"))
    files = IndexFiles(tmp_path / "journal.db")
    assert files.read("r1", index.started_us) is None
    files.write(index)
    path = tmp_path / "journal.db-replays" / "r1.index"
    assert (path.stat().st_mode & 0o777, path.parent.stat().st_mode & 0o777) == (0o600, 0o700)
    assert msgspec.to_builtins(files.read("r1", index.started_us)) == msgspec.to_builtins(index)
    assert files.read("r1", index.started_us + 1) is None
    content = path.read_bytes()
    for damaged in (
        b"",
        content[:-1],
        content[:200],
        content.replace(b"of m2pem", b"of other"),
        content[:-20] + b"x" + content[-19:],
    ):
        path.write_bytes(damaged)
        assert files.read("r1", index.started_us) is None
    files.write(index)
    files.keep_only([("r1", index.started_us)])
    assert path.exists()
    files.keep_only([("r1", index.started_us + 1)])
    assert not path.exists()


async def opened(replays: Replays, summary: RunSummary) -> Replay:
    async with asyncio.timeout(60):
        while isinstance(replay := await replays.of_run(summary), Making):
            pass
    return replay


async def summary_of(control: MissionControl, run: str) -> RunSummary:
    (summary,) = [each for each in await control.runs() if each.run == run]
    return summary


async def until(condition: Callable[[], bool]) -> None:
    async with asyncio.timeout(60):
        while not condition():  # noqa: ASYNC110  # no file says when it is there
            await asyncio.sleep(0.02)


async def contents(replay: Replay) -> Any:
    """All that pages are sent of a replay."""
    last = replay.index.seq // replay.index.page
    pages = [await replay.page(number) for number in range(last + 1)]
    return msgspec.json.encode(replay.head()), pages


async def test_an_index_is_written_at_the_end_of_a_run_and_made_again_where_it_is_missing(
    tmp_path: Path,
) -> None:
    path = tmp_path / "journal.db-replays"
    async with AsyncExitStack() as stack:
        first = await begun(stack, tmp_path)
        run = await run_of(first.control, looping(2000))
        await until((path / f"{run}.index").exists)
        summary = await summary_of(first.control, run)
    written = IndexFiles(tmp_path / "journal.db").read(run, summary.started_us)
    assert written is not None and written.seq == summary.records
    async with AsyncExitStack() as stack:
        second = await begun(stack, tmp_path)
        kept = await opened(Replays(second.control), summary)
        assert msgspec.to_builtins(kept.index) == msgspec.to_builtins(written)
        expected = await contents(kept)
        (path / f"{run}.index").unlink()
        made = await opened(Replays(second.control), summary)
        assert await contents(made) == expected
        assert (path / f"{run}.index").exists()
        browser = await second.browser()
        assert (await ready(browser, run))["records"] == summary.records
        gone = path / "r77.index"
        gone.write_bytes((path / f"{run}.index").read_bytes())
    async with AsyncExitStack() as stack:
        await begun(stack, tmp_path)
        await until(lambda: not gone.exists())


async def test_the_index_of_a_run_with_records_after_its_end_is_gone_on_with(
    tmp_path: Path,
) -> None:
    async with AsyncExitStack() as stack:
        here = await begun(stack, tmp_path)
        run = await run_of(here.control, looping(1500))
        summary = await summary_of(here.control, run)
        whole = await opened(Replays(here.control), summary)
        recordings = Recordings()
        view = new_view(summary, whole.mission)
        for stamped in await whole.source.between(0, 5500):
            view.apply(stamped)
            recordings.recorded(view, stamped)
        replays = Replays(here.control)
        replays.recordings = recordings
        (tmp_path / "journal.db-replays" / f"{run}.index").unlink(missing_ok=True)
        again = await opened(replays, summary)
        assert await contents(again) == await contents(whole)


async def test_the_pages_own_tests_have_what_the_server_sends() -> None:
    """`python tests/web_replayed.py` writes it."""
    assert await asyncio.to_thread(FIXTURE.read_text, encoding="utf-8") == await fixture()
