"""Injected faults: bad links, lost satellites, an empty battery, refusals, takeovers.

Every run is the same: random choices have a seed.
"""

from m2pem_plugin_mavlink.simulator.faults.faults import Direction, Faults
from m2pem_plugin_mavlink.simulator.faults.grammar import GRAMMAR, plan
from m2pem_plugin_mavlink.simulator.faults.link import LinkFaults, Rate, every, share

__all__ = [
    "GRAMMAR",
    "Direction",
    "Faults",
    "LinkFaults",
    "Rate",
    "every",
    "plan",
    "share",
]
