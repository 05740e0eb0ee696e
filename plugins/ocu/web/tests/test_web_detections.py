"""What payloads detect during a run: in its track, in messages to pages, and counted when many."""

import asyncio
import math
from contextlib import AsyncExitStack
from pathlib import Path
from typing import Any

import msgspec
from m2pem_plugin_web.tracks.detections import LONGEST_TEXT, MOST_DETECTIONS, Found, Numbering
from m2pem_plugin_web.tracks.stores import MemoryStore
from m2pem_plugin_web.tracks.thinning import Sample
from m2pem_plugin_web.tracks.track import Head, Track, page_of
from test_web_telemetry import track_of, tracked
from web_world import PLUGINS, SPEED, World, serving

from m2pem.api import Detection, GeoPosition
from m2pem.api.clock import SystemClock
from m2pem.executive.executive import Executive
from m2pem.fleet.fleet_file import load_fleet
from m2pem.journal import Journal, MemoryJournal
from m2pem.mission.catalogue import ResourceId
from m2pem.testing import scenarios

HEAD = Head("r1", 1_000)
RADAR = ResourceId("ugv1/radar")
HERE = GeoPosition(38.1, -77.3, 60.0)

FLEET = """
version: 1
name: detectors
origin: {{lat: 38.1075, lon: -77.3192, alt: 60}}
vehicles:
  ugv1:
    domain: ground
    arbiter: sim
    connection: {{home: [38.1075, -77.3192], heading: 0 deg}}
    payloads:
      radar:
        detector: true
        connection: {{kind: gpr, range: 5 m, {finds}}}{more}
"""
BEHIND = """targets: [
  {type: mine, position: [38.1073, -77.3192]}, {type: man, position: [38.1069, -77.3192]}]"""
"""It finds them while it reverses."""
LATER = "detections: [{at: 150 s, type: mine}]"
"""The time is that of the simulation: the page is served and the run has begun by then."""
WAITING = scenarios.service("Detector")
"""It ends with the first detection."""
LONG = scenarios.one_behavior("reverse", "ugv1", distance="5 km")


def detection(kind: str = "mine") -> Detection:
    return Detection(kind, RADAR, HERE, 7)


def entered(numbering: Numbering, t_s: float, *found: Detection) -> Sample:
    waiting = Found()
    for each in found:
        waiting.add(each)
    entries, more = numbering.enter(t_s, waiting)
    return Sample(t_s, {}, {}, entries, more)


async def detecting(
    stack: AsyncExitStack,
    folder: Path,
    finds: str = BEHIND,
    more: str = "",
    journal: Journal | None = None,
) -> World:
    """An executive with a detector. `more`: other payloads of its vehicle."""
    path = folder / "detectors.yaml"
    path.write_text(FLEET.format(finds=finds, more=more), "utf-8")
    clock = SystemClock(SPEED)
    running = await stack.enter_async_context(
        Executive(load_fleet(path), journal or MemoryJournal(), PLUGINS, clock, speed=SPEED)
    )
    return await stack.enter_async_context(serving(running.control, folder, {}))


def detections_of(samples: list[dict[str, Any]]) -> list[dict[str, Any]]:
    return [entry for sample in samples for entry in sample.get("detections", ())]


async def test_detections_are_in_the_track_and_sent_to_those_who_watch(tmp_path: Path) -> None:
    async with AsyncExitStack() as stack:
        world = await detecting(stack, tmp_path)
        browser = await world.browser()
        run = await world.control.start(LONG)
        await world.control.pause(run)
        live, other = await browser.live(), await browser.live()
        await live.watch(run)
        await other.watch(None)
        await world.control.resume(run)
        first = await live.until(lambda message: message["type"] == "detections")
        assert first["run"] == run
        assert first["more"] == 0
        [mine] = first["detections"]
        assert (mine["number"], mine["type"], mine["source"]) == (1, "mine", "ugv1/radar")
        assert mine["position"]["latitude_deg"] == 38.1073
        samples = await tracked(browser, run, lambda found: len(detections_of(found)) == 2)
        assert detections_of(samples)[0] == mine
        assert [each["type"] for each in detections_of(samples)] == ["mine", "man"]
        times = [each["t_s"] for each in detections_of(samples)]
        assert 0 < times[0] < times[1]
        # Nothing is sent to those who do not watch the run.
        assert all(message["type"] != "detections" for message in other.said)
        await world.control.stop(run)


