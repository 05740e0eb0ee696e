"""The device service: time, services, and device information."""

from collections.abc import Iterator
from datetime import UTC, datetime
from xml.sax.saxutils import escape

from m2pem_plugin_ptz.simulator.onvif import soap
from m2pem_plugin_ptz.simulator.onvif.camera import Camera
from m2pem_plugin_ptz.simulator.onvif.services import Operations
from m2pem_plugin_ptz.simulator.onvif.soap import Element

FREE = frozenset(
    {"GetSystemDateAndTime", "GetServices", "GetCapabilities", "GetServiceCapabilities"}
)
"""Operations without a password, by the specification."""

PATHS = {
    soap.DEVICE: "/onvif/device_service",
    soap.MEDIA: "/onvif/media_service",
    soap.MEDIA2: "/onvif/media2_service",
    soap.PTZ: "/onvif/ptz_service",
    soap.RECORDING: "/onvif/recording_service",
}


def offered(camera: Camera) -> Iterator[str]:
    """Yield the namespaces of its services."""
    yield soap.DEVICE
    if camera.spec.media:
        yield soap.MEDIA
    if camera.spec.media2:
        yield soap.MEDIA2
    yield soap.PTZ
    if camera.spec.recording:
        yield soap.RECORDING


def _time(camera: Camera, _asked: Element, _base: str) -> str:
    now = datetime.fromtimestamp(camera.now_s, UTC)
    moment = (
        f"<tt:Time><tt:Hour>{now.hour}</tt:Hour><tt:Minute>{now.minute}</tt:Minute>"
        f"<tt:Second>{now.second}</tt:Second></tt:Time>"
        f"<tt:Date><tt:Year>{now.year}</tt:Year><tt:Month>{now.month}</tt:Month>"
        f"<tt:Day>{now.day}</tt:Day></tt:Date>"
    )
    return (
        "<tds:SystemDateAndTime>"
        "<tt:DateTimeType>Manual</tt:DateTimeType><tt:DaylightSavings>false</tt:DaylightSavings>"
        f"<tt:TimeZone><tt:TZ>UTC0</tt:TZ></tt:TimeZone><tt:UTCDateTime>{moment}</tt:UTCDateTime>"
        "</tds:SystemDateAndTime>"
    )


def _services(camera: Camera, _asked: Element, base: str) -> str:
    return "".join(
        f"<tds:Service><tds:Namespace>{uri}</tds:Namespace><tds:XAddr>{base}{PATHS[uri]}</tds:XAddr>"
        "<tds:Version><tt:Major>2</tt:Major><tt:Minor>60</tt:Minor></tds:Version></tds:Service>"
        for uri in offered(camera)
    )


def _capabilities(camera: Camera, _asked: Element, base: str) -> str:
    media = ""
    if camera.spec.media:
        media = (
            f"<tt:Media><tt:XAddr>{base}{PATHS[soap.MEDIA]}</tt:XAddr>"
            "<tt:StreamingCapabilities/></tt:Media>"
        )
    return (
        f"<tds:Capabilities><tt:Device><tt:XAddr>{base}{PATHS[soap.DEVICE]}</tt:XAddr></tt:Device>{media}"
        f"<tt:PTZ><tt:XAddr>{base}{PATHS[soap.PTZ]}</tt:XAddr></tt:PTZ>"
        "</tds:Capabilities>"
    )


def _information(camera: Camera, _asked: Element, _base: str) -> str:
    return (
        f"<tds:Manufacturer>m2pem</tds:Manufacturer><tds:Model>{escape(camera.spec.name)}</tds:Model>"
        "<tds:FirmwareVersion>1.0</tds:FirmwareVersion><tds:SerialNumber>1</tds:SerialNumber>"
        "<tds:HardwareId>simulated</tds:HardwareId>"
    )


OPERATIONS: Operations = {
    "GetSystemDateAndTime": _time,
    "GetServices": _services,
    "GetCapabilities": _capabilities,
    "GetDeviceInformation": _information,
}
