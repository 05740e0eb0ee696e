"""What the journal keeps of a team behavior, so that its members are found again after a restart.

It is the team behavior's `native_ref`: a text, in which each part is named as its behavior
is behind the team's id: "r1.b3.evsg1" is the part evsg1 of r1.b3. "evsg2/evsg1" is what evsg2 does
in the place of evsg1, and "evsg1/evsg1/2" what evsg1 began anew when the run had its second epoch.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field

from m2pem.mission.catalogue import ResourceId


@dataclass(frozen=True, slots=True)
class Reference:
    """`begun`: the arbiters' own references of parts that have begun. `done`: parts that have ended
    well. `lost`: members that the team goes on without, and why. `version`: how often it changed.
    `split`: the shares of the members in what they divide.
    """

    begun: Mapping[str, str | None] = field(default_factory=dict)
    done: tuple[str, ...] = ()
    lost: Mapping[ResourceId, str] = field(default_factory=dict)
    version: int = 0
    split: tuple[float, ...] = ()

    def text(self) -> str:
        """As the journal keeps it."""
        return json.dumps(
            {
                "begun": dict(self.begun),
                "done": list(self.done),
                "lost": dict(self.lost),
                "version": self.version,
                "split": list(self.split),
            },
            separators=(",", ":"),
        )


def read_reference(text: str | None) -> Reference:
    """What `Reference.text` wrote; an empty one for nothing, and for what cannot be read."""
    try:
        data = json.loads(text or "{}")
        return Reference(
            {str(name): ref for name, ref in data.get("begun", {}).items()},
            tuple(data.get("done", ())),
            {ResourceId(name): str(why) for name, why in data.get("lost", {}).items()},
            int(data.get("version", 0)),
            tuple(float(share) for share in data.get("split", ())),
        )
    except (ValueError, TypeError, AttributeError):
        return Reference()
