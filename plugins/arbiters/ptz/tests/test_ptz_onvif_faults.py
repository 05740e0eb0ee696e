"""Cameras that are away, wrong passwords, wrong clocks, faults, stuck motors."""

import asyncio
import re
import sys

import pytest
from m2pem_plugin_ptz.drivers.driver import CameraError
from m2pem_plugin_ptz.drivers.onvif import session, steering
from m2pem_plugin_ptz.gimbal import PanTiltZoom
from m2pem_plugin_ptz.simulator.onvif.camera import CameraSpec
from m2pem_plugin_ptz.simulator.onvif.server import OnvifServer
from m2pem_plugin_ptz.simulator.onvif.services import device, ptz
from onvif_bench import ACCOUNT, ANSWERS_S, camera, driven, until, write_credentials

from m2pem.errors import PluginError
from m2pem.testing.loopback import on_loopback


# In real time: in virtual time one of many runs does not find the camera.
async def test_a_camera_that_is_switched_on_later_is_found(tmp_path, caplog):
    async with camera() as server:
        port = server.port
    async with driven(server, tmp_path) as bench:
        await until(lambda: "does not answer" in bench.driver.refusal("ptz_point_at"))
        assert bench.heard == 0
        with pytest.raises(CameraError, match="does not answer"):
            await bench.driver.take_picture()
        bench.driver.point(0.4, 0.0)
        async with OnvifServer(CameraSpec(latency_s=ANSWERS_S), port=port):
            await until(lambda: bench.looks_at(0.4, 0.0))
            assert bench.driver.refusal("ptz_point_at") == ""
    said = [each.message for each in caplog.records if "does not answer" in each.message]
    assert len(set(said)) == len(said), "it is said once"


@on_loopback
async def test_a_camera_that_reboots_with_another_clock_is_taken_up_again(tmp_path):
    async with camera(account=ACCOUNT) as server, driven(server, tmp_path) as bench:
        await bench.ready()
        bench.driver.point(0.6, 0.0)
        await until(lambda: bench.looks_at(0.6, 0.0))
        await server.faults.switch_off()
        server.faults.clock(-1e8)
        await until(lambda: "does not answer" in bench.driver.refusal("ptz_point_at"))
        heard = bench.heard
        await server.faults.switch_on()
        await until(lambda: bench.heard > heard + 3)
        await until(lambda: server.camera.ptz[0] > 0.59)
        assert bench.driver.refusal("ptz_point_at") == ""


@on_loopback
async def test_a_camera_with_another_clock_that_checks_every_token_is_taken_up(
    tmp_path, monkeypatch
):
    """onvif-zeep-async 4.3.0 forgets the camera's clock before it asks GetServices."""
    monkeypatch.setattr(device, "FREE", frozenset({"GetSystemDateAndTime"}))
    wrong = camera(account=ACCOUNT, skew_s=7200.0)
    async with wrong as server, driven(server, tmp_path) as bench:
        await bench.ready()
        assert server.camera.calls["GetServices"] == 1


@on_loopback
async def test_a_position_that_is_no_number_is_said_so(tmp_path, monkeypatch):
    truly = ptz.OPERATIONS["GetStatus"]

    def status(of, asked, base):
        return re.sub(r'PanTilt x="[^"]*"', 'PanTilt x="NaN"', truly(of, asked, base))

    async with camera() as server, driven(server, tmp_path) as bench:
        await bench.ready()
        monkeypatch.setitem(ptz.OPERATIONS, "GetStatus", status)
        await until(lambda: "a position that is not finite" in bench.driver.refusal("zoom"))
        assert bench.driver.ptz == PanTiltZoom(0.0, 0.0)


@on_loopback
async def test_a_clock_that_is_set_while_it_works_costs_no_more_than_a_moment(tmp_path):
    async with camera(account=ACCOUNT) as server, driven(server, tmp_path) as bench:
        await bench.ready()
        server.faults.clock(7200.0)
        await until(lambda: server.camera.calls["GetSystemDateAndTime"] >= 2)
        heard = bench.heard
        await until(lambda: bench.heard > heard + 2, 10.0)
        assert bench.driver.refusal("take_picture") == ""


@on_loopback
async def test_a_wrong_password_is_the_files_fault_and_tried_again_when_it_changes(
    tmp_path, caplog
):
    path = str(write_credentials(tmp_path, "wrong one"))
    locked = camera(account=ACCOUNT)
    async with locked as server, driven(server, tmp_path, credentials=path) as bench:
        await until(lambda: "refuses user 'operator'" in bench.driver.refusal("zoom"))
        assert f"correct user or password in {path}" in bench.driver.refusal("zoom")
        assert bench.heard == 0
        write_credentials(tmp_path)
        await bench.ready()
        assert server.camera.calls["GetServices"] <= 3, "it did not knock again and again"
    assert "wrong one" not in caplog.text
    assert ACCOUNT.password not in caplog.text


@on_loopback
async def test_a_camera_that_asks_for_a_password_gets_the_fleet_told_how_to_say_it(tmp_path):
    locked = camera(account=ACCOUNT)
    async with locked as server, driven(server, tmp_path, credentials=None) as bench:
        await until(lambda: "connection.credentials" in bench.driver.refusal("zoom"))


@on_loopback
async def test_a_password_that_others_may_read_does_not_leave_the_machine(tmp_path):
    path = write_credentials(tmp_path)
    path.chmod(0o644)
    async with camera(account=ACCOUNT) as server:
        with pytest.raises(PluginError, match="chmod 600"):
            async with driven(server, tmp_path, credentials=str(path)):
                pass
        assert not server.camera.calls


