"""Sends updates to every browser at a pace that the browser can follow; the engine never waits.

Records are applied to views as they come. 25 times a second, the names of what changed are added to
each viewer that watches, and those that are ready get a frame: all that keep up the same one, which
is made and encoded once. With many browsers there are fewer frames, so that the engine keeps its
pace.
"""

import asyncio
import logging
import time
from collections.abc import Iterable, Mapping, Sequence
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
from m2pem_plugin_web.live.live_run import LiveRun, command, debugging, requirement
from m2pem_plugin_web.live.messages import Message
from m2pem_plugin_web.live.standbys import Standbys
from m2pem_plugin_web.live.viewer import Unsent, Viewer
from m2pem_plugin_web.replay.replays import Recordings
from m2pem_plugin_web.tracks.detections import DetectionEntry

FRAME_S = 0.04

SLOWEST_FRAME_S = 0.2

SHARE = 0.05
"""Of the time of the event loop that making and sending frames may take."""

LOG_EVERY_S = 0.25

HOLDERS_EVERY_S = 0.5

MOST_VIEWERS = 64

RETRY_S = 1.0

FAULT_RECORDS = frozenset((r.BehaviorEnded, r.ErrorThrown, r.RunEnded))

log = logging.getLogger("m2pem.ocu.web")


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
        self._changed_holders: set[str] = set()
        self._holders_at = 0.0
        self._logged_at = 0.0
        self._times: dict[RunId, float] = {}
        self._changed_status: set[RunId] = set()

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
            self._send_to_all("fault", text=text if own else f"{view.run}: {text}")

    def status_changed(self, view: RunView) -> None:
        """Send the status with the next frame."""
        self._changed_status.add(view.run)

    def prompt_opened(self, prompt: OpenPrompt) -> None:
        """Send the prompt at once."""
        self._send_to_all("prompt", prompt=messages.prompt_of(prompt, self.place(prompt)))

    def prompt_closed(self, prompt: OpenPrompt, closed: PromptClosed) -> None:
        """Send the answer or withdrawal at once."""
        self._send_to_all("prompt_closed", **asdict(closed))

    def alerted(self, alert: Alert) -> None:
        """Send the alert at once, unless each page shows what it is about until it is over."""
        if alert.code == CONTROL_REQUEST and not alert.clears:
            return
        text = f"{alert.run}: {alert.text}" if alert.run else alert.text
        self._send_to_all("notice" if alert.code in NEWS else "fault", text=text)

    def alerts_changed(self) -> None:
        """Send at once that the alerts are to be read again."""
        self._send_to_all("alerts")

    def schedule_changed(self) -> None:
        """Send at once that the schedule is to be read again."""
        self._send_to_all("schedule")

    def shared_space_changed(self) -> None:
        """Send at once that shared space is to be read again."""
        self._send_to_all("shared_space")

    def operators_changed(self) -> None:
        """Send at once that operators are to be read again."""
        self._send_to_all("operators")

    def comments_changed(self, mission: str) -> None:
        """Send at once that the comments on a mission are to be read again."""
        self._send_to_all("comments", mission=mission)

    def announce(self, text: str) -> None:
        """Send a text to all operators."""
        self._send_to_all("fault", text=text)

    def detected(self, run: RunId, entries: Sequence[DetectionEntry], more: int) -> None:
        """Send new detections to those who watch the run. `more`: how many have no entry."""
        message = messages.message("detections", run=run, detections=entries, more=more)
        for viewer in self.viewers:
            if viewer.live is not None and viewer.live.view.run == run:
                viewer.send_soon(message)

    def _lost(self, resource: ResourceId) -> None:
        self._send_to_all("fault", text=f"{resource}: its link is lost")

    def _send_to_all(self, kind: str, **fields: Any) -> None:
        message = messages.message(kind, **fields)
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
        at, cost_s = loop.time(), 0.0
        while True:
            # After a delay, continue at the usual pace: skip the missed ticks.
            at = max(at + min(max(FRAME_S, cost_s / SHARE), SLOWEST_FRAME_S), loop.time())
            await asyncio.sleep(at - loop.time())
            if not self.viewers:
                self._end_changes({})
                continue
            await self._prepare(loop.time())
            began_s = time.thread_time()
            self._send_frames(loop.time())
            cost_s += (time.thread_time() - began_s - cost_s) / 4

    async def _prepare(self, now: float) -> None:
        self._send_statuses()
        await self._update_holders(now)
        watched = self._watched()
        self._end_changes(watched)
        for live in watched.values():
            await self._update_time(live.view)

    def _watched(self) -> dict[RunId, LiveRun]:
        return {each.live.view.run: each.live for each in self.viewers if each.live is not None}

    def _end_changes(self, watched: Mapping[RunId, LiveRun]) -> None:
        for run, live in self.runs.items():
            if run not in watched:
                live.end_changes()

    def _send_statuses(self) -> None:
        for run in self._changed_status:
            if run in self.runs:
                self._send_to_all("run", run=asdict(self.runs[run].view.counted()))
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
        self._changed_holders |= changed
        self._holders = holders

    async def _update_time(self, view: RunView) -> None:
        t_s = view.t_s
        if view.status in (RunStatus.RUNNING, RunStatus.PAUSED):
            with suppress(M2pemError):
                t_s = await self._control.mission_time_s(view.run)
        self._times[view.run] = t_s

    def _distribute_changes(self) -> None:
        """Add the names of what has changed to the viewers that watch it."""
        states = self.fleet.vehicles, self.fleet.payloads, self.fleet.teams
        names = [frozenset(each) for each in (*(s.dirty for s in states), self._changed_holders)]
        of_fleet = Unsent(frozenset(), frozenset(), *names)
        of_runs: dict[RunId, Unsent] = {}
        for run, live in self._watched().items():
            if (changes := live.view.changes) is not None:
                elements, behaviors = frozenset(changes.elements), frozenset(changes.behaviors)
                unsent = Unsent(elements, behaviors, *names)
                of_runs[run] = unsent._replace(
                    requirements=frozenset(changes.requirements),
                    debugging=frozenset(changes.debugging),
                )
                for behavior in behaviors - live.view.behaviors.keys():
                    self.fleet.teams.forget(behavior)
                live.clear_changes()
        for viewer in self.viewers:
            run = viewer.live.view.run if viewer.live is not None else ""
            viewer.unsent = viewer.unsent.merged(of_runs.get(run, of_fleet))
        for each in states:
            each.dirty.clear()
        self._changed_holders.clear()

    # --- messages ---------------------------------------------------------------------------

    def _send_frames(self, now: float) -> None:
        """Send to each viewer that is ready what it has not received: a snapshot, frame or log.

        No record is applied meanwhile: each message shows all that it counts.
        """
        self._distribute_changes()
        if now - self._logged_at >= LOG_EVERY_S:
            self._logged_at = now
            for viewer in self.viewers:
                viewer.wants_log = True
        made: dict[tuple[RunId, Unsent | int | None], Message] = {}
        for viewer in self.viewers:
            if not (viewer.may_send and viewer.due(now)):
                continue
            live = viewer.live
            run = live.view.run if live is not None else ""
            unsent = None if viewer.wants_snapshot else viewer.unsent
            if (frame := made.get((run, unsent))) is None:
                frame = self._snapshot(live) if unsent is None else self._frame(live, unsent)
                made[run, unsent] = frame
            viewer.send_paced(frame, now)
            if live is not None and viewer.log_due:
                after = max(viewer.logged_seq, live.view.newest[0].seq - 1)
                if (log := made.get((run, after))) is None:
                    log = made[run, after] = messages.message(
                        "log", records=live.newest_after(after)
                    )
                viewer.send_log(log)

    def _head(self, live: LiveRun | None) -> dict[str, Any]:
        if live is None:
            return {"run": None, "now": now_s(), "t": 0.0, "events": 0}
        view = live.view
        t_s = max(self._times.get(view.run, 0.0), view.t_s)
        return {"run": view.run, "now": now_s(), "t": t_s, "events": view.seq}

    def _snapshot(self, live: LiveRun | None) -> Message:
        prompts = self.follower.prompts.values()
        places = live.view.elements if live is not None else ()
        behaviors = live.view.behaviors if live is not None else {}
        requirements = live.view.requirements if live is not None else {}
        return messages.message(
            "snapshot",
            **self._head(live),
            status=live.view.status if live is not None else None,
            speed=self._control.speed(),
            elements=_elements(live, places),
            prompts=[messages.prompt_of(each, self.place(each)) for each in prompts],
            runs=[asdict(each.view.counted()) for each in self.runs.values()],
            vehicles=_encoded(self.fleet.vehicles, self.fleet.vehicles.states),
            payloads=_encoded(self.fleet.payloads, self.fleet.payloads.states),
            teams=_encoded(self.fleet.teams, self.fleet.teams.states),
            holders=self._holders,
            commands={key: command(each) for key, each in behaviors.items()},
            requirements={key: requirement(each) for key, each in requirements.items()},
            debugging=debugging(live.view) if live is not None else None,
        )

    def _frame(self, live: LiveRun | None, changed: Unsent) -> Message:
        frame = self._head(live)
        if live is not None and changed.elements:
            frame["elements"] = _elements(live, changed.elements)
        if live is not None and changed.commands:
            behaviors = live.view.behaviors
            frame["commands"] = {
                key: command(behaviors[key]) if key in behaviors else None
                for key in changed.commands
            }
        if live is not None and changed.requirements:
            known = live.view.requirements
            frame["requirements"] = {
                key: requirement(known[key]) if key in known else None
                for key in changed.requirements
            }
        if live is not None and changed.debugging:
            frame["debugging"] = debugging(live.view)
        for name, latest, names in (
            ("vehicles", self.fleet.vehicles, changed.vehicles),
            ("payloads", self.fleet.payloads, changed.payloads),
            ("teams", self.fleet.teams, changed.teams),
        ):
            if names:
                frame[name] = _encoded(latest, names)
        if changed.holders:
            frame["holders"] = {key: self._holders.get(key, "") for key in changed.holders}
        return messages.message("frame", **frame)


def _elements(live: LiveRun | None, places: Iterable[Place]) -> Mapping[str, Any]:
    if live is None:
        return {}
    return messages.nested((place, live.encoded(place)) for place in places)


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
