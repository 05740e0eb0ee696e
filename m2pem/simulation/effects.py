"""What physically happened to simulated resources, for tests to look at."""

from dataclasses import dataclass
from enum import StrEnum

from m2pem.api.arbiter import BehaviorId
from m2pem.mission.catalogue import ResourceId


class EffectKind(StrEnum):
    """What happened."""

    START = "start"
    HOLD = "hold"
    RESUME = "resume"
    CANCEL = "cancel"
    END = "end"


@dataclass(frozen=True, slots=True)
class Effect:
    """At `time_us` (microseconds since the Unix epoch). `resource` is a behavior's first one.

    `behavior` is "" for a hold or resume of a resource that has none.
    """

    time_us: int
    kind: EffectKind
    resource: ResourceId
    behavior: BehaviorId = ""
