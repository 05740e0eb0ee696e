"""Where one camera looks in the world, and where it must look to see something."""

from datetime import UTC, datetime

from m2pem.api import ArbiterContext, GeoPosition, Point, ResourceId, VehiclePosition, VehicleState
from m2pem_plugin_ptz.camera_model.field_of_view import View, footprint
from m2pem_plugin_ptz.camera_model.frames import Vector, ecef
from m2pem_plugin_ptz.camera_model.limits import Turn, turn
from m2pem_plugin_ptz.camera_model.pose import Deck, Eye, deck, eye
from m2pem_plugin_ptz.camera_model.vehicle_pose import Carrier
from m2pem_plugin_ptz.drivers.driver import CameraDriver
from m2pem_plugin_ptz.gimbal import Look
from m2pem_plugin_ptz.settings import Settings


class Sight:
    """One camera on its vehicle, at any time that is near."""

    def __init__(
        self,
        resource: ResourceId,
        domain: str,
        driver: CameraDriver,
        settings: Settings,
        context: ArbiterContext,
    ) -> None:
        self.resource = resource
        self.driver = driver
        self.settings = settings
        self.context = context
        self.carrier = Carrier(ResourceId(resource.partition("/")[0]), domain, context)
        self._targets: dict[str, Carrier] = {}
        self._seen_by: tuple[Look | None, VehicleState | None] = (None, None)
        self._seen: tuple[GeoPosition, ...] = ()

    @property
    def now_us(self) -> int:
        """The time of the clock that was lent."""
        return self.context.clock.now_us()

    def deck(self, at_us: int) -> Deck:
        """What the camera turns on; where its vehicle's heading is not known, north is ahead."""
        roll, pitch, yaw = self.carrier.turned(at_us)
        return deck(
            self.settings.mounting, roll, pitch, yaw or 0.0, stabilized=self.settings.stabilized
        )

    def eye(self, at_us: int) -> Eye | None:
        """The camera; None: where its vehicle is or heads is not known."""
        stance = self.carrier.stance(at_us)
        if stance is None:
            return None
        return eye(stance, self.settings.mounting, stabilized=self.settings.stabilized)

    def view(self, look: Look | None) -> View:
        """What it has in its picture, at the zoom of a look."""
        return View(*self.driver.reach.view_rad).zoomed(max(look.zoom if look else 1.0, 1.0))

    def turn(self, pan_rad: float, tilt_rad: float, slack_rad: float = 0.0) -> Turn:
        """The nearest that it can look to that, from where it looks."""
        look = self.driver.look
        return turn(self.driver.reach, pan_rad, tilt_rad, look.pan_rad if look else 0.0, slack_rad)

    def place(self, target: Point | VehiclePosition, at_us: int) -> Vector | None:
        """Where a target is, in ECEF; None: not known."""
        if isinstance(target, VehiclePosition):
            if target.vehicle not in self._targets:
                vehicle = ResourceId(target.vehicle)
                self._targets[target.vehicle] = Carrier(vehicle, "", self.context)
            return self._targets[target.vehicle].place(at_us)
        latitude, longitude, altitude = target.position
        height = self.carrier.ground_m()
        if altitude is not None:
            above = {"amsl": 0.0, "terrain": height}
            height = altitude + above.get(target.altitude_frame, self.carrier.home_m())
        return ecef(GeoPosition(latitude, longitude, height))

    def footprint(self, look: Look | None) -> tuple[GeoPosition, ...]:
        """What it sees of the ground; see `PayloadState.footprint`."""
        state = self.carrier.state()
        if (look, state) == self._seen_by:
            return self._seen
        seeing = self.eye(self.now_us)
        if look is None or seeing is None:
            return ()
        axes = seeing.deck.axes(look.pan_rad, look.tilt_rad)
        self._seen_by = (look, state)
        self._seen = footprint(seeing, axes, self.view(look), self.carrier.ground_m())
        return self._seen


def iso(time_us: int) -> str:
    """A time as missions read it: UTC, to the microsecond."""
    seconds, rest = divmod(time_us, 1_000_000)
    time = datetime.fromtimestamp(seconds, UTC).replace(microsecond=rest)
    return time.isoformat(timespec="microseconds").replace("+00:00", "Z")
