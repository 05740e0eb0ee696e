"""The vehicles of a fleet for which autopilots are started: arbiter `mavlink`, `connection.sitl`
(docs/mavlink.md).
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from m2pem.api import Connection, ConnectionReader, Dimension, Fleet, ResourceId, offset
from m2pem.errors import PluginError
from m2pem_plugin_mavlink.protocol.url import SocketUrl, Way, parse_url
from m2pem_plugin_mavlink.settings import SITL, Settings, read_settings
from m2pem_plugin_mavlink.sitl.launch import (
    MAVLINK_SERIALS,
    Launch,
    Start,
    ardupilot_launch,
    px4_launch,
    px4_port,
)
from m2pem_plugin_mavlink.sitl.programs import (
    FRAMES,
    FRAMES_OF,
    PX4_MODELS,
    Frame,
    find_ardupilot,
    find_px4,
)
from m2pem_plugin_mavlink.vehicle.failsafe import link_parameters
from m2pem_plugin_mavlink.vehicle.identity import Firmware, Identity

_KEYS = ("firmware", "frame", "home", "heading", "parameters")
_FIRMWARES = {each.lower(): each for each in Firmware}


@dataclass(frozen=True, slots=True)
class SitlSettings:
    """`frame`: ArduPilot's frame or PX4's model; "" is the usual one of the domain.

    `home`: latitude and longitude in WGS-84 degrees, and metres above mean sea level, NaN where the
    fleet does not say; None: the vehicle has a place in the row at the fleet's origin.
    `heading_deg`: from true north, clockwise. `parameters`: of the autopilot, by name.
    """

    firmware: Firmware = Firmware.ARDUPILOT
    frame: str = ""
    home: tuple[float, float, float] | None = None
    heading_deg: float = 0.0
    parameters: Mapping[str, float] = field(default_factory=dict)


def read_sitl_settings(resource: ResourceId, value: Any) -> SitlSettings:
    """Read the settings in the map `connection.sitl`.

    Raises:
        PluginError: one of them is wrong; the text names the resource and the key.
    """
    reader = ConnectionReader(resource, {SITL: value}).inner(SITL, "{frame: quad}")
    reader.refuse_others(_KEYS)
    firmware = _FIRMWARES.get(str(reader.values.get("firmware", Firmware.ARDUPILOT)).lower())
    if firmware is None:
        known = ", ".join(_FIRMWARES)
        raise reader.error("firmware", f"{reader.values['firmware']!r} is none of {known}")
    frame = reader.values.get("frame", "")
    if not isinstance(frame, str):
        raise reader.error("frame", f"{frame!r} is not a name such as quad")
    return SitlSettings(
        firmware,
        frame,
        _home(reader),
        math.degrees(reader.quantity("heading", 0.0, Dimension.ANGLE)) % 360.0,
        _parameters(reader),
    )


def _home(reader: ConnectionReader) -> tuple[float, float, float] | None:
    value = reader.values.get("home")
    if value is None:
        return None
    if not isinstance(value, list) or len(value) not in (2, 3) or not all(map(_number, value)):
        raise reader.error("home", f"{value!r} is not [latitude, longitude] or [.., .., altitude]")
    latitude, longitude, altitude = (*map(float, value), math.nan)[:3]
    if abs(latitude) > 90.0 or abs(longitude) > 180.0:
        raise reader.error("home", f"{value!r} is not [latitude, longitude] in degrees")
    return latitude, longitude, altitude


def _parameters(reader: ConnectionReader) -> dict[str, float]:
    value = reader.values.get("parameters", {})
    if not isinstance(value, Mapping) or not all(map(_number, value.values())):
        raise reader.error(
            "parameters", "names of parameters and numbers, such as {BATT_FS_LOW_ACT: 2}"
        )
    return {str(name): float(number) for name, number in value.items()}


def _number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


ARBITER = "mavlink"
APART_M = 5.0
"""Distance in metres of vehicles without a home in the fleet file, in a row to the east."""

HERE = ("127.0.0.1", "localhost")
PX4_GROUND_STATION_PORT = 14550
"""The UDP port to which every instance of PX4 sends for ground stations."""


@dataclass(frozen=True, slots=True)
class Vehicle:
    """A vehicle of the fleet whose autopilot is to be started. `ports`: of 127.0.0.1, where it
    sends. `frame`: of ArduPilot, or the name of a model of PX4."""

    resource: ResourceId
    domain: str
    settings: Settings
    sitl: SitlSettings
    frame: Frame | str
    ports: tuple[int, ...]
    start: Start
    parameters: Mapping[str, float]

    def __str__(self) -> str:
        frame = self.frame if isinstance(self.frame, str) else self.frame.name
        what = f"{self.sitl.firmware} {frame}, system {self.settings.system_id}"
        where = f"{self.start.latitude_deg:.6f},{self.start.longitude_deg:.6f}"
        return f"{self.resource}: {what}, to {' and '.join(self.settings.urls)}, at {where}"


def read_vehicles(fleet: Fleet, speed: float) -> list[Vehicle]:
    """Return the vehicles, in the order of the file; `speed`: simulated seconds per second.

    Raises:
        PluginError: a vehicle cannot be simulated as the fleet says; the text names the key.
    """
    chosen = [each for each in fleet.vehicles.values() if each.arbiter == ARBITER and each.sitl]
    settings = read_settings(
        {each.id: Connection(each.id, each.domain.value, each.settings) for each in chosen}
    )
    vehicles: list[Vehicle] = []
    for number, each in enumerate(chosen):
        own, domain = settings[each.id], each.domain.value
        sitl = read_sitl_settings(each.id, each.settings.get(SITL, {}))
        frame = _frame(each.id, domain, sitl)
        # Of PX4, the parameters are the same for all kinds.
        kind = frame.kind if isinstance(frame, Frame) else FRAMES[FRAMES_OF[domain][0]].kind
        failsafe = link_parameters(each.failsafe, Identity(sitl.firmware, kind), own.gcs_system_id)
        vehicles.append(
            Vehicle(
                each.id,
                domain,
                own,
                sitl,
                frame,
                _ports(each.id, own, sitl.firmware),
                _start(fleet, sitl, number, speed),
                {**failsafe, **sitl.parameters},
            )
        )
    _refuse_same_systems(vehicles)
    return vehicles


def launches(
    vehicles: list[Vehicle], ardupilot: Path | None, px4: Path | None, folder: Path
) -> Iterator[Launch]:
    """Return how to start the programs of the vehicles, each in `folder` / its name.

    `ardupilot`, `px4`: the folders of the programs; None: not given.

    Raises:
        PluginError: a vehicle needs programs of which the place is not known.
        SitlError: a program, its parameters or a model is not there.
    """
    instance = 0
    for each in vehicles:
        if isinstance(each.frame, Frame):
            if ardupilot is None:
                raise PluginError(
                    f"{each.resource} runs ArduPilot: give its programs with --ardupilot "
                    "FOLDER, or `sitl: {firmware: px4}` in its connection"
                )
            yield ardupilot_launch(
                each.resource,
                find_ardupilot(ardupilot, each.frame),
                each.frame,
                each.start,
                instance=instance,
                system_id=each.settings.system_id,
                ports=each.ports,
                parameters=each.parameters,
            )
            instance += 1
        else:
            if px4 is None:
                raise PluginError(f"{each.resource} runs PX4: give its folder with --px4 FOLDER")
            program = find_px4(px4)
            if each.frame not in program.models():
                known = ", ".join(program.models())
                raise PluginError(
                    f"{each.resource}: connection.sitl.frame: PX4 in {px4} has no model "
                    f"'{each.frame}'; it has: {known}"
                )
            yield px4_launch(
                each.resource,
                program,
                each.frame,
                each.start,
                instance=each.settings.system_id - 1,
                folder=folder / each.resource,
                parameters=each.parameters,
            )


def _frame(resource: ResourceId, domain: str, sitl: SitlSettings) -> Frame | str:
    if sitl.firmware is Firmware.PX4:
        model = sitl.frame or PX4_MODELS.get(domain)
        if model is None:
            raise PluginError(f"{resource}: domain: PX4 simulates no {domain} vehicle")
        return model
    known = FRAMES_OF[domain]
    name = sitl.frame or known[0]
    if name not in known:
        raise PluginError(
            f"{resource}: connection.sitl.frame: '{name}' is not a frame of a vehicle of domain "
            f"{domain}; known: {', '.join(known)}"
        )
    return FRAMES[name]


def _ports(resource: ResourceId, own: Settings, firmware: Firmware) -> tuple[int, ...]:
    if own.component_id != 1:
        raise PluginError(f"{resource}: connection.component_id: autopilots have 1")
    ports = tuple(_port(resource, url) for url in own.urls)
    if firmware is Firmware.PX4:
        instance = own.system_id - 1
        right = px4_port(instance)
        if ports != (right,):
            raise PluginError(
                f"{resource}: connection: PX4 with system_id {own.system_id} is instance "
                f"{instance} and sends to udpin://127.0.0.1:{right} alone, not to "
                f"{', '.join(own.urls)}: write that URL, or the system_id of another instance"
            )
    elif len(ports) > MAVLINK_SERIALS:
        raise PluginError(
            f"{resource}: connection.url: ArduPilot sends to {MAVLINK_SERIALS} places at most"
        )
    return ports


def _port(resource: ResourceId, text: str) -> int:
    url = parse_url(text)
    if isinstance(url, SocketUrl) and url.way is Way.UDP_IN and url.host in HERE and url.port:
        return url.port
    port = url.port if isinstance(url, SocketUrl) and url.port else 14550
    raise PluginError(
        f"{resource}: connection.url: software in the loop sends to a UDP port of this machine, "
        f"such as udpin://127.0.0.1:{port}, and not to {text}"
    )


def _start(fleet: Fleet, sitl: SitlSettings, number: int, speed: float) -> Start:
    latitude, longitude, altitude = fleet.origin
    if sitl.home is None:
        latitude, longitude = offset((latitude, longitude), number * APART_M, 0.0)
    else:
        latitude, longitude = sitl.home[:2]
        altitude = altitude if math.isnan(sitl.home[2]) else sitl.home[2]
    return Start(latitude, longitude, altitude, sitl.heading_deg, speed)


def _refuse_same_systems(vehicles: list[Vehicle]) -> None:
    """Refuse equal system ids: every PX4 also sends to the port for ground stations."""
    px4 = {each.settings.system_id: each for each in vehicles if isinstance(each.frame, str)}
    for each in vehicles:
        other = px4.get(each.settings.system_id)
        if other is not None and other is not each and PX4_GROUND_STATION_PORT in each.ports:
            raise PluginError(
                f"{each.resource}: connection.system_id: {other.resource} has it, too, and as PX4 "
                f"sends to port {PX4_GROUND_STATION_PORT} as well: give one of them another"
            )
