"""A broker that wants TLS and a password: real certificates, on 127.0.0.1."""

import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from m2pem_plugin_vda5050.arbiter import Vda5050Arbiter
from m2pem_plugin_vda5050.host_checks import check_brokers
from vda_world import Mosquitto, SimProcess, connection, write_fleet

from m2pem import load_fleet
from m2pem.api import Connection, HealthStatus, LinkState, ResourceId, SystemClock
from m2pem.testing.contracts.arbiter_harness import ArbiterHarness, context

AGV1 = ResourceId("agv1")
SPEED = 6.0


@dataclass
class Secured:
    """A broker with TLS and the user `m2pem`, and the settings that reach it."""

    broker: Mosquitto
    folder: Path

    def settings(self, **more: Any) -> dict[str, Any]:
        url = f"mqtts://127.0.0.1:{self.broker.port}"
        secrets = {"user": "m2pem", "password_file": str(self.folder / "secret")}
        tls = {"tls": {"ca": str(self.folder / "ca.pem")}}
        return connection(url, AGV1, **{**secrets, **tls, **more})


def openssl(folder: Path, *words: str) -> None:
    subprocess.run(["openssl", *words], cwd=folder, check=True, capture_output=True)


@pytest.fixture
def secured(tmp_path: Path) -> Iterator[Secured]:
    keys = ("-newkey", "rsa:2048", "-nodes", "-days", "2")
    openssl(
        tmp_path, "req", "-x509", *keys, "-keyout", "ca.key", "-out", "ca.pem", "-subj", "/CN=ca"
    )
    openssl(tmp_path, "req", *keys[:3], "-keyout", "s.key", "-out", "s.csr", "-subj", "/CN=broker")
    (tmp_path / "s.ext").write_text("subjectAltName=IP:127.0.0.1\n", encoding="utf-8")
    signing = ("-CA", "ca.pem", "-CAkey", "ca.key", "-CAcreateserial", "-extfile", "s.ext")
    openssl(tmp_path, "x509", "-req", "-in", "s.csr", *signing, "-out", "s.pem", "-days", "2")
    for name, password in (("secret", "rosebud"), ("wrong", "guess")):
        (tmp_path / name).write_text(f"{password}\n", encoding="utf-8")
        (tmp_path / name).chmod(0o600)
    words = ["mosquitto_passwd", "-b", "-c", str(tmp_path / "users"), "m2pem", "rosebud"]
    subprocess.run(words, check=True, capture_output=True)
    lines = [
        f"certfile {tmp_path / 's.pem'}",
        f"keyfile {tmp_path / 's.key'}",
        f"password_file {tmp_path / 'users'}",
    ]
    broker = Mosquitto(tmp_path, lines, anonymous=False)
    broker.start()
    yield Secured(broker, tmp_path)
    broker.stop()


async def link(settings: dict[str, Any], within_s: float) -> LinkState | None:
    """Connect an arbiter; return the link to its vehicle, or None: nothing was received."""
    connections = {AGV1: Connection(AGV1, "ground", settings, sitl=True)}
    clock = SystemClock(SPEED)
    async with ArbiterHarness(Vda5050Arbiter(connections, context(clock)), clock) as harness:
        await harness.until(lambda: harness.latest(AGV1) is not None, within_s)
        state = harness.latest(AGV1)
        return None if state is None else state.link


@pytest.mark.tried_with(
    "mosquitto",
    "connects with a password and an authority of its own",
    kind="Automated guided vehicles",
    result="connected; others are refused",
    version="2.0.11",
)
async def test_with_the_password_and_the_authority_it_connects(secured: Secured) -> None:
    settings = secured.settings()
    sim = SimProcess(write_fleet(secured.folder / "fleet.yaml", {AGV1: settings}), SPEED)
    try:
        assert await link(settings, 120) is not None
    finally:
        sim.close()
    (check,) = check_brokers(load_fleet(secured.folder / "fleet.yaml"))
    assert check.status is HealthStatus.OK, check


async def test_a_wrong_password_is_told_and_never_logged(secured: Secured, caplog: Any) -> None:
    settings = secured.settings(password_file=str(secured.folder / "wrong"))
    assert await link(settings, 6) is None
    assert "not authori" in caplog.text.lower()
    assert "guess" not in caplog.text


async def test_a_broker_of_another_authority_is_not_trusted(secured: Secured, caplog: Any) -> None:
    settings = secured.settings()
    del settings["tls"]
    assert await link(settings, 6) is None
    assert "certificate verify failed" in caplog.text
