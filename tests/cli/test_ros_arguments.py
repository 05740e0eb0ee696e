"""`m2pem ... --ros-args ...`: arguments of ROS are for plugins, not for the command line."""

import click
import pytest

from m2pem.cli.group import run_command_line
from m2pem.cli.ros_arguments import VARIABLE, ros_arguments


def test_they_are_parted_from_the_command_and_given_to_the_process() -> None:
    environment: dict[str, str] = {}
    words = "run a.bpmn --ros-args -r odom:=x --log-level info -- --fleet f.yaml --ros-args -p a:=b"
    with ros_arguments([*words.split(), "c d"], environment) as rest:
        assert rest == ["run", "a.bpmn", "--fleet", "f.yaml"]
        assert environment == {VARIABLE: "-r odom:=x --log-level info -p a:=b 'c d'"}
    assert environment == {}


def test_those_of_the_environment_come_before() -> None:
    environment = {VARIABLE: "-p a:=b"}
    with ros_arguments(["serve", "--ros-args", "-p", "a:=c"], environment):
        assert environment == {VARIABLE: "-p a:=b -p a:=c"}
    assert environment == {VARIABLE: "-p a:=b"}


def test_a_command_line_without_them_stays_as_it_is() -> None:
    environment: dict[str, str] = {}
    with ros_arguments(["check", "a.bpmn", "--", "-b"], environment) as rest:
        assert rest == ["check", "a.bpmn", "--", "-b"]
        assert environment == {}


@pytest.mark.parametrize(
    ("words", "called"),
    [(["check", "a.bpmn"], "`m2pem check`"), (["--debug"], "m2pem without a command")],
)
def test_a_command_without_nodes_refuses_them(words: list[str], called: str) -> None:
    with (
        pytest.raises(click.UsageError, match=f"^{called} has no ROS nodes: leave --ros-args out"),
        ros_arguments([*words, "--ros-args", "-r", "a:=b"]),
    ):
        pass
    assert run_command_line([*words, "--ros-args", "-r", "a:=b"]) == 2
