"""Pictures and videos: what is stored, under which names, and what the mission gets."""

import errno
import json
from pathlib import Path

import pytest
from m2pem_plugin_ptz import image_files
from m2pem_plugin_ptz.gimbal import CapturedImage
from m2pem_plugin_ptz.image_files import ImageMetadata, store_image
from ptz_fake_camera import Gimbal, rad
from ptz_world import CAMERA, START_US, play

from m2pem.api import BehaviorState
from m2pem.testing.contracts.arbiter_harness import ORIGIN

CAPTION = ImageMetadata("r1.b3", 1, START_US, None, {"run": "r1"})
PICTURE = CapturedImage(START_US, b"jpeg")


def test_pictures_are_stored_with_what_is_known_of_them(tmp_path):
    async def main(world):
        world.gimbal.pan, world.gimbal.tilt = rad(30), rad(-20)
        end = await world.do("take_picture", id_="r7.b12", count=2, interval=3.0)
        assert end.state is BehaviorState.SUCCEEDED
        return dict(end.outputs)

    outputs = play(main, moves=lambda _: {"yaw": 0.0, "roll_rad": rad(3)}, pictures=str(tmp_path))
    first, second = (tmp_path / "r7" / f"b12_{number}.jpg" for number in (1, 2))
    assert outputs["picture.files"] == [str(first), str(second)]
    assert outputs["picture.file"] == str(second)
    assert outputs["picture.position"] == pytest.approx([*ORIGIN[:2], ORIGIN[2] + 2], abs=0.01), (
        "of the camera, on its mast"
    )
    assert outputs["picture.time"].startswith("2026-01-01T00:00:03.5")
    assert first.read_bytes() == b"picture 1"
    notes = json.loads(second.with_suffix(".json").read_text())
    assert (notes["camera"], notes["run"], notes["behavior"], notes["number"]) == (
        *("ugv/ptz", "r7", "r7.b12", 2),
    )
    assert notes["time"] == outputs["picture.time"]
    assert notes["file"] == str(second)
    assert notes["vehicle"]["heading_deg"] == pytest.approx(90)
    assert notes["vehicle"]["roll_deg"] == pytest.approx(3)
    assert notes["look"]["pan_deg"] == pytest.approx(30)
    assert notes["look"]["heading_deg"] == pytest.approx(119, abs=2)
    assert notes["look"]["view_deg"] == pytest.approx([60, 34])
    assert len(notes["footprint"]) > 3
    assert sorted(path.name for path in (tmp_path / "r7").iterdir()) == [
        *("b12_1.jpg", "b12_1.json", "b12_2.jpg", "b12_2.json"),
    ]


def test_the_interval_is_from_one_picture_to_the_next(tmp_path):
    async def main(world):
        began = world.seconds
        await world.do("take_picture", count=4, interval=2.0)
        assert world.seconds - began == pytest.approx(3 * 2.0 + world.gimbal.picture_s, abs=0.3)

    play(main, pictures=str(tmp_path))


def test_what_was_taken_before_a_restart_is_kept(tmp_path):
    first = store_image(tmp_path, PICTURE, CAPTION)
    again = store_image(tmp_path, CapturedImage(START_US, b"other"), CAPTION)
    assert (Path(first).name, Path(again).name) == ("b3_1.jpg", "b3_2.jpg")
    assert Path(first).read_bytes() == b"jpeg"


def test_a_picture_that_the_camera_keeps_is_known_by_its_reference(tmp_path):
    kept = CapturedImage(START_US, None, reference="mftp://[;comp=100]/DCIM/1.jpg")
    assert store_image(tmp_path, kept, CAPTION) == kept.reference
    notes = json.loads((tmp_path / "r1" / "b3_1.json").read_text())
    assert notes["reference"] == kept.reference
    assert store_image(tmp_path, kept, CAPTION) == kept.reference
    assert (tmp_path / "r1" / "b3_2.json").exists()


def test_names_lead_nowhere_else(tmp_path):
    caption = ImageMetadata("../../r1.b/3", 1, START_US, None, {})
    file = Path(store_image(tmp_path, CapturedImage(START_US, b"x", suffix="/../x"), caption))
    assert file.parent.parent == tmp_path
    assert file.suffix == ".jpg"


def test_a_card_that_knows_no_links_stores_pictures_too(tmp_path, monkeypatch):
    def link(*_):
        raise OSError(errno.EPERM, "Operation not permitted")

    monkeypatch.setattr(image_files.os, "link", link)
    names = [Path(store_image(tmp_path, PICTURE, CAPTION)).name for _ in range(2)]
    assert names == ["b3_1.jpg", "b3_2.jpg"]


