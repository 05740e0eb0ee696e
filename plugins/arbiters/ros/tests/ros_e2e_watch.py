"""What vehicles do and are told, as a listener of the tests' own hears it over DDS."""

import threading
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple
from uuid import UUID

import rclpy
from action_msgs.msg import GoalStatusArray
from m2pem_interfaces.msg import BehaviorCommand, BehaviorStatus
from m2pem_plugin_ros.runtime import qos
from nav_msgs.msg import Odometry
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from ros_e2e_programs import until
from std_msgs.msg import UInt32

ACTIONS = ("execute_behavior", "navigate_through_poses", "navigate_to_pose", "backup")
MOVING_M_S = 0.5


class Sample(NamedTuple):
    """What odometry said: speed forwards, and where."""

    forward_m_s: float
    east_m: float
    north_m: float


class Track:
    """One vehicle. All of it is in the order in which it was heard.

    `begun_m`: how far north it was whenever it began to move. `starts`: goals that its node was
    told to START, as often as it was told. `statuses`: (goal, number, state). `goals`: how goals of
    actions stood.
    """

    def __init__(self) -> None:
        self.odometry: list[Sample] = []
        self.begun_m: list[float] = []
        self.starts: list[str] = []
        self.statuses: list[tuple[str, int, int]] = []
        self.goals: dict[str, list[int]] = defaultdict(list)

    @property
    def moves(self) -> bool:
        """Whether it moves now."""
        return bool(self.odometry) and self.odometry[-1].forward_m_s > MOVING_M_S

    @property
    def stands(self) -> bool:
        """Whether it has stood for the last samples."""
        last = self.odometry[-5:]
        return len(last) == 5 and all(abs(each.forward_m_s) < 0.01 for each in last)

    @property
    def north_m(self) -> float:
        """Where it is."""
        return self.odometry[-1].north_m

    def begun_before(self, north_m: float) -> int:
        """How often it has begun to move before it came there."""
        return sum(begun_m < north_m for begun_m in self.begun_m)

    def stood_on_the_way(self, from_m: float, to_m: float) -> list[Sample]:
        """Where it was not moving between two places on its way north."""
        way = [each for each in self.odometry if from_m < each.north_m < to_m]
        assert way, "it never was there"
        return [each for each in way if each.forward_m_s < MOVING_M_S]

    def accepted(self) -> list[str]:
        """Goals that its node has said it begins, in order."""
        begun: dict[str, None] = {}
        for goal, _, state in self.statuses:
            if state in (BehaviorStatus.ACCEPTED, BehaviorStatus.RUNNING):
                begun[goal] = None
        return list(begun)


class Watch:
    """Hears all vehicles, in a thread of its own."""

    def __init__(self, vehicles: Iterable[str], domain: int) -> None:
        self.tracks = {name: Track() for name in vehicles}
        self._context = rclpy.Context()
        rclpy.init(context=self._context, domain_id=domain)
        self._node = rclpy.create_node("watch", context=self._context)
        for name, track in self.tracks.items():
            self._on_message(name, track)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._thread = threading.Thread(target=self._spin, daemon=True)
        self._thread.start()

    def __getitem__(self, name: str) -> Track:
        return self.tracks[name]

    def until_heard(self) -> None:
        """Wait until all vehicles were heard."""
        self.until(lambda: all(track.odometry for track in self.tracks.values()))

    def until(self, true: Callable[[], Any]) -> Any:
        """Wait for something that vehicles do."""
        return until(true, lambda: {name: track.odometry[-1:] for name, track in self.items()})

    def items(self) -> Iterable[tuple[str, Track]]:
        """Vehicles by their names."""
        return self.tracks.items()

    def close(self) -> None:
        """Hear no more."""
        rclpy.try_shutdown(context=self._context)
        self._thread.join()
        self._node.destroy_node()
        self._executor.shutdown(timeout_sec=0)

    def _spin(self) -> None:
        try:
            self._executor.spin()
        except ExternalShutdownException:
            return

    def _on_message(self, name: str, track: Track) -> None:
        def odometry(message: Any) -> None:
            place = message.pose.pose.position
            track.odometry.append(Sample(message.twist.twist.linear.x, place.x, place.y))

        def motions(message: Any) -> None:
            if message.data:
                track.begun_m.append(track.north_m if track.odometry else 0.0)

        def command(message: Any) -> None:
            if message.verb == BehaviorCommand.START:
                track.starts.append(message.id)

        def status(message: Any) -> None:
            track.statuses.append((message.id, message.number, message.state))

        def goals(message: Any) -> None:
            for each in message.status_list:
                goal = str(UUID(bytes=bytes(each.goal_info.goal_id.uuid)))
                if track.goals[goal][-1:] != [each.status]:
                    track.goals[goal].append(each.status)

        subscribe = self._node.create_subscription
        subscribe(Odometry, f"/{name}/odom", odometry, qos.TELEMETRY)
        subscribe(UInt32, f"/{name}/motions", motions, qos.STATUS)
        subscribe(BehaviorCommand, f"/{name}/command", command, qos.COMMANDS)
        subscribe(BehaviorStatus, f"/{name}/behavior_status", status, qos.BEHAVIOR_STATUS)
        for action in ACTIONS:
            topic = f"/{name}/{action}/_action/status"
            subscribe(GoalStatusArray, topic, goals, qos.STATUS)


@contextmanager
def watching(vehicles: Iterable[str], domain: int) -> Iterator[Watch]:
    """Hear them while the block lasts."""
    watch = Watch(vehicles, domain)
    try:
        yield watch
    finally:
        watch.close()
