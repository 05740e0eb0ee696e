"""Vehicles over UDP: heard on a port of ours, or spoken to first."""

import asyncio
import socket
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest
from m2pem_plugin_mavlink.link import udp
from m2pem_plugin_mavlink.link.hub import shared_hub
from m2pem_plugin_mavlink.link.routed_link import RoutedLink, open_link
from m2pem_plugin_mavlink.link.udp import UdpEndpoint
from m2pem_plugin_mavlink.protocol.frames import encode
from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type
from m2pem_plugin_mavlink.protocol.url import parse_url
from mavlink_wire import GROUND_STATION, FarEnd, HandClock, udp_end, until

from m2pem.errors import PluginError

URL = "udpin://127.0.0.1:0"
VEHICLE = Address(1, 1)
COMMAND_LONG = message_type("COMMAND_LONG")


def arm(system: int = 1, component: int = 1) -> Message:
    made: Message = COMMAND_LONG.make(
        target_system=system, target_component=component, command=400, param1=1.0
    )
    return made


def endpoint() -> UdpEndpoint:
    found = shared_hub().endpoint(parse_url(URL))
    assert isinstance(found, UdpEndpoint)
    return found


@asynccontextmanager
async def opened(*systems: int) -> AsyncIterator[tuple[HandClock, list[RoutedLink]]]:
    clock = HandClock()
    links = [await open_link(Address(system, 1), [URL], clock) for system in systems]
    try:
        yield clock, links
    finally:
        for link in links:
            await link.close()


def heard(link: RoutedLink) -> list[int]:
    modes: list[int] = []
    link.listen([0], lambda message, _: modes.append(message.custom_mode))
    return modes


async def test_a_bridge_that_cuts_every_frame_is_received() -> None:
    """As a radio that sends 8 bytes at a time: no datagram ever has a whole frame."""
    async with opened(1) as (_, [link]):
        modes = heard(link)
        frame = encode(message_type("HEARTBEAT").make(custom_mode=7), 0, VEHICLE)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as bridge:
            for start in range(0, len(frame), 8):
                bridge.sendto(frame[start : start + 8], ("127.0.0.1", endpoint().port))
            await until(lambda: modes == [7])


async def test_a_vehicle_is_heard_and_answered_where_it_is() -> None:
    async with opened(1) as (_, [link]):
        modes = heard(link)
        vehicle = await udp_end(endpoint().port)
        vehicle.beat(mode=3)
        await until(lambda: modes == [3])
        link.send(arm())
        await until(lambda: vehicle.names() == ["COMMAND_LONG"])
        assert vehicle.received[-1].get_srcSystem() == 255
        assert vehicle.received[-1].param1 == 1.0
        await vehicle.close()


async def test_nothing_is_sent_to_a_vehicle_that_was_not_heard() -> None:
    async with opened(1, 2) as (_, [first, second]):
        modes = heard(second)
        vehicle = await udp_end(endpoint().port, system=2)
        vehicle.beat()
        await until(lambda: modes)
        first.send(arm(1))
        second.send(arm(2))
        await until(vehicle.names)
        assert [
            each.target_system for each in vehicle.received if each.get_type() != "HEARTBEAT"
        ] == [2]
        await vehicle.close()


async def test_each_of_many_vehicles_gets_its_own_and_only_its_own() -> None:
    systems = range(1, 21)
    async with opened(*systems) as (_, links):
        modes = [heard(link) for link in links]
        vehicles = [await udp_end(endpoint().port, system=each) for each in systems]
        for vehicle in vehicles:
            vehicle.beat(mode=vehicle.mav.srcSystem)
        await until(lambda: all(modes))
        assert modes == [[each] for each in systems]
        for link in links:
            link.send(arm(link.address.system))
        await until(lambda: all(each.names() for each in vehicles))
        for vehicle in vehicles:
            (command,) = [each for each in vehicle.received if each.get_type() == "COMMAND_LONG"]
            assert command.target_system == vehicle.mav.srcSystem
            await vehicle.close()


async def test_vehicles_behind_one_address_are_told_apart() -> None:
    async with opened(1, 2) as (_, links):
        modes = [heard(link) for link in links]
        router = await udp_end(endpoint().port)
        for system in (1, 2):
            router.mav.srcSystem = system
            router.beat(mode=10 * system)
        await until(lambda: all(modes))
        assert modes == [[10], [20]]
        await router.close()


async def test_who_lies_about_its_system_id_gets_no_commands() -> None:
    async with opened(1) as (_, [link]):
        modes = heard(link)
        vehicle, liar = [await udp_end(endpoint().port) for _ in range(2)]
        vehicle.beat(mode=1)
        await until(lambda: modes == [1])
        for _ in range(5):
            liar.beat(mode=2)
        vehicle.beat(mode=3)
        await until(lambda: 3 in modes)
        link.send(arm())
        await until(vehicle.names)
        assert modes == [1, 3]
        assert liar.names() == []
        await vehicle.close()
        await liar.close()


