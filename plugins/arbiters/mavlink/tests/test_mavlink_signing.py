"""Signed links over UDP and TCP, with pymavlink at the other end: who is heard, and who is not."""

import time
from collections import Counter
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest
from m2pem_plugin_mavlink.link.hub import shared_hub
from m2pem_plugin_mavlink.link.routed_link import RoutedLink, open_link
from m2pem_plugin_mavlink.link.streams import TcpInEndpoint
from m2pem_plugin_mavlink.link.udp import UdpEndpoint
from m2pem_plugin_mavlink.protocol.messages import Address, message_type
from m2pem_plugin_mavlink.protocol.url import parse_url
from m2pem_plugin_mavlink.signing.key_file import SigningError
from m2pem_plugin_mavlink.signing.policy import SigningPolicy
from m2pem_plugin_mavlink.signing.signature import Signer
from mavlink_signed_end import KEY, OTHER_KEY, Recorded, sign_with, write_key
from mavlink_wire import FarEnd, HandClock, tcp_end, udp_end, until

UDP, TCP = "udpin://127.0.0.1:0", "tcpin://127.0.0.1:0"
VEHICLE = Address(1, 1)
ARM = message_type("COMMAND_LONG").make(target_system=1, target_component=1, command=400)
BOTH = pytest.mark.parametrize("url", [UDP, TCP])


def port_of(url: str) -> int:
    endpoint = shared_hub().endpoint(parse_url(url))
    assert isinstance(endpoint, UdpEndpoint | TcpInEndpoint)
    return endpoint.port


async def end_at(url: str, system: int = 1, component: int = 1) -> FarEnd:
    if url == UDP:
        return await udp_end(port_of(url), system, component)
    return await tcp_end(port_of(url), system)


@asynccontextmanager
async def opened(
    policy: SigningPolicy, *urls: str, address: Address = VEHICLE
) -> AsyncIterator[RoutedLink]:
    link = await open_link(address, urls or [UDP], HandClock(), signing=policy)
    try:
        yield link
    finally:
        await link.close()


def heard(link: RoutedLink) -> list[int]:
    modes: list[int] = []
    link.listen([0], lambda message, _: modes.append(message.custom_mode))
    return modes


def refused(link: RoutedLink) -> dict[str, int]:
    counts: Counter[str] = Counter()
    for each in link.refused():
        counts[each.refusal] += each.count
    return dict(counts)


@BOTH
async def test_a_vehicle_with_the_key_is_heard_and_hears(tmp_path: Path, url: str) -> None:
    async with opened(SigningPolicy(write_key(tmp_path)), url) as link:
        modes = heard(link)
        vehicle = sign_with(await end_at(url))
        for mode in range(5):
            vehicle.beat(mode)
        await until(lambda: len(modes) == 5)
        link.send(ARM)
        link.send(ARM)
        await until(lambda: vehicle.names() == ["COMMAND_LONG"] * 2)
        assert all(each.get_signed() for each in vehicle.received)
        assert vehicle.mav.signing.badsig_count == 0
        assert refused(link) == {}
        await vehicle.close()


@BOTH
@pytest.mark.parametrize(
    ("key", "reason"), [(None, "not signed"), (OTHER_KEY, "wrongly signed")], ids=["none", "other"]
)
async def test_a_vehicle_without_the_key_is_not_heard_and_gets_nothing(
    tmp_path: Path, url: str, key: bytes | None, reason: str
) -> None:
    async with opened(SigningPolicy(write_key(tmp_path)), url) as link:
        modes = heard(link)
        vehicle = sign_with(await end_at(url), key)
        for _ in range(3):
            vehicle.beat()
        await until(lambda: refused(link) == {reason: 3})
        link.send(ARM)
        good = sign_with(await end_at(url))
        good.beat(9)
        await until(lambda: modes == [9])
        assert "COMMAND_LONG" not in vehicle.names()
        (found,) = link.refused()
        assert (found.url, found.count) == (url, 3)
        await vehicle.close()
        await good.close()


