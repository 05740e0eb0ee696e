"""What a simulated vehicle is: its names, where it stands, how it moves and what it carries."""

from dataclasses import dataclass, field

from m2pem.api import GeoPosition
from m2pem_plugin_ros.pose import Pose
from m2pem_plugin_ros.settings import Settings
from m2pem_plugin_ros.sim.battery import Capacity
from m2pem_plugin_ros.sim.body import Chassis
from m2pem_plugin_ros.sim.detector import DetectorSpec
from m2pem_plugin_ros.sim.odometer import Inaccuracy

FORT = GeoPosition(38.1075, -77.3192, 60.0)
"""Where vehicles stand that no fleet places: near the field of the vignettes."""


@dataclass(frozen=True, slots=True)
class VehicleSpec:
    """One simulated vehicle.

    `settings`: the connection as an executive has it, so that both mean the same topics. `start`:
    in the fleet's local frame. `origin`: of that frame, latitude and longitude in degrees, altitude
    in metres above mean sea level. `battery`: charge at first, 0 to 1.
    """

    name: str
    settings: Settings
    domain: str = "ground"
    start: Pose = field(default_factory=lambda: Pose(0.0, 0.0, 0.0))
    origin: tuple[float, float, float] = (FORT.latitude_deg, FORT.longitude_deg, FORT.altitude_m)
    chassis: Chassis = field(default_factory=Chassis)
    inaccuracy: Inaccuracy = field(default_factory=Inaccuracy)
    capacity: Capacity = field(default_factory=Capacity)
    battery: float = 1.0
    detectors: tuple[DetectorSpec, ...] = ()

    @property
    def hardware_id(self) -> str:
        """What it is called in /diagnostics."""
        return self.settings.hardware_id or self.name
