"""m2pem: a mission executive for teams of unmanned vehicles.

A mission is a BPMN 2.0 diagram; m2pem checks it against a fleet, rehearses it on a virtual clock
and executes it with tokens. Start with `load_mission` and `load_fleet`, or with the command line.
"""

from m2pem.hookspecs import hookimpl

__version__ = "0.1.0"

__all__ = ["__version__", "hookimpl"]
