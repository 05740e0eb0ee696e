"""An executive's `--ros-args` count for the nodes of its arbiter and of its operators."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from uuid import uuid4

import pytest
from m2pem_plugin_ros.arbiter import RosArbiter
from m2pem_plugin_ros.installation import RosError
from m2pem_plugin_ros.runtime import RosRuntime
from m2pem_plugin_ros.runtime.arguments import process_arguments
from m2pem_plugin_ros.testing import Peer
from ros_sensors import until

from m2pem.api import Connection, ResourceId, SystemClock, VehicleState
from m2pem.testing.contracts.arbiter_harness import ArbiterHarness, context

BASE = Path(__file__).with_name("ros_base_peer.py")
V = ResourceId("ugv1")
VARIABLE = "M2PEM_ROS_ARGS"


async def test_topics_of_a_vehicle_are_remapped(
    ros_domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(VARIABLE, "-r /ugv1/odom:=/evsg1/odom -r /ugv1/cmd_vel:=/evsg1/cmd_vel")
    settings = {"namespace": "/ugv1", "domain_id": ros_domain, "driver": "base"}
    connections = {V: Connection(V, "ground", settings, sitl=True)}
    clock = SystemClock()
    arbiter = RosArbiter(connections, replace(context(clock), journal=uuid4()))
    with Peer(BASE, ros_domain, ["/evsg1", "plain", "1"]):
        async with ArbiterHarness(arbiter, clock) as bench:

            def state() -> VehicleState | None:
                found = bench.latest(V)
                return found if isinstance(found, VehicleState) else None

            await until(lambda: (found := state()) and found.ready, "it is ready")
            async with RosRuntime("looking", domain_id=ros_domain) as ros:
                await until(lambda: ros.node.count_publishers("/evsg1/cmd_vel") == 1, "commands")
                assert ros.node.count_publishers("/ugv1/cmd_vel") == 0


async def test_a_node_is_renamed_and_moved_by_its_name(
    ros_domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(VARIABLE, "-r executive:__ns:=/team_a -r other:__node:=renamed")
    async with RosRuntime("executive", namespace="/m2pem", domain_id=ros_domain) as ros:
        assert ros.node.get_fully_qualified_name() == "/team_a/executive"
        assert ros.make_node("other").get_fully_qualified_name() == "/renamed"
        assert not ros.uses_sim_time
        assert ros.stamp_us(7) == 7


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", []),
        ("  ", []),
        ("-p a:=b", ["--ros-args", "-p", "a:=b"]),
        ("--ros-args -p a:='b c'", ["--ros-args", "-p", "a:=b c"]),
    ],
)
def test_the_variable_is_read_as_a_shell_does(text: str, words: Sequence[str]) -> None:
    assert process_arguments({VARIABLE: text}) == words


def test_a_variable_that_is_no_words_is_refused() -> None:
    with pytest.raises(RosError, match=f"{VARIABLE}=.* cannot be read as words: No closing"):
        process_arguments({VARIABLE: "-p 'a"})


async def test_an_argument_that_is_none_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, "--bogus")
    with pytest.raises(RosError, match="ROS has no argument '--bogus'"):
        RosRuntime("refused")
