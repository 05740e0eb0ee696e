"""The model of one camera on its vehicle: directions, field of view and footprint at a time."""

from datetime import UTC, datetime

from m2pem.api import ArbiterContext, GeoPosition, Point, ResourceId, VehiclePosition, VehicleState
from m2pem_plugin_ptz.camera_model.field_of_view import FieldOfView, footprint
from m2pem_plugin_ptz.camera_model.frames import Vector, ecef
from m2pem_plugin_ptz.camera_model.limits import Reachable, nearest_reachable
from m2pem_plugin_ptz.camera_model.pose import CameraPose, MountFrame, camera_pose, mount_frame
from m2pem_plugin_ptz.camera_model.vehicle_pose import TrackedVehicle
from m2pem_plugin_ptz.drivers.driver import CameraDriver
from m2pem_plugin_ptz.gimbal import PanTiltZoom
from m2pem_plugin_ptz.settings import Settings


class CameraModel:
    """One camera on its vehicle, at the present or in the near future."""

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
        self.vehicle_pose = TrackedVehicle(ResourceId(resource.partition("/")[0]), domain, context)
        self._targets: dict[str, TrackedVehicle] = {}
        self._footprint_of: tuple[PanTiltZoom | None, VehicleState | None] = (None, None)
        self._footprint: tuple[GeoPosition, ...] = ()

    @property
    def now_us(self) -> int:
        return self.context.clock.now_us()

    def mount_frame(self, at_us: int) -> MountFrame:
        """Return the frame in which the camera turns. If the heading of the vehicle is not known,
        it is north."""
        roll, pitch, yaw = self.vehicle_pose.attitude(at_us)
        return mount_frame(
            self.settings.mounting, roll, pitch, yaw or 0.0, stabilized=self.settings.stabilized
        )

    def camera_pose(self, at_us: int) -> CameraPose | None:
        """Return the pose of the camera; None if the pose of its vehicle is not known."""
        pose = self.vehicle_pose.pose(at_us)
        if pose is None:
            return None
        return camera_pose(pose, self.settings.mounting, stabilized=self.settings.stabilized)

    def field_of_view(self, ptz: PanTiltZoom | None) -> FieldOfView:
        """Return the field of view at a zoom."""
        return FieldOfView(*self.driver.reach.view_rad).zoomed(max(ptz.zoom if ptz else 1.0, 1.0))

    def nearest_reachable(
        self, pan_rad: float, tilt_rad: float, slack_rad: float = 0.0
    ) -> Reachable:
        """Return the nearest reachable direction, from the current one."""
        ptz = self.driver.ptz
        return nearest_reachable(
            self.driver.reach, pan_rad, tilt_rad, ptz.pan_rad if ptz else 0.0, slack_rad
        )

    def place(self, target: Point | VehiclePosition, at_us: int) -> Vector | None:
        """Return the position of a target in ECEF; None if it is not known."""
        if isinstance(target, VehiclePosition):
            if target.vehicle not in self._targets:
                vehicle = ResourceId(target.vehicle)
                self._targets[target.vehicle] = TrackedVehicle(vehicle, "", self.context)
            return self._targets[target.vehicle].place_ecef(at_us)
        latitude, longitude, altitude = target.position
        height = self.vehicle_pose.ground_m()
        if altitude is not None:
            above = {"amsl": 0.0, "terrain": height}
            height = altitude + above.get(
                target.altitude_frame, self.vehicle_pose.home_altitude_m()
            )
        return ecef(GeoPosition(latitude, longitude, height))

    def footprint(self, ptz: PanTiltZoom | None) -> tuple[GeoPosition, ...]:
        """Return the footprint; see `PayloadState.footprint`."""
        state = self.vehicle_pose.state()
        if (ptz, state) == self._footprint_of:
            return self._footprint
        seeing = self.camera_pose(self.now_us)
        if ptz is None or seeing is None:
            return ()
        axes = seeing.mount_frame.axes(ptz.pan_rad, ptz.tilt_rad)
        self._footprint_of = (ptz, state)
        self._footprint = footprint(
            seeing, axes, self.field_of_view(ptz), self.vehicle_pose.ground_m()
        )
        return self._footprint


def iso(time_us: int) -> str:
    """Return a time as missions read it: UTC, to the microsecond."""
    seconds, rest = divmod(time_us, 1_000_000)
    time = datetime.fromtimestamp(seconds, UTC).replace(microsecond=rest)
    return time.isoformat(timespec="microseconds").replace("+00:00", "Z")
