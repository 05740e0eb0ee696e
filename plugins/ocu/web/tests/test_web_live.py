"""What browsers are told over their WebSockets, and at what pace."""

import asyncio
import logging
from collections.abc import Callable, Iterable
from itertools import pairwise
from statistics import median
from typing import Any

import pytest
from m2pem_plugin_web.live import messages
from m2pem_plugin_web.live.hub import FRAME_S, MOST_VIEWERS
from m2pem_plugin_web.live.socket import FULL, SILENT
from m2pem_plugin_web.live.viewer import URGENT, WINDOW, Viewer
from web_world import VEHICLE, Live, MakeWorld, World, serving

from m2pem.api import RunId, RunStatus, StampedRecord, follower
from m2pem.api.records import TokenEntered
from m2pem.testing import scenarios
from m2pem.testing.contracts.ocu_harness import until

QUESTION = scenarios.question("Is the road clear?", ("proceed", "retreat"))
LAPS = b"""<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"
  xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" targetNamespace="t" id="d">
  <process id="Laps" isExecutable="true">
    <startEvent id="Start"/>
    <sequenceFlow id="f0" sourceRef="Start" targetRef="Meet"/>
    <exclusiveGateway id="Meet"/>
    <sequenceFlow id="f1" sourceRef="Meet" targetRef="Lap"/>
    <task id="Lap"/>
    <sequenceFlow id="f2" sourceRef="Lap" targetRef="Wait"/>
    <intermediateCatchEvent id="Wait"><timerEventDefinition id="t">
      <timeDuration xsi:type="tFormalExpression">PT0.2S</timeDuration>
    </timerEventDefinition></intermediateCatchEvent>
    <sequenceFlow id="f3" sourceRef="Wait" targetRef="Meet"/>
  </process>
</definitions>"""
"""Laps without end, 100 in a second."""


async def every_record(here: World, run: RunId) -> list[StampedRecord]:
    """All records of a run, by the journal."""
    records: list[StampedRecord] = []
    while page := await here.control.records(run, records[-1].seq if records else 0):
        records += page
    return records


def entered(records: Iterable[StampedRecord]) -> dict[str, int]:
    """How often each element was entered."""
    hits: dict[str, int] = {}
    for stamped in records:
        if isinstance(stamped.record, TokenEntered):
            hits[stamped.record.element] = hits.get(stamped.record.element, 0) + 1
    return hits


async def counted(here: World, run: RunId) -> dict[str, int]:
    """How often each element was entered, by the journal."""
    return entered(await every_record(here, run))


def hits(live: Live) -> dict[str, int]:
    return {element: state["hits"] for (_, element), state in live.elements().items()}


async def ended(live: Live, run: RunId) -> dict[str, Any]:
    """Wait until a page knows that a run has ended, and all that it did."""
    told = await live.until(
        lambda message: (
            message["type"] == "run"
            and message["run"]["run"] == run
            and RunStatus(message["run"]["status"]).ended
        )
    )
    await live.until(
        lambda message: (
            message.get("run") == run and message["events"] >= told["run"]["records"]
            if message["type"] in ("frame", "snapshot")
            else False
        )
    )
    return told


# --- what is told -------------------------------------------------------------------------------


async def test_a_snapshot_has_all_that_is_known(world: MakeWorld) -> None:
    async with world() as here:
        prompt = await here.asked(QUESTION)
        live = await (await here.browser()).live()
        told = await live.watch(prompt.run)
        assert [each["seq"] for each in live.said] == list(range(1, len(live.said) + 1))
        assert (told["run"], told["status"], told["speed"]) == (prompt.run, "running", 20.0)
        (process,) = told["elements"]
        asking = told["elements"][process][prompt.element]
        assert (asking["active"], asking["hits"], asking["asking"]) == (1, 1, True)
        assert told["prompts"] == [
            {
                "run": prompt.run,
                "prompt": prompt.prompt,
                "process": process,
                "element": prompt.element,
                "text": "Is the road clear?",
                "decisions": [
                    {"value": "proceed", "label": "proceed"},
                    {"value": "retreat", "label": "retreat"},
                ],
                "role": "",
            }
        ]
        assert [each["run"] for each in told["runs"]] == [prompt.run]
        assert told["events"] == len(await here.control.records(prompt.run))


