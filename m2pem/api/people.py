"""Operators as others see them: who watches what, and who asks whom for a vehicle or payload."""

from dataclasses import dataclass

from m2pem.api.runs import RunId
from m2pem.mission.catalogue import ResourceId

MAX_NOTE_CHARACTERS = 2000
"""The longest note in a run's log."""

PRESENCE_EVERY_S = 5.0
"""How often an operator control unit announces who is present at it."""

ABSENT_AFTER_S = 15.0
"""An operator whose unit has not announced it for so long is gone."""


@dataclass(frozen=True, slots=True)
class OperatorPresence:
    """An operator is present at a unit: a page, a terminal.

    `role`: what the unit lets the operator do; "": it does not say. `run`: what it shows, "": none
    in particular; `page`: which page; `editing`: the mission that the operator edits there, "":
    none. `since_us`: microseconds since the Unix epoch.
    """

    by: str
    unit: str
    role: str = ""
    run: RunId = ""
    page: str = ""
    since_us: int = 0
    editing: str = ""

    def __str__(self) -> str:
        role = f" ({self.role})" if self.role else ""
        run = f", run {self.run}" if self.run else ""
        editing = f", edits {self.editing}" if self.editing else ""
        return f"{self.by}{role}: {self.unit}{run}{editing}"


@dataclass(frozen=True, slots=True)
class OpenControlRequest:
    """An operator asks the one who has a vehicle or payload, `holder`, for it.

    `left_s`: seconds until its time is over. `given_then`: whether the resource goes to who asks
    then; else it stays. `holder_gone`: no unit has announced the holder.
    """

    resource: ResourceId
    by: str
    holder: str
    left_s: float
    given_then: bool = False
    holder_gone: bool = False

    def __str__(self) -> str:
        gone = f"; {self.holder} is gone: no page or terminal of theirs is open"
        then = f"goes to {self.by}" if self.given_then else "stays"
        asks = f"{self.by} asks {self.holder} for {self.resource}{gone if self.holder_gone else ''}"
        return f"{asks}; without an answer it {then} in {self.left_s:.0f} s"


@dataclass(frozen=True, slots=True)
class OperatorsChanged:
    """Who is present, or who asks for control, has changed; `MissionControl.operators` and
    `control_requests` have it. It concerns all runs."""

    run: str = ""
