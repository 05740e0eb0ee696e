"""What a role needs of the resources that fill it (docs/allocation.md)."""

import re
from collections.abc import Mapping
from typing import Literal

from m2pem.bpmn.context import KEY, ReadingContext
from m2pem.bpmn.rules.behaviors import ROLE_NEED
from m2pem.bpmn.times import wrong_time
from m2pem.mission.behavior import Need
from m2pem.mission.events import TimerKind
from m2pem.mission.expression import Expression

NEED_ATTRIBUTES = ("requires", "same", "count", "prefer", "store", "wait", "priority")
"""The attributes of a role that make it one which is allocated when its task starts."""

UNLIMITED = "unlimited"
"""The value of `wait` of a task that waits as long as its vehicles are not free."""

MAX_COUNT = 1_000
"""Resources that fill one role, at most."""

MAX_PRIORITY = 999_999
"""The greatest priority of a role; the least is its negative."""

_NAMED = ("wait", "priority")
"""The attributes that a role which names its resource may have, too."""

_COUNT = re.compile(r"(\d+)(?:\.\.(\d+))?")


class NeedReader:
    """Reads the need of one role. What is wrong goes to the findings of the task."""

    def __init__(
        self, context: ReadingContext, task: str, line: int, role: str, *, by_need: bool
    ) -> None:
        self._context = context
        self._task = task
        self._line = line
        self._role = role
        self._by_need = by_need

    def read(self, texts: Mapping[str, str]) -> Need | None:
        """Return the need that attributes say; None when one of them is wrong."""
        if not self._by_need and (extra := [key for key in texts if key not in _NAMED]):
            self._wrong(
                f"{extra[0]}='{texts[extra[0]]}' belongs to a role that says what it needs",
                f"write requires= in place of the name, or delete {extra[0]}",
            )
            return None
        least, most = self._count(texts.get("count", "1"))
        condition = self._expression(texts.get("requires"))
        preference = self._expression(texts.get("prefer"))
        priority = self._priority(texts.get("priority", "0"))
        same = self._name("same", texts.get("same"))
        store = self._name("store", texts.get("store"))
        limit = self._limit(texts.get("wait"))
        found = (least, most, condition, preference, priority, same, store, limit)
        if any(each is None for each in found):
            return None
        return Need(
            condition or None,
            least or 1,
            most or 1,
            preference or None,
            same or "",
            store or "",
            "wait" in texts,
            limit or None,
            priority or 0,
        )

    def _expression(self, text: str | None) -> Expression | Literal[False] | None:
        """Return the expression; False where there is none; None where it is wrong."""
        if text is None:
            return False
        return self._context.expression(self._line, self._task, text)

    def _count(self, text: str) -> tuple[int | None, int | None]:
        found = _COUNT.fullmatch(text.strip())
        least = int(found[1]) if found else 0
        most = int(found[2] or found[1]) if found else 0
        if found is None or not 1 <= least <= most <= MAX_COUNT:
            self._wrong(
                f"count='{text}' is no number and no range of numbers from 1 to {MAX_COUNT}",
                "write for example count='2', or count='1..3' for as many as are free up to 3",
            )
            return None, None
        return least, most

    def _priority(self, text: str) -> int | None:
        priority: int | None
        try:
            priority = int(text)
        except ValueError:
            priority = None
        if priority is None or abs(priority) > MAX_PRIORITY:
            self._wrong(
                f"priority='{text}' is no whole number from -{MAX_PRIORITY} to {MAX_PRIORITY}",
                "write for example priority='1'; what has the greatest number is served first",
            )
            return None
        return priority

    def _name(self, attribute: str, text: str | None) -> str | None:
        if text is not None and not KEY.fullmatch(text.strip()):
            self._wrong(
                f"{attribute}='{text}' is no name of data",
                f"write for example {attribute}='surveyor'",
            )
            return None
        return (text or "").strip()

    def _limit(self, text: str | None) -> Expression | Literal[False] | None:
        if text is None or text.strip() == UNLIMITED:
            return False
        limit = self._context.template(self._line, self._task, text)
        if limit is not None and (wrong := wrong_time(limit, TimerKind.DURATION)):
            self._wrong(
                f"wait='{text}': {wrong}",
                f"write an ISO 8601 duration such as wait='PT10M', or wait='{UNLIMITED}'",
            )
            return None
        return limit

    def _wrong(self, message: str, remedy: str) -> None:
        self._context.findings.error(
            self._line, self._task, ROLE_NEED, f"role '{self._role}': {message}", remedy
        )
