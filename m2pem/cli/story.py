"""A run's records as lines for people: what matters of them, with the diagram's own names."""

from collections.abc import Callable
from typing import Any, TypeAlias

import click

from m2pem.api.control import RunId, StampedRecord
from m2pem.engine import records as r
from m2pem.engine.state import RunState
from m2pem.mission.catalogue import BehaviorState
from m2pem.mission.elements import Activity, Event
from m2pem.mission.mission import Mission

Told: TypeAlias = tuple[str, str]
"""A line, and the colour of it ("" for none)."""


class Story:
    """Tells the records of runs. `mission` gives the diagram of a run.

    `colour`: for a terminal. `one`: the lines of the first run need not name it. `asks`: whether
    prompts are told, which an operator's own unit may do better.
    """

    def __init__(
        self,
        mission: Callable[[RunId], Mission | None],
        *,
        colour: bool = False,
        one: bool = True,
        asks: bool = True,
    ) -> None:
        self._main: RunId | None = None if one else ""
        self._asks = asks
        self._mission = mission
        self._colour = colour
        self._behaviors: dict[tuple[RunId, str], tuple[str, str]] = {}

    def know(self, state: RunState) -> None:
        """Know the behaviors of a run that was begun before."""
        for behavior in state.behaviors.values():
            self._behaviors[state.run, behavior.id] = (behavior.name, ", ".join(behavior.resources))

    def tell(self, stamped: StampedRecord) -> str | None:
        """One line for a record; None for one that matters to programs only."""
        if self._main is None:
            self._main = stamped.run
        teller = _TELLERS.get(type(stamped.record))
        if teller is None or (not self._asks and isinstance(stamped.record, r.PromptOpened)):
            return None
        told = teller(self, stamped.run, stamped.record)
        if told is None:
            return None
        text, colour = told
        run = "" if stamped.run == self._main else f"{stamped.run:<4} "
        line = f"{stamped.t_s:9.1f} s  {run}{printable(text)}"
        return click.style(line, fg=colour) if self._colour and colour else line

    def label(self, run: RunId, element: str) -> str:
        """What the diagram calls an element."""
        mission = self._mission(run)
        known = mission.elements.get(element) if mission is not None else None
        return known.label if known is not None else element

    def is_shown(self, run: RunId, element: str) -> bool:
        """Whether it matters that a token is on it: gateways come and go."""
        mission = self._mission(run)
        return mission is None or isinstance(mission.elements.get(element), (Activity, Event))

    def requested(self, run: RunId, record: r.BehaviorRequested) -> Told:
        """A vehicle begins something."""
        who = ", ".join(record.resources)
        self._behaviors[run, record.behavior] = (record.name, who)
        return f"{self.label(run, record.element)}: {who} begins {record.name}", "cyan"

    def of_behavior(self, run: RunId, behavior: str) -> str:
        """Who does what."""
        name, who = self._behaviors.get((run, behavior), ("", ""))
        return f"{who}: {name}" if name else behavior

    def ended(self, run: RunId, record: r.BehaviorEnded) -> Told:
        """A vehicle is released."""
        name, who = self._behaviors.pop((run, record.behavior), (record.behavior, ""))
        how = record.state.value.lower()
        if record.state is not BehaviorState.CANCELLED and record.code:
            how = f"{how}, {record.code}" + (f" ({record.reason})" if record.reason else "")
        colour = "cyan" if record.state is BehaviorState.SUCCEEDED else "yellow"
        return f"{self.label(run, record.element)}: {who} ends {name}: {how}", colour

    def signal(self, run: RunId, record: r.SignalThrown) -> Told:
        """A signal, by a token or an operator."""
        mission = self._mission(run)
        known = mission.signals.get(record.signal) if mission is not None else None
        name = known.name if known is not None and known.name else record.signal
        origin = self.label(run, record.element) if record.element else record.by or "outside"
        return f"{origin}: signal '{name}'", "magenta"


def printable(text: str) -> str:
    """On one line, and without what would steer a terminal: names come from strangers' files."""
    line = " ".join(text.split())
    return line if line.isprintable() else "".join(c if c.isprintable() else "?" for c in line)


def _by(record: Any) -> str:
    return f" by {record.by}" if record.by else ""


def _entered(story: Story, run: RunId, record: r.TokenEntered) -> Told | None:
    if not story.is_shown(run, record.element):
        return None
    number = f", instance {record.instance}" if record.instance is not None else ""
    return f"{story.label(run, record.element)}{number}", ""


