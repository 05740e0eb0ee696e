"""The checks of `m2pem doctor` for MAVLink vehicles: ports, serial lines, and who sends to them.

Nothing is sent. A heartbeat of a ground station that ends again could start a vehicle's failsafe.
"""

import errno
import grp
import os
import selectors
import socket
import time
from collections.abc import Iterator, Mapping, Sequence, Set
from contextlib import ExitStack
from importlib.util import find_spec
from typing import TypeGuard

from m2pem.api import Connection, Fleet, HealthCheck, HealthStatus, ResourceId, listening_check
from m2pem.errors import PluginError
from m2pem_plugin_mavlink.protocol.inbound import AdmitSender, Inbound, Sender
from m2pem_plugin_mavlink.protocol.url import (
    SerialUrl,
    SocketUrl,
    Url,
    Way,
    chooses_port,
    parse_url,
)
from m2pem_plugin_mavlink.settings import Settings, read_settings
from m2pem_plugin_mavlink.signing.key_file import SigningError, read_key

LISTENED_S = 2.5
"""Autopilots send a heartbeat every second."""

CONNECTED_WITHIN_S = 1.0
LARGEST_DATAGRAM = 65_535

OK, WARNING, ERROR = HealthStatus.OK, HealthStatus.WARNING, HealthStatus.ERROR


def check_fleet(fleet: Fleet) -> Sequence[HealthCheck]:
    """Check the endpoints of the fleet's MAVLink vehicles, and whether each vehicle is received."""
    connections = {
        vehicle.id: Connection(vehicle.id, vehicle.domain.value, vehicle.settings)
        for vehicle in fleet.vehicles.values()
        if vehicle.arbiter == "mavlink"
    }
    try:
        settings = read_settings(connections)
        urls = {url: parse_url(url) for each in settings.values() for url in each.urls}
    except PluginError:
        return ()  # the check of the fleet itself says it
    checks = [
        *_drivers(settings),
        *_keys(settings),
        *(check for url in urls.values() for check in _endpoint(url)),
    ]
    well = all(check.status is OK for check in checks)
    return [*checks, *_autopilots(settings)] if well else checks


def _drivers(settings: Mapping[ResourceId, Settings]) -> Iterator[HealthCheck]:
    if any(each.driver == "mavsdk" for each in settings.values()) and not find_spec("mavsdk"):
        remedy = "pip install 'm2pem-plugin-mavlink[mavsdk]'"
        yield HealthCheck("mavsdk", ERROR, "the driver mavsdk is not installed", remedy)


def _keys(settings: Mapping[ResourceId, Settings]) -> Iterator[HealthCheck]:
    """Check that the keys of vehicles that sign can be read, by their owner alone."""
    for resource, each in settings.items():
        if each.signing is None:
            continue
        name = f"signing {resource}"
        try:
            read_key(each.signing.key)
        except SigningError as error:
            remedy = "m2pem mavlink signing keygen writes a new key, for its owner alone"
            yield HealthCheck(name, ERROR, str(error), remedy)
        else:
            yield HealthCheck(name, OK, f"{each.signing.key} has a key")


def _endpoint(url: Url) -> Iterator[HealthCheck]:
    if isinstance(url, SerialUrl):
        yield check_serial_line(url)
    elif url.way in (Way.UDP_IN, Way.TCP_IN):
        kind = socket.SOCK_DGRAM if url.way is Way.UDP_IN else socket.SOCK_STREAM
        yield listening_check(str(url), url.host, url.port, kind)
    else:
        yield _check_name(url)


def _check_name(url: SocketUrl) -> HealthCheck:
    try:
        found = socket.getaddrinfo(url.host, url.port)[0][4][0]
    except OSError as error:
        why = f"{url.host} cannot be resolved: {error.strerror or error}"
        return HealthCheck(str(url), ERROR, why, "write an IP address, or a name that resolves")
    return HealthCheck(str(url), OK, f"{url.host} is {found}")


