"""Pictures by HTTP, and video by the recording control service."""

import asyncio
import base64
from dataclasses import dataclass
from typing import Any

from m2pem_plugin_ptz.drivers.onvif.session import (
    RefusedError,
    Session,
    camera,
    translate_error,
    unauthorized_error,
)
from m2pem_plugin_ptz.image_files import decode

PROFILE = "http://www.onvif.org/ver10/schema/Profile"
TIME = "%Y-%m-%dT%H:%M:%SZ"


@dataclass(frozen=True, slots=True)
class Recording:
    """An active recording. `own`: its job was created for it. `begun`: by the camera's clock."""

    token: str
    job: str
    own: bool
    begun: str


async def start_recording(session: Session, profile: str) -> Recording:
    """Start recording.

    Raises:
        CameraError: the camera refused, or did not answer.
    """
    found = await session.call("recording", "GetRecordings")
    if not found:
        raise RefusedError(f"{camera(session.settings)} has no recording: create one in the camera")
    token = str(found[0].RecordingToken)
    begun = session.camera_time.strftime(TIME)
    try:
        job = await session.call(
            "recording",
            "CreateRecordingJob",
            JobConfiguration={
                "RecordingToken": token,
                "Mode": "Active",
                "Priority": 1,
                "Source": [{"SourceToken": {"Token": profile, "Type": PROFILE}}],
            },
        )
        recording = Recording(token, str(job.JobToken), True, begun)
    except RefusedError:
        # The camera may have as many jobs as it can: use an idle one.
        idle = await _idle_job(session, token)
        if idle is None:
            raise
        await session.call("recording", "SetRecordingJobMode", JobToken=idle, Mode="Active")
        recording = Recording(token, idle, False, begun)
    state = await session.call("recording", "GetRecordingJobState", JobToken=recording.job)
    if state.State not in ("Active", "PartiallyActive"):
        await stop_recording(session, recording)
        raise RefusedError(
            f"{camera(session.settings)} accepted the recording job, but its state is {state.State}"
        )
    return recording


async def stop_recording(session: Session, recording: Recording) -> str:
    """Stop recording, and return the camera's URI of it, with times of the camera's clock.

    Raises:
        CameraError: the camera refused, or did not answer.
    """
    ended = session.camera_time.strftime(TIME)
    job = recording.job
    await session.call("recording", "SetRecordingJobMode", JobToken=job, Mode="Idle")
    if recording.own:
        await session.call("recording", "DeleteRecordingJob", JobToken=job)
    return (
        f"onvif://{session.settings.address}/recordings/{recording.token}"
        f"?from={recording.begun}&to={ended}"
    )


async def _idle_job(session: Session, token: str) -> str | None:
    jobs: Any = await session.call("recording", "GetRecordingJobs")
    for each in jobs or ():
        settings = each.JobConfiguration
        if str(settings.RecordingToken) == token and settings.Mode == "Idle":
            return str(each.JobToken)
    return None


LARGEST = 32 * 1024 * 1024
"""In bytes."""

TIMEOUT_FACTOR = 4.0
"""Timeout of a picture, in timeouts of a call."""

CHUNK = 64 * 1024
KINDS = {b"\xff\xd8\xff": ".jpg", b"\x89PNG": ".png"}
"""First bytes of pictures. The type that a camera reports is often wrong."""


async def fetch_snapshot(session: Session, url: str) -> tuple[bytes, str]:
    """Return a picture, and the suffix of its file.

    Raises:
        CameraError: the camera sent no picture; the text says why.
    """
    import aiohttp  # noqa: PLC0415  # comes with the library

    settings = session.settings
    try:
        async with asyncio.timeout(settings.timeout_s * TIMEOUT_FACTOR):
            async with aiohttp.ClientSession() as client:
                content = await _ask(client, session, url)
    except Exception as error:
        raise translate_error(error, "a picture", settings, session.user) from error
    suffix = next((kind for start, kind in KINDS.items() if content.startswith(start)), None)
    if suffix is None:
        raise RefusedError(f"{camera(settings)} sent {len(content)} bytes that are not a picture")
    try:
        await asyncio.to_thread(decode, content)
    except Exception as error:  # each format of Pillow raises its own
        raise RefusedError(
            f"{camera(settings)} sent a picture of {len(content)} bytes that cannot be decoded: "
            f"{error}"
        ) from error
    return content, suffix


async def _ask(client: Any, session: Session, url: str) -> bytes:
    """Request the picture with digest authentication, or basic if the camera knows no other."""
    import aiohttp  # noqa: PLC0415

    account = session.credentials
    digest = (
        () if account is None else (aiohttp.DigestAuthMiddleware(account.user, account.password),)
    )
    async with client.get(url, middlewares=digest, allow_redirects=False) as answer:
        asked = answer.headers.get("WWW-Authenticate", "").lower()
        if answer.status != 401 or account is None or not asked.startswith("basic"):
            return await _read(answer, session)
    basic = base64.b64encode(f"{account.user}:{account.password}".encode()).decode()
    headers = {"Authorization": f"Basic {basic}"}
    async with client.get(url, headers=headers, allow_redirects=False) as answer:
        return await _read(answer, session)


async def _read(answer: Any, session: Session) -> bytes:
    settings = session.settings
    if answer.status in (401, 403):
        raise unauthorized_error(settings, session.user)
    if answer.status != 200:
        raise RefusedError(f"{camera(settings)} refuses a picture: HTTP status {answer.status}")
    content = bytearray()
    async for chunk in answer.content.iter_chunked(CHUNK):
        content += chunk
        if len(content) > LARGEST:
            raise RefusedError(f"{camera(settings)} sent a picture of more than {LARGEST} bytes")
    return bytes(content)
