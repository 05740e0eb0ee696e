"""A vehicle keeps the place at which it is heard, whoever else claims to be it."""

import logging

import pytest
from m2pem_plugin_mavlink.link.route import FORGOTTEN_S, MAX_COMPETITORS, TAKEOVER_S, Peer, Route
from m2pem_plugin_mavlink.protocol.frames import encode
from m2pem_plugin_mavlink.protocol.inbound import Sender
from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type
from m2pem_plugin_mavlink.protocol.url import parse_url

VEHICLE = Address(5, 1)
GIMBAL = Address(5, 154)
HEARTBEAT = message_type("HEARTBEAT")


class World:
    """A route with a clock; whatever peers are heard."""

    def __init__(self) -> None:
        self.route = Route(5, parse_url("udpin://127.0.0.1:14550"))
        self.route.autopilots.add(1)
        self.now_s = 0.0
        self.received: list[int] = []
        self.claims: list[bool] = []
        self.route.listen([0], self._listen)

    def _listen(self, message: Message, _: Address) -> None:
        self.received.append(message.custom_mode)

    def peer(self, name: str) -> Peer:
        def meet(peer: Peer, sender: Sender) -> bool:
            self.claims.append(self.route.claim(peer, sender, self.now_s))
            return True

        return Peer(name, lambda _: None, meet, 0.0)

    def beat(self, peer: Peer, source: Address = VEHICLE, mode: int = 0) -> None:
        peer.inbound.datagram(encode(HEARTBEAT.make(custom_mode=mode), 0, source), self.now_s)

    def reached(self, component: int = 1) -> str | None:
        peer = self.route.peer_of(component, 1)
        return peer.name if peer else None


def test_a_vehicle_that_was_not_heard_is_nowhere() -> None:
    world = World()
    assert world.reached() is None
    world.beat(world.peer("camera"), GIMBAL)
    assert world.reached() is None


def test_a_component_is_reached_where_it_is_heard_and_others_through_the_autopilot() -> None:
    world = World()
    world.beat(world.peer("autopilot"))
    world.beat(world.peer("gimbal"), GIMBAL)
    assert [world.reached(each) for each in (0, 1, 154, 100)] == [
        "autopilot",
        "autopilot",
        "gimbal",
        "autopilot",
    ]


def test_another_peer_with_the_same_id_is_not_believed_and_told_of_once(
    caplog: pytest.LogCaptureFixture,
) -> None:
    world = World()
    first, *liars = (world.peer(name) for name in ("first", "second", "third"))
    world.beat(first, mode=1)
    with caplog.at_level(logging.WARNING):
        for _ in range(20):
            world.now_s += 0.5
            world.beat(first, mode=1)
            for liar in liars:
                world.beat(liar, mode=2)
            world.route.judge(world.now_s)
    assert world.reached() == "first"
    assert set(world.received) == {1}
    assert len(caplog.records) == 1
    assert "second claims to be component 1 of system 5, as does first" in caplog.text


def test_a_rival_is_believed_when_the_first_has_long_been_silent() -> None:
    world = World()
    old, new = world.peer("old"), world.peer("new")
    world.beat(old)
    world.beat(new)
    world.now_s = TAKEOVER_S
    world.beat(new, mode=7)
    world.route.judge(world.now_s)
    assert world.reached() == "old"
    world.now_s += 0.1
    world.route.judge(world.now_s)
    assert world.reached() == "new"
    world.received.clear()
    world.beat(new, mode=8)
    world.beat(old, mode=9)
    assert world.received == [8]


def test_places_may_change_again_and_again() -> None:
    world = World()
    peers = [world.peer(name) for name in ("a", "b", "c")]
    for turn in range(9):
        speaking = peers[turn % 3]
        for _ in range(8):
            world.beat(speaking, mode=turn)
            world.now_s += 1.0
            world.route.judge(world.now_s)
        assert world.reached() == speaking.name
        assert world.received[-1] == turn


def test_who_is_heard_first_after_a_silence_is_believed_at_once() -> None:
    world = World()
    world.beat(world.peer("old"))
    world.now_s = TAKEOVER_S + 0.1
    world.beat(world.peer("new"), mode=7)
    assert (world.reached(), world.received[-1]) == ("new", 7)


def test_a_rival_that_is_silent_too_is_not_believed() -> None:
    world = World()
    world.beat(world.peer("old"))
    world.beat(world.peer("new"))
    world.now_s = 60.0
    world.route.judge(world.now_s)
    assert world.reached() == "old"


def test_a_connection_that_is_gone_gives_its_place_up_at_once() -> None:
    world = World()
    old, new = world.peer("old"), world.peer("new")
    world.beat(old)
    world.beat(new)
    old.open = False
    assert world.reached() is None
    world.route.judge(world.now_s)
    assert world.reached() == "new"


def test_rivals_do_not_pile_up() -> None:
    world = World()
    world.beat(world.peer("first"))
    for number in range(100):
        world.beat(world.peer(str(number)))
    assert world.claims == [True] * (1 + MAX_COMPETITORS) + [False] * (100 - MAX_COMPETITORS)


def test_a_component_that_is_long_silent_is_forgotten_and_met_anew_but_no_autopilot() -> None:
    world = World()
    autopilot, gimbal = world.peer("autopilot"), world.peer("gimbal")
    world.beat(autopilot)
    world.beat(gimbal, GIMBAL)
    world.now_s = FORGOTTEN_S + 1
    world.route.judge(world.now_s)
    assert [world.reached(each) for each in (1, 154)] == ["autopilot", "autopilot"]
    assert not world.route.holds(gimbal)
    world.beat(gimbal, GIMBAL)
    assert world.reached(154) == "gimbal"


def test_a_message_is_wanted_as_often_as_it_is_listened_to() -> None:
    world = World()
    peer = world.peer("first")
    calls: list[Message] = []

    def listen(message: Message, _: Address) -> None:
        calls.append(message)

    world.route.listen([0, 30], listen)
    world.route.listen([0], listen)
    world.beat(peer)
    assert len(calls) == 2
    world.route.unlisten([0, 30], listen)
    world.beat(peer)
    assert len(calls) == 3
    world.route.unlisten([0], listen)
    world.beat(peer)
    assert len(calls) == 3
    (sender,) = peer.inbound.senders.values()
    assert set(sender.wanted) == {0}, "no other message is decoded"


def test_an_unknown_message_cannot_be_wanted() -> None:
    with pytest.raises(KeyError):
        World().route.listen([0, 0x7FFFFF], lambda *_: None)


def test_quality_is_that_of_the_component_where_it_is_believed() -> None:
    world = World()
    assert world.route.quality(1, 0.0) is None
    world.beat(world.peer("first"))
    world.now_s = 2.0
    world.beat(world.peer("liar"))
    quality = world.route.quality(1, 2.0)
    assert quality is not None and quality.age_s == 2.0