def _left(story: Story, run: RunId, record: r.TokenLeft) -> Told | None:
    if record.outcome is not r.TokenOutcome.INTERRUPTED:
        return None
    if not story.is_shown(run, record.element):
        return None
    return f"{story.label(run, record.element)}: interrupted", "yellow"


def _ended(story: Story, run: RunId, record: r.RunEnded) -> Told:
    well = record.outcome in (r.RunOutcome.COMPLETED, r.RunOutcome.TERMINATED)
    detail = f": {record.detail}" if record.detail else ""
    return f"{run} {record.outcome.value}{detail}", "green" if well else "red"


def _answered(story: Story, run: RunId, record: r.PromptAnswered) -> Told:
    return f"{story.label(run, record.element)}: {record.decision}, answered{_by(record)}", "green"


def _service_ended(story: Story, run: RunId, record: r.ServiceEnded) -> Told:
    label = story.label(run, record.element)
    if not record.code:
        return f"{label}: done", ""
    return f"{label}: failed, {record.code}" + (
        f" ({record.reason})" if record.reason else ""
    ), "red"


def _escalation(story: Story, run: RunId, record: r.EscalationThrown) -> Told:
    caught = f"caught by {story.label(run, record.caught_by)}" if record.caught_by else "not caught"
    what = record.code or record.escalation
    return f"{story.label(run, record.element)}: escalation {what}, {caught}", "magenta"


def _error(story: Story, run: RunId, record: r.ErrorThrown) -> Told:
    caught = f"caught by {story.label(run, record.caught_by)}" if record.caught_by else "not caught"
    reason = f" ({record.reason})" if record.reason else ""
    return f"{story.label(run, record.element)}: error {record.code}{reason}, {caught}", "red"


def _unsettled(story: Story, run: RunId, record: r.BehaviorUnsettled) -> Told:
    return f"{story.of_behavior(run, record.behavior)}: held, {record.reason}", "yellow"


def _compensation(story: Story, run: RunId, record: r.CompensationTriggered) -> Told:
    what = "undoes what was done" if record.completions else "there is nothing to undo"
    return f"{story.label(run, record.element)}: {what}", "magenta"


_TELLERS: dict[type, Callable[[Story, RunId, Any], Told | None]] = {
    r.RunStarted: lambda story, run, record: (
        f"{run} of {story.label(run, record.process)} started{_by(record)}",
        "green",
    ),
    r.RunClaimed: lambda _, run, record: (f"{run} taken up again{_by(record)}", "green"),
    r.RunPaused: lambda _, run, record: (f"{run} paused{_by(record)}", "yellow"),
    r.RunResumed: lambda _, run, record: (f"{run} goes on{_by(record)}", "yellow"),
    r.RunEnded: _ended,
    r.TokenEntered: _entered,
    r.TokenLeft: _left,
    r.BehaviorRequested: Story.requested,
    r.BehaviorEnded: Story.ended,
    r.BehaviorUnsettled: _unsettled,
    r.BehaviorContinued: lambda story, run, record: (
        f"{story.of_behavior(run, record.behavior)}: goes on{_by(record)}",
        "cyan",
    ),
    r.BehaviorRestarted: lambda story, run, record: (
        f"{story.of_behavior(run, record.behavior)}: started again{_by(record)}",
        "cyan",
    ),
    r.PromptOpened: lambda story, run, record: (
        f"{story.label(run, record.element)} asks: {record.text}",
        "green",
    ),
    r.PromptAnswered: _answered,
    r.ServiceRequested: lambda story, run, record: (
        f"{story.label(run, record.element)}: runs {record.name}",
        "",
    ),
    r.ServiceEnded: _service_ended,
    r.SignalThrown: Story.signal,
    r.MessageThrown: lambda story, run, record: (
        f"{story.label(run, record.element) if record.element else record.by or 'outside'}:"
        f" message {record.message}",
        "magenta",
    ),
    r.EscalationThrown: _escalation,
    r.ErrorThrown: _error,
    r.CompensationTriggered: _compensation,
    r.CompensationBegan: lambda story, run, record: (
        f"{story.label(run, record.activity)}: is undone",
        "magenta",
    ),
    r.TransactionCancelled: lambda story, run, record: (
        f"{story.label(run, record.element)}: the transaction is cancelled",
        "yellow",
    ),
    r.GeometryReceived: lambda _, __, record: (f"{record.name} received{_by(record)}", ""),
}
