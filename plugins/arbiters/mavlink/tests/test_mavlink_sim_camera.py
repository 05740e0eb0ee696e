"""The camera of a simulated vehicle."""

import math
from typing import Any

import pytest
from m2pem_plugin_mavlink.simulator.camera import Camera
from mavlink_bench import Bench
from pymavlink.dialects.v20 import ardupilotmega as dialect

CAMERA = 100
CAPTURED, STATUS = 263, 262


@pytest.fixture
def bench() -> Bench:
    return Bench(camera=True)


def to_camera(bench: Bench, command: int, *params: float) -> list[Any]:
    padded = [*params, *[0.0] * (7 - len(params))]
    message = dialect.MAVLink_command_long_message(1, CAMERA, command, 0, *padded)
    answers = bench.tell(message)
    of_camera = [each for each in answers if each.get_type() != "STATUSTEXT"]
    assert {each.get_srcComponent() for each in of_camera} == {CAMERA}
    return answers


def result(bench: Bench, command: int, *params: float) -> int:
    answers = to_camera(bench, command, *params)
    (ack,) = [each for each in answers if each.get_type() == "COMMAND_ACK"]
    return int(ack.result)


def camera(bench: Bench) -> Camera:
    (found,) = [each for each in bench.autopilot.components if isinstance(each, Camera)]
    return found


def pictures(bench: Bench) -> list[Any]:
    return [each for each in bench.received if each.get_msgId() == CAPTURED]


def asked(bench: Bench, id_: int) -> Any:
    return next(each for each in to_camera(bench, 512, id_) if each.get_msgId() == id_)


def test_a_simulated_camera_has_a_heartbeat_of_its_own(bench: Bench) -> None:
    bench.run(5)
    beats = [each for each in bench.received if each.get_msgId() == 0]
    cameras = [each for each in beats if each.get_srcComponent() == CAMERA]
    assert {each.type for each in cameras} == {dialect.MAV_TYPE_CAMERA}
    assert 4 <= len(cameras) <= 6


def test_without_one_nobody_answers() -> None:
    message = dialect.MAVLink_command_long_message(1, CAMERA, 512, 0, 259, 0, 0, 0, 0, 0, 0)
    assert Bench().tell(message) == []


def test_a_simulated_camera_tells_what_it_is(bench: Bench) -> None:
    information = asked(bench, 259)
    assert bytes(information.vendor_name).rstrip(b"\0") == b"m2pem"
    assert information.flags & dialect.CAMERA_CAP_FLAGS_CAPTURE_IMAGE
    assert asked(bench, 261).total_capacity > 0
    assert asked(bench, 260).zoomLevel == 0
    assert result(bench, 512, 24) == 3


def test_a_picture_is_told_of_with_its_place(bench: Bench) -> None:
    bench.airborne(20)
    assert result(bench, 2000, 0, 0, 1) == 0
    bench.run(1)
    (picture,) = pictures(bench)
    assert picture.capture_result == 1
    assert picture.relative_alt == pytest.approx(20_000, abs=500)
    assert picture.lat == pytest.approx(bench.offset(0, 0)[0] * 1e7, abs=20)
    assert asked(bench, STATUS).image_count == 1
    assert asked(bench, 261).used_capacity > 0


def test_a_series_has_as_many_pictures_as_were_asked_for(bench: Bench) -> None:
    assert result(bench, 2000, 0, 2, 3) == 0
    assert result(bench, 2000, 0, 0, 1) == 1
    bench.run(1)
    assert asked(bench, STATUS).image_status == 2
    bench.run(20)
    assert [each.image_index for each in pictures(bench)] == [0, 1, 2]
    assert asked(bench, STATUS).image_status == 0


def test_a_series_without_an_end_goes_on_until_it_is_stopped(bench: Bench) -> None:
    assert result(bench, 2000, 0, 1, 0) == 0
    bench.run(10)
    assert result(bench, 2001) == 0
    count = len(pictures(bench))
    assert 9 <= count <= 11
    bench.run(5)
    assert len(pictures(bench)) == count


def test_a_video_is_recorded(bench: Bench) -> None:
    assert result(bench, 2500, 0, 1, 0) == 0
    bench.run(4)
    status = asked(bench, STATUS)
    assert status.video_status == 1
    assert status.recording_time_ms == pytest.approx(4000, abs=100)
    assert result(bench, 2501) == 0
    assert asked(bench, STATUS).video_status == 0


def test_a_simulated_camera_zooms_by_steps_on_and_on_and_to_a_place(bench: Bench) -> None:
    zoom = dialect.MAV_CMD_SET_CAMERA_ZOOM
    assert result(bench, zoom, 2, 40) == 0
    assert asked(bench, 260).zoomLevel == 40
    assert result(bench, zoom, 0, -1) == 0
    assert asked(bench, 260).zoomLevel == 30
    assert result(bench, zoom, 1, 1) == 0
    bench.run(2)
    assert result(bench, zoom, 1, 0) == 0
    assert asked(bench, 260).zoomLevel == pytest.approx(70, abs=2)
    assert result(bench, zoom, 2, 140) == 2
    assert result(bench, zoom, 0, math.nan) == 2


def test_what_makes_no_sense_is_denied(bench: Bench) -> None:
    assert result(bench, 2000, 0, 0.01, 5) == 2
    assert result(bench, 2000, 0, 1, -3) == 2
    assert result(bench, dialect.MAV_CMD_NAV_TAKEOFF) == 3


def test_the_autopilot_takes_no_command_for_the_camera(bench: Bench) -> None:
    assert bench.command(2000, 0, 0, 1) == 3
    bench.run(1)
    assert not pictures(bench)


def test_a_picture_with_a_number_is_taken_once(bench: Bench) -> None:
    for number in (5, 5, 6, 6):
        assert result(bench, 2000, 0, 0, 1, number) == 0
        bench.run(1)
    assert [each.image_index for each in pictures(bench)] == [0, 1]


def test_a_simulated_camera_tells_of_a_picture_again_if_it_is_asked(bench: Bench) -> None:
    camera(bench).untold = 1
    assert result(bench, 2000, 0, 0, 1) == 0
    bench.run(1)
    assert not pictures(bench)
    answers = to_camera(bench, 512, CAPTURED, 0)
    assert [each.image_index for each in answers if each.get_msgId() == CAPTURED] == [0]
    assert result(bench, 512, CAPTURED, 1) == dialect.MAV_RESULT_DENIED


def test_a_picture_that_it_cannot_take_it_tells_of(bench: Bench) -> None:
    camera(bench).spoilt = 1
    assert result(bench, 2000, 0, 0, 1) == 0
    bench.run(1)
    assert [each.capture_result for each in pictures(bench)] == [0]
    assert asked(bench, STATUS).image_count == 0


def test_a_full_camera_takes_and_records_nothing_more(bench: Bench) -> None:
    bench.autopilot.injected_faults.camera_full = True
    assert result(bench, 2000, 0, 0, 1) == dialect.MAV_RESULT_FAILED
    assert result(bench, 2500) == dialect.MAV_RESULT_FAILED
    assert asked(bench, 261).available_capacity == 0
    assert "Camera: storage full" in bench.texts()
    bench.autopilot.injected_faults.camera_full = False
    assert result(bench, 2000, 0, 0, 1) == 0
