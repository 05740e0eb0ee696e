"""A simulated street sweeper that m2pem commands: its whole arbiter node, in plain rclpy.

python street_sweeper.py --ros-args -r __ns:=/sweeper1 [-p NAME:=VALUE]...

Parameters: `vehicle`, its name in the fleet; `latitude` and `longitude`, where it begins, in
degrees; `hopper`, how full its hopper is at the beginning, from 0 to 1; `capacity`, how many metres
of street fill it; `faster`, how many times as fast as a real one it does everything.

For another vehicle, write other `BEHAVIORS`, and have `roll` drive it.
"""

import contextlib
import json
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import rclpy
from m2pem_interfaces.msg import (
    BehaviorCommand,
    BehaviorStatus,
    CommandRefusal,
    VehicleStatus,
)
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import NavSatFix, NavSatStatus

COMMANDS = QoSProfile(depth=10)
BEHAVIOR_STATUS = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
VEHICLE_STATUS = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)

TICK_S = 0.05
TOP_SPEED_M_S = 3.0
SWEEPING_M_S = 1.5
ACCELERATION_M_S2 = 1.5
BRAKING_M_S2 = 5.0
NEAR_M = 0.5
EMPTYING_S = 3.0
REMEMBERED = 1000
METRES_PER_DEGREE = 111_320.0
"""Of latitude; near enough for the few kilometres of a simulated town."""

Place = tuple[float, float]
"""Metres east and north of where the sweeper began."""


class RefusedError(Exception):
    """The command cannot be done; nothing moves."""


class FailedError(Exception):
    """The behavior cannot be brought to its end. `code` is for the mission to catch."""

    def __init__(self, code: str, reason: str) -> None:
        super().__init__(reason)
        self.code = code


@dataclass
class Job:
    """The behavior that is being done. `steps` drives for a tick each time it is asked on."""

    id: str
    run: str
    speed_m_s: float
    steps: Iterator[None]
    cancelled: bool = False


