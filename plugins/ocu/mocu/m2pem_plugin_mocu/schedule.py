"""The schedule over ROS: its entries as messages, and what changes as events."""

import math
from collections.abc import Callable, Mapping
from typing import Any

from m2pem_interfaces import msg
from m2pem_plugin_ros import RosRuntime, messages, qos, sendable
from rclpy.qos import QoSProfile, ReliabilityPolicy

from m2pem.api import (
    MissionControl,
    Schedule,
    ScheduledMission,
    ScheduledStatus,
    SettledTime,
    Settlement,
)
from m2pem_plugin_mocu.publish_throttle import PublishThrottle

EVENTS = QoSProfile(depth=100, reliability=ReliabilityPolicy.RELIABLE)

INT32_MAX = 2**31 - 1

_STATUS = {status: getattr(msg.ScheduledMission, status.name) for status in ScheduledStatus}
_SETTLEMENT = {each: getattr(msg.SettledTime, each.name) for each in Settlement}


class ScheduleTopics:
    """Publishes the schedule, and events of what has changed in it since the last time."""

    def __init__(self, ros: RosRuntime, control: MissionControl, now_us: Callable[[], int]) -> None:
        self._control = control
        self._now_us = now_us
        self._known: dict[str, ScheduledMission] | None = None
        self._hold = ""
        create = ros.node.create_publisher
        self._publisher = create(msg.Schedule, "schedule", qos.STATUS)
        self._events = create(msg.ScheduleEvent, "schedule_events", EVENTS)
        self._throttle = PublishThrottle(self._publish)

    def mark_changed(self) -> None:
        """Have it published soon."""
        self._throttle.mark_changed()

    async def run(self) -> None:
        """Publish until cancelled."""
        await self._throttle.run()

    async def _publish(self) -> None:
        found = await self._control.scheduled()
        stamp_us = self._now_us()
        message = schedule(found)
        message.stamp = messages.time_of(stamp_us)
        self._publisher.publish(message)
        entries = {each.entry: each for each in found.entries}
        for event in self._changes(entries, found.hold):
            event.stamp = messages.time_of(stamp_us)
            self._events.publish(event)
        self._known, self._hold = entries, found.hold

    def _changes(self, entries: Mapping[str, ScheduledMission], hold: str) -> list[Any]:
        """Return an event for each change. What was there before this unit began is none."""
        if self._known is None:
            return []
        kinds, known = msg.ScheduleEvent, self._known
        events = [
            kinds(kind=kinds.CHANGED if number in known else kinds.ADDED, entry=entry(each))
            for number, each in entries.items()
            if known.get(number) != each
        ]
        events += [
            kinds(kind=kinds.REMOVED, entry=entry(each))
            for number, each in known.items()
            if number not in entries
        ]
        if hold != self._hold:
            kind = kinds.HELD if hold else kinds.RELEASED
            events.append(kinds(kind=kind, hold=sendable(hold)))
        return events


async def list_schedule(control: MissionControl, request: Any, response: Any) -> None:
    """Answer a ListSchedule request."""
    response.schedule = schedule(await control.scheduled(), open_only=request.open_only)


def schedule(found: Schedule, *, open_only: bool = False) -> Any:
    """Return the schedule as a message without a stamp."""
    return msg.Schedule(
        served=found.served,
        hold=sendable(found.hold),
        warning_s=float(found.warning_s),
        entries=[entry(each) for each in found.entries if not (open_only and each.status.over)],
    )


def entry(mission: ScheduledMission) -> Any:
    """Return an entry as a message."""
    when = mission.when
    deadline_s = when.starting_deadline_s
    return msg.ScheduledMission(
        entry=mission.entry,
        mission=sendable(mission.mission),
        process=sendable(mission.process),
        status=_STATUS[mission.status],
        when=sendable(mission.when_text),
        at=sendable(when.at),
        cron=sendable(when.cron),
        time_zone=sendable(when.time_zone),
        until=sendable(when.until),
        after=sendable(when.after),
        outcomes=list(when.outcomes) if when.after else [],
        condition=sendable(when.condition),
        vehicles=[sendable(each) for each in when.vehicles],
        held_for_s=float(when.held_for_s),
        starting_deadline_s=math.nan if deadline_s is None else float(deadline_s),
        missed=when.missed.value,
        concurrency=when.concurrency.value,
        priority=max(-INT32_MAX, min(INT32_MAX, mission.priority)),
        by=sendable(mission.by),
        scheduled=messages.time_of(mission.scheduled_us),
        next=messages.time_of(mission.next_us),
        due=messages.time_of(mission.due_us),
        deadline=messages.time_of(mission.deadline_us),
        starts=messages.time_of(mission.starts_us),
        reason=sendable(mission.reason),
        run=mission.run,
        times=[settled_time(each) for each in mission.times],
    )


def settled_time(settled: SettledTime) -> Any:
    """Return what became of a time as a message."""
    return msg.SettledTime(
        due=messages.time_of(settled.due_us),
        at=messages.time_of(settled.at_us),
        settlement=_SETTLEMENT[settled.settlement],
        run=settled.run,
        text=sendable(settled.text),
        times=settled.times,
        owed=settled.owed,
    )
