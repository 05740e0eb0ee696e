"""The face as a contact of a TAK server that is not ours (taky); pytak is a phone. All over TLS."""

import asyncio
import subprocess
import sys
from collections.abc import AsyncIterator, Callable, Iterator
from configparser import ConfigParser
from contextlib import asynccontextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytak
import pytest
from lxml import etree
from m2pem_plugin_cot.face import CotFace
from m2pem_plugin_cot.received import EventStream
from test_cot_face import certificates, free_port

from m2pem.api import MissionControl, Point
from m2pem.errors import PluginError
from m2pem.testing import run_executive, scenarios, serve_face

__all__ = ["certificates"]

WITHIN_S = 60.0
UID = "m2pem.scenario.contact"
NOW = 'time="2026-01-01T00:00:00Z" start="2026-01-01T00:00:00Z" stale="2099-01-01T00:00:00Z"'
POINT = '<point lat="38.1077" lon="-77.3190" hae="0" ce="9" le="9"/>'
TO_M2PEM = '<marti><dest callsign="M2PEM"/></marti>'


@pytest.fixture
def server(certificates: Path, tmp_path: Path) -> Iterator[int]:
    """A taky; its port."""
    port = free_port()
    (tmp_path / "certificates.txt").touch()
    (tmp_path / "taky.conf").write_text(
        f"[taky]\nhostname=localhost\nbind_ip=127.0.0.1\nroot_dir={tmp_path}\n"
        f"[cot_server]\nport={port}\n[ssl]\nenabled=true\nclient_cert_required=true\n"
        f"ca={certificates / 'cert.pem'}\ncert={certificates / 'cert.pem'}\n"
        f"key={certificates / 'key.pem'}\ncert_db={tmp_path / 'certificates.txt'}\n"
    )
    words = [sys.executable, "-m", "taky.cot", "-c", str(tmp_path / "taky.conf")]
    with (tmp_path / "taky.log").open("wb") as log:
        process = subprocess.Popen(words, stdout=log, stderr=log)
        yield port
        process.terminate()
        process.wait(20)


class Phone:
    """A person's TAK client. `seen`: all events that it has received."""

    def __init__(self, reader: Any, writer: Any, callsign: str) -> None:
        self._reader, self._writer = reader, writer
        self.callsign, self.uid = callsign, f"ANDROID-{callsign}"
        self.seen: list[etree._Element] = []
        self._read = asyncio.create_task(self._receive())

    async def _receive(self) -> None:
        stream = EventStream()
        while content := await self._reader.read(4096):
            self.seen += [etree.fromstring(each) for each in stream.feed(content)]

    async def send(self, uid: str, type_: str, detail: str) -> None:
        event = f'<event version="2.0" uid="{uid}" type="{type_}" how="h-e" {NOW}>{POINT}<detail>'
        self._writer.write(f"{event}{detail}</detail></event>".encode())
        await self._writer.drain()

    async def introduce(self) -> None:
        contact = f'<contact callsign="{self.callsign}" endpoint="*:-1:stcp"/>'
        takv = '<takv os="34" device="phone" version="5" platform="ATAK-CIV"/>'
        await self.send(
            self.uid, "a-f-G-U-C", f'{takv}{contact}<__group name="Cyan" role="Team Member"/>'
        )

    async def chat(self, text: str, to: str = UID, room: str = "M2PEM") -> None:
        await self.send(
            f"GeoChat.{self.uid}.{to}.1",
            "b-t-f",
            f'<__chat parent="RootContactGroup" groupOwner="false" chatroom="{room}" id="{to}" '
            f'senderCallsign="{self.callsign}"><chatgrp uid0="{self.uid}" uid1="{to}" id="{to}"/>'
            f'</__chat><link uid="{self.uid}" type="a-f-G-U-C" relation="p-p"/>'
            f'<remarks source="BAO.F.ATAK.{self.uid}" to="{to}" time="2026-01-01T00:00:00Z">{text}'
            "</remarks>",
        )

    async def until(self, wanted: Callable[[etree._Element], bool]) -> etree._Element:
        async with asyncio.timeout(WITHIN_S):
            while not (found := list(filter(wanted, self.seen))):  # noqa: ASYNC110
                await asyncio.sleep(0.02)
        return found[-1]

    async def read(self, text: str) -> str:
        """Wait for a message with this text."""
        found = await self.until(lambda each: text in (each.findtext("detail/remarks") or ""))
        return str(found.findtext("detail/remarks"))

    def close(self) -> None:
        self._read.cancel()
        self._writer.close()


