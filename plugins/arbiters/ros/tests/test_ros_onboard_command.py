"""`m2pem ros onboard`: a plain base becomes a vehicle with an m2pem node."""

import signal
from importlib.util import find_spec
from pathlib import Path

import pytest
from click.testing import CliRunner
from m2pem_plugin_ros.onboard.command_line import onboard
from m2pem_plugin_ros.testing import Peer
from ros_node_bench import CANCELLED, SUCCEEDED, bench

from m2pem.api import Point, Route

HERE = Path(__file__).parent
ORIGIN = ["--origin", "38.0,-77.0,60"]
NEAR = Point((38.00002, -77.0, None))
FAR = Route(((38.00003, -77.0, None), (38.01, -77.0, None)))

needs_base = pytest.mark.skipif(
    find_spec("m2pem_plugin_ros.drivers.base") is None, reason="no driver of plain bases is there"
)


@needs_base
async def test_a_plain_base_does_behaviors_and_stands_when_the_node_ends(ros_domain: int) -> None:
    command = ["--vehicle", "evsg1", *ORIGIN, "--loopback", "--set", "bounds.acceleration=4"]
    with (
        Peer(HERE / "ros_base_peer.py", ros_domain, ["/evsg1", "plain", "1"]),
        Peer(HERE / "ros_onboard_command.py", ros_domain, command) as node,
    ):
        async with bench(ros_domain, "evsg1") as one:
            await one.until(lambda: one.driver.health.ready)
            assert (await one.end_of(one.begin("goto", target=NEAR))).state is SUCCEEDED
            order = one.begin("single_vehicle_routing", route=FAR)
            await one.running(order)
            node.process.send_signal(signal.SIGTERM)
            end = await one.end_of(order)
            assert (end.state, end.reason) == (CANCELLED, "the node on the vehicle was stopped")


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        ([], "Missing option '--vehicle'"),
        (["--vehicle", "evsg1"], "Missing option '--origin'"),
        (["--vehicle", "evsg1", "--origin", "here"], "'here' is not LAT,LON,ALT"),
        (["--vehicle", "evsg1", "--origin", "98,0"], "'98,0' is not on Earth"),
        (["--vehicle", "evsg1", *ORIGIN, "--set", "bounds"], "'bounds' is not KEY=VALUE"),
        (["--vehicle", "evsg1", *ORIGIN, "--set", "a.b.c=1"], "'a.b.c=1' is not KEY=VALUE"),
        (
            ["--vehicle", "evsg1", *ORIGIN, "--set", "namespace.x=1"],
            "--set namespace.x: 'namespace' has a value of its own",
        ),
        (["--vehicle", "evsg1", *ORIGIN, "--driver", "m2pem"], "'m2pem' is not one of"),
    ],
)
def test_what_cannot_be_is_refused(words: list[str], problem: str) -> None:
    ended = CliRunner().invoke(onboard, words)
    assert ended.exit_code == 2
    assert problem in ended.output


@needs_base
@pytest.mark.parametrize(
    ("said", "problem"),
    [
        ("bounds.sped=1", "evsg1: connection.bounds.sped: there is no such setting"),
        ("stamped=yes", "evsg1: connection.stamped: 'yes' is neither true nor false"),
        ("driver=m2pem", "this is the m2pem node; its driver must be base or nav2"),
    ],
)
def test_settings_that_are_none_are_refused(said: str, problem: str) -> None:
    ended = CliRunner().invoke(onboard, ["--vehicle", "evsg1", *ORIGIN, "--set", said])
    assert ended.exit_code == 2
    assert problem in ended.output
