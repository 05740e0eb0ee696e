"""The settings of a MAVLink camera in the fleet file."""

from dataclasses import dataclass, fields
from enum import StrEnum

from m2pem.api import Connection, ConnectionReader

AUTOPILOT_COMPONENT, CAMERA_COMPONENT = 1, 100
GCS_SYSTEM_ID = 255
OWN_COMPONENT = 191
"""Cameras are commanded as this component of the ground station; vehicles as 190."""

MOST_DEVICES = 255


class Yaw(StrEnum):
    """The direction that a gimbal keeps between two commands."""

    VEHICLE = "vehicle"
    NORTH = "north"


@dataclass(frozen=True, slots=True)
class MavlinkSettings:
    """`system_id`, `component_id`: of the vehicle's autopilot. `gimbal`: without one, the camera
    points ahead. `gimbal_component`: of the gimbal manager. `camera_component` None: a camera of
    its own, or else the autopilot. Device 0: the only one."""

    urls: tuple[str, ...]
    system_id: int
    component_id: int = AUTOPILOT_COMPONENT
    gcs_system_id: int = GCS_SYSTEM_ID
    own_component: int = OWN_COMPONENT
    gimbal: bool = True
    gimbal_component: int = AUTOPILOT_COMPONENT
    gimbal_device: int = 0
    camera_component: int | None = None
    camera_device: int = 0
    yaw: Yaw = Yaw.VEHICLE

    @property
    def camera_components(self) -> tuple[int, ...]:
        """Components that may be the camera, the likeliest first."""
        if self.camera_component is not None:
            return (self.camera_component,)
        return CAMERA_COMPONENT, self.component_id


_KEYS = ("url", *(each.name for each in fields(MavlinkSettings) if each.name != "urls"))


def read_settings(connection: Connection) -> MavlinkSettings:
    """Read the settings of one camera.

    Raises:
        PluginError: something is missing or wrong; the text names the resource and the key.
    """
    own = ConnectionReader(connection.resource, connection.settings)
    own.refuse_misspelled(_KEYS)
    autopilot = own.whole("component_id", AUTOPILOT_COMPONENT, 1, 255, "of the autopilot")
    camera = None
    if "camera_component" in own.values:
        camera = own.whole("camera_component", CAMERA_COMPONENT, 1, 255, "of the camera")
    return MavlinkSettings(
        urls=_urls(own),
        system_id=own.whole("system_id", None, 1, 255, "the MAVLink system id of the vehicle"),
        component_id=autopilot,
        gcs_system_id=own.whole("gcs_system_id", GCS_SYSTEM_ID, 1, 255, "our own"),
        own_component=own.whole("own_component", OWN_COMPONENT, 1, 255, "our own"),
        gimbal=own.flag("gimbal", True),
        gimbal_component=own.whole("gimbal_component", autopilot, 1, 255, "of the manager"),
        gimbal_device=own.whole("gimbal_device", 0, 0, MOST_DEVICES, "of the manager's gimbals"),
        camera_component=camera,
        camera_device=own.whole("camera_device", 0, 0, MOST_DEVICES, "of its cameras"),
        yaw=own.choice("yaw", Yaw, Yaw.VEHICLE),
    )


def _urls(own: ConnectionReader) -> tuple[str, ...]:
    value = own.values.get("url")
    urls = value if isinstance(value, list | tuple) else [value]
    if not urls or not all(isinstance(url, str) and "://" in url for url in urls):
        raise own.error(
            "url",
            f"{value!r} is not a URL; write that of the vehicle, such as udpin://127.0.0.1:14550",
        )
    return tuple(urls)
