"""The settings of a connection to a MAVLink vehicle in the fleet file."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from m2pem.api import Connection, ConnectionReader, ResourceId
from m2pem_plugin_mavlink.signing.policy import SigningPolicy, read_signing

DRIVERS = ("pymavlink", "mavsdk")
SCHEMES = ("udpin", "udpout", "tcpin", "tcpout", "serial")
GCS_SYSTEM_ID = 255


@dataclass(frozen=True, slots=True)
class Settings:
    """`urls`: the endpoints on which the vehicle may be reached. `actuators`: the names in the
    fleet file for actuators ("servo 9"). `signing` None: frames are neither signed nor checked."""

    urls: tuple[str, ...]
    system_id: int
    component_id: int = 1
    driver: str = "pymavlink"
    gcs_system_id: int = GCS_SYSTEM_ID
    actuators: Mapping[str, str] = field(default_factory=dict)
    signing: SigningPolicy | None = None


SITL = "sitl"
"""The keys that only `m2pem sitl` reads."""

_KEYS = (
    "url",
    "system_id",
    "component_id",
    "driver",
    "gcs_system_id",
    "actuators",
    "signing",
    SITL,
)


def read_settings(
    connections: Mapping[ResourceId, Connection], state_folder: Path | None = None
) -> dict[ResourceId, Settings]:
    """Read the settings of all vehicles; payloads have none of their own. `state_folder`: where the
    timestamps of signatures are kept.

    Raises:
        PluginError: something is missing or wrong; the text names the resource and the key.
    """
    read = {
        resource: _read(resource, connection.settings, state_folder)
        for resource, connection in connections.items()
        if "/" not in resource
    }
    state: dict[tuple[str, int, int], ResourceId] = {}
    for resource, settings in read.items():
        for url in settings.urls:
            key = (url, settings.system_id, settings.component_id)
            if (other := state.setdefault(key, resource)) != resource:
                raise ConnectionReader(resource, {}).error(
                    "system_id", f"{other} is system {settings.system_id} of {url}, too"
                )
    first = next(iter(read.values()), None)
    for resource, settings in read.items():
        if first is not None and settings.gcs_system_id != first.gcs_system_id:
            raise ConnectionReader(resource, {}).error(
                "gcs_system_id",
                f"it is {settings.gcs_system_id}, and {first.gcs_system_id} for "
                f"{next(iter(read))}; it must be the same for all vehicles",
            )
    return read


def _read(resource: ResourceId, settings: Mapping[str, Any], state_folder: Path | None) -> Settings:
    reader = ConnectionReader(resource, settings)
    reader.refuse_others(_KEYS)
    driver = settings.get("driver", DRIVERS[0])
    if driver not in DRIVERS:
        raise reader.error("driver", f"{driver!r} is none of {', '.join(DRIVERS)}")
    urls, component_id = _urls(reader), reader.whole("component_id", 1, 1, 255)
    signing = read_signing(reader, component_id, len(urls), state_folder)
    if signing is not None and driver == "mavsdk":
        raise reader.error(
            "signing", "MAVSDK has no interface for signing; leave out `driver: mavsdk`"
        )
    return Settings(
        urls,
        reader.whole("system_id", None, 1, 255, "the MAVLink system id of the vehicle"),
        component_id,
        driver,
        reader.whole("gcs_system_id", GCS_SYSTEM_ID, 1, 255),
        _actuators(reader),
        signing,
    )


def _urls(reader: ConnectionReader) -> tuple[str, ...]:
    value = reader.values.get("url")
    urls = value if isinstance(value, list) else [value]
    example = "such as udpin://127.0.0.1:14550"
    if value is None or not urls:
        raise reader.error("url", f"a MAVLink vehicle needs one, {example}")
    for url in urls:
        scheme = url.partition("://")[0] if isinstance(url, str) and "://" in url else ""
        if scheme not in SCHEMES:
            schemes = ", ".join(SCHEMES)
            raise reader.error("url", f"{url!r} is not a URL of {schemes}, {example}")
    return tuple(urls)


def _actuators(reader: ConnectionReader) -> dict[str, str]:
    value = reader.values.get("actuators", {})
    if not isinstance(value, Mapping) or not all(isinstance(v, str | int) for v in value.values()):
        raise reader.error("actuators", "names and what they are, such as {dropper: servo 9}")
    return {str(name): str(meant) for name, meant in value.items()}
