"""`m2pem arbiter-host` and an executive, as docs/arbiter-host.md shows them: two processes."""

import os
import re
import signal
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


def far(folder: Path) -> None:
    mission = scenarios.one_behavior("goto", "rover1", target="[38.1090, -77.3192]", speed="4 m/s")
    (folder / "far.bpmn").write_bytes(mission)


def begun(folder: Path) -> "subprocess.Popen[str]":
    """An executive whose vehicle moves."""
    command = [*M2PEM, "run", "far.bpmn", "--fleet", "fleet.yaml", "--ocu", "none"]
    process = subprocess.Popen(
        [*command, "--journal", "journal.db"],
        cwd=folder,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        env={**os.environ, "PYTHONUNBUFFERED": "1"},
    )
    assert process.stdout is not None
    for line in process.stdout:
        if "begins goto" in line:
            return process
    raise AssertionError(f"it ended with {process.wait()}")


def test_an_executive_that_was_killed_finds_its_behavior_at_the_host(
    folder: Path, host: "subprocess.Popen[str]"
) -> None:
    far(folder)
    executive = begun(folder)
    executive.kill()
    executive.communicate()
    command = [*M2PEM, "resume", "r1", "--journal", "journal.db", "--ocu", "none"]
    resumed = subprocess.run(command, cwd=folder, text=True, capture_output=True, check=False)
    assert resumed.returncode == 0, resumed
    assert "ends goto: succeeded" in resumed.stdout
    assert "ended goto: lost" not in resumed.stdout


def test_the_operator_is_told_which_host_has_not_confirmed_a_stop(
    folder: Path, host: "subprocess.Popen[str]"
) -> None:
    far(folder)
    executive = begun(folder)
    assert executive.stdout is not None
    host.send_signal(signal.SIGSTOP)
    try:
        stop = [*M2PEM, "stop", "r1", "--journal", "journal.db"]
        subprocess.run(stop, cwd=folder, capture_output=True, check=False)
        told = next((line for line in executive.stdout if "may not have received" in line), "")
    finally:
        host.send_signal(signal.SIGCONT)
    assert "rover1 may not have received the STOP of r1" in told
    assert "on rover1-pi has not taken it within 1 s" in told
    executive.communicate()
    assert executive.returncode == 130