@BOTH
async def test_recorded_frames_are_refused(tmp_path: Path, url: str) -> None:
    async with opened(SigningPolicy(write_key(tmp_path)), url) as link:
        modes = heard(link)
        vehicle = sign_with(await end_at(url))
        with Recorded(vehicle) as frames:
            for mode in range(3):
                vehicle.beat(mode)
        await until(lambda: len(modes) == 3)
        attacker = await end_at(url)
        for frame in frames:
            attacker.write(frame)
            vehicle.write(frame)  # from the right address
        await until(lambda: refused(link) == {"replayed": 6})
        vehicle.beat(7)
        await until(lambda: modes == [0, 1, 2, 7])
        assert attacker.names() == []
        await vehicle.close()
        await attacker.close()


async def test_recorded_frames_are_refused_on_another_endpoint(tmp_path: Path) -> None:
    async with opened(SigningPolicy(write_key(tmp_path)), UDP, TCP) as link:
        modes = heard(link)
        vehicle, attacker = sign_with(await end_at(UDP)), await end_at(TCP)
        with Recorded(vehicle) as frames:
            vehicle.beat(1)
        await until(lambda: modes == [1])
        attacker.write(frames[0])
        await until(lambda: [(each.url, each.count) for each in link.refused()] == [(TCP, 1)])
        await vehicle.close()
        await attacker.close()


async def test_recorded_frames_are_refused_after_a_restart(tmp_path: Path) -> None:
    policy = SigningPolicy(write_key(tmp_path), state_folder=tmp_path)
    async with opened(policy) as link:
        modes = heard(link)
        vehicle = sign_with(await end_at(UDP))
        with Recorded(vehicle) as frames:
            vehicle.beat(1)
        await until(lambda: modes == [1])
        link.send(ARM)
        await until(vehicle.names)
    before = vehicle.mav.signing.timestamp
    async with opened(policy) as link:
        modes = heard(link)
        attacker = await end_at(UDP)
        attacker.write(frames[0])
        await until(lambda: refused(link) == {"replayed": 1})
        vehicle.to = ("127.0.0.1", port_of(UDP))
        vehicle.beat(2)
        await until(lambda: modes == [2])
        vehicle.received.clear()
        link.send(ARM)
        await until(vehicle.names)
        assert vehicle.mav.signing.timestamp > before
        await attacker.close()
        await vehicle.close()


async def test_the_clock_of_the_computer_may_go_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    policy = SigningPolicy(write_key(tmp_path), state_folder=tmp_path)
    vehicle, began_s = sign_with(FarEnd()), time.time()
    for _ in range(2):  # the second time after a restart with the clock set back by an hour
        async with opened(policy) as link:
            modes = heard(link)
            now = await end_at(UDP)
            now.mav.signing = vehicle.mav.signing
            now.beat()
            await until(lambda: modes)  # noqa: B023
            link.send(ARM)
            await until(lambda: now.names() == ["COMMAND_LONG"])  # noqa: B023
            await now.close()
        monkeypatch.setattr(
            "m2pem_plugin_mavlink.signing.timestamps.time.time", lambda: began_s - 3600
        )
    assert vehicle.mav.signing.badsig_count == 0


async def test_a_new_stream_may_be_a_minute_old_and_its_vehicle_is_told_the_time(
    tmp_path: Path,
) -> None:
    async with opened(SigningPolicy(write_key(tmp_path))) as link:
        modes = heard(link)
        old = sign_with(await end_at(UDP), ago_s=90)
        old.beat(1)
        await until(lambda: refused(link) == {"too old": 1})
        await until(old.beats)  # a heartbeat, from which a vehicle without a clock takes the time
        old.beat(2)
        await until(lambda: modes == [2])
        another = sign_with(await end_at(UDP, component=2), ago_s=50)
        another.beat(3)
        await until(lambda: modes == [2, 3])
        await old.close()
        await another.close()


async def test_a_vehicle_whose_clock_is_ahead_is_followed(tmp_path: Path) -> None:
    async with opened(SigningPolicy(write_key(tmp_path))) as link:
        modes = heard(link)
        vehicle = sign_with(await end_at(UDP), ago_s=-86_400)
        vehicle.beat(1)
        await until(lambda: modes == [1])
        link.send(ARM)
        await until(vehicle.names)
        assert vehicle.mav.signing.badsig_count == 0
        await vehicle.close()


