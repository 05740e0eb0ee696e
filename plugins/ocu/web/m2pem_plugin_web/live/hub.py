"""Tells every browser what is new, at a pace that it keeps up with; the engine waits for none.

Records are folded into pictures as they come. 25 times a second, names of what changed are
handed to those who watch; what they are told is made when they are ready for it.
"""

import asyncio
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict
from typing import Any

import msgspec

from m2pem.api import (
    Alert,
    MissionControl,
    OpenPrompt,
    PromptClosed,
    ResourceId,
    RunId,
    RunStatus,
)
from m2pem.errors import M2pemError
from m2pem_plugin_web.access.lateness import now_s
from m2pem_plugin_web.live import words
from m2pem_plugin_web.live.feed import Feed
from m2pem_plugin_web.live.fleet import FleetPicture, Heard
from m2pem_plugin_web.live.picture import Picture, Place
from m2pem_plugin_web.live.viewer import Changes, Viewer

FRAME_S = 0.04

HOLDERS_EVERY_S = 0.5

MOST_VIEWERS = 64

_encode = msgspec.json.Encoder().encode


class Hub:
    """All browsers, and what they look at. Made before the executive runs, so nothing is missed."""

    def __init__(self, control: MissionControl) -> None:
        self.viewers: set[Viewer] = set()
        self.feed = Feed(control, self)
        self.fleet = FleetPicture(control, self._lost)
        self._control = control
        self._holders: dict[str, str] = {}
        self._looked_at = 0.0
        self._times: dict[RunId, float] = {}
        self._asked: tuple[RunId, int, set[Place]] = ("", 0, set())
        self._told = msgspec.Raw(b"{}")

    async def run(self) -> None:
        """Go on until cancelled."""
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(self.feed.follow(), name="web: records")
            tasks.create_task(self.fleet.follow(), name="web: telemetry")
            tasks.create_task(self._pace(), name="web: frames")

    async def watch(self, viewer: Viewer, run: RunId | None) -> None:
        """Have a viewer see a run, from a snapshot on.

        Raises:
            M2pemError: there is no such run.
        """
        picture = await self.feed.load(run) if run is not None else None
        viewer.changes = Changes()
        viewer.watch(picture)

    # --- at once --------------------------------------------------------------------------------

    def asked(self, prompt: OpenPrompt) -> None:
        """A prompt opened."""
        self._tell_all(words.asked(prompt, self.place(prompt)))

    def closed(self, closed: PromptClosed) -> None:
        """It was answered or withdrawn."""
        self._tell_all(words.closed(closed))

    def alerted(self, alert: Alert) -> None:
        """The executive warns of something that is in no run's records."""
        self._tell_all(words.fault(f"{alert.run}: {alert.text}" if alert.run else alert.text))

    def failed(self, run: RunId, text: str) -> None:
        """Something went wrong in a run."""
        self._tell_all(words.fault(f"{run}: {text}"))

    def announce(self, text: str) -> None:
        """Tell every page of something that all operators have to know."""
        self._tell_all(words.fault(text))

    def _lost(self, resource: ResourceId) -> None:
        self._tell_all(words.fault(f"{resource} is no longer heard"))

    def _tell_all(self, message: dict[str, Any]) -> None:
        for viewer in self.viewers:
            viewer.tell(message)

    def place(self, prompt: OpenPrompt) -> Place | None:
        """Where a prompt was asked, if that is known yet."""
        picture = self.feed.pictures.get(prompt.run)
        return picture.asked.get(prompt.prompt) if picture is not None else None

    # --- at a pace ------------------------------------------------------------------------------

    async def _pace(self) -> None:
        loop = asyncio.get_running_loop()
        at = loop.time()
        while True:
            # What was late once must not be late for ever, nor be made up for in a rush.
            at = max(at + FRAME_S, loop.time())
            await asyncio.sleep(at - loop.time())
            if self.viewers:
                await self._tick(loop.time())

    async def _tick(self, now: float) -> None:
        self._tell_of_runs()
        await self._look_at_holders(now)
        watched = {id(v.picture): v.picture for v in self.viewers if v.picture is not None}
        for picture in watched.values():
            await self._look_at_time(picture)
        self._hand_out()
        for viewer in self.viewers:
            if viewer.due(now):
                viewer.frame_due = True
                viewer.wake.set()

    def _tell_of_runs(self) -> None:
        for picture in self.feed.pictures.values():
            if picture.dirty_summary:
                picture.dirty_summary = False
                self._tell_all(words.run(picture.counted()))

    async def _look_at_holders(self, now: float) -> None:
        if now - self._looked_at < HOLDERS_EVERY_S:
            return
        self._looked_at = now
        try:
            holders = {str(each): who for each, who in (await self._control.holders()).items()}
        except M2pemError:
            return
        changed = {name for name, who in holders.items() if self._holders.get(name) != who}
        self._holders = holders
        if changed:
            for viewer in self.viewers:
                viewer.changes.holders |= changed

    async def _look_at_time(self, picture: Picture) -> None:
        run = picture.summary.run
        t_s = picture.t_s
        if picture.summary.status in (RunStatus.RUNNING, RunStatus.PAUSED):
            with suppress(M2pemError):
                t_s = await self._control.mission_time_s(run)
        self._times[run] = t_s

    def _hand_out(self) -> None:
        """Give the names of what is new to all who want to know it."""
        for viewer in self.viewers:
            if (picture := viewer.picture) is not None:
                viewer.changes.elements |= picture.dirty
                viewer.changes.commands |= picture.dirty_commands
            viewer.changes.vehicles |= self.fleet.vehicles.dirty
            viewer.changes.payloads |= self.fleet.payloads.dirty
            viewer.changes.teams |= self.fleet.teams.dirty
        for picture in {id(v.picture): v.picture for v in self.viewers if v.picture}.values():
            for behavior in picture.dirty_commands - picture.commands.keys():
                self.fleet.teams.forget(behavior)
            picture.dirty.clear()
            picture.dirty_commands.clear()
        for heard in (self.fleet.vehicles, self.fleet.payloads, self.fleet.teams):
            heard.dirty.clear()

    # --- what is told ---------------------------------------------------------------------------

    def next_messages(self, viewer: Viewer, now: float) -> list[dict[str, Any]]:
        """What to send to a viewer now, in order; it counts as sent."""
        messages = [viewer.numbered(each) for each in viewer.urgent]
        viewer.urgent.clear()
        if viewer.may_send and (viewer.wants_snapshot or viewer.frame_due):
            # Records may have come since the names were handed out: all that is counted is shown.
            self._hand_out()
            told = self._snapshot(viewer) if viewer.wants_snapshot else self._frame(viewer)
            viewer.wants_snapshot = viewer.frame_due = False
            viewer.changes = Changes()
            viewer.told_seq = viewer.picture.seq if viewer.picture else 0
            messages.append(viewer.numbered(told))
            viewer.sent_paced(now)
            if viewer.picture is not None and viewer.log_due(now):
                messages.append(viewer.numbered(self._log(viewer, viewer.picture)))
        return messages

    def _log(self, viewer: Viewer, picture: Picture) -> dict[str, Any]:
        records = [each for each in picture.newest if each.seq > viewer.logged_seq]
        viewer.logged_seq = picture.seq
        return words.log(records)

    def _head(self, kind: str, picture: Picture | None) -> dict[str, Any]:
        if picture is None:
            return {"type": kind, "run": None, "now": now_s(), "t": 0.0, "events": 0}
        run = picture.summary.run
        t_s = max(self._times.get(run, 0.0), picture.t_s)
        return {"type": kind, "run": run, "now": now_s(), "t": t_s, "events": picture.seq}

    def _snapshot(self, viewer: Viewer) -> dict[str, Any]:
        picture = viewer.picture
        elements = picture.elements if picture is not None else {}
        feed = self.feed
        return {
            **self._head("snapshot", picture),
            "status": picture.summary.status if picture is not None else None,
            "speed": self._control.speed(),
            "elements": words.nested(
                (place, picture.encoded(place)) for place in elements if picture is not None
            ),
            "prompts": [words.prompt_of(each, self.place(each)) for each in feed.prompts.values()],
            "runs": [asdict(each.counted()) for each in feed.pictures.values()],
            "vehicles": _encoded(self.fleet.vehicles, self.fleet.vehicles.states),
            "payloads": _encoded(self.fleet.payloads, self.fleet.payloads.states),
            "teams": _encoded(self.fleet.teams, self.fleet.teams.states),
            "holders": self._holders,
            "commands": picture.commands if picture is not None else {},
        }

    def _elements(self, picture: Picture, places: set[Place]) -> msgspec.Raw:
        """Their states as JSON; browsers that keep up are told the same of a run."""
        asked = (picture.summary.run, picture.seq, places)
        if asked != self._asked:
            states = words.nested((place, picture.encoded(place)) for place in places)
            self._asked, self._told = asked, msgspec.Raw(_encode(states))
        return self._told

    def _frame(self, viewer: Viewer) -> dict[str, Any]:
        picture, changes = viewer.picture, viewer.changes
        frame = self._head("frame", picture)
        if picture is not None and changes.elements:
            frame["elements"] = self._elements(picture, changes.elements)
        if picture is not None and changes.commands:
            frame["commands"] = {key: picture.commands.get(key) for key in changes.commands}
        for name, heard, changed in (
            ("vehicles", self.fleet.vehicles, changes.vehicles),
            ("payloads", self.fleet.payloads, changes.payloads),
            ("teams", self.fleet.teams, changes.teams),
        ):
            if changed:
                frame[name] = _encoded(heard, changed)
        if changes.holders:
            frame["holders"] = {key: self._holders.get(key, "") for key in changes.holders}
        return frame


def _encoded(heard: Heard, names: Any) -> Mapping[str, msgspec.Raw]:
    found = ((name, heard.encoded(name)) for name in names)
    return {name: state for name, state in found if state is not None}
