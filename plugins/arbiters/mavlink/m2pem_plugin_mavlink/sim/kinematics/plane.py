"""How a plane moves."""

from dataclasses import dataclass

from m2pem_plugin_mavlink.sim.body import Body
from m2pem_plugin_mavlink.sim.demands import Demand


@dataclass(frozen=True, slots=True)
class PlaneKinematics:
    """A plane."""

    def step(self, body: Body, demand: Demand, dt_s: float) -> None:
        """Let `dt_s` pass."""
