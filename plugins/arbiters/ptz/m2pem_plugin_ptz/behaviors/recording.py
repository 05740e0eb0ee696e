"""To record a video."""

from collections.abc import Mapping

from m2pem.api import Value
from m2pem_plugin_ptz.behaviors.behavior import Behavior, Job
from m2pem_plugin_ptz.drivers.driver import CameraError
from m2pem_plugin_ptz.sight import iso


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
        duration_s = self.job.number("duration")
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
