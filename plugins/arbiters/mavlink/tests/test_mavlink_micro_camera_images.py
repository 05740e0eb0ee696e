"""The images that a camera reports to have taken."""

from collections.abc import Sequence
from typing import Any

from m2pem_plugin_mavlink.microservices.camera_images import KEPT, CapturedImages, ReadImage
from m2pem_plugin_mavlink.protocol.messages import Message, message_type
from m2pem_plugin_mavlink.protocol.transaction import RETRIES
from mavlink_lossy import VEHICLE, Played, over_the_wire, play_table
from mavlink_peers import Commanded, ack


def captured(index: int, **more: Any) -> Any:
    named = {"lat": 473977420, "lon": -85455940, "alt": 520_500, "capture_result": 1, **more}
    make = message_type("CAMERA_IMAGE_CAPTURED").make
    return over_the_wire(make(image_index=index, file_url=b"mftp://1.jpg", **named))


def test_each_image_counts_once() -> None:
    images = CapturedImages()
    image = images.take(captured(4))
    assert image is not None
    assert (image.index, image.taken, image.url) == (4, True, "mftp://1.jpg")
    place = (image.latitude_deg, image.longitude_deg, image.altitude_amsl_m)
    assert place == (47.397742, -8.545594, 520.5)
    assert images.take(captured(4)) is None
    assert images.take(captured(5, capture_result=0)).taken is False  # type: ignore[union-attr]
    assert list(images.images) == [4, 5]


def test_images_that_were_not_heard_of_are_known() -> None:
    images = CapturedImages()
    assert images.missing() == ()
    for index in (3, 8, 5):
        images.take(captured(index))
    assert images.missing() == (4, 6, 7)
    images.take(captured(2_000_000_000))
    assert images.missing() == ()


def test_a_camera_that_counts_for_ever_takes_little_memory() -> None:
    images = CapturedImages()
    for index in range(KEPT + 50):
        images.take(captured(index))
    assert len(images.images) == KEPT
    assert min(images.images) == 50


def test_a_missing_image_is_told_or_it_fails_clearly_whatever_the_link_does() -> None:
    def gives(command: Any, camera: Commanded) -> Sequence[Message]:
        index = int(command.param2)
        return ack(command.command), captured(index + 1), captured(index)

    def check(played: Played, _: Commanded) -> None:
        assert played.error is not None or played.result.index == 6

    play_table(lambda: (ReadImage(VEHICLE, 6), Commanded(gives)), check, lambda _: RETRIES.bound_s)
