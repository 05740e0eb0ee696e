"""m2pem: a mission executive for teams of unmanned vehicles.

A mission is a BPMN 2.0 diagram; m2pem checks it against a fleet, rehearses it on a virtual clock
and executes it with tokens. Start with `load_mission` and `load_fleet`, or with the command line.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from m2pem.hookspecs import hookimpl

if TYPE_CHECKING:
    from m2pem.bpmn import read_mission as load_mission
    from m2pem.fleet.fleet_file import load_fleet

__version__ = "0.2.0"

__all__ = ["__version__", "hookimpl", "load_fleet", "load_mission"]

# Loaded when asked for: the parsers of files are most of what importing m2pem would cost.
_LAZY = {
    "load_fleet": ("m2pem.fleet.fleet_file", "load_fleet"),
    "load_mission": ("m2pem.bpmn", "read_mission"),
}


def __getattr__(name: str) -> Any:
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, attribute = _LAZY[name]
    return getattr(import_module(module), attribute)
