"""The command line serves operators over ROS, and the example's operator runs a mission there."""

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import m2pem_plugin_mocu
import pytest
from m2pem_plugin_ros import loopback
from m2pem_plugin_ros.testing import reserved_domain

REPOSITORY = Path(__file__).parents[4]
EXAMPLE = REPOSITORY / "examples" / "t22_operator_over_ros"
WITHIN_S = 40

Operate = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture
def environment(tmp_path: Path) -> Iterator[dict[str, str]]:
    """As where the plugin is installed, also if it is not."""
    installed = tmp_path / "site" / "m2pem_plugin_mocu-0.1.0.dist-info"
    installed.mkdir(parents=True)
    (installed / "METADATA").write_text(
        "Metadata-Version: 2.1\nName: m2pem-plugin-mocu\nVersion: 0.1.0\n"
    )
    (installed / "entry_points.txt").write_text("[m2pem]\nmocu = m2pem_plugin_mocu\n")
    ours = str(Path(m2pem_plugin_mocu.__file__).parents[1])
    ros = str(Path(loopback.__file__).parents[1])
    path = os.pathsep.join([str(installed.parent), str(REPOSITORY), ours, ros])
    home = tmp_path / "home"
    home.mkdir()
    with reserved_domain() as domain:
        yield {
            **os.environ,
            **loopback.environment(domain),
            "PYTHONPATH": path,
            "HOME": str(home),
        }


@pytest.fixture
def served(environment: dict[str, str]) -> Iterator[subprocess.Popen[str]]:
    speed = "--speed 100"  # so that an operator on a busy computer sees what goes on
    words = f"serve --fleet {EXAMPLE / 'fleet.yaml'} --ocu mocu {speed} --journal memory:"
    process = subprocess.Popen(
        [sys.executable, "-m", "m2pem", *words.split()],
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


@pytest.fixture
def operate(environment: dict[str, str]) -> Operate:
    def run(*words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, str(EXAMPLE / "ros_operator.py"), *words],
            env={**environment, "PYTHONPATH": ""},  # it needs nothing of m2pem but its interfaces
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=WITHIN_S,
            check=False,
        )

    return run


def test_an_operator_in_another_process_runs_a_mission(
    served: subprocess.Popen[str], operate: Operate, tmp_path: Path
) -> None:
    mission = str(EXAMPLE / "mission.bpmn")
    route = f"route_alpha={EXAMPLE / 'detour.geojson'}"
    done = operate("--mission", mission, "--set-route", route, "--answer", "SendRoute=continue")
    assert done.returncode == 0, done.stdout
    lines = done.stdout.splitlines()
    for line in (
        "route route_alpha is handed over",
        "started r1",
        "p1 SendRoute asks: Send the route, then continue [continue, abort]",
        "answer to p1: continue: taken",
        "p1 was answered by ros_operator: continue",
        "active: DriveRoute single_vehicle_routing rover",
        "r1 is completed",
    ):
        assert line in lines, done.stdout
    assert any(line.endswith("DRIVE started by ros_operator") for line in lines), done.stdout
    assert any(line.endswith(" s  r1 completed") for line in lines), done.stdout
    assert "were not received" not in done.stdout

    aborted = operate("--url", mission, "--answers", str(EXAMPLE / "answers.yaml"))
    assert (aborted.returncode, "started r2" in aborted.stdout) == (0, True), aborted.stdout
    (tmp_path / "broken.bpmn").write_text("no BPMN")
    refused = operate("--mission", str(tmp_path / "broken.bpmn"))
    assert refused.returncode == 2
    assert "start_mission refused: " in refused.stdout

    served.terminate()
    printed, _ = served.communicate(timeout=WITHIN_S)
    assert served.returncode == 0, printed
    assert "operators: mocu" in printed
    assert "Traceback" not in printed


def test_an_operator_that_is_killed_is_followed_by_another(
    served: subprocess.Popen[str], operate: Operate, environment: dict[str, str]
) -> None:
    mission = str(EXAMPLE / "mission.bpmn")
    first = subprocess.Popen(
        [sys.executable, str(EXAMPLE / "ros_operator.py"), "--mission", mission],
        env={**environment, "PYTHONPATH": ""},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert first.stdout is not None
        assert any(line.startswith("p1 SendRoute asks") for line in first.stdout)
    finally:
        first.kill()
        first.communicate()
    second = operate("--run", "r1", "--answer", "SendRoute=continue", "--by", "bob")
    assert second.returncode == 0, second.stdout
    lines = second.stdout.splitlines()
    for line in ("p1 was answered by bob: continue", "r1 is completed"):
        assert line in lines, second.stdout


def test_without_what_it_needs_the_executive_does_not_start(
    environment: dict[str, str],
) -> None:
    words = f"serve --fleet {EXAMPLE / 'fleet.yaml'} --ocu mocu --journal memory:"
    for variable, says in (
        ({"M2PEM_ROS_NAMESPACE": "9 lives"}, "M2PEM_ROS_NAMESPACE='9 lives' is no namespace"),
        ({"M2PEM_ROS_LOOPBACK": "yes"}, "M2PEM_ROS_LOOPBACK='yes': 1 keeps DDS on 127.0.0.1"),
    ):
        ended = subprocess.run(
            [sys.executable, "-m", "m2pem", *words.split()],
            env={**environment, **variable},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=WITHIN_S,
            check=False,
        )
        assert ended.returncode == 2
        assert says in ended.stdout
        assert "Traceback" not in ended.stdout