def check_serial_line(url: SerialUrl) -> HealthCheck:
    """Check that a serial line is there, and that this user can open it."""
    if not find_spec("serial_asyncio_fast"):
        remedy = "pip install 'm2pem-plugin-mavlink[serial]'"
        return HealthCheck(str(url), ERROR, "serial lines need pyserial-asyncio-fast", remedy)
    try:
        line = os.open(url.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    except OSError as error:
        why = f"{url.path} cannot be opened: {error.strerror}"
        return HealthCheck(str(url), ERROR, why, _serial_remedy(url.path, error))
    try:
        if os.isatty(line):
            return HealthCheck(str(url), OK, f"{url.path} can be opened")
        remedy = "name a serial line: ls /dev/serial/by-id"
        return HealthCheck(str(url), ERROR, f"{url.path} is not a serial line", remedy)
    finally:
        os.close(line)


def _serial_remedy(path: str, error: OSError) -> str:
    if error.errno in (errno.EACCES, errno.EPERM):
        try:
            group = grp.getgrgid(os.stat(path).st_gid).gr_name  # noqa: PTH116
        except (OSError, KeyError):
            group = "dialout"
        return f"sudo usermod -a -G {group} $USER, then sign in again"
    if error.errno == errno.EBUSY:
        return f"end the program that has it: fuser -v {path}"
    return "plug the device in; ls /dev/serial/by-id shows the lines that there are"


def _autopilots(settings: Mapping[ResourceId, Settings]) -> Iterator[HealthCheck]:
    """Check of each vehicle whether its frames arrive, where they arrive unasked."""
    listened = {
        resource: {url for url in map(parse_url, each.urls) if _sends_unasked(url)}
        for resource, each in settings.items()
    }
    wanted: dict[SocketUrl, set[int]] = {}
    for resource, urls in listened.items():
        for url in urls:
            wanted.setdefault(url, set()).add(settings[resource].system_id)
    received = received_systems(wanted)
    for resource, each in settings.items():
        urls = listened[resource]
        if not urls:
            continue
        name, where = f"autopilot {resource}", ", ".join(each.urls)
        if any(each.system_id in received[url] for url in urls):
            yield HealthCheck(name, OK, f"system {each.system_id} sends to {where}")
            continue
        others = sorted(set().union(*(received[url] for url in urls)))
        yield HealthCheck(
            name,
            WARNING,
            f"nothing of system {each.system_id} arrived at {where} in {LISTENED_S:g} s"
            + (f"; systems {', '.join(map(str, others))} send there" if others else ""),
            "is it on, does it send to this host and port, and is SYSID_THISMAV (MAV_SYS_ID of "
            f"PX4) {each.system_id}?",
        )


def _sends_unasked(url: Url) -> TypeGuard[SocketUrl]:
    # Over udpout an autopilot sends only after it was sent to; a board may restart when its serial
    # line is kept open and closed again.
    listens = isinstance(url, SocketUrl) and url.way in (Way.UDP_IN, Way.TCP_OUT)
    return listens and not chooses_port(url)


def received_systems(wanted: Mapping[SocketUrl, Set[int]]) -> Mapping[SocketUrl, Set[int]]:
    """Listen for `LISTENED_S`, or until all wanted systems are received at one of their URLs.

    Returns the system ids of all right frames by their URL.
    """
    found: dict[SocketUrl, set[int]] = {url: set() for url in wanted}
    missing = set().union(*wanted.values())
    end_s = time.monotonic() + LISTENED_S
    with ExitStack() as stack:
        selector = stack.enter_context(selectors.DefaultSelector())
        for url in wanted:
            if (opened := _opened(url)) is not None:
                inbound = Inbound(_noting(found[url]))
                selector.register(stack.enter_context(opened), selectors.EVENT_READ, inbound)
        while selector.get_map() and (left_s := end_s - time.monotonic()) > 0:
            for key, _ in selector.select(left_s):
                assert isinstance(key.fileobj, socket.socket)
                if not _received(key.fileobj, key.data):
                    selector.unregister(key.fileobj)
            if missing <= set().union(*(found[url] & wanted[url] for url in wanted)):
                break
    return found


def _received(connection: socket.socket, inbound: Inbound) -> bool:
    """Read what has arrived; False: the other end has closed the connection."""
    try:
        data = connection.recv(LARGEST_DATAGRAM)
    except OSError:
        data = b""
    if connection.type == socket.SOCK_DGRAM:
        inbound.datagram(data, time.monotonic())
        return True
    inbound.stream(data, time.monotonic())
    return bool(data)


def _noting(systems: set[int]) -> AdmitSender:
    """Return what notes the system of each sender; its frames are not decoded."""

    def admit(sender: Sender) -> bool:
        systems.add(sender.address.system)
        return True

    return admit


def _opened(url: SocketUrl) -> socket.socket | None:
    """A socket that receives what arrives at a URL; None: no connection."""
    try:
        if url.way is Way.TCP_OUT:
            return socket.create_connection((url.host, url.port), CONNECTED_WITHIN_S)
        family, kind, _, _, address = socket.getaddrinfo(
            url.host, url.port, type=socket.SOCK_DGRAM
        )[0]
        opened = socket.socket(family, kind)
        opened.bind(address)
    except OSError:
        return None
    return opened
