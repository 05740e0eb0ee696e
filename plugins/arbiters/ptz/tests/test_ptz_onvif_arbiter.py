"""Behaviors on a simulated ONVIF camera over HTTP: what a mission gets of it."""

import asyncio
import math
import re
from contextlib import asynccontextmanager
from pathlib import Path

import pytest
from aiohttp import web
from m2pem_plugin_ptz.arbiter import PtzArbiter
from m2pem_plugin_ptz.simulator.onvif import soap
from m2pem_plugin_ptz.simulator.onvif.services import ptz as ptz_service
from onvif_bench import ACCOUNT, camera, write_credentials
from PIL import Image
from ptz_fake_camera import at, rad, vehicle

from m2pem.api import ArbiterContext, BehaviorState, Connection, LinkState, Point, ResourceId
from m2pem.testing.contracts.arbiter_harness import ArbiterHarness, context
from m2pem.testing.loopback import loop_clock, on_loopback

PTZ = ResourceId("a/ptz")
SPEED_M_S, TURN_RAD_S = 4.0, rad(6)
TARGET = (60.0, 40.0)


class Way:
    """A vehicle that drives a curve, and says ten times a second where it is."""

    def __init__(self, lent: ArbiterContext) -> None:
        self._lent = lent
        self._began_us = lent.clock.now_us()

    def pose(self, now_us):
        """East, north, yaw, and the velocity."""
        seconds = (now_us - self._began_us) / 1e6
        yaw = math.pi / 2 - TURN_RAD_S * seconds
        radius = SPEED_M_S / TURN_RAD_S
        east = radius * (1 - math.sin(yaw))
        north = radius * math.cos(yaw)
        return east, north, yaw, (SPEED_M_S * math.cos(yaw), SPEED_M_S * math.sin(yaw), 0.0)

    def bearing(self, now_us):
        """Of the target, from the bow, clockwise."""
        east, north, yaw, _ = self.pose(now_us)
        return math.remainder(yaw - math.atan2(TARGET[1] - north, TARGET[0] - east), math.tau)

    async def drive(self):
        while True:
            now_us = self._lent.clock.now_us()
            east, north, yaw, velocity = self.pose(now_us)
            self._lent.bus.publish(vehicle("a", now_us, east, north, 0.0, yaw, velocity))
            await self._lent.clock.sleep(0.1)


@asynccontextmanager
async def bench(server, folder: Path, *, drives=False, **said):
    clock = loop_clock()
    lent = context(clock)
    settings = {
        "driver": "onvif",
        "host": "127.0.0.1",
        "port": server.port,
        "pictures": str(folder / "pictures"),
        "reach": {"endless": True, "rate": "100 deg/s"},
        **said,
    }
    way = Way(lent)
    lent.bus.publish(vehicle("a", clock.now_us()))
    driving = asyncio.create_task(way.drive()) if drives else None
    arbiter = PtzArbiter({PTZ: Connection(PTZ, "ground", settings)}, lent)
    async with ArbiterHarness(arbiter, clock) as found:
        yield found, way
    if driving is not None:
        driving.cancel()


@on_loopback
async def test_a_camera_stays_on_its_target_while_its_vehicle_drives_and_turns(tmp_path):
    round_about = camera(latency_s=0.1, endless=True)
    async with round_about as server, bench(server, tmp_path, drives=True) as (found, way):
        place = Point((*at(*TARGET)[:2], None))
        await found.start("r1.b1", "ptz_track", PTZ, target=place, duration=10.0)
        await found.running("r1.b1")
        longest_us, good_since_us = 0, found.clock.now_us()
        while not found.states_of("r1.b1")[-1].terminal:
            now_us = found.clock.now_us()
            off = math.remainder(server.camera.ptz[0] - way.bearing(now_us), math.tau)
            if abs(off) > rad(1):
                good_since_us = now_us
            longest_us = max(longest_us, now_us - good_since_us)
            await asyncio.sleep(0.03)
        assert found.of("r1.b1")[-1].state is BehaviorState.SUCCEEDED
        assert longest_us > 2e6, "a busy computer may lose it for a moment, but not all the time"
        assert server.camera.calls["ContinuousMove"] > 5


def note_in(picture):
    with Image.open(picture) as image:
        return image.info["comment"].decode()


@on_loopback
async def test_pictures_and_a_video_come_into_the_missions_data(tmp_path):
    said = {"credentials": str(write_credentials(tmp_path))}
    async with camera(account=ACCOUNT) as server, bench(server, tmp_path, **said) as (found, _):
        await found.start("r1.b1", "ptz_point_at", PTZ, bearing=rad(30), elevation=rad(-10))
        assert (await found.ended("r1.b1", 40)).state is BehaviorState.SUCCEEDED
        await found.start("r1.b2", "take_picture", PTZ, count=2, interval=0.2)
        end = await found.ended("r1.b2", 40)
        assert end.state is BehaviorState.SUCCEEDED, end
        assert len(end.outputs["picture.files"]) == 2
        shown = note_in(end.outputs["picture.file"])
        assert abs(float(shown.split()[1]) - 30) < 0.6
        await found.start("r1.b3", "record_video", PTZ, duration=0.3)
        end = await found.ended("r1.b3", 40)
        assert end.outputs["video.file"].startswith("onvif://127.0.0.1:")
        assert len(server.camera.recorded) == 1


