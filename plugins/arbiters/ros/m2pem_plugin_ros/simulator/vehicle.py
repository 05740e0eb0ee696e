"""The physical state of a simulated vehicle, and its sensors, without I/O."""

import math
from collections.abc import Iterator
from random import Random

from m2pem.api import GeoPosition
from m2pem_plugin_ros.frames import to_geodetic
from m2pem_plugin_ros.pose import Pose, Twist
from m2pem_plugin_ros.simulator.dynamics import Dynamics
from m2pem_plugin_ros.simulator.sensors import LOW_FRACTION, Battery, Detector, Odometer, Target
from m2pem_plugin_ros.simulator.specification import VehicleSpec

STEP_S = 0.02
"""The integration step, in simulated time."""


class Vehicle:
    """`now_s`: simulated seconds since the start. `gps_lost`: the receiver has no satellites."""

    def __init__(self, spec: VehicleSpec, seed: int = 0) -> None:
        self.spec = spec
        self.now_s = 0.0
        self.gps_lost = False
        self.body = Dynamics(spec.chassis, spec.start)
        start = spec.start if spec.settings.odom_frame == "map" else Pose(0.0, 0.0, 0.0)
        self.odometer = Odometer(start, spec.inaccuracy, Random(f"{seed}/{spec.name}"))
        self.battery = Battery(spec.capacity, spec.battery)
        self.detectors = tuple(Detector(each) for each in spec.detectors)
        self._steps = 0
        self._found: list[tuple[Detector, Target]] = []

    @property
    def position(self) -> GeoPosition:
        """The true position. The ground is flat, at the altitude of the origin."""
        pose, origin = self.body.pose, self.spec.origin
        place = to_geodetic(pose.east_m, pose.north_m, 0.0, origin)
        return GeoPosition(place.latitude_deg, place.longitude_deg, origin[2] + pose.up_m)

    @property
    def problems(self) -> tuple[str, ...]:
        """The problems in its own diagnostics."""
        found = {
            "no satellites": self.gps_lost,
            "battery low": self.battery.fraction < LOW_FRACTION,
            "wheels stuck": self.body.stuck,
        }
        return tuple(text for text, is_so in found.items() if is_so)

    def command(self, twist: Twist) -> None:
        """Process a message of cmd_vel."""
        self.body.command(twist, self.now_s)

    def pass_until(self, now_s: float) -> None:
        """Advance in whole steps, so that the result does not depend on how often this is
        called."""
        target = math.floor(now_s / STEP_S + 1e-9)
        while self._steps < target:
            self._steps += 1
            self.now_s = self._steps * STEP_S
            self._step()

    def _step(self) -> None:
        before_m = self.body.driven_m
        stood = self.body.stands
        self.body.step(self.now_s, STEP_S)
        self.battery.drain(self.body.driven_m - before_m, STEP_S)
        if stood and self.body.stands and self._steps > 1:
            return
        self.odometer.step(self.body.twist, STEP_S)
        for detector in self.detectors:
            self._found += [(detector, found) for found in detector.find(self.body.pose)]

    def detect(self, what: str = "") -> None:
        """Make a detection here and now. With the name of a detector, it finds its usual type;
        otherwise the first detector finds something of type `what`.

        Raises:
            ValueError: the vehicle carries no detector.
        """
        if not self.detectors:
            raise ValueError(f"{self.spec.name} carries no detector")
        names = {each.spec.payload.rpartition("/")[2]: each for each in self.detectors}
        detector, kind = names.get(what, self.detectors[0]), "" if what in names else what
        pose = self.body.pose
        found = Target(kind or detector.spec.type, pose.east_m, pose.north_m)
        self._found.append((detector, found))

    def detections(self) -> Iterator[tuple[Detector, Target]]:
        """Yield the detections since the last call."""
        while self._found:
            yield self._found.pop(0)
