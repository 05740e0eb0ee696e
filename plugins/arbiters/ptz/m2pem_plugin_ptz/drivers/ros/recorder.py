"""Records the images of a camera to a file: JPEG after JPEG, as players know it (Motion JPEG)."""

import asyncio
from collections import deque
from datetime import UTC, datetime
from pathlib import Path
from typing import IO

from m2pem.api import Clock, ResourceId
from m2pem_plugin_ptz.drivers.driver import CameraError
from m2pem_plugin_ptz.drivers.ros.image_feed import Frame, ImageFeed

MOST_WAITING = 60
"""Of more images that a slow disk has not taken yet, the oldest are left out."""


class Recorder:
    """One video at a time, in `folder`."""

    def __init__(self, feed: ImageFeed, folder: Path, resource: ResourceId, clock: Clock) -> None:
        self._feed = feed
        self._folder = folder
        self._name = resource.replace("/", "_")
        self._clock = clock
        self._file: IO[bytes] | None = None
        self._path = Path()
        self._waiting: deque[bytes] = deque(maxlen=MOST_WAITING)
        self._news = asyncio.Event()
        self._writing: asyncio.Task[None] | None = None
        self._end_reading = _nothing
        self._failure = ""

    async def start(self) -> None:
        """Begin; what goes on already goes on.

        Raises:
            CameraError: there are no images, or no file can be written.
        """
        if self._file is not None:
            return
        first = await self._feed.next()
        if first.suffix != ".jpg":
            raise CameraError(f"only JPEG images make a video, and {self._feed.topic} has others")
        began = datetime.fromtimestamp(self._clock.now_us() / 1e6, UTC)
        try:
            self._file = await asyncio.to_thread(self._create, f"{began:%Y%m%dT%H%M%SZ}")
        except OSError as error:
            raise CameraError(f"no video can be stored in {self._folder}: {error}") from error
        self._failure = ""
        self._take(first)
        self._end_reading = self._feed.read(self._take)
        self._writing = asyncio.get_running_loop().create_task(self._write(self._file))

    async def stop(self) -> str:
        """End it, and return the path of the file.

        Raises:
            CameraError: none was begun, or not all could be written.
        """
        file, self._file = self._file, None
        if file is None:
            raise CameraError("no video was begun")
        self._end_reading()
        self._news.set()
        if self._writing is not None:
            await self._writing
        try:
            await asyncio.to_thread(file.close)
        except OSError as error:
            self._failure = self._failure or str(error)
        if self._failure:
            raise CameraError(f"the video {self._path} is not whole: {self._failure}")
        return str(self._path)

    async def close(self) -> None:
        """End what goes on; what was written stays."""
        if self._file is not None:
            try:
                await self.stop()
            except CameraError:
                return

    def _create(self, began: str) -> IO[bytes]:
        self._folder.mkdir(parents=True, exist_ok=True)
        for number in range(1, 1000):
            again = "" if number == 1 else f"_{number}"
            path = (self._folder / f"{self._name}_{began}{again}.mjpeg").absolute()
            try:
                file = path.open("xb")
            except FileExistsError:
                continue
            self._path = path
            return file
        raise FileExistsError(f"there are too many videos of {began}")

    def _take(self, frame: Frame) -> None:
        if frame.suffix == ".jpg":
            self._waiting.append(frame.content)
            self._news.set()

    async def _write(self, file: IO[bytes]) -> None:
        while self._file is not None or self._waiting:
            await self._news.wait()
            self._news.clear()
            content = b"".join(self._waiting)
            self._waiting.clear()
            try:
                await asyncio.to_thread(file.write, content)
            except OSError as error:
                self._failure = str(error)
                self._end_reading()
                self._waiting.clear()
                return


def _nothing() -> None:
    """There is nothing to end."""
