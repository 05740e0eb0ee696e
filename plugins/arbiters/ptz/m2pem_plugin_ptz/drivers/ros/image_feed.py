"""The images of a camera: they are listened to only while somebody wants them, as they are big."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from sensor_msgs.msg import CompressedImage

from m2pem.api import Clock
from m2pem_plugin_ptz.drivers.driver import CameraError

if TYPE_CHECKING:
    from m2pem_plugin_ros import RosRuntime

WITHIN_S = 5.0
"""Of real time: a camera that shows nothing for so long shows nothing."""

LINGER_S = 10.0
"""It is listened to for so much longer: the next picture then needs no looking for its camera."""

SUFFIXES = {b"\xff\xd8\xff": ".jpg", b"\x89PNG": ".png"}


@dataclass(frozen=True, slots=True)
class Frame:
    """An image; `suffix`: of its file. `taken_us`: since the Unix epoch."""

    content: bytes
    suffix: str
    taken_us: int


class ImageFeed:
    """Frames of one topic of sensor_msgs/CompressedImage."""

    def __init__(self, ros: "RosRuntime", topic: str, clock: Clock) -> None:
        self.topic = topic
        self._ros = ros
        self._clock = clock
        self._readers: set[Callable[[Frame], None]] = set()
        self._subscription: Any = None
        self._lingering: asyncio.TimerHandle | None = None

    @property
    def has_publisher(self) -> bool:
        """Whether anybody publishes images there."""
        return bool(self._ros.node.count_publishers(self.topic))

    def read(self, reader: Callable[[Frame], None]) -> Callable[[], None]:
        """Have each frame from now on handed over; the function that is returned ends it."""
        self._readers.add(reader)
        if self._lingering is not None:
            self._lingering.cancel()
            self._lingering = None
        if self._subscription is None:
            from m2pem_plugin_ros import qos  # noqa: PLC0415  # it needs rclpy

            self._subscription = self._ros.subscribe(
                CompressedImage, self.topic, self._hear, qos.TELEMETRY, waiting=2
            )

        def end() -> None:
            self._readers.discard(reader)
            if not self._readers and self._lingering is None:
                loop = asyncio.get_running_loop()
                self._lingering = loop.call_later(LINGER_S, self.close)

        return end

    async def next(self) -> Frame:
        """The next frame.

        Raises:
            CameraError: none comes, or it is of no known kind.
        """
        came: asyncio.Future[Frame] = asyncio.get_running_loop().create_future()

        def take(frame: Frame) -> None:
            if not came.done():
                came.set_result(frame)

        end = self.read(take)
        try:
            async with asyncio.timeout(WITHIN_S):
                frame = await came
        except TimeoutError:
            who = "its publisher" if self.has_publisher else "nobody"
            raise CameraError(
                f"no image came on {self.topic} within {WITHIN_S:g} s: {who} publishes there"
                f"{', but sends none' if self.has_publisher else ''}"
            ) from None
        finally:
            end()
        if not frame.suffix:
            raise CameraError(f"what came on {self.topic} is neither a JPEG nor a PNG")
        return frame

    def close(self) -> None:
        """Listen no more."""
        if self._lingering is not None:
            self._lingering.cancel()
            self._lingering = None
        if self._subscription is not None:
            self._ros.node.destroy_subscription(self._subscription)
            self._subscription = None

    def _hear(self, message: Any) -> None:
        content = bytes(message.data)
        stamp = message.header.stamp
        stamp_us = stamp.sec * 1_000_000 + stamp.nanosec // 1000
        suffix = next((each for start, each in SUFFIXES.items() if content.startswith(start)), "")
        frame = Frame(content, suffix, stamp_us or self._clock.now_us())
        for reader in tuple(self._readers):
            reader(frame)
