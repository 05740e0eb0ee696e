"""The topics that operators receive: docs/ros-operators.md."""

import asyncio
import logging
import math
import time
from collections import deque
from typing import Any

from m2pem_interfaces import msg
from m2pem_plugin_ros import RosRuntime, messages, qos
from rclpy.duration import Duration
from rclpy.qos import QoSProfile, ReliabilityPolicy

from m2pem.api import (
    Alert,
    Follower,
    Listener,
    MissionControl,
    OpenPrompt,
    PromptClosed,
    RunId,
    RunStatus,
    RunSummary,
    RunView,
    StampedRecord,
)
from m2pem.api import records as r
from m2pem.api.runs import SCHEDULE, STARTS_SOON
from m2pem.errors import M2pemError
from m2pem_plugin_mocu import incidents
from m2pem_plugin_mocu.publish_throttle import PublishThrottle
from m2pem_plugin_mocu.schedule import ScheduleTopics
from m2pem_plugin_mocu.shared_space import SharedSpaceTopic

PROMPT_EVENTS = QoSProfile(depth=100, reliability=ReliabilityPolicy.RELIABLE)

EVENTS_AT_ONCE = 25
EVENTS_EVERY_S = 0.025
"""That is 1000 a second, and 1000 are what the topic keeps for a reader: one in Python takes
several thousand a second, and may hesitate for one."""

EVENTS_WAITING = 10_000
"""Beyond that the oldest are left out, which their readers see by `seq`."""

CLOSED_PROMPTS = 1000
"""Closed prompts that are remembered: a late answer is refused with the name of the first."""

TOKEN_RECORDS = frozenset(
    (r.TokenEntered, r.TokenLeft, r.ScopeOpened, r.BehaviorRequested, r.BehaviorEnded, r.RunEnded)
)

FLUSH_S = 1.0
"""At the end, so long may take what has not been sent, or not been confirmed by its readers."""

log = logging.getLogger("m2pem.ocu.mocu")


def now_us() -> int:
    """The time of this machine, in microseconds since the Unix epoch."""
    return time.time_ns() // 1000


