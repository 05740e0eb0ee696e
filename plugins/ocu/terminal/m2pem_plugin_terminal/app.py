"""The screen of the operator control unit, and what its keys do."""

import time
from collections.abc import Awaitable, Callable
from typing import Any, ClassVar

from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, VerticalScroll
from textual.widgets import RichLog, Static

from m2pem.api.control import MissionControl, OpenPrompt, PromptClosed, RunId, RunStatus
from m2pem.api.operator import operator_name
from m2pem.errors import M2pemError
from m2pem_plugin_terminal.board import Board
from m2pem_plugin_terminal.dialogs import Choice, Choose, Read, help_text
from m2pem_plugin_terminal.feed import Feed
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


class TerminalApp(App[None], inherit_bindings=False):
    """Shows one run at a time. `now`: the operator's clock; `by`: the name that is journaled."""

    CSS_PATH = "terminal.tcss"
    ENABLE_COMMAND_PALETTE = False
    AUTO_FOCUS = ""  # keys are commands until a field is asked for
    TITLE = "m2pem"
    BINDINGS: ClassVar[list[BindingType]] = [
        # Before any dialog or text field gets to see them:
        Binding("ctrl+x", "stop", priority=True),
        Binding("ctrl+c", "interrupt", priority=True),
        Binding("escape", "disarm", priority=True),
        *(Binding(str(number), f"answer({number})") for number in range(1, 10)),
        Binding("tab", "next_question", priority=True),
        Binding("p", "pause"),
        Binding("s", "signals"),
        Binding("r", "runs"),
        Binding("slash", "filter"),
        Binding("question_mark", "help"),
        Binding("q", "leave"),
        Binding("up", "scroll('#mission', -1)"),
        Binding("down", "scroll('#mission', 1)"),
        Binding("pageup", "scroll('RichLog', -4)"),
        Binding("pagedown", "scroll('RichLog', 4)"),
        Binding("shift+up", "scroll('#question-text', -1)"),
        Binding("shift+down", "scroll('#question-text', 1)"),
    ]

    def __init__(
        self,
        control: MissionControl,
        *,
        now: Callable[[], float] = time.monotonic,
        by: str | None = None,
    ) -> None:
        super().__init__()
        self.control = control
        self.now = now
        self.by = operator_name() if by is None else by
        self.feed = Feed(control, self, now)
        self.run_shown: RunId = ""
        self.trigger = Trigger(now)
        self._vehicles = Vehicles(control.fleet())
        self._time_s = 0.0
        self._asking_time = False
        self._answers: set[tuple[RunId, str]] = set()

    # --- life -----------------------------------------------------------------------------------

    def compose(self) -> ComposeResult:
        """From top to bottom."""
        yield Static(id="header")
        with Horizontal(id="middle"):
            with VerticalScroll(id="mission", can_focus=False):
                yield Static(id="tree")
            with VerticalScroll(id="vehicles", can_focus=False):
                yield Static(id="fleet")
        yield Questions(self.now)
        yield LogPane()
        yield NoticeLine(self.now)
        yield StopBar()

    def on_mount(self) -> None:
        """Begin to follow."""
        self.register_theme(THEME)
        self.theme = THEME.name
        self.query_one("#mission").border_title = "Mission"
        self.query_one("#vehicles").border_title = "Vehicles"
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
        screen = self.screen_stack[0]
        board, now = self.board, self.now()
        if board is not None and not board.status.ended and not self._asking_time:
            self._asking_time = True
            self.run_worker(self._ask_time(board), exit_on_error=False)
        time_s = (
            self._time_s if board and not board.status.ended else board.time_s if board else 0.0
        )
        active = [b for b in self.feed.boards.values() if not b.status.ended]
        others = sum(1 for each in active if each is not board)
        top = screen.query_one("#header", Static)
        top.update(header(board, others, time_s, screen.size.width))
        if board is not None:
            tree = screen.query_one("#tree", Static)
            width = screen.query_one("#mission").scrollable_content_region.width
            tree.update(mission_tree(board, now, time_s, width))
        width = screen.query_one("#vehicles").scrollable_content_region.width
        screen.query_one("#fleet", Static).update(
            self._vehicles.table(now, width, self._behavior_name)
        )
        screen.query_one(Questions).show(self.feed.prompts, self._label, self.run_shown)
        screen.query_one(NoticeLine).show()
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
        self._log_pane.show(self.feed.logs[run])
        self.show()

    def say(self, text: str, *, alarm: bool = False) -> None:
        """Tell the operator something, for some seconds."""
        if self.is_running:
            self.screen_stack[0].query_one(NoticeLine).say(text, alarm=alarm)

    @property
    def _log_pane(self) -> LogPane:
        return self.screen_stack[0].query_one(LogPane)

    @property
    def _questions(self) -> Questions:
        return self.screen_stack[0].query_one(Questions)

    # --- what the feed tells --------------------------------------------------------------------

    def logged(self, run: RunId, line: Line) -> None:
        """One more line."""
        if run == self.run_shown:
            self._log_pane.add(line)

    def answered(self, prompt: OpenPrompt, closed: PromptClosed) -> None:
        """Tell who answered, unless it was this operator here."""
        key = (prompt.run, prompt.prompt)
        if key in self._answers:
            self._answers.discard(key)
        elif closed.by or closed.decision:
            label = {d.value: d.label for d in prompt.decisions}.get(closed.decision)
            who = closed.by or "Somebody"
            self.say(f"{who} answered {self._label(prompt)}: {label or closed.decision}")
        elif not self.feed.boards[prompt.run].status.ended:
            self.say(f"{self._label(prompt)} is no longer asked")

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

    # --- what keys do ---------------------------------------------------------------------------

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Escape and Tab are left to dialogs and fields unless they are needed here."""
        if action == "disarm":
            return self.trigger.armed or (not self._in_dialog and self._log_pane.filtering)
        if action == "next_question":
            return not self._in_dialog
        return True

    @property
    def _in_dialog(self) -> bool:
        return len(self.screen_stack) > 1

    def _carry_out(self, what: str, call: Awaitable[Any]) -> None:
        """Ask the executive without waiting; what it refuses is told."""

        async def asked() -> None:
            try:
                await call
            except M2pemError as error:
                self.say(f"{what}: {error}", alarm=True)

        self.run_worker(asked(), exit_on_error=False)

    def _active_board(self) -> Board | None:
        board = self.board
        if board is None or board.status.ended:
            self.say("No mission is running here")
            return None
        return board

    def action_stop(self) -> None:
        """STOP, at the second press."""
        board = self._active_board()
        if board is not None and self.trigger.press(f"STOP {board.run}"):
            self.say(f"Stopping {board.run} ...", alarm=True)
            reason = f"by {self.by}"
            self._carry_out("Stop", self.control.stop(board.run, by=self.by, reason=reason))
        self.show()

    def action_interrupt(self) -> None:
        """Ctrl-C: STOP; when nothing runs, leave."""
        board = self.board
        if board is not None and not board.status.ended:
            self.action_stop()
        elif self.trigger.press("Quit"):
            self.exit()
        self.show()

    def action_disarm(self) -> None:
        """Not STOP after all; or the whole log again."""
        if self.trigger.armed:
            self.trigger.disarm()
        else:
            self._log_pane.clear_filter()
        self.show()

    def action_answer(self, number: int) -> None:
        """Answer the question that is shown."""
        prompt, decision = self._questions.current, self._questions.decide(number)
        if prompt is None or decision is None:
            return
        if not self._questions.settled:
            self.say("Not taken: the question has only just appeared. Read it, then press again")
            return
        self._answers.add((prompt.run, prompt.prompt))

        async def answer() -> None:
            try:
                await self.control.answer(prompt.run, prompt.prompt, decision, by=self.by)
            except M2pemError:
                self._answers.discard((prompt.run, prompt.prompt))
                raise

        self._carry_out("Not taken", answer())

    def action_next_question(self) -> None:
        """Tab."""
        self._questions.turn()
        self.show()

    def action_pause(self) -> None:
        """Pause, or go on."""
        board = self._active_board()
        if board is None:
            return
        if board.status is RunStatus.PAUSED:
            self._carry_out("Go on", self.control.resume(board.run, by=self.by))
        else:
            self._carry_out("Pause", self.control.pause(board.run, by=self.by))

    async def action_signals(self) -> None:
        """Choose a signal by its name; those that are awaited come first."""
        board = self._active_board()
        if board is None:
            return
        signals = sorted(board.signals().items(), key=lambda item: not item[1][1])
        if not signals:
            self.say("This mission has no signals")
            return
        choices = [
            Choice(signal, name, "awaited" if awaited else "")
            for signal, (name, awaited) in signals
        ]

        def send(signal: str | None) -> None:
            if signal is not None:
                self._carry_out("Signal", self.control.signal(signal, run=board.run, by=self.by))

        await self.push_screen(Choose("Send a signal", choices), send)
        self.show()

    async def action_runs(self) -> None:
        """Choose the run to look at."""
        try:
            runs = await self.control.runs()
        except M2pemError as error:
            self.say(str(error), alarm=True)
            return
        choices = [Choice(each.run, f"{each.run}  {each.mission}", each.status) for each in runs]
        choices.reverse()

        def look(run: str | None) -> None:
            if run is not None:
                self.run_worker(self._load_and_look(run), exit_on_error=False)

        await self.push_screen(Choose("Look at a run", choices), look)
        self.show()

    async def _load_and_look(self, run: RunId) -> None:
        try:
            await self.feed.load(run)
        except M2pemError as error:
            self.say(str(error), alarm=True)
        else:
            self.look_at(run)

    def action_filter(self) -> None:
        """Type what log lines must have in them."""
        self._log_pane.ask_filter()

    async def action_help(self) -> None:
        """All keys."""
        await self.push_screen(Read("Keys", help_text()))
        self.show()

    async def action_leave(self) -> None:
        """Leave; what becomes of a mission that runs is asked."""
        board = self.board
        if board is None or board.status.ended:
            self.exit()
            return

        def done(choice: str | None) -> None:
            if choice == "leave":
                self.exit()

        choices = [Choice("leave", "Quit, and let the mission go on"), Choice("stay", "Stay")]
        text = f"{board.run} is running. To stop it, press ^X twice."
        await self.push_screen(Choose("Quit", choices, text), done)
        self.show()

    def action_scroll(self, what: str, lines: int) -> None:
        """Move through what does not fit."""
        found = self.screen_stack[0].query_one(what)
        if isinstance(found, (VerticalScroll, RichLog)):
            found.scroll_relative(y=lines, animate=False)
