"""Alerts that no run has: they stay until an operator has seen them."""

from collections.abc import Callable
from dataclasses import dataclass

from rich.text import Text

TITLE = "Alerts"
NONE = "There are no alerts."
MOST = 200
"""Alerts that are kept; of more, the oldest are dropped."""


@dataclass(slots=True)
class KeptAlert:
    """An alert. `at`: the time of day at which it came here. `count`: how often, if several times
    in a row."""

    at: str
    text: str
    count: int = 1


class Alerts:
    """All alerts of this executive since this unit began; the last ones are not seen yet.

    `now`: the time of day, as it is shown.
    """

    def __init__(self, now: Callable[[], str]) -> None:
        self._now = now
        self._kept: list[KeptAlert] = []
        self.unseen = 0

    def add(self, text: str) -> None:
        """Keep an alert until it is seen, and afterwards."""
        if self._kept and self._kept[-1].text == text and self.unseen:
            self._kept[-1].count += 1
            self._kept[-1].at = self._now()
            return
        self._kept.append(KeptAlert(self._now(), text))
        del self._kept[:-MOST]
        self.unseen = min(self.unseen + 1, MOST)

    def see(self) -> Text:
        """Return all, the newest first, those that were not seen marked; now all are."""
        if not self._kept:
            return Text(NONE)
        text = Text()
        for place, alert in enumerate(reversed(self._kept)):
            unseen = place < self.unseen
            text.append(f"{'!' if unseen else ' '} {alert.at}  ", "bold #e07a6a")
            many = f" ({alert.count} times)" if alert.count > 1 else ""
            text.append(f"{alert.text}{many}\n", "#e3e8ee" if unseen else "#9aa4af")
        self.unseen = 0
        return text

    def hint(self) -> str:
        """Say in short how many are not seen; "": none."""
        if not self.unseen:
            return ""
        return f"{self.unseen} alert{'s' if self.unseen > 1 else ''} (a)"
