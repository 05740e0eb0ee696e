"""A vehicle's link through MAVSDK, over real UDP."""

import asyncio
import threading

import pytest
from m2pem_plugin_mavlink.protocol.messages import Address, message_type
from m2pem_plugin_mavlink.protocol.transaction import NoAnswerError
from mavlink_mavsdk_world import (
    GROUND,
    free_port,
    native_threads,
    open_files,
    scripted,
    stationed,
    until,
)

from m2pem.errors import PluginError

EKF = message_type("EKF_STATUS_REPORT")
HEARTBEAT = message_type("HEARTBEAT")
TEXT = message_type("STATUSTEXT")


async def test_messages_are_heard_in_the_event_loop():
    port, heard = free_port(), []
    async with stationed(f"udpin://127.0.0.1:{port}") as station, scripted(port) as vehicle:
        link = station.link(1)
        link.listen(
            (TEXT.id, EKF.id), lambda *each: heard.append((*each, threading.current_thread()))
        )
        await until(lambda: link.attached)
        await until(lambda: _told(vehicle) and len({each[0].TYPE for each in heard}) == 2)
    assert {each[1] for each in heard} == {Address(1, 1)}
    assert {each[2] for each in heard} == {threading.main_thread()}
    assert {each[0].text for each in heard if each[0].TYPE is TEXT} == {b"EKF: fine"}
    assert {each[0].flags for each in heard if each[0].TYPE is EKF} == {0x33F}


def _told(vehicle):
    vehicle.mav.statustext_send(6, b"EKF: fine")
    vehicle.mav.ekf_status_report_send(0x33F, 0, 0, 0, 0, 0)
    return True


async def test_each_vehicle_of_a_station_hears_its_own():
    port, heard = free_port(), {1: set(), 7: set()}
    async with (
        stationed(f"udpin://127.0.0.1:{port}") as station,
        scripted(port, 1),
        scripted(port, 7),
    ):
        for system, senders in heard.items():
            station.link(system).listen(
                (HEARTBEAT.id,), lambda _, sender, to=senders: to.add(sender)
            )
        await until(lambda: all(heard.values()))
        await asyncio.sleep(0.2)
    assert heard == {1: {Address(1, 1)}, 7: {Address(7, 1)}}


async def test_who_no_longer_listens_hears_nothing():
    port, first, second = free_port(), [], []
    async with stationed(f"udpin://127.0.0.1:{port}") as station, scripted(port):
        link = station.link(1)
        end = link.listen((HEARTBEAT.id,), lambda *each: first.append(each))
        link.listen((HEARTBEAT.id,), lambda *each: second.append(each))
        await until(lambda: bool(first))
        end()
        end()
        count, others = len(first), len(second)
        await until(lambda: len(second) > others)
    assert len(first) == count


async def test_what_is_sent_arrives_in_its_order_from_the_right_system():
    port = free_port()
    target = message_type("SET_POSITION_TARGET_LOCAL_NED")
    async with stationed(f"udpin://127.0.0.1:{port}") as station, scripted(port) as vehicle:
        link = station.link(1)
        link.send(target.make(vx=-1.0))  # not heard yet: dropped
        await until(lambda: link.attached)
        for north in range(20):
            link.send(target.make(target_system=1, target_component=1, vx=float(north)))
        await vehicle.hears(lambda each: getattr(each, "vx", None) == 19.0)
    sent = [each for each in vehicle.heard if each.get_type() == target.name]
    assert [each.vx for each in sent] == [float(north) for north in range(20)]
    assert {(each.get_srcSystem(), each.get_srcComponent()) for each in sent} == {tuple(GROUND)}


async def test_it_sends_heartbeats_of_a_ground_station():
    port = free_port()
    async with stationed(f"udpin://127.0.0.1:{port}"), scripted(port) as vehicle:
        beat = await vehicle.hears(lambda each: each.get_type() == "HEARTBEAT")
    assert (beat.get_srcSystem(), beat.get_srcComponent(), beat.type) == (*GROUND, 6)


async def test_nothing_is_performed_before_the_vehicle_is_heard():
    port = free_port()
    async with stationed(f"udpin://127.0.0.1:{port}") as station:
        with pytest.raises(NoAnswerError, match="system 1 was not heard yet"):
            await station.link(1).perform(_Ask())


class _Ask:
    key = "key"


async def test_no_thread_and_no_socket_is_left_after_close():
    async def once():
        port = free_port()
        async with stationed(f"udpin://127.0.0.1:{port}") as station, scripted(port) as vehicle:
            link = station.link(1)
            link.listen((HEARTBEAT.id, TEXT.id), lambda *_: None)
            await until(lambda: link.attached)
            link.send(TEXT.make(text=b"hello"))
            await vehicle.hears(lambda each: each.get_type() == "STATUSTEXT")
        await asyncio.sleep(0.1)  # transports close a turn of the loop later

    await once()
    threads, files, tasks = native_threads(), open_files(), len(asyncio.all_tasks())
    await once()
    assert (native_threads(), open_files(), len(asyncio.all_tasks())) == (threads, files, tasks)


async def test_its_log_does_not_go_to_the_terminal(capfd):
    port = free_port()
    async with stationed(f"udpin://127.0.0.1:{port}") as station, scripted(port):
        await until(lambda: station.link(1).attached)
    out, err = capfd.readouterr()
    assert (out, err) == ("", "")


@pytest.mark.parametrize("url", ["nonsense://127.0.0.1:1", "udpin://192.0.2.1:24999"])
async def test_what_cannot_be_opened_is_an_error_that_says_so(url):
    before = native_threads()
    with pytest.raises(PluginError, match=f"{url}: MAVSDK cannot open it: Connection failed: "):
        async with stationed(url):
            pass
    assert native_threads() == before
