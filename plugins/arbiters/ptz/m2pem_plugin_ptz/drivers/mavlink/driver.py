"""The driver of a camera over the MAVLink connection that it shares with its vehicle."""

from dataclasses import replace
from typing import TYPE_CHECKING

from m2pem.api import ResourceId
from m2pem.errors import PluginError
from m2pem_plugin_ptz.drivers.driver import CameraError, DriverSetup
from m2pem_plugin_ptz.drivers.mavlink.context import VehicleAttitude
from m2pem_plugin_ptz.drivers.mavlink.settings import read_settings
from m2pem_plugin_ptz.gimbal import CapturedImage, PanTiltZoom, Reach

if TYPE_CHECKING:
    from m2pem_plugin_mavlink import RoutedLink

    from m2pem_plugin_ptz.drivers.mavlink.camera import CameraComponent
    from m2pem_plugin_ptz.drivers.mavlink.gimbal import GimbalDriver

MISSING = (
    "cameras over MAVLink need the plugin m2pem-plugin-mavlink: "
    "pip install 'm2pem-plugin-ptz[mavlink]'"
)
NOT_OPEN = "the camera is not connected"
OF_THE_CAMERA = ("zoom", "take_picture", "record_video")


class MavlinkDriver:
    """Implements `CameraDriver`.

    Raises:
        PluginError: the connection cannot be used; the text names the resource and the key.
    """

    def __init__(self, setup: DriverSetup) -> None:
        self._setup = setup
        self._settings = read_settings(setup.connection)
        self._link: RoutedLink | None = None
        self._gimbal: GimbalDriver | None = None
        self._camera: CameraComponent | None = None

    async def open(self) -> None:
        """Connect. The camera need not be there yet.

        Raises:
            PluginError: the MAVLink plugin is not installed, or a URL cannot be opened.
        """
        try:
            from m2pem_plugin_mavlink import Address, open_link, signing_of  # noqa: PLC0415  # optional

            from m2pem_plugin_ptz.drivers.mavlink.camera import CameraComponent  # noqa: PLC0415
            from m2pem_plugin_ptz.drivers.mavlink.context import CameraContext  # noqa: PLC0415
            from m2pem_plugin_ptz.drivers.mavlink.gimbal import GimbalDriver  # noqa: PLC0415
        except ModuleNotFoundError as error:
            raise PluginError(f"{self._resource}: {MISSING} ({error})") from error
        own, context = self._settings, self._setup.context
        source = Address(own.gcs_system_id, own.own_component)
        settings = self._setup.connection.settings
        signing = signing_of(self._resource, settings, context.state_folder)
        try:
            self._link = await open_link(
                Address(own.system_id, own.component_id),
                own.urls,
                context.clock,
                source,
                signing=signing,
            )
        except PluginError as error:
            raise PluginError(f"{self._resource}: connection.url: {error}") from error
        vehicle = ResourceId(self._resource.partition("/")[0])
        stabilized = self._setup.settings.stabilized
        camera_context = CameraContext(
            self._resource,
            own,
            self._setup.settings.reach,
            VehicleAttitude(vehicle, context.bus, stabilized=stabilized),
            self._link,
            context.clock,
            context.logger,
            self._setup.on_contact,
        )
        if own.gimbal:
            self._gimbal = GimbalDriver(camera_context)
            self._gimbal.open()
        self._camera = CameraComponent(replace(camera_context, on_contact=self._camera_received))
        self._camera.open()

    async def close(self) -> None:
        if self._camera is not None:
            await self._camera.close()
        if self._gimbal is not None:
            await self._gimbal.close()
        if self._link is not None:
            await self._link.close()

    # --- state ----------------------------------------------------------------------------------

    @property
    def ptz(self) -> PanTiltZoom | None:
        zoom = self._camera.level if self._camera is not None else 1.0
        if not self._settings.gimbal:
            return PanTiltZoom(0.0, 0.0, zoom)
        direction = self._gimbal.direction if self._gimbal is not None else None
        return None if direction is None else PanTiltZoom(*direction, zoom)

    @property
    def reach(self) -> Reach:
        """The limits of the gimbal, within those of the fleet."""
        if not self._settings.gimbal:
            of_fleet = self._setup.settings.reach
            return Reach((0.0, 0.0), (0.0, 0.0), of_fleet.zoom_max, view_rad=of_fleet.view_rad)
        return self._gimbal.reach() if self._gimbal is not None else self._setup.settings.reach

    def refusal(self, behavior: str) -> str:
        if self._camera is None:
            return NOT_OPEN
        if behavior in OF_THE_CAMERA:
            return self._camera.refusal(behavior)
        if self._gimbal is None:
            return "the camera cannot turn: the fleet sets `gimbal: false`"
        return self._gimbal.refusal

    # --- orders ---------------------------------------------------------------------------------

    def point(self, pan_rad: float, tilt_rad: float, rate_rad_s: float | None = None) -> None:
        if self._gimbal is not None:
            self._gimbal.point((pan_rad, tilt_rad), rate_rad_s)

    def zoom(self, level: float) -> None:
        if self._camera is not None:
            self._camera.zoom(level)

    def halt(self) -> None:
        if self._gimbal is not None:
            self._gimbal.halt()
        if self._camera is not None:
            self._camera.halt()

    async def take_picture(self) -> CapturedImage:
        """Take one picture, which the camera keeps.

        Raises:
            CameraError: the camera refused, or did not answer.
        """
        return await self._opened.take_picture()

    async def start_recording(self) -> None:
        await self._opened.start_recording()

    async def stop_recording(self) -> str:
        """End the video, and return the camera's name for it.

        Raises:
            CameraError: the camera refused, or did not answer.
        """
        return await self._opened.stop_recording()

    # --- inside ---------------------------------------------------------------------------------

    @property
    def _resource(self) -> ResourceId:
        return self._setup.connection.resource

    @property
    def _opened(self) -> "CameraComponent":
        if self._camera is None:
            raise CameraError(NOT_OPEN)
        return self._camera

    def _camera_received(self) -> None:
        """Report a message of the camera, unless there is a gimbal, whose silence must not be
        hidden."""
        if self._gimbal is None or not self._gimbal.is_received:
            self._setup.on_contact()
