"""What is so now, of which operators must know: questions, incidents, lost links, and more.

It is looked at twice a second, so it costs nothing when records are committed.
"""

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, field

from m2pem.api.alerts import (
    BATTERY_LOW,
    INCIDENT,
    LINK_LOST,
    NOT_READY,
    QUESTION,
    SPACE_VIOLATED,
    AlertSeverity,
    OperatorAlert,
)
from m2pem.api.telemetry import LinkState, VehicleState
from m2pem.engine.records import Trigger
from m2pem.engine.state import RunState, RunStatus, Wait
from m2pem.executive.alert_list import Condition
from m2pem.executive.runner import Runner
from m2pem.executive.supervisor import Supervisor
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.elements import BoundaryEvent
from m2pem.telemetry.bus import Bus
from m2pem.telemetry.link_monitor import LinkMonitor

NOT_READY_AFTER_US = 10_000_000
"""A vehicle that has just started says for a while that it is not ready."""


@dataclass(eq=False)
class AlertConditions:
    """Reads the conditions off the parts of an executive.

    `links`: returns what watches the links; None: they are not watched.
    """

    _supervisor: Supervisor
    _bus: Bus
    _links: Callable[[], LinkMonitor | None]
    _not_ready_us: dict[ResourceId, int] = field(default_factory=dict)

    def now(self) -> list[Condition]:
        """What is so now."""
        now_us = self._supervisor.clock.now_us()
        found: list[Condition] = []
        for runner in self._supervisor.runners.values():
            if runner.prompts:
                found += _questions(runner, now_us)
            if runner.run.state.incidents:
                found += _incidents(runner)
        found += self._resources(now_us)
        if self._supervisor.fleet.shared_space:
            found += self._spaces()
        return found

    def undecided(self, alert: OperatorAlert) -> Collection[str]:
        """Of whom it cannot be said yet whether an alert still holds; see `AlertList.update`."""
        if alert.subject:
            if not alert.run:
                return ()
            runner = self._supervisor.runners.get(alert.run)
            # A run that is being taken up has the question before it asks it.
            still = runner is None or alert.subject in runner.run.state.prompts
            return (alert.subject,) if still else ()
        latest = self._bus.latest
        return [
            each
            for each in alert.resources
            if each in self._supervisor.arbiters.resources and latest(ResourceId(each)) is None
        ]

    def _resources(self, now_us: int) -> Iterator[Condition]:
        links = self._links()
        lost, low, not_ready = [], [], []
        for resource in self._supervisor.arbiters.resources:
            state = self._bus.latest(resource)
            if state is None:
                continue
            elif state.link is LinkState.LOST:
                lost.append(resource)
            elif isinstance(state, VehicleState) and state.ready is False and not state.armed:
                since_us = self._not_ready_us.setdefault(resource, now_us)
                if now_us - since_us >= NOT_READY_AFTER_US:
                    not_ready.append(resource)
            else:
                self._not_ready_us.pop(resource, None)
            if links is not None and links.has_low_battery(resource):
                low.append(resource)
        for code, severity, text, names in (
            (LINK_LOST, AlertSeverity.ERROR, "{names}: the link is lost", lost),
            (BATTERY_LOW, AlertSeverity.WARNING, "{names}: the battery is low", low),
            (NOT_READY, AlertSeverity.WARNING, "{names}: not ready for a mission", not_ready),
        ):
            if names:
                yield Condition(code, severity, text, resources=tuple(names))

    def _spaces(self) -> Iterator[Condition]:
        for space in self._supervisor.shared_space():
            if len(space.holders) > space.capacity:
                names = tuple(each.vehicle for each in space.holders)
                text = f"{space.name} has {len(names)} vehicles and {space.capacity} places: "
                yield Condition(
                    SPACE_VIOLATED,
                    AlertSeverity.ERROR,
                    text + "{names}",
                    subject=space.name,
                    resources=names,
                )


def _questions(runner: Runner, now_us: int) -> Iterator[Condition]:
    for prompt in list(runner.prompts.values()):
        deadline_us = _deadline_us(runner.run.state, prompt.prompt, now_us)
        yield Condition(
            QUESTION,
            AlertSeverity.WARNING,
            f"asks: {prompt.text}",
            runner.id,
            prompt.prompt,
            deadline_us=deadline_us,
        )


def _deadline_us(state: RunState, prompt: str, now_us: int) -> int | None:
    """When a timer withdraws a question, by the executive's clock."""
    known = state.prompts.get(prompt)
    if known is None or not known.token.waits:
        return None
    due_us = (_due_us(each, state, now_us) for each in known.token.waits.values())
    return min((each for each in due_us if each is not None), default=None)


def _due_us(wait: Wait, state: RunState, now_us: int) -> int | None:
    node = wait.node
    if wait.trigger is not Trigger.TIMER or not isinstance(node, BoundaryEvent):
        return None
    if not node.interrupting:
        return None
    if wait.calendar:
        return wait.due_us
    if state.status is RunStatus.PAUSED:
        return None
    return wait.due_us + now_us - state.mission_time_us(now_us)


def _incidents(runner: Runner) -> Iterator[Condition]:
    for incident in runner.run.state.incidents.values():
        reason = f": {incident.reason}" if incident.reason else ""
        yield Condition(
            INCIDENT,
            AlertSeverity.ERROR,
            f"{incident.token.node.label}: {incident.code}{reason}",
            runner.id,
            incident.id,
            incident.resources,
        )
