"""Sends updates to every browser at a pace that the browser can follow; the engine never waits.

Records are applied to views as they come. 25 times a second, the names of what changed are added to
each viewer that watches; its message is made when the browser is ready for it.
"""

import asyncio
import logging
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict
from typing import Any

import msgspec

from m2pem.api import (
    CONTROL_REQUEST,
    NEWS,
    PRESENCE_EVERY_S,
    Alert,
    BehaviorState,
    Listener,
    MissionControl,
    OpenPrompt,
    PromptClosed,
    ResourceId,
    RunId,
    RunStatus,
    RunView,
    StampedRecord,
    describe,
    follow,
)
from m2pem.api import records as r
from m2pem.api.run_view import Place
from m2pem.errors import M2pemError
from m2pem_plugin_web.access.requests import now_s
from m2pem_plugin_web.access.roles import Role
from m2pem_plugin_web.live import messages
from m2pem_plugin_web.live.latest_states import FleetStates, LatestStates
from m2pem_plugin_web.live.live_run import LiveRun, command
from m2pem_plugin_web.live.standbys import Standbys
from m2pem_plugin_web.live.viewer import Unsent, Viewer
from m2pem_plugin_web.replay.replays import Recordings

FRAME_S = 0.04

HOLDERS_EVERY_S = 0.5

MOST_VIEWERS = 64

RETRY_S = 1.0

FAULT_RECORDS = frozenset((r.BehaviorEnded, r.ErrorThrown, r.RunEnded))

log = logging.getLogger("m2pem.ocu.web")

_encode = msgspec.json.Encoder().encode


