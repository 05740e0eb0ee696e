"""Judges whether an aircraft whose motors have stopped had landed, or falls.

ArduPilot and PX4 report MAV_LANDED_STATE_ON_GROUND as soon as an aircraft is disarmed, also in the
air (seen on ArduCopter 4.7-dev and PX4 main of August 2026). Their land detectors wait until it is
at rest before they disarm it; so its motion around that moment tells what happened.
"""

from dataclasses import dataclass

FALLS_M_S = 2.5
"""An aircraft without thrust sinks as fast within 0.3 s; one that lands is slower at the end."""

FALLS_M = 3.0
BEFORE_S = 2.0
"""Seconds before a heartbeat that shows it disarmed in which it may have been disarmed: heartbeats
come every second, and one may be lost."""

RESTS_S, RESTS_M_S = 0.5, 0.5
DRIFTS_M_S = 5.0
"""Deck of a ship, at most; an aircraft that glides is faster."""

UNKNOWN_AFTER_S = 3.0
"""Without a position for so long, its own report counts."""


@dataclass(frozen=True, slots=True)
class _Sample:
    at_s: float
    above_home_m: float
    altitude_m: float
    across_m_s: float
    up_m_s: float


class Touchdown:
    """The motion of one aircraft around its disarming, without I/O. Times are of one clock.

    `fell_from_m`: its height above home, in metres, when its motors stopped in the air; None: they
    did not since it was armed last.
    """

    def __init__(self) -> None:
        self.fell_from_m: float | None = None
        self._samples: list[_Sample] = []
        self._armed = False
        self._disarmed_s: float | None = None
        self._rested_s: float | None = None

    def take_heartbeat(self, armed: bool, at_s: float) -> None:
        """Note whether its motors may turn."""
        if armed:
            self.fell_from_m = self._disarmed_s = self._rested_s = None
        elif self._armed:
            self._disarmed_s = at_s
            self._judge()
        self._armed = armed

    def take_position(
        self, at_s: float, above_home_m: float, altitude_m: float, enu: tuple[float, float, float]
    ) -> None:
        """Note where it is (metres above home, and above mean sea level), and its velocity."""
        if self._disarmed_s is None:
            self._samples = [each for each in self._samples if each.at_s > at_s - BEFORE_S]
        across_m_s = (enu[0] ** 2 + enu[1] ** 2) ** 0.5
        self._samples.append(_Sample(at_s, above_home_m, altitude_m, across_m_s, enu[2]))
        if self._disarmed_s is not None and self._rested_s is None:
            self._judge()

    def has_landed(self, now_s: float) -> bool:
        """Return whether a report that it is on the ground can be true: it is armed, was never seen
        armed, or has come to rest since it was disarmed."""
        if self._disarmed_s is None or self._rested_s is not None:
            return True
        last_s = self._samples[-1].at_s if self._samples else self._disarmed_s
        return now_s - max(last_s, self._disarmed_s) > UNKNOWN_AFTER_S

    def _judge(self) -> None:
        assert self._disarmed_s is not None
        highest = max(self._samples, key=lambda each: each.altitude_m, default=None)
        if highest is None:
            return
        last = self._samples[-1]
        sinks_m_s = -min(each.up_m_s for each in self._samples)
        if sinks_m_s > FALLS_M_S or highest.altitude_m - last.altitude_m > FALLS_M:
            self.fell_from_m = self.fell_from_m or highest.above_home_m
        rest = [each for each in self._samples if each.at_s > last.at_s - RESTS_S]
        still = all(abs(s.up_m_s) < RESTS_M_S and s.across_m_s < DRIFTS_M_S for s in rest)
        if still and last.at_s - self._disarmed_s >= RESTS_S:
            self._rested_s = last.at_s
