"""Pictures of what is detected: from cameras that may be slow, broken or hostile."""

import asyncio
import threading
from collections.abc import Callable
from contextlib import AsyncExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from m2pem_plugin_web.tracks import snapshots
from m2pem_plugin_web.tracks.camera_pictures import (
    MOST_BYTES,
    NoPictureError,
    Picture,
    PictureRequest,
    picture_of,
)
from m2pem_plugin_web.tracks.pictures import FolderPictures, FullError, MemoryPictures
from m2pem_plugin_web.tracks.snapshots import Snapshots, camera_of
from test_web_detections import BEHIND, LATER, LONG, WAITING, detecting, detections_of
from test_web_telemetry import tracked
from web_snapshots import (
    JPEG,
    PNG,
    WEBP,
    PictureServer,
    picture_server,
    reading_threads,
)
from web_world import Browser

from m2pem.api import Fleet
from m2pem.fleet.fleet import Video, VideoKind
from m2pem.fleet.fleet_file import load_fleet
from m2pem.journal.sqlite import SqliteJournal
from m2pem.mission.catalogue import ResourceId

AMPLE_S = 60.0
TOO_LARGE = "the picture is larger than 5 MB"
NO_TYPE = "the camera's answer is not a JPEG, PNG or WebP picture"
BROKEN = "the camera's answer broke off, or is not HTTP"
AWAY = "the camera's server redirects to another host or port"

SIX = [ResourceId(f"ugv{each}/camera") for each in range(6)]

FLEET = """
version: 1
name: eyes
origin: {lat: 38.1075, lon: -77.3192}
vehicles:
  ugv1:
    domain: ground
    arbiter: sim
    payloads:
      radar: {connection: {kind: gpr}}
      stream: {connection: {kind: ptz}, video: {url: "http://10.0.0.1/a.m3u8", kind: hls}}
      mast: {connection: {kind: ptz}, video: {url: "http://10.0.0.1/a.jpg", kind: image}}
      rear: {connection: {kind: ptz}, video: {url: "http://10.0.0.1/b", kind: mjpeg}}
  ugv2:
    domain: ground
    arbiter: sim
    payloads:
      radar: {connection: {kind: gpr}}
"""


async def read(server: PictureServer, path: str, kind: VideoKind = VideoKind.IMAGE) -> Picture:
    request = PictureRequest(server.video(path, kind), AMPLE_S)
    async with asyncio.timeout(AMPLE_S):
        return await asyncio.to_thread(request.read)


@pytest.mark.parametrize(
    ("path", "content", "suffix"),
    [
        ("/good", JPEG, "jpg"),
        ("/good?stream=1", JPEG, "jpg"),
        ("/lies", JPEG, "jpg"),
        ("/png", PNG, "png"),
        ("/webp", WEBP, "webp"),
        ("/chunked", JPEG, "jpg"),
        ("/unsaid", JPEG, "jpg"),
        ("/moved", JPEG, "jpg"),
        ("/mjpeg", JPEG, "jpg"),
        ("/mjpeg-hyphens", JPEG, "jpg"),
        ("/mjpeg-unsaid", JPEG, "jpg"),
    ],
)
async def test_a_picture_is_read(path: str, content: bytes, suffix: str) -> None:
    async with picture_server() as server:
        assert await read(server, path) == Picture(content, suffix)


@pytest.mark.parametrize(
    ("path", "why"),
    [
        ("/script", NO_TYPE),
        ("/svg", NO_TYPE),
        ("/empty", NO_TYPE),
        ("/said-huge", TOO_LARGE),
        ("/endless", TOO_LARGE),
        ("/mjpeg-endless", TOO_LARGE),
        ("/short", BROKEN),
        ("/cut", BROKEN),
        ("/noise", BROKEN),
        ("/no-parts", BROKEN),
        ("/closed", "no connection to the camera: it broke off"),
        ("/away", AWAY),
        ("/other-port", AWAY),
        ("/file", AWAY),
        ("/round", "the camera's server redirects too often"),
        ("/missing", "the camera's server answers 404"),
    ],
)
async def test_what_a_bad_camera_answers_is_refused_with_the_reason(path: str, why: str) -> None:
    async with picture_server() as server:
        with pytest.raises(NoPictureError) as refused:
            await read(server, path)
        assert str(refused.value) == why


