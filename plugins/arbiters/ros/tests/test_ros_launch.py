"""The launch files of ros/m2pem: their arguments and those of the programs that they start.

`launch` is in no registry of Python packages: here are stand-ins for the few names of it that the
files use, which say what would be started.
"""

import runpy
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import click
import pytest
from ros_m2pem_command import main  # noqa: F401  # what the installed program runs

from m2pem.cli.group import built_in, cli

PACKAGE = Path(__file__).parents[4] / "ros" / "m2pem"
FILES = sorted(path.name for path in (PACKAGE / "launch").iterdir())
REQUIRED = {
    "executive.launch.py": {"fleet": "f.yaml"},
    "onboard.launch.py": {"vehicle": "evsg1", "origin": "38.1,-77.3,60"},
    "simulators.launch.py": {"fleet": "f.yaml"},
}


class Declared(SimpleNamespace):
    """DeclareLaunchArgument."""

    def __init__(self, name: str, **options: Any) -> None:
        super().__init__(name=name, **options)


class Configuration:
    """LaunchConfiguration."""

    def __init__(self, name: str) -> None:
        self.name = name

    def perform(self, context: Mapping[str, str]) -> str:
        return context[self.name]


@pytest.fixture
def launched(monkeypatch: pytest.MonkeyPatch) -> Callable[..., tuple[list[Declared], Any]]:
    """Return the arguments of a launch file, and the node that it starts with such values."""
    names: dict[str, dict[str, Any]] = {
        "launch": {"LaunchContext": dict, "LaunchDescription": list},
        "launch.actions": {"DeclareLaunchArgument": Declared, "OpaqueFunction": SimpleNamespace},
        "launch.substitutions": {"LaunchConfiguration": Configuration},
        "launch_ros": {},
        "launch_ros.actions": {"Node": SimpleNamespace},
    }
    for name, content in names.items():
        module = ModuleType(name)
        vars(module).update(content)
        monkeypatch.setitem(sys.modules, name, module)

    def launch(file: str, **values: str) -> tuple[list[Declared], Any]:
        described = runpy.run_path(str(PACKAGE / "launch" / file))["generate_launch_description"]()
        *arguments, opaque = described
        usual = {each.name: getattr(each, "default_value", None) for each in arguments}
        (node,) = opaque.function({**usual, **REQUIRED[file], **values})
        return arguments, node

    return launch


def command_of(words: list[str]) -> tuple[click.Command, list[str]]:
    """The command that words name, and the words that are left."""
    first, *rest = words
    if first == "serve":
        return built_in(first), rest
    group = cli.get_command(click.Context(cli), first)
    assert isinstance(group, click.Group)
    lazy = group.commands[rest[0]]
    context = lazy.make_context(rest[0], rest[1:], resilient_parsing=True)
    return context.command, rest[1:]


@pytest.mark.parametrize("file", FILES)
def test_what_is_required_has_no_default_and_each_argument_is_described(
    file: str, launched: Callable[..., tuple[list[Declared], Any]]
) -> None:
    arguments, node = launched(file)
    required = {each.name for each in arguments if not hasattr(each, "default_value")}
    assert required == set(REQUIRED[file])
    assert all(getattr(each, "description", "") or each.choices for each in arguments)
    assert (node.package, node.executable) == ("m2pem", "m2pem")
    assert (PACKAGE / "scripts" / node.executable).stat().st_mode & 0o111


@pytest.mark.parametrize(
    ("file", "values"),
    [
        ("executive.launch.py", {}),
        ("executive.launch.py", {"journal": "j.db", "ocu": "none", "speed": "2"}),
        ("onboard.launch.py", {}),
        (
            "onboard.launch.py",
            {
                "epochs": "e.json",
                "autostart": "false",
                "driver": "nav2",
                "domain": "surface",
                "namespace": "/a",
            },
        ),
        ("simulators.launch.py", {}),
        ("simulators.launch.py", {"fault": "evsg1: silent", "use_sim_time": "true"}),
    ],
)
def test_each_option_that_is_passed_is_one_of_the_program(
    file: str, values: dict[str, str], launched: Callable[..., tuple[list[Declared], Any]]
) -> None:
    _, node = launched(file, **values)
    command, words = command_of(node.arguments)
    options = {name for param in command.params for name in (*param.opts, *param.secondary_opts)}
    given = [word for word in words if word.startswith("--")]
    assert given
    assert set(given) <= options
    for value in values.values():
        if value not in ("true", "false"):
            assert value in node.arguments


def test_choices_are_those_of_the_program(
    launched: Callable[..., tuple[list[Declared], Any]],
) -> None:
    arguments, node = launched("onboard.launch.py")
    command, _ = command_of(node.arguments)
    choices = {param.name: param.type for param in command.params}
    for each in arguments:
        kind = choices.get(each.name)
        if isinstance(kind, click.Choice):
            assert each.choices == list(kind.choices)
            assert each.default_value in each.choices


def test_the_clock_and_the_names_of_nodes(
    launched: Callable[..., tuple[list[Declared], Any]],
) -> None:
    _, node = launched("onboard.launch.py", params_file="p.yaml", use_sim_time="true")
    assert (node.name, node.namespace) == ("m2pem_onboard", "/evsg1")
    assert node.parameters == ["p.yaml", {"use_sim_time": True}]
    for file in ("executive.launch.py", "simulators.launch.py"):
        _, node = launched(file)  # of several nodes, a name would be that of all
        assert not hasattr(node, "name")
        assert not hasattr(node, "namespace")
        assert node.parameters == [{"use_sim_time": False}]
    _, node = launched("simulators.launch.py", use_sim_time="true")
    assert "--speed" not in node.arguments
