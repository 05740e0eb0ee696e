"""Behaviors on an ONVIF camera whose SOAP is that of node-soap, by the WSDL files of ONVIF.

`tests/js/onvif_camera.mjs` has the head and its spaces; node-soap reads the requests and writes the
answers. libxml2 then validates all envelopes of both sides by the schemas in the WSDL files.
"""

import asyncio
import json
import math
import shutil
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import onvif
import pytest
from lxml import etree
from m2pem_plugin_ptz.arbiter import PtzArbiter
from onvif_bench import ACCOUNT, write_credentials
from PIL import Image
from ptz_fake_camera import rad, vehicle

from m2pem.api import BehaviorState, Connection, ResourceId, SystemClock
from m2pem.testing.contracts.arbiter_harness import ArbiterHarness, context

PTZ = ResourceId("a/ptz")
JS = Path(__file__).parents[4] / "tests" / "js"
WSDL = Path(onvif.__file__).parent / "wsdl"
REACH = {"pan": ["-170 deg", "170 deg"], "tilt": ["-60 deg", "30 deg"], "rate": "90 deg/s"}
ENVELOPE = "{http://www.w3.org/2003/05/soap-envelope}"
XS = "{http://www.w3.org/2001/XMLSchema}"
NAMES = {"tt": "http://www.onvif.org/ver10/schema"}


@cache
def schema(service: str) -> etree.XMLSchema:
    """The schema in a WSDL file."""
    found = etree.parse(WSDL / f"{service}.wsdl").find(f".//{XS}schema")
    for each in found.findall(f"{XS}import"):
        each.set("schemaLocation", str(WSDL / each.get("schemaLocation")))
    return etree.XMLSchema(etree.fromstring(etree.tostring(found)))


SERVICES = {
    "http://www.onvif.org/ver10/device/wsdl": "devicemgmt",
    "http://www.onvif.org/ver10/media/wsdl": "media",
    "http://www.onvif.org/ver20/ptz/wsdl": "ptz",
}


@dataclass
class NodeCamera:
    """What the camera says of itself: the envelopes, and the directions that its pictures show."""

    port: int
    received: list[etree._Element] = field(default_factory=list)
    replied: list[etree._Element] = field(default_factory=list)
    pictures: list[dict[str, float]] = field(default_factory=list)

    def read(self, line: dict[str, object]) -> None:
        for side in ("received", "replied"):
            if side in line:
                getattr(self, side).append(etree.fromstring(str(line[side]).encode()))
        if "picture" in line:
            self.pictures.append(line["picture"])

    def requests(self, operation: str) -> list[etree._Element]:
        return [body for body in map(content, self.received) if named(body) == operation]

    def directions(self) -> list[tuple[float, bool]]:
        """Pan in the generic space, and whether the camera says that it moves."""
        found = []
        for body in map(content, self.replied):
            if named(body) == "GetStatusResponse":
                pan = float(body.find(".//tt:Position/tt:PanTilt", NAMES).get("x"))
                moves = body.findtext(".//tt:MoveStatus/tt:PanTilt", namespaces=NAMES)
                found.append((pan, moves == "MOVING"))
        return found

    def invalid(self) -> list[str]:
        """What libxml2 finds wrong in the envelopes."""
        wrong = []
        for body in map(content, [*self.received, *self.replied]):
            if body.tag == f"{ENVELOPE}Fault":
                wrong.append(etree.tostring(body).decode())
                continue
            judge = schema(SERVICES[etree.QName(body).namespace])
            if not judge.validate(etree.fromstring(etree.tostring(body))):
                wrong.append(f"{named(body)}: {judge.error_log}")
        return wrong


def content(envelope: etree._Element) -> etree._Element:
    """The first element of the body, of SOAP 1.2."""
    return envelope.find(f"{ENVELOPE}Body")[0]


def named(element: etree._Element) -> str:
    return etree.QName(element).localname


@asynccontextmanager
async def node_camera(folder: Path, rate_deg_s: float = 90.0):
    node = shutil.which("node")
    if node is None or not (JS / "node_modules" / "soap").exists():
        pytest.fail("needs Node.js 18 or newer and the packages of tests/js: run `make setup`")
    Image.new("RGB", (32, 18), "navy").save(folder / "view.jpg")
    said = [WSDL, folder / "view.jpg", ACCOUNT.user, ACCOUNT.password, rate_deg_s]
    process = await asyncio.create_subprocess_exec(
        node, "onvif_camera.mjs", *map(str, said), cwd=JS, stdout=asyncio.subprocess.PIPE,
        limit=2**22,
    )  # fmt: skip
    assert process.stdout is not None
    try:
        async with asyncio.timeout(60):
            found = NodeCamera(json.loads(await process.stdout.readline())["port"])

        async def read():
            async for line in process.stdout:
                found.read(json.loads(line))

        reading = asyncio.create_task(read())
        yield found
        reading.cancel()
    finally:
        process.kill()
        await process.wait()


