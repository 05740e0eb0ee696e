"""The driver of a camera on a pan-tilt unit, by the topics of its joints and its images. All
cameras of a ROS domain share one connection."""

import asyncio
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

from m2pem.api import ResourceId
from m2pem.errors import PluginError
from m2pem_plugin_ptz.drivers.driver import CameraError, DriverSetup
from m2pem_plugin_ptz.drivers.ros.settings import Axis, Command, read_settings
from m2pem_plugin_ptz.gimbal import CapturedImage, PanTiltZoom, Reach

if TYPE_CHECKING:
    from m2pem_plugin_ros import RosRuntime

    from m2pem_plugin_ptz.drivers.ros.images import ImageTopic, Recorder
    from m2pem_plugin_ptz.drivers.ros.steering import JointController


@dataclass(slots=True)
class _Shared:
    runtime: "RosRuntime"
    users: int = 0


_shared: WeakKeyDictionary[asyncio.AbstractEventLoop, dict[int | None, _Shared]] = (
    WeakKeyDictionary()
)


def join_runtime(domain_id: int | None, name: str) -> "RosRuntime":
    """Return the connection to a domain; a new one is named `name`.

    Raises:
        RosError: ROS cannot be used; the text gives the remedy.
    """
    from m2pem_plugin_ros import RosRuntime  # noqa: PLC0415  # it needs rclpy

    domains = _shared.setdefault(asyncio.get_running_loop(), {})
    if domain_id not in domains:
        domains[domain_id] = _Shared(RosRuntime(name, domain_id=domain_id))
    domains[domain_id].users += 1
    return domains[domain_id].runtime


async def leave_runtime(domain_id: int | None) -> None:
    """Undo one `join_runtime`."""
    domains = _shared[asyncio.get_running_loop()]
    shared = domains[domain_id]
    shared.users -= 1
    if not shared.users:
        del domains[domain_id]
        await shared.runtime.close()


MISSING = "cameras over ROS need the plugin m2pem-plugin-ros: pip install 'm2pem-plugin-ptz[ros]'"
NOT_OPEN = "the camera is not connected"


