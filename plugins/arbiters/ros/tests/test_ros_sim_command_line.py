"""`m2pem sim ros` as a program: what it says, what it refuses, and how it ends."""

import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import pytest
from click.testing import CliRunner
from m2pem_plugin_ros import loopback
from m2pem_plugin_ros.hooks import add_commands
from ros_sim_command import cli
from ros_sim_watch import COMMAND

BASE = ("sim", "ros", "--driver", "base")


@contextmanager
def program(words: Sequence[str], domain: int) -> Iterator[subprocess.Popen[str]]:
    """It, until the block ends; without the variables that would keep it on loopback anyway."""
    environment = {k: v for k, v in os.environ.items() if k not in loopback.environment()}
    process = subprocess.Popen(
        [sys.executable, str(COMMAND), *words, "--domain-id", str(domain)],
        env=environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def lines_until(process: subprocess.Popen[str], last: str) -> list[str]:
    assert process.stdout is not None
    lines: list[str] = []
    for line in process.stdout:
        lines.append(line.strip())
        if lines[-1] == last:
            return lines
    raise AssertionError(f"it ended before it said {last!r}: {lines}")


def test_each_vehicle_is_named_and_then_all_are_ready(ros_domain: int) -> None:
    words = [*BASE, "--ground", "2", "--surface", "1", "--home", "38.1,-77.3,5"]
    with program(words, ros_domain) as process:
        lines = lines_until(process, "ready")
    assert lines[0] == "ugv1: /ugv1, plain base, at 38.100000,-77.300000"
    assert [line.split(" at ")[0] for line in lines[1:]] == [
        "ugv2: /ugv2, plain base,",
        "usv1: /usv1, plain base,",
        "ready",
    ]


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_the_simulator_ends_cleanly_by_a_signal(number: int, ros_domain: int) -> None:
    with program(BASE, ros_domain) as process:
        lines_until(process, "ready")
        process.send_signal(number)
        _, errors = process.communicate(timeout=60)
        assert (process.returncode, errors) == (0, "")


def test_lines_of_its_input_are_faults(ros_domain: int) -> None:
    with program(BASE, ros_domain) as process:
        lines_until(process, "ready")
        assert process.stdin is not None and process.stderr is not None
        process.stdin.write("ugv1: sulk\nugv1: silent for 2 s\n")
        process.stdin.close()
        assert "'sulk' is no action" in process.stderr.readline()
        assert lines_until(process, "fault: ugv1: silent for 2 s")
        assert process.poll() is None  # it goes on when its input ends
        process.stdin = None


def addresses_of(pid: int) -> set[str]:
    """The local addresses of all UDP and TCP sockets of a process that have a port."""
    owned = set()
    for descriptor in Path(f"/proc/{pid}/fd").iterdir():
        if found := re.fullmatch(r"socket:\[(\d+)\]", str(descriptor.readlink())):
            owned.add(found[1])
    addresses = set()
    for table in ("udp", "tcp", "udp6", "tcp6"):
        for line in Path(f"/proc/{pid}/net/{table}").read_text(encoding="ascii").splitlines()[1:]:
            fields = line.split()
            address, _, port = fields[1].partition(":")
            if fields[9] in owned and int(port, 16):
                addresses.add(address)
    return addresses


def test_the_simulator_keeps_to_this_machine_whatever_the_environment_says(ros_domain: int) -> None:
    with program(BASE, ros_domain) as process:
        lines_until(process, "ready")
        listening = addresses_of(process.pid)
    multicast = {each for each in listening if each.endswith(("EF", "E0"))}
    assert listening - multicast == {"0100007F"}  # 127.0.0.1


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--ground", "0"], "no vehicles: say how many"),
        (["--ground", "many"], "--ground"),
        (["--driver", "ros1"], "'ros1' is not one of 'm2pem', 'nav2', 'base'"),
        (["--speed", "0"], "--speed"),
        (["--domain-id", "500"], "--domain-id"),
        (["--home", "zurich"], "is not LAT,LON,ALT"),
        (["--home", "95,8"], "is not on Earth"),
        (["--target", "38,-77"], "is not TYPE@LAT,LON"),
        (["--set", "fast"], "is not KEY=VALUE"),
        (["--set", "max_sped=3"], "did you mean 'max_speed'?"),
        (["--set", "home=[38, -77]"], "say --home"),
        (["--fault", "ugv1: sulk"], "'sulk' is no action"),
        (["--fault", "ugv9: silent"], "there is no vehicle ugv9; there are: ugv1"),
        (["--driver", "base", "--fault", "lie"], "ugv1 is a plain base"),
        (["--fleet", "/no/such.yaml"], "'/no/such.yaml' does not exist"),
    ],
)
def test_words_that_make_no_sense_are_refused(words: list[str], said: str) -> None:
    result = CliRunner().invoke(cli, ["sim", "ros", *words])
    assert result.exit_code == 2
    assert said in result.output


def test_a_fleet_and_made_up_vehicles_do_not_mix(tmp_path: Path) -> None:
    fleet = tmp_path / "fleet.yaml"
    fleet.write_text("version: 1\n")
    result = CliRunner().invoke(cli, ["sim", "ros", "--fleet", str(fleet), "--ground", "1"])
    assert result.exit_code == 2
    assert "--fleet says which vehicles there are" in result.output


def test_groups_of_other_plugins_are_kept() -> None:
    import click

    theirs = click.Group("sim")
    theirs.add_command(click.Command("mavlink"))
    commands: dict[str, click.Command] = {"sim": theirs}
    add_commands(commands)
    assert commands["sim"] is theirs
    assert sorted(theirs.commands) == ["mavlink", "ros"]
    assert isinstance(commands["ros"], click.Group)
    assert sorted(commands["ros"].commands) == ["onboard"]


def test_the_list_of_commands_loads_none_of_them() -> None:
    program = (
        "import sys; from ros_sim_command import cli\n"
        "cli(['sim', '--help'], standalone_mode=False)\n"
        "heavy = ('rclpy', 'numpy', 'm2pem_plugin_ros.simulator')\n"
        "print(*(name for name in heavy if name in sys.modules))"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(COMMAND.parent), *sys.path])}
    done = subprocess.run(
        [sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=True
    )
    assert "Simulate ROS vehicles on 127.0.0.1." in done.stdout
    assert done.stdout.splitlines()[-1] == ""
