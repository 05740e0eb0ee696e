"""DDS stays on 127.0.0.1, as the sockets of a process show that talks to another one."""

import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from ipaddress import IPv4Address
from pathlib import Path

import pytest
from m2pem_interfaces.srv import AnswerPrompt
from m2pem_plugin_ros import loopback
from m2pem_plugin_ros.runtime import RosRuntime
from m2pem_plugin_ros.testing import Peer, reserved_domain

ECHO = Path(__file__).with_name("ros_echo_peer.py")
LOOPBACK = IPv4Address("127.0.0.1")


def internet_sockets() -> Iterator[socket.socket]:
    """Copies of all sockets of this process that could reach a network."""
    for descriptor in Path("/proc/self/fd").iterdir():
        try:
            if not str(descriptor.readlink()).startswith("socket:"):
                continue
            copy = socket.socket(fileno=os.dup(int(descriptor.name)))
        except FileNotFoundError:  # that of this listing
            continue
        with copy:
            if copy.family in (socket.AF_INET, socket.AF_INET6):
                yield copy


def bound() -> set[tuple[str, int]]:
    """Addresses and ports of all sockets; those without a port have never sent or received."""
    names = [sock.getsockname()[:2] for sock in internet_sockets()]
    return {(address, port) for address, port in names if port}


async def test_all_sockets_are_of_loopback_while_processes_talk(ros_domain: int) -> None:
    before = bound()
    with Peer(ECHO, ros_domain):
        async with RosRuntime("kept", domain_id=ros_domain) as ros:
            client = ros.client(AnswerPrompt, "answer")
            assert (await ros.call(client, AnswerPrompt.Request(), 20.0)).success
            used = {IPv4Address(address) for address, _ in bound() - before}
    assert {address for address in used if not address.is_multicast} == {LOOPBACK}


def members(group: str) -> set[str]:
    """The interfaces of this machine on which a multicast group is joined."""
    key = f"{int.from_bytes(socket.inet_aton(group), sys.byteorder):08X}"
    interface, joined = "", set()
    for line in Path("/proc/net/igmp").read_text(encoding="ascii").splitlines()[1:]:
        if line[0].isdigit():
            interface = line.split()[1]
        elif line.split()[0] == key:
            joined.add(interface)
    return joined


async def test_the_group_of_discovery_is_joined_on_loopback_only(ros_domain: int) -> None:
    async with RosRuntime("kept", domain_id=ros_domain):
        assert members("239.255.0.1") == {"lo"}


def test_a_process_that_was_not_kept_from_the_beginning_is_refused() -> None:
    late = (
        "import rclpy; from m2pem_plugin_ros.loopback import keep_on_loopback; keep_on_loopback()"
    )
    environment = {k: v for k, v in os.environ.items() if k not in loopback.environment()}
    ended = subprocess.run(
        [sys.executable, "-c", late], env=environment, capture_output=True, text=True, check=False
    )
    assert "only before rclpy is imported" in ended.stderr


def test_the_variables_of_the_user_do_not_open_it() -> None:
    program = "from m2pem_plugin_ros import loopback as l; l.keep_on_loopback(); print(l.is_kept())"
    wide = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET", "ROS_STATIC_PEERS": "192.0.2.1"}
    ended = subprocess.run(
        [sys.executable, "-c", program],
        env={**os.environ, **wide},
        capture_output=True,
        text=True,
        check=True,
    )
    assert ended.stdout == "True\n"


def test_a_reserved_domain_is_given_to_one_at_a_time() -> None:
    with reserved_domain() as one, reserved_domain() as other:
        assert one != other
    with reserved_domain() as again:
        assert again == one


@pytest.mark.parametrize("domain", [None, 7])
def test_a_domain_is_said_only_if_there_is_one(domain: int | None) -> None:
    assert loopback.environment(domain).get("ROS_DOMAIN_ID") == (domain and str(domain))