class Sweeper(Node):
    """The vehicle, and what the executive hears of it."""

    def __init__(self) -> None:
        super().__init__("arbiter")
        self.vehicle = self.declare_parameter("vehicle", "sweeper1").value
        self.origin = (
            self.declare_parameter("latitude", 38.1075).value,
            self.declare_parameter("longitude", -77.3192).value,
        )
        self.hopper = self.declare_parameter("hopper", 0.0).value
        self.capacity_m = self.declare_parameter("capacity", 200.0).value
        faster = self.declare_parameter("faster", 1.0).value
        self.place: Place = (0.0, 0.0)
        self.yaw_rad = 0.0
        self.speed_m_s = 0.0
        self.held = False
        self.job: Job | None = None
        self.last: dict[str, BehaviorStatus] = {}
        self.epochs: dict[str, int] = {}
        self.statuses = self.create_publisher(BehaviorStatus, "behavior_status", BEHAVIOR_STATUS)
        self.refusals = self.create_publisher(CommandRefusal, "command_refusal", COMMANDS)
        self.states = self.create_publisher(VehicleStatus, "vehicle_status", VEHICLE_STATUS)
        self.fixes = self.create_publisher(NavSatFix, "fix", 10)
        self.odometry = self.create_publisher(Odometry, "odom", 10)
        self.create_subscription(BehaviorCommand, "command", self.obey, COMMANDS)
        self.create_timer(TICK_S / faster, self.tick)
        self.create_timer(0.1 / faster, self.say_where)
        self.create_timer(0.5 / faster, self.say_how)

    # --- commands of the executive --------------------------------------------------------------

    def obey(self, command: BehaviorCommand) -> None:
        """Carry out a command. Commands with an unknown verb, and late ones, get no answer."""
        verbs: dict[int, Callable[[BehaviorCommand], None]] = {
            BehaviorCommand.START: self.start,
            BehaviorCommand.CANCEL: self.cancel,
            BehaviorCommand.HOLD: lambda _: self.hold(True),
            BehaviorCommand.RESUME: lambda _: self.hold(False),
            BehaviorCommand.QUERY: self.repeat_status,
            BehaviorCommand.ADJUST: self.adjust,
            BehaviorCommand.CLAIM: lambda _: None,
        }
        if command.verb not in verbs:
            return
        past = self.is_past(command)
        if past and command.verb != BehaviorCommand.HOLD:
            self.refuse(command)
        # A START gets a status, a QUERY its answer, and whoever wants the vehicle to stand may.
        answered = (BehaviorCommand.START, BehaviorCommand.QUERY, BehaviorCommand.HOLD)
        if not past or command.verb in answered:
            verbs[command.verb](command)

    def start(self, command: BehaviorCommand) -> None:
        """Begin a behavior, or reject it."""
        if not command.id:
            return
        if command.id in self.last:  # a repeated START: the behavior has begun already
            self.statuses.publish(self.last[command.id])
            return
        if self.is_past(command):
            reason = f"epoch {command.epoch} of its run is past"
            self.report(command.id, BehaviorStatus.REJECTED, "STALE_EPOCH", reason)
            return
        try:
            steps, speed_m_s = self.prepare(command)
            if self.job is not None and self.job.id not in command.preempts:
                raise RefusedError(f"busy with {self.job.id}")
        except RefusedError as error:
            self.report(command.id, BehaviorStatus.REJECTED, reason=str(error))
            return
        if self.job is not None:
            self.end(BehaviorStatus.CANCELLED, reason=f"{command.id} took over")
        self.held = False
        self.report(command.id, BehaviorStatus.ACCEPTED)
        self.job = Job(command.id, command.run, speed_m_s, steps)
        self.report(command.id, BehaviorStatus.RUNNING)

    def prepare(self, command: BehaviorCommand) -> tuple[Iterator[None], float]:
        """The steps of a behavior and the speed to do it with.

        Raises:
            RefusedError: there is no such behavior, or a parameter does not fit.
        """
        if command.behavior not in BEHAVIORS:
            raise RefusedError(f"no behavior '{command.behavior}'; known: {', '.join(BEHAVIORS)}")
        steps, names, usual_m_s = BEHAVIORS[command.behavior]
        given = {each.key: parsed(each.key, each.value) for each in command.parameters}
        if strange := [name for name in given if name not in names]:
            raise RefusedError(f"this vehicle's {command.behavior} takes no {', '.join(strange)}")
        speed_m_s = number(given, "speed", usual_m_s)
        if not 0.0 < speed_m_s <= TOP_SPEED_M_S:
            raise RefusedError(f"speed: {speed_m_s:g} m/s is not within 0 to {TOP_SPEED_M_S:g}")
        return steps(self, given), speed_m_s

    def cancel(self, command: BehaviorCommand) -> None:
        """Have a behavior end; it has ended when the vehicle stands."""
        if self.job is not None and self.job.id == command.id:
            self.job.cancelled = True

    def hold(self, held: bool) -> None:
        """Stand, or go on; the behavior stays."""
        self.held = held
        self.say_how()

    def adjust(self, command: BehaviorCommand) -> None:
        """Another speed is all that can be changed on the way."""
        if self.job is None or self.job.id != command.id:
            return
        with contextlib.suppress(RefusedError):
            given = {each.key: parsed(each.key, each.value) for each in command.parameters}
            speed_m_s = number(given, "speed", self.job.speed_m_s)
            self.job.speed_m_s = min(max(speed_m_s, 0.1), TOP_SPEED_M_S)

    def repeat_status(self, command: BehaviorCommand) -> None:
        """Publish the last status of a behavior again."""
        unknown = BehaviorStatus(id=command.id, number=0, state=BehaviorStatus.UNKNOWN)
        self.statuses.publish(self.last.get(command.id, unknown))

    def is_past(self, command: BehaviorCommand) -> bool:
        """Whether another executive drives this run by now."""
        newest = max(command.epoch, self.epochs.get(command.run, 0))
        self.epochs[command.run] = newest
        return command.epoch < newest

    def refuse(self, command: BehaviorCommand) -> None:
        """Say that another executive drives the run."""
        refusal = CommandRefusal(verb=command.verb, id=command.id, run=command.run)
        refusal.stamp = self.get_clock().now().to_msg()
        refusal.epoch, refusal.newest = command.epoch, self.epochs[command.run]
        refusal.code = "STALE_EPOCH"
        refusal.reason = f"epoch {command.epoch} of its run is past"
        self.refusals.publish(refusal)

    # --- what the executive hears ---------------------------------------------------------------

    def report(self, behavior: str, state: int, code: str = "", reason: str = "") -> None:
        """Say what became of a behavior, once, and remember it for who asks."""
        before = self.last.pop(behavior, None)
        status = BehaviorStatus(id=behavior, state=state, code=code, reason=reason)
        status.stamp = self.get_clock().now().to_msg()
        status.number = before.number + 1 if before is not None else 1
        self.last[behavior] = status
        if len(self.last) > REMEMBERED:
            del self.last[next(iter(self.last))]
        self.statuses.publish(status)

    def end(self, state: int, code: str = "", reason: str = "") -> None:
        """The behavior has ended."""
        assert self.job is not None
        ended, self.job, self.held = self.job, None, False
        self.report(ended.id, state, code, reason)
        self.say_how()

    def say_how(self) -> None:
        """Publish the vehicle's status; that it goes on coming says that the vehicle is there."""
        status = VehicleStatus(vehicle=self.vehicle, mode="autonomous", battery=math.nan)
        status.stamp = self.get_clock().now().to_msg()
        status.behavior = self.job.id if self.job is not None else ""
        status.held = self.held
        status.readiness = VehicleStatus.READY
        self.states.publish(status)

    def say_where(self) -> None:
        """Publish position, heading and speed. The frame of the odometry begins where we began."""
        now = self.get_clock().now().to_msg()
        fix = NavSatFix(altitude=math.nan)
        fix.header.stamp, fix.header.frame_id = now, "base_link"
        fix.status.status = NavSatStatus.STATUS_FIX
        fix.latitude, fix.longitude = self.on_earth(self.place)
        self.fixes.publish(fix)
        odom = Odometry(child_frame_id="base_link")
        odom.header.stamp, odom.header.frame_id = now, "odom"
        odom.pose.pose.position.x, odom.pose.pose.position.y = self.place
        odom.pose.pose.orientation.z = math.sin(self.yaw_rad / 2)
        odom.pose.pose.orientation.w = math.cos(self.yaw_rad / 2)
        odom.twist.twist.linear.x = self.speed_m_s
        self.odometry.publish(odom)

    # --- driving --------------------------------------------------------------------------------

    def tick(self) -> None:
        """Drive for a moment."""
        if self.job is None or self.held or self.job.cancelled:
            self.roll(0.0)
            if self.job is not None and self.job.cancelled and self.speed_m_s == 0.0:
                self.end(BehaviorStatus.CANCELLED)
            return
        try:
            next(self.job.steps)
        except StopIteration:
            self.end(BehaviorStatus.SUCCEEDED)
        except FailedError as failure:
            self.end(BehaviorStatus.FAILED, failure.code, str(failure))

    def roll(self, speed_m_s: float) -> float:
        """Move for a tick, at that speed as soon as possible; returns the metres."""
        faster = min(speed_m_s, self.speed_m_s + ACCELERATION_M_S2 * TICK_S)
        self.speed_m_s = max(faster, self.speed_m_s - BRAKING_M_S2 * TICK_S, 0.0)
        metres = self.speed_m_s * TICK_S
        east_m, north_m = self.place
        self.place = (
            east_m + metres * math.cos(self.yaw_rad),
            north_m + metres * math.sin(self.yaw_rad),
        )
        return metres

    def drive_to(self, place: Place, near_m: float = NEAR_M) -> Iterator[float]:
        """Drive until it is near; gives the metres of each tick."""
        while (left_m := math.dist(self.place, place)) > near_m:
            assert self.job is not None
            self.yaw_rad = math.atan2(place[1] - self.place[1], place[0] - self.place[0])
            yield self.roll(min(self.job.speed_m_s, math.sqrt(BRAKING_M_S2 * left_m)))

    def stop(self) -> Iterator[None]:
        """Come to a stand."""
        while self.speed_m_s > 0.0:
            self.roll(0.0)
            yield

    def wait(self, seconds: float) -> Iterator[None]:
        """Stand for a time."""
        for _ in range(round(seconds / TICK_S)):
            yield

    def on_earth(self, place: Place) -> tuple[float, float]:
        """Latitude and longitude in degrees."""
        latitude, longitude = self.origin
        narrowed = METRES_PER_DEGREE * math.cos(math.radians(latitude))
        return latitude + place[1] / METRES_PER_DEGREE, longitude + place[0] / narrowed

    def in_town(self, position: list[float]) -> Place:
        """A GeoJSON position, longitude first, as a place."""
        latitude, longitude = self.origin
        narrowed = METRES_PER_DEGREE * math.cos(math.radians(latitude))
        return (position[0] - longitude) * narrowed, (position[1] - latitude) * METRES_PER_DEGREE


