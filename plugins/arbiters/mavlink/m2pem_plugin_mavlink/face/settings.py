"""The settings of the face in the fleet file, and the system id of each vehicle."""

from collections.abc import Collection, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from m2pem.api import FaceSettings, Fleet, ResourceId
from m2pem.errors import PluginError
from m2pem_plugin_mavlink.protocol.url import Url, parse_url
from m2pem_plugin_mavlink.settings import GCS_SYSTEM_ID

ALL = "all"
DEFAULT_URL = "udpout://127.0.0.1:14550"
HIGHEST_SYSTEM = 254
FASTEST_HZ = 20.0
SLOWEST_HZ = 0.01

RATES_HZ: Mapping[str, float] = {
    "HEARTBEAT": 1.0,
    "GLOBAL_POSITION_INT": 4.0,
    "ATTITUDE": 4.0,
    "VFR_HUD": 2.0,
    "SYS_STATUS": 1.0,
    "BATTERY_STATUS": 0.5,
    "GPS_RAW_INT": 1.0,
    "EXTENDED_SYS_STATE": 1.0,
    "HOME_POSITION": 0.2,
    "MISSION_CURRENT": 1.0,
    "GIMBAL_MANAGER_STATUS": 0.2,
    "GIMBAL_DEVICE_ATTITUDE_STATUS": 2.0,
}
"""Messages that are sent by themselves, and how often in a second."""

_KEYS = (
    "url",
    "links",
    "system_ids",
    "commands",
    "rates",
    "forward",
    "forward_commands",
    "receive",
    "send",
    "send_to",
)
"""`receive` and `send`: event_settings.py."""


@dataclass(frozen=True, slots=True)
class Settings:
    """`systems`: the system id of each vehicle, in the order of the fleet file. `commands`: the
    vehicles that ground stations may command. `forwarded`: those whose own frames they get.
    `forwarded_commands`: those of `forwarded` to which commands pass, too. `sent_to`: those to
    which messages go that missions throw. `rates_hz`: by name. `links`: the vehicles that are on a
    URL, of those URLs on which not all are."""

    urls: tuple[Url, ...]
    systems: Mapping[ResourceId, int]
    commands: frozenset[ResourceId] = frozenset()
    rates_hz: Mapping[str, float] = field(default_factory=dict)
    forwarded: frozenset[ResourceId] = frozenset()
    forwarded_commands: frozenset[ResourceId] = frozenset()
    sent_to: frozenset[ResourceId] = frozenset()
    links: Mapping[Url, frozenset[ResourceId]] = field(default_factory=dict)


def read_settings(reader: FaceSettings, fleet: Fleet) -> Settings:
    """Read the settings.

    Raises:
        PluginError: something is wrong; the text names the key.
    """
    reader.refuse_others(_KEYS)
    named = reader.vehicles("forward", fleet.vehicles)
    forwarded = frozenset(each for each in named if not _simulated(fleet, each))
    for each in fleet.vehicles.values():
        if each.id in forwarded and (problem := passes_elsewhere(fleet, each.id)):
            if reader.values.get("forward") == ALL:
                forwarded -= {each.id}
            else:
                raise reader.error("forward", f"{each.id}: {problem}")
    commands = reader.vehicles("forward_commands", fleet.vehicles)
    if extra := sorted(commands - named) if reader.values.get("forward_commands") != ALL else []:
        raise reader.error("forward_commands", f"{extra[0]} is not one of those of `forward`")
    links = _links(reader, fleet)
    return Settings(
        (*_urls(reader, fleet, links), *links),
        _systems(reader, fleet, forwarded),
        reader.vehicles("commands", fleet.vehicles),
        _rates(reader),
        forwarded,
        commands & forwarded,
        reader.vehicles("send_to", fleet.vehicles),
        links,
    )


def _links(reader: FaceSettings, fleet: Fleet) -> dict[Url, frozenset[ResourceId]]:
    given = reader.values.get("links", [])
    example = f"[{{url: '{DEFAULT_URL}', vehicles: [rover1]}}]"
    if not isinstance(given, list) or not all(isinstance(each, dict) for each in given):
        raise reader.error("links", f"{given!r} is not a list of links such as {example}")
    links: dict[Url, frozenset[ResourceId]] = {}
    for each in given:
        link = FaceSettings("mavlink", each, f"{reader.path}.links")
        link.refuse_others(("url", "vehicles"))
        if "url" not in each:
            raise link.error("url", f"a link has a URL, such as {example}")
        if not (vehicles := link.vehicles("vehicles", fleet.vehicles)):
            raise link.error("vehicles", f"a link has one vehicle or more, such as {example}")
        for url in _read_urls(link, fleet):
            if url in links:
                raise link.error("url", f"{url} is the URL of two links")
            links[url] = vehicles
    return links


def _urls(reader: FaceSettings, fleet: Fleet, links: Collection[Url]) -> tuple[Url, ...]:
    if links and "url" not in reader.values:
        return ()
    urls = _read_urls(reader, fleet)
    if twice := [each for each in urls if each in links]:
        raise reader.error("url", f"{twice[0]} is the URL of one of `links`, too")
    return urls


