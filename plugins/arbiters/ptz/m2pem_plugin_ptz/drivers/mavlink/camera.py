"""The camera component: pictures, videos and zoom (camera protocol)."""

import asyncio
import math
from collections.abc import Callable
from datetime import UTC, datetime
from functools import partial
from pathlib import PurePosixPath

from m2pem_plugin_mavlink import (
    Address,
    ExchangeError,
    Message,
    RefusedError,
    camera,
    camera_images,
    message_type,
)

from m2pem.api.latest_task import LatestTask, cancel_and_wait
from m2pem_plugin_ptz.drivers.driver import CameraError
from m2pem_plugin_ptz.drivers.mavlink.context import CameraContext, Job
from m2pem_plugin_ptz.gimbal import CapturedImage

ATTEND_S = 5.0
FIND_EVERY_S = 1.0
FIND_SELDOM_S = 60.0
FIND_OFTEN = 5
"""After this many requests without an answer, a camera is requested rarely: an autopilot without a
camera acknowledges each request and never answers it."""
REPORTED_WITHIN_S = 2.0
"""After this time without a message about a new picture, it is requested."""

TAKEN_WITHIN_S = 10.0
"""A picture that is not taken after this time has failed."""

BUSY_S = 0.5
ZOOM_LOOK_S, ZOOMED_WITHIN_S, ZOOMED = 0.3, 15.0, 0.01
SEQUENCES = 8_000_000
"""Sequence numbers that a float can hold. They start from the time of day, since a camera may
ignore numbers that it had before a restart."""

_HEARTBEAT = message_type("HEARTBEAT").id