def test_a_full_disk_leaves_nothing_half_done(tmp_path, monkeypatch):
    def full(_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(image_files.os, "fsync", full)
    with pytest.raises(OSError, match="No space"):
        store_image(tmp_path, PICTURE, CAPTION)
    assert list((tmp_path / "r1").iterdir()) == []


def test_a_disk_that_gets_full_ends_the_behavior_with_the_pictures_that_were_stored(
    tmp_path, monkeypatch
):
    stores = []

    def store(folder, picture, caption):
        stores.append(caption.number)
        if len(stores) == 3:
            raise OSError(errno.ENOSPC, "No space left on device")
        return store_image(folder, picture, caption)

    monkeypatch.setattr("m2pem_plugin_ptz.behaviors.capture.store_image", store)

    async def main(world):
        return await world.do("take_picture", count=5, interval=1.0)

    end = play(main, pictures=str(tmp_path))
    assert (end.state, end.code) == (BehaviorState.FAILED, "FAILED")
    assert end.reason == f"cannot store a picture in {tmp_path}: No space left on device"
    assert len(end.outputs["picture.files"]) == 2


def test_a_folder_that_cannot_be_made_is_a_failure_with_the_reason(tmp_path):
    (tmp_path / "file").write_text("")

    async def main(world):
        return await world.do("take_picture")

    end = play(main, pictures=str(tmp_path / "file" / "below"))
    assert end.state is BehaviorState.FAILED
    assert end.reason.endswith("below: Not a directory")


def test_a_camera_that_takes_no_picture_is_a_failure_with_its_reason(tmp_path):
    gimbal = Gimbal()
    gimbal.refuses["picture"] = "the storage is full"

    async def main(world):
        return await world.do("take_picture")

    end = play(main, gimbal, pictures=str(tmp_path))
    assert (end.state, end.reason) == (BehaviorState.FAILED, "the storage is full")


def test_cancelled_pictures_are_written_as_far_as_they_were_taken(tmp_path):
    async def main(world):
        await world.bench.start("r1.b1", "take_picture", CAMERA, count=50, interval=1.0)
        await world.clock.sleep(2.6)
        await world.bench.arbiter.cancel("r1.b1", 1)
        return await world.bench.ended("r1.b1", 5)

    end = play(main, pictures=str(tmp_path))
    assert end.state is BehaviorState.CANCELLED
    assert len(end.outputs["picture.files"]) == 3


def test_a_hold_finishes_the_picture_and_takes_no_more(tmp_path):
    async def main(world):
        await world.bench.start("r1.b1", "take_picture", CAMERA, count=3, interval=1.0)
        await world.until(lambda: "take_picture" in world.gimbal.calls)
        await world.bench.arbiter.hold(CAMERA)
        await world.clock.sleep(30)
        assert world.gimbal.calls.count("take_picture") == 1
        await world.bench.arbiter.resume(CAMERA)
        return await world.bench.ended("r1.b1", 10)

    end = play(main, pictures=str(tmp_path))
    assert len(end.outputs["picture.files"]) == 3


def test_where_nobody_knows_the_vehicle_pictures_are_taken_all_the_same(tmp_path):
    async def main(world):
        return await world.do("take_picture")

    end = play(main, moves=None, pictures=str(tmp_path))
    assert end.state is BehaviorState.SUCCEEDED
    assert end.outputs["picture.position"] is None


# --- videos -------------------------------------------------------------------------------------


def test_a_video_lasts_for_its_duration():
    async def main(world):
        began = world.seconds
        end = await world.do("record_video", duration=12.0)
        assert end.state is BehaviorState.SUCCEEDED
        assert world.seconds - began == pytest.approx(12, abs=0.2)
        assert end.outputs == {
            "video.file": "/media/video.mp4",
            "video.time": "2026-01-01T00:00:00.300000Z",
        }
        assert not world.gimbal.recording

    play(main)


def test_a_cancelled_video_is_stopped_and_written():
    async def main(world):
        await world.bench.start("r1.b1", "record_video", CAMERA)
        await world.clock.sleep(5)
        assert world.gimbal.recording
        await world.bench.arbiter.cancel("r1.b1", 1)
        end = await world.bench.ended("r1.b1", 5)
        assert (end.state, end.outputs["video.file"]) == (
            BehaviorState.CANCELLED,
            "/media/video.mp4",
        )
        assert not world.gimbal.recording

    play(main)


def test_a_behavior_that_takes_over_ends_the_video_first():
    async def main(world):
        await world.bench.start("r1.b1", "record_video", CAMERA)
        await world.clock.sleep(5)
        again = {"preempts": ("r1.b1",), "bearing": 0.5, "elevation": 0.0}
        await world.bench.start("r1.b2", "ptz_point_at", CAMERA, **again)
        assert (await world.bench.ended("r1.b2", 10)).state is BehaviorState.SUCCEEDED
        assert world.gimbal.calls.count("stop_recording") == 1

    play(main)


def test_a_video_that_does_not_begin_is_a_failure():
    gimbal = Gimbal()
    gimbal.refuses["recording"] = "there is no card"

    async def main(world):
        end = await world.do("record_video")
        assert (end.state, end.reason) == (BehaviorState.FAILED, "there is no card")
        assert BehaviorState.RUNNING not in world.bench.states_of("r1.b1")

    play(main, gimbal)


def test_a_video_that_does_not_stop_is_not_said_to_be_cancelled():
    async def main(world):
        await world.bench.start("r1.b1", "record_video", CAMERA)
        await world.clock.sleep(5)
        world.gimbal.recording = False
        await world.bench.arbiter.cancel("r1.b1", 1)
        end = await world.bench.ended("r1.b1", 12)
        assert (end.state, end.reason) == (
            BehaviorState.FAILED,
            "the camera did not stop: it does not record",
        )

    play(main)