async def test_a_camera_that_is_not_there_is_said() -> None:
    async with picture_server() as server:
        gone = server.video("/good")
    request = PictureRequest(gone, AMPLE_S)
    with pytest.raises(NoPictureError, match="no connection to the camera: Connection refused"):
        await asyncio.to_thread(request.read)


def test_the_largest_picture_is_taken() -> None:
    assert len(picture_of(JPEG + b"\x00" * (MOST_BYTES - len(JPEG))).content) == MOST_BYTES


@pytest.fixture
def fleet(tmp_path: Path) -> Fleet:
    path = tmp_path / "eyes.yaml"
    path.write_text(FLEET, "utf-8")
    return load_fleet(path)


def test_the_camera_is_the_one_that_detected_or_the_first_of_its_vehicle(fleet: Fleet) -> None:
    for source, camera in {
        "ugv1/rear": "ugv1/rear",
        "ugv1/radar": "ugv1/mast",
        "ugv1/stream": "ugv1/mast",
        "ugv1": "ugv1/mast",
        "ugv2/radar": None,
        "elsewhere": None,
    }.items():
        assert camera_of(fleet, ResourceId(source)) == camera


class Gated(PictureRequest):
    """A request that is answered when its test says so. `begun`: all of them."""

    begun: list["Gated"]

    def __init__(self, video: Video) -> None:
        super().__init__(video, AMPLE_S)
        self.gate = threading.Event()
        self.at_s = asyncio.get_running_loop().time()
        self.begun.append(self)

    def read(self) -> Picture:
        assert self.gate.wait(AMPLE_S)
        return Picture(JPEG, "jpg")

    def abort(self) -> None:
        self.gate.set()


@pytest.fixture
def gated() -> type[Gated]:
    return type("GatedHere", (Gated,), {"begun": []})


async def until(condition: Callable[[], bool]) -> None:
    async with asyncio.timeout(AMPLE_S):
        while True:
            if condition():
                return
            await asyncio.sleep(0.005)


