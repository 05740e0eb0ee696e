"""Checks that ROS 2 and packages of interfaces are installed; errors give the remedy."""

import importlib
import importlib.metadata
import importlib.util
import os
import re
import sys
from pathlib import Path
from types import ModuleType

from m2pem.errors import PluginError

WHEELS = "pip install 'm2pem-plugin-ros[wheels]'"
SOURCED = "a machine with ROS 2: source /opt/ros/jazzy/setup.bash before m2pem starts"

OWN_INTERFACES = "m2pem_interfaces"
OWN_INSTALLATION = (
    "with the wheels: pip install ./ros/m2pem_interfaces of m2pem's sources; "
    "with a sourced ROS: colcon build that folder, and source the result"
)
BUILT_FOR_WHEELS = ("geographic_msgs", "tf2_msgs")
"""Packages of ROS that its wheels lack."""

NEWEST_MESSAGE = "FleetState"
"""The message that was added last."""


class RosError(PluginError):
    """ROS 2 is missing, or cannot be used; the message gives the remedy."""

    exit_status = 2


def require_ros() -> None:
    """Import rclpy.

    Raises:
        RosError: ROS or a library of it is missing, or there are two installations.
    """
    wheels = _has_wheels()
    sourced = _sourced_prefixes()
    if wheels and sourced:
        raise RosError(
            f"there are two ROS 2: wheels in {sys.prefix}, and sourced from {sourced[0]}; the "
            "two do not mix: start m2pem without sourcing ROS, or without its wheels"
        )
    if wheels:
        os.environ.setdefault("AMENT_PREFIX_PATH", sys.prefix)  # what sourcing sets elsewhere
    elif sourced and (other := _other_python(sourced[0])):
        raise RosError(_for_other_python(sourced[0], other))
    try:
        importlib.import_module("rclpy")
    except ModuleNotFoundError as error:
        raise RosError(
            f"ROS 2 is not installed for this Python ({error}). With {SOURCED}. Without: {WHEELS}. "
            "Never both"
        ) from error
    except ImportError as error:
        raise RosError(
            f"rclpy is installed, but cannot be loaded: {error}{_hint(wheels)}"
        ) from error


def require_interfaces(package: str) -> ModuleType:
    """Import and return a package of interfaces, such as m2pem_interfaces or nav2_msgs.

    Raises:
        RosError: it is not installed, or that of an earlier m2pem.
    """
    require_ros()
    try:
        module = importlib.import_module(package)
        for part in ("msg", "srv", "action"):
            if importlib.util.find_spec(f"{package}.{part}"):
                importlib.import_module(f"{package}.{part}")
    except ImportError as error:
        how = f"apt-get install ros-jazzy-{package.replace('_', '-')}, then source ROS again"
        if package in BUILT_FOR_WHEELS:
            how += f"; with the wheels: pip install ./ros/wheels/{package} of m2pem's sources"
        if package == OWN_INTERFACES:
            how = OWN_INSTALLATION
        raise RosError(f"the ROS package {package} is not installed ({error}); {how}") from error
    if package == OWN_INTERFACES and not hasattr(module.msg, NEWEST_MESSAGE):
        raise RosError(
            f"the ROS package {package} is that of an earlier m2pem: it has no {NEWEST_MESSAGE}; "
            f"install it again, {OWN_INSTALLATION}"
        )
    return module


def installed_as() -> str:
    """Return how ROS 2 comes to this process, for people; "" if it does not."""
    ways = [f"wheels in {sys.prefix}"] if _has_wheels() else []
    ways += [f"sourced from {prefix}" for prefix in _sourced_prefixes()[:1]]
    return " and ".join(ways)


def _has_wheels() -> bool:
    try:
        importlib.metadata.distribution("ros-rclpy")
    except importlib.metadata.PackageNotFoundError:
        return False
    return True


def _sourced_prefixes() -> list[str]:
    """Return the prefixes of another ROS than that of this environment, which was sourced."""
    prefixes = [p for p in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if p]
    own = Path(sys.prefix).resolve()
    return [p for p in prefixes if Path(p).resolve() != own and Path(p, "share", "rclpy").is_dir()]


OLDEST_PYTHON = (3, 11)
"""What m2pem needs. ROS 2 Humble and Iron are built for 3.10."""


def _other_python(prefix: str) -> tuple[int, int] | None:
    """Return the Python that a sourced ROS was built for; None if it is this one, or not known."""
    found = [
        (int(version[1]), int(version[2]))
        for path in Path(prefix).glob("lib/python3.*/*-packages/rclpy")
        if (version := re.fullmatch(r"python(\d+)\.(\d+)", path.parts[-3]))
    ]
    return None if not found or sys.version_info[:2] in found else max(found)


def _for_other_python(prefix: str, version: tuple[int, int]) -> str:
    """Return what to do about a sourced ROS that was built for another Python."""
    built, running = (".".join(map(str, each)) for each in (version, sys.version_info[:2]))
    distribution = os.environ.get("ROS_DISTRO", "").capitalize()
    named = f"ROS 2 {distribution}".rstrip()
    text = f"{named} of {prefix} was built for Python {built}, and this is Python {running}; "
    if version < OLDEST_PYTHON:
        return f"{text}m2pem needs Python 3.11 or newer: use ROS 2 Jazzy or newer"
    return f"{text}make the environment of m2pem with `python{built} -m venv`"


def _hint(wheels: bool) -> str:
    if not wheels:
        return f"; with {SOURCED}, and run m2pem with the Python that this ROS was built for"
    return (
        "; LD_LIBRARY_PATH is another environment's: unset it and _ROS_WHEELS_BOOTSTRAP_COMPLETE, "
        "and start again"
    )
