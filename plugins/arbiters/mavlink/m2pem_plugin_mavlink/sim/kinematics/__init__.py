"""How vehicles move: a demand and a small time in, a changed body out. They know no MAVLink."""

from typing import Protocol

from m2pem_plugin_mavlink.sim.body import Body
from m2pem_plugin_mavlink.sim.demands import Demand
from m2pem_plugin_mavlink.sim.specification import Kind


class Kinematics(Protocol):
    """Moves a body."""

    def step(self, body: Body, demand: Demand, dt_s: float) -> None:
        """Let `dt_s` pass."""
        ...


def kinematics_of(kind: Kind) -> Kinematics:
    """How vehicles of a kind move."""
    from m2pem_plugin_mavlink.sim.kinematics.copter import CopterKinematics  # noqa: PLC0415
    from m2pem_plugin_mavlink.sim.kinematics.plane import PlaneKinematics  # noqa: PLC0415
    from m2pem_plugin_mavlink.sim.kinematics.rover import RoverKinematics  # noqa: PLC0415

    match kind:
        case Kind.COPTER:
            return CopterKinematics()
        case Kind.PLANE:
            return PlaneKinematics()
        case Kind.ROVER:
            return RoverKinematics()
        case Kind.BOAT:
            return RoverKinematics(acceleration_mps2=0.8, turn_radius_m=2.0)
