"""The behaviors `take_picture` and `record_video`."""

import asyncio
from collections.abc import Mapping

from m2pem.api import Value
from m2pem_plugin_ptz.behaviors.behavior import Behavior, BehaviorContext, BehaviorFailedError
from m2pem_plugin_ptz.camera_model.model import iso
from m2pem_plugin_ptz.drivers.driver import CameraError
from m2pem_plugin_ptz.image_files import ImageMetadata, store_image


class TakePicture(Behavior):
    """Take pictures one after the other. Each is stored before the next one is taken."""

    name = "take_picture"
    turns = False

    def __init__(self, context: BehaviorContext) -> None:
        super().__init__(context)
        self._files: list[Value] = []
        self._last: ImageMetadata | None = None

    async def step(self, elapsed_s: float) -> bool:
        interval_s = self.context.parameters.interval_s
        taken = len(self._files)
        if elapsed_s >= taken * interval_s:
            # The pose at the request is nearer to that of the picture than the pose after the
            # answer.
            metadata = ImageMetadata.of(self.model, self.context.id, taken + 1)
            picture = await self.driver.take_picture()
            metadata = metadata.taken(picture)
            folder = self.model.settings.pictures
            try:
                file = await asyncio.to_thread(store_image, folder, picture, metadata)
            except OSError as error:
                reason = f"cannot store a picture in {folder}: {error.strerror or error}"
                raise BehaviorFailedError(reason) from error
            self._files.append(file)
            self._last = metadata
        return len(self._files) >= self.context.parameters.count

    def outputs(self) -> Mapping[str, Value]:
        """Return the files, and position and time of the last picture."""
        if self._last is None:
            return {}
        return {
            "picture.file": self._files[-1],
            "picture.files": list(self._files),
            "picture.position": self._last.position,
            "picture.time": iso(self._last.time_us),
        }


class RecordVideo(Behavior):
    """Record for `duration`, or until cancelled. Recording goes on in a hold, as nothing moves."""

    name = "record_video"
    turns = False

    def __init__(self, context: BehaviorContext) -> None:
        super().__init__(context)
        self._requested = self._records = False
        self._began_us = 0
        self._file: str | None = None

    async def begin(self) -> None:
        self._requested, self._began_us = True, self.model.now_us
        await self.driver.start_recording()
        self._records = True

    async def step(self, elapsed_s: float) -> bool:
        duration_s = self.context.parameters.duration_s
        return duration_s is not None and elapsed_s >= duration_s

    async def leave(self) -> None:
        """Stop recording, if it was started."""
        if not self._requested:
            return
        try:
            self._file = await self.driver.stop_recording()
        except CameraError:
            if self._records:  # otherwise the camera may have recorded nothing
                raise
        self._requested = False

    def outputs(self) -> Mapping[str, Value]:
        """Return the file of the video, and when it began."""
        if self._file is None:
            return {}
        return {"video.file": self._file, "video.time": iso(self._began_us)}
