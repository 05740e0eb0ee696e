"""Pictures of what was detected, at that moment: by the camera that detected it, or by another one
of the same vehicle.

A camera is asked one time in a second; what is detected meanwhile gets the next picture. Threads
wait for cameras, a few at a time: the event loop does not.
"""

import asyncio
import logging
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TypeAlias

from m2pem.api import Fleet, ResourceId
from m2pem.fleet.fleet import Video, VideoKind
from m2pem_plugin_web.tracks.camera_pictures import NoPictureError, Picture, PictureRequest

WITHIN_S = 5.0
"""Seconds for a picture, from connecting to its last byte."""

EVERY_S = 1.0
"""Least seconds between two requests to a camera."""

MOST_AT_ONCE = 4
"""Most cameras that are asked at once."""

TURN_S = 15.0
"""Seconds until a camera gets its turn, while others do not answer."""

KINDS = (VideoKind.IMAGE, VideoKind.MJPEG)

log = logging.getLogger("m2pem.ocu.web")


@dataclass(frozen=True, slots=True)
class CameraAnswer:
    """What a camera gave: a picture, or why there is none; and when, by the loop's clock."""

    picture: Picture | None
    why: str
    at_s: float


@dataclass(frozen=True, slots=True)
class Snapshot:
    """A picture of `camera` that is asked for; `since_s`: when that was, by the loop's clock."""

    camera: ResourceId
    since_s: float
    coming: "asyncio.Task[CameraAnswer]"


Ask: TypeAlias = Callable[[Video], PictureRequest]


def camera_of(fleet: Fleet, source: ResourceId) -> ResourceId | None:
    """Return the camera that shows what `source` detects: itself if it has one, else the first one
    of its vehicle; None if no picture can be had."""
    cameras = [each for each, video in fleet.videos.items() if video.kind in KINDS]
    if source in cameras:
        return source
    payload = fleet.payloads.get(source)
    vehicle = payload.vehicle if payload is not None else source
    of_vehicle = fleet.vehicles[vehicle].payloads if vehicle in fleet.vehicles else ()
    return next((each for each in of_vehicle if each in cameras), None)


@dataclass(slots=True, eq=False)
class _Camera:
    """`next`: the picture that is asked for when it is this camera's turn."""

    turn: asyncio.Lock = field(default_factory=asyncio.Lock)
    not_before_s: float = 0.0
    next: "asyncio.Task[CameraAnswer] | None" = None


class Snapshots:
    """Asks cameras of a fleet for pictures, `at_once` at a time. `ask`: makes a request."""

    def __init__(
        self,
        fleet: Callable[[], Fleet],
        ask: Ask = lambda video: PictureRequest(video, WITHIN_S),
        at_once: int = MOST_AT_ONCE,
    ) -> None:
        self._fleet = fleet
        self._ask = ask
        self._cameras: dict[ResourceId, _Camera] = {}
        self._slots = asyncio.Semaphore(at_once)
        self._tasks: set[asyncio.Task[CameraAnswer]] = set()

    def of(self, source: ResourceId) -> Snapshot | None:
        """Ask for a picture of what `source` has just detected; None: there is no camera."""
        fleet = self._fleet()
        name = camera_of(fleet, source)
        if name is None:
            return None
        camera = self._cameras.setdefault(name, _Camera())
        if camera.next is None:
            taken = self._take(camera, fleet.videos[name])
            camera.next = asyncio.create_task(taken, name=f"web: a picture of {name}")
            self._tasks.add(camera.next)
            camera.next.add_done_callback(self._tasks.discard)
        return Snapshot(name, asyncio.get_running_loop().time(), camera.next)

    async def close(self) -> None:
        """End all requests."""
        tasks = set(self._tasks)
        for task in tasks:
            task.cancel()
        if tasks:
            await asyncio.wait(tasks)

    async def _take(self, camera: _Camera, video: Video) -> CameraAnswer:
        loop = asyncio.get_running_loop()
        try:
            async with camera.turn:
                await asyncio.sleep(camera.not_before_s - loop.time())
                try:
                    async with asyncio.timeout(TURN_S):
                        await self._slots.acquire()
                except TimeoutError:
                    return CameraAnswer(None, "too many other cameras do not answer", loop.time())
                camera.not_before_s = loop.time() + EVERY_S
                camera.next = None  # what is detected from now on wants a later one
                return await self._read(self._ask(video))
        finally:
            if camera.next is asyncio.current_task():
                camera.next = None

    async def _read(self, request: PictureRequest) -> CameraAnswer:
        """Read in a thread of its own, which has a slot until it ends."""
        loop = asyncio.get_running_loop()
        done: asyncio.Future[CameraAnswer] = loop.create_future()

        def give(answer: CameraAnswer) -> None:
            self._slots.release()
            if not done.cancelled():
                done.set_result(answer)

        def read() -> None:
            try:
                answer = CameraAnswer(request.read(), "", loop.time())
            except NoPictureError as error:
                answer = CameraAnswer(None, str(error), loop.time())
            except Exception:
                log.exception("a picture of a detection could not be read")
                answer = CameraAnswer(None, "it could not be read: the log says why", loop.time())
            with suppress(RuntimeError):  # the loop has ended
                loop.call_soon_threadsafe(give, answer)

        try:
            threading.Thread(target=read, name="web: a picture", daemon=True).start()
        except RuntimeError as error:
            self._slots.release()
            return CameraAnswer(None, f"this machine has no thread for it: {error}", loop.time())
        try:
            async with asyncio.timeout(WITHIN_S):
                return await done
        except TimeoutError:
            return CameraAnswer(
                None, f"the camera gave no picture within {WITHIN_S:g} s", loop.time()
            )
        finally:
            request.abort()
