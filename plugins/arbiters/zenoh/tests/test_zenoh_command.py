"""`m2pem arbiter-host` and an executive, as docs/arbiter-host.md shows them: two processes."""

import re
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from m2pem_plugin_zenoh.plugin import ZenohHosts
from zenoh_world import free_port

from m2pem import load_fleet
from m2pem.api import SystemClock
from m2pem.api.arbiter import BehaviorReport
from m2pem.errors import PluginError
from m2pem.executive.fleet_connections import FleetArbiters, FleetConnections
from m2pem.plugins import PluginManager
from m2pem.testing import scenarios
from m2pem.testing.contracts.arbiter_harness import context
from tests.command_line import CommandLine, Program, command_line

PAGE = Path(__file__).parents[4] / "docs" / "arbiter-host.md"
FLEET = re.findall(r'```yaml title="fleet.yaml"\n(.*?)```', PAGE.read_text(), re.DOTALL)[0]
SERVED = ("arbiter-host", "--fleet", "fleet.yaml")


@pytest.fixture
def m2pem(tmp_path: Path) -> Iterator[CommandLine]:
    port = free_port()
    (tmp_path / "fleet.yaml").write_text(FLEET.replace(":7447", f":{port}"))
    near, far = "[38.10752, -77.3192]", "[38.1076, -77.3192]"
    for name, vehicle, target in (
        ("rover1", "rover1", near),
        ("rover2", "rover2", near),
        ("far", "rover1", far),
    ):
        mission = scenarios.one_behavior("goto", vehicle, target=target, speed="4 m/s")
        (tmp_path / f"{name}.bpmn").write_bytes(mission)
    yield from command_line(tmp_path)


@pytest.fixture
def host(m2pem: CommandLine) -> Program:
    program = m2pem.start(*SERVED, "--host", "rover1-pi", "--state", "state")
    assert "listens at tcp/127.0.0.1:" in program.stderr.readline()
    return program


RUN = ("--fleet", "fleet.yaml", "--ocu", "none", "--journal", "journal.db")


def test_missions_run_on_a_vehicle_of_a_host_and_one_of_the_executive(
    m2pem: CommandLine, host: Program
) -> None:
    for mission in ("rover1.bpmn", "rover2.bpmn"):
        ran = m2pem.run("run", mission, *RUN)
        assert ran[0] == 0, ran
        assert "ends goto: succeeded" in ran[1]
    host.process.terminate()
    assert host.rest()[0] == 0


def test_an_executive_beside_a_host_may_not_command_the_same_vehicle(
    m2pem: CommandLine, host: Program
) -> None:
    status, _, errors = m2pem.run(*SERVED, "--state", "state")
    assert status == 2
    assert f"process {host.process.pid} commands it already" in errors


def test_without_its_host_a_vehicle_is_not_commanded(m2pem: CommandLine) -> None:
    ran = m2pem.run("run", "rover1.bpmn", *RUN)
    assert ran[0] == 1, ran
    assert "host rover1-pi is not reached" in "".join(ran[1:])


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--host", "rover1"), "no vehicle has the host 'rover1'; did you mean 'rover1-pi'?"),
        (("--listen", "tcp/0.0.0.0:7447"), "anyone there could command"),
        (("--listen", "tcp/127.0.0.1:1", "--connect", "tcp/127.0.0.1:2"), "one or the other"),
    ],
)
def test_bad_words_are_refused_with_a_remedy(
    m2pem: CommandLine, words: tuple[str, ...], message: str
) -> None:
    status, _, errors = m2pem.run(*SERVED, *words)
    assert status == 2
    assert message in errors


def test_no_vehicle_has_the_link_as_its_arbiter() -> None:
    with pytest.raises(PluginError, match="keep the vehicle's own arbiter"):
        ZenohHosts()({}, None)  # type: ignore[arg-type]  # it is refused before


async def test_the_way_to_its_host_adds_to_the_bound_of_a_vehicle(tmp_path: Path) -> None:
    text = FLEET.replace("arbiter: sim,", "arbiter: sim, lost_after: 5 s,")
    text = text.replace("arbiter: sim}", "arbiter: sim, lost_after: 5 s}")
    (tmp_path / "fleet.yaml").write_text(text.replace('7447"]', '7447"], round_trip: 3 s'))
    fleet = load_fleet(tmp_path / "fleet.yaml")
    arbiters = FleetArbiters(fleet, PluginManager(), context(SystemClock()))

    async def ignore(_: BehaviorReport) -> None:
        return

    connections = FleetConnections(arbiters, ignore, lambda _: None)
    try:
        assert connections.lost_after_s(1.0) == {"rover1": 8.0, "rover2": 5.0}
    finally:
        await connections.close()


def begun(m2pem: CommandLine) -> Program:
    """An executive whose vehicle moves."""
    program = m2pem.start("run", "far.bpmn", *RUN)
    program.until_text("begins goto")
    return program


def test_an_executive_that_was_killed_finds_its_behavior_at_the_host(
    m2pem: CommandLine, host: Program
) -> None:
    begun(m2pem).kill()
    ran = m2pem.run("resume", "r1", "--journal", "journal.db", "--ocu", "none")
    assert ran[0] == 0, ran
    assert "ends goto: succeeded" in ran[1]
    assert "ended goto: lost" not in ran[1]


def test_the_operator_is_told_which_host_has_not_confirmed_a_stop(
    m2pem: CommandLine, host: Program
) -> None:
    executive = begun(m2pem)
    host.send(signal.SIGSTOP)
    try:
        m2pem.run("stop", "r1", "--journal", "journal.db")
        told = next((line for line in executive.stderr if "may not have received" in line), "")
    finally:
        host.send(signal.SIGCONT)
    assert "rover1 may not have received the STOP of r1" in told
    assert "on rover1-pi has not taken it within 1 s" in told
    assert executive.rest()[0] == 130
