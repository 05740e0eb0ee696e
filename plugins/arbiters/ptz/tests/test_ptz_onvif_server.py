"""The simulated camera answers a SOAP client that knows nothing of it, by the official WSDLs."""

import base64
import hashlib
import os
from contextlib import asynccontextmanager
from datetime import UTC, datetime, timedelta
from functools import cache
from pathlib import Path

import aiohttp
import httpx
import onvif
import pytest
import zeep
from lxml import etree
from onvif_bench import ACCOUNT, camera, until
from zeep.cache import InMemoryCache
from zeep.proxy import AsyncServiceProxy
from zeep.transports import AsyncTransport
from zeep.wsse.username import UsernameToken

from m2pem.testing.loopback import on_loopback

WSDL = Path(onvif.__file__).parent / "wsdl"
SERVICES = {
    "device": ("devicemgmt.wsdl", "http://www.onvif.org/ver10/device/wsdl", "DeviceBinding"),
    "media": ("media.wsdl", "http://www.onvif.org/ver10/media/wsdl", "MediaBinding"),
    "ptz": ("ptz.wsdl", "http://www.onvif.org/ver20/ptz/wsdl", "PTZBinding"),
    "recording": (
        "recording.wsdl",
        "http://www.onvif.org/ver10/recording/wsdl",
        "RecordingBinding",
    ),
}
GENERIC = "http://www.onvif.org/ver10/tptz/PanTiltSpaces/PositionGenericSpace"


def plain_http(kind=httpx.AsyncClient):
    """A client that does not read the certificates of this machine: the camera speaks HTTP."""
    return kind(trust_env=False, verify=False)


@cache
def document(file):
    transport = AsyncTransport(
        client=plain_http(), wsdl_client=plain_http(httpx.Client), cache=InMemoryCache()
    )
    return zeep.wsdl.Document(str(WSDL / file), transport)


@asynccontextmanager
async def client(server, name, token=None):
    """Plain zeep, strict: what is not by the schema is an error."""
    file, namespace, binding = SERVICES[name]
    async with plain_http() as http:
        transport = AsyncTransport(
            client=http, wsdl_client=plain_http(httpx.Client), cache=InMemoryCache()
        )
        found = zeep.AsyncClient(document(file), transport=transport, wsse=token)
        address = f"http://127.0.0.1:{server.port}/onvif/{name}_service"
        yield AsyncServiceProxy(
            found, found.wsdl.bindings[f"{{{namespace}}}{binding}"], address=address
        )


def account(password=ACCOUNT.password, **options):
    return UsernameToken(ACCOUNT.user, password, use_digest=True, zulu_timestamp=True, **options)


@on_loopback
@pytest.mark.tried_with(
    "onvif-zeep-async",
    "asks the simulated ONVIF camera by the WSDL of ONVIF",
    kind="Cameras",
    result="understands every answer",
)
async def test_a_strict_client_understands_every_answer():
    async with camera(account=ACCOUNT) as server:
        async with client(server, "device", account()) as device:
            said = await device.GetSystemDateAndTime()
            assert abs(said.UTCDateTime.Date.Year - datetime.now(UTC).year) <= 1
            listed = await device.GetServices(IncludeCapability=False)
            assert f"http://127.0.0.1:{server.port}/onvif/ptz_service" in [
                each.XAddr for each in listed
            ]
            assert (await device.GetCapabilities(Category="All")).PTZ.XAddr
            assert (await device.GetDeviceInformation()).Manufacturer == "m2pem"
        async with client(server, "media", account()) as media:
            profile = (await media.GetProfiles())[0]
            assert (await media.GetProfile(profile.token)).Name == "main"
            uri = await media.GetSnapshotUri(profile.token)
            assert uri.Uri == f"http://127.0.0.1:{server.port}/snapshot.jpg"
        async with client(server, "recording", account()) as recording:
            assert (await recording.GetServiceCapabilities()).MaxRecordingJobs == 2
            item = (await recording.GetRecordings())[0]
            made = await recording.CreateRecordingJob(
                {"RecordingToken": item.RecordingToken, "Mode": "Active", "Priority": 1}
            )
            assert (await recording.GetRecordingJobs())[0].JobToken == made.JobToken
            assert (await recording.GetRecordingJobState(made.JobToken)).State == "Active"
            assert server.camera.recording
            await recording.SetRecordingJobMode(made.JobToken, "Idle")
            await recording.DeleteRecordingJob(made.JobToken)
            assert not server.camera.jobs


@pytest.mark.parametrize("degrees", [True, False])
@on_loopback
async def test_a_strict_client_turns_the_camera_and_sees_where_it_looks(degrees):
    async with camera(degrees=degrees) as server, client(server, "ptz") as ptz:
        node = (await ptz.GetNodes())[0]
        listed = node.SupportedPTZSpaces.AbsolutePanTiltPositionSpace
        assert len(listed) == (2 if degrees else 1)
        assert (await ptz.GetConfiguration("ptz_1")).NodeToken == node.token
        place = {"PanTilt": {"x": 0.5, "y": 0.0, "space": GENERIC}, "Zoom": {"x": 0.5}}
        await ptz.AbsoluteMove("profile_1", place)
        for _ in range(300):
            status = await ptz.GetStatus("profile_1")
            if status.MoveStatus.PanTilt == status.MoveStatus.Zoom == "IDLE":
                break
        assert status.Position.PanTilt.x == pytest.approx(90.0 if degrees else 0.5, abs=1e-3)
        assert status.Position.Zoom.x == pytest.approx(0.5, abs=1e-3)
        assert server.camera.ptz == pytest.approx((1.5708, -0.5236, 10.5), abs=1e-3)


