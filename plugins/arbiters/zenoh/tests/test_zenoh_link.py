"""Sessions of Zenoh: who may connect, which files are refused, routers, and what is urgent."""

import asyncio
import shutil
from contextlib import AsyncExitStack
from dataclasses import replace
from pathlib import Path

import pytest
from m2pem_plugin_zenoh import m2pem_check_host
from m2pem_plugin_zenoh.arbiter_host import LinkError
from m2pem_plugin_zenoh.link import Endpoints, Link, check_hosts, settings
from m2pem_plugin_zenoh.plugin import ZenohHosts
from zenoh_world import free_port, hosted_simulation

from bench.network import make_keys
from m2pem import load_fleet
from m2pem.api import Host, SystemClock
from m2pem.errors import PluginError
from m2pem.testing.contracts.arbiter_harness import context


@pytest.fixture(scope="session")
def keys(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with keys for 127.0.0.1, and files of passwords."""
    folder = make_keys(tmp_path_factory.mktemp("keys"), "127.0.0.1")
    for name, password in (("users", "secret"), ("wrong", "guessed")):
        (folder / name).write_text(f"anna:{password}\n")
        (folder / name).chmod(0o600)
    return folder


def host(keys: Path, certificate: str = "link", credentials: str = "") -> Host:
    return Host(
        "pi",
        ca=str(keys / "ca.pem"),
        certificate=str(keys / f"{certificate}.pem"),
        key=str(keys / f"{certificate}.key"),
        credentials=str(keys / credentials) if credentials else "",
    )


async def echo(content: bytes) -> bytes:
    return b"got " + content


async def answer_of(listening: Host, connecting: Host, protocol: str = "tls") -> bytes:
    """Return the answer over a link between two hosts.

    Raises:
        LinkError: there is no connection.
    """
    endpoint = (f"{protocol}/127.0.0.1:{free_port()}",)
    async with AsyncExitStack() as stack:
        one = Link(settings(listening, Endpoints(listen=endpoint)), "one")
        stack.push_async_callback(one.close)
        await one.open()
        await one.answer("there/request", echo)
        two = Link(settings(connecting, Endpoints(connect=endpoint)), "two")
        stack.push_async_callback(two.close)
        try:
            async with asyncio.timeout(4):
                await two.open()
                while True:  # what there is to ask is learnt soon after the connection
                    try:
                        return await two.request("there/request", b"this", 2.0, urgent=True)
                    except LinkError:
                        await asyncio.sleep(0.05)
        except TimeoutError:
            raise LinkError("no connection") from None


@pytest.mark.tried_with(
    "Eclipse Zenoh",
    "hosts with certificates of one authority",
    kind="Databases and brokers",
    result="connected; others are not",
    package="eclipse-zenoh",
)
async def test_hosts_with_certificates_of_one_ca_are_connected(keys: Path) -> None:
    assert await answer_of(host(keys), host(keys)) == b"got this"


async def test_a_password_takes_the_place_of_a_certificate(keys: Path) -> None:
    # The end that connects has no files but these two.
    connecting = Host(
        "pi",
        ca=str(keys / "ca.pem"),
        certificate="/no/such/file",
        key="/no/such/file",
        credentials=str(keys / "users"),
    )
    assert await answer_of(host(keys, credentials="users"), connecting) == b"got this"


async def test_without_a_certificate_of_the_ca_or_the_right_password_there_is_no_connection(
    keys: Path,
) -> None:
    with_password = host(keys, credentials="users")
    refused = {
        "a certificate of another CA": (host(keys), host(keys, "stranger")),
        "no TLS": (host(keys), Host("pi", ca=str(keys / "ca.pem"))),
        "a wrong password": (with_password, host(keys, credentials="wrong")),
        "no password": (with_password, host(keys)),
    }
    answers = await asyncio.gather(
        *(answer_of(*hosts) for hosts in refused.values()), return_exceptions=True
    )
    connected = [
        why for why, got in zip(refused, answers, strict=True) if not isinstance(got, LinkError)
    ]
    assert not connected, answers


@pytest.mark.parametrize("file", ["link.key", "users"])
def test_a_secret_that_others_may_read_is_refused(keys: Path, tmp_path: Path, file: str) -> None:
    copy = tmp_path / "keys"
    shutil.copytree(keys, copy)
    (copy / file).chmod(0o640)
    with pytest.raises(PluginError, match=rf"{file}: others may read it .*chmod 600 .*{file}"):
        settings(host(copy, credentials="users"), Endpoints(listen=("tls/127.0.0.1:1",)))


async def test_with_a_secret_that_others_may_read_neither_end_starts(
    keys: Path, tmp_path: Path
) -> None:
    copy = tmp_path / "keys"
    shutil.copytree(keys, copy)
    (copy / "link.key").chmod(0o644)
    hosted = hosted_simulation(1, tmp_path)
    hosted = replace(hosted, host=replace(host(copy), connect=("tls/127.0.0.1:1",)))
    made = context(SystemClock())
    executive = ZenohHosts()(hosted.connections, made, hosted)
    with pytest.raises(PluginError, match=r"chmod 600 .*link\.key"):
        await executive.connect()
    await executive.close()
    with pytest.raises(PluginError, match=r"chmod 600 .*link\.key"):
        await ZenohHosts().serve([hosted], made, tmp_path / "state")


@pytest.mark.long
async def test_an_end_whose_certificate_names_another_address_is_not_spoken_to(
    tmp_path: Path,
) -> None:
    elsewhere = make_keys(tmp_path, "10.0.0.7")
    with pytest.raises(LinkError):
        await answer_of(host(elsewhere), host(elsewhere))


def test_the_doctor_names_files_that_cannot_be_used(keys: Path) -> None:
    (keys / "fleet.yaml").write_text(
        "version: 1\n"
        "hosts:\n"
        "  here: {connect: ['tcp/127.0.0.1:7447']}\n"
        "  good: {connect: ['tls/10.0.0.7:7447'], tls: {ca: ca.pem, certificate: link.pem,"
        " key: link.key}}\n"
        "  bad: {connect: ['tls/10.0.0.8:7447'], tls: {ca: ca.pem, certificate: none.pem,"
        " key: link.key}}\n"
    )
    here, good, bad = check_hosts(load_fleet(keys / "fleet.yaml"))
    assert (here.status, good.status, bad.status) == ("ok", "ok", "error")
    assert "none.pem: No such file" in bad.message
    assert m2pem_check_host(None) == ()


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(PluginError, match=r"ca\.pem: No such file"):
        settings(Host("pi", ca=str(tmp_path / "ca.pem")), Endpoints())


def test_a_file_without_a_user_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "users"
    file.write_text("anna\n")
    file.chmod(0o600)
    with pytest.raises(PluginError, match="no line 'user:password'"):
        settings(Host("pi", credentials=str(file)), Endpoints())


def test_nothing_is_looked_for_on_the_network() -> None:
    found = settings(Host("pi"), Endpoints(connect=("tcp/127.0.0.1:1",)))
    assert found["scouting/multicast/enabled"] is False
    assert found["scouting/gossip/enabled"] is False


async def test_a_taken_port_is_an_error_that_names_it() -> None:
    endpoint = (f"tcp/127.0.0.1:{free_port()}",)
    first = Link(settings(Host("pi"), Endpoints(listen=endpoint)), "first")
    second = Link(settings(Host("pi"), Endpoints(listen=endpoint)), "second")
    try:
        await first.open()
        with pytest.raises(PluginError, match=endpoint[0]):
            await second.open()
    finally:
        await first.close()
        await second.close()


async def test_two_ends_that_connect_to_a_router_reach_each_other() -> None:
    import zenoh

    port = free_port()
    config = zenoh.Config()
    config.insert_json5("mode", '"router"')
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("listen/endpoints", f'["tcp/127.0.0.1:{port}"]')
    endpoints = Endpoints(connect=(f"tcp/127.0.0.1:{port}",))
    one, two = (Link(settings(Host("pi"), endpoints), name) for name in ("one", "two"))
    appeared, arrived = asyncio.Event(), asyncio.Event()
    # The host begins before the router does.
    opening = asyncio.create_task(one.open())
    router = zenoh.open(config)
    try:
        await opening
        await two.open()
        await two.watch("there/alive", appeared.set)
        await two.subscribe("there/state", lambda _: arrived.set())
        await one.answer("there/request", echo)
        await one.be_there("there/alive")
        async with asyncio.timeout(10):
            await appeared.wait()
            assert await two.request("there/request", b"this", 5.0) == b"got this"
            while not arrived.is_set():
                one.publish("there/state", b"state")
                await asyncio.sleep(0.05)
    finally:
        await one.close()
        await two.close()
        router.close()


async def test_a_request_that_nobody_answers_ends() -> None:
    endpoint = (f"tcp/127.0.0.1:{free_port()}",)
    link = Link(settings(Host("pi"), Endpoints(listen=endpoint)), "link")
    await link.open()
    try:
        with pytest.raises(LinkError, match="the other end is not there"):
            await link.request("there/request", b"", 5.0)
    finally:
        await link.close()