@on_loopback
async def test_a_user_who_is_locked_out_on_the_way_is_said_so(tmp_path):
    async with camera(account=ACCOUNT) as server, driven(server, tmp_path) as bench:
        await bench.ready()
        server.faults.locked(True)
        await until(lambda: "refuses user 'operator'" in bench.driver.refusal("ptz_point_at"))


@on_loopback
async def test_a_fault_is_told_and_gone_when_the_camera_obeys_again(tmp_path, caplog):
    async with camera() as server, driven(server, tmp_path) as bench:
        await bench.ready()
        server.faults.refuse("the motor is too hot")
        bench.driver.point(0.5, 0.0)
        await until(lambda: "the motor is too hot" in bench.driver.refusal("ptz_point_at"))
        assert "refuses AbsoluteMove" in bench.driver.refusal("ptz_point_at")
        assert bench.driver.refusal("take_picture") == ""
        server.faults.refuse("")
        await until(lambda: bench.looks_at(0.5, 0.0))
        assert bench.driver.refusal("ptz_point_at") == ""
    assert caplog.text.count("the motor is too hot") == 1


@on_loopback
async def test_a_fault_of_what_was_wanted_before_does_not_count_after_a_halt(tmp_path):
    async with camera() as server, driven(server, tmp_path) as bench:
        await bench.ready()
        server.faults.refuse("no")
        bench.driver.point(0.5, 0.0)
        await until(lambda: bench.driver.refusal("ptz_point_at"))
        bench.driver.halt()
        assert bench.driver.refusal("ptz_point_at") == ""


@on_loopback
async def test_a_head_that_does_not_turn_is_noticed(tmp_path, monkeypatch):
    monkeypatch.setattr(steering, "AGAIN_S", 0.3)
    async with camera() as server, driven(server, tmp_path) as bench:
        await bench.ready()
        server.faults.stuck(True)
        bench.driver.point(0.5, 0.0)
        await until(lambda: "does not turn" in bench.driver.refusal("ptz_point_at"))
        server.faults.stuck(False)
        await until(lambda: bench.looks_at(0.5, 0.0))
        assert bench.driver.refusal("ptz_point_at") == ""


@on_loopback
async def test_a_silent_camera_is_not_heard_and_then_heard_again(tmp_path):
    async with camera() as server, driven(server, tmp_path, timeout="0.3 s") as bench:
        await bench.ready()
        server.faults.silent(True)
        await until(lambda: "nothing within 0.3 s" in bench.driver.refusal("zoom"))
        heard = bench.heard
        bench.driver.point(0.3, 0.0)
        server.faults.silent(False)
        await until(lambda: bench.looks_at(0.3, 0.0))
        assert bench.heard > heard


@on_loopback
async def test_a_slow_camera_is_still_pointed(tmp_path):
    async with camera() as server, driven(server, tmp_path) as bench:
        await bench.ready()
        server.faults.slow(0.6)
        bench.driver.point(-0.8, 0.1)
        await until(lambda: bench.looks_at(-0.8, 0.1))


@on_loopback
async def test_a_full_storage_is_an_error_of_the_recording(tmp_path):
    async with camera() as server, driven(server, tmp_path) as bench:
        await bench.ready()
        server.camera.fault_state.full = True
        with pytest.raises(CameraError, match="the storage is full"):
            await bench.driver.start_recording()
        with pytest.raises(CameraError, match="is not recording"):
            await bench.driver.stop_recording()


@on_loopback
async def test_a_recording_that_a_reboot_ended_does_not_stand_in_the_way_of_the_next(tmp_path):
    async with camera() as server, driven(server, tmp_path) as bench:
        await bench.ready()
        await bench.driver.start_recording()
        server.camera.restart()
        with pytest.raises(CameraError, match="refuses SetRecordingJobMode: there is no job"):
            await bench.driver.stop_recording()
        await bench.driver.start_recording()
        assert server.camera.recording


@on_loopback
async def test_what_is_no_onvif_camera_is_said_so(tmp_path):
    async def web_page(reader, writer):
        await reader.read(100)
        writer.write(b"HTTP/1.1 200 OK\r\nContent-Length: 4\r\nConnection: close\r\n\r\nhey!")
        await writer.drain()
        writer.close()

    page = await asyncio.start_server(web_page, "127.0.0.1", 0)
    async with page, camera() as server:
        server.port, kept = page.sockets[0].getsockname()[1], server.port
        async with driven(server, tmp_path) as bench:
            await until(lambda: "with invalid ONVIF" in bench.driver.refusal("zoom"))
            assert bench.heard == 0
        server.port = kept


@on_loopback
async def test_nothing_is_left_after_close(tmp_path):
    before = asyncio.all_tasks()
    async with camera() as server:
        async with driven(server, tmp_path) as bench:
            await bench.ready()
            bench.driver.point(1.0, 0.0)
            bench.driver.halt()
        await bench.driver.close()
    left = {task for task in asyncio.all_tasks() - before if not task.done()}
    assert not {task for task in left if "m2pem" in repr(task.get_coro())}


def test_a_library_that_is_not_there_is_asked_for(monkeypatch):
    monkeypatch.setitem(sys.modules, "onvif", None)
    monkeypatch.setitem(sys.modules, "onvif.client", None)
    with pytest.raises(PluginError, match=r"pip install 'm2pem-plugin-ptz\[onvif\]'"):
        session.require()
