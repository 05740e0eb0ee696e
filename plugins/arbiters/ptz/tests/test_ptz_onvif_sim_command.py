"""`m2pem sim onvif`, and how faults are written."""

import asyncio
import os
import signal
import subprocess
import sys
import urllib.request
from pathlib import Path

import click
import m2pem_plugin_ptz
import pytest
from click.testing import CliRunner
from m2pem_plugin_ptz.hooks import add_commands
from m2pem_plugin_ptz.simulator.onvif.faults import GRAMMAR
from onvif_bench import camera, until, write_credentials

ROOT = Path(m2pem_plugin_ptz.__file__).parents[1]
COMMAND = """
import click
from m2pem_plugin_ptz.hooks import add_commands
cli = click.Group("m2pem")
add_commands(cli.commands)
cli()
"""


def group():
    cli = click.Group("m2pem")
    add_commands(cli.commands)
    return cli


def test_a_camera_is_simulated_until_ctrl_c():
    words = ["sim", "onvif", "--listen", "127.0.0.1:0", "--endless", "--generic"]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), *sys.path])}
    process = subprocess.Popen(
        [sys.executable, "-c", COMMAND, *words], stdout=subprocess.PIPE, text=True, env=environment
    )
    with process:
        try:
            line = process.stdout.readline().split()
            picture = line[1].replace("/onvif/device_service", "/snapshot.jpg")
            direct = urllib.request.build_opener(urllib.request.ProxyHandler({}))
            with direct.open(picture, timeout=40) as answer:
                assert answer.read(3) == b"\xff\xd8\xff"
        finally:
            process.send_signal(signal.SIGINT)
        assert process.wait(40) == 0
    assert line[0] == "camera"
    assert line[1].startswith("http://127.0.0.1:")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--listen", "8081"], "is not HOST:PORT, such as 127.0.0.1:8081"),
        (["--pan", "170,-170"], "it goes up from LOW to HIGH"),
        (["--latency", "soon"], "is not a number with a unit"),
        (["--fault", "melt at 3 s"], "'melt' is no action. Actions: silent; slow 2 s;"),
        (["--credentials", "none.yaml"], "none.yaml: cannot be read"),
    ],
)
def test_a_wrong_option_is_refused_with_what_would_be_right(words, said):
    result = CliRunner().invoke(group(), ["sim", "onvif", *words])
    assert result.exit_code == 2
    assert said in " ".join(result.output.split())


def test_a_password_that_others_may_read_is_not_taken(tmp_path):
    path = write_credentials(tmp_path)
    path.chmod(0o644)
    result = CliRunner().invoke(group(), ["sim", "onvif", "--credentials", str(path)])
    assert result.exit_code == 2
    assert "chmod 600" in result.output


@pytest.mark.parametrize(
    ("words", "at_s", "for_s"),
    [
        ("silent", None, None),
        ("Silent at 10 s for 2.5 s", 10.0, 2.5),
        ("slow 0.4 s at 3s", 3.0, None),
        ("refuse auth for 60 s", None, 60.0),
        ("stuck at 1 s", 1.0, None),
        ('refuse "too hot at 90 s" at 2 s', 2.0, None),
        ("clock +3600 s", None, None),
        ("clock -3600 s", None, None),
        ("reboot at 4 s", 4.0, 5.0),
    ],
)
def test_a_fault_is_read_with_its_times(words, at_s, for_s):
    planned = GRAMMAR.parse(words)
    assert (planned.at_s, planned.for_s) == (at_s, for_s)


async def test_planned_faults_begin_and_end():
    async with camera() as server:
        for words in ('refuse "too hot" for 3 s', "slow 2 s for 3 s", "clock +60 s for 3 s"):
            server.faults.plan(GRAMMAR.parse(words))
        fault_state = server.camera.fault_state
        await until(lambda: (fault_state.fault, fault_state.slow_s) == ("too hot", 2.0))
        assert server.camera.skew_s == 60.0
        await until(lambda: (fault_state.fault, fault_state.slow_s) == ("", 0.0))
        await until(lambda: server.camera.skew_s == 0.0)


async def test_a_camera_that_reboots_comes_back_at_its_address_looking_ahead():
    async with camera() as server:
        server.camera.gimbal.pan.at = 1.0
        port = server.port
        server.faults.plan(GRAMMAR.parse("reboot for 0.2 s"))
        await until(lambda: server.camera.reboots == 1)
        assert server.camera.ptz[0] == 0.0

        async def answers():
            try:
                _, writer = await asyncio.open_connection("127.0.0.1", port)
            except OSError:
                return False
            writer.close()
            return True

        for _ in range(2000):
            if await answers():
                break
            await asyncio.sleep(0.02)
        assert await answers()
