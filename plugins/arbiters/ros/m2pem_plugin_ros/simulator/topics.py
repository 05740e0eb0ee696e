"""The topics of a simulated base: its sensors, and cmd_vel."""

import math
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Twist as TwistMessage
from geometry_msgs.msg import TwistStamped
from m2pem_interfaces.msg import Detection, GeoPoint
from nav_msgs.msg import Odometry
from sensor_msgs.msg import BatteryState, NavSatFix, NavSatStatus
from std_msgs.msg import String, UInt32

from m2pem.api import ellipsoidal_m
from m2pem.api.clock import Clock, RateTimer
from m2pem_plugin_ros.frames import quaternion_of_yaw, to_geodetic
from m2pem_plugin_ros.interfaces import set_stamp
from m2pem_plugin_ros.pose import Twist
from m2pem_plugin_ros.runtime import qos
from m2pem_plugin_ros.settings import FixAltitude, OdomFrame
from m2pem_plugin_ros.simulator.faults import TrafficFaults
from m2pem_plugin_ros.simulator.sensors import Detector, Reading, Target
from m2pem_plugin_ros.simulator.traffic import FilteredRuntime
from m2pem_plugin_ros.simulator.transforms import Transforms
from m2pem_plugin_ros.simulator.vehicle import Vehicle

ODOMETRY_HZ, FIX_HZ, BATTERY_HZ, DIAGNOSTICS_HZ = 20.0, 5.0, 1.0, 1.0
POSITION_M2, YAW_RAD2, GPS_M2 = 0.01, 0.001, 0.25
"""Published variances, whatever the inaccuracy is."""