def _read_urls(reader: FaceSettings, fleet: Fleet) -> tuple[Url, ...]:
    value = reader.values.get("url", DEFAULT_URL)
    texts = value if isinstance(value, list) and value else [value]
    urls = []
    for text in texts:
        if not isinstance(text, str):
            raise reader.error("url", f"{text!r} is not a URL such as {DEFAULT_URL}")
        try:
            urls.append(parse_url(text))
        except PluginError as error:
            raise reader.error("url", str(error)) from None
    for each in fleet.vehicles.values():
        if each.arbiter == "mavlink" and (shared := _urls_of(each.settings).intersection(urls)):
            raise reader.error(
                "url", f"{shared.pop()} is where {each.id} is: ground stations need another address"
            )
    return tuple(dict.fromkeys(urls))


def _urls_of(settings: Mapping[str, Any]) -> set[Url]:
    """Return the URLs of a vehicle, given its connection; wrong ones are left out."""
    given = settings.get("url")
    found: set[Url] = set()
    for text in given if isinstance(given, list) else [given]:
        with suppress(PluginError):
            found.add(parse_url(str(text)))
    return found


def _simulated(fleet: Fleet, name: ResourceId) -> bool:
    """Return whether a MAVLink vehicle is simulated (`--simulate`), and so has no frames."""
    vehicle = fleet.vehicles[name]
    return vehicle.arbiter == "sim" and own_system(vehicle.settings) is not None


def passes_elsewhere(fleet: Fleet, name: ResourceId) -> str:
    """Return why the frames of a vehicle do not pass m2pem here; "" if they do."""
    vehicle = fleet.vehicles[name]
    if vehicle.arbiter != "mavlink":
        return f"its arbiter is {vehicle.arbiter}; frames are those of MAVLink vehicles"
    if vehicle.host:
        return f"its link is on the host {vehicle.host}, and its frames do not pass m2pem here"
    if vehicle.settings.get("driver") == "mavsdk":
        return "with the driver mavsdk its frames do not pass m2pem; use the driver pymavlink"
    if vehicle.settings.get("component_id", 1) != 1:
        return "its autopilot is not component 1"
    return ""


def _rates(reader: FaceSettings) -> dict[str, float]:
    inner = reader.inner("rates", "{GLOBAL_POSITION_INT: 2 Hz}")
    inner.refuse_others(tuple(RATES_HZ))
    rates = dict(RATES_HZ)
    for name, value in inner.values.items():
        text = str(value).removesuffix("Hz").strip()
        try:
            rate = float(text)
        except ValueError:
            rate = -1.0
        if isinstance(value, bool) or not SLOWEST_HZ <= rate <= FASTEST_HZ:
            raise inner.error(
                name, f"{value!r} is not a rate from {SLOWEST_HZ:g} to {FASTEST_HZ:g} Hz"
            )
        rates[name] = rate
    if rates["HEARTBEAT"] < 1.0:
        raise inner.error("HEARTBEAT", "ground stations expect 1 Hz or more")
    return rates


def _systems(
    reader: FaceSettings, fleet: Fleet, forwarded: Collection[ResourceId]
) -> dict[ResourceId, int]:
    """Return the system id of each vehicle: given ones, then those of MAVLink vehicles; others get
    the lowest that are free, in the order of the fleet file."""
    given = reader.inner("system_ids", "{rover1: 11}")
    for name in given.values:
        reader.vehicle("system_ids", name, fleet.vehicles)
    owners: dict[int, ResourceId] = {}
    ids: dict[ResourceId, int] = {}
    for name, vehicle in fleet.vehicles.items():
        own = own_system(vehicle.settings)
        if name not in given.values and own is None:
            continue
        id_ = given.whole(name, own, 1, HIGHEST_SYSTEM, "a MAVLink system id")
        if name in forwarded and id_ != own:
            raise given.error(
                name, f"its own frames are forwarded, and they have system id {own}: leave it out"
            )
        if (other := owners.setdefault(id_, name)) != name:
            raise reader.error(
                "system_ids",
                f"{name} and {other} both have system id {id_}: give one of them another",
            )
        ids[name] = id_
    stations = {GCS_SYSTEM_ID, *_ground_stations(fleet)}
    for id_ in sorted(stations & owners.keys()):
        raise reader.error(
            "system_ids", f"{owners[id_]} has system id {id_}, which is m2pem's own ground station"
        )
    free = (n for n in range(1, HIGHEST_SYSTEM + 1) if n not in owners and n not in stations)
    for name in fleet.vehicles:
        if name not in ids:
            id_ = next(free, 0)
            if not id_:
                raise reader.error(
                    "system_ids", f"no system id is free for {name}: MAVLink has {HIGHEST_SYSTEM}"
                )
            ids[name] = id_
    return {name: ids[name] for name in fleet.vehicles}


def own_system(settings: Mapping[str, Any]) -> int | None:
    """Return the system id of a MAVLink vehicle, given its connection; None: it has none."""
    id_ = settings.get("system_id")
    return id_ if isinstance(id_, int) and not isinstance(id_, bool) else None


def _ground_stations(fleet: Fleet) -> set[int]:
    found = (each.settings.get("gcs_system_id") for each in fleet.vehicles.values())
    return {id_ for id_ in found if isinstance(id_, int)}
