"""The list of alerts of an executive: raised, cleared, acknowledged, owned, and kept.

Conditions are given whole each time (`update`): what was not there is raised, what is gone is
cleared. What is said once (`add`) is open until an operator acknowledges it. The journal keeps the
list, so that the next executive knows who has acknowledged what. Several executives of a simulated
fleet may write it: an alert gets another number if one of them was first with that.
"""

import asyncio
import logging
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice

import msgspec

from m2pem.api.alerts import AlertSeverity, OperatorAlert
from m2pem.api.runs import Alert
from m2pem.errors import OperatorError, StaleAlertsError
from m2pem.executive.emergency import written_in_time
from m2pem.journal.base import Journal

log = logging.getLogger("m2pem.alerts")

GROUPED_WITHIN_US = 5_000_000
"""What is alike is one alert if no more time than this is between two of them: a thousand vehicles
that lose their links at once are one alert."""

MOST_OVER = 500
"""Alerts that are over and are kept; of more, the oldest are removed."""

MOST_OPEN = 1000
"""Alerts that are open and were said once; of more, the oldest count as over."""

MOST_DETAILS = 20

SHOWN_NAMES = 5


@dataclass(frozen=True, slots=True)
class Condition:
    """Something that is so now, of which operators must know.

    `resources`: of whom it is so; those that come together are one alert. `text` has `{names}`
    where their names belong. Other fields as in `OperatorAlert`.
    """

    code: str
    severity: AlertSeverity
    text: str
    run: str = ""
    subject: str = ""
    resources: tuple[str, ...] = ()
    deadline_us: int | None = None


@dataclass(slots=True)
class _Line:
    """An alert of the list. `group`: of what was said once; None: of a condition. `left`: the
    resources of which the condition still holds. `form`: its text, before names are filled in."""

    alert: OperatorAlert
    group: str | None
    left: set[str]
    form: str = ""

    def is_same(self, other: "_Line") -> bool:
        """Whether both are one alert, however it has changed since it was raised."""
        return self._raised() == other._raised()

    def _raised(self) -> tuple[int, str, str, str, str | None, str]:
        one = self.alert
        return one.raised_us, one.code, one.run, one.subject, self.group, self.form


class _Kept(msgspec.Struct, frozen=True, omit_defaults=True):
    """A line as the journal has it."""

    alert: OperatorAlert
    group: str | None = None
    left: tuple[str, ...] = ()
    form: str = ""


