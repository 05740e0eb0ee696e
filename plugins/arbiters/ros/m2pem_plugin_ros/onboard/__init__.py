"""The arbiter node that runs on a vehicle or a payload (docs/ros.md, "Write your own node").

`Onboard` is the node, and `ArbiterDriver` has what it is asked for done by any arbiter on board;
`Targets` is the bus that such an arbiter is lent.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from m2pem_plugin_ros.onboard.arbiter_driver import ArbiterDriver
    from m2pem_plugin_ros.onboard.onboard import Onboard
    from m2pem_plugin_ros.onboard.targets import Targets

__all__ = ["ArbiterDriver", "Onboard", "Targets"]

_MODULES = {"ArbiterDriver": "arbiter_driver", "Onboard": "onboard", "Targets": "targets"}


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    # The command line needs no ROS.
    return getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
