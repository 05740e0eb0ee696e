"""Pictures and videos over ROS."""

from io import FileIO
from pathlib import Path

import pytest
from m2pem_plugin_ptz.drivers.driver import CameraError
from m2pem_plugin_ptz.drivers.ros import images
from ptz_ros_world import until, world


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
