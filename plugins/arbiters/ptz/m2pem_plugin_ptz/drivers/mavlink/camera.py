"""The camera itself: pictures, videos and zoom."""

import asyncio
import math
from collections.abc import Callable, Coroutine
from datetime import UTC, datetime
from pathlib import PurePosixPath
from typing import Any, TypeAlias

from m2pem_plugin_mavlink import (
    Address,
    ExchangeError,
    Message,
    RefusedError,
    camera,
    camera_images,
    message_type,
)

from m2pem_plugin_ptz.drivers.driver import CameraError
from m2pem_plugin_ptz.drivers.mavlink.context import Post
from m2pem_plugin_ptz.gimbal import Picture

ATTEND_S = 5.0
FIND_EVERY_S = 1.0
FIND_SELDOM_S = 60.0
FIND_OFTEN = 5
"""After so many questions in vain a camera is asked for seldom: an autopilot that has none
acknowledges each question and never answers it."""
TOLD_WITHIN_S = 2.0
"""So long after a picture was asked for a camera should have told of it; then it is asked."""

TAKEN_WITHIN_S = 10.0
"""A camera that has not taken a picture after so long has not taken it."""

BUSY_S = 0.5
ZOOM_LOOK_S, ZOOMED_WITHIN_S, ZOOMED = 0.3, 15.0, 0.01
SEQUENCES = 8_000_000
"""Numbers of pictures that a float has; they go on from the time of day, since a camera may ignore
one that it has seen, from before a restart."""

_HEARTBEAT = message_type("HEARTBEAT").id

Job: TypeAlias = Callable[[], Coroutine[Any, Any, None]]


