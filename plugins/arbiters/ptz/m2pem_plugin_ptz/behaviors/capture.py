"""To take pictures."""

import asyncio
from collections.abc import Mapping

from m2pem.api import Value
from m2pem_plugin_ptz.behaviors.behavior import Behavior, BehaviorFailedError, Job
from m2pem_plugin_ptz.camera_model.model import iso
from m2pem_plugin_ptz.drivers.driver import CameraError
from m2pem_plugin_ptz.image_files import Caption, stored


class TakePicture(Behavior):
    """So many, one after the other, each stored before the next one is taken."""

    name = "take_picture"
    turns = False

    def __init__(self, job: Job) -> None:
        super().__init__(job)
        self._files: list[Value] = []
        self._last: Caption | None = None

    async def step(self, elapsed_s: float) -> bool:
        """Done when the last one is stored."""
        interval_s = self.job.parameters.interval_s
        taken = len(self._files)
        if elapsed_s >= taken * interval_s:
            # Where it looked when it was told to; that is nearer to the truth than afterwards.
            caption = Caption.of(self.sight, self.job.id, taken + 1)
            picture = await self.driver.take_picture()
            caption = caption.taken(picture)
            folder = self.sight.settings.pictures
            try:
                file = await asyncio.to_thread(stored, folder, picture, caption)
            except OSError as error:
                reason = f"cannot store a picture in {folder}: {error.strerror or error}"
                raise BehaviorFailedError(reason) from error
            self._files.append(file)
            self._last = caption
        return len(self._files) >= self.job.parameters.count

    def outputs(self) -> Mapping[str, Value]:
        """The pictures, and where and when the last one was taken."""
        if self._last is None:
            return {}
        return {
            "picture.file": self._files[-1],
            "picture.files": list(self._files),
            "picture.position": self._last.position,
            "picture.time": iso(self._last.time_us),
        }


class RecordVideo(Behavior):
    """For the duration, or until it is cancelled. It goes on in a hold: nothing moves for it."""

    name = "record_video"
    turns = False

    def __init__(self, job: Job) -> None:
        super().__init__(job)
        self._asked = self._records = False
        self._began_us = 0
        self._file: str | None = None

    async def begin(self) -> None:
        """Start."""
        self._asked, self._began_us = True, self.sight.now_us
        await self.driver.start_recording()
        self._records = True

    async def step(self, elapsed_s: float) -> bool:
        """Done after the duration."""
        duration_s = self.job.parameters.duration_s
        return duration_s is not None and elapsed_s >= duration_s

    async def leave(self) -> None:
        """Stop, if it was started."""
        if not self._asked:
            return
        try:
            self._file = await self.driver.stop_recording()
        except CameraError:
            if self._records:  # else nobody knows whether there was anything to stop
                raise
        self._asked = False

    def outputs(self) -> Mapping[str, Value]:
        """Where the video is, and when it began."""
        if self._file is None:
            return {}
        return {"video.file": self._file, "video.time": iso(self._began_us)}
