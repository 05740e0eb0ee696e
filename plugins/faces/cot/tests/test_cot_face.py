"""The face against programs that are not ours: pytak listens and sends; hostile ones do, too."""

import asyncio
import os
import random
import socket
import ssl
import subprocess
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import urlparse

import pytak
import pytest
from lxml import etree
from m2pem_plugin_cot.face import CotFace
from takproto import TAKProtoVer, xml2proto

from m2pem.api import FaceSettings, GeoPosition, MissionControl, Point, Route, VehicleState, records
from m2pem.errors import PluginError
from m2pem.testing import run_executive, scenarios, serve_face

WITHIN_S = 20.0
PLACE, FAR = [38.10755, -77.3192], [38.15, -77.3192]
NAMES = ("rover1", "rover2")
HANDED_OVER = ("lz",)


def free_port(kind: int = socket.SOCK_DGRAM) -> int:
    """A port that no socket gets by itself: those are above 32767."""
    for port in random.sample(range(20_000, 32_000), 100):
        with socket.socket(type=kind) as probe, suppress(OSError):
            probe.bind(("127.0.0.1", port))
            return port
    raise AssertionError


def is_bound(port: int) -> bool:
    with socket.socket(type=socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(("127.0.0.1", port))
        except OSError:
            return True
    return False


@asynccontextmanager
async def fleet(**settings: Any) -> AsyncIterator[MissionControl]:
    """An executive with two simulated rovers, and the face with these settings."""
    made = scenarios.fleet("sim", {name: {} for name in NAMES})
    made = replace(
        made, handed_over=HANDED_OVER, geometries={"gate": Point((38.108, -77.319, None))}
    )
    async with (
        run_executive(made) as control,
        serve_face(CotFace, control, settings, "cot"),
    ):
        yield control


async def received(reader: Any, wanted: Callable[[etree._Element], bool]) -> etree._Element:
    """The first event of pytak's reader that is wanted."""
    async with asyncio.timeout(WITHIN_S):
        while True:
            content, _ = await reader.recv()
            event = etree.fromstring(content)
            if wanted(event):
                return event


async def until(condition: Callable[[], bool]) -> None:
    async with asyncio.timeout(WITHIN_S):
        while not condition():  # noqa: ASYNC110  # a program of others has no event
            await asyncio.sleep(0.01)


async def state_of(control: MissionControl, name: str) -> VehicleState:
    async for state in control.telemetry():
        if isinstance(state, VehicleState) and state.resource == name and state.position:
            return state
    raise AssertionError


def is_vehicle(name: str) -> Callable[[etree._Element], bool]:
    return lambda event: event.get("uid") == f"m2pem.scenario.vehicle.{name}"


@pytest.mark.tried_with(
    "PyTAK",
    "reads Cursor on Target of the face",
    kind="TAK",
    result="every vehicle is where it is",
    package="pytak",
)
async def test_pytak_reads_every_vehicle_where_it_is() -> None:
    where = f"127.0.0.1:{free_port()}"
    url = f"udp://{where}"
    reader, _ = await pytak.create_udp_client(urlparse(f"udp+ro://{where}"), None)
    async with fleet(url=url, rate="5 Hz") as control:
        for name in NAMES:
            event = await received(reader, is_vehicle(name))
            position = (await state_of(control, name)).position
            assert isinstance(position, GeoPosition)
            point = event.find("point")
            assert float(point.get("lat")) == pytest.approx(position.latitude_deg, abs=1e-6)
            assert float(point.get("lon")) == pytest.approx(position.longitude_deg, abs=1e-6)
            assert event.find("detail/contact").get("callsign") == name
        gate = await received(reader, lambda each: each.get("type") == "b-m-p-s-m")
        assert gate.find("detail/contact").get("callsign") == "gate"
    reader.close()


async def test_what_a_mission_has_drawn_is_sent_with_its_run_and_deleted_when_that_ends() -> None:
    where = f"127.0.0.1:{free_port()}"
    reader, _ = await pytak.create_udp_client(urlparse(f"udp+ro://{where}"), None)
    lane = Route(((38.108, -77.319, None), (38.109, -77.318, None)))
    async with fleet(url=f"udp://{where}", rate="10 Hz") as control:
        run = await control.start(scenarios.drawn(scenarios.question(), lane=lane))
        uid = f"m2pem.scenario.geometry.{run}/lane"
        shown = await received(reader, lambda each: each.get("uid") == uid)
        assert shown.get("type") == "b-m-r"
        assert shown.find("detail/contact").get("callsign") == f"{run}/lane"
        await control.stop(run)
        deleted = await received(reader, lambda each: each.get("type") == "t-x-d-d")
        assert deleted.find("detail/link").get("uid") == uid
        assert deleted.find("detail/__forcedelete") is not None
        assert deleted.get("stale") == deleted.get("time")
    reader.close()


def marker(name: str = "lz", place: str = 'lat="38.1077" lon="-77.3190"') -> bytes:
    return (
        f'<event version="2.0" uid="phone.1" type="b-m-p-s-m" how="h-g-i-g-o"><point {place} '
        f'hae="9999999.0" ce="9999999.0" le="9999999.0"/><detail><contact callsign="{name}"/>'
        "</detail></event>"
    ).encode()


@pytest.mark.tried_with(
    "PyTAK",
    "sends a marker",
    kind="TAK",
    result="handed over if the fleet allows it",
    package="pytak",
)
async def test_a_marker_of_pytak_is_handed_over_if_the_fleet_allows_it() -> None:
    port = free_port()
    settings = {"url": f"udp://127.0.0.1:{free_port()}", "listen": f"udp://127.0.0.1:{port}"}
    async with fleet(**settings, receive=True) as control:
        _, writer = await pytak.create_udp_client(urlparse(f"udp+wo://127.0.0.1:{port}"), None)

        async def send() -> None:
            while "lz" not in control.geometries():  # the socket may not be open yet
                event = pytak.cot_event(
                    38.1077, -77.319, uid="phone.1", cot_type="b-m-p-s-m", callsign="lz"
                )
                with suppress(ConnectionRefusedError):
                    await writer.send(pytak.serialize_cot(event))
                    await writer.send(marker("gate"))
                await asyncio.sleep(0.05)

        async with asyncio.timeout(WITHIN_S):
            await send()
        given = control.geometries()["lz"]
        assert given.geometry["geometry"]["coordinates"] == [-77.319, 38.1077]
        assert given.by.startswith("cot phone.1 at 127.0.0.1:")
        assert "gate" not in control.geometries()
        writer.close()


@pytest.mark.tried_with(
    "takproto",
    "writes a marker in the TAK protocol (protobuf), which pytak sends",
    kind="TAK",
    result="is handed over",
    package="takproto",
)
async def test_a_marker_in_the_tak_protocol_is_handed_over() -> None:
    """As ATAK sends it to its multicast group; pytak 7.6.1 sends what takproto 3.0.1 has made."""
    port = free_port()
    settings = {"url": f"udp://127.0.0.1:{free_port()}", "listen": f"udp://127.0.0.1:{port}"}
    async with fleet(**settings, receive=True) as control:
        await until(lambda: is_bound(port))
        _, writer = await pytak.create_udp_client(urlparse(f"udp+wo://127.0.0.1:{port}"), None)
        await writer.send(bytes(xml2proto(marker().decode(), TAKProtoVer.MESH)))
        await until(lambda: "lz" in control.geometries())
        given = control.geometries()["lz"]
        assert given.geometry["geometry"]["coordinates"] == [-77.3190, 38.1077]
        assert given.by.startswith("cot phone.1 at 127.0.0.1:")
        writer.close()


async def test_a_server_may_send_the_tak_protocol_in_its_stream() -> None:
    async def talk(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        frame = bytes(xml2proto(marker().decode(), TAKProtoVer.STREAM))
        writer.write(marker("other") + b"\n" + frame[:40])
        await writer.drain()
        writer.write(frame[40:])
        while await reader.read(1000):
            continue

    server = await asyncio.start_server(talk, "127.0.0.1", 0)
    port = server.sockets[0].getsockname()[1]
    async with fleet(url=f"tcp://127.0.0.1:{port}", receive=True) as control:
        await until(lambda: "lz" in control.geometries())
    server.close()


async def test_a_hostile_sender_changes_nothing_and_slows_nothing() -> None:
    port = free_port()
    settings = {"url": f"udp://127.0.0.1:{free_port()}", "listen": f"udp://127.0.0.1:{port}"}
    bombs = [
        os.urandom(1400),
        marker(place='lat="1e309" lon="0"'),
        b'<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa">]><event>&a;</event>',
        b"<event>" * 9000,
        b"\xbf\x01\xbf" + os.urandom(1400),
        b"\xbf\x01\xbf\x12" + b"\xff" * 9 + b"\x01",
        marker("not handed over"),
        marker("lz" * 30_000),
    ]
    with socket.socket(type=socket.SOCK_DGRAM) as hostile:
        async with fleet(**settings, receive=True) as control:
            target = {"target": PLACE}
            run = await control.execute_behavior("rover1", "goto", target, by="anna")
            ended = asyncio.create_task(control.wait(run))
            sent = 0
            while not ended.done():
                for bomb in bombs * 20:
                    hostile.sendto(bomb, ("127.0.0.1", port))
                    sent += 1
                await asyncio.sleep(0)
            assert str((await ended).status) == "completed"
            assert sent > 1000
            assert control.geometries() == {}


async def test_a_flood_of_changes_does_not_fill_the_journal() -> None:
    """Each change is a record of every run. The last one counts."""
    port = free_port()
    settings = {"url": f"udp://127.0.0.1:{free_port()}", "listen": f"udp://127.0.0.1:{port}"}
    places = [f'lat="38.{1080 + number}" lon="-77.3190"' for number in range(40)]

    def is_last(control: MissionControl) -> bool:
        given = control.geometries().get("lz")
        return given is not None and given.geometry["geometry"]["coordinates"][1] == 38.1119

    with socket.socket(type=socket.SOCK_DGRAM) as flood:
        async with fleet(**settings, receive=True) as control:
            run = await control.execute_behavior("rover1", "goto", {"target": FAR}, by="anna")
            await until(lambda: is_bound(port))
            for place in places:
                flood.sendto(marker(place=place), ("127.0.0.1", port))
            await until(lambda: is_last(control))
            found = [each.record for each in await control.records(run, 0, 1000)]
            changes = [each for each in found if isinstance(each, records.GeometryReceived)]
            assert len(changes) < len(places) // 2


async def test_a_stalled_server_loses_events_and_the_face_connects_again() -> None:
    port = free_port(socket.SOCK_STREAM)
    accepted: list[asyncio.StreamWriter] = []
    lines: list[bytes] = []

    async def read_nothing(_: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        accepted.append(writer)
        writer.transport.pause_reading()

    async def read(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        accepted.append(writer)
        while content := await reader.read(1000):
            lines.append(content)

    server = await asyncio.start_server(read_nothing, "127.0.0.1", port)
    async with fleet(url=f"tcp://127.0.0.1:{port}", rate="20 Hz") as control:
        await until(lambda: len(accepted) == 1)
        run = await control.execute_behavior("rover1", "goto", {"target": PLACE})
        assert str((await control.wait(run)).status) == "completed"
        server.close()
        accepted[0].transport.abort()
        server = await asyncio.start_server(read, "127.0.0.1", port)
        await until(lambda: b"m2pem.scenario.vehicle.rover2" in b"".join(lines))
    server.close()
    for each in accepted:
        each.transport.abort()


@pytest.fixture(scope="module")
def certificates(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A certificate for 127.0.0.1 that is its own authority, and its key."""
    folder = tmp_path_factory.mktemp("certificates")
    words = "req -x509 -newkey rsa:2048 -nodes -keyout key.pem -out cert.pem -days 2 -subj /CN=x"
    subject = "subjectAltName=IP:127.0.0.1"
    subprocess.run(
        ["openssl", *words.split(), "-addext", subject], cwd=folder, check=True, capture_output=True
    )
    (folder / "key.pem").chmod(0o600)
    return folder


async def test_a_tak_server_is_reached_over_mutual_tls(certificates: Path) -> None:
    context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH, cafile=certificates / "cert.pem")
    context.load_cert_chain(certificates / "cert.pem", certificates / "key.pem")
    context.verify_mode = ssl.CERT_REQUIRED
    lines: list[bytes] = []

    async def talk(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writer.write(marker()[:40])
        await writer.drain()
        writer.write(marker()[40:] + b"\n")
        while content := await reader.read(1000):
            lines.append(content)

    server = await asyncio.start_server(talk, "127.0.0.1", 0, ssl=context)
    port = server.sockets[0].getsockname()[1]
    files = {"ca": "cert.pem", "certificate": "cert.pem", "key": "key.pem"}
    tls = {key: str(certificates / name) for key, name in files.items()}
    async with fleet(url=f"tls://127.0.0.1:{port}", tls=tls, receive=True) as control:
        await until(lambda: "lz" in control.geometries())
        await until(lambda: b"m2pem.scenario.vehicle.rover1" in b"".join(lines))
    server.close()


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({}, "faces.cot.url: it is missing"),
        ({"url": "http://a:1"}, "faces.cot.url: 'http://a:1' is no address"),
        ({"url": "udp://127.0.0.1"}, "is no address such as udp://127.0.0.1:4242"),
        ({"url": "tcp://a:1", "listen": "udp://a:2"}, "only a udp:// url needs it"),
        ({"url": "udp://a:1", "receive": True}, "needs `listen"),
        ({"url": "udp://a:1", "rate": "10 m"}, "faces.cot.rate"),
        ({"url": "udp://a:1", "rate": "0.02 Hz"}, "faces.cot.stale"),
        ({"url": "udp://a:1", "types": {"rover3": "a-f-G"}}, "did you mean 'rover2' or 'rover1'"),
        ({"url": "udp://a:1", "types": {"rover1": "<x>"}}, "is no type of Cursor on Target"),
        ({"url": "tls://a:1"}, "faces.cot.tls.ca: it is missing"),
        ({"url": "udp://a:1", "ulr": 1}, "did you mean 'url'"),
    ],
)
async def test_wrong_settings_are_named(settings: dict[str, Any], says: str) -> None:
    with pytest.raises(PluginError) as raised:
        async with fleet(**settings):
            pass
    assert says in str(raised.value)


async def test_a_key_that_others_may_read_is_refused(certificates: Path, tmp_path: Path) -> None:
    key = tmp_path / "key.pem"
    key.write_bytes((certificates / "key.pem").read_bytes())
    key.chmod(0o644)
    tls = dict.fromkeys(("ca", "certificate"), str(certificates / "cert.pem")) | {"key": str(key)}
    with pytest.raises(PluginError, match="chmod 600"):
        async with fleet(url="tls://127.0.0.1:1", tls=tls):
            pass


async def test_a_port_that_is_taken_is_named() -> None:
    with socket.socket(type=socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        listen = f"udp://127.0.0.1:{taken.getsockname()[1]}"
        with pytest.raises(PluginError, match="Address already in use"):
            async with run_executive(scenarios.fleet("sim", {"rover1": {}})) as control:
                settings = {"url": "udp://127.0.0.1:9", "listen": listen}
                await CotFace(control, FaceSettings("cot", settings)).serve()
