"""Video that the camera keeps itself: its recording control service."""

from dataclasses import dataclass
from typing import Any

from m2pem_plugin_ptz.drivers.onvif.session import Session
from m2pem_plugin_ptz.drivers.onvif.troubles import RefusedError, camera

PROFILE = "http://www.onvif.org/ver10/schema/Profile"
TIME = "%Y-%m-%dT%H:%M:%SZ"


@dataclass(frozen=True, slots=True)
class Recording:
    """One that goes on. `own`: the job was made for it. `begun`: by the camera's clock."""

    token: str
    job: str
    own: bool
    begun: str


async def start_recording(session: Session, profile: str) -> Recording:
    """Have the camera record.

    Raises:
        CameraError: it does not.
    """
    found = await session.call("recording", "GetRecordings")
    if not found:
        raise RefusedError(
            f"{camera(session.settings)} has no recording to write to: make one in the camera"
        )
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
        # It may have all its jobs already, one of which can be used.
        idle = await _idle_job(session, token)
        if idle is None:
            raise
        await session.call("recording", "SetRecordingJobMode", JobToken=idle, Mode="Active")
        recording = Recording(token, idle, False, begun)
    state = await session.call("recording", "GetRecordingJobState", JobToken=recording.job)
    if state.State not in ("Active", "PartiallyActive"):
        await stop_recording(session, recording)
        raise RefusedError(
            f"{camera(session.settings)} took the recording job, but its state is {state.State}"
        )
    return recording


async def stop_recording(session: Session, recording: Recording) -> str:
    """End it; returns the camera's name for it, with the time by the camera's clock.

    Raises:
        CameraError: it could not be told.
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