class CameraComponent:
    """The camera component of a vehicle. Refusals of the camera are CameraErrors with its own
    reason."""

    def __init__(self, context: CameraContext) -> None:
        self._context = context
        self._found: camera.Camera | None = None
        self._last_error = ""
        self._fraction: float | None = None
        self._wanted: float | None = None
        self._sequence = int(context.now_s()) % SEQUENCES
        self._taking = asyncio.Lock()
        self._images = camera_images.CapturedImages()
        self._news = asyncio.Event()
        self._began: datetime | None = None
        self._zooming = LatestTask()
        self._attending: asyncio.Task[None] | None = None
        self._stop_listening: Callable[[], None] = lambda: None

    def open(self) -> None:
        """Search the camera, and subscribe."""
        wanted = camera_images.WANTED | {_HEARTBEAT}
        self._stop_listening = self._context.link.listen(wanted, self._on_message)
        self._attending = asyncio.get_running_loop().create_task(self._poll())

    async def close(self) -> None:
        """Close. The camera stays as it is."""
        self._stop_listening()
        await cancel_and_wait(self._attending)
        await self._zooming.close()

    # --- state ----------------------------------------------------------------------------------

    @property
    def level(self) -> float:
        """The zoom as a factor."""
        return 1.0 + (self._fraction or 0.0) * (self._context.reach.zoom_max - 1.0)

    def refusal(self, behavior: str) -> str:
        """Return why the camera cannot do a behavior; "" if it can."""
        if self._found is None:
            settings = self._context.settings
            who = " and ".join(map(str, settings.camera_components))
            return (
                f"no camera has answered as component {who} of system {settings.system_id}"
                f"{self._last_error}"
            )
        can = {
            "zoom": (self._found.zooms, "zoom"),
            "take_picture": (self._found.takes_images, "take single pictures"),
            "record_video": (self._found.records, "record videos"),
        }
        is_able, what = can.get(behavior, (True, ""))
        return "" if is_able else f"the camera reports that it cannot {what}"

    # --- zoom -----------------------------------------------------------------------------------

    def zoom(self, level: float) -> None:
        found, most = self._found, self._context.reach.zoom_max
        if found is None or most <= 1.0:
            return
        fraction = max(0.0, min(1.0, (level - 1.0) / (most - 1.0)))
        if fraction != self._wanted or not self._zooming.is_running:
            self._begin_zoom(partial(self._zoom_to, found, fraction), fraction)

    def halt(self) -> None:
        """Stop zooming."""
        found = self._found
        if found is not None and self._zooming.is_running:
            self._begin_zoom(partial(self._stop_zoom, found), None)

    def _begin_zoom(self, job: Job, fraction: float | None) -> None:
        self._wanted = fraction
        self._zooming.replace(partial(self._context.carefully, "camera", job))

    async def _zoom_to(self, found: camera.Camera, fraction: float) -> None:
        device = self._context.settings.camera_device
        await self._context.link.perform(camera.zoom(found.address, fraction, device))
        until_s = self._context.now_s() + ZOOMED_WITHIN_S
        while self._context.now_s() < until_s:
            if not await self._read_zoom(found):
                self._fraction = (
                    fraction  # the camera does not report its zoom: assume the commanded one
                )
            if self._fraction is not None and abs(self._fraction - fraction) < ZOOMED:
                return
            await self._context.clock.sleep(ZOOM_LOOK_S)

    async def _stop_zoom(self, found: camera.Camera) -> None:
        await self._context.link.perform(
            camera.stop_zoom(found.address, self._context.settings.camera_device)
        )
        await self._read_zoom(found)

    async def _read_zoom(self, found: camera.Camera) -> bool:
        """Read the zoom, and return whether the camera knows it."""
        reading = camera.ReadZoom(found.address, self._context.settings.camera_device)
        try:
            fraction = await self._context.link.perform(reading)
        except RefusedError:
            return False
        if math.isfinite(fraction):
            self._fraction = fraction
        return math.isfinite(fraction)

    # --- pictures -------------------------------------------------------------------------------

    async def take_picture(self) -> CapturedImage:
        """Take a picture, and wait for the camera's message about it.

        Raises:
            CameraError: the camera took no picture, or did not report it.
        """
        found = self._known("take_picture")
        async with self._taking:
            try:
                image = await self._take(found)
            except ExchangeError as error:
                raise CameraError(f"the camera refuses to take a picture: {error}") from error
        if not image.taken:
            raise CameraError("the camera reports that it could not take the picture")
        return CapturedImage(
            taken_us=image.time_us or self._context.clock.now_us(),
            suffix=PurePosixPath(image.url).suffix or ".jpg",
            reference=image.url or f"image {image.index} of the camera",
        )

    async def _take(self, found: camera.Camera) -> camera_images.Image:
        settings, link = self._context.settings, self._context.link
        await self._enter_mode(found, video=False)
        before = await self._count(found)
        self._images = camera_images.CapturedImages()
        self._sequence = self._sequence % SEQUENCES + 1
        until_s = self._context.now_s() + TAKEN_WITHIN_S
        while True:
            taking = camera.take_image(found.address, self._sequence, settings.camera_device)
            try:
                await link.perform(taking)
                break
            except RefusedError as error:
                if not error.temporary or self._context.now_s() >= until_s:
                    raise
            await self._context.clock.sleep(BUSY_S)  # the camera is busy with another picture
        while self._context.now_s() < until_s:
            image = await self._wait_for_image(before) or await self._request_image(found, before)
            if image is not None:
                return image
        raise CameraError(
            f"the camera accepted to take a picture, but has taken none in {TAKEN_WITHIN_S:g} s"
        )

    async def _count(self, found: camera.Camera) -> int | None:
        """Return the number of pictures; None if the camera does not report it."""
        reading = camera.ReadCaptureStatus(found.address, self._context.settings.camera_device)
        try:
            return (await self._context.link.perform(reading)).images
        except RefusedError:
            return None

    async def _wait_for_image(self, before: int | None) -> camera_images.Image | None:
        """Return the new picture, if the camera reports it in time."""
        limit = asyncio.ensure_future(self._context.clock.sleep(REPORTED_WITHIN_S))
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

    async def _request_image(
        self, found: camera.Camera, before: int | None
    ) -> camera_images.Image | None:
        """Request the new picture, whose message was lost."""
        if before is None or (await self._count(found) or 0) <= before:
            return None
        try:
            return await self._context.link.perform(camera_images.ReadImage(found.address, before))
        except RefusedError as error:
            raise CameraError(
                f"the camera took a picture, but does not report its index: {error}"
            ) from error

    # --- videos ---------------------------------------------------------------------------------

    async def start_recording(self) -> None:
        """Begin a video.

        Raises:
            CameraError: the camera refused, or did not answer.
        """
        found = self._known("record_video")
        try:
            await self._enter_mode(found, video=True)
            device = self._context.settings.camera_device
            await self._context.link.perform(camera.start_video(found.address, device=device))
        except ExchangeError as error:
            raise CameraError(f"the camera does not start recording: {error}") from error
        self._began = datetime.fromtimestamp(self._context.now_s(), UTC)

    async def stop_recording(self) -> str:
        """End the video, and return a text that identifies it: MAVLink has no names for videos.

        Raises:
            CameraError: the camera refused, or did not answer.
        """
        found = self._known("record_video")
        try:
            device = self._context.settings.camera_device
            await self._context.link.perform(camera.stop_video(found.address, device))
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
            device = self._context.settings.camera_device
            await self._context.link.perform(camera.camera_mode(found.address, mode, device))

    def _on_message(self, message: Message, sender: Address) -> None:
        if self._found is None or sender != self._found.address:
            return
        if message.TYPE.id == _HEARTBEAT:
            self._context.on_contact()
        elif self._images.take(message) is not None:
            self._news.set()

    async def _poll(self) -> None:
        requests = 0
        while True:
            try:
                if self._found is None:
                    self._found = await self._find()
                if self._found.zooms:
                    await self._read_zoom(self._found)
            except ExchangeError as error:
                self._last_error = f" ({error})"
                self._context.logger.debug("%s: camera: %s", self._context.resource, error)
            if self._found is not None:
                await self._context.clock.sleep(ATTEND_S)
            else:
                requests += 1
                seldom = requests >= FIND_OFTEN
                await self._context.clock.sleep(FIND_SELDOM_S if seldom else FIND_EVERY_S)

    async def _find(self) -> camera.Camera:
        settings = self._context.settings
        failure: ExchangeError | None = None
        for component in settings.camera_components:
            address = Address(settings.system_id, component)
            try:
                return await self._context.link.perform(
                    camera.FindCamera(address, settings.camera_device)
                )
            except ExchangeError as error:
                failure = failure or error
        assert failure is not None, "`camera_components` is not empty"
        raise failure
