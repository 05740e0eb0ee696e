import os
import signal
import subprocess
import sys
from pathlib import Path

import click
import m2pem_plugin_mavlink
import pytest
from click.testing import CliRunner
from mavlink_ground import Ground

ROOT = Path(m2pem_plugin_mavlink.__file__).parents[1]
COMMAND = """
import click, m2pem_plugin_mavlink
cli = click.Group("m2pem")
m2pem_plugin_mavlink.m2pem_register_commands(cli)
cli()
"""


def group() -> click.Group:
    cli = click.Group("m2pem")
    m2pem_plugin_mavlink.m2pem_register_commands(cli)
    return cli


def boat_has_gimbal(ground: Ground) -> bool:
    ground.link.mav.command_long_send(3, 1, 512, 0, 280, 0, 0, 0, 0, 0, 0)
    told = ground.wait("GIMBAL_MANAGER_INFORMATION", that=lambda m: m.get_srcSystem() == 3)
    return bool(told.gimbal_device_id)


def test_vehicles_are_named_and_simulated_until_they_are_ended() -> None:
    ground = Ground("udpin:127.0.0.1:0")
    words = ["sim", "mavlink", "--copters", "2", "--boats", "1", "--speed", "10", "--gimbal"]
    words += ["--to", f"udp://127.0.0.1:{ground.port}", "--home", "60.1,24.9,5", "--ekf", "500ms"]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), *sys.path])}
    process = subprocess.Popen(
        [sys.executable, "-c", COMMAND, *words], stdout=subprocess.PIPE, text=True, env=environment
    )
    assert process.stdout is not None
    with process:
        try:
            ground.wait("HEARTBEAT", that=lambda m: m.get_srcSystem() == 3 and m.type == 11)
            home = ground.wait("HOME_POSITION", that=lambda m: m.get_srcSystem() == 1)
            assert (home.latitude, home.longitude, home.altitude) == (601000000, 249000000, 5000)
            # Only copters would have one without being told to.
            assert boat_has_gimbal(ground)
            lines = [process.stdout.readline().split() for _ in range(3)]
        finally:
            process.send_signal(signal.SIGTERM)
        assert process.wait(10) == 0
    ground.close()
    assert [line[:3] for line in lines] == [
        ["system", "1", "copter"],
        ["system", "2", "copter"],
        ["system", "3", "boat"],
    ]
    assert all(line[3].startswith("udp://127.0.0.1:") for line in lines)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--copters", "0"], "no vehicles"),
        (["--copters", "251"], "too many vehicles"),
        (["--to", "127.0.0.1:14550"], "is not a UDP address such as udp://127.0.0.1:14550"),
        (["--to", "udp://127.0.0.1:x"], "is not a UDP address"),
        (["--home", "zurich"], "is not LAT,LON,ALT"),
        (["--home", "95,8,0"], "is not on Earth"),
        (["--home", "47,nan,0"], "is not on Earth"),
        (["--ekf", "soon"], "is not a number with a unit"),
        (["--speed", "0"], "--speed"),
    ],
)
def test_words_that_make_no_sense_are_refused(words: list[str], said: str) -> None:
    result = CliRunner().invoke(group(), ["sim", "mavlink", *words])
    assert result.exit_code == 2
    assert said in result.output


def test_a_group_of_simulators_that_is_there_already_is_kept() -> None:
    cli = click.Group("m2pem")
    theirs = click.Group("sim")
    theirs.add_command(click.Command("ros"))
    cli.add_command(theirs)
    m2pem_plugin_mavlink.m2pem_register_commands(cli)
    assert cli.commands["sim"] is theirs
    assert sorted(theirs.commands) == ["mavlink", "ros"]
