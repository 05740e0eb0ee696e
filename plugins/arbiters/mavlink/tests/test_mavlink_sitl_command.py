"""`m2pem sitl` with programs that stand in for ArduPilot's: real processes over real UDP."""

import os
import re
import select
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import pytest
from mavlink_sitl import free_port, until_ready
from mavlink_standin import write_standin

WITHIN_S = 60
FLEET = """
version: 1
origin: {{lat: 38.1, lon: -77.3, alt: 60.0}}
vehicles:
  uav1: {{domain: air, arbiter: mavlink, sitl: true, connection: {{url: "udpin://127.0.0.1:{port}", system_id: 1}}}}
  rover1: {{domain: ground, arbiter: mavlink, sitl: true, connection: {{url: "udpin://127.0.0.1:{port}", system_id: 2}}}}
"""  # noqa: E501


@pytest.fixture
def port() -> int:
    return free_port()


@pytest.fixture
def fleet(tmp_path: Path, port: int) -> Path:
    file = tmp_path / "fleet.yaml"
    file.write_text(FLEET.format(port=port), encoding="utf-8")
    return file


@pytest.fixture
def programs(tmp_path: Path) -> Path:
    folder = tmp_path / "bin"
    for name in ("arducopter", "ardurover"):
        write_standin(folder / name)
    return folder


Sitl = Callable[..., subprocess.Popen[str]]


@pytest.fixture
def sitl(fleet: Path, programs: Path) -> Iterator[Sitl]:
    with ExitStack() as started:
        yield lambda *words: started.enter_context(_sitl(fleet, programs, *words))


