"""The interfaces are built in both ways, and programs of all builds understand each other.

Environments are made from the beginning, so these tests take minutes, and ask for packages.
"""

import asyncio
import os
import subprocess
import sys
import tomllib
from collections.abc import Sequence
from pathlib import Path
from uuid import uuid4

import pytest
from m2pem_interfaces.action import ExecuteBehavior
from m2pem_interfaces.msg import BehaviorCommand, BehaviorStatus, KeyValue
from m2pem_interfaces.srv import AnswerPrompt
from m2pem_plugin_ros import loopback
from m2pem_plugin_ros.runtime import RosRuntime, qos
from m2pem_plugin_ros.testing import Peer
from rclpy.action import ActionClient

ROS = Path(__file__).parents[4] / "ros"
INTERFACES = ROS / "m2pem_interfaces"
ECHO = Path(__file__).with_name("ros_echo_peer.py")
WHEELS = ("ros-jazzy-rclpy", "ros-jazzy-rmw-fastrtps-cpp")
OURS = (
    *("LD_LIBRARY_PATH", "_ROS_WHEELS_BOOTSTRAP_COMPLETE"),
    *("AMENT_PREFIX_PATH", "CMAKE_PREFIX_PATH", "PYTHONPATH"),
)
"""Variables that lead the processes that we start to the ROS of this environment."""

ANSWER_S = 20.0
TWENTY_MINUTES_S = 1200

pytestmark = [pytest.mark.long, pytest.mark.timeout(TWENTY_MINUTES_S)]


def environment(**more: str) -> dict[str, str]:
    """Of a process that is to find its own ROS."""
    return {**{k: v for k, v in os.environ.items() if k not in OURS}, **more}


class Elsewhere(Peer):
    """A peer of another environment."""

    def __init__(self, command: Sequence[str], domain: int, variables: dict[str, str]) -> None:
        self.process = subprocess.Popen(
            [*command, str(ECHO)],
            env={**variables, **loopback.environment(domain)},
            stdout=subprocess.PIPE,
            text=True,
        )


def make_environment(folder: Path, *packages: str) -> Path:
    """A new virtual environment with these packages; returns its Python."""
    subprocess.run([sys.executable, "-m", "venv", str(folder)], check=True)
    python = folder / "bin" / "python"
    pins = str(ROS / "constraints.txt")
    install(python, *packages, constraints=pins)
    return python


def install(python: Path, *packages: str, constraints: str) -> None:
    subprocess.run(
        [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *packages],
        env=environment(PIP_CONSTRAINT=constraints, PIP_BUILD_CONSTRAINT=constraints),
        check=True,
    )


