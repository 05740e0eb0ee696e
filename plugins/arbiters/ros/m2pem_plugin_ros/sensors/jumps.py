"""Jumps of a position: to where the vehicle cannot have moved since the last message."""

import math

JUMP_M = 10.0
"""Less is the noise of a satellite fix, or a correction of a localization on a map."""

MARGIN = 1.5
WITHIN_S = 2.0
"""After a longer silence, nothing is known."""

SHOWN_S = 30.0


class JumpMonitor:
    """Compares each position with the one before. Times are in seconds of one clock."""

    def __init__(self) -> None:
        self._last: tuple[float, float, float] | None = None
        self._jumped_s = -math.inf
        self._jump = ""

    def jump(self, east_m: float, north_m: float, speed_m_s: float, now_s: float) -> str:
        """Return how the position has jumped; "" if it has not. `speed_m_s`: its highest."""
        last, self._last = self._last or (east_m, north_m, now_s), (east_m, north_m, now_s)
        if (passed_s := now_s - last[2]) > WITHIN_S:
            return ""
        far_m = math.hypot(east_m - last[0], north_m - last[1])
        if far_m <= JUMP_M + MARGIN * speed_m_s * passed_s:
            return ""
        self._jumped_s = now_s
        self._jump = f"its position has jumped {far_m:.0f} m within {passed_s:.1f} s"
        return self._jump

    def problem(self, now_s: float) -> str:
        """Return the last jump for some time after it; "" otherwise."""
        return self._jump if now_s - self._jumped_s < SHOWN_S else ""