@BOTH
async def test_a_spoofed_heartbeat_and_acknowledgement_change_nothing(
    tmp_path: Path, url: str
) -> None:
    async with opened(SigningPolicy(write_key(tmp_path)), url) as link:
        acks: list[int] = []
        link.listen([77], lambda message, _: acks.append(message.result))
        modes = heard(link)
        attackers = [await end_at(url), sign_with(await end_at(url), OTHER_KEY)]
        for attacker in attackers:  # before the vehicle, to take its place
            attacker.beat(66)
            attacker.acknowledge(400)
        await until(lambda: refused(link) == {"not signed": 2, "wrongly signed": 2})
        vehicle = sign_with(await end_at(url))
        vehicle.beat(1)
        await until(lambda: modes == [1])
        link.send(ARM)
        await until(vehicle.names)
        for attacker in attackers:
            attacker.acknowledge(400)
            attacker.beat(66)
        await until(lambda: refused(link) == {"not signed": 4, "wrongly signed": 4})
        vehicle.acknowledge(400, 4)
        await until(lambda: acks == [4])
        assert modes == [1]
        assert not any("COMMAND_LONG" in attacker.names() for attacker in attackers)
        for end in (*attackers, vehicle):
            await end.close()


async def test_a_forged_timestamp_does_not_shut_the_vehicle_out(tmp_path: Path) -> None:
    async with opened(SigningPolicy(write_key(tmp_path))) as link:
        modes = heard(link)
        vehicle = sign_with(await end_at(UDP))
        vehicle.beat(1)
        forger = sign_with(await end_at(UDP), OTHER_KEY, ago_s=-3600)
        forger.beat(2)
        await until(lambda: refused(link) == {"wrongly signed": 1} and modes)
        vehicle.beat(3)
        await until(lambda: modes == [1, 3])
        await vehicle.close()
        await forger.close()


async def test_radios_need_not_sign_and_are_no_sign_of_life(tmp_path: Path) -> None:
    policy = SigningPolicy(write_key(tmp_path), accept_unsigned=("HEARTBEAT",))
    async with opened(policy) as link:
        statuses: list[int] = []
        link.listen([109], lambda message, _: statuses.append(message.rssi))
        modes = heard(link)
        radio = await end_at(UDP)
        radio.mav.radio_status_send(1, 2, 3, 4, 5, 6, 7)
        radio.beat(1)
        vehicle = sign_with(await end_at(UDP))
        vehicle.beat(2)
        await until(lambda: modes == [2])
        sign_with(vehicle, None)  # from the address of the vehicle
        vehicle.mav.radio_status_send(8, 2, 3, 4, 5, 6, 7)
        vehicle.beat(3)
        await until(lambda: (statuses, modes) == ([8], [2, 3]))
        assert refused(link) == {}
        quality = link.quality()
        assert quality is not None
        link.send(ARM)
        sign_with(vehicle)
        await until(lambda: "COMMAND_LONG" in vehicle.names())
        assert radio.names() == []
        await radio.close()
        await vehicle.close()


async def test_components_that_do_not_sign_may_be_named(tmp_path: Path) -> None:
    async with opened(SigningPolicy(write_key(tmp_path), accept_unsigned=(154,))) as link:
        senders: list[Address] = []
        link.listen([0], lambda _, sender: senders.append(sender))
        for component in (154, 155):
            end = await end_at(UDP, component=component)
            end.beat()
            await end.close()
        await until(lambda: refused(link) == {"not signed": 1})
        assert senders == [(1, 154)]


async def test_a_signed_message_that_is_unknown_here_is_checked_too(tmp_path: Path) -> None:
    async with opened(SigningPolicy(write_key(tmp_path))) as link:
        modes = heard(link)
        vehicle = sign_with(await end_at(UDP))
        vehicle.beat(1)
        await until(lambda: modes == [1])
        unknown = bytes.fromhex("fd010100010101ffff7f00aabb")
        vehicle.write(unknown + bytes(13))
        await until(lambda: refused(link) == {"wrongly signed": 1})
        await vehicle.close()