async def test_the_fleet_is_told_of_without_a_run(world: MakeWorld) -> None:
    async with world() as here:
        live = await (await here.browser()).live()
        assert (await live.watch(None))["elements"] == {}
        moved = await live.until(lambda message: VEHICLE in message.get("vehicles", {}))
        assert moved["run"] is None
        assert moved["vehicles"][VEHICLE]["link"] == "connected"
        await live.until(lambda message: VEHICLE in message.get("holders", {}))


async def test_what_a_vehicle_does_and_who_holds_it_is_told(world: MakeWorld) -> None:
    async with world() as here:
        far = f"[{scenarios.ORIGIN[0] + 0.1}, {scenarios.ORIGIN[1]}]"
        run = await here.control.start(scenarios.one_behavior("goto", VEHICLE, target=far))
        live = await (await here.browser()).live()
        await live.watch(run)
        begun = await live.until(lambda message: message.get("commands"))
        (behavior,) = begun["commands"]
        assert begun["commands"][behavior]["resources"] == [VEHICLE]
        await live.until(lambda message: message.get("holders", {}).get(VEHICLE) == behavior)
        await here.control.stop(run)
        await live.until(lambda message: message.get("commands") == {behavior: None})
        await live.until(lambda message: message.get("holders", {}).get(VEHICLE) == "")


async def test_a_prompt_and_its_answer_are_told_to_all(world: MakeWorld) -> None:
    async with world() as here:
        watching = [await (await here.browser()).live() for _ in range(2)]
        for live in watching:
            await live.watch(None)
        prompt = await here.asked(QUESTION)
        for live in watching:
            await live.until(lambda message: message["type"] == "prompt")
        await here.control.answer(prompt.run, prompt.prompt, "retreat", by="ben")
        for live in watching:
            closed = await live.until(lambda message: message["type"] == "prompt_closed")
            assert (closed["decision"], closed["by"]) == ("retreat", "ben")


async def test_several_runs_are_told_apart(world: MakeWorld) -> None:
    async with world() as here:
        first, second = await here.asked(QUESTION), await here.asked(QUESTION)
        one, other = [await (await here.browser()).live() for _ in range(2)]
        await one.watch(first.run)
        await other.watch(second.run)
        await here.control.answer(first.run, first.prompt, "proceed", by="ben")
        assert (await ended(one, first.run))["run"]["status"] == "completed"
        assert other.elements()[next(iter(other.elements()))]["hits"] == 1
        assert [state["asking"] for state in one.elements().values()].count(True) == 0
        assert [state["asking"] for state in other.elements().values()].count(True) == 1
        assert (await one.watch(second.run))["run"] == second.run


async def test_a_run_that_has_ended_can_be_watched(world: MakeWorld) -> None:
    async with world() as here:
        prompt = await here.asked(QUESTION)
        await here.control.stop(prompt.run, reason="enough")
        await here.control.wait(prompt.run)
        told = await (await (await here.browser()).live()).watch(prompt.run)
        assert told["status"] == "stopped"
        (elements,) = told["elements"].values()
        assert {state["active"] for state in elements.values()} == {0}


async def test_a_run_that_is_not_there_is_refused(world: MakeWorld) -> None:
    async with world() as here:
        live = await (await here.browser()).live()
        await live.send(type="watch", run="r99")
        told = await live.until(lambda message: message["type"] == "fault")
        assert "r99" in told["text"]
        assert await live.watch(None)


