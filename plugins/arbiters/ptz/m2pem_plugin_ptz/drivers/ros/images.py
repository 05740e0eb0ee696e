"""The images of a camera: subscribed only while they are needed, as they are large; and their
recording."""

import asyncio
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from sensor_msgs.msg import CompressedImage

from m2pem.api import Clock, ResourceId
from m2pem_plugin_ptz.drivers.driver import CameraError
from m2pem_plugin_ptz.image_files import decode

if TYPE_CHECKING:
    from m2pem_plugin_ros import RosRuntime


WITHIN_S = 5.0
"""Timeout of the next image, in real seconds."""

LINGER_S = 10.0
"""The subscription is kept this long after the last reader, so that the next picture needs no
discovery."""

SUFFIXES = {b"\xff\xd8\xff": ".jpg", b"\x89PNG": ".png"}
END_OF_JPEG = b"\xff\xd9"
TYPE = "sensor_msgs/msg/CompressedImage"


@dataclass(frozen=True, slots=True)
class ImageFrame:
    """An image. `suffix`: of its file. `taken_us`: microseconds since the Unix epoch."""

    content: bytes
    suffix: str
    taken_us: int


class ImageTopic:
    """The images of one topic of sensor_msgs/CompressedImage."""

    def __init__(self, ros: "RosRuntime", topic: str, clock: Clock) -> None:
        self.topic = topic
        self._ros = ros
        self._clock = clock
        self._readers: set[Callable[[ImageFrame], None]] = set()
        self._subscription: Any = None
        self._lingering: asyncio.TimerHandle | None = None

    @property
    def has_publisher(self) -> bool:
        """Whether the topic has a publisher."""
        return bool(self._ros.node.count_publishers(self.topic))

    def read(self, reader: Callable[[ImageFrame], None]) -> Callable[[], None]:
        """Call `reader` with each image, until the returned function is called."""
        self._readers.add(reader)
        if self._lingering is not None:
            self._lingering.cancel()
            self._lingering = None
        if self._subscription is None:
            from m2pem_plugin_ros import qos  # noqa: PLC0415  # it needs rclpy

            self._subscription = self._ros.subscribe(
                CompressedImage, self.topic, self._on_message, qos.TELEMETRY, waiting=2
            )

        def end() -> None:
            self._readers.discard(reader)
            if not self._readers and self._lingering is None:
                loop = asyncio.get_running_loop()
                self._lingering = loop.call_later(LINGER_S, self.close)

        return end

    async def next(self) -> ImageFrame:
        """Return the next image.

        Raises:
            CameraError: no image was received, or it cannot be decoded.
        """
        came: asyncio.Future[ImageFrame] = asyncio.get_running_loop().create_future()

        def take(frame: ImageFrame) -> None:
            if not came.done():
                came.set_result(frame)

        end = self.read(take)
        try:
            async with asyncio.timeout(WITHIN_S):
                frame = await came
        except TimeoutError:
            raise CameraError(
                f"no image was received on {self.topic} within {WITHIN_S:g} s: {self._absence}"
            ) from None
        finally:
            end()
        if not frame.suffix:
            raise CameraError(f"the image on {self.topic} is neither a JPEG nor a PNG")
        try:
            await asyncio.to_thread(decode, frame.content)
        except Exception as error:  # each format of Pillow raises its own
            raise CameraError(
                f"the image of {len(frame.content)} bytes on {self.topic} cannot be decoded: "
                f"{error}"
            ) from error
        return frame

    @property
    def _absence(self) -> str:
        found = self._ros.node.get_publishers_info_by_topic(self.topic)
        types = sorted({each.topic_type for each in found} - {TYPE})
        if types:
            return f"it has a publisher of {', '.join(types)}, and {TYPE} is expected"
        return "its publisher sends none" if found else "it has no publisher"

    def close(self) -> None:
        """Unsubscribe."""
        if self._lingering is not None:
            self._lingering.cancel()
            self._lingering = None
        if self._subscription is not None:
            self._ros.node.destroy_subscription(self._subscription)
            self._subscription = None

    def _on_message(self, message: Any) -> None:
        content = bytes(message.data)
        stamp = message.header.stamp
        stamp_us = stamp.sec * 1_000_000 + stamp.nanosec // 1000
        suffix = next((each for start, each in SUFFIXES.items() if content.startswith(start)), "")
        frame = ImageFrame(content, suffix, stamp_us or self._clock.now_us())
        for reader in tuple(self._readers):
            reader(frame)


MOST_WAITING = 60
"""Most images that wait for a slow disk; the oldest are dropped."""


class Recorder:
    """Records images to a file of Motion JPEG, one video at a time."""

    def __init__(
        self, images: ImageTopic, folder: Path, resource: ResourceId, clock: Clock
    ) -> None:
        self._images = images
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
        self._cut = 0

    async def start(self) -> None:
        """Start a video. An active one is kept.

        Raises:
            CameraError: there are no images, or no file can be written.
        """
        if self._file is not None:
            return
        first = await self._images.next()
        if first.suffix != ".jpg":
            raise CameraError(f"only JPEG images make a video, and {self._images.topic} has others")
        began = datetime.fromtimestamp(self._clock.now_us() / 1e6, UTC)
        try:
            self._file = await asyncio.to_thread(self._create, f"{began:%Y%m%dT%H%M%SZ}")
        except OSError as error:
            raise CameraError(f"no video can be stored in {self._folder}: {error}") from error
        self._failure, self._cut = "", 0
        self._take(first)
        self._end_reading = self._images.read(self._take)
        self._writing = asyncio.get_running_loop().create_task(self._write(self._file))

    async def stop(self) -> str:
        """End the video, and return its file.

        Raises:
            CameraError: no video was begun, or not all images could be written.
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
        if self._cut and not self._failure:
            self._failure = f"{self._cut} images were cut off, and left out"
        if self._failure:
            raise CameraError(f"the video {self._path} is not complete: {self._failure}")
        return str(self._path)

    async def close(self) -> None:
        """End the video. What was written stays."""
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

    def _take(self, frame: ImageFrame) -> None:
        if frame.suffix != ".jpg":
            return
        if not frame.content.rstrip(b"\0").endswith(END_OF_JPEG):  # some cameras fill up with zeros
            self._cut += 1
            return
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


def _nothing() -> None: ...