def is_called(name: str) -> Callable[[etree._Element], bool]:
    def called(event: etree._Element) -> bool:
        contact = event.find("detail/contact")
        return contact is not None and contact.get("callsign") == name

    return called


@asynccontextmanager
async def phone(port: int, certificates: Path, callsign: str) -> AsyncIterator[Phone]:
    parser = ConfigParser()
    parser["phone"] = {
        "COT_URL": f"tls://127.0.0.1:{port}",
        "PYTAK_TLS_CLIENT_CERT": str(certificates / "cert.pem"),
        "PYTAK_TLS_CLIENT_KEY": str(certificates / "key.pem"),
        "PYTAK_TLS_CLIENT_CAFILE": str(certificates / "cert.pem"),
        "PYTAK_TLS_DONT_CHECK_HOSTNAME": "1",
    }
    async with asyncio.timeout(WITHIN_S):
        while True:
            try:
                reader, writer = await pytak.protocol_factory(parser["phone"])
                break
            except OSError:  # the server has not begun to listen
                await asyncio.sleep(0.05)
    made = Phone(reader, writer, callsign)
    await made.introduce()
    try:
        yield made
    finally:
        made.close()


@asynccontextmanager
async def fleet(port: int, certificates: Path, **settings: Any) -> AsyncIterator[MissionControl]:
    made = replace(
        scenarios.fleet("sim", {"rover1": {}}),
        handed_over=("lz", "way", "road"),
        geometries={"gate": Point((38.108, -77.319, None))},
    )
    files = {"ca": "cert.pem", "certificate": "cert.pem", "key": "key.pem"}
    given = {
        "url": f"tls://127.0.0.1:{port}",
        "tls": {key: str(certificates / name) for key, name in files.items()},
        "receive": True,
        "callsign": "M2PEM",
        "chat": True,
        **settings,
    }
    async with run_executive(made) as control, serve_face(CotFace, control, given, "cot"):
        yield control


async def until(condition: Callable[[], Any]) -> None:
    async with asyncio.timeout(WITHIN_S):
        while not condition():  # noqa: ASYNC110  # a program of others has no event
            await asyncio.sleep(0.02)


@pytest.mark.tried_with(
    "taky",
    "routes events and chat between the face and pytak, over TLS",
    kind="TAK",
    result="m2pem is a contact: markers and routes sent to it are handed over, none comes back",
    package="taky-ng",
)
async def test_what_a_phone_sends_to_the_contact_is_handed_over_and_not_echoed(
    server: int, certificates: Path
) -> None:
    async with (
        phone(server, certificates, "ANNA") as anna,
        phone(server, certificates, "BEN") as ben,
        fleet(server, certificates, rate="5 Hz") as control,
    ):
        contact = await anna.until(is_called("M2PEM"))
        assert (contact.get("uid"), contact.get("type")) == (UID, "a-f-G-U-C")
        assert contact.find("detail/takv").get("platform") == "m2pem"
        assert contact.find("detail/contact").get("endpoint") == "*:-1:stcp"
        name = '<contact callsign="lz"/>'
        corners = '<link point="38.1,-77.31"/><link point="38.2,-77.31"/>'
        await anna.send("marker-1", "b-m-p-s-m", f"{name}{TO_M2PEM}")
        await anna.send("route-1", "b-m-r", f'{corners}<contact callsign="way"/>{TO_M2PEM}')
        await until(lambda: {"lz", "way"} <= set(control.geometries()))
        assert control.geometries()["lz"].by.startswith("cot marker-1 at tls://127.0.0.1:")
        assert control.geometries()["way"].geometry["geometry"]["type"] == "LineString"
        road = {"type": "Feature", "geometry": {"type": "Point", "coordinates": [-77.3, 38.1]}}
        await control.set_geometry("road", {**road, "properties": {}}, by="otto")
        for each in (anna, ben):
            await each.until(is_called("road"))
            assert not list(filter(is_called("lz"), each.seen)), "it is on the map already"
            assert not list(filter(is_called("way"), each.seen))


