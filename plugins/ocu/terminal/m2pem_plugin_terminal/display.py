"""The screen of the operator control unit: its panes, and how they are kept up to date."""

import time
from collections.abc import Callable, Mapping

from textual import work
from textual.app import App, ComposeResult
from textual.containers import Horizontal, VerticalScroll
from textual.widgets import Static

from m2pem.api import ResourceId
from m2pem.api.control import Alert, MissionControl, OpenPrompt, PromptClosed, RunId, RunStatus
from m2pem.errors import M2pemError
from m2pem_plugin_terminal.board import Board
from m2pem_plugin_terminal.feed import Feed
from m2pem_plugin_terminal.handover import taken
from m2pem_plugin_terminal.header import header
from m2pem_plugin_terminal.log_pane import LogPane
from m2pem_plugin_terminal.notice import NoticeLine
from m2pem_plugin_terminal.questions import Questions
from m2pem_plugin_terminal.stop import StopBar, Trigger
from m2pem_plugin_terminal.story import Line
from m2pem_plugin_terminal.theme import THEME
from m2pem_plugin_terminal.tree import mission_tree
from m2pem_plugin_terminal.vehicles import Vehicles

REFRESH_S = 0.25


class Display(App[None], inherit_bindings=False):
    """Shows one run at a time. `now`: the operator's clock, in seconds."""

    CSS_PATH = "terminal.tcss"
    ENABLE_COMMAND_PALETTE = False
    AUTO_FOCUS = ""  # keys are commands until a field is asked for
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
        self.feed = Feed(control, self, now)
        self.run_shown: RunId = ""
        self.trigger = Trigger(now)
        self._vehicles = Vehicles(control.fleet())
        self._time_s = 0.0
        self._asking_time = False
        self._holders: Mapping[ResourceId, str] = {}
        self._asking_holders = False
        self.own_answers: set[tuple[RunId, str]] = set()
        # Held, not looked up: while the screen is being taken down they can no longer be found.
        self._header = Static(id="header")
        self._tree = Static(id="tree")
        self._mission = VerticalScroll(self._tree, id="mission", can_focus=False)
        self._fleet = Static(id="fleet")
        self._around = VerticalScroll(self._fleet, id="vehicles", can_focus=False)
        self._notice = NoticeLine(now)
        self.questions = Questions(now)
        self.log_pane = LogPane()

    # --- life -----------------------------------------------------------------------------------

    def compose(self) -> ComposeResult:
        """From top to bottom."""
        yield self._header
        yield Horizontal(self._mission, self._around, id="middle")
        yield self.questions
        yield self.log_pane
        yield self._notice
        yield StopBar()

    def on_mount(self) -> None:
        """Begin to follow."""
        self.register_theme(THEME)
        self.theme = THEME.name
        self._mission.border_title = "Mission"
        self._around.border_title = "Vehicles"
        self.run_worker(self._follow())
        self.run_worker(self._hear())
        self.set_interval(REFRESH_S, self.show)

    async def _follow(self) -> None:
        try:
            await self.feed.follow()
            self.say("The executive has ended.", alarm=True)
        except M2pemError as error:
            self.say(f"The executive cannot be followed any more: {error}", alarm=True)

    async def _hear(self) -> None:
        try:
            async for state in self.control.telemetry():
                self._vehicles.hear(state, self.now())
        except M2pemError as error:
            self.say(f"No telemetry any more: {error}", alarm=True)

    # --- what is shown --------------------------------------------------------------------------

    @property
    def board(self) -> Board | None:
        """The run that is shown."""
        return self.feed.boards.get(self.run_shown)

    def show(self) -> None:
        """Bring everything up to date."""
        board, now = self.board, self.now()
        if board is not None and not board.status.ended and not self._asking_time:
            self._asking_time = True
            self.run_worker(self._ask_time(board), exit_on_error=False)
        time_s = (
            self._time_s if board and not board.status.ended else board.time_s if board else 0.0
        )
        if not self._asking_holders:
            self._asking_holders = True
            self._ask_holders()
        active = [b for b in self.feed.boards.values() if not b.status.ended]
        others = sum(1 for each in active if each is not board)
        self._header.update(header(board, others, time_s, self.size.width))
        if board is not None:
            width = self._mission.scrollable_content_region.width
            self._tree.update(mission_tree(board, now, time_s, width))
        width = self._around.scrollable_content_region.width
        self._fleet.update(
            self._vehicles.table(now, width, self._behavior_name, taken(self._holders))
        )
        self.questions.show(self.feed.prompts, self._label, self.run_shown)
        self._notice.show()
        paused = board is not None and board.status is RunStatus.PAUSED
        for each in self.screen_stack:
            for bar in each.query(StopBar):
                bar.show(self.trigger, paused)

    async def _ask_time(self, board: Board) -> None:
        try:
            self._time_s = await self.control.mission_time_s(board.run)
        except M2pemError:
            self._time_s = board.time_s
        finally:
            self._asking_time = False

    @work(exit_on_error=False)
    async def _ask_holders(self) -> None:
        # Not folded from records: what is taken or given back while no run is active leaves none.
        try:
            self._holders = await self.control.holders()
        except M2pemError:
            self._holders = {}
        finally:
            self._asking_holders = False

    def _behavior_name(self, behavior: str) -> str:
        names = (board.behavior_name(behavior) for board in self.feed.boards.values())
        return next((name for name in names if name), behavior)

    def _label(self, prompt: OpenPrompt) -> str:
        board = self.feed.boards.get(prompt.run)
        return board.label(prompt.element) if board is not None else prompt.element

    def look_at(self, run: RunId) -> None:
        """Show another run."""
        self.run_shown = run
        board = self.feed.boards[run]
        self._time_s = board.time_s
        self.log_pane.show(self.feed.logs[run])
        self.show()

    def say(self, text: str, *, alarm: bool = False) -> None:
        """Tell the operator something, for some seconds."""
        self._notice.say(text, alarm=alarm)

    # --- what the feed tells --------------------------------------------------------------------

    def logged(self, run: RunId, line: Line) -> None:
        """One more line."""
        if run == self.run_shown:
            self.log_pane.add(line)

    def alerted(self, alert: Alert) -> None:
        """Show it as an alarm."""
        self.say(f"{alert.run}: {alert.text}" if alert.run else alert.text, alarm=True)

    def asked(self, prompt: OpenPrompt) -> None:
        """Show it at once."""
        self.show()

    def answered(self, prompt: OpenPrompt, closed: PromptClosed) -> None:
        """Tell who answered, unless it was this operator here."""
        key = (prompt.run, prompt.prompt)
        if key in self.own_answers:
            self.own_answers.discard(key)
        elif closed.by or closed.decision:
            label = {d.value: d.label for d in prompt.decisions}.get(closed.decision)
            who = closed.by or "Somebody"
            self.say(f"{who} answered {self._label(prompt)}: {label or closed.decision}")
        elif not self.feed.boards[prompt.run].status.ended:
            self.say(f"{self._label(prompt)} is no longer asked")
        self.show()

    def began(self, run: RunId) -> None:
        """Look at a new run, unless one that still runs is looked at."""
        board = self.board
        if board is None or board.status.ended:
            self.look_at(run)
        elif not self.feed.boards[run].status.ended:
            self.say(f"{run} has begun; press r to look at it")

    def ended(self, run: RunId) -> None:
        """Tell how it ended."""
        board = self.feed.boards[run]
        detail = f": {board.outcome_detail}" if board.outcome_detail else ""
        bad = board.status in (RunStatus.FAILED, RunStatus.STOPPED)
        self.say(f"{run} {board.status.value}{detail}", alarm=bad)