async def test_every_peer_hears_us_once_a_second_of_the_clock() -> None:
    async with opened(1) as (clock, [link]):
        modes = heard(link)
        vehicle = await udp_end(endpoint().port)
        vehicle.beat()
        await until(lambda: modes)
        await clock.turn(5.0)
        await until(lambda: len(vehicle.beats()) == 5)
        assert set(vehicle.beats()) == {GROUND_STATION}
        assert [each.get_seq() for each in vehicle.received] == [0, 1, 2, 3, 4]
        await vehicle.close()


async def test_what_says_to_come_from_us_is_not_heard() -> None:
    async with opened(1) as (clock, [link]):
        modes = heard(link)
        echo = await udp_end(endpoint().port, system=255, component=190)
        vehicle = await udp_end(endpoint().port)
        echo.beat()
        vehicle.beat()
        await until(lambda: modes)
        await clock.turn(1.0)
        await until(vehicle.beats)
        assert echo.received == []
        assert link.known_systems() == {1}
        await echo.close()
        await vehicle.close()


async def test_who_sends_junk_is_no_peer() -> None:
    async with opened(1) as (_, [link]):
        modes = heard(link)
        junk, vehicle = [await udp_end(endpoint().port) for _ in range(2)]
        for data in (b"", b"x", b"\xfd" * 300, b"GET / HTTP/1.1\r\n\r\n"):
            junk.write(data)
        vehicle.beat()
        await until(lambda: modes)
        assert len(endpoint().peers) == 1
        await junk.close()
        await vehicle.close()


async def test_peers_that_are_silent_are_forgotten_but_not_a_vehicle() -> None:
    async with opened(1) as (clock, [link]):
        modes = heard(link)
        vehicle, other = await udp_end(endpoint().port), await udp_end(endpoint().port, system=9)
        other.beat()
        vehicle.beat()
        await until(lambda: modes and len(endpoint().peers) == 2)
        await clock.turn(udp.FORGOTTEN_S + 2)
        assert link.known_systems() == {1}
        link.send(arm())
        await until(vehicle.names)
        await other.close()
        await vehicle.close()


async def test_when_there_are_too_many_peers_the_longest_silent_goes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(udp, "MAX_PEERS", 3)
    async with opened(1) as (clock, [link]):
        modes = heard(link)
        ends = [await udp_end(endpoint().port, system=each) for each in range(1, 7)]
        for number, end in enumerate(ends):
            end.beat()
            await until(lambda: number + 1 in link.known_systems())  # noqa: B023
            await clock.turn(0.1)
        assert modes == [0]
        assert link.known_systems() == {1, 5, 6}
        for end in ends:
            await end.close()


async def test_udpout_speaks_first_and_hears_the_answer() -> None:
    vehicle = FarEnd()
    loop = asyncio.get_running_loop()
    transport, _ = await loop.create_datagram_endpoint(lambda: vehicle, local_addr=("127.0.0.1", 0))
    port = transport.get_extra_info("sockname")[1]
    link = await open_link(VEHICLE, [f"udpout://127.0.0.1:{port}"], HandClock())
    modes = heard(link)
    await until(lambda: vehicle.beats() == [GROUND_STATION])
    vehicle.beat(mode=6)
    await until(lambda: modes == [6])
    link.send(arm())
    await until(vehicle.names)
    await link.close()
    await vehicle.close()


async def test_udpout_goes_on_where_nobody_listens_yet() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as held:
        held.bind(("127.0.0.1", 0))
        port = held.getsockname()[1]
    clock = HandClock()
    link = await open_link(VEHICLE, [f"udpout://127.0.0.1:{port}"], clock)
    await clock.turn(3.0)
    vehicle = FarEnd()
    loop = asyncio.get_running_loop()
    await loop.create_datagram_endpoint(lambda: vehicle, local_addr=("127.0.0.1", port))
    await clock.turn(2.0)
    await until(vehicle.beats)
    await link.close()
    await vehicle.close()


async def test_a_port_that_is_taken_is_said() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as held:
        held.bind(("127.0.0.1", 0))
        url = f"udpin://127.0.0.1:{held.getsockname()[1]}"
        with pytest.raises(PluginError, match=f"{url}: another program has this port"):
            await open_link(VEHICLE, [url], HandClock())
    link = await open_link(VEHICLE, [url], HandClock())
    await link.close()


async def test_an_address_of_another_machine_cannot_be_listened_at() -> None:
    with pytest.raises(PluginError, match=r"does not have that address; .* 0\.0\.0\.0"):
        await open_link(VEHICLE, ["udpin://192.0.2.1:14550"], HandClock())


async def test_a_burst_of_many_vehicles_is_read_at_one_go() -> None:
    async with opened(1) as (_, [link]):
        modes = heard(link)
        vehicle = await udp_end(endpoint().port)
        for number in range(1_000):
            vehicle.beat(mode=number)
        await until(lambda: len(modes) == 1_000)
        assert modes == [*range(1_000)]
        quality = link.quality()
        assert quality is not None and quality.loss == 0
        await vehicle.close()
