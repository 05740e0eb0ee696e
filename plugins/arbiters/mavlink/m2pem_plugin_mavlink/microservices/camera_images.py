"""The images that a camera reports to have taken (mavlink.io, "Camera Protocol v2",
services/camera.html, "Still Image Capture")."""

from dataclasses import dataclass

from m2pem_plugin_mavlink.microservices.message_requests import RequestMessage
from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type

WANTED = frozenset({message_type("CAMERA_IMAGE_CAPTURED").id})
MOST_GAPS = 100
KEPT = 1000
_DEG_TO_1E7 = 1e7
_MM_PER_M = 1000.0


@dataclass(frozen=True, slots=True)
class Image:
    """An image. `index` counts the images of the camera; `taken`: False if it failed. WGS-84
    degrees, metres above mean sea level; `time_us`: since the Unix epoch, 0 if the camera does not
    know it."""

    index: int
    taken: bool
    latitude_deg: float
    longitude_deg: float
    altitude_amsl_m: float
    time_us: int
    url: str


class CapturedImages:
    """Collects the images of one camera. Pass each CAMERA_IMAGE_CAPTURED of its component to it.

    `images`: by index, each once, the last `KEPT`.
    """

    def __init__(self) -> None:
        self.images: dict[int, Image] = {}

    def take(self, message: Message) -> Image | None:
        """Return the image in a CAMERA_IMAGE_CAPTURED; None if it is known."""
        image = image_of(message)
        if self.images.get(image.index) == image:
            return None
        self.images.pop(
            image.index, None
        )  # a camera counts from 0 again when its storage is formatted
        self.images[image.index] = image
        if len(self.images) > KEPT:
            del self.images[next(iter(self.images))]
        return image

    def missing(self) -> tuple[int, ...]:
        """The indexes that are missing between received ones: `ReadImage` requests them."""
        if not self.images:
            return ()
        indexes = range(min(self.images), max(self.images))
        if len(indexes) > len(self.images) + MOST_GAPS:  # a camera that counted from 0 again
            return ()
        return tuple(index for index in indexes if index not in self.images)


class ReadImage(RequestMessage[Image]):
    """Reads the description of an image from the camera."""

    def __init__(self, target: Address, index: int) -> None:
        def read(message: Message) -> Image | None:
            return image_of(message) if message.image_index == index else None

        super().__init__(target, "CAMERA_IMAGE_CAPTURED", read, index=index)


def image_of(message: Message) -> Image:
    """Return the image in a CAMERA_IMAGE_CAPTURED."""
    return Image(
        index=message.image_index,
        taken=message.capture_result == 1,
        latitude_deg=message.lat / _DEG_TO_1E7,
        longitude_deg=message.lon / _DEG_TO_1E7,
        altitude_amsl_m=message.alt / _MM_PER_M,
        time_us=message.time_utc,
        url=message.file_url.decode("utf-8", "replace"),
    )
