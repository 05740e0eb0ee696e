"""What a simulated camera has to show: names of pictures and videos that are nowhere.

They are written to the mission's data store under the names that real cameras use.
"""

from collections.abc import Mapping
from datetime import UTC, datetime

import msgspec

from m2pem.api.arbiter import BehaviorId
from m2pem.api.telemetry import GeoPosition
from m2pem.mission.values import Value

_ROUNDING_S = 1e-6


class Shots(msgspec.Struct, frozen=True):
    """Pictures: `count` of them, every `every_s`, each of which takes `shutter_s`. A video, which
    begins with the behavior at `began_us`, if `count` is 0."""

    count: int = 0
    every_s: float = 0.0
    shutter_s: float = 0.0
    began_us: int = 0

    def taken(self, after_s: float) -> int:
        """How many pictures there are after so much of the behavior's own time."""
        passed_s = after_s - self.shutter_s + _ROUNDING_S
        if passed_s < 0 or self.every_s <= 0:
            return 0 if passed_s < 0 else self.count
        return min(self.count, int(passed_s / self.every_s) + 1)

    def outputs(
        self,
        behavior: BehaviorId,
        after_s: float,
        now_us: int,
        position: GeoPosition | None,
        *,
        done: bool,
    ) -> Mapping[str, Value]:
        """What has come of it now. `done`: all of it, whatever the time."""
        stem = "sim:" + behavior.replace(".", "/")
        if not self.count:
            return {"video.file": f"{stem}.mp4", "video.time": _iso(self.began_us)}
        taken = self.count if done else self.taken(after_s)
        if not taken:
            return {}
        since_s = max(0.0, after_s - (taken - 1) * self.every_s - self.shutter_s)
        files: list[Value] = [f"{stem}_{number}.jpg" for number in range(1, taken + 1)]
        place: Value = None
        if position is not None:
            place = [position.latitude_deg, position.longitude_deg, position.altitude_m]
        return {
            "picture.file": files[-1],
            "picture.files": files,
            "picture.position": place,
            "picture.time": _iso(now_us - round(since_s * 1e6)),
        }


def _iso(time_us: int) -> str:
    seconds, rest = divmod(time_us, 1_000_000)
    time = datetime.fromtimestamp(seconds, UTC).replace(microsecond=rest)
    return time.isoformat(timespec="microseconds").replace("+00:00", "Z")
