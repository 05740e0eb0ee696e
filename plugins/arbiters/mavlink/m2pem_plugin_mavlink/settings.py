"""The settings of a connection to a MAVLink vehicle in the fleet file."""

import difflib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from m2pem.api import Connection, ResourceId
from m2pem.errors import PluginError

DRIVERS = ("pymavlink", "mavsdk")
SCHEMES = ("udpin", "udpout", "tcpin", "tcpout", "serial")
GCS_SYSTEM_ID = 255


@dataclass(frozen=True, slots=True)
class Settings:
    """`urls`: the endpoints on which the vehicle may be reached. `actuators`: the names in the
    fleet file for actuators ("servo 9")."""

    urls: tuple[str, ...]
    system_id: int
    component_id: int = 1
    driver: str = "pymavlink"
    gcs_system_id: int = GCS_SYSTEM_ID
    actuators: Mapping[str, str] = field(default_factory=dict)


SITL = "sitl"
"""The keys that only `m2pem sitl` reads."""

_KEYS = ("url", "system_id", "component_id", "driver", "gcs_system_id", "actuators", SITL)


def read_settings(connections: Mapping[ResourceId, Connection]) -> dict[ResourceId, Settings]:
    """Read the settings of all vehicles; payloads have none of their own.

    Raises:
        PluginError: something is missing or wrong; the text names the resource and the key.
    """
    read = {
        resource: _read(resource, connection.settings)
        for resource, connection in connections.items()
        if "/" not in resource
    }
    state: dict[tuple[str, int, int], ResourceId] = {}
    for resource, settings in read.items():
        for url in settings.urls:
            key = (url, settings.system_id, settings.component_id)
            if (other := state.setdefault(key, resource)) != resource:
                raise _error(
                    resource, "system_id", f"{other} is system {settings.system_id} of {url}, too"
                )
    first = next(iter(read.values()), None)
    for resource, settings in read.items():
        if first is not None and settings.gcs_system_id != first.gcs_system_id:
            raise _error(
                resource,
                "gcs_system_id",
                f"it is {settings.gcs_system_id}, and {first.gcs_system_id} for "
                f"{next(iter(read))}; it must be the same for all vehicles",
            )
    return read


def _read(resource: ResourceId, settings: Mapping[str, Any]) -> Settings:
    for key in settings:
        if key not in _KEYS:
            near = difflib.get_close_matches(str(key), _KEYS, n=1)
            hint = f"did you mean '{near[0]}'?" if near else f"known: {', '.join(_KEYS)}"
            raise _error(resource, str(key), f"there is no such setting; {hint}")
    driver = settings.get("driver", DRIVERS[0])
    if driver not in DRIVERS:
        raise _error(resource, "driver", f"{driver!r} is none of {', '.join(DRIVERS)}")
    return Settings(
        _urls(resource, settings.get("url")),
        _id(resource, settings, "system_id", None),
        _id(resource, settings, "component_id", 1),
        driver,
        _id(resource, settings, "gcs_system_id", GCS_SYSTEM_ID),
        _actuators(resource, settings.get("actuators", {})),
    )


def _urls(resource: ResourceId, value: Any) -> tuple[str, ...]:
    urls = value if isinstance(value, list) else [value]
    example = "such as udpin://127.0.0.1:14550"
    if value is None or not urls:
        raise _error(resource, "url", f"a MAVLink vehicle needs one, {example}")
    for url in urls:
        scheme = url.partition("://")[0] if isinstance(url, str) and "://" in url else ""
        if scheme not in SCHEMES:
            schemes = ", ".join(SCHEMES)
            raise _error(resource, "url", f"{url!r} is not a URL of {schemes}, {example}")
    return tuple(urls)


def _id(resource: ResourceId, settings: Mapping[str, Any], key: str, default: int | None) -> int:
    value = settings.get(key, default)
    if value is None:
        raise _error(resource, key, "it is missing: the MAVLink system id of the vehicle, 1 to 255")
    if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= 255:
        raise _error(resource, key, f"{value!r} is not a whole number from 1 to 255")
    return value


def _actuators(resource: ResourceId, value: Any) -> dict[str, str]:
    if not isinstance(value, Mapping) or not all(isinstance(v, str | int) for v in value.values()):
        raise _error(resource, "actuators", "names and what they are, such as {dropper: servo 9}")
    return {str(name): str(meant) for name, meant in value.items()}


def _error(resource: ResourceId, key: str, problem: str) -> PluginError:
    return PluginError(f"{resource}: connection.{key}: {problem}")
