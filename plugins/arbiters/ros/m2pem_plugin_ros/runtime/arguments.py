"""The arguments of ROS for all nodes of this process (docs/ros.md)."""

import os
import shlex
from collections.abc import Mapping, Sequence

from m2pem_plugin_ros.installation import RosError

VARIABLE = "M2PEM_ROS_ARGS"
"""What `m2pem ... --ros-args` got, without that word."""

BEGIN = "--ros-args"


def process_arguments(environment: Mapping[str, str] = os.environ) -> Sequence[str]:
    """Return the arguments of the process for rclpy; none if there are none.

    Raises:
        RosError: the text of the variable cannot be parted into words.
    """
    text = environment.get(VARIABLE, "")
    try:
        words = [word for word in shlex.split(text) if word != BEGIN]
    except ValueError as error:
        raise RosError(f"{VARIABLE}={text!r} cannot be read as words: {error}") from error
    return [BEGIN, *words] if words else []


def refused(error: Exception) -> str:
    """Return what is wrong with arguments that rclpy refused, without the places in its source."""
    text = str(error).partition(", at /")[0]
    if type(error).__name__ == "UnknownROSArgsError":
        return f"ROS has no argument {text.strip('[]')}; it has -r, -p, --params-file, --log-level"
    return text.removeprefix("failed to initialize rcl: ")