class Hub(Listener):
    """All browsers and their watched runs. It needs all records: create it before the executive
    runs. `recordings`: the indexes of runs that go on; None: none are made."""

    def __init__(self, control: MissionControl, recordings: Recordings | None = None) -> None:
        self.viewers: set[Viewer] = set()
        self.runs: dict[RunId, LiveRun] = {}
        self.follower = follow(control, self)
        self.fleet = FleetStates(control, self._lost)
        self.standbys = Standbys(control)
        self._recordings = recordings
        self._control = control
        self._holders: dict[str, str] = {}
        self._holders_at = 0.0
        self._times: dict[RunId, float] = {}
        self._changed_status: set[RunId] = set()
        self._encoded_for: tuple[RunId, int, set[Place]] = ("", 0, set())
        self._encoded_elements = msgspec.Raw(b"{}")

    async def run(self) -> None:
        """Send updates until cancelled."""
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(self._follow(), name="web: records")
            tasks.create_task(self.fleet.follow(), name="web: telemetry")
            tasks.create_task(self._pace(), name="web: frames")
            tasks.create_task(self.standbys.run(), name="web: standbys")
            tasks.create_task(self._announce_presence(), name="web: presence")

    async def _announce_presence(self) -> None:
        while True:
            for viewer in list(self.viewers):
                await self._present(viewer)
            await asyncio.sleep(PRESENCE_EVERY_S)

    async def _present(self, viewer: Viewer) -> None:
        if viewer.person is None:
            return
        run = viewer.live.view.run if viewer.live is not None else ""
        role, name = str(viewer.person.role), viewer.person.name
        with suppress(M2pemError):
            await self._control.announce_presence(
                viewer.id, unit="page", role=role, run=run, editing=viewer.editing, by=name
            )

    async def left(self, viewer: Viewer) -> None:
        """A browser is not connected any more."""
        with suppress(M2pemError):
            await self._control.end_presence(viewer.id)

    async def _follow(self) -> None:
        while True:
            try:
                return await self.follower.run()
            except M2pemError as error:
                log.warning("%s", error)
                await asyncio.sleep(RETRY_S)

    async def watch(self, viewer: Viewer, run: RunId | None) -> None:
        """Have a viewer watch a run, from a snapshot on.

        Raises:
            M2pemError: there is no such run.
        """
        live = None
        if run is not None:
            await self.follower.load(run)
            live = self.runs[run]
            live.begin_changes()
        viewer.unsent = Unsent()
        viewer.watch(live)
        await self._present(viewer)

    async def edit(self, viewer: Viewer, mission: str) -> None:
        """Announce which mission a person edits, if the person may; "": none."""
        may = viewer.person is not None and viewer.person.role.covers(Role.COMMANDER)
        if viewer.editing != (mission if may else ""):
            viewer.editing = mission
            await self._present(viewer)

    # --- at once --------------------------------------------------------------------------------

    def run_added(self, view: RunView) -> None:
        """Add a run; drop those that the follower has dropped."""
        for run in self.runs.keys() - self.follower.views.keys():
            del self.runs[run]
        self.runs[view.run] = LiveRun(view)

    def recorded(self, view: RunView, stamped: StampedRecord, *, is_new: bool) -> None:
        """Index the record for a replay; send faults that the mission does not handle to every
        page."""
        if self._recordings is not None:
            self._recordings.recorded(view, stamped)
        if is_new and type(stamped.record) in FAULT_RECORDS and _is_fault(stamped.record):
            text = describe(stamped, view).text
            own = text.startswith(f"{view.run} ")
            self._send_to_all(messages.fault(text if own else f"{view.run}: {text}"))

    def status_changed(self, view: RunView) -> None:
        """Send the status with the next frame."""
        self._changed_status.add(view.run)

    def prompt_opened(self, prompt: OpenPrompt) -> None:
        """Send the prompt at once."""
        self._send_to_all(messages.prompt_opened(prompt, self.place(prompt)))

    def prompt_closed(self, prompt: OpenPrompt, closed: PromptClosed) -> None:
        """Send the answer or withdrawal at once."""
        self._send_to_all(messages.prompt_closed(closed))

    def alerted(self, alert: Alert) -> None:
        """Send the alert at once, unless each page shows what it is about until it is over."""
        if alert.code == CONTROL_REQUEST and not alert.clears:
            return
        text = f"{alert.run}: {alert.text}" if alert.run else alert.text
        is_news = alert.code in NEWS
        self._send_to_all(messages.notice(text) if is_news else messages.fault(text))

    def alerts_changed(self) -> None:
        """Send at once that the alerts are to be read again."""
        self._send_to_all(messages.alerts_changed())

    def schedule_changed(self) -> None:
        """Send at once that the schedule is to be read again."""
        self._send_to_all(messages.schedule_changed())

    def shared_space_changed(self) -> None:
        """Send at once that shared space is to be read again."""
        self._send_to_all(messages.shared_space_changed())

    def operators_changed(self) -> None:
        """Send at once that operators are to be read again."""
        self._send_to_all(messages.operators_changed())

    def announce(self, text: str) -> None:
        """Send a text to all operators."""
        self._send_to_all(messages.fault(text))

    def _lost(self, resource: ResourceId) -> None:
        self._send_to_all(messages.fault(f"{resource}: its link is lost"))

    def _send_to_all(self, message: dict[str, Any]) -> None:
        for viewer in self.viewers:
            viewer.send_soon(message)

    def place(self, prompt: OpenPrompt) -> Place | None:
        """Return the process and element of an open prompt, if its record is known yet."""
        view = self.follower.views.get(prompt.run)
        record = view.prompts.get(prompt.prompt) if view is not None else None
        return (record.process, record.element) if record is not None else None

    # --- at a pace ------------------------------------------------------------------------------

    async def _pace(self) -> None:
        loop = asyncio.get_running_loop()
        at = loop.time()
        while True:
            # After a delay, continue at the usual pace: skip the missed ticks.
            at = max(at + FRAME_S, loop.time())
            await asyncio.sleep(at - loop.time())
            if self.viewers:
                await self._tick(loop.time())
            else:
                self._end_changes({})

    async def _tick(self, now: float) -> None:
        self._send_statuses()
        await self._update_holders(now)
        watched = self._watched()
        self._end_changes(watched)
        for live in watched.values():
            await self._update_time(live.view)
        self._distribute_changes()
        for viewer in self.viewers:
            if viewer.due(now):
                viewer.frame_due = True
                viewer.wake.set()

    def _watched(self) -> dict[RunId, LiveRun]:
        return {each.live.view.run: each.live for each in self.viewers if each.live is not None}

    def _end_changes(self, watched: Mapping[RunId, LiveRun]) -> None:
        for run, live in self.runs.items():
            if run not in watched:
                live.end_changes()

    def _send_statuses(self) -> None:
        for run in self._changed_status:
            if run in self.runs:
                self._send_to_all(messages.run(self.runs[run].view.counted()))
        self._changed_status.clear()

    async def _update_holders(self, now: float) -> None:
        if now - self._holders_at < HOLDERS_EVERY_S:
            return
        self._holders_at = now
        try:
            holders = {str(each): who for each, who in (await self._control.holders()).items()}
        except M2pemError:
            return
        changed = {name for name, who in holders.items() if self._holders.get(name) != who}
        self._holders = holders
        if changed:
            for viewer in self.viewers:
                viewer.unsent.holders |= changed

    async def _update_time(self, view: RunView) -> None:
        t_s = view.t_s
        if view.status in (RunStatus.RUNNING, RunStatus.PAUSED):
            with suppress(M2pemError):
                t_s = await self._control.mission_time_s(view.run)
        self._times[view.run] = t_s

    def _distribute_changes(self) -> None:
        """Add the names of changed elements to the viewers that watch them."""
        for viewer in self.viewers:
            if viewer.live is not None and (changes := viewer.live.view.changes) is not None:
                viewer.unsent.elements |= changes.elements
                viewer.unsent.commands |= changes.behaviors
            viewer.unsent.vehicles |= self.fleet.vehicles.dirty
            viewer.unsent.payloads |= self.fleet.payloads.dirty
            viewer.unsent.teams |= self.fleet.teams.dirty
        for live in self._watched().values():
            if (changes := live.view.changes) is not None:
                for behavior in changes.behaviors - live.view.behaviors.keys():
                    self.fleet.teams.forget(behavior)
                live.clear_changes()
        for states in (self.fleet.vehicles, self.fleet.payloads, self.fleet.teams):
            states.dirty.clear()

    # --- messages ---------------------------------------------------------------------------

    def next_messages(self, viewer: Viewer, now: float) -> list[dict[str, Any]]:
        """Return the messages to send to a viewer now, in order; they count as sent."""
        due = [viewer.numbered(each) for each in viewer.urgent]
        viewer.urgent.clear()
        if viewer.may_send and (viewer.wants_snapshot or viewer.frame_due):
            # Records may have come since the names were added: the frame includes all of them.
            self._distribute_changes()
            state = self._snapshot(viewer) if viewer.wants_snapshot else self._frame(viewer)
            viewer.wants_snapshot = viewer.frame_due = False
            viewer.unsent = Unsent()
            viewer.sent_seq = viewer.live.view.seq if viewer.live is not None else 0
            due.append(viewer.numbered(state))
            viewer.sent_paced(now)
            if viewer.live is not None and viewer.log_due(now):
                due.append(viewer.numbered(self._log(viewer, viewer.live)))
        return due

    def _log(self, viewer: Viewer, live: LiveRun) -> dict[str, Any]:
        records = [each for each in live.view.newest if each.seq > viewer.logged_seq]
        viewer.logged_seq = live.view.seq
        return messages.log(records, live.view)

    def _head(self, kind: str, live: LiveRun | None) -> dict[str, Any]:
        if live is None:
            return {"type": kind, "run": None, "now": now_s(), "t": 0.0, "events": 0}
        view = live.view
        t_s = max(self._times.get(view.run, 0.0), view.t_s)
        return {"type": kind, "run": view.run, "now": now_s(), "t": t_s, "events": view.seq}

    def _snapshot(self, viewer: Viewer) -> dict[str, Any]:
        live = viewer.live
        prompts = self.follower.prompts.values()
        return {
            **self._head("snapshot", live),
            "status": live.view.status if live is not None else None,
            "speed": self._control.speed(),
            "elements": messages.nested(
                (place, live.encoded(place)) for place in live.view.elements
            )
            if live is not None
            else {},
            "prompts": [messages.prompt_of(each, self.place(each)) for each in prompts],
            "runs": [asdict(each.view.counted()) for each in self.runs.values()],
            "vehicles": _encoded(self.fleet.vehicles, self.fleet.vehicles.states),
            "payloads": _encoded(self.fleet.payloads, self.fleet.payloads.states),
            "teams": _encoded(self.fleet.teams, self.fleet.teams.states),
            "holders": self._holders,
            "commands": {key: command(each) for key, each in live.view.behaviors.items()}
            if live is not None
            else {},
        }

    def _elements(self, live: LiveRun, places: set[Place]) -> msgspec.Raw:
        """Return states of elements as JSON, encoded once for browsers that keep up."""
        wanted = (live.view.run, live.view.seq, places)
        if wanted != self._encoded_for:
            states = messages.nested((place, live.encoded(place)) for place in places)
            self._encoded_for, self._encoded_elements = wanted, msgspec.Raw(_encode(states))
        return self._encoded_elements

    def _frame(self, viewer: Viewer) -> dict[str, Any]:
        live, changes = viewer.live, viewer.unsent
        frame = self._head("frame", live)
        if live is not None and changes.elements:
            frame["elements"] = self._elements(live, changes.elements)
        if live is not None and changes.commands:
            behaviors = live.view.behaviors
            frame["commands"] = {
                key: command(behaviors[key]) if key in behaviors else None
                for key in changes.commands
            }
        for name, latest, changed in (
            ("vehicles", self.fleet.vehicles, changes.vehicles),
            ("payloads", self.fleet.payloads, changes.payloads),
            ("teams", self.fleet.teams, changes.teams),
        ):
            if changed:
                frame[name] = _encoded(latest, changed)
        if changes.holders:
            frame["holders"] = {key: self._holders.get(key, "") for key in changes.holders}
        return frame


def _encoded(latest: LatestStates, names: Any) -> Mapping[str, msgspec.Raw]:
    found = ((name, latest.encoded(name)) for name in names)
    return {name: state for name, state in found if state is not None}


def _is_fault(record: r.Record) -> bool:
    """Return whether a record is a fault that the mission does not handle."""
    match record:
        case r.BehaviorEnded(state=BehaviorState.LOST):
            return True
        case r.ErrorThrown(caught_by=""):
            return True
        case r.RunEnded(outcome=r.RunOutcome.FAILED):
            return True
    return False
