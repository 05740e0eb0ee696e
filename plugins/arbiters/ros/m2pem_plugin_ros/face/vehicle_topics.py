"""The topics of one vehicle: odom, fix, battery_state, imu and joint_states."""

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any

from nav_msgs.msg import Odometry
from rclpy.node import Node
from sensor_msgs.msg import BatteryState, Imu, JointState, NavSatFix

from m2pem.api import LocalFrame, PayloadState, ResourceId, VehicleState
from m2pem_plugin_ros.face import telemetry_messages as messages
from m2pem_plugin_ros.face.names import BASE, Names
from m2pem_plugin_ros.face.publisher import TelemetryPublisher
from m2pem_plugin_ros.frames import Vector, to_local


class VehicleTopics:
    """Publishes the telemetry of a vehicle and its payloads. Topics that the vehicle has itself, by
    its connection, are not made."""

    def __init__(
        self,
        node: Node,
        vehicle: ResourceId,
        names: Names,
        frame: LocalFrame,
        rates: Mapping[str, float],
    ) -> None:
        self._frame = frame
        self._odom, self._base = names.odom_frame(vehicle), names.frame(vehicle, BASE)
        self._payloads: dict[ResourceId, PayloadState] = {}
        self._names = names
        base = self._base
        kinds: tuple[tuple[str, Any, Callable[[VehicleState], Any]], ...] = (
            ("odom", Odometry, self._odometry),
            ("fix", NavSatFix, partial(messages.fix, frame=base)),
            ("battery_state", BatteryState, partial(messages.battery, frame=base)),
            ("imu", Imu, partial(messages.imu, frame=base)),
        )
        self._of_vehicle = [
            TelemetryPublisher[VehicleState](node, kind, topic, rates[leaf], make)
            for leaf, kind, make in kinds
            if not names.left_to_vehicle(topic := names.topic(vehicle, leaf))
        ]
        self._joints: TelemetryPublisher[PayloadState] | None = None
        self._make_joints = partial(
            TelemetryPublisher[PayloadState],
            node,
            JointState,
            names.topic(vehicle, "joint_states"),
            rates["joint_states"],
            self._joint_states,
        )

    def put(self, state: VehicleState) -> None:
        """Publish the state of the vehicle."""
        for publisher in self._of_vehicle:
            publisher.put(state)

    def put_payload(self, state: PayloadState) -> None:
        """Publish the joints of a payload, if it has any."""
        if state.pan_rad is None and state.tilt_rad is None:
            return
        self._payloads[state.resource] = state
        if self._joints is None:
            self._joints = self._make_joints()
        self._joints.put(state)

    def publishers(self) -> Iterator[TelemetryPublisher[Any]]:
        """All publishers that exist now."""
        yield from self._of_vehicle
        if self._joints is not None:
            yield self._joints

    def place(self, state: VehicleState) -> Vector | None:
        """Return where the vehicle is in the local frame of the fleet; None: that is not known."""
        if state.position is None:
            return None
        return to_local(state.position, self._frame.origin)

    def transform(self, state: VehicleState) -> Any:
        """Return the transform odom -> base_link; None if the position is not known."""
        place = self.place(state)
        if place is None:
            return None
        attitude = messages.attitude_of(state)
        return messages.transform(state.time_us, self._odom, self._base, place, attitude)

    def _odometry(self, state: VehicleState) -> Any:
        place = self.place(state)
        if place is None:
            return None
        return messages.odometry(state, place, self._odom, self._base)

    def _joint_states(self, _: PayloadState) -> Any:
        joints = [
            (self._names.joint(each, "pan"), self._names.joint(each, "tilt"))
            for each in self._payloads
        ]
        return messages.joint_states(list(self._payloads.values()), joints)