class Topics(Listener):
    """Publishes what a follower reports."""

    def __init__(self, ros: RosRuntime, control: MissionControl, follower: Follower) -> None:
        self._ros = ros
        publisher = ros.node.create_publisher
        self._ros_log = ros.node.get_logger()
        self._control = control
        self._follower = follower
        self._opened_us: dict[tuple[RunId, str], int] = {}
        """When each open prompt became known here."""
        self.closed_prompts: dict[tuple[RunId, str], PromptClosed] = {}
        self._incidents: dict[str, OpenPrompt] = {}
        self._prompts = publisher(msg.OpenPrompts, "prompts", qos.STATUS)
        self._prompt_events = publisher(msg.Prompt, "prompt_events", PROMPT_EVENTS)
        self._status = publisher(msg.MissionStatus, "status", qos.STATUS)
        self._active = publisher(msg.ActiveElements, "active_elements", qos.STATUS)
        self._events = publisher(msg.MissionEvent, "events", qos.EVENTS)
        self.schedule = ScheduleTopics(ros, control, self.now_us)
        self.shared_space = SharedSpaceTopic(ros, control, self.now_us)
        self._waiting: deque[tuple[RunView, StampedRecord, int]] = deque()
        self._some_wait = asyncio.Event()
        self.left_out = 0
        self._prompts_throttle = PublishThrottle(self._publish_prompts)
        self._status_throttle = PublishThrottle(self._publish_status)
        self._active_throttle = PublishThrottle(self._publish_active)

    def now_us(self) -> int:
        """Return the time for stamps: that of this machine, or of /clock with `use_sim_time`."""
        return self._ros.stamp_us(now_us())

    def listeners(self) -> int:
        """How many clients receive events, and prompts as they come."""
        publishers = (self._events, self._prompt_events)
        return min(int(publisher.get_subscription_count()) for publisher in publishers)

    async def run(self) -> None:
        """Publish until cancelled."""
        async with asyncio.TaskGroup() as group:
            for throttle in (self._prompts_throttle, self._status_throttle, self._active_throttle):
                group.create_task(throttle.run())
            group.create_task(self._send_events())
            group.create_task(self.schedule.run())
            group.create_task(self.shared_space.run())

    async def flush(self) -> None:
        """Publish the last state, and give clients the time to receive it."""
        try:
            async with asyncio.timeout(FLUSH_S):
                while self._waiting:
                    self._send_some()
                    await asyncio.sleep(0)
                for publish in (self._publish_prompts, self._publish_status, self._publish_active):
                    await publish()
                publishers = (
                    self._prompts,
                    self._prompt_events,
                    self._status,
                    self._active,
                    self._events,
                )
                for publisher in publishers:
                    wait = Duration(seconds=FLUSH_S / len(publishers))
                    await asyncio.to_thread(publisher.wait_for_all_acked, wait)
        except TimeoutError:
            log.warning("some operators may not have received how it ended")

    # --- what the follower reports --------------------------------------------------------------

    def run_added(self, view: RunView) -> None:
        """Publish the new run soon."""
        self._status_throttle.mark_changed()
        self._active_throttle.mark_changed()

    def recorded(self, view: RunView, stamped: StampedRecord, *, is_new: bool) -> None:
        """Queue an event for a new record."""
        if not is_new:
            return
        if len(self._waiting) >= EVENTS_WAITING:
            self._waiting.popleft()
            self.left_out += 1
        self._waiting.append((view, stamped, view.at_us(stamped.t_s)))
        self._some_wait.set()
        self._note_incident(view, stamped.record)
        if type(stamped.record) in TOKEN_RECORDS:
            self._active_throttle.mark_changed()

    def _note_incident(self, view: RunView, record: r.Record) -> None:
        """Publish an incident as a prompt that opens, and its end as one that closes."""
        match record:
            case r.IncidentOpened():
                prompt = self._incidents[record.incident] = incidents.prompt_of(view, record)
                opened_us = self._opened_us[view.run, record.incident] = self.now_us()
                self._prompt_events.publish(messages.open_prompt(prompt, opened_us))
            case r.IncidentResolved(incident=incident, choice=choice, by=by):
                self._close_incident(view.run, incident, choice.value, by)
            case r.IncidentClosed(incident=incident):
                self._close_incident(view.run, incident, "", "")
            case _:
                return
        self._prompts_throttle.mark_changed()

    def _close_incident(self, run: RunId, incident: str, choice: str, by: str) -> None:
        prompt = self._incidents.pop(incident, None)
        self._opened_us.pop((run, incident), None)
        if prompt is not None:
            closed = messages.closed_prompt(prompt, choice, by, self.now_us())
            self._prompt_events.publish(closed)

    def status_changed(self, view: RunView) -> None:
        """Publish the status soon."""
        self._status_throttle.mark_changed()
        self._active_throttle.mark_changed()

    def prompt_opened(self, prompt: OpenPrompt) -> None:
        """Publish it at once as an event, and soon among all open prompts."""
        opened_us = self._opened_us[prompt.run, prompt.prompt] = self.now_us()
        self._prompt_events.publish(messages.open_prompt(prompt, opened_us))
        self._prompts_throttle.mark_changed()

    def prompt_closed(self, prompt: OpenPrompt, closed: PromptClosed) -> None:
        """Publish it at once as an event, and soon all prompts that are still open."""
        key = (closed.run, closed.prompt)
        self._opened_us.pop(key, None)
        self.closed_prompts[key] = closed
        if len(self.closed_prompts) > CLOSED_PROMPTS:
            del self.closed_prompts[next(iter(self.closed_prompts))]
        self._prompt_events.publish(
            messages.closed_prompt(prompt, closed.decision, closed.by, self.now_us())
        )
        self._prompts_throttle.mark_changed()

    def schedule_changed(self) -> None:
        """Publish the schedule soon."""
        self.schedule.mark_changed()

    def shared_space_changed(self) -> None:
        """Publish shared space soon."""
        self.shared_space.mark_changed()

    def alerted(self, alert: Alert) -> None:
        """Log it in ROS, whose topic `/rosout` operators read."""
        text = f"{alert.run}: {alert.text}" if alert.run else alert.text
        if alert.code == SCHEDULE:
            self._ros_log.info(text)
        elif alert.code == STARTS_SOON:
            self._ros_log.warning(text)
        else:
            self._ros_log.error(text)

    # --- publishing -----------------------------------------------------------------------------

    async def _publish_prompts(self) -> None:
        prompts = [
            messages.open_prompt(prompt, self._opened_us.get(key, 0))
            for key, prompt in self._follower.prompts.items()
        ]
        prompts += [
            messages.open_prompt(
                incidents.prompt_of(view, record), self._opened_us.get((view.run, number), 0)
            )
            for view in self._follower.views.values()
            for number, record in view.incidents.items()
        ]
        self._prompts.publish(
            msg.OpenPrompts(stamp=messages.time_of(self.now_us()), prompts=prompts)
        )

    async def _publish_active(self) -> None:
        self._active.publish(messages.active_elements(self._follower.views.values(), self.now_us()))

    async def _publish_status(self) -> None:
        runs: list[Any] = []
        for view in list(self._follower.views.values()):
            summary = view.summary
            runs.append(messages.run_status(summary, await self.mission_time_s(summary)))
        self._status.publish(msg.MissionStatus(stamp=messages.time_of(self.now_us()), runs=runs))

    async def mission_time_s(self, summary: RunSummary) -> float:
        """Of a run that goes on; NaN of others."""
        if summary.status.ended or summary.status is RunStatus.INTERRUPTED:
            return math.nan
        try:
            return await self._control.mission_time_s(summary.run)
        except M2pemError:  # no executive here drives it, or it has ended just now
            return math.nan

    async def _send_events(self) -> None:
        while True:
            self._some_wait.clear()
            if not self._waiting:
                await self._some_wait.wait()
            self._send_some()
            await asyncio.sleep(EVENTS_EVERY_S)

    def _send_some(self) -> None:
        if not self._events.get_subscription_count():
            self._waiting.clear()  # what no client receives is not kept: the journal has it
        for _ in range(min(EVENTS_AT_ONCE, len(self._waiting))):
            view, stamped, at_us = self._waiting.popleft()
            try:
                self._events.publish(messages.event(view, stamped, at_us))
            except Exception:  # one that no message can carry must not silence the others
                log.exception("%s: record %d cannot be sent", stamped.run, stamped.seq)