@contextmanager
def _sitl(fleet: Path, programs: Path, *words: object) -> Iterator[subprocess.Popen[str]]:
    line = ("sitl", "--ardupilot", programs, "--fleet", fleet, "--speed", 10, *words)
    process = subprocess.Popen(
        [sys.executable, "-m", "m2pem", *map(str, line)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def pids(lines: list[str]) -> list[int]:
    return [int(match[1]) for line in lines if (match := re.search(r", pid (\d+)$", line))]


def runs(pid: int) -> bool:
    """Whether there is such a process; one that has ended and is not yet waited for does not."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"


def any_runs_in(folder: Path) -> bool:
    """Whether a process has `folder` as its own."""
    for process in Path("/proc").glob("[0-9]*/cwd"):
        with suppress(OSError):
            if process.readlink() == folder:
                return True
    return False


@pytest.mark.parametrize(
    "number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.long)]
)
def test_vehicles_are_named_ready_and_ended_with_the_command(
    sitl: Sitl, port: int, tmp_path: Path, number: signal.Signals
) -> None:
    process = sitl("--keep", tmp_path / "kept")
    lines = until_ready(process)
    url = f"udpin://127.0.0.1:{port}"
    assert [line.rpartition(", pid ")[0] for line in lines[:-1]] == [
        f"uav1: ArduPilot quad, system 1, to {url}, at 38.100000,-77.300000",
        f"rover1: ArduPilot rover, system 2, to {url}, at 38.100000,-77.299943",
    ]
    started = pids(lines)
    assert all(map(runs, started))
    assert hears_at(port, {1, 2}), "the port is the executive's when the vehicles are ready"
    process.send_signal(number)
    assert process.wait(WITHIN_S) == 0
    assert not any(map(runs, started))
    assert "model quad" in (tmp_path / "kept/uav1/output").read_text(encoding="utf-8")


def hears_at(port: int, systems: set[int]) -> bool:
    """Whether an executive hears these systems, and no others, at the port."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as executive:
        executive.bind(("127.0.0.1", port))
        executive.settimeout(WITHIN_S)
        heard: set[int] = set()
        while not heard >= systems:
            heard.add(executive.recv(300)[5])  # a MAVLink 2 frame's system id
    return heard == systems


def test_an_autopilot_that_dies_is_named_and_ends_the_others(sitl: Sitl) -> None:
    process = sitl()
    uav1, rover1 = pids(until_ready(process))
    os.kill(rover1, signal.SIGKILL)
    _, errors = process.communicate(timeout=WITHIN_S)
    assert process.returncode == 1
    assert f"rover1 (pid {rover1}) has ended by SIGKILL; it printed last:\n" in errors
    assert "model rover" in errors
    assert not runs(uav1)


def test_an_autopilot_that_dies_at_its_start_says_why(sitl: Sitl, programs: Path) -> None:
    write_standin(programs / "ardurover", "DIES 99\n")
    output, errors = sitl().communicate(timeout=WITHIN_S)
    assert "ready" not in output
    assert "has ended with status 1; it printed last:" in errors
    assert "PANIC: no such board 99" in errors
    assert not any(map(runs, pids(output.splitlines())))


def test_a_program_that_cannot_be_started_leaves_none_running(
    sitl: Sitl, programs: Path, tmp_path: Path
) -> None:
    (programs / "ardurover").chmod(0o644)
    process = sitl("--keep", tmp_path / "kept")
    _, errors = process.communicate(timeout=WITHIN_S)
    assert process.returncode == 1
    assert re.search(r"cannot start a program: .*Permission denied.*ardurover", errors)
    assert (tmp_path / "kept/uav1").is_dir()
    assert not any_runs_in(tmp_path / "kept/uav1")


@pytest.mark.long
def test_what_is_waited_for_is_said(sitl: Sitl, programs: Path) -> None:
    write_standin(programs / "arducopter", "EKF_READY_S 100000\n")
    process = sitl()
    assert process.stdout is not None
    assert process.stderr is not None
    _, rover1 = pids([process.stdout.readline().rstrip(), process.stdout.readline().rstrip()])
    said = next(line for line in process.stderr if "EKF" in line and "rover1" not in line)
    assert re.match(r"waiting for uav1: .*EKF: no position yet, \d+ s", said)
    os.kill(rover1, signal.SIGSTOP)  # a program that hangs is not ready any more
    assert any("rover1: silent for" in line for line in process.stderr)
    process.terminate()
    assert process.wait(WITHIN_S) == 0
    assert not runs(rover1)


def test_vehicles_do_not_outlive_a_command_that_is_killed(sitl: Sitl, tmp_path: Path) -> None:
    process = sitl("--keep", tmp_path / "kept")  # else its own folder would be left behind
    with ExitStack() as opened:
        ends = [os.pidfd_open(pid) for pid in pids(until_ready(process))]
        for end in ends:
            opened.callback(os.close, end)
        process.kill()
        for end in ends:
            assert select.select([end], [], [], WITHIN_S)[0]


def test_a_port_that_is_taken_is_said_before_anything_is_started(
    sitl: Sitl, port: int, tmp_path: Path
) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as executive:
        executive.bind(("127.0.0.1", port))
        process = sitl("--keep", tmp_path / "kept")
        output, errors = process.communicate(timeout=WITHIN_S)
    assert (process.returncode, output) == (1, "")
    assert f"uav1: connection.url: udpin://127.0.0.1:{port}: another program has this" in errors
    assert "an executive is started after `m2pem sitl` has printed ready" in errors
    assert not (tmp_path / "kept").exists()


def test_a_folder_of_an_earlier_start_is_not_written_over(sitl: Sitl, tmp_path: Path) -> None:
    (tmp_path / "kept/rover1").mkdir(parents=True)
    process = sitl("--keep", tmp_path / "kept")
    _, errors = process.communicate(timeout=WITHIN_S)
    assert process.returncode == 2
    assert "it has a folder rover1 of an earlier start; name a new one" in errors


def test_a_fleet_without_software_in_the_loop_is_refused(sitl: Sitl, fleet: Path) -> None:
    text = fleet.read_text(encoding="utf-8").replace("sitl: true, ", "")
    fleet.write_text(text, encoding="utf-8")
    process = sitl()
    _, errors = process.communicate(timeout=WITHIN_S)
    assert process.returncode == 2
    assert "no vehicle has `arbiter: mavlink` and `sitl: true`" in errors