class RosDriver:
    """Implements `CameraDriver`.

    Raises:
        PluginError: the connection cannot be used; the text names the resource and the key.
    """

    def __init__(self, setup: DriverSetup) -> None:
        self._setup = setup
        self._settings = read_settings(setup.connection)
        self._ros: RosRuntime | None = None
        self._made: list[Any] = []
        self._positions: dict[Axis, float] = {}
        self._other_joints: tuple[str, ...] = ()
        self._joint_controller: JointController | None = None
        self._images: ImageTopic | None = None
        self._recorder: Recorder | None = None

    # --- life -----------------------------------------------------------------------------------

    async def open(self) -> None:
        """Connect. The camera need not be there yet.

        Raises:
            PluginError: ROS or its plugin is not installed, or cannot be used.
        """
        self._ros = self._join()
        try:
            self._listen(self._ros)
        except BaseException:
            await self.close()
            raise

    def _join(self) -> "RosRuntime":
        try:
            from m2pem_plugin_ros import keep_on_loopback  # noqa: PLC0415  # optional
        except ModuleNotFoundError as error:
            raise PluginError(f"{self._resource}: {MISSING} ({error})") from error
        if self._setup.connection.sitl:
            try:
                keep_on_loopback()
            except (
                PluginError
            ):  # the arbiter of other vehicles may have set up DDS for other networks
                self._setup.context.logger.info("%s: DDS is not on 127.0.0.1 alone", self._resource)
        # The name of the journal distinguishes executives on one network.
        name = f"m2pem_ptz_{self._setup.context.journal.hex[:8]}"
        return join_runtime(self._settings.domain_id, name)

    def _listen(self, ros: "RosRuntime") -> None:
        from m2pem_plugin_ros import qos  # noqa: PLC0415  # they need ROS
        from sensor_msgs.msg import JointState  # noqa: PLC0415
        from std_msgs.msg import Float64MultiArray  # noqa: PLC0415
        from trajectory_msgs.msg import JointTrajectory  # noqa: PLC0415

        from m2pem_plugin_ptz.drivers.ros.images import ImageTopic, Recorder  # noqa: PLC0415
        from m2pem_plugin_ptz.drivers.ros.steering import JointController  # noqa: PLC0415

        own, clock = self._settings, self._setup.context.clock
        as_trajectory = own.command is Command.TRAJECTORY
        kind = JointTrajectory if as_trajectory else Float64MultiArray
        publisher = ros.node.create_publisher(kind, own.command_topic, qos.COMMANDS)
        subscription = ros.subscribe(JointState, own.joint_states, self._on_message, qos.TELEMETRY)
        self._made = [publisher, subscription]
        self._joint_controller = JointController(
            own.joints,
            self.reach,
            clock,
            lambda: self.ptz,
            publisher.publish,
            as_trajectory=as_trajectory,
        )
        self._images = ImageTopic(ros, own.image, clock)
        folder = self._setup.settings.pictures
        self._recorder = Recorder(self._images, folder, self._resource, clock)

    async def close(self) -> None:
        """Disconnect. The camera stays as it is, and a recording ends."""
        if self._joint_controller is not None:
            await self._joint_controller.close()
        if self._recorder is not None:
            await self._recorder.close()
        if self._images is not None:
            self._images.close()
        ros, self._ros = self._ros, None
        if ros is not None:
            for each in self._made[:1]:
                ros.node.destroy_publisher(each)
            for each in self._made[1:]:
                ros.node.destroy_subscription(each)
            self._made = []
            await leave_runtime(self._settings.domain_id)

    # --- state ----------------------------------------------------------------------------------

    @property
    def ptz(self) -> PanTiltZoom | None:
        endless = self._setup.settings.reach.endless
        return self._settings.joints.ptz(self._positions, endless=endless)

    @property
    def reach(self) -> Reach:
        reach = self._setup.settings.reach
        return reach if self._settings.joints.zooms else replace(reach, zoom_max=1.0)

    def refusal(self, behavior: str) -> str:
        if self._ros is None or self._images is None:
            return NOT_OPEN
        if behavior == "zoom" and not self._settings.joints.zooms:
            return "the fleet names no joint that zooms (connection.joints.zoom)"
        return ""

    def missing(self, behavior: str) -> str:
        """Return which topic of the camera is not there yet."""
        if self._ros is None or self._images is None:
            return NOT_OPEN
        if behavior in ("take_picture", "record_video"):
            is_there = self._images.has_publisher
            return "" if is_there else f"no publisher of images on {self._images.topic}"
        if self.ptz is None:
            return self._missing_joints()
        if not self._ros.node.count_subscribers(self._settings.command_topic):
            return f"no subscriber to {self._settings.command_topic}, which commands the joints"
        return ""

    # --- orders ---------------------------------------------------------------------------------

    def point(self, pan_rad: float, tilt_rad: float, rate_rad_s: float | None = None) -> None:
        if self._joint_controller is not None:
            self._joint_controller.point(pan_rad, tilt_rad, rate_rad_s)

    def zoom(self, level: float) -> None:
        if self._joint_controller is not None and self._settings.joints.zooms:
            self._joint_controller.zoom(level)

    def halt(self) -> None:
        if self._joint_controller is not None:
            self._joint_controller.halt()

    async def take_picture(self) -> CapturedImage:
        """Return the next image.

        Raises:
            CameraError: no image was received.
        """
        if self._images is None:
            raise CameraError(NOT_OPEN)
        frame = await self._images.next()
        return CapturedImage(frame.taken_us, frame.content, frame.suffix)

    async def start_recording(self) -> None:
        """Start to store images.

        Raises:
            CameraError: no images were received, or they cannot be stored.
        """
        if self._recorder is None:
            raise CameraError(NOT_OPEN)
        await self._recorder.start()

    async def stop_recording(self) -> str:
        """End the video, and return its file.

        Raises:
            CameraError: no video was begun, or not all images could be stored.
        """
        if self._recorder is None:
            raise CameraError(NOT_OPEN)
        return await self._recorder.stop()

    # --- inside ---------------------------------------------------------------------------------

    @property
    def _resource(self) -> ResourceId:
        return self._setup.connection.resource

    def _on_message(self, message: Any) -> None:
        found = self._settings.joints.read(message.name, message.position)
        self._positions.update(found)
        if self.ptz is None:
            self._other_joints = tuple(message.name)
        elif found:
            self._setup.on_contact()

    def _missing_joints(self) -> str:
        names = " and ".join(list(self._settings.joints.names.values())[:2])
        others = f"; it has {', '.join(self._other_joints)}" if self._other_joints else ""
        return f"{self._settings.joint_states} has no {names}{others}"
