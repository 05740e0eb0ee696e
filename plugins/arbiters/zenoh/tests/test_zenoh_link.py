"""Sessions of Zenoh: who may connect, which files are refused, routers, and what is urgent."""

import asyncio
import shutil
import subprocess
from contextlib import AsyncExitStack
from pathlib import Path

import pytest
from m2pem_plugin_zenoh import m2pem_check_host
from m2pem_plugin_zenoh.arbiter_host import LinkError
from m2pem_plugin_zenoh.host_checks import check_hosts
from m2pem_plugin_zenoh.link import Endpoints, Link, settings
from zenoh_world import free_port

from m2pem import load_fleet
from m2pem.api import Host
from m2pem.errors import PluginError


@pytest.fixture(scope="session")
def keys(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a CA, a certificate for 127.0.0.1 and its key, and one of another CA."""
    if not shutil.which("openssl"):
        pytest.fail("needs openssl: install it")
    folder = tmp_path_factory.mktemp("keys")
    (folder / "names").write_text("subjectAltName=IP:127.0.0.1")
    new = "openssl req -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes"
    for ca in ("ca", "other"):
        run(folder, f"{new} -x509 -days 2 -keyout {ca}.key -out {ca}.pem -subj /CN={ca}")
    for name, ca in (("link", "ca"), ("stranger", "other")):
        run(folder, f"{new} -keyout {name}.key -out {name}.csr -subj /CN={name}")
        signed = f"-CA {ca}.pem -CAkey {ca}.key -CAcreateserial -days 2 -extfile names"
        run(folder, f"openssl x509 -req -in {name}.csr {signed} -out {name}.pem")
    (folder / "users").write_text("anna:secret\n")
    (folder / "wrong").write_text("anna:guessed\n")
    for file in folder.iterdir():
        file.chmod(0o600)
    return folder


def run(folder: Path, command: str) -> None:
    subprocess.run(command.split(), cwd=folder, check=True, capture_output=True)


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
        with pytest.raises(LinkError, match="nobody answers"):
            await link.request("there/request", b"", 5.0)
    finally:
        await link.close()