# --- the behaviors: each drives for a tick whenever it is asked for the next step ---------------

Given = dict[str, object]


def goto(sweeper: Sweeper, given: Given) -> Iterator[None]:
    """Drive to a point."""
    (place,) = places(sweeper, given, "target", "Point")
    near_m = number(given, "tolerance", NEAR_M)

    def steps() -> Iterator[None]:
        for _ in sweeper.drive_to(place, max(near_m, NEAR_M)):
            yield
        yield from sweeper.stop()

    return steps()


def stand(sweeper: Sweeper, given: Given) -> Iterator[None]:
    """Stop, and stand for a time if there is one."""
    duration_s = number(given, "duration", 0.0)

    def steps() -> Iterator[None]:
        yield from sweeper.stop()
        yield from sweeper.wait(duration_s)

    return steps()


def sweep_street(sweeper: Sweeper, given: Given) -> Iterator[None]:
    """Drive along a route with the brush down, there and back if asked for more passes."""
    street = places(sweeper, given, "route", "LineString")
    passes = round(number(given, "passes", 1))

    def steps() -> Iterator[None]:
        for turn in range(passes):
            way = street if turn % 2 == 0 else street[::-1]
            for _ in sweeper.drive_to(way[0]):
                yield
            for place in way[1:]:
                for metres in sweeper.drive_to(place):
                    sweeper.hopper += metres / sweeper.capacity_m
                    if sweeper.hopper >= 1.0:
                        yield from sweeper.stop()
                        raise FailedError("HOPPER_FULL", "the hopper is full")
                    yield
        yield from sweeper.stop()

    return steps()