async def test_what_goes_wrong_is_told_at_once(world: MakeWorld) -> None:
    async with world() as here:
        live = await (await here.browser()).live()
        await live.watch(None)
        await here.control.take(VEHICLE, by="anna")
        run = await here.control.start(
            scenarios.one_behavior("goto", VEHICLE, target=list(scenarios.ORIGIN)),
            even_if_busy=True,
        )
        told = await live.until(lambda message: message["type"] == "fault")
        assert told["text"].startswith(f"{run}: ")


async def test_the_log_has_the_newest_records(world: MakeWorld) -> None:
    async with world() as here:
        prompt = await here.asked(QUESTION)
        live = await (await here.browser()).live()
        await live.watch(prompt.run)
        log = await live.until(lambda message: message["type"] == "log")
        assert [each["seq"] for each in log["records"]] == list(range(1, len(log["records"]) + 1))
        assert log["records"][0]["record"] == "RunStarted"
        before = len(live.said)
        await here.control.answer(prompt.run, prompt.prompt, "retreat", by="ben")
        more = await live.until(lambda message: message["type"] == "log", before)
        assert more["records"][0]["seq"] == log["records"][-1]["seq"] + 1


async def nth_frame(live: Live, n: int) -> None:
    """Wait until a browser has had so many frames."""
    count = 0

    def reached(message: dict[str, Any]) -> bool:
        nonlocal count
        count += message["type"] == "frame"
        return count == n

    await live.until(reached)


# --- at what pace -------------------------------------------------------------------------------


async def test_every_event_is_counted_and_frames_are_bounded(world: MakeWorld) -> None:
    async with world() as here:
        run = await here.control.start(LAPS)
        live = await (await here.browser()).live()
        loop = asyncio.get_running_loop()
        began = loop.time()
        await live.watch(run)
        await live.until(lambda message: message.get("events", 0) > 1000)
        took_s = loop.time() - began
        frames = sum(message["type"] == "frame" for message in live.said)
        assert frames <= took_s / FRAME_S + 2
        await here.control.stop(run)
        await ended(live, run)
        assert hits(live) == await counted(here, run)
        assert live.said[-1]["seq"] == len(live.said)


async def test_each_message_shows_all_that_it_counts(world: MakeWorld) -> None:
    """Records come all the time, and some of what a frame has was encoded for another browser."""
    async with world() as here:
        run = await here.control.start(LAPS)
        lives = [await (await here.browser()).live() for _ in range(3)]
        for live in lives:
            await live.watch(run)
            await live.until(lambda message: message["type"] == "frame")
        for live in lives:
            await nth_frame(live, 4)
        await lives[0].until(lambda message: message.get("events", 0) > 1000)
        await here.control.stop(run)
        for live in lives:
            await ended(live, run)
        records = await every_record(here, run)
        for live in lives:
            hits: dict[str, int] = {}
            frames = [each for each in live.said if each.get("run") == run and "events" in each]
            assert len(frames) > 3
            for frame in frames:
                for elements in frame.get("elements", {}).values():
                    hits |= {name: state["hits"] for name, state in elements.items()}
                assert hits == entered(records[: frame["events"]])


async def test_a_browser_that_acknowledges_nothing_gets_no_more_than_the_window(
    world: MakeWorld,
) -> None:
    async with world() as here:
        run = await here.control.start(LAPS)
        slow = await (await here.browser()).live(acknowledges=False)
        quick = await (await here.browser()).live()
        await slow.watch(run)
        await quick.watch(run)
        await quick.until(lambda message: message.get("events", 0) > 1000)
        paced = [each for each in slow.said if each["type"] in ("snapshot", "frame")]
        assert len(paced) == WINDOW
        # Its next frame has all that was missed, and what is urgent did not wait.
        prompt = await here.asked(QUESTION)
        await slow.until(lambda message: message["type"] == "prompt")
        await here.control.stop(prompt.run)
        await slow.until(lambda message: message["type"] == "prompt_closed")
        await here.control.stop(run)
        await ended(quick, run)
        slow.acknowledges = True
        await slow.send(type="ack", seq=paced[-1]["seq"])
        await ended(slow, run)
        assert hits(slow) == hits(quick) == await counted(here, run)