def build_workspace(
    workspace: Path, python: Path, variables: dict[str, str], package: str = "m2pem_interfaces"
) -> None:
    """What docs/ros.md says to do where ROS is, and what the wheels need beside."""
    includes = INTERFACES / "wheel_backend" / "present_includes.cmake"
    options = [
        f"-DCMAKE_PROJECT_m2pem_interfaces_INCLUDE={includes}",
        f"-DPython3_EXECUTABLE={python}",
        "-DBUILD_TESTING=OFF",
    ]
    built = subprocess.run(
        ["colcon", "build", "--packages-select", package, "--cmake-args", *options],
        cwd=workspace,
        env=variables,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    assert built.returncode == 0, built.stdout[-3000:]


def place_of_interfaces(command: Sequence[str], variables: dict[str, str]) -> Path:
    """Where that Python has its interfaces."""
    program = "import m2pem_interfaces; print(m2pem_interfaces.__file__)"
    said = subprocess.run(
        [*command, "-c", program], env=variables, stdout=subprocess.PIPE, text=True, check=True
    )
    return Path(said.stdout.strip())


def check_m2pem(installed: Path, command: Sequence[str], variables: dict[str, str]) -> None:
    """Its program finds its plugins, which are those of the workspace, and has launch files."""

    def said(*words: str) -> str:
        ended = subprocess.run(
            [*command, *words], env=variables, stdout=subprocess.PIPE, text=True, check=True
        )
        return ended.stdout.strip()

    plugins = said(str(installed / "lib" / "m2pem" / "m2pem"), "plugins").splitlines()
    assert {"    arbiter ros", "    ocu mocu"} <= set(plugins)
    place = said("-c", "import m2pem_plugin_ros; print(m2pem_plugin_ros.__file__)")
    assert Path(place).is_relative_to(installed)
    assert (installed / "share" / "m2pem" / "launch" / "onboard.launch.py").is_file()


async def exchange(domain: int) -> None:
    """A message there and back, a service and the action, with the peer in that domain."""
    async with RosRuntime("here", domain_id=domain) as ros:
        heard: asyncio.Queue[BehaviorStatus] = asyncio.Queue()
        ros.subscribe(BehaviorStatus, "behavior_status", heard.put_nowait, qos.COMMANDS)
        commands = ros.node.create_publisher(BehaviorCommand, "command", qos.COMMANDS)
        command = BehaviorCommand(verb=BehaviorCommand.START, id="b1", behavior="goto")
        command.parameters = [KeyValue(key="speed", value="5.0")]
        async with asyncio.timeout(ANSWER_S):
            while heard.empty():  # a message sent before the two know each other reaches nobody
                commands.publish(command)
                await asyncio.sleep(0.05)
        status = heard.get_nowait()
        assert (status.id, status.state) == ("b1", BehaviorStatus.ACCEPTED)
        assert status.native_ref == "speed=5.0"
        assert list(status.outputs) == list(command.parameters)

        client = ros.client(AnswerPrompt, "answer")
        request = AnswerPrompt.Request(prompt="p1", decision="continue")
        assert (await ros.call(client, request, ANSWER_S)).message == "p1: continue"

        actions = ActionClient(ros.node, ExecuteBehavior, "execute_behavior")
        goal = ExecuteBehavior.Goal(command=command)
        feedback: list[int] = []
        handle = await ros.send_goal(
            actions,
            goal,
            ANSWER_S,
            goal_id=uuid4(),
            feedback=lambda said: feedback.append(said.feedback.status.state),
        )
        result = (await ros.wait(handle.get_result_async(), ANSWER_S)).result
        assert (result.status.id, result.status.state) == ("b1", BehaviorStatus.SUCCEEDED)
        assert feedback == [BehaviorStatus.RUNNING]


async def test_without_ros_pip_builds_the_interfaces(tmp_path: Path, ros_domain: int) -> None:
    python = make_environment(tmp_path / "clean", str(INTERFACES), *WHEELS)
    assert place_of_interfaces([str(python)], environment()).is_relative_to(tmp_path)
    with Elsewhere([str(python)], ros_domain, environment()):
        await exchange(ros_domain)


@pytest.mark.tried_with(
    "colcon",
    "builds `ros/m2pem_interfaces` as a workspace",
    kind="ROS 2",
    result="built, and understood by the wheel's programs",
    package="colcon-core",
)
async def test_with_ros_colcon_builds_the_interfaces(tmp_path: Path, ros_domain: int) -> None:
    """The wheels are the ROS that is there; their build tools are what ROS brings along itself."""
    tools = tomllib.loads((INTERFACES / "pyproject.toml").read_text(encoding="utf-8"))
    requires = tools["build-system"]["requires"]
    ours = tomllib.loads((ROS.parent / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    needed = (*WHEELS, "ros-jazzy-common-interfaces", *requires, *ours["dependencies"])
    underlay = tmp_path / "underlay"
    python = make_environment(underlay, "-r", str(ROS / "colcon.txt"), *needed)
    sourced = environment(
        AMENT_PREFIX_PATH=str(underlay),
        CMAKE_PREFIX_PATH=str(underlay),
        PATH=f"{underlay / 'bin'}{os.pathsep}{os.environ['PATH']}",
    )
    workspace = tmp_path / "workspace"
    workspace.mkdir()
    (workspace / "src").symlink_to(ROS)
    build_workspace(workspace, python, sourced)

    setup = workspace / "install" / "setup.bash"
    command = ["bash", "-c", f'. "{setup}"; exec "{python}" "$@"', "bash"]
    assert place_of_interfaces(command, sourced).is_relative_to(workspace / "install")
    with Elsewhere(command, ros_domain, sourced):
        await exchange(ros_domain)

    build_workspace(workspace, python, sourced, "m2pem")
    check_m2pem(workspace / "install" / "m2pem", command, sourced)
