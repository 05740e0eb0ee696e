"""Vehicles over TCP: connected to, again and again, or connecting to us."""

import asyncio
import logging
from typing import Any

import pytest
from m2pem_plugin_mavlink.link import streams
from m2pem_plugin_mavlink.link.hub import shared_hub
from m2pem_plugin_mavlink.link.routed_link import RoutedLink, open_link
from m2pem_plugin_mavlink.link.streams import MOST_UNSENT_BYTES, TcpInEndpoint
from m2pem_plugin_mavlink.protocol.messages import Address, message_type
from m2pem_plugin_mavlink.protocol.url import parse_url
from mavlink_wire import GROUND_STATION, HandClock, TcpServer, tcp_end, until

from m2pem.errors import PluginError

VEHICLE = Address(1, 1)
URL = "tcpin://127.0.0.1:0"


@pytest.fixture(autouse=True)
def _soon(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(streams, "FIRST_PAUSE_S", 0.01)
    monkeypatch.setattr(streams, "LONGEST_PAUSE_S", 0.02)


def heard(link: RoutedLink) -> list[int]:
    modes: list[int] = []
    link.listen([0], lambda message, _: modes.append(message.custom_mode))
    return modes


def send_arm(link: RoutedLink) -> None:
    link.send(message_type("COMMAND_LONG").make(target_system=1, target_component=1, command=400))


async def test_tcpout_connects_speaks_first_and_is_answered() -> None:
    server = TcpServer()
    link = await open_link(VEHICLE, [f"tcpout://127.0.0.1:{await server.open()}"], HandClock())
    modes = heard(link)
    await until(lambda: server.ends and server.ends[0].beats() == [GROUND_STATION])
    server.ends[0].write(b"boot banner\r\n")
    server.ends[0].beat(mode=5)
    await until(lambda: modes == [5])
    send_arm(link)
    await until(lambda: server.ends[0].names() == ["COMMAND_LONG"])
    await link.close()
    await server.close()


async def test_a_connection_that_breaks_is_made_again() -> None:
    server = TcpServer()
    link = await open_link(VEHICLE, [f"tcpout://127.0.0.1:{await server.open()}"], HandClock())
    modes = heard(link)
    for number in range(3):
        await until(lambda: len(server.ends) == number + 1 and server.ends[-1].transport)  # noqa: B023
        server.ends[number].beat(mode=number)
        await until(lambda: modes == [*range(number + 1)])  # noqa: B023
        send_arm(link)
        await until(server.ends[number].names)
        await server.ends[number].close()
        await until(lambda: link.quality() is None)
    await link.close()
    await server.close()


async def test_a_connection_is_tried_again_until_somebody_listens(
    caplog: pytest.LogCaptureFixture,
) -> None:
    server = TcpServer()
    port = await server.open()
    await server.close()
    with caplog.at_level(logging.WARNING):
        link = await open_link(VEHICLE, [f"tcpout://127.0.0.1:{port}"], HandClock())
        modes = heard(link)
        await until(lambda: "reconnecting" in caplog.text)
        await server.open(port)
        await until(lambda: server.ends)
    server.ends[0].beat()
    await until(lambda: modes)
    assert len(caplog.records) == 1
    await link.close()
    await server.close()


async def test_tcpin_lets_several_vehicles_connect() -> None:
    links = [await open_link(Address(system, 1), [URL], HandClock()) for system in (1, 2)]
    endpoint = shared_hub().endpoint(parse_url(URL))
    assert isinstance(endpoint, TcpInEndpoint)
    modes = [heard(link) for link in links]
    ends = [await tcp_end(endpoint.port, system) for system in (1, 2)]
    for end in ends:
        await until(lambda: end.beats() == [GROUND_STATION])  # noqa: B023
        end.beat(mode=end.mav.srcSystem)
    await until(lambda: modes == [[1], [2]])
    send_arm(links[0])
    await until(ends[0].names)
    assert ends[1].names() == []
    await ends[0].close()
    await until(lambda: links[0].quality() is None)
    assert links[1].quality() is not None
    for link in links:
        await link.close()
    await until(ends[1].transport.is_closing)


async def test_a_port_that_is_taken_is_said() -> None:
    server = TcpServer()
    url = f"tcpin://127.0.0.1:{await server.open()}"
    with pytest.raises(PluginError, match=f"{url}: another program has this port"):
        await open_link(VEHICLE, [url], HandClock())
    await server.close()


async def test_what_a_peer_does_not_read_is_dropped_and_not_kept(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    loop, transports = asyncio.get_running_loop(), []
    connect = loop.create_connection

    async def noted(*arguments: Any) -> Any:
        made = await connect(*arguments)
        transports.append(made[0])
        return made

    monkeypatch.setattr(loop, "create_connection", noted)
    server = TcpServer()
    link = await open_link(VEHICLE, [f"tcpout://127.0.0.1:{await server.open()}"], HandClock())
    modes = heard(link)
    await until(lambda: server.ends and server.ends[0].transport)
    server.ends[0].transport.pause_reading()
    server.ends[0].beat()
    await until(lambda: modes)
    for _ in range(400_000):
        send_arm(link)
        unsent = transports[-1].get_write_buffer_size()
        if unsent >= MOST_UNSENT_BYTES:
            break
    assert unsent >= MOST_UNSENT_BYTES
    for _ in range(1_000):
        send_arm(link)
    assert transports[-1].get_write_buffer_size() == unsent
    await link.close()
    await server.close()


async def test_too_many_connections_are_not_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(streams, "MOST_CONNECTIONS", 2)
    link = await open_link(VEHICLE, [URL], HandClock())
    endpoint = shared_hub().endpoint(parse_url(URL))
    assert isinstance(endpoint, TcpInEndpoint)
    ends = [await tcp_end(endpoint.port) for _ in range(3)]
    await until(ends[2].transport.is_closing)
    assert len(endpoint.peers) == 2
    await link.close()
    for end in ends:
        await end.close()