class Written:
    """A wire that keeps what is written to it."""

    def __init__(self) -> None:
        self.is_writable = True
        self.texts: list[bytes] = []

    def listen(self, received: Callable[[bytes], None], drained: Callable[[], None]) -> None:
        raise AssertionError("no test needs it")

    def write_text(self, head: bytes, rest: bytes) -> None:
        self.texts.append(head + rest)

    def abort(self) -> None:
        raise AssertionError("no test needs it")


async def test_what_is_urgent_goes_before_what_is_paced() -> None:
    wire = Written()
    viewer = Viewer(wire)
    viewer.send_soon(messages.message("prompt"))
    assert not wire.texts, "it has asked for nothing yet, and will get a snapshot"
    viewer.watch(None)
    assert viewer.may_send
    wire.is_writable = False
    for number in range(URGENT):
        viewer.send_soon(messages.message("prompt", number=number))
    assert not viewer.may_send
    assert not viewer.overrun
    viewer.send_soon(messages.message("prompt", number=URGENT))
    assert viewer.overrun
    wire.is_writable = True
    assert not viewer.may_send, "nothing paced overtakes what waits"
    viewer.flush()
    assert viewer.may_send
    assert wire.texts[0] == b'{"type":"prompt","seq":1,"number":0}'
    assert len(wire.texts) == URGENT