async def test_a_camera_is_asked_once_a_second_and_its_picture_is_shared(
    fleet: Fleet, gated: type[Gated], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(snapshots, "EVERY_S", 0.3)
    cameras = Snapshots(lambda: fleet, gated)
    first, same = cameras.of(ResourceId("ugv1/radar")), cameras.of(ResourceId("ugv1/mast"))
    assert first is not None
    assert same is not None
    assert first.coming is same.coming
    await until(lambda: len(gated.begun) == 1)
    # What is detected now is not in that picture.
    later, latest = cameras.of(ResourceId("ugv1/radar")), cameras.of(ResourceId("ugv1/radar"))
    assert later is not None
    assert latest is not None
    assert later.coming is latest.coming is not first.coming
    gated.begun[0].gate.set()
    assert (await first.coming).picture == Picture(JPEG, "jpg")
    await until(lambda: len(gated.begun) == 2)
    assert gated.begun[1].at_s - gated.begun[0].at_s > 0.25
    gated.begun[1].gate.set()
    assert (await later.coming).picture == Picture(JPEG, "jpg")
    assert cameras.of(ResourceId("ugv2/radar")) is None
    await cameras.close()


async def test_a_few_cameras_are_asked_at_once(
    fleet: Fleet, gated: type[Gated], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(snapshots, "WITHIN_S", AMPLE_S)
    videos = {each: Video("http://x", VideoKind.IMAGE) for each in SIX}
    many = Snapshots(lambda: replace(fleet, videos=videos), gated)
    taken = [many.of(each) for each in SIX]
    await until(lambda: len(gated.begun) == snapshots.MOST_AT_ONCE)
    await until(lambda: reading_threads() == snapshots.MOST_AT_ONCE)
    for number in range(6):
        await until(lambda least=number: len(gated.begun) > least)  # type: ignore[misc]
        gated.begun[number].gate.set()
    for each in taken:
        assert each is not None
        assert (await each.coming).picture is not None


@pytest.mark.parametrize("path", ["/held", "/head-drips", "/body-drips"])
async def test_a_slow_camera_is_given_up(
    fleet: Fleet, path: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(snapshots, "WITHIN_S", 0.3)
    async with picture_server() as server:
        video = server.video(path)
        cameras = Snapshots(lambda: fleet, lambda _: PictureRequest(video, AMPLE_S))
        asked = cameras.of(ResourceId("ugv1/mast"))
        assert asked is not None
        async with asyncio.timeout(AMPLE_S):
            answer = await asked.coming
        assert answer.picture is None
        assert answer.why == "the camera gave no picture within 0.3 s"
        # Its thread ends, too, although bytes may come for ever.
        await until(lambda: reading_threads() == 0)


async def test_cameras_that_hang_do_not_make_others_wait_for_ever(
    fleet: Fleet, gated: type[Gated], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(snapshots, "TURN_S", 0.2)
    cameras = Snapshots(lambda: fleet, gated, at_once=0)
    asked = cameras.of(ResourceId("ugv1/mast"))
    assert asked is not None
    assert (await asked.coming).why == "too many other cameras do not answer"
    assert cameras.of(ResourceId("ugv1/mast")) != asked
    await cameras.close()


@pytest.mark.parametrize("in_memory", [False, True])
def test_pictures_are_kept_and_removed(tmp_path: Path, in_memory: bool) -> None:
    most = 2 * len(JPEG) + len(PNG)
    kept = MemoryPictures(2, most) if in_memory else FolderPictures(tmp_path, most)
    jpg, png = Picture(JPEG, "jpg"), Picture(PNG, "png")
    kept.put("r1", 1, jpg)
    kept.put("r1", 2, png)
    kept.put("r12", 1, jpg)
    assert kept.get("r1", 1) == jpg
    assert kept.get("r1", 2) == png
    assert kept.get("r1", 3) is None
    assert kept.get("../r1", 1) is None
    assert set(kept.runs()) == {"r1", "r12"}
    kept.put("r1", 3, jpg)
    with pytest.raises(FullError, match="of pictures already"):
        kept.put("r1", 4, png)
    kept.remove("r1", 1)
    assert [kept.get("r1", number) for number in (1, 2, 3)] == [jpg, None, None]
    kept.put("r1", 2, jpg)
    kept.remove("r1")
    assert set(kept.runs()) == {"r12"}
    if not in_memory:
        assert [each.name for each in tmp_path.iterdir()] == ["r12-1.jpg"]
        assert (tmp_path / "r12-1.jpg").stat().st_mode & 0o777 == 0o600
        with pytest.raises(OSError, match="not the id of a run"):
            kept.put("../r1", 1, jpg)


def eye(server: PictureServer, path: str) -> str:
    """A camera beside the detector."""
    return f"""
      mast: {{connection: {{kind: ptz}}, video: {{url: "{server.base}{path}", kind: image}}}}"""


def opened(stack: AsyncExitStack, folder: Path) -> SqliteJournal:
    journal = SqliteJournal.open(folder / "journal.db")
    stack.push_async_callback(journal.close)
    return journal


def pictured(samples: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The latest entry of each number, of those whose pictures are decided."""
    latest = {each["number"]: each for each in detections_of(samples)}
    return [each for each in latest.values() if "picture" in each or "no_picture" in each]


async def test_what_is_detected_has_its_picture(tmp_path: Path) -> None:
    async with AsyncExitStack() as stack:
        server = await stack.enter_async_context(picture_server())
        world = await detecting(stack, tmp_path, BEHIND, eye(server, "/good"))
        browser = await world.browser()
        live = await browser.live()
        run = await world.control.start(LONG)
        await live.watch(run)
        said = await live.until(
            lambda message: (
                message["type"] == "detections"
                and any(each.get("picture") for each in message["detections"])
            )
        )
        samples = await tracked(browser, run, lambda found: len(pictured(found)) == 2)
        mine, man = pictured(samples)
        assert said["detections"][-1] in detections_of(samples)
        assert (mine["type"], mine["camera"], mine["picture"]) == ("mine", "ugv1/mast", 1)
        assert mine["picture_after_s"] >= 0
        assert man["picture"] in (1, 2)
        where = f"/api/runs/{run}/detections"
        picture = await browser.http.get(f"{where}/1/picture")
        assert (picture.status_code, picture.content) == (200, JPEG)
        assert picture.headers["content-type"] == "image/jpeg"
        assert picture.headers["x-content-type-options"] == "nosniff"
        assert "default-src 'self'" in picture.headers["content-security-policy"]
        missing = await browser.http.get(f"{where}/77/picture")
        assert (missing.status_code, missing.json()["detail"]) == (404, f"{run} has no picture 77")
        assert (await browser.http.get(f"{where}/0/picture")).status_code == 422
        assert (await browser.http.get("/api/runs/r9/detections/1/picture")).status_code == 404
        assert (await world.stranger().http.get(f"{where}/1/picture")).status_code == 401
        await world.control.stop(run)


async def test_why_there_is_no_picture_is_said(tmp_path: Path) -> None:
    async with AsyncExitStack() as stack:
        server = await stack.enter_async_context(picture_server())
        world = await detecting(stack, tmp_path, BEHIND, eye(server, "/script"))
        browser = await world.browser()
        run = await world.control.start(LONG)
        samples = await tracked(browser, run, lambda found: len(pictured(found)) == 2)
        assert {each["no_picture"] for each in pictured(samples)} == {NO_TYPE}
        assert all("picture" not in each for each in detections_of(samples))
        await world.control.stop(run)


async def test_the_picture_of_the_detection_that_ends_a_run_comes_later(tmp_path: Path) -> None:
    async with AsyncExitStack() as stack:
        server = await stack.enter_async_context(picture_server())
        world = await detecting(stack, tmp_path, LATER, eye(server, "/held"))
        browser = await world.browser()
        run = await world.control.start(WAITING)
        async with asyncio.timeout(AMPLE_S):
            await world.control.wait(run)
        samples = await tracked(browser, run, lambda found: len(detections_of(found)) == 1)
        assert pictured(samples) == []
        server.gate.set()
        samples = await tracked(browser, run, lambda found: len(pictured(found)) == 1)
        assert pictured(samples)[0]["picture"] == 1


async def test_a_picture_that_has_not_come_at_the_end_is_said(tmp_path: Path) -> None:
    async with AsyncExitStack() as outside:
        server = await outside.enter_async_context(picture_server())
        async with AsyncExitStack() as stack:
            journal = opened(stack, tmp_path)
            world = await detecting(stack, tmp_path, BEHIND, eye(server, "/held"), journal)
            browser: Browser = await world.browser()
            run = await world.control.start(LONG)
            await tracked(browser, run, lambda found: len(detections_of(found)) == 2)
        text = (tmp_path / "journal.db-tracks" / f"{run}.jsonl").read_text("utf-8")
        assert text.count("m2pem ended before it came") == 2
        assert not list((tmp_path / "journal.db-tracks").glob("*.jpg"))


async def test_pictures_outlive_the_executive_and_go_with_their_run(tmp_path: Path) -> None:
    tracks = tmp_path / "journal.db-tracks"
    async with AsyncExitStack() as outside:
        server = await outside.enter_async_context(picture_server())
        async with AsyncExitStack() as stack:
            journal = opened(stack, tmp_path)
            world = await detecting(stack, tmp_path, BEHIND, eye(server, "/good"), journal)
            browser = await world.browser()
            run = await world.control.start(LONG)
            await tracked(browser, run, lambda found: len(pictured(found)) == 2)
            await world.control.stop(run)
            await world.control.wait(run)
        assert (tracks / f"{run}-1.jpg").read_bytes() == JPEG
        (tracks / "r77-1.jpg").write_bytes(JPEG)
        async with AsyncExitStack() as stack:
            journal = opened(stack, tmp_path)
            world = await detecting(stack, tmp_path, BEHIND, eye(server, "/good"), journal)
            browser = await world.browser()
            picture = await browser.http.get(f"/api/runs/{run}/detections/1/picture")
            assert picture.content == JPEG
            # The journal does not have that run.
            await until(lambda: not (tracks / "r77-1.jpg").exists())
