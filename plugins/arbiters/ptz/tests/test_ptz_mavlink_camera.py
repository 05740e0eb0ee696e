"""Pictures, videos and zoom over MAVLink."""

import asyncio
from dataclasses import replace

import pytest
from m2pem_plugin_mavlink.simulator.messages import Result
from m2pem_plugin_ptz.drivers.driver import CameraError
from ptz_mavlink_world import until, world

from m2pem.testing.loopback import on_loopback

IMAGE_START, VIDEO_START, ZOOM = 2000, 2500, 531


@on_loopback
async def test_a_picture_is_what_the_camera_calls_it() -> None:
    async with world() as it:
        await it.ready("take_picture")
        first = await it.driver.take_picture()
        second = await it.driver.take_picture()
        assert (first.content, first.reference, first.suffix) == (None, "/00000.jpg", ".jpg")
        assert second.reference == "/00001.jpg"
        assert second.taken_us > first.taken_us
        assert it.camera.pictures == 2


@on_loopback
async def test_a_camera_that_never_answers_is_asked_for_seldom_and_still_found() -> None:
    """An autopilot without a camera acknowledges the question, and answers nothing."""
    async with world() as it:
        pilot, withheld = it.real.autopilot, []
        real, answers = pilot.send, False

        def send(message, *to):
            if message.get_type() == "CAMERA_INFORMATION" and not answers:
                withheld.append(pilot.now_s)
            else:
                real(message, *to)

        pilot.send = send
        await until(lambda: withheld and pilot.now_s > withheld[-1] + 20.0)
        often = len(withheld)
        answers = True
        await until(lambda: it.driver.refusal("take_picture") == "")
        assert often < 40, "each of five questions is asked a few times"


@on_loopback
async def test_pictures_that_are_asked_for_at_once_are_taken_one_after_another() -> None:
    async with world() as it:
        await it.ready("take_picture")
        taken = await asyncio.gather(*(it.driver.take_picture() for _ in range(3)))
        assert [each.reference for each in taken] == ["/00000.jpg", "/00001.jpg", "/00002.jpg"]


@on_loopback
async def test_a_picture_whose_message_is_lost_is_asked_for() -> None:
    async with world() as it:
        await it.ready("take_picture")
        await it.driver.take_picture()
        it.camera.untold = 1
        assert (await it.driver.take_picture()).reference == "/00001.jpg"
        assert it.camera.pictures == 2


@on_loopback
async def test_a_command_whose_answer_is_lost_takes_one_picture() -> None:
    async with world() as it:
        await it.ready("take_picture")
        pilot, lost = it.real.autopilot, []
        real = pilot.send

        def send(message, *to):
            is_answer = message.get_type() == "COMMAND_ACK" and message.command == IMAGE_START
            if is_answer and not lost:
                lost.append(message)
            else:
                real(message, *to)

        pilot.send = send
        assert (await it.driver.take_picture()).reference == "/00000.jpg"
        assert lost
        assert it.camera.pictures == 1


@on_loopback
async def test_a_picture_that_could_not_be_taken_is_an_error() -> None:
    async with world() as it:
        await it.ready("take_picture")
        it.camera.spoilt = 1
        with pytest.raises(CameraError, match="could not take the picture"):
            await it.driver.take_picture()
        await it.driver.take_picture()


@on_loopback
async def test_a_picture_that_never_comes_is_an_error() -> None:
    async with world() as it:
        await it.ready("take_picture")
        it.real.faults.refuse_command(IMAGE_START, Result.ACCEPTED)  # and nothing is done
        with pytest.raises(CameraError, match="has taken none in 10 s"):
            await it.driver.take_picture()


@on_loopback
async def test_a_full_storage_is_an_error_that_says_so() -> None:
    async with world() as it:
        await it.ready("take_picture")
        it.real.autopilot.injected_faults.camera_full = True
        with pytest.raises(CameraError, match="storage full"):
            await it.driver.take_picture()
        with pytest.raises(CameraError, match="storage full"):
            await it.driver.start_recording()
        it.real.autopilot.injected_faults.camera_full = False
        await it.driver.take_picture()


@on_loopback
async def test_a_camera_that_is_busy_is_waited_for() -> None:
    async with world() as it:
        await it.ready("take_picture")
        busy = Result.TEMPORARILY_REJECTED
        it.real.faults.refuse_command(IMAGE_START, busy, times=2)
        assert (await it.driver.take_picture()).reference == "/00000.jpg"


@on_loopback
async def test_a_camera_that_falls_silent_is_an_error() -> None:
    async with world() as it:
        await it.ready("take_picture")
        it.real.faults.cut_link()
        with pytest.raises(CameraError, match="no answer"):
            await it.driver.take_picture()


@on_loopback
async def test_a_video_is_begun_and_ended() -> None:
    async with world() as it:
        await it.ready("record_video")
        await it.driver.start_recording()
        assert it.camera.recording
        name = await it.driver.stop_recording()
        assert not it.camera.recording
        assert name.startswith("video of 20")
        assert name.endswith("in camera 1/100")


@on_loopback
async def test_a_camera_that_does_not_record_says_why() -> None:
    async with world() as it:
        await it.ready("record_video")
        it.real.faults.refuse_command(VIDEO_START, Result.DENIED, "Camera: no card")
        with pytest.raises(CameraError, match="no card"):
            await it.driver.start_recording()


@on_loopback
async def test_a_camera_zooms_to_a_factor_and_says_so() -> None:
    async with world() as it:
        await it.ready()
        await it.ready("zoom")
        it.driver.zoom(6.0)
        await until(lambda: it.driver.ptz.zoom == pytest.approx(6.0))
        assert it.camera.zoom == pytest.approx(50.0)
        it.driver.zoom(1.0)
        await until(lambda: it.driver.ptz.zoom == pytest.approx(1.0))


@on_loopback
async def test_zoom_that_somebody_else_changes_is_seen() -> None:
    async with world() as it:
        await it.ready()
        await it.ready("zoom")
        it.camera.zoom = 20.0
        await until(lambda: it.driver.ptz.zoom == pytest.approx(3.0))


@on_loopback
async def test_halt_stops_a_zoom_on_its_way() -> None:
    async with world() as it:
        await it.ready()
        await it.ready("zoom")
        told = []
        real = it.camera.command_server.handlers[ZOOM]

        def slowly(command):
            told.append((command.param1, command.param2))
            to_range = command.param1 == 2
            return real(replace(command, param1=1, param2=0.1) if to_range else command)

        it.camera.command_server.handlers[ZOOM] = slowly
        it.driver.zoom(11.0)
        await until(lambda: it.camera.zoom > 10.0)
        it.driver.halt()
        await until(lambda: (1, 0) in told)
        stood = it.camera.zoom
        await it.clock.sleep(1.0)
        assert it.camera.zoom == stood < 90.0


@on_loopback
async def test_a_vehicle_without_a_camera_says_who_did_not_answer() -> None:
    async with world(spec={"camera": False}) as it:
        await it.ready()
        assert "component 100 and 1 of system 1" in it.driver.refusal("take_picture")
        with pytest.raises(CameraError, match="component 100 and 1"):
            await it.driver.take_picture()