class CameraUnit:
    """Refusals of the camera are CameraErrors with its own reason."""

    def __init__(self, post: Post) -> None:
        self._post = post
        self._found: camera.Camera | None = None
        self._why = ""
        self._fraction: float | None = None
        self._wanted: float | None = None
        self._sequence = int(post.now_s()) % SEQUENCES
        self._taking = asyncio.Lock()
        self._images = camera_images.CapturedImages()
        self._news = asyncio.Event()
        self._began: datetime | None = None
        self._zooming: asyncio.Task[None] | None = None
        self._attending: asyncio.Task[None] | None = None
        self._stop_listening: Callable[[], None] = lambda: None

    def open(self) -> None:
        """Look for it, and listen."""
        wanted = camera_images.WANTED | {_HEARTBEAT}
        self._stop_listening = self._post.link.listen(wanted, self._hear)
        self._attending = asyncio.get_running_loop().create_task(self._attend())

    async def close(self) -> None:
        """Leave it as it is."""
        self._stop_listening()
        tasks = [each for each in (self._attending, self._zooming) if each is not None]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    # --- what is known --------------------------------------------------------------------------

    @property
    def level(self) -> float:
        """The zoom, as a factor."""
        return 1.0 + (self._fraction or 0.0) * (self._post.reach.zoom_max - 1.0)

    def refusal(self, behavior: str) -> str:
        """Why it cannot do such a behavior; "" if it can."""
        if self._found is None:
            settings = self._post.settings
            who = " and ".join(map(str, settings.camera_components))
            return (
                f"no camera has answered as component {who} of system {settings.system_id}"
                f"{self._why}"
            )
        can = {
            "zoom": (self._found.zooms, "zoom"),
            "take_picture": (self._found.takes_images, "take single pictures"),
            "record_video": (self._found.records, "record videos"),
        }
        is_able, what = can.get(behavior, (True, ""))
        return "" if is_able else f"the camera says that it cannot {what}"

    # --- zoom -----------------------------------------------------------------------------------

    def zoom(self, level: float) -> None:
        """Zoom there."""
        found, most = self._found, self._post.reach.zoom_max
        if found is None or most <= 1.0:
            return
        fraction = max(0.0, min(1.0, (level - 1.0) / (most - 1.0)))
        is_on_its_way = self._zooming is not None and not self._zooming.done()
        if fraction == self._wanted and is_on_its_way:
            return
        self._begin_zoom(lambda: self._zoom_to(found, fraction), fraction)

    def halt(self) -> None:
        """Zoom no further."""
        found = self._found
        if found is not None and self._zooming is not None and not self._zooming.done():
            self._begin_zoom(lambda: self._stop_zoom(found), None)

    def _begin_zoom(self, job: Job, fraction: float | None) -> None:
        if self._zooming is not None:
            self._zooming.cancel()
        self._wanted = fraction
        self._zooming = asyncio.get_running_loop().create_task(self._carefully(job))

    async def _carefully(self, job: Job) -> None:
        try:
            await job()
        except ExchangeError as error:
            self._post.logger.warning("%s: camera: %s", self._post.resource, error)

    async def _zoom_to(self, found: camera.Camera, fraction: float) -> None:
        device = self._post.settings.camera_device
        await self._post.link.perform(camera.zoom(found.address, fraction, device))
        until_s = self._post.now_s() + ZOOMED_WITHIN_S
        while self._post.now_s() < until_s:
            if not await self._read_zoom(found):
                self._fraction = fraction  # it does not say: then where it was sent
            if self._fraction is not None and abs(self._fraction - fraction) < ZOOMED:
                return
            await self._post.clock.sleep(ZOOM_LOOK_S)

    async def _stop_zoom(self, found: camera.Camera) -> None:
        await self._post.link.perform(
            camera.stop_zoom(found.address, self._post.settings.camera_device)
        )
        await self._read_zoom(found)

    async def _read_zoom(self, found: camera.Camera) -> bool:
        """Whether the camera knows how far it has zoomed."""
        reading = camera.ReadZoom(found.address, self._post.settings.camera_device)
        try:
            fraction = await self._post.link.perform(reading)
        except RefusedError:
            return False
        if math.isfinite(fraction):
            self._fraction = fraction
        return math.isfinite(fraction)

    # --- pictures -------------------------------------------------------------------------------

    async def take_picture(self) -> Picture:
        """Take one, and wait until the camera says that it has.

        Raises:
            CameraError: it could not, or does not say.
        """
        found = self._known("take_picture")
        async with self._taking:
            try:
                image = await self._take(found)
            except ExchangeError as error:
                raise CameraError(f"the camera takes no picture: {error}") from error
        if not image.taken:
            raise CameraError("the camera says that the picture could not be taken")
        return Picture(
            taken_us=image.time_us or self._post.clock.now_us(),
            suffix=PurePosixPath(image.url).suffix or ".jpg",
            reference=image.url or f"image {image.index} of the camera",
        )

    async def _take(self, found: camera.Camera) -> camera_images.Image:
        settings, link = self._post.settings, self._post.link
        await self._enter_mode(found, video=False)
        before = await self._count(found)
        self._images = camera_images.CapturedImages()
        self._sequence = self._sequence % SEQUENCES + 1
        until_s = self._post.now_s() + TAKEN_WITHIN_S
        while True:
            taking = camera.take_image(found.address, self._sequence, settings.camera_device)
            try:
                await link.perform(taking)
                break
            except RefusedError as error:
                if not error.temporary or self._post.now_s() >= until_s:
                    raise
            await self._post.clock.sleep(BUSY_S)  # it is busy with another one
        while self._post.now_s() < until_s:
            image = await self._told_of(before) or await self._asked_for(found, before)
            if image is not None:
                return image
        raise CameraError(
            f"the camera accepted to take a picture, and had none after {TAKEN_WITHIN_S:g} s"
        )

    async def _count(self, found: camera.Camera) -> int | None:
        """How many pictures there are; None where it does not say."""
        reading = camera.ReadCaptureStatus(found.address, self._post.settings.camera_device)
        try:
            return (await self._post.link.perform(reading)).images
        except RefusedError:
            return None

    async def _told_of(self, before: int | None) -> camera_images.Image | None:
        """The new picture, if the camera tells of it soon."""
        limit = asyncio.ensure_future(self._post.clock.sleep(TOLD_WITHIN_S))
        try:
            while True:
                for image in self._images.images.values():
                    if before is None or image.index >= before:
                        return image
                if limit.done():
                    return None
                self._news.clear()
                news = asyncio.ensure_future(self._news.wait())
                await asyncio.wait({limit, news}, return_when=asyncio.FIRST_COMPLETED)
                news.cancel()
        finally:
            limit.cancel()

    async def _asked_for(
        self, found: camera.Camera, before: int | None
    ) -> camera_images.Image | None:
        """The new picture, of which the camera told, but not so that it was heard."""
        if before is None or (await self._count(found) or 0) <= before:
            return None
        try:
            return await self._post.link.perform(camera_images.ReadImage(found.address, before))
        except RefusedError as error:
            raise CameraError(
                f"the camera took a picture, and does not say which: {error}"
            ) from error

    # --- videos ---------------------------------------------------------------------------------

    async def start_recording(self) -> None:
        """Begin a video.

        Raises:
            CameraError: it could not.
        """
        found = self._known("record_video")
        try:
            await self._enter_mode(found, video=True)
            device = self._post.settings.camera_device
            await self._post.link.perform(camera.start_video(found.address, device=device))
        except ExchangeError as error:
            raise CameraError(f"the camera does not record: {error}") from error
        self._began = datetime.fromtimestamp(self._post.now_s(), UTC)

    async def stop_recording(self) -> str:
        """End the video. MAVLink has no names for them, so this tells which one it is.

        Raises:
            CameraError: it could not.
        """
        found = self._known("record_video")
        try:
            device = self._post.settings.camera_device
            await self._post.link.perform(camera.stop_video(found.address, device))
        except ExchangeError as error:
            raise CameraError(f"the camera does not stop recording: {error}") from error
        system, component = found.address
        began = f" of {self._began:%Y-%m-%dT%H:%M:%SZ}" if self._began is not None else ""
        return f"video{began} in camera {system}/{component}"

    # --- inside ---------------------------------------------------------------------------------

    def _known(self, behavior: str) -> camera.Camera:
        if (reason := self.refusal(behavior)) or self._found is None:
            raise CameraError(reason)
        return self._found

    async def _enter_mode(self, found: camera.Camera, *, video: bool) -> None:
        mode = found.mode_for(video)
        if mode is not None:
            device = self._post.settings.camera_device
            await self._post.link.perform(camera.camera_mode(found.address, mode, device))

    def _hear(self, message: Message, sender: Address) -> None:
        if self._found is None or sender != self._found.address:
            return
        if message.TYPE.id == _HEARTBEAT:
            self._post.heard()
        elif self._images.take(message) is not None:
            self._news.set()

    async def _attend(self) -> None:
        asked = 0
        while True:
            try:
                if self._found is None:
                    self._found = await self._find()
                if self._found.zooms:
                    await self._read_zoom(self._found)
            except ExchangeError as error:
                self._why = f" ({error})"
                self._post.logger.debug("%s: camera: %s", self._post.resource, error)
            if self._found is not None:
                await self._post.clock.sleep(ATTEND_S)
            else:
                asked += 1
                seldom = asked >= FIND_OFTEN
                await self._post.clock.sleep(FIND_SELDOM_S if seldom else FIND_EVERY_S)

    async def _find(self) -> camera.Camera:
        settings = self._post.settings
        failure: ExchangeError | None = None
        for component in settings.camera_components:
            address = Address(settings.system_id, component)
            try:
                return await self._post.link.perform(
                    camera.FindCamera(address, settings.camera_device)
                )
            except ExchangeError as error:
                failure = failure or error
        assert failure is not None, "there is a component to ask"
        raise failure