@asynccontextmanager
async def bench(camera: NodeCamera, folder: Path, password: str = ACCOUNT.password):
    clock = SystemClock()
    lent = context(clock)
    lent.bus.publish(vehicle("a", clock.now_us()))
    settings = {
        "driver": "onvif",
        "host": "127.0.0.1",
        "port": camera.port,
        "credentials": str(write_credentials(folder, password)),
        "pictures": str(folder / "pictures"),
        "reach": REACH,
    }
    arbiter = PtzArbiter({PTZ: Connection(PTZ, "ground", settings)}, lent)
    async with ArbiterHarness(arbiter, clock) as found:
        yield found


def is_between(directions: list[tuple[float, bool]]) -> bool:
    """Whether the head moves, between the edges of the sector (60 of 170 degrees each)."""
    return any(moves and abs(pan) < 50 / 170 for pan, moves in directions)


@pytest.mark.tried_with(
    "node-soap",
    "serves an ONVIF camera by the WSDL of ONVIF: it points, takes a picture and stops",
    kind="Cameras",
    package="soap",
    result="understands every request; each is valid by the schema",
)
async def test_a_camera_of_another_soap_library_points_takes_a_picture_and_stops(tmp_path):
    async with node_camera(tmp_path) as camera, bench(camera, tmp_path) as found:
        assert await found.until(lambda: len(camera.directions()) > 1, 60)
        await found.start("r1.b1", "ptz_point_at", PTZ, bearing=rad(60), elevation=rad(-15))
        end = await found.ended("r1.b1", 60)
        assert end.state is BehaviorState.SUCCEEDED, end
        await found.start("r1.b2", "take_picture", PTZ)
        end = await found.ended("r1.b2", 60)
        assert end.state is BehaviorState.SUCCEEDED, end
        shown = camera.pictures[-1]
        assert (shown["pan"], shown["tilt"]) == pytest.approx((60, -15), abs=0.5)
        with Image.open(end.outputs["picture.file"]) as image:
            assert json.loads(image.info["comment"]) == shown

        seen = len(camera.directions())
        await found.start("r1.b3", "ptz_scan_sector", PTZ, heading=0.0, sector=rad(120), speed=0.3)
        await found.running("r1.b3")
        assert await found.until(lambda: is_between(camera.directions()[seen:]), 30)
        await found.arbiter.hold(PTZ)
        assert await found.until(lambda: bool(camera.requests("Stop")), 10)
        seen = len(camera.directions())
        assert await found.until(lambda: len(camera.directions()) > seen + 6, 30)
        rest = camera.directions()[-4:]
        assert not any(moves for _, moves in rest)
        assert len({pan for pan, _ in rest}) == 1, "the head stays where it stopped"
        assert not math.isclose(abs(rest[0][0]), 60 / 170, abs_tol=0.01), "before its edges"
    assert camera.requests("AbsoluteMove")
    assert camera.invalid() == []


async def test_the_camera_refuses_a_wrong_password(tmp_path):
    async with node_camera(tmp_path) as camera, bench(camera, tmp_path, "wrong") as found:
        assert await found.until(lambda: len(camera.replied) > 1, 60)
        await found.start("r1.b1", "ptz_point_at", PTZ, bearing=0.1, elevation=0.0)
        end = await found.ended("r1.b1", 60)
        assert end.state is BehaviorState.REJECTED
        assert f"correct user or password in {tmp_path / 'camera.yaml'}" in end.reason
        assert not camera.requests("AbsoluteMove")


def test_the_schema_finds_what_onvif_does_not_have():
    camera = NodeCamera(0)
    for nonsense in ("", "<Nonsense/>"):
        move = (
            '<e:Envelope xmlns:e="http://www.w3.org/2003/05/soap-envelope"><e:Body>'
            '<Stop xmlns="http://www.onvif.org/ver20/ptz/wsdl"><ProfileToken>p0</ProfileToken>'
            f"{nonsense}</Stop></e:Body></e:Envelope>"
        )
        camera.read({"received": move})
    (found,) = camera.invalid()
    assert "Nonsense" in found