async def test_a_browser_that_keeps_no_pace_with_prompts_is_disconnected(
    world: MakeWorld, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("m2pem_plugin_web.live.viewer.URGENT", 10)
    async with world() as here:
        live = await (await here.browser()).live()
        await live.watch(None)
        live.socket.transport.pause_reading()
        hub = here.ocu.hub
        (viewer,) = hub.viewers
        while not viewer.overrun:
            hub.announce("too much " * 10_000)
        assert await until(lambda: not hub.viewers)


async def test_a_browser_that_takes_nothing_in_is_let_go(
    world: MakeWorld, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("m2pem_plugin_web.live.viewer.SILENT_S", 0.2)
    async with world() as here:
        live = await (await here.browser()).live(acknowledges=False)
        await live.watch(None)
        assert await live.until_closed() == SILENT


async def test_a_browser_that_never_reads_holds_up_nobody(
    world: MakeWorld, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("m2pem_plugin_web.live.viewer.SILENT_S", 1.0)
    async with world() as here:
        run = await here.control.start(LAPS)
        browser = await here.browser()
        live = await browser.live()
        stalled = await (await here.browser()).live()
        await stalled.watch(run)
        stalled.socket.transport.pause_reading()
        await live.watch(run)
        assert await until(lambda: len(here.ocu.hub.viewers) == 1)
        await here.control.stop(run)
        await ended(live, run)
        assert hits(live) == await counted(here, run)


async def test_who_comes_again_has_what_was_missed(world: MakeWorld) -> None:
    async with world() as here:
        run = await here.control.start(LAPS)
        browser = await here.browser()
        first = await browser.live()
        await first.watch(run)
        await first.close()
        prompt = await here.asked(QUESTION)
        again = await browser.live()
        told = await again.watch(run)
        assert [each["prompt"] for each in told["prompts"]] == [prompt.prompt]
        await here.control.stop(run)
        await ended(again, run)
        assert hits(again) == await counted(here, run)


async def test_what_came_too_fast_is_counted_from_the_journal(
    world: MakeWorld, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(follower, "BACKLOG", 5)
    monkeypatch.setattr(follower, "RETRY_S", 0.01)
    async with world() as here:
        run = await here.control.start(LAPS)
        live = await (await here.browser()).live()
        await live.watch(run)
        await live.until(lambda message: message.get("events", 0) > 500)
        prompt = await here.asked(QUESTION)
        await live.until(lambda message: message["type"] == "prompt")
        await here.control.answer(prompt.run, prompt.prompt, "retreat", by="ben")
        await live.until(lambda message: message["type"] == "prompt_closed")
        await here.control.stop(run)
        await ended(live, run)
        assert hits(live) == await counted(here, run)
        assert "fell 5 events behind" in caplog.text


async def test_only_so_many_pages_are_served(
    world: MakeWorld, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert MOST_VIEWERS >= 20
    monkeypatch.setattr("m2pem_plugin_web.live.socket.MOST_VIEWERS", 1)
    async with world() as here:
        browser = await here.browser()
        first, second = await browser.live(), await browser.live()
        assert await second.until_closed() == FULL
        assert await first.watch(None)


async def test_a_browser_that_goes_while_it_speaks_and_is_spoken_to_leaves_no_error(
    world: MakeWorld, caplog: pytest.LogCaptureFixture
) -> None:
    async with world() as here:
        live = await (await here.browser()).live()
        await live.watch(None)
        for _ in range(10):
            await live.send(type="watch", run=None)
            here.ocu.hub.announce("something")
        live.socket.transport.abort()
        here.ocu.hub.announce("something more")
        assert await until(lambda: not here.ocu.hub.viewers)
        here.ocu.hub.announce("the last")
    assert not [each for each in caplog.records if each.levelno >= logging.ERROR]


async def test_what_a_browser_sends_in_a_row_is_done_in_order(world: MakeWorld) -> None:
    async with world() as here:
        runs = [(await here.asked(QUESTION)).run for _ in range(3)]
        live = await (await here.browser()).live()
        for run in [*runs, "r99", None, runs[0]]:
            await live.send(type="watch", run=run)
        await live.until(lambda message: message["type"] == "fault" and "r99" in message["text"])
        await live.until(lambda message: message.get("run") == runs[0])


async def test_many_browsers_get_the_same_at_the_pace_that_the_engine_can_bear(
    world: MakeWorld, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("m2pem_plugin_web.live.hub.SHARE", 1e-9)
    monkeypatch.setattr("m2pem_plugin_web.live.hub.SLOWEST_FRAME_S", 0.3)
    async with world() as here:
        run = await here.control.start(LAPS)
        browser = await here.browser()
        lives = [await browser.live() for _ in range(10)]
        for live in lives:
            await live.watch(run)
        for live in lives:
            await nth_frame(live, 6)
            frames = [each["now"] for each in live.said if each["type"] == "frame"]
            # One that is late is followed by one that is not: the pauses between some are shorter.
            assert median(later - now for now, later in pairwise(frames)) > 0.2
        prompt = await here.asked(QUESTION)
        for live in lives:
            await live.until(lambda message: message["type"] == "prompt")
        await here.control.stop(prompt.run)
        await here.control.stop(run)
        for live in lives:
            await ended(live, run)
        truth = await counted(here, run)
        assert all(hits(live) == truth for live in lives)


async def test_two_units_tell_the_same(world: MakeWorld) -> None:
    async with world() as here, serving(here.control, world.folder, {}) as there:
        prompt = await here.asked(QUESTION)
        one, other = [await (await each.browser()).live() for each in (here, there)]
        await one.watch(prompt.run)
        await other.watch(prompt.run)
        answer = await there.browsers[0].http.post(
            f"/api/runs/{prompt.run}/prompts/{prompt.prompt}", json={"decision": "proceed"}
        )
        assert answer.status_code == 204
        late = await here.browsers[0].http.post(
            f"/api/runs/{prompt.run}/prompts/{prompt.prompt}", json={"decision": "retreat"}
        )
        assert late.status_code == 409
        await ended(one, prompt.run)
        await ended(other, prompt.run)
        assert one.elements() == other.elements()
