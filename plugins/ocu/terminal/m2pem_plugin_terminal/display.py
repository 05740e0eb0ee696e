"""The screen of the operator control unit: its panes, which follow the executive."""

import asyncio
import os
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress

from textual import work
from textual.app import App, ComposeResult
from textual.containers import Horizontal, VerticalScroll
from textual.filter import LineFilter
from textual.theme import Theme
from textual.widgets import Static

from m2pem.api import (
    Alert,
    ExecutiveAddress,
    Importance,
    Listener,
    MissionControl,
    OpenPrompt,
    OperatorAlert,
    PromptClosed,
    ResourceId,
    RunId,
    RunStatus,
    RunView,
    StampedRecord,
    follow,
)
from m2pem.api.run_view import Behavior, FinishedToken
from m2pem.api.runs import LOGGED
from m2pem.errors import M2pemError
from m2pem_plugin_terminal.alerts import Bell, hint, time_left
from m2pem_plugin_terminal.ascii_only import AsciiFilter, ascii_only
from m2pem_plugin_terminal.formatting import clock_time
from m2pem_plugin_terminal.handover import taken
from m2pem_plugin_terminal.log_pane import Line, LogPane, line_of
from m2pem_plugin_terminal.map_pane import MapPane
from m2pem_plugin_terminal.mission_pane import FADES_FOR_S, Done, mission_tree, shown_when_done
from m2pem_plugin_terminal.prompt_pane import PromptPane
from m2pem_plugin_terminal.runs import run_tabs
from m2pem_plugin_terminal.status_lines import DoublePress, NoticeLine, StopBar, header
from m2pem_plugin_terminal.vehicles_pane import Vehicles

REFRESH_S = 0.25

VEHICLES_AT_ONCE = 25
"""With that many vehicles, the table is updated at every second tick; with twice as many, at every
third."""

STANDBYS_EVERY_S = 2.0
"""Between two questions to the executive, who stands by."""

WIDE_CELLS = 120
"""A wider terminal shows the map beside the mission; on others it takes the place of the panes."""
NARROW_CELLS = 66
"""A narrower terminal shows the vehicles below the mission."""

LOG_LINES = 2000

DONE_TOKENS = 20

BELL = "M2PEM_BELL"
"""0: the bell is off at first."""

ALONE = "No executive stands by any more"

THEME = Theme(
    name="m2pem",
    primary="#8ab4d8",
    secondary="#7fc8a9",
    accent="#e8c468",
    warning="#e8c468",
    error="#e07a6a",
    success="#7fc8a9",
    foreground="#c8d0d9",
    background="#1b2129",
    surface="#222a33",
    panel="#2a333e",
    dark=True,
)
"""Slate; green: work, amber: waits for the operator, red: STOP."""


class RunLog:
    """The log of a run, and its tokens that have finished lately."""

    def __init__(self) -> None:
        self.lines: deque[Line] = deque(maxlen=LOG_LINES)
        self.done: deque[Done] = deque(maxlen=DONE_TOKENS)
        self._seq = 0
        self._last_finished: FinishedToken | None = None

    def add(self, view: RunView, stamped: StampedRecord, at: float) -> Line | None:
        """Add a record that the view has applied; return its line, if it has one and is new."""
        if stamped.seq <= self._seq:
            return None
        self._seq = stamped.seq
        last = view.finished[-1] if view.finished else None
        if last is not None and last is not self._last_finished:
            self._last_finished = last
            if shown_when_done(view, last):
                self.done.append(Done(last, at))
        line = line_of(view, stamped)
        if line is not None:
            self.lines.append(line)
        return line


