"""Signing with a real ArduCopter: between it and m2pem is a relay, which records and forges frames.

Its first serial port, which has no relay, accepts unsigned frames, as USB does; the second one does
not. pymavlink is a second ground station, and the attacker.
"""

import asyncio
import re
import subprocess
import sys
import time
from collections import Counter
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import mavlink_sitl as sitl
import pytest
from m2pem_plugin_mavlink.link.routed_link import RoutedLink, open_link
from m2pem_plugin_mavlink.protocol.messages import Address, message_type
from m2pem_plugin_mavlink.settings import Settings
from m2pem_plugin_mavlink.signing.policy import SigningPolicy
from m2pem_plugin_mavlink.signing.setup import SetupError, remove_key, set_up_key
from mavlink_copters import task
from mavlink_signed_end import KEY, OTHER_KEY, sign_with, write_key
from mavlink_wire import FarEnd
from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api.clock import SystemClock
from tests.executive.conftest import mission, sequence

pytestmark = pytest.mark.sitl("M2PEM_ARDUCOPTER")

COPTER = Address(1, 1)
WITHIN_S = 40.0
REBOOT = dialect.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN
FLEET = """
version: 1
origin: {{lat: 47.397742, lon: 8.545594, alt: 488.0}}
vehicles:
  uav1:
    domain: air
    arbiter: mavlink
    sitl: true
    lost_after: 20 s
    connection: {{url: "udpin://127.0.0.1:{port}", system_id: 1, signing: {{key: {key}}}}}
"""
MISSION = mission(sequence(task("Up", "takeoff", "vehicle='uav1'", altitude="20")))


async def until(true: Callable[[], object]) -> None:
    async with asyncio.timeout(WITHIN_S):
        while not true():  # noqa: ASYNC110  # what is waited for tells nobody
            await asyncio.sleep(0.02)


class _Side(asyncio.DatagramProtocol):
    """One socket of the relay."""

    def __init__(self) -> None:
        self.other: _Side
        self.to: Any = None
        self.frames: list[bytes] = []
        self.transport: Any = None

    def connection_made(self, transport: Any) -> None:
        self.transport = transport

    def datagram_received(self, data: bytes, address: Any) -> None:
        self.to = address
        self.frames.append(data)
        self.other.send(data)

    def error_received(self, error: OSError) -> None:
        """Nobody listens there, yet."""

    def send(self, data: bytes) -> None:
        if self.to is not None:
            self.transport.sendto(data, self.to)


