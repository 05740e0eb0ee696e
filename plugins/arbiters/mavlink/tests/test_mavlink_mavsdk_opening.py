"""Links that share a ground station of MAVSDK, over real UDP."""

import asyncio
import socket

import pytest
from m2pem_plugin_mavlink.mavsdk_driver.ground_station import open_mavsdk_link
from m2pem_plugin_mavlink.protocol.messages import Address, message_type
from mavlink_mavsdk_world import (
    GROUND,
    ONE,
    free_port,
    linked,
    native_threads,
    open_files,
    scripted,
    until,
)

from m2pem.errors import PluginError

HEARTBEAT = message_type("HEARTBEAT").id
TEXT = message_type("STATUSTEXT")


async def test_each_vehicle_at_a_url_hears_its_own_and_they_share_mavsdk():
    port, heard = free_port(), {1: set(), 7: set()}
    url, addresses = f"udpin://127.0.0.1:{port}", [Address(system, 1) for system in heard]
    async with linked(url, *addresses) as links, scripted(port, 1), scripted(port, 7):
        for link, senders in zip(links, heard.values(), strict=True):
            link.listen((HEARTBEAT,), lambda _, sender, to=senders: to.add(sender))
        await until(lambda: all(heard.values()))
        await asyncio.sleep(0.2)
    assert heard == {1: {Address(1, 1)}, 7: {Address(7, 1)}}


async def test_a_vehicle_that_was_heard_before_anybody_asked_for_it_is_reached():
    port, heard = free_port(), []
    url = f"udpin://127.0.0.1:{port}"
    async with linked(url) as (first,), scripted(port):
        await until(lambda: first.attached)
        async with linked(url) as (second,):
            second.listen((HEARTBEAT,), lambda *each: heard.append(each))
            await until(lambda: bool(heard))
        first.listen((HEARTBEAT,), lambda *each: heard.append(each))
        before = len(heard)
        await until(lambda: len(heard) > before)  # the first goes on without the second


async def test_the_driver_sends_heartbeats_of_a_ground_station():
    port = free_port()
    async with linked(f"udpin://127.0.0.1:{port}"), scripted(port) as vehicle:
        beat = await vehicle.hears(lambda each: each.get_type() == "HEARTBEAT")
    assert (beat.get_srcSystem(), beat.get_srcComponent(), beat.type) == (*GROUND, 6)


async def test_no_thread_and_no_socket_is_left_after_close():
    async def once():
        port = free_port()
        async with linked(f"udpin://127.0.0.1:{port}") as (link,), scripted(port) as vehicle:
            link.listen((HEARTBEAT, TEXT.id), lambda *_: None)
            await until(lambda: link.attached)
            link.send(TEXT.make(text=b"hello"))
            await vehicle.hears(lambda each: each.get_type() == "STATUSTEXT")
        await asyncio.sleep(0.1)  # transports close a turn of the loop later

    await once()
    threads, files, tasks = native_threads(), open_files(), len(asyncio.all_tasks())
    await once()
    assert (native_threads(), open_files(), len(asyncio.all_tasks())) == (threads, files, tasks)


async def test_nothing_goes_to_the_terminal(capfd):
    port, heard = free_port(), []
    async with linked(f"udpin://127.0.0.1:{port}") as (link,), scripted(port) as vehicle:
        link.listen((TEXT.id,), lambda message, _: heard.append(message.text))
        await until(lambda: link.attached)
        await vehicle.hears(lambda each: each.get_type() == "COMMAND_LONG")
        vehicle.mav.statustext_send(6, b"no \xff UTF-8")
        await until(lambda: bool(heard))
    assert heard == ["no \ufffd UTF-8".encode()]
    assert capfd.readouterr() == ("", "")


async def test_a_port_that_is_taken_is_an_error_that_says_so():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        url = f"udpin://127.0.0.1:{other.getsockname()[1]}"
        with pytest.raises(PluginError, match=f"{url}: cannot listen there: Address"):
            await open_mavsdk_link(ONE, [url], None)


async def test_what_mavsdk_cannot_open_is_an_error_and_leaves_nothing():
    url, before = "serial:///dev/nothing-is-here:57600", native_threads()
    for _ in range(2):
        with pytest.raises(PluginError, match=f"{url}: MAVSDK cannot open it: Connection failed: "):
            await open_mavsdk_link(ONE, [url], None)
    assert native_threads() <= before


async def test_a_url_that_is_wrong_is_not_even_tried():
    with pytest.raises(PluginError, match="did you mean udpin://"):
        await open_mavsdk_link(ONE, ["udp://127.0.0.1:14550"], None)


async def test_there_is_one_url():
    with pytest.raises(PluginError, match="`driver: mavsdk` takes one URL, not 2"):
        await open_mavsdk_link(ONE, ["udpin://127.0.0.1:1", "udpin://127.0.0.1:2"], None)
