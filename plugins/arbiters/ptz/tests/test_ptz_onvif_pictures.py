"""Pictures over HTTP: whom the camera gives them to, and what is no picture."""

import asyncio
import io
import math
import re

import pytest
from m2pem_plugin_ptz.drivers.driver import CameraError
from m2pem_plugin_ptz.drivers.onvif import media
from m2pem_plugin_ptz.drivers.onvif.session import Session
from m2pem_plugin_ptz.drivers.onvif.settings import OnvifSettings
from m2pem_plugin_ptz.simulator.onvif.camera import Asks
from m2pem_plugin_ptz.simulator.onvif.server import draw
from onvif_bench import ACCOUNT, camera, driven, until
from PIL import Image

from m2pem.testing.loopback import on_loopback

VIEW = (math.radians(60), math.radians(34))


@pytest.mark.parametrize("asks", list(Asks))
@on_loopback
async def test_a_picture_is_fetched_however_the_camera_asks_for_the_password(tmp_path, asks):
    async with camera(account=ACCOUNT, asks=asks) as server, driven(server, tmp_path) as bench:
        await bench.ready()
        for _ in range(2):
            picture = await bench.driver.take_picture()
            image = Image.open(io.BytesIO(picture.content))
            image.load()
            assert (image.format, image.size) == ("JPEG", (640, 360))
            assert picture.suffix == ".jpg"
            assert picture.taken_us > 1_600_000_000_000_000
        assert server.camera.calls["snapshot"] == 2


@on_loopback
async def test_a_picture_shows_where_the_camera_looks(tmp_path):
    async with camera() as server, driven(server, tmp_path) as bench:
        await bench.ready()
        before = await bench.driver.take_picture()
        bench.driver.point(0.5, -0.2)
        await until(lambda: bench.looks_at(0.5, -0.2))
        after = await bench.driver.take_picture()
        shown = Image.open(io.BytesIO(after.content)).info["comment"].decode()
        ptz = re.match(r"pan ([-+.\d]+)  tilt ([-+.\d]+)  zoom 1\.0", shown)
        assert ptz is not None, shown
        # It may still turn by the last tenths of a degree.
        assert [float(angle) for angle in ptz.groups()] == pytest.approx([28.6, -11.5], abs=0.5)
        assert before.content != after.content


def test_the_horizon_is_where_it_belongs():
    above = Image.open(io.BytesIO(draw(0.0, math.radians(10), 1.0, VIEW, "")))
    below = Image.open(io.BytesIO(draw(0.0, math.radians(-10), 1.0, VIEW, "")))
    middle = (200, 170)
    assert above.getpixel(middle)[2] > above.getpixel(middle)[1], "sky"
    assert below.getpixel(middle)[2] < below.getpixel(middle)[1], "ground"


@on_loopback
async def test_what_is_no_picture_is_an_error(tmp_path):
    async with camera() as server, driven(server, tmp_path) as bench:
        await bench.ready()
        server.camera.fault_state.picture = b"<html>Please log in</html>"
        with pytest.raises(CameraError, match="sent 26 bytes that are not a picture"):
            await bench.driver.take_picture()


@on_loopback
async def test_half_a_picture_is_an_error(tmp_path):
    async with camera() as server, driven(server, tmp_path) as bench:
        await bench.ready()
        whole = (await bench.driver.take_picture()).content
        server.camera.fault_state.picture = whole[: len(whole) // 2]
        with pytest.raises(CameraError, match="cannot be decoded: image file is truncated"):
            await bench.driver.take_picture()


@on_loopback
async def test_a_picture_has_a_largest_size(tmp_path, monkeypatch):
    monkeypatch.setattr(media, "LARGEST", 100_000)
    async with camera() as server, driven(server, tmp_path) as bench:
        await bench.ready()
        server.camera.fault_state.picture = b"\xff\xd8\xff" + bytes(200_000)
        with pytest.raises(CameraError, match="more than 100000 bytes"):
            await bench.driver.take_picture()


@on_loopback
async def test_a_picture_that_does_not_come_is_not_waited_for_for_ever(tmp_path):
    async with camera() as server, driven(server, tmp_path, timeout="0.3 s") as bench:
        await bench.ready()
        server.faults.silent(True)
        async with asyncio.timeout(40):
            with pytest.raises(CameraError, match="does not answer") as refused:
                await bench.driver.take_picture()
        assert refused.value.code == "LINK_LOST"


@on_loopback
async def test_a_wrong_password_for_pictures_is_said_so(tmp_path):
    async with camera(account=ACCOUNT) as server, driven(server, tmp_path) as bench:
        await bench.ready()
        server.faults.locked(True)
        with pytest.raises(CameraError, match=r"refuses user 'operator': correct .*camera\.yaml"):
            await bench.driver.take_picture()


@pytest.mark.parametrize(
    ("said", "taken"),
    [
        ("http://10.0.0.5:99/snap?x=1", "http://cam:8081/snap?x=1"),
        ("http://evil.example/snap", "http://cam:8081/snap"),
        ("http://cam:80/snap", "http://cam:80/snap"),
    ],
)
def test_the_password_goes_to_no_other_host(said, taken):
    assert Session(OnvifSettings("cam", 8081), None).near(said) == taken