async def test_heartbeats_are_signed_with_the_key_of_each_vehicle(tmp_path: Path) -> None:
    clock = HandClock()
    keys = {1: KEY, 2: OTHER_KEY, 3: None}
    links = []
    for system, key in keys.items():
        file = write_key(tmp_path, f"{system}.key", key or KEY)
        policy = SigningPolicy(file) if key else None
        links.append(await open_link(Address(system, 1), [UDP], clock, signing=policy))
    ends = {system: sign_with(await end_at(UDP, system), key) for system, key in keys.items()}
    modes = [heard(link) for link in links]
    for end in ends.values():
        end.beat()
    await until(lambda: all(modes))
    await clock.turn(3.0)
    await until(lambda: all(len(end.beats()) == 3 for end in ends.values()))
    signed = {system: {each.get_signed() for each in end.received} for system, end in ends.items()}
    assert signed == {1: {True}, 2: {True}, 3: {False}}
    assert all(end.mav.signing.badsig_count == 0 for end in ends.values())
    for end in ends.values():
        await end.close()
    for link in links:
        await link.close()


async def test_each_endpoint_of_a_vehicle_is_a_link_of_its_own(tmp_path: Path) -> None:
    async with opened(SigningPolicy(write_key(tmp_path), link_id=4), UDP, TCP) as link:
        modes = heard(link)
        ends = [sign_with(await end_at(url)) for url in (UDP, TCP)]
        for end in ends:
            end.mav.signing.link_id = ends.index(end)
            end.beat()
        await until(lambda: len(modes) == 2)
        for endpoint, end in zip((UDP, TCP), ends, strict=True):
            peers = shared_hub().endpoint(parse_url(endpoint)).signings()
            (signings,) = peers.values()
            assert {each.link_id for each in signings if each} == {4 + ends.index(end)}
            await end.close()


async def test_a_second_link_to_a_vehicle_signs_as_the_first(tmp_path: Path) -> None:
    policy = SigningPolicy(write_key(tmp_path))
    async with opened(policy) as link:
        other = await open_link(VEHICLE, [UDP], HandClock(), Address(255, 191))
        modes = heard(other)
        vehicle = sign_with(await end_at(UDP))
        vehicle.beat(4)
        await until(lambda: modes == [4])
        other.send(ARM)
        await until(vehicle.names)
        assert vehicle.received[-1].get_signed()
        file = write_key(tmp_path, "other.key", OTHER_KEY)
        with pytest.raises(SigningError, match=r"has another key or link id: that of .*v1\.key"):
            await open_link(VEHICLE, [UDP], HandClock(), signing=SigningPolicy(file))
        link.send(ARM)
        await until(lambda: len(vehicle.names()) == 2)
        await vehicle.close()
        await other.close()


async def test_a_link_that_begins_to_sign_forgets_who_was_heard_without(tmp_path: Path) -> None:
    first = await open_link(VEHICLE, [UDP], HandClock())
    modes = heard(first)
    attacker = await end_at(UDP)
    attacker.beat(1)
    await until(lambda: modes == [1])
    async with opened(SigningPolicy(write_key(tmp_path))) as link:
        attacker.beat(2)
        await until(lambda: refused(link) == {"not signed": 1})
        link.send(ARM)
        vehicle = sign_with(await end_at(UDP))
        vehicle.beat(3)
        await until(lambda: modes == [1, 3])
        link.send(ARM)
        await until(vehicle.names)
        assert attacker.names() == []
        await vehicle.close()
    await attacker.close()
    await first.close()


def test_a_large_fleet_may_have_one_key() -> None:
    signer = Signer(KEY, None)
    for system in range(1, 255):
        for component in range(1, 11):
            frame = bytes((system, component))
            signed = frame + signer.signature(frame, 1)
            assert signer.refusal(signed, system | component << 8) is None


async def test_no_text_form_of_a_link_has_the_key(tmp_path: Path) -> None:
    async with opened(SigningPolicy(write_key(tmp_path))) as link:
        endpoint = shared_hub().endpoint(parse_url(UDP))
        route = endpoint.route(1)
        texts = "".join(map(repr, (link, route, route.check, route.signing)))
        endpoint.release(route)
    assert KEY.hex() not in texts and repr(KEY) not in texts
