"""Keeps DDS on this machine: for simulated vehicles, demos and tests.

`python -m m2pem_plugin_ros.loopback [DOMAIN]` prints shell commands to evaluate.

By default, DDS looks for peers on every network. The profile restricts it to the interface
127.0.0.1, where peers find each other by multicast. The discovery range LOCALHOST of ROS is not
enough: with it, DDS opens sockets on all interfaces.
"""

import os
import shlex
import sys
from collections.abc import Mapping
from pathlib import Path

from m2pem_plugin_ros.installation import RosError

LOOPBACK = "M2PEM_ROS_LOOPBACK"
"""1: DDS stays on 127.0.0.1. 0: it does not. Otherwise it does where nothing real moves."""

PROFILE = Path(__file__).with_name("loopback.xml")


def environment(domain_id: int | None = None) -> Mapping[str, str]:
    """Return the environment variables that keep a ROS process on 127.0.0.1.

    `domain_id` is the ROS domain, 0 to 101; None leaves it to the process.
    """
    variables = {
        "RMW_IMPLEMENTATION": "rmw_fastrtps_cpp",
        "FASTRTPS_DEFAULT_PROFILES_FILE": str(PROFILE),
        "FASTDDS_DEFAULT_PROFILES_FILE": str(PROFILE),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "SYSTEM_DEFAULT",  # as the profile says
        "ROS_LOCALHOST_ONLY": "",
        "ROS_STATIC_PEERS": "",
    }
    if domain_id is not None:
        variables["ROS_DOMAIN_ID"] = str(domain_id)
    return variables


def keep_on_loopback() -> None:
    """Keep this process, and those that it starts, on 127.0.0.1. It may be called again.

    Raises:
        RosError: rclpy was imported before, and may use other networks already.
    """
    if is_kept():
        return
    if "rclpy" in sys.modules:
        raise RosError(
            "DDS can be kept on 127.0.0.1 only before rclpy is imported, which it is already"
        )
    os.environ.update(environment())


def is_kept() -> bool:
    """Whether this process is kept on 127.0.0.1."""
    return all(os.environ.get(name) == value for name, value in environment().items())


def stays_on_loopback(environment: Mapping[str, str], *, simulated: bool) -> bool:
    """Whether DDS is to stay on 127.0.0.1; `simulated`: nothing real moves.

    Raises:
        RosError: the variable has another value than 0, 1 or none.
    """
    match environment.get(LOOPBACK, "").strip():
        case "":
            return simulated
        case "0":
            return False
        case "1":
            return True
        case other:
            raise RosError(f"{LOOPBACK}={other!r}: 1 keeps DDS on 127.0.0.1, and 0 does not")


def _export() -> None:
    domain_id = int(sys.argv[1]) if len(sys.argv) > 1 else None
    for name, value in environment(domain_id).items():
        sys.stdout.write(f"export {name}={shlex.quote(value)}\n")


if __name__ == "__main__":
    _export()
