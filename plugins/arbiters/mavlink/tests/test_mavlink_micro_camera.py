"""The basics of cameras, on links that lose, double, delay and reorder."""

from collections.abc import Sequence
from typing import Any

import pytest
from m2pem_plugin_mavlink.microservices.camera import (
    Camera,
    FindCamera,
    ReadCaptureStatus,
    ReadZoom,
    camera_mode,
    start_video,
    stop_video,
    stop_zoom,
    take_image,
    zoom,
)
from m2pem_plugin_mavlink.protocol.messages import Message, message_type
from m2pem_plugin_mavlink.protocol.transaction import RETRIES, NoAnswerError
from mavlink_lossy import VEHICLE, Played, play_table, run
from mavlink_peers import Commanded, ack
from pymavlink.dialects.v20 import ardupilotmega as dialect


def photographs(command: Any, vehicle: Commanded) -> Sequence[Message]:
    """One image for each sequence number, as the specification says."""
    if command.param4 not in vehicle.effects:
        vehicle.effects.append(command.param4)
    return (ack(command.command),)


def tells(command: Any, vehicle: Commanded) -> Sequence[Message]:
    name = {259: "CAMERA_INFORMATION", 260: "CAMERA_SETTINGS", 262: "CAMERA_CAPTURE_STATUS"}
    type_ = message_type(name[int(command.param1)])
    fields: dict[str, Any] = {
        "CAMERA_INFORMATION": {
            "vendor_name": tuple(b"Maker".ljust(32, b"\0")),
            "model_name": tuple(b"Eye".ljust(32, b"\0")),
            "flags": dialect.CAMERA_CAP_FLAGS_CAPTURE_IMAGE,
        },
        "CAMERA_SETTINGS": {"zoomLevel": 25.0},
        "CAMERA_CAPTURE_STATUS": {"video_status": 1, "recording_time_ms": 2500, "image_count": 9},
    }[type_.name]
    return ack(command.command), type_.make(**fields)


def test_one_image_is_taken_or_it_fails_clearly_whatever_the_link_does() -> None:
    def check(played: Played, camera: Commanded) -> None:
        assert camera.effects in ([], [5])
        assert isinstance(played.error, NoAnswerError) or camera.effects == [5]

    play_table(
        lambda: (take_image(VEHICLE, 5), Commanded(photographs)),
        check,
        lambda _: RETRIES.bound_s,
    )


@pytest.mark.parametrize(
    ("command", "id_", "params"),
    [
        (take_image(VEHICLE, 5, 2), dialect.MAV_CMD_IMAGE_START_CAPTURE, (2, 0, 1, 5)),
        (start_video(VEHICLE, 1.0, 2), dialect.MAV_CMD_VIDEO_START_CAPTURE, (0, 1.0, 2)),
        (stop_video(VEHICLE, 2), dialect.MAV_CMD_VIDEO_STOP_CAPTURE, (0, 2)),
        (zoom(VEHICLE, 0.25), dialect.MAV_CMD_SET_CAMERA_ZOOM, (2, 25.0, 0)),
        (stop_zoom(VEHICLE), dialect.MAV_CMD_SET_CAMERA_ZOOM, (1, 0.0, 0)),
        (camera_mode(VEHICLE, 1), dialect.MAV_CMD_SET_CAMERA_MODE, (0, 1)),
    ],
)
def test_what_is_sent_to_cameras(command: Any, id_: int, params: tuple[float, ...]) -> None:
    camera = Commanded(lambda heard, _: (ack(heard.command),))
    assert run(command, camera).error is None
    (heard,) = camera.received
    assert heard.command == id_
    assert tuple(heard)[: len(params)] == params


def test_what_cameras_tell_of_themselves() -> None:
    camera = run(FindCamera(VEHICLE), Commanded(tells)).result
    assert (camera.model, camera.device) == ("Eye", 0)
    assert camera.has(dialect.CAMERA_CAP_FLAGS_CAPTURE_IMAGE)
    assert not camera.has(dialect.CAMERA_CAP_FLAGS_CAPTURE_VIDEO)
    assert (camera.takes_images, camera.records, camera.zooms) == (True, False, False)

    status = run(ReadCaptureStatus(VEHICLE), Commanded(tells)).result
    assert (status.takes_images, status.records) == (False, True)
    assert status.images == 9

    assert run(ReadZoom(VEHICLE), Commanded(tells)).result == 0.25


def test_another_camera_behind_the_same_autopilot_is_not_meant() -> None:
    assert isinstance(run(FindCamera(VEHICLE, 2), Commanded(tells)).error, NoAnswerError)


@pytest.mark.parametrize(
    ("flags", "for_images", "for_videos"),
    [
        (0, None, None),
        (dialect.CAMERA_CAP_FLAGS_HAS_MODES, 0, 1),
        (
            dialect.CAMERA_CAP_FLAGS_HAS_MODES
            | dialect.CAMERA_CAP_FLAGS_CAN_CAPTURE_IMAGE_IN_VIDEO_MODE,
            None,
            1,
        ),
        (
            dialect.CAMERA_CAP_FLAGS_HAS_MODES
            | dialect.CAMERA_CAP_FLAGS_CAN_CAPTURE_VIDEO_IN_IMAGE_MODE,
            0,
            None,
        ),
    ],
)
def test_a_camera_with_modes_must_be_in_one_of_them(
    flags: int, for_images: int | None, for_videos: int | None
) -> None:
    camera = Camera(VEHICLE, 0, "Eye", flags)
    assert (camera.mode_for(video=False), camera.mode_for(video=True)) == (for_images, for_videos)