@on_loopback
async def test_a_velocity_lasts_as_long_as_its_timeout_or_until_a_stop():
    async with camera() as server, client(server, "ptz") as ptz:
        half = {"PanTilt": {"x": 0.5, "y": 0.0}}
        await ptz.ContinuousMove("profile_1", half, timedelta(seconds=0.3))
        await until(lambda: server.camera.ptz[0] > 0.05)
        await until(lambda: server.camera.ptz and not server.camera.gimbal.pan.moving)
        assert 0.1 < server.camera.ptz[0] < 0.5
        await ptz.ContinuousMove("profile_1", half, timedelta(seconds=60))
        await ptz.Stop("profile_1")
        assert server.camera.gimbal.pan.velocity == 0.0


@pytest.mark.parametrize(
    ("place", "text"),
    [
        ({"PanTilt": {"x": 1.5, "y": 0.0, "space": GENERIC}}, "1.5 is not in -1.0 to 1.0"),
        ({"PanTilt": {"x": 0.0, "y": 0.0, "space": "urn:no"}}, "there is no space urn:no"),
    ],
)
@on_loopback
async def test_what_cannot_be_is_a_fault_and_moves_nothing(place, text):
    async with camera() as server, client(server, "ptz") as ptz:
        with pytest.raises(zeep.exceptions.Fault, match=text):
            await ptz.AbsoluteMove("profile_1", place)
        with pytest.raises(zeep.exceptions.Fault, match="there is no profile 'other'"):
            await ptz.GetStatus("other")
        assert server.camera.moves == 0


@pytest.mark.parametrize(
    ("token", "why"),
    [
        (None, "there is no user name token"),
        (account("wrong"), "the user or the password is wrong"),
        (UsernameToken(ACCOUNT.user, ACCOUNT.password), "the password is not a digest"),
        (UsernameToken("root", ACCOUNT.password, use_digest=True), "the user or the password"),
        (account(created=datetime(2020, 1, 1)), "the token was not made now"),
    ],
)
@on_loopback
async def test_nobody_comes_in_without_a_fresh_digest_of_the_password(token, why):
    async with camera(account=ACCOUNT) as server, client(server, "media", token) as media:
        with pytest.raises(zeep.exceptions.Fault, match=why) as refused:
            await media.GetProfiles()
        assert [code.localname for code in refused.value.subcodes] == ["NotAuthorized"]


@on_loopback
async def test_a_nonce_is_taken_once():
    token = account(nonce="one of many")
    async with camera(account=ACCOUNT) as server, client(server, "media", token) as media:
        await media.GetProfiles()
        with pytest.raises(zeep.exceptions.Fault, match="the nonce was used before"):
            await media.GetProfiles()


@on_loopback
async def test_a_token_must_be_made_by_the_cameras_clock():
    async with camera(account=ACCOUNT, skew_s=-3600.0) as server:
        behind = datetime.now(UTC).replace(tzinfo=None) - timedelta(hours=1)
        async with client(server, "media", account(created=behind)) as media:
            assert await media.GetProfiles()


@on_loopback
async def test_what_is_no_soap_is_a_fault():
    async with camera() as server, aiohttp.ClientSession() as http:
        bomb = '<!DOCTYPE a [<!ENTITY b "c">]><a>&b;</a>'
        for body in ("", "<a/>", "no xml", bomb):
            url = f"http://127.0.0.1:{server.port}/onvif/ptz_service"
            async with http.post(url, data=body) as answer:
                assert answer.status == 400
                fault = etree.fromstring(await answer.read())
                assert "WellFormed" in etree.tostring(fault, encoding="unicode")


@on_loopback
async def test_the_digest_is_the_one_of_the_specification():
    """Without any library: nonce, created and password, hashed with SHA-1."""
    nonce, created = os.urandom(16), datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
    whole = nonce + created.encode() + ACCOUNT.password.encode()
    digest = base64.b64encode(hashlib.sha1(whole).digest()).decode()
    wsse = "http://docs.oasis-open.org/wss/2004/01/oasis-200401-wss"
    envelope = f"""<s:Envelope xmlns:s="http://www.w3.org/2003/05/soap-envelope"><s:Header>
      <Security xmlns="{wsse}-wssecurity-secext-1.0.xsd"><UsernameToken>
      <Username>{ACCOUNT.user}</Username>
      <Password Type="{wsse}-username-token-profile-1.0#PasswordDigest">{digest}</Password>
      <Nonce>{base64.b64encode(nonce).decode()}</Nonce>
      <Created xmlns="{wsse}-wssecurity-utility-1.0.xsd">{created}</Created>
      </UsernameToken></Security></s:Header>
      <s:Body><GetProfiles xmlns="http://www.onvif.org/ver10/media/wsdl"/></s:Body></s:Envelope>"""
    async with camera(account=ACCOUNT) as server, aiohttp.ClientSession() as http:
        url = f"http://127.0.0.1:{server.port}/onvif/media_service"
        async with http.post(url, data=envelope) as answer:
            assert answer.status == 200
            assert b"profile_1" in await answer.read()
