"""The media services: one profile, and the URL of its pictures. There is no stream."""

from m2pem_plugin_ptz.simulator.onvif.camera import Camera
from m2pem_plugin_ptz.simulator.onvif.services import PROFILE, SOURCE, Operations, know
from m2pem_plugin_ptz.simulator.onvif.services.ptz import configuration
from m2pem_plugin_ptz.simulator.onvif.soap import Element, FaultError

SNAPSHOT = "/snapshot.jpg"

_VIDEO = (
    "<tt:Name>video</tt:Name><tt:UseCount>1</tt:UseCount>"
    f"<tt:SourceToken>{SOURCE}</tt:SourceToken>"
    '<tt:Bounds x="0" y="0" width="640" height="360"/>'
)


def _profile(tag: str, camera: Camera) -> str:
    return (
        f'<{tag} token="{PROFILE}" fixed="true"><tt:Name>main</tt:Name>'
        f'<tt:VideoSourceConfiguration token="{SOURCE}">{_VIDEO}</tt:VideoSourceConfiguration>'
        f"{configuration(camera, 'tt:PTZConfiguration')}</{tag}>"
    )


def _profiles(camera: Camera, _asked: Element, _base: str) -> str:
    return _profile("trt:Profiles", camera)


def _one_profile(camera: Camera, asked: Element, _base: str) -> str:
    know(asked.says("ProfileToken"), PROFILE)
    return _profile("trt:Profile", camera)


def _snapshot(camera: Camera, asked: Element, base: str) -> str:
    know(asked.says("ProfileToken"), PROFILE)
    _see_that_there_are_snapshots(camera)
    return (
        f"<trt:MediaUri><tt:Uri>{base}{SNAPSHOT}</tt:Uri>"
        "<tt:InvalidAfterConnect>false</tt:InvalidAfterConnect>"
        "<tt:InvalidAfterReboot>false</tt:InvalidAfterReboot><tt:Timeout>PT0S</tt:Timeout>"
        "</trt:MediaUri>"
    )


def _see_that_there_are_snapshots(camera: Camera) -> None:
    if not camera.spec.snapshots:
        raise FaultError("no pictures", "ActionNotSupported", receiver=True)


def _profiles2(camera: Camera, asked: Element, _base: str) -> str:
    types = {each.text for each in asked.all("Type")}
    inner = ""
    if types & {"VideoSource", "All"}:
        inner += f'<tr2:VideoSource token="{SOURCE}">{_VIDEO}</tr2:VideoSource>'
    if types & {"PTZ", "All"}:
        inner += configuration(camera, "tr2:PTZ")
    configurations = f"<tr2:Configurations>{inner}</tr2:Configurations>" if inner else ""
    return (
        f'<tr2:Profiles token="{PROFILE}" fixed="true">'
        f"<tr2:Name>main</tr2:Name>{configurations}</tr2:Profiles>"
    )


def _snapshot2(camera: Camera, asked: Element, base: str) -> str:
    know(asked.says("ProfileToken"), PROFILE)
    _see_that_there_are_snapshots(camera)
    return f"<tr2:Uri>{base}{SNAPSHOT}</tr2:Uri>"


MEDIA: Operations = {
    "GetProfiles": _profiles,
    "GetProfile": _one_profile,
    "GetSnapshotUri": _snapshot,
}
MEDIA2: Operations = {"GetProfiles": _profiles2, "GetSnapshotUri": _snapshot2}
