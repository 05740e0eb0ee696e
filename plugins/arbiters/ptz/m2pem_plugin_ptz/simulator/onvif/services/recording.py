"""The recording control service: one recording, and its jobs."""

from m2pem_plugin_ptz.simulator.onvif.camera import Camera, Job
from m2pem_plugin_ptz.simulator.onvif.services import PROFILE, Operations, know
from m2pem_plugin_ptz.simulator.onvif.soap import Element, FaultError

RECORDING = "recording_1"
MOST_JOBS = 2


def _capabilities(_camera: Camera, _asked: Element, _base: str) -> str:
    return (
        '<trc:Capabilities DynamicRecordings="false" MaxRecordings="1" '
        f'MaxRecordingJobs="{MOST_JOBS}"/>'
    )


def _recordings(_camera: Camera, _asked: Element, _base: str) -> str:
    source = (
        "<tt:Source><tt:SourceId>urn:m2pem:camera</tt:SourceId><tt:Name>camera</tt:Name>"
        "<tt:Location/><tt:Description/><tt:Address>urn:m2pem:camera</tt:Address></tt:Source>"
    )
    return (
        f"<trc:RecordingItem><tt:RecordingToken>{RECORDING}</tt:RecordingToken>"
        f"<tt:Configuration>{source}<tt:Content>all</tt:Content>"
        "<tt:MaximumRetentionTime>PT0S</tt:MaximumRetentionTime></tt:Configuration>"
        "<tt:Tracks><tt:Track><tt:TrackToken>video</tt:TrackToken><tt:Configuration>"
        "<tt:TrackType>Video</tt:TrackType><tt:Description/></tt:Configuration></tt:Track></tt:Tracks>"
        "</trc:RecordingItem>"
    )


def _settings(tag: str, active: bool) -> str:
    mode = "Active" if active else "Idle"
    return (
        f"<{tag}><tt:RecordingToken>{RECORDING}</tt:RecordingToken><tt:Mode>{mode}</tt:Mode>"
        f"<tt:Priority>1</tt:Priority></{tag}>"
    )


def _jobs(camera: Camera, _asked: Element, _base: str) -> str:
    return "".join(
        f"<trc:JobItem><tt:JobToken>{job.token}</tt:JobToken>"
        f"{_settings('tt:JobConfiguration', job.active)}</trc:JobItem>"
        for job in camera.jobs.values()
    )


def _create(camera: Camera, asked: Element, _base: str) -> str:
    know(asked.says("JobConfiguration", "RecordingToken"), RECORDING, what="recording")
    source = asked.says("JobConfiguration", "Source", "SourceToken", "Token")
    if source:
        know(source, PROFILE)
    active = _mode(asked.says("JobConfiguration", "Mode"))
    if camera.fault_state.full:
        raise FaultError("the storage is full", "Action", "StorageFull", receiver=True)
    if len(camera.jobs) >= MOST_JOBS:
        raise FaultError("there are too many jobs", "Action", "MaxRecordingJobs", receiver=True)
    job = camera.add_job(active)
    configuration = _settings("trc:JobConfiguration", active)
    return f"<trc:JobToken>{job.token}</trc:JobToken>{configuration}"


def _mode(text: str) -> bool:
    if text not in ("Active", "Idle"):
        raise FaultError(f"there is no mode {text!r}", "InvalidArgVal", "BadMode")
    return text == "Active"


def _job(camera: Camera, asked: Element) -> Job:
    token = asked.says("JobToken")
    know(token, *camera.jobs, what="job")
    return camera.jobs[token]


def _set_mode(camera: Camera, asked: Element, _base: str) -> str:
    camera.set_job(_job(camera, asked), _mode(asked.says("Mode")))
    return ""


def _delete(camera: Camera, asked: Element, _base: str) -> str:
    camera.remove_job(_job(camera, asked))
    return ""


def _state(camera: Camera, asked: Element, _base: str) -> str:
    state = "Active" if _job(camera, asked).active else "Idle"
    return (
        f"<trc:State><tt:RecordingToken>{RECORDING}</tt:RecordingToken>"
        f"<tt:State>{state}</tt:State></trc:State>"
    )


OPERATIONS: Operations = {
    "GetServiceCapabilities": _capabilities,
    "GetRecordings": _recordings,
    "GetRecordingJobs": _jobs,
    "CreateRecordingJob": _create,
    "SetRecordingJobMode": _set_mode,
    "DeleteRecordingJob": _delete,
    "GetRecordingJobState": _state,
}
