"""Pictures and videos over ROS."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from io import BytesIO, FileIO
from pathlib import Path

import pytest
from m2pem_plugin_ptz.drivers.driver import CameraError
from m2pem_plugin_ptz.drivers.ros import images
from m2pem_plugin_ros.runtime import qos
from PIL import Image
from ptz_ros_world import World, until, world
from sensor_msgs.msg import CompressedImage
from sensor_msgs.msg import Image as RawImage


async def test_a_picture_shows_where_the_camera_looked(ros_domain, tmp_path) -> None:
    async with world(ros_domain, tmp_path) as it:
        await it.ready()
        it.point(30.0, -10.0)
        await until(lambda: it.joints_are(0.05, pan_joint=-30.0, tilt_joint=-10.0))
        await it.stands()
        picture = await it.driver.take_picture()
        assert picture.suffix == ".jpg"
        assert picture.content.startswith(b"\xff\xd8")
        assert b"pan 30.00 tilt -10.00" in picture.content
        again = await it.driver.take_picture()
        assert again.taken_us > picture.taken_us


async def test_images_are_listened_to_only_while_they_are_wanted(
    ros_domain, tmp_path, monkeypatch
) -> None:
    monkeypatch.setattr(images, "LINGER_S", 0.2)
    async with world(ros_domain, tmp_path) as it:
        await it.ready()
        topic = "/evsg2/camera/image_raw/compressed"
        assert it.ros.node.count_subscribers(topic) == 0
        await it.driver.take_picture()
        await it.driver.start_recording()
        await until(lambda: it.ros.node.count_subscribers(topic) == 1)
        await it.driver.stop_recording()
        await until(lambda: it.ros.node.count_subscribers(topic) == 0)


async def test_a_camera_that_shows_nothing_is_an_error(ros_domain, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(images, "WITHIN_S", 0.5)
    async with world(ros_domain, tmp_path) as it:
        await it.ready()
        await it.fault("blind")
        with pytest.raises(CameraError, match=r"its publisher sends none$"):
            await it.driver.take_picture()


async def test_what_is_no_picture_is_an_error(ros_domain, tmp_path) -> None:
    async with world(ros_domain, tmp_path) as it:
        await it.ready()
        await it.fault("garbled")
        with pytest.raises(CameraError, match="neither a JPEG nor a PNG"):
            await it.driver.take_picture()


TOPIC = "/evsg2/camera/image_raw/compressed"


def encoded(format_: str) -> bytes:
    """A picture with detail, by Pillow."""
    file = BytesIO()
    Image.effect_noise((160, 120), 60).save(file, format_)
    return file.getvalue()


@asynccontextmanager
async def published(it: World, *messages: object) -> AsyncIterator[None]:
    """Publish messages on the topic of images, one after the other, again and again."""
    publisher = it.ros.node.create_publisher(type(messages[0]), TOPIC, qos.TELEMETRY)

    async def publish() -> None:
        while True:
            for message in messages:
                publisher.publish(message)
                await asyncio.sleep(0.05)

    task = asyncio.create_task(publish())
    yield
    task.cancel()


@pytest.mark.parametrize("format_", ["JPEG", "PNG"])
async def test_half_a_picture_is_an_error(ros_domain, tmp_path, format_) -> None:
    whole = encoded(format_)
    half = CompressedImage(format=format_.lower(), data=whole[: len(whole) // 2])
    async with world(ros_domain, tmp_path, camera=False) as it:
        async with published(it, half):
            with pytest.raises(
                CameraError,
                match=rf"^the image of {len(half.data)} bytes on {TOPIC} cannot be decoded: .",
            ):
                await it.driver.take_picture()
        async with published(it, CompressedImage(format=format_.lower(), data=whole)):
            async with asyncio.timeout(20):
                while True:
                    try:
                        picture = await it.driver.take_picture()
                        break
                    except CameraError:  # the last half picture was on the way
                        continue
            assert picture.content == whole


async def test_half_pictures_are_left_out_of_a_video_which_says_so(ros_domain, tmp_path) -> None:
    whole = encoded("JPEG")
    filled = whole + bytes(7)
    contents = (whole, whole[: len(whole) // 2], filled)
    async with world(ros_domain, tmp_path, camera=False) as it:
        async with published(it, *(CompressedImage(format="jpeg", data=c) for c in contents)):
            while True:
                try:
                    await it.driver.start_recording()
                    break
                except CameraError as error:
                    assert "cannot be decoded" in error.reason  # the first one was a half
            (path,) = tmp_path.iterdir()
            await until(lambda: path.read_bytes().count(whole) > 4)
            with pytest.raises(CameraError, match=r"is not complete: \d+ images were cut off"):
                await it.driver.stop_recording()
        left = path.read_bytes().replace(whole, b"").replace(bytes(7), b"")
        assert left == b""


async def test_a_raw_image_is_an_error_that_names_the_type(
    ros_domain, tmp_path, monkeypatch
) -> None:
    monkeypatch.setattr(images, "WITHIN_S", 2.0)
    raw = RawImage(height=2, width=2, encoding="mono8", step=2, data=[1, 2, 3, 4])
    async with world(ros_domain, tmp_path, camera=False) as it, published(it, raw):
        with pytest.raises(
            CameraError,
            match=r"a publisher of sensor_msgs/msg/Image, and .*CompressedImage is expected$",
        ):
            await it.driver.take_picture()


async def test_a_video_is_a_file_of_pictures(ros_domain, tmp_path) -> None:
    async with world(ros_domain, tmp_path / "new") as it:
        await it.ready()
        await it.driver.start_recording()
        it.point(40.0, 0.0)
        await until(lambda: it.joints_are(pan_joint=-40.0))
        (path,) = (tmp_path / "new").iterdir()
        await until(lambda: b"pan 40.00" in path.read_bytes())
        await until(lambda: path.read_bytes().count(b"pan ") >= 2)
        told = await it.driver.stop_recording()
        assert Path(told) == path.absolute()
        assert path.name.startswith("evsg2_ptz_20")
        content = path.read_bytes()
        assert content.count(b"\xff\xd8\xff\xfe") == content.count(b"pan ") >= 2


@pytest.mark.long
async def test_two_videos_never_share_a_file(ros_domain, tmp_path) -> None:
    async with world(ros_domain, tmp_path) as it:
        await it.ready()
        for _ in range(3):
            await it.driver.start_recording()
            await it.driver.stop_recording()
        assert len(list(tmp_path.iterdir())) == 3


async def test_a_video_that_cannot_be_stored_is_an_error(ros_domain, tmp_path) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("not a folder")
    async with world(ros_domain, blocked) as it:
        await it.ready()
        with pytest.raises(CameraError, match="no video can be stored in"):
            await it.driver.start_recording()
        with pytest.raises(CameraError, match="no video was begun"):
            await it.driver.stop_recording()


def is_open(path: Path) -> bool:
    """Whether this process has a file open."""
    return any(each.resolve() == path for each in Path("/proc/self/fd").iterdir())


async def test_a_video_that_goes_on_ends_with_the_driver(ros_domain, tmp_path) -> None:
    async with world(ros_domain, tmp_path) as it:
        await it.ready()
        await it.driver.start_recording()
        (path,) = tmp_path.iterdir()
        assert is_open(path)
    assert not is_open(path)
    assert path.read_bytes().endswith(b"\xff\xd9")


class Full(FileIO):
    """A file whose last bytes find no space."""

    def close(self) -> None:
        was_open = not self.closed
        super().close()
        if was_open:
            raise OSError(28, "No space left on device")


@pytest.mark.long
async def test_a_disk_that_is_full_is_told_at_the_end(ros_domain, tmp_path, monkeypatch) -> None:
    async with world(ros_domain, tmp_path) as it:
        await it.ready()
        monkeypatch.setattr(Path, "open", lambda path, mode: Full(path, mode.replace("b", "")))
        await it.driver.start_recording()
        with pytest.raises(CameraError, match=r"is not complete: .*No space left"):
            await it.driver.stop_recording()
