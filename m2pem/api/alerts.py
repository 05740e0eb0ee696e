"""Alerts: what operators must know now, with who has seen it and who takes care of it.

`Alert` is what is said once. `OperatorAlert` is a line of the list that an executive keeps of them:
of conditions (a link that is lost, a question that is open), and of what was said.
"""

from dataclasses import dataclass, replace
from enum import StrEnum

from m2pem.units import US_PER_S


class AlertSeverity(StrEnum):
    """How severe an alert is, in the words of syslog (RFC 5424), which MAVLink's MAV_SEVERITY has,
    too.

    CRITICAL: act now, a vehicle may do what no operator wants. ERROR: something does not go on, or
    is lost. WARNING: look at it, or decide. NOTICE: it is said once, and needs no operator.
    """

    CRITICAL = "critical"
    ERROR = "error"
    WARNING = "warning"
    NOTICE = "notice"

    @property
    def rank(self) -> int:
        """0 for the most severe."""
        return _RANKS[self]


_RANKS = {each: rank for rank, each in enumerate(AlertSeverity)}

QUESTION = "QUESTION"
"""The code of the alert of a question that is open."""
INCIDENT = "INCIDENT"
"""The code of the alert of an incident that is open."""
LINK_LOST = "LINK_LOST"
"""The code of the alert of vehicles and payloads whose link is lost."""
BATTERY_LOW = "BATTERY_LOW"
"""The code of the alert of vehicles whose battery is low."""
NOT_READY = "NOT_READY"
"""The code of the alert of vehicles that say that they are not ready."""
RUN_FAILED = "RUN_FAILED"
"""The code of the alert of a run that has failed."""
REQUIREMENT_VIOLATED = "REQUIREMENT_VIOLATED"
"""The code of the alert of a run that has violated a requirement."""
DEVIATION = "DEVIATION"
"""The code of the alert of a vehicle that does not do what it is commanded."""
NOT_STOPPED = "NOT_STOPPED"
"""The code of the alert of a vehicle that goes on although its behavior was cancelled."""
SPACE_VIOLATED = "SPACE_VIOLATED"
"""The code of the alert of a shared space with more vehicles than it has places."""


@dataclass(frozen=True, slots=True)
class OperatorAlert:
    """An alert of an executive's list. Times are microseconds since the Unix epoch, by the
    executive's clock.

    `alert`: its id. `run`, `resources`, `subject`: where it comes from; the subject is the id of a
    prompt or an incident. `last_us`, `count`: when it was said last, and how often. `details`: what
    else was said that is part of it, the newest last. `deadline_us`: when a question will be
    withdrawn; None: never, or not while its run is paused. `cleared_us`: when it was over; None: it
    is open. `acknowledged_by`: who has seen it; `owner`: who takes care; "": no operator. `age_s`,
    `left_s`: seconds since it was raised and until its deadline, when it was asked for.
    """

    alert: str
    severity: AlertSeverity
    code: str
    text: str
    raised_us: int
    last_us: int
    run: str = ""
    resources: tuple[str, ...] = ()
    subject: str = ""
    count: int = 1
    details: tuple[str, ...] = ()
    deadline_us: int | None = None
    cleared_us: int | None = None
    acknowledged_by: str = ""
    acknowledged_us: int | None = None
    owner: str = ""
    owned_us: int | None = None
    age_s: float = 0.0
    left_s: float | None = None

    @property
    def open(self) -> bool:
        """Whether it is not over."""
        return self.cleared_us is None

    @property
    def calls(self) -> bool:
        """Whether it is open and not acknowledged."""
        return self.open and not self.acknowledged_by

    def at(self, now_us: int) -> "OperatorAlert":
        """The same, with its age and what is left until its deadline."""
        left_us = None if self.deadline_us is None else max(0, self.deadline_us - now_us)
        age_us = max(0, (self.cleared_us or now_us) - self.raised_us)
        left_s = None if left_us is None else left_us / US_PER_S
        return replace(self, age_s=age_us / US_PER_S, left_s=left_s)

    def __str__(self) -> str:
        many = f" ({self.count} times)" if self.count > 1 else ""
        seen = f"; acknowledged by {self.acknowledged_by}" if self.acknowledged_by else ""
        owned = f"; {self.owner} takes care" if self.owner else ""
        where = f"{self.run}: " if self.run else ""
        over = "; over" if not self.open else ""
        return f"{self.alert}: {self.severity}: {where}{self.text}{many}{over}{seen}{owned}"


@dataclass(frozen=True, slots=True)
class AlertsChanged:
    """The list of alerts has changed; `MissionControl.alerts` has it. It concerns all runs."""

    run: str = ""