@on_loopback
async def test_a_wrong_password_and_a_missing_recorder_reject_with_whose_fault_it_is(tmp_path):
    path = write_credentials(tmp_path, "wrong")
    said = {"credentials": str(path)}
    async with camera(account=ACCOUNT) as server, bench(server, tmp_path, **said) as (found, _):
        await found.start("r1.b1", "ptz_point_at", PTZ, bearing=0.1, elevation=0.0)
        end = await found.ended("r1.b1", 40)
        assert end.state is BehaviorState.REJECTED
        assert f"correct user or password in {path}" in end.reason
    async with camera(recording=False) as server, bench(server, tmp_path) as (found, _):
        await found.start("r1.b1", "record_video", PTZ, duration=1.0)
        end = await found.ended("r1.b1", 40)
        assert (end.state, end.code) == (BehaviorState.REJECTED, "REJECTED")
        assert "has no recording service" in end.reason


@on_loopback
async def test_what_is_left_of_a_sector_is_reported_by_where_the_camera_looks(tmp_path):
    async with camera(latency_s=0.1, endless=True) as server, bench(server, tmp_path) as (found, _):
        sector = {"heading": rad(90), "sector": rad(80)}
        await found.start("r1.b1", "ptz_scan_sector", PTZ, **sector, speed=rad(40))
        assert (await found.ended("r1.b1", 40)).state is BehaviorState.SUCCEEDED
        said = [each.remaining for each in found.of("r1.b1") if each.remaining is not None]
    ends = [_ends(each) for each in said]
    left = [high - low for low, high in ends]
    assert len(left) > 2
    assert left == sorted(left, reverse=True)
    assert left[-1] < 40.0
    near, far = (50.0, 130.0)
    assert all(abs(low - near) < 0.2 or abs(high - far) < 0.2 for low, high in ends), ends


def _ends(remaining):
    """The edges of what is left, in degrees."""
    heading, sector = (float(remaining[key].removesuffix(" deg")) for key in ("heading", "sector"))
    return heading - sector / 2, heading + sector / 2


@on_loopback
async def test_a_camera_that_reports_where_it_will_be_is_there_when_it_rests(tmp_path, monkeypatch):
    def status(of, asked, base):
        """Return its status as if its head were already where it goes to."""
        said = truly(of, asked, base)
        pan = of.gimbal.pan.at if of.gimbal.pan.goal is None else of.gimbal.pan.goal
        return re.sub(r'PanTilt x="[^"]*"', f'PanTilt x="{math.degrees(pan):.4f}"', said)

    truly = ptz_service.OPERATIONS["GetStatus"]
    monkeypatch.setitem(ptz_service.OPERATIONS, "GetStatus", status)
    slow = camera(rate_deg_s=20.0, drives=False)
    async with slow as server, bench(server, tmp_path) as (found, _):
        await found.start("r1.b1", "ptz_point_at", PTZ, bearing=rad(60), elevation=0.0)
        end = await found.ended("r1.b1", 60)
        assert end.state is BehaviorState.SUCCEEDED
        assert math.degrees(server.camera.ptz[0]) == pytest.approx(60, abs=0.5)


@pytest.mark.parametrize("obeys", [True, False])
@on_loopback
async def test_a_cancel_is_done_when_the_camera_rests(tmp_path, monkeypatch, obeys):
    if not obeys:
        monkeypatch.setitem(ptz_service.OPERATIONS, "Stop", lambda *_: "")
    slow = camera(rate_deg_s=5.0, drives=False)
    async with slow as server, bench(server, tmp_path) as (found, _):
        await found.until(lambda: getattr(found.latest(PTZ), "pan_rad", None) is not None, 60)
        await found.start("r1.b1", "ptz_point_at", PTZ, bearing=rad(160), elevation=0.0)
        await found.until(lambda: math.degrees(server.camera.ptz[0]) > 10, 60)
        await found.arbiter.cancel("r1.b1", 1)
        end = await found.ended("r1.b1", 60)
        assert server.camera.gimbal.pan.moving is not obeys
        if obeys:
            assert end.state is BehaviorState.CANCELLED
        else:
            assert (end.state, end.code) == (BehaviorState.FAILED, "TIMEOUT")
            assert end.reason == "the camera did not stop within 8 s of the cancel"


@on_loopback
async def test_two_seconds_of_server_errors_are_no_lost_link(tmp_path, monkeypatch):
    """The answer is a text: for it, zeep 4.3.3 raises AttributeError, not TransportError."""

    def fails(_):
        raise web.HTTPInternalServerError

    async with camera() as server, bench(server, tmp_path) as (found, _):
        await found.until(lambda: getattr(found.latest(PTZ), "pan_rad", None) is not None, 30)
        with monkeypatch.context() as broken:
            broken.setattr(soap, "read", fails)
            await found.clock.sleep(2.0)
        states = len(found.states)
        await found.until(lambda: len(found.states) > states + 20, 60)
        assert {state.link for state in found.states} == {LinkState.CONNECTED}
