"""To take pictures."""

import asyncio
from collections.abc import Mapping

from m2pem.api import Value
from m2pem_plugin_ptz.behaviors.behavior import Behavior, BehaviorFailedError, Job
from m2pem_plugin_ptz.pictures import Caption, stored
from m2pem_plugin_ptz.sight import iso

_INTERVAL_S = 1.0


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
        interval_s = self.job.number("interval")
        interval_s = _INTERVAL_S if interval_s is None else interval_s
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
        return len(self._files) >= (self.job.number("count") or 1)

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
