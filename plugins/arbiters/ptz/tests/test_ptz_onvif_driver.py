"""The ONVIF driver and a simulated camera, over HTTP: all that a behavior asks for."""

import asyncio
import math
import os
from datetime import datetime

import pytest
from m2pem_plugin_ptz.gimbal import Reach
from m2pem_plugin_ptz.simulator.onvif.camera import Account
from onvif_bench import ACCOUNT, camera, driven, until

from m2pem.testing.loopback import on_loopback

rad = math.radians


@on_loopback
async def test_a_camera_points_zooms_and_says_where_it_looks(tmp_path):
    async with camera(account=ACCOUNT) as server, driven(server, tmp_path) as bench:
        await bench.ready()
        driver = bench.driver
        assert driver.reach.pan_rad == pytest.approx((-math.pi, math.pi))
        assert driver.reach.tilt_rad == pytest.approx((rad(-90), rad(30)))
        assert driver.reach.zoom_max == pytest.approx(20.0)
        heard = bench.heard
        driver.point(1.0, -0.3)
        driver.zoom(5.0)
        await until(lambda: bench.looks_at(1.0, -0.3) and abs(driver.ptz.zoom - 5.0) < 0.05)
        assert server.camera.ptz == pytest.approx((1.0, -0.3, 5.0), abs=0.01)
        assert server.camera.calls["AbsoluteMove"] == 2, "one turn, one zoom"
        assert bench.heard > heard


@on_loopback
async def test_the_last_wish_counts_and_calls_are_bounded(tmp_path):
    async with camera() as server, driven(server, tmp_path, calls=10) as bench:
        await bench.ready()
        began, told = asyncio.get_running_loop().time(), 0
        for step in range(40):
            bench.driver.point(step % 7 / 10, 0.0)
            await asyncio.sleep(0.02)
        bench.driver.point(-0.7, 0.1)
        await until(lambda: bench.looks_at(-0.7, 0.1))
        seconds = asyncio.get_running_loop().time() - began
        told = server.camera.calls["AbsoluteMove"] + server.camera.calls["ContinuousMove"]
        assert told <= 5 * seconds + 2
        assert sum(server.camera.calls.values()) <= 10 * seconds + 20


@on_loopback
async def test_a_halt_stops_at_once_even_while_a_call_is_under_way(tmp_path):
    async with camera(latency_s=0.3) as server, driven(server, tmp_path) as bench:
        await bench.ready()
        bench.driver.zoom(20.0)
        bench.driver.point(3.0, 0.2, rad(20))
        await until(lambda: server.camera.ptz[0] > 0.3)
        bench.driver.halt()
        await until(lambda: server.camera.calls["Stop"] >= 1)
        gimbal = server.camera.gimbal
        await until(lambda: server.camera.ptz and not any(axis.moving for axis in gimbal.axes))
        pan, _, zoom = server.camera.ptz
        await until(lambda: server.camera.calls["Stop"] >= 2)
        assert server.camera.ptz[0] == pan < 2.9
        assert server.camera.ptz[2] == zoom < 20.0


@on_loopback
async def test_what_is_wanted_after_a_halt_is_done(tmp_path):
    async with camera(latency_s=0.1) as server, driven(server, tmp_path) as bench:
        await bench.ready()
        for _ in range(3):
            bench.driver.point(2.0, 0.0)
            await until(lambda: server.camera.gimbal.pan.moving)
            bench.driver.halt()
            bench.driver.point(-0.2, -0.1)
            await until(lambda: bench.looks_at(-0.2, -0.1))


@on_loopback
async def test_a_rate_is_kept(tmp_path):
    async with camera() as server, driven(server, tmp_path) as bench:
        await bench.ready()
        bench.driver.point(0.3, 0.0, rad(20))
        await until(lambda: server.camera.ptz[0] > 0.1)
        assert 0 < server.camera.gimbal.pan.speed <= rad(20.01)
        await until(lambda: bench.looks_at(0.3, 0.0))


@on_loopback
async def test_a_moving_target_is_followed_within_a_degree(tmp_path):
    async with camera(latency_s=0.2) as server, driven(server, tmp_path) as bench:
        await bench.ready()
        clock = asyncio.get_running_loop().time
        began = good_since = clock()

        def target():
            return rad(6) * (clock() - began), rad(-10) + rad(1) * (clock() - began)

        async with asyncio.timeout(25.0):  # a busy computer may lose it for a moment
            while clock() - good_since < 2.0:
                bench.driver.point(*target())
                await asyncio.sleep(1 / 15)
                pan, tilt, _ = server.camera.ptz
                wanted = target()
                if max(abs(pan - wanted[0]), abs(tilt - wanted[1])) > rad(1.0):
                    good_since = clock()
        assert server.camera.calls["ContinuousMove"] > 5


