"""The clock of a node with `use_sim_time`: it follows /clock, and never goes back."""

import asyncio
import heapq
import itertools
from collections.abc import Callable

from rclpy.qos import QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock as ClockMessage

from m2pem_plugin_ros.runtime.ros_runtime import RosRuntime

TOPIC = "/clock"
LATEST = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)

STANDS_AFTER_S = 1.0
"""Real seconds without a change of /clock, after which it counts as standing."""


class RosClock:
    """Implements `m2pem.api.Clock` by /clock.

    It begins at the first message of /clock, stands while /clock stands, and has any pace. When
    /clock jumps back, as at the reset of a simulation, it stands at that moment, and goes on from
    there with /clock: time that was shown is never shown again. `on_jump` gets the seconds of such
    a jump.
    """

    speed = 1.0

    def __init__(self, ros: RosRuntime) -> None:
        self.on_jump: Callable[[float], None] | None = None
        self._loop = asyncio.get_running_loop()
        self._now_us = 0
        self._offset_us: int | None = None
        self._changed_s = self._loop.time()
        self._sleepers: list[tuple[int, int, asyncio.Future[None]]] = []
        self._numbers = itertools.count()
        self._begun = asyncio.Event()
        ros.subscribe(ClockMessage, TOPIC, self._hear, LATEST)

    @property
    def began(self) -> bool:
        """Whether /clock was received."""
        return self._offset_us is not None

    @property
    def stands(self) -> str:
        """Why time does not go on, for people; "" if it does."""
        if not self.began:
            return f"use_sim_time is set, and nothing was received on {TOPIC} yet"
        silent_s = self._loop.time() - self._changed_s
        if silent_s <= STANDS_AFTER_S:
            return ""
        return f"use_sim_time is set, and {TOPIC} has stood still for {silent_s:.0f} s"

    async def wait_until_begun(self) -> None:
        """Wait for the first message of /clock."""
        await self._begun.wait()

    def now_us(self) -> int:
        """Microseconds; 0 before the first message. It never goes back."""
        return self._now_us

    async def sleep(self, seconds: float) -> None:
        """Wait for so many seconds of /clock."""
        await self.sleep_until(self._now_us + round(seconds * 1e6))

    async def sleep_until(self, time_us: int) -> None:
        """Wait until `now_us()` is at least `time_us`."""
        if self.began and time_us <= self._now_us:
            await asyncio.sleep(0)
            return
        wakes: asyncio.Future[None] = self._loop.create_future()
        # Before the first message, `time_us` counts from 0: from the first message then.
        heapq.heappush(self._sleepers, (time_us, next(self._numbers), wakes))
        await wakes

    def _hear(self, message: ClockMessage) -> None:
        shown_us = message.clock.sec * 1_000_000 + message.clock.nanosec // 1000
        if self._offset_us is None:
            self._offset_us = 0
            self._begun.set()
            self._sleepers = [(at + shown_us, n, wakes) for at, n, wakes in self._sleepers]
            self._now_us = shown_us - 1
        now_us = shown_us + self._offset_us
        if now_us < self._now_us:
            back_us = self._now_us - now_us
            self._offset_us += back_us
            now_us = self._now_us
            self._changed_s = self._loop.time()
            if self.on_jump is not None:
                self.on_jump(back_us / 1e6)
        if now_us > self._now_us:
            self._now_us = now_us
            self._changed_s = self._loop.time()
        while self._sleepers and self._sleepers[0][0] <= self._now_us:
            _, _, wakes = heapq.heappop(self._sleepers)
            if not wakes.done():
                wakes.set_result(None)
