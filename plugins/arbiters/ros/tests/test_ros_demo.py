"""`m2pem demo ros` and `m2pem demo team`: simulated vehicles, an executive and an operator, over
real DDS and UDP."""

import os
import re
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from m2pem_plugin_ros.testing import reserved_domain
from ros_e2e_programs import SOURCES, until

REPOSITORY = Path(__file__).parents[4]
FLEETS = REPOSITORY / "fleet_configs"
ENDED_WITHIN_S = 170.0
SITL_WITHIN_S = 400.0
"""A real autopilot takes 41 s to know where it is, and lands slowly."""

POINTING_DEG = 3.0
"""What is asked of the camera here, where other tests have the processor, too."""


class Demo:
    """`m2pem demo` in a process group of its own, as a terminal has it."""

    def __init__(self, name: str, domain: int, folder: Path, *options: str) -> None:
        sources = os.pathsep.join(map(str, SOURCES))
        self.process = subprocess.Popen(
            [*(sys.executable, "-m", "m2pem", "demo", name, "--domain", str(domain)), *options],
            cwd=REPOSITORY,
            env={**os.environ, "PYTHONPATH": sources, "HOME": str(folder)},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )
        self.lines: list[str] = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.lines.append(line.rstrip("\n"))

    def until(self, line: str) -> None:
        until(lambda: line in self.lines, lambda: self.lines[-20:], ENDED_WITHIN_S)

    def rest(self, within_s: float = ENDED_WITHIN_S) -> int:
        """Its exit status, when all that it has started has ended, too."""
        status = self.process.wait(within_s)
        self._reader.join(ENDED_WITHIN_S)
        until(lambda: not self.members(), self.members)  # who has closed its output ends soon
        return status

    def members(self) -> list[int]:
        """The processes of its group that are there."""
        found = []
        for stat in Path("/proc").glob("[0-9]*/stat"):
            try:
                _, _, fields = stat.read_text(encoding="utf-8", errors="replace").rpartition(")")
            except OSError:  # it has ended meanwhile
                continue
            state, _, group = fields.split()[:3]
            if int(group) == self.process.pid and state != "Z":
                found.append(int(stat.parent.name))
        return found

    def end(self) -> None:
        for pid in self.members():
            os.kill(pid, signal.SIGKILL)
        self.process.wait()


@pytest.fixture
def domain() -> Iterator[int]:
    with reserved_domain() as domain:
        yield domain


@pytest.mark.long
@pytest.mark.timeout(200)
def test_a_hazard_is_found_and_the_second_time_the_route_is_driven_to_its_end(
    domain: int, tmp_path: Path
) -> None:
    demo = Demo("ros", domain, tmp_path, "--only", "vehicle")
    try:
        assert demo.rest() == 0, demo.lines[-20:]
    finally:
        demo.end()
    first = demo.lines.index("started r1")
    second = demo.lines.index("started r2")
    assert "active: Reverse reverse evsg1" in demo.lines[first:second]
    assert "p2 was answered by ros_operator: abort" in demo.lines[first:second]
    assert "r1 is terminated: terminated by mission ended" in demo.lines
    assert not any("Reverse" in line for line in demo.lines[second:])
    assert "r2 is terminated: terminated by mission ended" in demo.lines[second:]
    assert not any(re.search("WARNING|Traceback|refused", line) for line in demo.lines)


@pytest.mark.timeout(200)
def test_ctrl_c_ends_all_that_was_started(domain: int, tmp_path: Path) -> None:
    demo = Demo("ros", domain, tmp_path, "--only", "vehicle")
    try:
        demo.until("r1 is running")
        os.killpg(demo.process.pid, signal.SIGINT)
        assert demo.rest() != 0
    finally:
        demo.end()


@pytest.mark.long
def test_a_team_sweeps_a_road_and_crosses_a_bridge(domain: int, tmp_path: Path) -> None:
    demo = Demo("ros", domain, tmp_path, "--only", "team")
    try:
        assert demo.rest() == 0, demo.lines[-20:]
    finally:
        demo.end()
    assert "r1 is completed" in demo.lines


