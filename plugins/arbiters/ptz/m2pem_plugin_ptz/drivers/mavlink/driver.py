"""Reaches a camera through the MAVLink of its vehicle, over the socket that its arbiter uses."""

from dataclasses import replace
from typing import TYPE_CHECKING

from m2pem.api import ResourceId
from m2pem.errors import PluginError
from m2pem_plugin_ptz.drivers.driver import CameraError, Seat
from m2pem_plugin_ptz.drivers.mavlink.context import Carrier
from m2pem_plugin_ptz.drivers.mavlink.settings import read_settings
from m2pem_plugin_ptz.gimbal import Look, Picture, Reach

if TYPE_CHECKING:
    from m2pem_plugin_mavlink import RoutedLink

    from m2pem_plugin_ptz.drivers.mavlink.camera import CameraUnit
    from m2pem_plugin_ptz.drivers.mavlink.gimbal import GimbalHead

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

    def __init__(self, seat: Seat) -> None:
        self._seat = seat
        self._settings = read_settings(seat.connection)
        self._link: RoutedLink | None = None
        self._gimbal: GimbalHead | None = None
        self._camera: CameraUnit | None = None

    async def open(self) -> None:
        """Listen; the camera need not be there yet.

        Raises:
            PluginError: the MAVLink plugin is not installed, or a URL cannot be opened.
        """
        try:
            from m2pem_plugin_mavlink import Address, open_link  # noqa: PLC0415  # optional

            from m2pem_plugin_ptz.drivers.mavlink.camera import CameraUnit  # noqa: PLC0415
            from m2pem_plugin_ptz.drivers.mavlink.context import Post  # noqa: PLC0415
            from m2pem_plugin_ptz.drivers.mavlink.gimbal import GimbalHead  # noqa: PLC0415
        except ModuleNotFoundError as error:
            raise PluginError(f"{self._resource}: {MISSING} ({error})") from error
        own, context = self._settings, self._seat.context
        source = Address(own.gcs_system_id, own.own_component)
        try:
            self._link = await open_link(
                Address(own.system_id, own.component_id), own.urls, context.clock, source
            )
        except PluginError as error:
            raise PluginError(f"{self._resource}: connection.url: {error}") from error
        vehicle = ResourceId(self._resource.partition("/")[0])
        stabilized = self._seat.settings.stabilized
        post = Post(
            self._resource,
            own,
            self._seat.settings.reach,
            Carrier(vehicle, context.bus, stabilized=stabilized),
            self._link,
            context.clock,
            context.logger,
            self._seat.heard,
        )
        if own.gimbal:
            self._gimbal = GimbalHead(post)
            self._gimbal.open()
        self._camera = CameraUnit(replace(post, heard=self._camera_heard))
        self._camera.open()

    async def close(self) -> None:
        """Let go. The camera stays as it is."""
        if self._camera is not None:
            await self._camera.close()
        if self._gimbal is not None:
            await self._gimbal.close()
        if self._link is not None:
            await self._link.close()

    # --- what is known --------------------------------------------------------------------------

    @property
    def look(self) -> Look | None:
        """Where it looks, as it said last."""
        zoom = self._camera.level if self._camera is not None else 1.0
        if not self._settings.gimbal:
            return Look(0.0, 0.0, zoom)
        direction = self._gimbal.direction if self._gimbal is not None else None
        return None if direction is None else Look(*direction, zoom)

    @property
    def reach(self) -> Reach:
        """Where it can look: as the gimbal says, within what the fleet says."""
        if not self._settings.gimbal:
            of_fleet = self._seat.settings.reach
            return Reach((0.0, 0.0), (0.0, 0.0), of_fleet.zoom_max, view_rad=of_fleet.view_rad)
        return self._gimbal.reach() if self._gimbal is not None else self._seat.settings.reach

    def refusal(self, behavior: str) -> str:
        """Why the camera cannot do such a behavior, now or ever; "" if it can."""
        if self._camera is None:
            return NOT_OPEN
        if behavior in OF_THE_CAMERA:
            return self._camera.refusal(behavior)
        if self._gimbal is None:
            return "the fleet says that it has no gimbal, so that it cannot be turned"
        return self._gimbal.refusal

    # --- orders ---------------------------------------------------------------------------------

    def point(self, pan_rad: float, tilt_rad: float, rate_rad_s: float | None = None) -> None:
        """Turn there, not faster than `rate_rad_s`, and stay."""
        if self._gimbal is not None:
            self._gimbal.point((pan_rad, tilt_rad), rate_rad_s)

    def zoom(self, level: float) -> None:
        """Zoom there."""
        if self._camera is not None:
            self._camera.zoom(level)

    def halt(self) -> None:
        """Stop turning and zooming."""
        if self._gimbal is not None:
            self._gimbal.halt()
        if self._camera is not None:
            self._camera.halt()

    async def take_picture(self) -> Picture:
        """Take one picture; the camera keeps it.

        Raises:
            CameraError: it could not.
        """
        return await self._opened.take_picture()

    async def start_recording(self) -> None:
        """Begin a video.

        Raises:
            CameraError: it could not.
        """
        await self._opened.start_recording()

    async def stop_recording(self) -> str:
        """End the video; returns the camera's own name for it.

        Raises:
            CameraError: it could not.
        """
        return await self._opened.stop_recording()

    # --- inside ---------------------------------------------------------------------------------

    @property
    def _resource(self) -> ResourceId:
        return self._seat.connection.resource

    @property
    def _opened(self) -> "CameraUnit":
        if self._camera is None:
            raise CameraError(NOT_OPEN)
        return self._camera

    def _camera_heard(self) -> None:
        """A gimbal that points is what counts: its silence must not be hidden by its camera."""
        if self._gimbal is None or not self._gimbal.is_heard:
            self._seat.heard()