async def test_a_prompt_is_answered_in_words_and_the_journal_has_by_whom(
    server: int, certificates: Path
) -> None:
    async with (
        phone(server, certificates, "ANNA") as anna,
        fleet(server, certificates) as control,
    ):
        await anna.until(is_called("M2PEM"))
        run = await control.start(scenarios.question("Is the bridge clear?", ("yes", "no")))
        asked = await anna.read("Is the bridge clear?")
        assert asked.startswith(f"{run} ")
        assert "yes | no" in asked
        await anna.chat("yes", to="All Chat Rooms", room="All Chat Rooms")
        await anna.chat("maybe")
        assert "'maybe' is no answer" in await anna.read("'maybe' is no answer")
        (still,) = control.prompts()  # what was written in the room came before, and is no answer
        async with asyncio.timeout(WITHIN_S):
            while control.prompts():  # a word counts once the question could be read
                await anna.chat(" Yes ")
                await asyncio.sleep(0.2)
        assert str((await control.wait(run)).status) == "completed"
        by = "cot ANNA (ANDROID-ANNA) at tls://127.0.0.1:"
        assert f"yes ({by}" in await anna.read(f"{run} {still.prompt}: yes")
        records = [str(each.record) for each in await control.records(run, 0, 1000)]
        assert any(by in each for each in records)


async def test_a_word_that_comes_as_soon_as_another_question_is_asked_for_again(
    server: int, certificates: Path
) -> None:
    async with (
        phone(server, certificates, "ANNA") as anna,
        fleet(server, certificates) as control,
    ):
        await anna.until(is_called("M2PEM"))
        run = await control.start(scenarios.question("Is the road clear?", ("yes", "no")))
        await until(control.prompts)
        await anna.chat("yes")
        assert run in await anna.read("'yes' may be meant for another")
        await anna.chat(f"{run} {control.prompts()[0].prompt} yes")
        assert str((await control.wait(run)).status) == "completed"


async def test_an_answer_that_fits_several_questions_is_asked_for_again(
    server: int, certificates: Path
) -> None:
    async with (
        phone(server, certificates, "ANNA") as anna,
        fleet(server, certificates) as control,
    ):
        await anna.until(is_called("M2PEM"))
        run = await control.start(scenarios.two_questions())
        await anna.read("Is the road clear?")
        await anna.read("Is the bridge clear?")
        await anna.chat("yes")
        assert "may answer several questions" in await anna.read("several questions")
        for prompt in control.prompts():
            await anna.chat(f"{run} {prompt.prompt} yes")
        assert str((await control.wait(run)).status) == "completed"


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"chat": True}, "it needs a `callsign`"),
        ({"chat": True, "callsign": "M2PEM"}, "it needs a tls:// url"),
        ({"callsign": "a\nb"}, "is no callsign"),
    ],
)
async def test_wrong_settings_of_the_contact_are_named(settings: dict[str, Any], says: str) -> None:
    async with run_executive(scenarios.fleet("sim", {"rover1": {}})) as control:
        with pytest.raises(PluginError, match=says):
            async with serve_face(CotFace, control, {"url": "udp://a:1", **settings}, "cot"):
                pass
