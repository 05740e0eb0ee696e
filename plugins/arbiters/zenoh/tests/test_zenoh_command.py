"""`m2pem arbiter-host` and an executive, as docs/arbiter-host.md shows them: two processes."""

import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from m2pem_plugin_zenoh.plugin import ZenohHosts
from zenoh_world import free_port

from m2pem.errors import PluginError
from m2pem.testing import scenarios

PAGE = Path(__file__).parents[4] / "docs" / "arbiter-host.md"
FLEET = re.findall(r'```yaml title="fleet.yaml"\n(.*?)```', PAGE.read_text(), re.DOTALL)[0]
M2PEM = (sys.executable, "-m", "m2pem")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    port = free_port()
    (tmp_path / "fleet.yaml").write_text(FLEET.replace(":7447", f":{port}"))
    target = "[38.1076, -77.3192]"
    for vehicle in ("rover1", "rover2"):
        mission = scenarios.one_behavior("goto", vehicle, target=target, speed="4 m/s")
        (tmp_path / f"{vehicle}.bpmn").write_bytes(mission)
    return tmp_path


@pytest.fixture
def host(folder: Path) -> Iterator["subprocess.Popen[str]"]:
    command = [*M2PEM, "arbiter-host", "--fleet", "fleet.yaml", "--host", "rover1-pi"]
    process = subprocess.Popen(
        [*command, "--state", "state"], cwd=folder, stderr=subprocess.PIPE, text=True
    )
    assert process.stderr is not None
    assert "listens at tcp/127.0.0.1:" in process.stderr.readline()
    yield process
    process.kill()
    process.wait()
    process.stderr.close()


def run(folder: Path, mission: str) -> "subprocess.CompletedProcess[str]":
    command = [*M2PEM, "run", mission, "--fleet", "fleet.yaml", "--ocu", "none"]
    return subprocess.run(
        [*command, "--journal", "journal.db"],
        cwd=folder,
        text=True,
        capture_output=True,
        check=False,
    )


def test_missions_run_on_a_vehicle_of_a_host_and_one_of_the_executive(
    folder: Path, host: "subprocess.Popen[str]"
) -> None:
    for mission in ("rover1.bpmn", "rover2.bpmn"):
        ran = run(folder, mission)
        assert ran.returncode == 0, ran
        assert "ends goto: succeeded" in ran.stdout
    host.terminate()
    assert host.wait() == 0


def test_an_executive_beside_a_host_may_not_command_the_same_vehicle(
    folder: Path, host: "subprocess.Popen[str]"
) -> None:
    command = [*M2PEM, "arbiter-host", "--fleet", "fleet.yaml", "--state", "state"]
    second = subprocess.run(command, cwd=folder, text=True, capture_output=True, check=False)
    assert second.returncode == 2
    assert f"process {host.pid} commands it already" in second.stderr


def test_without_its_host_a_vehicle_is_not_commanded(folder: Path) -> None:
    ran = run(folder, "rover1.bpmn")
    assert ran.returncode == 1, ran
    assert "host rover1-pi is not reached" in ran.stderr + ran.stdout


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--host", "rover1"), "no vehicle has the host 'rover1'; did you mean 'rover1-pi'?"),
        (("--listen", "tcp/0.0.0.0:7447"), "anyone there could command"),
        (("--listen", "tcp/127.0.0.1:1", "--connect", "tcp/127.0.0.1:2"), "one or the other"),
    ],
)
def test_bad_words_are_refused_with_a_remedy(
    folder: Path, words: tuple[str, ...], message: str
) -> None:
    command = [*M2PEM, "arbiter-host", "--fleet", "fleet.yaml", *words]
    refused = subprocess.run(command, cwd=folder, text=True, capture_output=True, check=False)
    assert refused.returncode == 2
    assert message in refused.stderr


def test_no_vehicle_has_the_link_as_its_arbiter() -> None:
    with pytest.raises(PluginError, match="keep the vehicle's own arbiter"):
        ZenohHosts()({}, None)  # type: ignore[arg-type]  # it is refused before
