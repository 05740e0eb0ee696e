"""The executive's list of alerts in the terminal: its lines, the bell, deadlines of questions."""

from collections.abc import Iterable, Sequence

from m2pem.api import AlertSeverity, OperatorAlert, RunId
from m2pem.api.alerts import INCIDENT, QUESTION
from m2pem_plugin_terminal.dialogs import Choice
from m2pem_plugin_terminal.formatting import clock_time

TITLE = "Alerts"
NONE = "There are no alerts."

AGAIN_S = 10.0
"""The bell rings again for critical alerts that are not acknowledged, after so long."""

_MINUTE_S, _HOUR_S, _DAY_S = 60, 3600, 86_400


def age(seconds: float) -> str:
    """Return how long ago something was, in the largest unit: "12 s", "3 min", "2 h", "4 d"."""
    for unit_s, unit in ((_DAY_S, "d"), (_HOUR_S, "h"), (_MINUTE_S, "min")):
        if seconds >= unit_s:
            return f"{seconds / unit_s:.0f} {unit}"
    return f"{seconds:.0f} s"


def alert_choices(alerts: Sequence[OperatorAlert], now_us: int) -> list[Choice]:
    """Return a line for each alert, as the list has them. `!`: it is not acknowledged; `-`: it
    is over. `now_us`: microseconds since the Unix epoch by the executive's clock."""
    return [
        Choice(each.alert, _line(each, now_us), _who(each)) for each in alerts if not _too_old(each)
    ]


def _too_old(alert: OperatorAlert) -> bool:
    return not alert.open and alert.severity is AlertSeverity.NOTICE


def _line(alert: OperatorAlert, now_us: int) -> str:
    mark = "!" if alert.calls else " " if alert.open else "-"
    where = f"{alert.run}: " if alert.run else ""
    many = f" ({alert.count} times)" if alert.count > 1 else ""
    return f"{mark} {alert.severity}, {age(alert.age_s)}: {where}{alert.text}{many}"


def _who(alert: OperatorAlert) -> str:
    return f"{alert.owner} takes care" if alert.owner else ""


def alert_text(alert: OperatorAlert, now_us: int) -> str:
    """Return all that is known of an alert."""
    where = f"{alert.run}: " if alert.run else ""
    lines = [f"{where}{alert.text}", *alert.details]
    lines.append(f"{alert.severity} {alert.code}, {age(alert.age_s)} ago")
    if alert.count > 1:
        lines.append(f"said {alert.count} times, last {_ago(now_us, alert.last_us)} ago")
    if alert.acknowledged_by:
        lines.append(f"acknowledged by {alert.acknowledged_by}")
    if alert.owner:
        lines.append(f"{alert.owner} takes care")
    if not alert.open:
        lines.append("It is over.")
    return "\n".join(lines)


def _ago(now_us: int, at_us: int) -> str:
    return age(max(0, now_us - at_us) / 1_000_000)


def what_to_do(alert: OperatorAlert, by: str) -> list[Choice]:
    """Return what an operator can do about an alert."""
    found = []
    if alert.calls:
        found.append(Choice("acknowledge", "Acknowledge it: you have seen it"))
    if alert.open and alert.owner != by:
        found.append(Choice("own", "Take care of it"))
    if alert.open and alert.owner:
        found.append(Choice("disown", "Give it up: it has no owner any more"))
    if alert.open and alert.code == INCIDENT:
        found.append(Choice("decide", "Decide about the incident"))
    if alert.run:
        found.append(Choice("look", f"Look at {alert.run}"))
    return [*found, Choice("close", "Close")]


def hint(alerts: Iterable[OperatorAlert]) -> str:
    """Say in short how many are not acknowledged, beside questions, which have a pane; "": none.

    The most severe ones are named.
    """
    calling = [each for each in alerts if each.calls and each.code != QUESTION]
    if not calling:
        return ""
    worst = min((each.severity for each in calling), key=lambda each: each.rank)
    count = f"{len(calling)} alert{'s' if len(calling) > 1 else ''}"
    return f"{count}, {worst} (a)" if worst.rank < AlertSeverity.WARNING.rank else f"{count} (a)"


class Bell:
    """When the bell rings: for alerts that are new and call an operator, and again for critical
    ones. `on`: whether it rings at all."""

    def __init__(self, *, on: bool) -> None:
        self.on = on
        self._known: set[str] | None = None
        self._rang_at = 0.0

    def rings(self, alerts: Iterable[OperatorAlert], now: float) -> bool:
        """Return whether it rings now. `now`: the operator's clock, in seconds. What was there when
        the unit began does not ring."""
        calling = {
            each.alert: each.severity
            for each in alerts
            if each.calls and each.severity is not AlertSeverity.NOTICE
        }
        new = self._known is not None and not calling.keys() <= self._known
        critical = AlertSeverity.CRITICAL in calling.values()
        again = critical and now - self._rang_at >= AGAIN_S
        self._known = set(calling)
        if not (new or again):
            return False
        self._rang_at = now
        return self.on


def time_left(alerts: Iterable[OperatorAlert], run: RunId, prompt: str, passed_s: float) -> str:
    """Return how long a question is open yet: ", 0:42 left"; "": without a limit.

    `passed_s`: seconds by the executive's clock since the alerts were read.
    """
    for each in alerts:
        asks = each.code == QUESTION and each.run == run and each.subject == prompt
        if asks and each.open and each.left_s is not None:
            return f", {clock_time(max(0, each.left_s - passed_s))} left"
    return ""