def empty_hopper(sweeper: Sweeper, _: Given) -> Iterator[None]:
    """Stand, and empty the hopper."""

    def steps() -> Iterator[None]:
        yield from sweeper.stop()
        yield from sweeper.wait(EMPTYING_S)
        sweeper.hopper = 0.0

    return steps()


Behavior = Callable[[Sweeper, Given], Iterator[None]]
BEHAVIORS: dict[str, tuple[Behavior, tuple[str, ...], float]] = {
    "goto": (goto, ("target", "speed", "tolerance"), TOP_SPEED_M_S),
    "drive_stop": (stand, (), TOP_SPEED_M_S),
    "hold": (stand, ("duration",), TOP_SPEED_M_S),
    "sweep_street": (sweep_street, ("route", "speed", "passes"), SWEEPING_M_S),
    "empty_hopper": (empty_hopper, (), TOP_SPEED_M_S),
}
"""By name: what it does, the parameters that it takes, and its usual speed."""


def parsed(name: str, text: str) -> object:
    """The value of a parameter, which is JSON."""
    try:
        return json.loads(text, parse_constant=float)
    except ValueError as error:
        raise RefusedError(f"{name}: not JSON: {error}") from error


def number(given: Given, name: str, usual: float) -> float:
    """A number among the parameters; the usual one if it is not there."""
    value = given.get(name)
    if value is None:
        return usual
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value < math.inf:
        raise RefusedError(f"{name}: {value!r} is not a number from 0 on")
    return float(value)


def places(sweeper: Sweeper, given: Given, name: str, kind: str) -> list[Place]:
    """Where a Point, or along what a LineString, leads: a GeoJSON Feature among the parameters."""
    feature = given.get(name)
    try:
        geometry = feature["geometry"]  # type: ignore[index]
        coordinates = geometry["coordinates"]
        positions = [coordinates] if kind == "Point" else coordinates
        found = [sweeper.in_town([float(part) for part in each]) for each in positions]
        if geometry["type"] == kind and found and all(map(math.isfinite, sum(found, ()))):
            return found
    except (KeyError, TypeError, ValueError, IndexError):
        pass
    raise RefusedError(f"{name}: {feature!r} is no GeoJSON Feature with a {kind}")


def main() -> None:
    """Be the vehicle until the end of the process."""
    rclpy.init()
    sweeper = Sweeper()
    print("ready", flush=True)
    try:
        rclpy.spin(sweeper)
    except (Exception, KeyboardInterrupt):  # at the end, whatever it did just then fails
        if rclpy.ok():
            raise


if __name__ == "__main__":
    main()