class World:
    """A copter that sends to `copter`, which hands on to `ground`."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.usb, self.port = sitl.free_port(), sitl.free_port()
        self.copter, self.ground = _Side(), _Side()
        self.copter.other, self.ground.other = self.ground, self.copter
        self.ground.to = ("127.0.0.1", self.port)
        self.key = write_key(folder)
        self.policy = SigningPolicy(self.key, state_folder=folder)
        self.over_usb = Settings((f"udpin://127.0.0.1:{self.usb}",), 1)

    @asynccontextmanager
    async def link(self, policy: SigningPolicy | None) -> AsyncIterator[RoutedLink]:
        url = f"udpin://127.0.0.1:{self.port}"
        link = await open_link(COPTER, [url], SystemClock(), signing=policy)
        try:
            yield link
        finally:
            await link.close()

    def acknowledged(self) -> Counter[int]:
        """The commands that the copter has acknowledged over the relay, and how often."""
        parser = dialect.MAVLink(None)
        parser.robust_parsing = True
        messages = parser.parse_buffer(b"".join(self.copter.frames)) or []
        return Counter(each.command for each in messages if each.get_type() == "COMMAND_ACK")


@asynccontextmanager
async def flying(folder: Path) -> AsyncIterator[World]:
    """A copter on the ground that is heard over USB."""
    world = World(folder)
    binary = sitl.program("M2PEM_ARDUCOPTER")
    assert binary is not None
    loop = asyncio.get_running_loop()
    for side in (world.copter, world.ground):
        await loop.create_datagram_endpoint(lambda side=side: side, local_addr=("127.0.0.1", 0))  # type: ignore[misc]
    inner = world.copter.transport.get_extra_info("sockname")[1]
    start = sitl.ardupilot(binary, "quad", 0, world.usb, 1)
    serial1 = start.command.index("--serial1") + 1
    words = [*start.command]
    words[serial1] = f"udpclient:127.0.0.1:{inner}"
    with sitl.running([sitl.Launch(start.name, tuple(words), {}, start.files)], folder / "sitl"):
        yield world
    for side in (world.copter, world.ground):
        side.transport.close()


def request(command: int, *parameters: float) -> Any:
    """A command of m2pem."""
    names = {f"param{number}": value for number, value in enumerate(parameters, 1)}
    make = message_type("COMMAND_LONG").make
    return make(target_system=1, target_component=1, command=command, **names)


def forged(key: bytes | None, system: int = 255, link_id: int = 1) -> Any:
    """What makes frames as another ground station."""
    return sign_with(FarEnd(system, 190), key, link_id).mav


def frame(mav: Any, command: int, *parameters: float) -> bytes:
    padded = [*parameters, *[0.0] * (7 - len(parameters))]
    message = dialect.MAVLink_command_long_message(1, 1, command, 0, *padded)
    made: bytes = message.pack(mav)
    mav.seq = (mav.seq + 1) % 256
    return made


def heard(link: RoutedLink) -> list[int]:
    modes: list[int] = []
    link.listen([0], lambda message, _: modes.append(message.custom_mode))
    return modes


def refused(link: RoutedLink) -> dict[str, int]:
    return {each.refusal.value: each.count for each in link.refused()}


async def obeyed(world: World, link: RoutedLink, number: int) -> None:
    """Send a command until it is acknowledged."""
    before = world.acknowledged()[number]
    for _ in range(10):
        link.send(request(number, 148.0))
        try:
            async with asyncio.timeout(2.0):
                await until(lambda: world.acknowledged()[number] > before)
        except TimeoutError:
            continue
        return
    raise AssertionError("no acknowledgement")


REQUEST_MESSAGE, SET_MODE, DO_SET_HOME = 512, 176, 179


@pytest.mark.tried_with(
    "ArduCopter",
    "MAVLink 2 signing: the vehicle is given the key",
    kind="Autopilots",
    result="obeys only who has the key",
    version="4.7.0-dev",
    on="2026-11",
)
async def test_a_copter_takes_the_key_and_obeys_only_who_has_it(tmp_path: Path) -> None:
    async with flying(tmp_path) as world:
        await set_up_key(world.over_usb, world.policy, None)
        async with world.link(world.policy) as link:
            modes = heard(link)
            await until(lambda: modes)
            await obeyed(world, link, REQUEST_MESSAGE)
            # Its ground station is who has the key, whatever its number; nobody else is.
            for mav in (forged(None), forged(OTHER_KEY), forged(None, 250), forged(OTHER_KEY, 250)):
                world.copter.send(frame(mav, DO_SET_HOME, 1.0))
            await obeyed(world, link, REQUEST_MESSAGE)
            assert world.acknowledged()[DO_SET_HOME] == 0
            second = forged(KEY, 250, link_id=9)
            # It takes the time from the copter, which is a minute ahead after it has got the key.
            second.parse_buffer(b"".join(world.copter.frames[-50:]))
            assert second.signing.goodsig_count > 0
            world.copter.send(frame(second, SET_MODE, 1.0, 4.0))
            await until(lambda: world.acknowledged()[SET_MODE] == 1)
            assert refused(link) == {}


@pytest.mark.parametrize(
    ("key", "reason"), [(None, "not signed"), (OTHER_KEY, "wrongly signed")], ids=["none", "other"]
)
async def test_a_copter_without_the_key_is_not_heard(
    tmp_path: Path, key: bytes | None, reason: str
) -> None:
    async with flying(tmp_path) as world:
        if key is not None:
            other = SigningPolicy(write_key(tmp_path, "its.key", key))
            await set_up_key(world.over_usb, other, None)
        async with world.link(world.policy) as link:
            modes = heard(link)
            await until(lambda: refused(link).get(reason, 0) > 5)
            link.send(request(DO_SET_HOME, 1.0))
            assert modes == []
        assert world.acknowledged() == {}


async def test_m2pem_without_the_key_is_not_obeyed(tmp_path: Path) -> None:
    async with flying(tmp_path) as world:
        await set_up_key(world.over_usb, world.policy, None)
        async with world.link(None) as link:
            modes = heard(link)
            await until(lambda: modes)
            for _ in range(3):
                link.send(request(DO_SET_HOME, 1.0))
        async with world.link(world.policy) as link:
            await until(lambda: link.quality() is not None)
            await obeyed(world, link, REQUEST_MESSAGE)
        assert world.acknowledged()[DO_SET_HOME] == 0


async def test_what_was_recorded_is_refused_on_both_sides(tmp_path: Path) -> None:
    async with flying(tmp_path) as world:
        await set_up_key(world.over_usb, world.policy, None)
        async with world.link(world.policy) as link:
            modes = heard(link)
            await until(lambda: modes)
            world.copter.frames.clear()
            await until(lambda: len(modes) > 5)
            await obeyed(world, link, REQUEST_MESSAGE)
            sent, received = list(world.ground.frames), list(world.copter.frames)
            times = world.acknowledged()[REQUEST_MESSAGE]
            for each in sent:  # commands of m2pem, to the copter
                world.copter.send(each)
            for each in received:  # messages of the copter, to m2pem
                world.ground.send(each)
            await until(lambda: refused(link) == {"replayed": len(received)})
            await obeyed(world, link, SET_MODE)
            assert world.acknowledged()[REQUEST_MESSAGE] == times
            forgeries = (forged(None), forged(OTHER_KEY))
            for mav in forgeries:  # from the right address
                mav.srcSystem, mav.srcComponent = COPTER
                world.ground.send(dialect.MAVLink_heartbeat_message(2, 3, 0, 99, 4, 3).pack(mav))
            await until(lambda: len(refused(link)) == 3)
            assert 99 not in modes


async def test_a_copter_that_restarts_signs_on(tmp_path: Path) -> None:
    async with flying(tmp_path) as world:
        await set_up_key(world.over_usb, world.policy, None)
        async with world.link(world.policy) as link:
            modes = heard(link)
            await until(lambda: modes)
            boots: list[int] = []
            link.listen([2], lambda message, _: boots.append(message.time_boot_ms))
            link.send(request(511, 2.0, 100_000.0))  # SYSTEM_TIME, ten a second
            await until(lambda: boots)
            for _ in range(5):  # it gets lost where the copter has not yet finished to start
                link.send(request(REBOOT, 1.0))
                await asyncio.sleep(0.1)
            world.copter.frames.clear()
            await obeyed(world, link, 511)
            link.send(request(511, 2.0, 100_000.0))
            await until(lambda: boots and boots[-1] < boots[0])
            assert refused(link) == {}


async def test_an_executive_that_restarts_with_its_clock_set_back_is_obeyed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with flying(tmp_path) as world:
        await set_up_key(world.over_usb, world.policy, None)
        began_s = time.time()
        for _ in range(3):
            async with world.link(world.policy) as link:
                modes = heard(link)
                await until(lambda: modes)  # noqa: B023
                await obeyed(world, link, REQUEST_MESSAGE)
                assert refused(link) == {}
            now_s, began_s = began_s - 3600, began_s - 3600
            monkeypatch.setattr(
                "m2pem_plugin_mavlink.signing.timestamps.time.time",
                lambda now_s=now_s: now_s,
            )


async def test_the_key_is_taken_away(tmp_path: Path) -> None:
    async with flying(tmp_path) as world:
        await set_up_key(world.over_usb, world.policy, None)
        other = SigningPolicy(write_key(tmp_path, "2.key", OTHER_KEY), state_folder=tmp_path)
        relayed = Settings((f"udpin://127.0.0.1:{world.port}",), 1)
        with pytest.raises(SetupError, match="another key"):
            await set_up_key(relayed, other, None)
        await set_up_key(relayed, other, world.policy)
        await remove_key(relayed, other)
        async with world.link(None) as link:
            await until(lambda: link.quality() is not None)
            await obeyed(world, link, REQUEST_MESSAGE)


async def play(world: World) -> str:
    """Run a mission; what m2pem prints."""
    (world.folder / "m.bpmn").write_bytes(MISSION)
    fleet = world.folder / "fleet.yaml"
    fleet.write_text(FLEET.format(port=world.port, key=world.key), encoding="utf-8")
    line = ("run", world.folder / "m.bpmn", "--fleet", fleet, "--speed", sitl.SPEED)
    options = ("--ocu", "none", "--format", "json", "--journal", world.folder / "journal.db")
    program = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "m2pem", *map(str, (*line, *options))),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    printed, _ = await program.communicate()
    return f"{printed.decode()}\nstatus {program.returncode}"


async def test_a_mission_flies_with_the_key(tmp_path: Path) -> None:
    async with flying(tmp_path) as world:
        await set_up_key(world.over_usb, world.policy, None)
        printed = await play(world)
        assert printed.endswith("status 0"), printed
        assert "refused" not in printed and KEY.hex() not in printed


async def test_a_mission_without_it_fails_with_that_reason(tmp_path: Path) -> None:
    async with flying(tmp_path) as world:
        other = SigningPolicy(write_key(tmp_path, "its.key", OTHER_KEY))
        await set_up_key(world.over_usb, other, None)
        printed = await play(world)
        assert "LINK_LOST" in printed and not printed.endswith("status 0"), printed
        assert re.search(r"frames of 1/1 on udpin\S+ refused: wrongly signed \(\d+\)", printed)