class Display(App[None], Listener, inherit_bindings=False):
    """Shows one run at a time. `now`: the operator's clock, in seconds."""

    CSS_PATH = "terminal.tcss"
    ENABLE_COMMAND_PALETTE = False
    AUTO_FOCUS = ""  # keys are commands until the operator opens a field
    TITLE = "m2pem"

    def __init__(
        self,
        control: MissionControl,
        *,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        super().__init__()
        self.control = control
        self.now = now
        self.follower = follow(control, self)
        self.logs: dict[RunId, RunLog] = {}
        self.run_shown: RunId = ""
        self.stop_press = DoublePress(now)
        self._vehicles = Vehicles(control.fleet(), control.speed())
        self._ticks = 0
        self._time_s = 0.0
        self._asking_time = False
        self._holders: Mapping[ResourceId, str] = {}
        self._asking_holders = False
        self._standbys: Sequence[ExecutiveAddress] = ()
        self.own_answers: set[tuple[RunId, str]] = set()
        # Stored, not queried: Textual cannot find them while it closes the screen.
        self._header = Static(id="header")
        self._tabs = Static(id="runs")
        self._tree = Static(id="tree")
        self._mission = VerticalScroll(self._tree, id="mission", can_focus=False)
        self._fleet = Static(id="fleet")
        self._around = VerticalScroll(self._fleet, id="vehicles", can_focus=False)
        self._ascii = [AsciiFilter()] if ascii_only() else []
        self.map_pane = MapPane(control.fleet(), ascii=bool(self._ascii))
        self.map_active = False
        self.alerts: Sequence[OperatorAlert] = ()
        self._alerts_read_s: float | None = None
        self.alarm_bell = Bell(on=os.environ.get(BELL, "1") != "0")
        self._notice = NoticeLine(now, lambda: hint(self.alerts))
        self.prompt_pane = PromptPane(now)
        self.log_pane = LogPane()

    # --- life -----------------------------------------------------------------------------------

    def compose(self) -> ComposeResult:
        """Compose the panes from top to bottom."""
        yield self._header
        yield self._tabs
        yield Horizontal(self._mission, self.map_pane, self._around, id="middle")
        yield self.prompt_pane
        yield self.log_pane
        yield self._notice
        yield StopBar()

    def on_mount(self) -> None:
        """Begin to follow the executive."""
        self.register_theme(THEME)
        self.theme = THEME.name
        self._mission.border_title = "Mission"
        self._around.border_title = "Vehicles"
        self._arrange()
        with suppress(M2pemError):  # an executive in another process does not list them
            for name, each in self.control.geometries().items():
                self.map_pane.scene.hand_over(name, each.geometry)
        self.run_worker(self._follow())
        self.run_worker(self._follow_telemetry())
        self.run_worker(self._follow_standbys())
        self.alerts_changed()
        self.set_interval(REFRESH_S, self.show)

    def get_line_filters(self) -> Sequence[LineFilter]:
        """Write in ASCII where the terminal shows nothing else."""
        return [*super().get_line_filters(), *self._ascii]

    def on_resize(self) -> None:
        """Arrange the panes for the new width."""
        self._arrange()

    def activate_map(self, active: bool) -> None:
        """Let the arrow keys move the map; on a terminal that is not wide, show it."""
        self.map_active = active
        self.map_pane.set_active(active)
        self._arrange()
        self.call_after_refresh(self.show)

    def _arrange(self) -> None:
        wide = self.size.width >= WIDE_CELLS
        alone = self.map_active and not wide
        self.map_pane.display = wide or alone
        for pane in (self._mission, self._around, self.log_pane):
            pane.display = not alone
        self.screen_stack[0].set_class(self.size.width < NARROW_CELLS, "narrow")

    async def _follow(self) -> None:
        try:
            await self.follower.run()
            self._vehicles.end()
            self.say("The executive has ended. q quits", alarm=True)
        except M2pemError as error:
            self.say(f"The connection to the executive has failed: {error}", alarm=True)

    async def _follow_telemetry(self) -> None:
        try:
            async for state in self.control.telemetry():
                self._vehicles.update(state, self.now())
                self.map_pane.update_state(state)
        except M2pemError as error:
            self.say(f"The telemetry has failed: {error}", alarm=True)

    async def _follow_standbys(self) -> None:
        while True:
            with suppress(M2pemError, OSError):  # the last answer stays
                found = await self.control.standbys()
                if self._standbys and not found:
                    self.say(ALONE, alarm=True)
                self._standbys = found
            await asyncio.sleep(STANDBYS_EVERY_S)

    # --- panes ----------------------------------------------------------------------------------

    @property
    def view(self) -> RunView | None:
        """The run that is shown."""
        return self.follower.views.get(self.run_shown)

    def show(self) -> None:
        """Update every pane."""
        view, now = self.view, self.now()
        if view is not None and not view.status.ended and not self._asking_time:
            self._asking_time = True
            self.run_worker(self._ask_time(view), exit_on_error=False)
        time_s = self._time_s if view and not view.status.ended else view.t_s if view else 0.0
        if not self._asking_holders:
            self._asking_holders = True
            self._ask_holders()
        active = [b for b in self.follower.views.values() if not b.status.ended]
        others = sum(1 for each in active if each is not view)
        self._tabs.display = others > 0
        if others:
            asking = {run for run, _ in self.follower.prompts}
            self._tabs.update(run_tabs(active, self.run_shown, asking))
        hosts = list(dict.fromkeys(each.host for each in self._standbys))
        self._header.update(header(view, others, time_s, self.size.width, hosts))
        if view is not None:
            width = self._mission.scrollable_content_region.width
            self._tree.update(mission_tree(view, self.logs[view.run].done, now, time_s, width))
        self._show_vehicles(now)
        if self.map_pane.display:
            self.map_pane.draw(self._vehicles.silent())
        self.prompt_pane.show(self.follower.prompts, self._label, self.run_shown, self._time_left)
        self._ring()
        self._notice.show()
        paused = view is not None and view.status is RunStatus.PAUSED
        for each in self.screen_stack:
            for bar in each.query(StopBar):
                bar.show(self.stop_press, paused)

    def _show_vehicles(self, now: float) -> None:
        """Update the table; a long one less often, as all of it is laid out anew."""
        self._ticks += 1
        every = 1 + len(self.control.fleet().vehicles) // VEHICLES_AT_ONCE
        if self._around.display and self._ticks % every == 0:
            width = self._around.scrollable_content_region.width
            holders = taken(self._holders)
            self._fleet.update(self._vehicles.table(now, width, self._behavior_name, holders))

    def clock_us(self) -> int:
        """Microseconds since the Unix epoch by the executive's clock, as far as it is known here:
        runs that go on say it, and without one it is taken for that of this computer."""
        view = self.view
        if view is not None and view.status is RunStatus.RUNNING:
            return view.at_us(self._time_s)
        return time.time_ns() // 1000

    async def _ask_time(self, view: RunView) -> None:
        try:
            self._time_s = await self.control.mission_time_s(view.run)
        except M2pemError:
            self._time_s = view.t_s
        finally:
            self._asking_time = False

    @work(exit_on_error=False)
    async def _ask_holders(self) -> None:
        # Not derived from records: without an active run, acquiring control writes none.
        try:
            self._holders = await self.control.holders()
        except M2pemError:
            self._holders = {}
        finally:
            self._asking_holders = False

    def _behavior_name(self, behavior: str) -> str:
        found = self._behavior(behavior)
        return found.name if found is not None else behavior

    def _behavior(self, id_: str) -> Behavior | None:
        """Return a behavior of any run that has not ended."""
        run = id_.rpartition(".")[0]
        view = self.follower.views.get(run)
        return view.behaviors.get(id_) if view is not None else None

    def _time_left(self, prompt: OpenPrompt) -> str:
        # The executive says what is left: its clock may be another one than that of this computer.
        since_s = self.now() - (self._alerts_read_s or 0.0)
        passed_s = since_s * self.control.speed()
        return time_left(self.alerts, prompt.run, prompt.prompt, passed_s)

    def _label(self, prompt: OpenPrompt) -> str:
        view = self.follower.views.get(prompt.run)
        return view.label(prompt.element) if view is not None else prompt.element

    def look_at(self, run: RunId) -> None:
        """Show this run."""
        self.run_shown = run
        view = self.follower.views[run]
        self._time_s = view.t_s
        self.log_pane.show(self.logs[run].lines)
        self.show()

    def say(self, text: str, *, alarm: bool = False) -> None:
        """Show a text to the operator for some seconds."""
        self._notice.say(text, alarm=alarm)

    # --- events ---------------------------------------------------------------------------------

    def run_added(self, view: RunView) -> None:
        """Show a new run, unless one that has not ended is shown."""
        self._run_log(view.run)
        shown = self.view
        if shown is None or shown.status.ended:
            self.look_at(view.run)
        elif not view.status.ended:
            self.say(f"{view.run} has begun; press ] to show it")

    def recorded(self, view: RunView, stamped: StampedRecord, *, is_new: bool) -> None:
        """Log a record, and keep what it says of places."""
        self.map_pane.scene.record(view.run, stamped.record)
        at = self.now() if is_new else self.now() - FADES_FOR_S
        line = self._run_log(view.run).add(view, stamped, at)
        if line is not None and is_new and view.run == self.run_shown:
            self.log_pane.add(line)

    def _run_log(self, run: RunId) -> RunLog:
        return self.logs.setdefault(run, RunLog())

    def status_changed(self, view: RunView) -> None:
        """Show how a run ended."""
        if view.status.ended:
            detail = f": {view.summary.detail}" if view.summary.detail else ""
            bad = view.status in (RunStatus.FAILED, RunStatus.STOPPED)
            self.say(f"{view.run} {view.status.value}{detail}", alarm=bad)

    def prompt_opened(self, prompt: OpenPrompt) -> None:
        """Show the prompt at once."""
        self.show()

    def prompt_closed(self, prompt: OpenPrompt, closed: PromptClosed) -> None:
        """Show who answered, unless it was this operator."""
        key = (prompt.run, prompt.prompt)
        if key in self.own_answers:
            self.own_answers.discard(key)
        elif closed.by or closed.decision:
            label = {d.value: d.label for d in prompt.decisions}.get(closed.decision)
            who = closed.by or "Another operator"
            self.say(f"{who} answered {self._label(prompt)}: {label or closed.decision}")
        elif not self.follower.views[prompt.run].status.ended:
            self.say(f"{self._label(prompt)} was withdrawn")
        self.show()

    def alerts_changed(self) -> None:
        """Read the executive's list of alerts; ring the bell for what is new."""
        self.run_worker(self._read_alerts(), exit_on_error=False)

    async def _read_alerts(self) -> None:
        with suppress(M2pemError):  # the last answer stays
            self.alerts = await self.control.alerts()
            self._alerts_read_s = self.now()
            self._ring()

    def _ring(self) -> None:
        if self._alerts_read_s is not None and self.alarm_bell.rings(self.alerts, self.now()):
            self.bell()

    def alerted(self, alert: Alert) -> None:
        """Show an alert as an alarm, unless the log shows it. The log of its run has it whole, and
        the executive's list keeps it."""
        text = f"{alert.run}: {alert.text}" if alert.run else alert.text
        if alert.code == LOGGED:
            return
        self.say(text, alarm=True)
        if (view := self.follower.views.get(alert.run)) is not None:
            line = Line(clock_time(view.t_s), alert.text, Importance.WARNING)
            self._run_log(alert.run).lines.append(line)
            if alert.run == self.run_shown:
                self.log_pane.add(line)
