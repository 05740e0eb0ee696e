"""Arguments of ROS in a command line: from `--ros-args` to `--`, or to the end.

They are for all nodes of the process, which its plugins make (docs/ros.md). The plugins read them
from the environment, as do processes that this one starts.
"""

import os
import shlex
from collections.abc import Iterator, MutableMapping, Sequence
from contextlib import contextmanager

import click

VARIABLE = "M2PEM_ROS_ARGS"
BEGIN, END = "--ros-args", "--"

COMMANDS = ("arbiter-host", "attach", "demo", "gateway", "resume", "ros", "run", "serve", "sim")
"""Those whose processes may have nodes."""


@contextmanager
def ros_arguments(
    words: Sequence[str], environment: MutableMapping[str, str] = os.environ
) -> Iterator[list[str]]:
    """Yield a command line without the arguments of ROS, which are in the environment meanwhile.

    Raises:
        click.UsageError: the command has no nodes.
    """
    rest, found = _parted(words)
    if not found:
        yield rest
        return
    command = next((word for word in rest if not word.startswith("-")), "")
    if command not in COMMANDS:
        called = f"`m2pem {command}`" if command else "m2pem without a command"
        raise click.UsageError(
            f"{called} has no ROS nodes: leave {BEGIN} out. Commands that may have nodes are "
            f"{', '.join(COMMANDS)}"
        )
    before = environment.get(VARIABLE)
    environment[VARIABLE] = " ".join([*([before] if before else []), shlex.join(found)])
    try:
        yield rest
    finally:
        environment.pop(VARIABLE)
        if before is not None:
            environment[VARIABLE] = before


def _parted(words: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the words that are not for ROS, and those that are."""
    rest: list[str] = []
    found: list[str] = []
    is_for_ros = False
    for word in words:
        if word == BEGIN:
            is_for_ros = True
        elif is_for_ros and word == END:
            is_for_ros = False
        else:
            (found if is_for_ros else rest).append(word)
    return rest, found
