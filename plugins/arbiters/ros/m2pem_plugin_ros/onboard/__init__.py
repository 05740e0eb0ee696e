"""The arbiter node that runs on a vehicle (docs/ros.md, "Write your own node")."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from m2pem_plugin_ros.onboard.onboard import Onboard

__all__ = ["Onboard"]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from m2pem_plugin_ros.onboard import onboard  # noqa: PLC0415  # the command line needs no ROS

    return getattr(onboard, name)
