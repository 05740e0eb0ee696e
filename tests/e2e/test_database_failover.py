"""A standby of the database takes over, whose clock differs, while an executive drives a vehicle
and another one stands by: never do both command it."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from bench.network import Network
from m2pem.simulation.executions import EffectKind
from m2pem.simulation.state_file import recorded_effects
from tests.chaos.missions import process
from tests.command_line import CommandLine, Program
from tests.executive.conftest import task
from tests.postgres_server import PostgresServer, Replicated, programs, replicate, start_server

pytestmark = [pytest.mark.long, pytest.mark.timeout(600)]

LEASE_S = 12
WITHIN_S = 120.0
AHEAD_S = [LEASE_S // 3, -LEASE_S // 3, 3600, -3600]

FLEET = """version: 1
name: failover
origin: {{lat: 38.1075, lon: -77.3192, alt: 60.0}}
vehicles:
  ugv1: {{domain: ground, arbiter: sim, connection: {{state: {state}, telemetry_hz: 1}}}}
"""
FAR = '<m2pem:property name="target" value="[38.2000, -77.3192]"/>'
MISSION = process(task("Out", "vehicle='ugv1'", "goto", FAR), "S Out E")
STARTED, HELD = [EffectKind.START], [EffectKind.START, EffectKind.HOLD]


class World:
    """An executive that drives, and one that stands by, each on a host of its own.

    `only_first`: the first one knows the address of the primary alone. `inside`: the words before
    the commands of each.
    """

    def __init__(
        self,
        folder: Path,
        servers: Replicated,
        only_first: bool = False,
        inside: Sequence[Sequence[str]] = ((), ()),
        lease_s: float = LEASE_S,
    ) -> None:
        self._state, self._inside = folder / "state", inside
        (folder / "fleet.yaml").write_text(FLEET.format(state=self._state), encoding="utf-8")
        (folder / "m.bpmn").write_bytes(MISSION)
        hosts = []
        for name in ("gcs1", "gcs2"):
            home = folder / name
            home.mkdir()
            variables = {"HOME": str(home), "M2PEM_RUNTIME_DIR": str(home)}
            hosts.append(CommandLine(folder, {**variables, "M2PEM_LEASE_S": f"{lease_s}"}))
        self._hosts = hosts
        self._journals = servers.url.rpartition(",")[0] if only_first else servers.url, servers.url
        self.owner = self._serve(0)
        self.owner.until_said("serving")
        self.standby = self._serve(1, "--standby")
        self.standby.until_said("standing by")
        self.run(0, "start", "m.bpmn")
        self.owner.until_record("BehaviorProgressed", state="RUNNING")

    def _serve(self, number: int, *words: str) -> Program:
        journal = ("--journal", self._journals[number])
        output = ("--ocu", "none", "--format", "json")
        command = ("serve", "--fleet", "fleet.yaml", *output, *journal, *words)
        return self._hosts[number].start_on(self._inside[number], *command)

    def run(self, number: int, *words: str) -> None:
        """Run m2pem on a host, to its end."""
        command = (*words, "--journal", self._journals[number])
        status, errors = self._hosts[number].start_on(self._inside[number], *command).rest()
        assert status == 0, errors

    def effects(self) -> list[EffectKind]:
        """What the vehicle was commanded so far."""
        return [each.kind for each in recorded_effects(self._state)]

    def taken_over(self) -> None:
        """Wait for the standby: the owner has held the vehicle before, and nothing moves it then
        before an operator says so."""
        self.standby.until_said("taking over")
        assert self.effects() == HELD
        self.standby.until_record("PromptOpened")
        assert self.effects() == HELD
        self.run(1, "stop", "r1")
        self.standby.until_record("RunEnded", outcome="stopped")

    def goes_on(self) -> None:
        """The owner has its run, as its operator finds when he stops it."""
        assert self.effects() == STARTED
        self.run(0, "stop", "r1")
        self.owner.until_record("RunEnded", outcome="stopped")

    def close(self) -> None:
        for host in self._hosts:
            host.end()


def until(true: Callable[[], Any]) -> None:
    deadline_s = time.monotonic() + WITHIN_S
    while not true():
        assert time.monotonic() < deadline_s
        time.sleep(0.02)


def until_renewed(server: PostgresServer, servers: Replicated) -> None:
    """Wait until the lease of the executive that drives is renewed."""
    url = server.url(servers.url.partition("?")[0].rpartition("/")[2])
    asked = "SELECT lease_until FROM executives JOIN owners ON id = executive"
    before = server.execute(asked, url)
    until(lambda: server.execute(asked, url) != before)


@pytest.fixture
def opened() -> Iterator[ExitStack]:
    with ExitStack() as stack:
        yield stack


def two_servers(opened: ExitStack, ahead_s: int) -> Replicated:
    primary = start_server()
    opened.callback(primary.remove)
    standby = PostgresServer(primary.programs, primary, ahead_s=ahead_s)
    opened.callback(standby.remove)
    return replicate(primary, standby)


@pytest.mark.parametrize("ahead_s", AHEAD_S)
def test_an_executive_that_reaches_the_new_server_in_time_keeps_its_run(
    opened: ExitStack, tmp_path: Path, ahead_s: int
) -> None:
    servers = two_servers(opened, ahead_s)
    world = World(tmp_path, servers)
    opened.callback(world.close)
    servers.fail_over()
    for _ in range(3):
        until_renewed(servers.standby, servers)
    world.goes_on()


@pytest.mark.parametrize("ahead_s", AHEAD_S)
def test_an_executive_that_does_not_reach_the_new_server_holds_before_another_one_commands(
    opened: ExitStack, tmp_path: Path, ahead_s: int
) -> None:
    servers = two_servers(opened, ahead_s)
    world = World(tmp_path, servers, only_first=True)
    opened.callback(world.close)
    until_renewed(servers.primary, servers)
    servers.fail_over()
    world.taken_over()


@pytest.mark.parametrize("ahead_s", AHEAD_S)
def test_an_executive_whose_lease_is_over_leaves_its_run_to_another_one(
    opened: ExitStack, tmp_path: Path, ahead_s: int
) -> None:
    servers = two_servers(opened, ahead_s)
    world = World(tmp_path, servers)
    opened.callback(world.close)
    servers.primary.kill()
    world.owner.until_said("did not renew the lease of this executive in time")
    servers.standby.promote()
    world.taken_over()
    status, errors = world.owner.rest()
    assert status == 1
    assert f"process {world.standby.process.pid} on" in errors


@pytest.fixture
def network() -> Iterator[Network]:
    with Network("db1", "db2", "gcs1", "gcs2") as made:
        yield made


def on_hosts(opened: ExitStack, network: Network) -> Replicated:
    """The primary on db1, and its standby on db2."""
    servers: list[PostgresServer] = []
    for name in ("db1", "db2"):
        made = PostgresServer(
            programs(),
            *servers,
            inside=network.inside(name),
            address=network.address(name),
        )
        opened.callback(made.remove)
        servers.append(made)
    return replicate(*servers)


def power_off(network: Network, host: str) -> None:
    """No packet leaves the host any more, also none that ends a connection."""
    for other in {"db1", "db2", "gcs1", "gcs2"} - {host}:
        network.link(host, other).cut = True


LONG_LEASE_S = 30


def test_an_executive_goes_on_when_the_servers_host_is_off_and_another_one_takes_over_at_once(
    network: Network, opened: ExitStack, tmp_path: Path
) -> None:
    servers = on_hosts(opened, network)
    inside = [network.inside(each) for each in ("gcs1", "gcs2")]
    world = World(tmp_path, servers, inside=inside, lease_s=LONG_LEASE_S)
    opened.callback(world.close)
    until_renewed(servers.primary, servers)
    power_off(network, "db1")
    servers.standby.promote()
    for _ in range(3):
        until_renewed(servers.standby, servers)
    world.goes_on()


def test_an_executive_holds_when_the_servers_host_is_off_until_another_one_takes_over(
    network: Network, opened: ExitStack, tmp_path: Path
) -> None:
    servers = on_hosts(opened, network)
    inside = [network.inside(each) for each in ("gcs1", "gcs2")]
    world = World(tmp_path, servers, inside=inside)
    opened.callback(world.close)
    until_renewed(servers.primary, servers)
    power_off(network, "db1")
    world.owner.until_said(f"after {LEASE_S} s another one may. Commanded to hold: ugv1")
    assert world.effects() == HELD
    world.owner.until_said("did not renew the lease of this executive in time")
    world.owner.kill()  # else it may serve its fleet again before the other one does
    servers.standby.promote()
    world.taken_over()