@pytest.fixture
def team(tmp_path: Path) -> Iterator[list[str]]:
    """Options: a fleet whose autopilot sends to a port of its own."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
    for folder in ("geo", "routes"):
        (tmp_path / folder).symlink_to(FLEETS / folder)
    fleet = tmp_path / "fleet.yaml"
    text = (FLEETS / "mehds_mixed.yaml").read_text(encoding="utf-8")
    assert text.count(":14550") == 1
    fleet.write_text(text.replace(":14550", f":{port}"), encoding="utf-8")
    yield [f"--fleet={fleet}", f"--port={port}", f"--pointing-deg={POINTING_DEG}"]


@pytest.mark.long
@pytest.mark.timeout(200)
def test_a_column_marches_with_its_camera_on_the_target_and_drives_round_a_mine(
    domain: int, tmp_path: Path, team: list[str]
) -> None:
    demo = Demo("team", domain, tmp_path, *team)
    try:
        assert demo.rest() == 0, demo.lines[-20:]
    finally:
        demo.end()
    assert "the run completed; EndBypassed reached" in demo.lines
    measured = [line.split()[1] for line in demo.lines if line.startswith("spacing ")]
    assert measured == ["RoadFollowing:", "DriveRound:"]
    (total,) = [line for line in demo.lines if line.startswith("pointing from the moving")]
    found = re.search(r"at most ([\d.]+) deg \((\d+) times\)", total)
    assert found is not None
    assert float(found[1]) < POINTING_DEG
    assert int(found[2]) > 500


@pytest.mark.sitl("M2PEM_ARDUCOPTER")
@pytest.mark.timeout(SITL_WITHIN_S + 30)
def test_a_column_of_ros_vehicles_marches_with_a_real_copter_behind_it(
    domain: int, tmp_path: Path, team: list[str]
) -> None:
    (tmp_path / "programs").mkdir()
    (tmp_path / "programs/arducopter").symlink_to(Path(os.environ["M2PEM_ARDUCOPTER"]).absolute())
    demo = Demo("team", domain, tmp_path, *team, f"--ardupilot={tmp_path / 'programs'}")
    try:
        assert demo.rest(SITL_WITHIN_S) == 0, demo.lines[-20:]
    finally:
        demo.end()
    assert "the run completed; EndBypassed reached" in demo.lines
    assert any(line.startswith("uav1: ArduPilot quad") for line in demo.lines)


@pytest.mark.long
@pytest.mark.timeout(200)
def test_a_demo_that_ends_elsewhere_has_failed(
    domain: int, tmp_path: Path, team: list[str]
) -> None:
    answers = tmp_path / "answers.yaml"
    answers.write_text("answers: {UserMoveOut: [abort]}", encoding="utf-8")
    demo = Demo("team", domain, tmp_path, *team, f"--answers={answers}")
    try:
        assert demo.rest() != 0
    finally:
        demo.end()
    assert "the run completed; EndBypassed not reached" in demo.lines


@pytest.mark.long
def test_ctrl_c_ends_the_whole_team(domain: int, tmp_path: Path, team: list[str]) -> None:
    demo = Demo("team", domain, tmp_path, *team)
    try:
        demo.until("r1 is running")
        os.killpg(demo.process.pid, signal.SIGINT)
        assert demo.rest() != 0
    finally:
        demo.end()
    assert not [line for line in demo.lines if re.search("Traceback|not a child", line)]


def free_port() -> int:
    with socket.socket(type=socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@pytest.mark.timeout(200)
def test_a_mixed_fleet_is_seen_and_commanded_from_both_sides(domain: int, tmp_path: Path) -> None:
    ports = ("--vehicles-port", str(free_port()), "--port", str(free_port()))
    demo = Demo("gateway", domain, tmp_path, *ports)
    try:
        assert demo.rest() == 0, demo.lines[-20:]
    finally:
        demo.end()
    seen = [line.split(":")[1].strip() for line in demo.lines if line.startswith("ROS: ")]
    assert seen[:4] == ["rover1", "rover2", "copter1", "copter2"]
    assert "ROS: copter1: goto succeeded" in demo.lines
    systems = [line.split()[2] for line in demo.lines if line.startswith("MAVLink: system")]
    assert systems == 2 * ["1:", "2:", "11:", "12:"]
    assert any(line.startswith("MAVLink: refused: rover1: DO_REPOSITION") for line in demo.lines)
    assert "MAVLink: the rover is there, and holds" in demo.lines
    asked = [line.split(" started by ")[1] for line in demo.lines if " started by " in line]
    assert [who.split()[0] for who in asked] == ["ros", "ros", "mavlink"]
