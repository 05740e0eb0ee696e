"""Faults on request, in words: `grammar` reads them, `actions` says what they do."""

from m2pem_plugin_ros.sim.faults.grammar import FaultError, PlannedFault, parse

__all__ = ["FaultError", "PlannedFault", "parse"]