@on_loopback
async def test_a_generic_camera_is_pointed_by_the_fleets_reach(tmp_path):
    reach = Reach((rad(-180), rad(180)), (rad(-90), rad(30)), zoom_max=20.0, rate_rad_s=rad(100))
    async with camera(degrees=False) as server, driven(server, tmp_path, reach) as bench:
        await bench.ready()
        bench.driver.point(1.0, -1.0)
        bench.driver.zoom(3.0)
        await until(lambda: bench.looks_at(1.0, -1.0))
        await until(lambda: abs(bench.driver.ptz.zoom - 3.0) < 0.05)
        assert server.camera.ptz == pytest.approx((1.0, -1.0, 3.0), abs=0.01)


@on_loopback
async def test_an_inverted_camera_is_told_the_other_way(tmp_path):
    both = ["pan", "tilt"]
    async with camera(tilt_deg=(-30, 90)) as server, driven(server, tmp_path, invert=both) as bench:
        await bench.ready()
        bench.driver.point(0.5, -1.0)
        await until(lambda: bench.looks_at(0.5, -1.0))
        assert server.camera.ptz[:2] == pytest.approx((-0.5, 1.0), abs=0.01)


@on_loopback
async def test_a_camera_without_the_old_media_service_works(tmp_path):
    only_new = camera(account=ACCOUNT, media=False)
    async with only_new as server, driven(server, tmp_path, profile="main") as bench:
        await bench.ready()
        bench.driver.point(0.5, 0.1)
        await until(lambda: bench.looks_at(0.5, 0.1))
        assert (await bench.driver.take_picture()).suffix == ".jpg"


@on_loopback
async def test_video_is_recorded_by_the_camera_and_found_by_its_clock(tmp_path):
    late = camera(account=ACCOUNT, skew_s=-86400.0)
    async with late as server, driven(server, tmp_path) as bench:
        await bench.ready()
        assert bench.driver.refusal("record_video") == ""
        await bench.driver.start_recording()
        assert server.camera.recording
        where = await bench.driver.stop_recording()
        assert not server.camera.jobs
        address, _, times = where.partition("?")
        assert address == f"onvif://127.0.0.1:{server.port}/recordings/recording_1"
        begun = datetime.fromisoformat(times.partition("&")[0].removeprefix("from="))
        assert abs(begun.timestamp() - server.camera.recorded[0].begin_s) < 60


@on_loopback
async def test_a_camera_whose_jobs_are_all_made_uses_an_idle_one(tmp_path):
    async with camera() as server, driven(server, tmp_path) as bench:
        await bench.ready()
        server.camera.add_job(active=False)
        server.camera.add_job(active=False)
        await bench.driver.start_recording()
        assert server.camera.recording
        await bench.driver.stop_recording()
        assert not server.camera.recording
        assert len(server.camera.jobs) == 2, "a job of somebody else is kept"


@pytest.mark.parametrize(
    ("options", "behavior", "why"),
    [
        ({"recording": False}, "record_video", "has no recording service"),
        ({"snapshots": False}, "take_picture", "refuses GetSnapshotUri: no pictures"),
        ({"degrees": False}, "zoom", "set reach.zoom_max in the fleet"),
        ({"turns": False}, "ptz_point_at", "does not report its direction"),
    ],
)
@on_loopback
async def test_what_a_camera_cannot_do_is_refused_with_the_reason(tmp_path, options, behavior, why):
    async with camera(**options) as server, driven(server, tmp_path) as bench:
        await until(lambda: why in bench.driver.refusal(behavior))
        if options.get("turns", True):
            assert bench.driver.refusal("ptz_track") == ""


@on_loopback
async def test_a_camera_that_does_not_say_where_it_looks_is_refused(tmp_path):
    async with camera(positions=False) as server, driven(server, tmp_path) as bench:
        await until(lambda: "GetStatus" in bench.driver.refusal("ptz_point_at"))
        assert bench.driver.ptz is None
        assert bench.heard > 0


@on_loopback
async def test_a_profile_that_is_not_there_is_refused_with_those_that_are(tmp_path):
    async with camera() as server, driven(server, tmp_path, profile="second") as bench:
        await until(lambda: "has no profile 'second'" in bench.driver.refusal("zoom"))
        assert "main (profile_1)" in bench.driver.refusal("zoom")


@on_loopback
async def test_the_environment_and_the_loggers_of_the_process_stay_as_they_are(
    tmp_path, monkeypatch
):
    import logging

    monkeypatch.setenv("http_proxy", "http://127.0.0.1:9")
    handlers = logging.getLogger().handlers[:]
    async with camera(account=Account("a", "b")) as server:
        path = tmp_path / "ab.yaml"
        path.touch(mode=0o600)
        path.write_text("{user: a, password: b}")
        async with driven(server, tmp_path, credentials=str(path)) as bench:
            await bench.ready()
    assert os.environ["http_proxy"] == "http://127.0.0.1:9"
    assert logging.getLogger().handlers == handlers
