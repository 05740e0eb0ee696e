"""Endpoints are shared by all of an event loop who name them, and closed after the last."""

import asyncio
import socket

import pytest
from m2pem_plugin_mavlink.link import hub as hub_module
from m2pem_plugin_mavlink.link.hub import shared_hub
from m2pem_plugin_mavlink.link.routed_link import open_link
from m2pem_plugin_mavlink.link.udp import UdpEndpoint
from m2pem_plugin_mavlink.protocol.messages import Address
from m2pem_plugin_mavlink.protocol.url import parse_url
from mavlink_wire import GROUND_STATION, HandClock, udp_end, until

from m2pem.errors import PluginError

URL = "udpin://127.0.0.1:0"
OTHER = Address(254, 191)


def port() -> int:
    endpoint = shared_hub().endpoint(parse_url(URL))
    assert isinstance(endpoint, UdpEndpoint)
    return endpoint.port


def is_free(number: int) -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(("127.0.0.1", number))
        except OSError:
            return False
        return True


async def test_equal_urls_are_one_socket_until_the_last_user_is_gone() -> None:
    first = await open_link(Address(1, 1), [URL], HandClock())
    shared = port()
    second = await open_link(Address(2, 1), [URL.upper()], HandClock())
    assert port() == shared
    await first.close()
    assert port() == shared
    await second.close()
    assert is_free(shared)
    with pytest.raises(KeyError):
        port()


async def test_links_that_are_opened_at_once_share_too() -> None:
    opening = (open_link(Address(system, 1), [URL], HandClock()) for system in range(1, 9))
    links = await asyncio.gather(*opening)
    shared = port()
    await asyncio.gather(*(link.close() for link in links))
    await links[0].close()
    assert is_free(shared)


async def test_a_vehicle_may_have_several_links_each_with_its_listeners() -> None:
    links = [await open_link(Address(1, 1), [URL], HandClock()) for _ in range(2)]
    modes: list[tuple[int, int]] = []
    for number, link in enumerate(links):
        link.listen([0], lambda m, _, number=number: modes.append((number, m.custom_mode)))  # type: ignore[misc]
    vehicle = await udp_end(port())
    vehicle.beat(1)
    await until(lambda: modes == [(0, 1), (1, 1)])
    await links[0].close()
    vehicle.beat(2)
    await until(lambda: modes[2:] == [(1, 2)])
    await links[1].close()
    await vehicle.close()


async def test_a_vehicle_is_heard_whose_link_is_opened_after_it_was() -> None:
    first = await open_link(Address(1, 1), [URL], HandClock())
    vehicle = await udp_end(port(), system=2)
    vehicle.beat()
    await until(lambda: first.known_systems() == {2})
    second = await open_link(Address(2, 1), [URL], HandClock())
    modes: list[int] = []
    second.listen([0], lambda message, _: modes.append(message.custom_mode))
    vehicle.beat(4)
    await until(lambda: modes == [4])
    await first.close()
    await second.close()
    await vehicle.close()


async def test_all_that_we_are_is_said_and_numbered_apart() -> None:
    clock = HandClock()
    links = [
        await open_link(Address(1, 1), [URL], clock),
        await open_link(Address(1, 1), [URL], clock, OTHER),
    ]
    vehicle = await udp_end(port())
    vehicle.beat()
    await until(links[0].known_systems)
    await clock.turn(2.0)
    await until(lambda: len(vehicle.received) == 4)
    assert vehicle.beats() == [(255, 190), OTHER] * 2
    assert [each.get_seq() for each in vehicle.received] == [0, 0, 1, 1]
    await links[1].close()
    await clock.turn(1.0)
    await until(lambda: len(vehicle.received) == 5)
    assert vehicle.beats()[-1] == (255, 190)
    await links[0].close()
    await vehicle.close()


async def test_heartbeats_do_not_catch_up_after_a_pause() -> None:
    clock = HandClock()
    link = await open_link(Address(1, 1), [URL], clock)
    vehicle = await udp_end(port())
    vehicle.beat()
    await until(link.known_systems)
    clock.jump(30.0)
    await clock.turn(3.0)
    await until(lambda: len(vehicle.beats()) >= 4)
    assert len(vehicle.beats()) == 4
    await link.close()
    await vehicle.close()


@pytest.mark.parametrize("vehicle_first", [True, False])
async def test_a_vehicle_cannot_have_our_own_system_id(vehicle_first: bool) -> None:
    openings = [(Address(254, 1), Address(255, 190)), (Address(2, 1), OTHER)]
    first, second = openings if vehicle_first else openings[::-1]
    link = await open_link(first[0], [URL], HandClock(), first[1])
    with pytest.raises(PluginError, match="system id 254 is that of a vehicle and of m2pem"):
        await open_link(second[0], [URL], HandClock(), second[1])
    shared = port()
    await link.close()
    assert is_free(shared)


async def test_if_one_endpoint_cannot_be_opened_the_others_are_closed() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as held:
        held.bind(("127.0.0.1", 0))
        taken = f"udpin://127.0.0.1:{held.getsockname()[1]}"
        with pytest.raises(PluginError, match="another program"):
            await open_link(Address(1, 1), [URL, taken], HandClock())
    with pytest.raises(KeyError):
        port()
    assert asyncio.all_tasks() == {asyncio.current_task()}, "no heartbeats are sent"
    vehicle = Address(GROUND_STATION[0], 1)  # its system id is m2pem's own no more
    link = await open_link(vehicle, [URL], HandClock(), OTHER)
    await link.close()


async def test_a_vehicle_with_no_url_is_an_error() -> None:
    with pytest.raises(PluginError, match="needs a URL"):
        await open_link(Address(1, 1), [], HandClock())


def test_each_event_loop_has_a_hub_of_its_own() -> None:
    async def hub() -> hub_module.Hub:
        assert shared_hub() is shared_hub()
        return shared_hub()

    assert asyncio.run(hub()) is not asyncio.run(hub())