class AlertList:
    """The alerts of the executive of a fleet. `now_us`: its clock."""

    def __init__(self, fleet: str, journal: Journal, now_us: Callable[[], int]) -> None:
        self._fleet = fleet
        self._journal = journal
        self._now_us = now_us
        self._lines: dict[int, _Line] = {}
        self._open: dict[int, _Line] = {}
        self._last = 0
        self._unwritten: dict[int, _Line | None] = {}
        self._last_kept: int | None = None
        """The last number that the journal has; None: it must be read before it is written."""
        self._first_new = 1
        """Alerts from this number on were raised here since the journal was read or written."""
        self._writing = asyncio.Lock()
        self.changes = 0
        """How often the list has changed."""
        self.on_change: Callable[[], None] = lambda: None
        """Is called after each change."""

    async def load(self) -> None:
        """Read what the journal has. Questions and incidents of runs that have ended are over.

        What is not written yet of this executive is newer.

        Raises:
            JournalError: it cannot be read; it is read before the next alert is written.
        """
        kept = await self._journal.alerts(self._fleet)
        runs = await self._journal.runs(files=False) if kept else ()
        # From here on nothing is awaited: what is raised meanwhile has the numbers after these.
        over = {each.run for each in runs if each.outcome or each.gone}
        raised = [(number, each) for number, each in self._lines.items() if self._is_new(number)]
        changed = {n: each for n, each in self._unwritten.items() if not self._is_new(n)}
        self._lines, self._open, self._unwritten = {}, {}, {}
        self._last = self._last_kept = max(kept, default=0)
        self._first_new = self._last + 1
        for number, text in kept.items():
            if number in changed and changed[number] is None:
                self._unwritten[number] = None
                continue
            line = changed.get(number) or _decoded(text)
            if line is not None:
                self._put(number, line)
                if number in changed:
                    self._changed(number, line)
        for wanted, line in raised:
            # A writing that was given up may have been done.
            written = self._lines.get(wanted) if wanted <= self._last_kept else None
            number = wanted
            if wanted > self._last:
                self._last = wanted
            elif written is None or not line.is_same(written):
                # Another executive was first with its number.
                line.alert = replace(line.alert, alert=self._next_id())
                number = self._last
            self._put(number, line)
            self._changed(number, line)
        for number, line in list(self._open.items()):
            if line.group is None and line.alert.subject and line.alert.run in over:
                self._clear(number, line)

    def _is_new(self, number: int) -> bool:
        return number >= self._first_new

    def _put(self, number: int, line: _Line) -> None:
        self._lines[number] = line
        if line.alert.open:
            self._open[number] = line
        else:
            self._open.pop(number, None)

    def alerts(self, *, over: bool = False) -> list[OperatorAlert]:
        """The open alerts, the most severe first, the newest of each severity first; with `over`,
        then those that are over, the newest first."""
        found = sorted(
            (line.alert for line in self._open.values()),
            key=lambda each: (each.severity.rank, -each.raised_us),
        )
        if over:
            past = [line.alert for line in self._lines.values() if not line.alert.open]
            found += sorted(past, key=lambda each: -(each.cleared_us or 0))
        now_us = self._now_us()
        return [each.at(now_us) for each in found]

    # --- what happens ---------------------------------------------------------------------------

    def add(self, said: Alert) -> None:
        """Add what was said once. A notice is over at once; other alerts are open until an operator
        acknowledges them, or until it is said that they are over."""
        if not said.listed:
            return
        if said.clears:
            for number, line in list(self._open.items()):
                if line.group is not None and line.alert.code == said.code:
                    self._clear(number, line)
            return
        now_us = self._now_us()
        group = said.group or said.text
        for number, line in reversed(self._open.items()):
            if self._joins(line, said, group, now_us):
                self._change(number, line, _with(line.alert, said, now_us))
                return
        alert = OperatorAlert(
            self._next_id(),
            said.severity,
            said.code,
            said.text,
            now_us,
            now_us,
            said.run,
            said.resources,
        )
        line = self._raise(alert, said.group or said.text)
        if said.severity is AlertSeverity.NOTICE:
            self._clear(self._last, line)
        elif sum(each.group is not None for each in self._open.values()) > MOST_OPEN:
            oldest = next(each for each, one in self._open.items() if one.group is not None)
            self._clear(oldest, self._open[oldest])

    @staticmethod
    def _joins(line: _Line, said: Alert, group: str, now_us: int) -> bool:
        """Whether it is the same again, or comes together with what is alike."""
        alert = line.alert
        if (line.group, alert.code, alert.run) != (group, said.code, said.run):
            return False
        together = now_us - alert.last_us <= GROUPED_WITHIN_US
        again = alert.text == said.text or group == said.code
        return not alert.acknowledged_by and (together or again)

    def update(
        self, conditions: Sequence[Condition], undecided: Callable[[OperatorAlert], Collection[str]]
    ) -> None:
        """Raise what is so now and was not, clear what is not so any more.

        `undecided`: the resources of an alert (its subject, if it has none) of which it cannot be
        said yet, as its run is not driven here, or nothing was received since connecting: its alert
        stays.
        """
        single = {(each.code, each.run, each.subject): each for each in conditions if each.subject}
        many: dict[tuple[str, str, str], tuple[Condition, dict[str, None]]] = {}
        for each in conditions:
            if not each.subject:
                many.setdefault((each.code, each.run, each.text), (each, {}))[1].update(
                    dict.fromkeys(each.resources)
                )
        for number, line in list(self._open.items()):
            if line.group is not None:
                continue
            alert = line.alert
            if alert.subject:
                found = single.pop((alert.code, alert.run, alert.subject), None)
                if found is None:
                    if alert.subject not in undecided(alert):
                        self._clear(number, line)
                elif found.deadline_us != alert.deadline_us:
                    self._change(number, line, replace(alert, deadline_us=found.deadline_us))
                continue
            self._narrow(number, line, many.get((alert.code, alert.run, line.form)), undecided)
        for condition in single.values():
            self._begin(condition, condition.resources)
        for condition, names in many.values():
            if names:
                self._join_or_begin(condition, tuple(names))

    def _narrow(
        self,
        number: int,
        line: _Line,
        now: tuple[Condition, dict[str, None]] | None,
        undecided: Callable[[OperatorAlert], Collection[str]],
    ) -> None:
        """Keep of an alert the resources of which it still holds; take those from `now`."""
        names: dict[str, None] = {} if now is None else now[1]
        left = {each for each in line.left if each in names}
        for each in left:
            del names[each]
        if gone := line.left - left:
            left |= gone & set(undecided(line.alert))
        if left == line.left:
            return
        line.left = left
        if not left:
            self._clear(number, line)
            return
        still = [each for each in line.alert.resources if each in left]
        self._change(number, line, replace(line.alert, text=_filled(line.form, still)))

    def _join_or_begin(self, condition: Condition, names: tuple[str, ...]) -> None:
        now_us = self._now_us()
        for number, line in reversed(self._open.items()):
            alert = line.alert
            same = (alert.code, alert.run) == (condition.code, condition.run)
            alike = line.group is None and not alert.subject and line.form == condition.text
            fresh = not (alert.acknowledged_by or alert.owner)
            if same and alike and fresh and now_us - alert.last_us <= GROUPED_WITHIN_US:
                line.left |= set(names)
                known = tuple(dict.fromkeys((*alert.resources, *names)))
                still = [each for each in known if each in line.left]
                self._change(
                    number,
                    line,
                    replace(
                        alert,
                        resources=known,
                        last_us=now_us,
                        text=_filled(line.form, still),
                    ),
                )
                return
        self._begin(condition, names)

    def _begin(self, condition: Condition, names: tuple[str, ...]) -> None:
        now_us = self._now_us()
        alert = OperatorAlert(
            self._next_id(),
            condition.severity,
            condition.code,
            _filled(condition.text, names),
            now_us,
            now_us,
            condition.run,
            names,
            condition.subject,
            deadline_us=condition.deadline_us,
        )
        line = self._raise(alert, None)
        line.left = set(names)
        line.form = condition.text

    # --- what operators do ----------------------------------------------------------------------

    async def acknowledge(self, alert: str, by: str) -> None:
        """Note that an operator has seen an alert. What was said once is over then.

        Raises:
            OperatorError: there is no such alert, it is over, or another operator was first; or
                it is noted here, and the journal has not written it.
        """
        number, line = self._find(alert)
        if line.alert.acknowledged_by:
            raise OperatorError(f"{line.alert.acknowledged_by} has acknowledged {alert} already")
        now_us = self._now_us()
        self._change(
            number, line, replace(line.alert, acknowledged_by=by or "?", acknowledged_us=now_us)
        )
        if line.group is not None:
            self._clear(number, line)
        await written_in_time(self.write, f"{alert} is acknowledged")

    async def own(self, alert: str, owner: str) -> None:
        """Note who takes care of an alert; "": no operator any more.

        Raises:
            OperatorError: there is no such alert, or it is over; or it is noted here, and the
                journal has not written it.
        """
        number, line = self._find(alert)
        owned_us = self._now_us() if owner else None
        self._change(number, line, replace(line.alert, owner=owner, owned_us=owned_us))
        await written_in_time(self.write, f"{alert}: the owner is {owner or 'no operator'}")

    def _find(self, alert: str) -> tuple[int, _Line]:
        digits = alert.removeprefix("a")
        number = int(digits) if digits.isascii() and digits.isdigit() else 0
        line = self._open.get(number)
        if line is not None:
            return number, line
        if number in self._lines:
            raise OperatorError(f"{alert} is over")
        known = ", ".join(each.alert.alert for each in list(self._open.values())[:20]) or "none"
        raise OperatorError(f"there is no alert {alert!r}; open ones: {known}")

    # --- the journal ----------------------------------------------------------------------------

    async def write(self) -> None:
        """Have the journal keep what has changed.

        Raises:
            JournalError: it cannot be written; it is written with the next call.
        """
        async with self._writing:
            while True:
                if self._unwritten and self._last_kept is None:
                    await self.load()
                taken, self._unwritten = self._unwritten, {}
                if not taken:
                    return
                last = self._last_kept or 0
                lines = {n: None if line is None else _encoded(line) for n, line in taken.items()}
                try:
                    await self._journal.write_alerts(self._fleet, lines, last=last)
                except BaseException as error:
                    self._unwritten = {**taken, **self._unwritten}
                    # Whether the journal has what was on its way is not known.
                    self._last_kept = None
                    if not isinstance(error, StaleAlertsError):
                        raise
                else:
                    self._last_kept = max((last, *taken))
                    self._first_new = self._last_kept + 1
                    return

    # --- inside ---------------------------------------------------------------------------------

    def _next_id(self) -> str:
        self._last += 1
        return f"a{self._last}"

    def _raise(self, alert: OperatorAlert, group: str | None) -> _Line:
        line = _Line(alert, group, set())
        self._lines[self._last] = self._open[self._last] = line
        self._changed(self._last, line)
        return line

    def _change(self, number: int, line: _Line, alert: OperatorAlert) -> None:
        line.alert = alert
        self._changed(number, line)

    def _clear(self, number: int, line: _Line) -> None:
        self._open.pop(number, None)
        self._change(number, line, replace(line.alert, cleared_us=self._now_us(), deadline_us=None))
        over = len(self._lines) - len(self._open)
        past = (each for each in self._lines if each not in self._open)
        for oldest in list(islice(past, max(0, over - MOST_OVER))):
            del self._lines[oldest]
            self._unwritten[oldest] = None

    def _changed(self, number: int, line: _Line) -> None:
        self._unwritten[number] = line
        self.changes += 1
        self.on_change()