async def test_the_detection_that_ends_a_run_is_in_its_track(tmp_path: Path) -> None:
    async with AsyncExitStack() as stack:
        world = await detecting(stack, tmp_path, LATER)
        run = await world.control.start(WAITING)
        async with asyncio.timeout(30):
            await world.control.wait(run)
        browser = await world.browser()
        samples = await tracked(browser, run, lambda found: len(detections_of(found)) > 0)
        [mine] = detections_of(samples)
        assert mine["type"] == "mine"
        assert await track_of(browser, run, limit=1) == samples


def test_what_is_too_much_is_counted() -> None:
    numbering = Numbering()
    sample = entered(numbering, 1.0, *[detection()] * (MOST_DETECTIONS - 1))
    assert (len(sample.detections), sample.more_detections) == (MOST_DETECTIONS - 1, 0)
    sample = entered(numbering, 2.0, *[detection()] * 3)
    assert [each.number for each in sample.detections] == [MOST_DETECTIONS]
    assert sample.more_detections == numbering.more == 2
    waiting = Found()
    for _ in range(MOST_DETECTIONS + 5):
        waiting.add(detection())
    assert numbering.enter(3.0, waiting) == ([], MOST_DETECTIONS + 5)
    assert numbering.more == MOST_DETECTIONS + 7


def test_long_texts_of_devices_are_cut() -> None:
    [entry] = entered(Numbering(), 1.0, detection("x" * 10_000)).detections
    assert len(entry.type) == LONGEST_TEXT


def test_thinning_keeps_every_detection_and_the_count() -> None:
    store = MemoryStore(2, 20_000)
    track = Track(store, HEAD, math.inf)
    for t_s in range(60):
        sample = entered(track.numbering, float(t_s), detection())
        track.append(
            [Sample(sample.t, {"v": msgspec.Raw(b'"' + b"x" * 400 + b'"')}, {}, sample.detections)]
        )
    track.append([Sample(60.0, {}, {}, (), 5)])
    track.append([Sample(61.0, {"v": msgspec.Raw(b"{}")}, {}, (), 2)])
    track.close()
    samples = page_of(store, "r1", HEAD.started_us, None, 1000).samples
    assert len([each for each in samples if each.vehicles]) < 60
    entries = [entry for each in samples for entry in each.detections]
    assert [entry.number for entry in entries] == list(range(1, 61))
    assert sum(each.more_detections for each in samples) == 7
    again = Track(store, HEAD, math.inf)
    assert (again.numbering.last, again.numbering.more) == (60, 7)


def test_tracks_of_before_have_no_detections() -> None:
    store = MemoryStore()
    text = store.open("r1")
    text.append(
        b'{"run":"r1","started_us":1000,"spacing_s":1.0}\n{"t":1.0,"vehicles":{},"payloads":{}}\n'
    )
    [sample] = page_of(store, "r1", HEAD.started_us, None, 10).samples
    assert (sample.detections, sample.more_detections) == ((), 0)
    assert Track(store, HEAD, 5.0).numbering.last == 0


def test_a_run_that_is_resumed_from_before_a_detection_numbers_it_again() -> None:
    store = MemoryStore()
    track = Track(store, HEAD, math.inf)
    track.append(
        [entered(track.numbering, 1.0, detection()), entered(track.numbering, 9.0, detection())]
    )
    track.close()
    again = Track(store, HEAD, 5.0)
    assert again.numbering.last == 1
