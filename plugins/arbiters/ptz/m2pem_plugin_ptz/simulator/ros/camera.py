"""The topics of one simulated camera. It needs ROS."""

import logging
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from m2pem_plugin_ros import RosRuntime, qos
from sensor_msgs.msg import CompressedImage, JointState
from std_msgs.msg import Float64MultiArray, String
from trajectory_msgs.msg import JointTrajectory

from m2pem.api import US_PER_S, Clock, Connection
from m2pem.api.clock import RateTimer
from m2pem.api.faults import Effect, FaultError, FaultGrammar, FaultKind, FaultSchedule, fixed
from m2pem_plugin_ptz.drivers.ros.settings import Axis, Command, RosSettings
from m2pem_plugin_ptz.gimbal import Reach
from m2pem_plugin_ptz.simulator.ros.gimbal import Gimbal
from m2pem_plugin_ptz.simulator.ros.image import picture

JOINTS_HZ, IMAGES_HZ = 20.0, 5.0

logger = logging.getLogger(__name__)


@dataclass(slots=True)
class CameraFaults:
    """`silent`: no joint states; `stuck`: the joints do not turn; `blind`: no images; `garbled`:
    invalid images."""

    silent: bool = False
    stuck: bool = False
    blind: bool = False
    garbled: bool = False


def _switch(fault: str) -> Callable[[re.Match[str]], Effect["SimulatedCamera"]]:
    return fixed(
        lambda camera: setattr(camera.faults, fault, True),
        lambda camera: setattr(camera.faults, fault, False),
    )


GRAMMAR: FaultGrammar["SimulatedCamera"] = FaultGrammar(
    {
        **{
            fault: FaultKind(fault, _switch(fault))
            for fault in ("silent", "stuck", "blind", "garbled")
        },
        "well": FaultKind("well", fixed(lambda camera: camera.clear_faults())),
    },
    "silent at 10 s for 5 s",
)


@dataclass(frozen=True, slots=True)
class NodeSpec:
    """`connection`: of the arbiter on board to the pan-tilt unit. `origin`: as in
    `ArbiterContext`."""

    connection: Connection
    namespace: str
    origin: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class CameraSpec:
    """`name`: of the payload, such as evsg1/ptz. `settings`: as the executive has them. `node`: its
    own m2pem node, if any."""

    name: str
    settings: RosSettings
    reach: Reach
    node: NodeSpec | None = None


class SimulatedCamera:
    """A camera on a pan-tilt unit. A std_msgs/String on `sim_fault`, beside its joint states, plans
    a fault; `sim_fault_is` confirms it."""

    def __init__(self, ros: RosRuntime, spec: CameraSpec, clock: Clock) -> None:
        self.spec = spec
        self.gimbal = Gimbal(spec.reach)
        self._clock = clock
        own, create = spec.settings, ros.node.create_publisher
        self._joints = create(JointState, own.joint_states, qos.TELEMETRY)
        self._images = create(CompressedImage, own.image, qos.TELEMETRY)
        as_trajectory = own.command is Command.TRAJECTORY
        if as_trajectory:
            ros.subscribe(JointTrajectory, own.command_topic, self._follow, qos.COMMANDS)
        else:
            ros.subscribe(Float64MultiArray, own.command_topic, self._go, qos.COMMANDS)
        switch = f"{own.joint_states.rpartition('/')[0]}/sim_fault"
        ros.subscribe(String, switch, self._switch, qos.COMMANDS)
        self._fault_is = create(String, f"{switch}_is", qos.STATUS)
        self._started_us = clock.now_us()
        self._now_s = 0.0
        self._joints_due, self._images_due = RateTimer(JOINTS_HZ), RateTimer(IMAGES_HZ)
        self.clear_faults()

    def clear_faults(self) -> None:
        """End all faults, and forget those that are planned."""
        self.faults, self._schedule = CameraFaults(), FaultSchedule()

    def step(self) -> None:
        """Advance, and publish what is due."""
        before_s, self._now_s = self._now_s, (self._clock.now_us() - self._started_us) / US_PER_S
        self._schedule.run_until(self._now_s)
        if not self.faults.stuck:
            self.gimbal.step(self._now_s - before_s)
        if self._joints_due.is_due(self._now_s) and not self.faults.silent:
            self._joints.publish(self._joint_state())
        if (
            self._images_due.is_due(self._now_s)
            and not self.faults.blind
            and self._images.get_subscription_count()
        ):
            self._images.publish(self._image())

    # --- commands -------------------------------------------------------------------------------

    def _follow(self, message: Any) -> None:
        if not message.points:
            return
        point = message.points[-1]
        self._move(message.joint_names, point.positions, _seconds(point.time_from_start))

    def _go(self, message: Any) -> None:
        self._move(list(self.spec.settings.joints.names.values()), message.data, 0.0)

    def _move(self, names: Any, positions: Any, seconds: float) -> None:
        joints = self.spec.settings.joints
        requested = {**joints.positions(self.gimbal.ptz), **joints.read(names, positions)}
        to = joints.ptz(requested)
        if to is not None:
            self.gimbal.move(to, seconds)

    def _switch(self, message: Any) -> None:
        try:
            fault = GRAMMAR.parse(message.data)
        except FaultError as error:
            logger.warning("%s: %s", self.spec.name, error)
            return
        self._after(fault.at_s or 0.0, lambda: fault.start(self, self._after))
        self._fault_is.publish(message)

    def _after(self, seconds: float, call: Callable[[], object]) -> None:
        if seconds <= 0:
            call()
        else:
            self._schedule.at(self._now_s + seconds, call)

    # --- what it says ---------------------------------------------------------------------------

    def _joint_state(self) -> Any:
        joints = self.spec.settings.joints
        positions = joints.positions(self.gimbal.ptz)
        names = [joints.names[axis] for axis in positions]
        message = JointState(name=["wheel", *names], position=[0.0, *positions.values()])
        self._stamp(message)
        return message

    def _image(self) -> Any:
        content = picture(self.gimbal.ptz, self.spec.reach.view_rad)
        if self.faults.garbled:
            content = b"GIF89a" + content
        message = CompressedImage(format="jpeg", data=content)
        self._stamp(message)
        return message

    def _stamp(self, message: Any) -> None:
        stamp = message.header.stamp
        stamp.sec, rest_us = divmod(self._clock.now_us(), US_PER_S)
        stamp.nanosec = rest_us * 1000
        message.header.frame_id = self.spec.settings.joints.names[Axis.PAN]


def _seconds(duration: Any) -> float:
    return float(duration.sec) + float(duration.nanosec) / 1e9
