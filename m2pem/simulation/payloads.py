"""A simulated payload: where it looks, as a function of time."""

import math
from collections.abc import Sequence

from m2pem.api.arbiter import Connection
from m2pem.api.telemetry import Detection, GeoPosition, LinkState, PayloadState
from m2pem.mission.catalogue import ResourceId
from m2pem.simulation.footprints import around, seen
from m2pem.simulation.gimbals import Mount
from m2pem.simulation.phases import Look, Pose, Slew, Vector
from m2pem.simulation.settings import Settings
from m2pem.simulation.track import Plan, Track
from m2pem.simulation.vehicles import carrier_of


class SimPayload:
    """Looks straight ahead at first. `detector`: whether it finds planted targets.

    `behavior`: the id of what it is busy with, `doing` the name; "" when free. `held`: whether
    `hold` was called on it.
    """

    def __init__(self, connection: Connection, settings: Settings, now_us: int) -> None:
        self.id: ResourceId = connection.resource
        self.carrier = carrier_of(connection.resource)
        self.settings = settings
        self.detector = connection.detector or settings.kind == "gpr"
        self.behavior = ""
        self.doing = ""
        self.held = False
        self.track: Track[Look] = Track(Plan([Slew(Look(), Look(), 0.0)]), now_us)

    def mount(self, now_us: int, carrier: Pose | None, ground_up_m: float) -> Mount:
        """As a behavior sees it."""
        look = self.look(now_us)
        return Mount(self.id, self.settings.gimbal, look, carrier, ground_up_m)

    def look(self, now_us: int) -> Look:
        """Where it looks; pan within half a turn."""
        look = self.track.at(now_us)
        return Look(math.remainder(look.pan, math.tau), look.tilt, look.zoom)

    def take(self, plan: Plan[Look], now_us: int) -> None:
        """Follow another plan, which must begin where it looks."""
        self.track = Track(plan, now_us)

    def stop(self, now_us: int) -> None:
        """Look on where it looks."""
        look = self.look(now_us)
        self.take(Plan([Slew(look, look, 0.0)]), now_us)

    def hold(self, now_us: int) -> None:
        """Stop at once, keeping the plan."""
        self.track.hold(now_us, 0.0)

    def go_on(self, now_us: int) -> None:
        """Take the plan up again."""
        self.track.go_on(now_us)

    def ground(self, now_us: int, carrier: Pose, ground_up_m: float) -> Sequence[Vector]:
        """What it sees of the ground, as corners; a detector sees all round."""
        if self.detector:
            return around(self.settings.detection_range_m, carrier, ground_up_m)
        return seen(self.settings.gimbal, self.look(now_us), carrier, ground_up_m)

    def state(
        self,
        now_us: int,
        detections: tuple[Detection, ...] = (),
        footprint: tuple[GeoPosition, ...] = (),
    ) -> PayloadState:
        """What it says about itself."""
        look = self.look(now_us)
        return PayloadState(
            resource=self.id,
            time_us=now_us,
            pan_rad=look.pan,
            tilt_rad=look.tilt,
            zoom=look.zoom,
            detections=detections,
            link=LinkState.CONNECTED,
            behavior=self.doing,
            footprint=footprint,
        )