class BaseTopics:
    """The publishers and subscriptions of one vehicle. They end with its nodes."""

    def __init__(
        self,
        ros: FilteredRuntime,
        vehicle: Vehicle,
        traffic_faults: TrafficFaults,
        clock: Clock,
    ) -> None:
        self._vehicle, self._traffic_faults, self._clock = vehicle, traffic_faults, clock
        settings = vehicle.spec.settings
        topics, create = settings.topics, ros.node.create_publisher
        self._odometry = create(Odometry, topics.odom, qos.TELEMETRY)
        self._fix = create(NavSatFix, topics.fix, qos.TELEMETRY)
        self._battery = create(BatteryState, topics.battery, qos.TELEMETRY)
        self._diagnostics = create(DiagnosticArray, topics.diagnostics, qos.EVENTS)
        self._motions = create(UInt32, "motions", qos.STATUS)
        self._detections = {
            (each.topic, each.plain): create(
                String if each.plain else Detection, each.topic, qos.EVENTS
            )
            for each in (detector.spec for detector in vehicle.detectors)
        }
        kind = TwistStamped if settings.stamped else TwistMessage
        ros.subscribe(kind, topics.cmd_vel, self._command, qos.TELEMETRY)
        self._rate_timers = {
            self._publish_odometry: RateTimer(ODOMETRY_HZ),
            self._publish_fix: RateTimer(FIX_HZ),
            self._publish_battery: RateTimer(BATTERY_HZ),
            self._publish_diagnostics: RateTimer(DIAGNOSTICS_HZ),
        }
        self._published_motions = -1
        frame = settings.namespace.strip("/")
        self._base_frame = f"{frame}/base_link" if frame else "base_link"
        self._odom_frame = str(settings.odom_frame)
        self._transforms: Transforms | None = None
        if settings.odom_frame is OdomFrame.TF:
            self._odom_frame = f"{frame}/odom" if frame else "odom"
            self._base_frame = settings.base_frame or self._base_frame
            self._transforms = Transforms(
                ros.node, settings, self._odom_frame, self._base_frame, vehicle.spec.start
            )
        self._odometry_message = self._make_odometry()

    def publish(self) -> None:
        """Publish what is due."""
        for publish, pace in self._rate_timers.items():
            if pace.is_due(self._vehicle.now_s):
                publish()
        if (motions := self._vehicle.body.motions) != self._published_motions:
            self._published_motions = motions
            self._motions.publish(UInt32(data=motions))
        for detector, found in self._vehicle.detections():
            self._publish_detection(detector, found)

    def _command(self, message: Any) -> None:
        twist = message.twist if hasattr(message, "twist") else message
        self._vehicle.command(Twist(twist.linear.x, twist.angular.z, twist.linear.y))

    # --- sensors ----------------------------------------------------------------------------------

    def _make_odometry(self) -> Any:
        message = Odometry(child_frame_id=self._base_frame)
        message.header.frame_id = self._odom_frame
        for index in (0, 7):
            message.pose.covariance[index] = message.twist.covariance[index] = POSITION_M2
        message.pose.covariance[35] = message.twist.covariance[35] = YAW_RAD2
        return message

    def _publish_odometry(self) -> None:
        if self._traffic_faults.no_odometry:
            return
        reading = self._vehicle.odometer.read(self._clock.now_us())
        message = _odometry(self._odometry_message, reading)
        self._odometry.publish(message)
        if self._transforms is not None:
            self._transforms.publish(message)

    def _publish_fix(self) -> None:
        lost, place = self._vehicle.gps_lost, self._vehicle.position
        altitude_m = place.altitude_m
        if self._vehicle.spec.settings.fix_altitude is FixAltitude.ELLIPSOID:
            altitude_m = ellipsoidal_m(*place.latlon, altitude_m)
        message = NavSatFix(
            latitude=math.nan if lost else place.latitude_deg,
            longitude=math.nan if lost else place.longitude_deg,
            altitude=math.nan if lost else altitude_m,
        )
        status = NavSatStatus.STATUS_NO_FIX if lost else NavSatStatus.STATUS_FIX
        message.status = NavSatStatus(status=status, service=NavSatStatus.SERVICE_GPS)
        if not lost:
            for index in (0, 4, 8):
                message.position_covariance[index] = GPS_M2
            message.position_covariance_type = NavSatFix.COVARIANCE_TYPE_APPROXIMATED
        self._stamp(message.header, self._base_frame)
        self._fix.publish(message)

    def _publish_battery(self) -> None:
        battery = self._vehicle.battery
        message = BatteryState(
            percentage=battery.fraction,
            voltage=battery.voltage_v,
            present=True,
            power_supply_status=BatteryState.POWER_SUPPLY_STATUS_DISCHARGING,
        )
        self._stamp(message.header, self._base_frame)
        self._battery.publish(message)

    def _publish_diagnostics(self) -> None:
        vehicle, problems = self._vehicle, self._vehicle.problems
        status = DiagnosticStatus(
            level=DiagnosticStatus.WARN if problems else DiagnosticStatus.OK,
            name=f"{vehicle.spec.name}: base",
            message=", ".join(problems) or "all is well",
            hardware_id=vehicle.spec.hardware_id,
            values=[
                KeyValue(key="driven_m", value=f"{vehicle.body.driven_m:.1f}"),
                KeyValue(key="battery", value=f"{vehicle.battery.fraction:.3f}"),
            ],
        )
        message = DiagnosticArray(status=[status])
        self._stamp(message.header, "")
        self._diagnostics.publish(message)

    def _publish_detection(self, detector: Detector, found: Target) -> None:
        spec, origin = detector.spec, self._vehicle.spec.origin
        publisher = self._detections[spec.topic, spec.plain]
        if spec.plain:
            publisher.publish(String(data=found.type))
            return
        place = to_geodetic(found.east_m, found.north_m, 0.0, origin)
        message = Detection(
            type=found.type,
            source=spec.payload,
            position_kind=Detection.GEOGRAPHIC,
            position_geographic=GeoPoint(
                latitude_deg=place.latitude_deg,
                longitude_deg=place.longitude_deg,
                altitude_m=origin[2],
            ),
        )
        self._stamp(message.header, "map")
        publisher.publish(message)

    def _stamp(self, header: Any, frame: str) -> None:
        set_stamp(header.stamp, self._clock.now_us())
        header.frame_id = frame


def _odometry(message: Any, reading: Reading) -> Any:
    """Fill the message, which is reused, as making one is slow."""
    set_stamp(message.header.stamp, reading.time_us)
    pose, twist = message.pose.pose, message.twist.twist
    pose.position.x, pose.position.y = reading.pose.east_m, reading.pose.north_m
    pose.position.z = reading.pose.up_m
    _, _, pose.orientation.z, pose.orientation.w = quaternion_of_yaw(reading.pose.yaw_rad)
    twist.linear.x, twist.angular.z = reading.twist.forward_m_s, reading.twist.yaw_rad_s
    return message
