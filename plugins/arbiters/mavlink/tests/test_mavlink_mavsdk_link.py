"""A vehicle's link through MAVSDK, over real UDP."""

import asyncio
import threading

import pytest
from m2pem_plugin_mavlink.protocol.messages import Address, message_type
from m2pem_plugin_mavlink.protocol.transaction import (
    ExchangeError,
    NoAnswerError,
    RefusedError,
    Transaction,
)
from mavlink_mavsdk_world import GROUND, free_port, linked, scripted, until

ACK = message_type("COMMAND_ACK")
COMMAND = message_type("COMMAND_LONG")
EKF = message_type("EKF_STATUS_REPORT")
HEARTBEAT = message_type("HEARTBEAT")
TEXT = message_type("STATUSTEXT")
PING = message_type("PING")


@pytest.fixture
async def world():
    """A link that is attached, and its vehicle."""
    port = free_port()
    async with linked(f"udpin://127.0.0.1:{port}") as (link,), scripted(port) as vehicle:
        await until(lambda: link.attached)
        yield link, vehicle


async def test_messages_are_heard_in_the_event_loop(world):
    link, vehicle = world
    heard = []
    link.listen((TEXT.id, EKF.id), lambda *each: heard.append((*each, threading.current_thread())))

    def told():
        vehicle.mav.statustext_send(6, b"EKF: fine")
        vehicle.mav.ekf_status_report_send(0x33F, 0, 0, 0, 0, 0)
        return len({each[0].TYPE.id for each in heard}) == 2

    await until(told)
    assert {each[1] for each in heard} == {Address(1, 1)}
    assert {each[2] for each in heard} == {threading.main_thread()}
    assert {each[0].text for each in heard if each[0].TYPE is TEXT} == {b"EKF: fine"}
    assert {each[0].flags for each in heard if each[0].TYPE is EKF} == {0x33F}


async def test_who_no_longer_listens_hears_nothing(world):
    link, _ = world
    first, second = [], []
    end = link.listen((HEARTBEAT.id,), lambda *each: first.append(each))
    link.listen((HEARTBEAT.id,), lambda *each: second.append(each))
    await until(lambda: bool(first))
    end()
    end()
    count, others = len(first), len(second)
    await until(lambda: len(second) > others)
    assert len(first) == count


async def test_what_is_sent_arrives_in_its_order_and_from_us(world):
    link, vehicle = world
    target = message_type("SET_POSITION_TARGET_LOCAL_NED")
    for north in range(20):
        link.send(target.make(target_system=1, target_component=1, vx=float(north)))
    await vehicle.hears(lambda each: getattr(each, "vx", None) == 19.0)
    sent = [each for each in vehicle.received if each.get_type() == target.name]
    assert [each.vx for each in sent] == [float(north) for north in range(20)]
    assert {(each.get_srcSystem(), each.get_srcComponent()) for each in sent} == {tuple(GROUND)}


async def test_before_the_vehicle_is_heard_nothing_is_sent_or_performed():
    port = free_port()
    async with linked(f"udpin://127.0.0.1:{port}") as (link,):
        link.send(PING.make())
        with pytest.raises(NoAnswerError, match="system 1 has sent no message yet"):
            await link.perform(Ask())
        async with scripted(port) as vehicle:
            await vehicle.hears(lambda each: each.get_type() == "HEARTBEAT")
            assert not any(each.get_type() == "PING" for each in vehicle.received)


class Ask(Transaction[int]):
    """A command, asked once."""

    wants = frozenset({ACK.id})

    def __init__(self, command=400, within_s=5.0, **fields):
        super().__init__(("command", command))
        self.command = command
        self.message = COMMAND.make(target_system=1, target_component=1, command=command, **fields)
        self.within_s = within_s

    def begin(self, now_s):
        self.outbox.append(self.message)
        self.deadline_s = now_s + self.within_s

    def receive(self, message, sender, now_s):
        if message.command == self.command:
            if message.result:
                self.fail(RefusedError("refused", message.result))
            else:
                self.succeed(message.result)

    def expire(self, now_s):
        self.fail(NoAnswerError("no answer"))


async def test_a_command_is_performed(world):
    link, vehicle = world
    assert await link.perform(Ask(511, param1=33.0, param7=-2.5)) == 0
    heard = await vehicle.hears(lambda each: getattr(each, "command", None) == 511)
    assert (heard.param1, heard.param2, heard.param7) == (33.0, 0.0, -2.5)


async def test_a_command_is_given_once_and_its_refusal_told(world):
    link, vehicle = world
    vehicle.answers["COMMAND_LONG"] = lambda message: vehicle.accept(message, 2)
    with pytest.raises(RefusedError, match="refused"):
        await link.perform(Ask())
    await asyncio.sleep(0.7)  # after 0.5 s MAVSDK itself would ask again
    assert len([each for each in vehicle.received if getattr(each, "command", None) == 400]) == 1


async def test_commands_with_one_number_and_different_fields_all_arrive(world):
    link, vehicle = world
    for message_id in (24, 30, 33):
        await link.perform(Ask(511, param1=float(message_id)))
    asked = [each.param1 for each in vehicle.received if getattr(each, "command", None) == 511]
    assert asked == [24.0, 30.0, 33.0]


async def test_a_silent_vehicle_ends_an_exchange_by_its_own_deadline(world):
    link, vehicle = world
    vehicle.answers.clear()
    ask = Ask(within_s=0.3)
    with pytest.raises(NoAnswerError, match="no answer"):
        await link.perform(ask)


async def test_an_exchange_fails_when_the_link_is_closed(world):
    link, vehicle = world
    vehicle.answers.clear()
    asking = asyncio.create_task(link.perform(Ask()))
    await vehicle.hears(lambda each: getattr(each, "command", None) == 400)
    await link.close()
    for attempt in (asking, link.perform(Ask())):
        with pytest.raises(ExchangeError, match="the link was closed"):
            await attempt
    link.send(PING.make())
    assert not link.calls.pending