def _with(alert: OperatorAlert, said: Alert, now_us: int) -> OperatorAlert:
    """An alert, to which something alike was added."""
    details = alert.details
    if said.text != alert.text and said.text not in details:
        details = (*details, said.text)[-MOST_DETAILS:]
    return replace(
        alert,
        count=alert.count + 1,
        last_us=now_us,
        details=details,
        severity=min(alert.severity, said.severity, key=lambda each: each.rank),
        resources=tuple(dict.fromkeys((*alert.resources, *said.resources))),
    )


def _filled(form: str, names: Sequence[str]) -> str:
    """A text with the names of resources in it."""
    shown = ", ".join(names[:SHOWN_NAMES])
    if len(names) > SHOWN_NAMES:
        shown += f" and {len(names) - SHOWN_NAMES:,} more"
    return form.replace("{names}", shown)


def _decoded(text: str) -> _Line | None:
    """A line as the journal has it; None: it cannot be read, which is logged."""
    try:
        found = msgspec.json.decode(text, type=_Kept)
    except (msgspec.MsgspecError, UnicodeError) as error:
        log.warning("an alert cannot be read, or is of a newer m2pem: %s", error)
        return None
    return _Line(found.alert, found.group, set(found.left), found.form)


def _encoded(line: _Line) -> str:
    kept = _Kept(line.alert, line.group, tuple(sorted(line.left)), line.form)
    return msgspec.json.encode(kept).decode()


def counted(alerts: Sequence[OperatorAlert]) -> Mapping[AlertSeverity, int]:
    """How many alerts call, by severity."""
    return {each: sum(a.severity is each and a.calls for a in alerts) for each in AlertSeverity}
