"""Tells how /clock and mission time differ, where an executive has `use_sim_time`.

Mission time never follows /clock: only stamps of messages do (docs/ros.md).
"""

import asyncio
import logging
import math

from rosgraph_msgs.msg import Clock as ClockMessage

from m2pem.api import US_PER_S, Clock
from m2pem_plugin_ros.runtime.ros_clock import LATEST, TOPIC
from m2pem_plugin_ros.runtime.ros_runtime import RosRuntime

CHECK_S = 2.0
"""Real seconds of mission time and /clock that are compared."""

DIFFERENT = 0.2
"""Part by which the paces may differ: a busy simulator is not even."""

AHEAD_S = 60.0
"""A step of /clock that is longer is a jump."""

ALIKE = "/clock goes as fast as mission time"


class ClockWatch:
    """Compares /clock with `clock`, the mission time, and logs each change once."""

    def __init__(self, ros: RosRuntime, clock: Clock, logger: logging.Logger) -> None:
        self._clock, self._logger = clock, logger
        self._shown_us: int | None = None
        self._since: tuple[int, int] | None = None
        """/clock and mission time at the last check; None if they cannot be compared from then."""
        self._pace = 1.0
        self._said = ALIKE
        ros.subscribe(ClockMessage, TOPIC, self._hear, LATEST)

    async def run(self) -> None:
        """Compare until cancelled."""
        while True:
            await asyncio.sleep(CHECK_S)
            self._check()

    def _hear(self, message: ClockMessage) -> None:
        shown_us = message.clock.sec * US_PER_S + message.clock.nanosec // 1000
        before_us, self._shown_us = self._shown_us, shown_us
        step_s = 0.0 if before_us is None else (shown_us - before_us) / US_PER_S
        if not 0.0 <= step_s <= AHEAD_S:
            self._since = None
            self._logger.warning(
                "/clock jumped %s %.3f s; mission time does not follow it: behaviors, timers and "
                "time limits go on",
                "back" if step_s < 0.0 else "ahead",
                abs(step_s),
            )
        if self._since is None:
            self._since = shown_us, self._clock.now_us()

    def _check(self) -> None:
        now_us = self._clock.now_us()
        if self._shown_us is None:
            self._say("nothing is received on /clock: stamps of messages are 0")
            return
        if self._since is None:
            return
        shown_us, mission_us = self._since
        self._since = self._shown_us, now_us
        if now_us <= mission_us:
            return
        before, pace = self._pace, (self._shown_us - shown_us) / (now_us - mission_us)
        self._pace = pace
        if pace == 0.0:
            self._say("/clock stands still; mission time goes on")
        elif abs(pace - 1.0) <= DIFFERENT:
            self._say(ALIKE)
        elif abs(pace - before) <= DIFFERENT * before:  # not only while the pace changes
            speed = pace * getattr(self._clock, "speed", 1.0)
            self._say(
                f"/clock goes {pace:.2g} times as fast as mission time: time limits do not fit "
                f"what moves; start m2pem with --speed {speed:.2g}",
                f"pace {math.floor(math.log2(pace))}",
            )

    def _say(self, text: str, state: str = "") -> None:
        state = state or text
        if state == self._said:
            return
        self._said = state
        level = logging.INFO if text == ALIKE else logging.WARNING
        self._logger.log(level, "%s", text)
