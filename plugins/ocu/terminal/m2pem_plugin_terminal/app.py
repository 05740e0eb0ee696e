"""The keys of the operator control unit, and what they do."""

from typing import ClassVar

from textual import events
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll

from m2pem.api import RunView
from m2pem.api.runs import RunStatus
from m2pem.errors import M2pemError
from m2pem_plugin_terminal.alerting import Alerting
from m2pem_plugin_terminal.dialogs import Choice, Choose, Read, help_text
from m2pem_plugin_terminal.direct_commands import DirectCommands
from m2pem_plugin_terminal.people import People
from m2pem_plugin_terminal.requirements import TITLE as TITLE_REQUIREMENTS
from m2pem_plugin_terminal.requirements import requirements_text
from m2pem_plugin_terminal.shared_space import TITLE as TITLE_SPACE
from m2pem_plugin_terminal.shared_space import space_text
from m2pem_plugin_terminal.starting import Starting
from m2pem_plugin_terminal.status_lines import STOP_ALL


class TerminalApp(Starting, Alerting, People, DirectCommands):
    """The display with its keys."""

    BINDINGS: ClassVar[list[BindingType]] = [
        # These keys work in dialogs and text fields, too:
        Binding("ctrl+x", "stop", priority=True),
        Binding("ctrl+a", "stop_all", priority=True),
        Binding("ctrl+c", "interrupt", priority=True),
        Binding("escape", "disarm", priority=True),
        *(Binding(str(number), f"answer({number})") for number in range(1, 10)),
        Binding("tab", "next_prompt", priority=True),
        Binding("p", "pause"),
        Binding("s", "signals"),
        Binding("t", "take"),
        Binding("d", "command"),
        Binding("m", "missions"),
        Binding("i", "incidents"),
        Binding("o", "operators"),
        Binding("n", "note"),
        Binding("r", "runs"),
        Binding("right_square_bracket", "next_run(1)"),
        Binding("left_square_bracket", "next_run(-1)"),
        Binding("c", "schedule"),
        Binding("f", "space"),
        Binding("v", "requirements"),
        Binding("a", "alerts"),
        Binding("b", "toggle_bell"),
        Binding("slash", "filter"),
        Binding("question_mark", "help"),
        Binding("q", "leave"),
        Binding("g", "map"),
        Binding("up", "arrow(0, -1)"),
        Binding("down", "arrow(0, 1)"),
        Binding("left", "arrow(-1, 0)"),
        Binding("right", "arrow(1, 0)"),
        Binding("plus,equals_sign", "zoom(True)"),
        Binding("minus", "zoom(False)"),
        Binding("0", "fit"),
        Binding("full_stop", "follow_next(1)"),
        Binding("comma", "follow_next(-1)"),
        Binding("pageup", "scroll_log(-4)"),
        Binding("pagedown", "scroll_log(4)"),
        Binding("shift+up", "scroll('#question-text', -1)"),
        Binding("shift+down", "scroll('#question-text', 1)"),
    ]

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Leave Escape and Tab to dialogs and fields unless the display needs them."""
        if action == "disarm":
            needed = self.log_pane.filtering or self.map_active
            return self.stop_press.armed or (not self.in_dialog and needed)
        if action == "next_prompt":
            return not self.in_dialog
        return True

    def _active_run(self) -> RunView | None:
        view = self.view
        if view is None or view.status.ended:
            self.say("No mission is running here")
            return None
        return view

    def action_stop(self) -> None:
        """Stop the run at the second press."""
        view = self._active_run()
        if view is not None and self.stop_press.press(f"STOP {view.run}"):
            self.say(f"Stopping {view.run} ...", alarm=True)
            while self.in_dialog:
                self.pop_screen()
            self.carry_out("Stop", self.control.stop(view.run, by=self.by))
        self.show()

    def action_stop_all(self) -> None:
        """Stop every run at the second press."""
        if self.stop_press.press(STOP_ALL):
            self.say("Stopping all runs ...", alarm=True)
            while self.in_dialog:
                self.pop_screen()
            self.carry_out(STOP_ALL, self.control.stop_all(by=self.by))
        self.show()

    def action_interrupt(self) -> None:
        """Ctrl-C: stop the run; when no run is active, quit."""
        view = self.view
        if view is not None and not view.status.ended:
            self.action_stop()
        elif self.stop_press.press("Quit"):
            self.exit()
        self.show()

    def action_disarm(self) -> None:
        """Escape: cancel the first press of STOP, show the whole log, or leave the map."""
        if self.stop_press.armed:
            self.stop_press.disarm()
        elif self.log_pane.filtering:
            self.log_pane.clear_filter()
        else:
            self.activate_map(False)
        self.show()

    def action_answer(self, number: int) -> None:
        """Answer the prompt that is shown."""
        prompt, decision = self.prompt_pane.current, self.prompt_pane.decision_on(number)
        if prompt is None or decision is None:
            return
        if not self.prompt_pane.settled:
            self.say("Not taken: the question has only just appeared. Read it, then press again")
            return
        self.own_answers.add((prompt.run, prompt.prompt))

        async def answer() -> None:
            try:
                await self.control.answer(prompt.run, prompt.prompt, decision, by=self.by)
            except M2pemError:
                self.own_answers.discard((prompt.run, prompt.prompt))
                raise

        self.carry_out("Not taken", answer())

    def action_next_prompt(self) -> None:
        """Tab: show the next prompt."""
        self.prompt_pane.show_next()
        self.show()

    def action_pause(self) -> None:
        """Pause the run, or resume it."""
        view = self._active_run()
        if view is None:
            return
        if view.status is RunStatus.PAUSED:
            self.carry_out("Go on", self.control.resume(view.run, by=self.by))
        else:
            self.carry_out("Pause", self.control.pause(view.run, by=self.by))

    async def action_signals(self) -> None:
        """Choose a signal to send by its name; awaited signals come first."""
        view = self._active_run()
        if view is None:
            return
        signals = sorted(view.signals().items(), key=lambda item: not item[1][1])
        if not signals:
            self.say("This mission has no signals")
            return
        choices = [
            Choice(signal, name, "awaited" if awaited else "")
            for signal, (name, awaited) in signals
        ]

        def send(signal: str | None) -> None:
            if signal is not None:
                self.carry_out("Signal", self.control.signal(signal, run=view.run, by=self.by))

        await self.push_screen(Choose("Send a signal", choices), send)
        self.show()

    async def action_space(self) -> None:
        """Show who is in shared space, and which tasks wait for what."""
        try:
            spaces, waiting = await self.control.shared_space(), await self.control.waiting()
        except M2pemError as error:
            self.say(str(error), alarm=True)
            return
        await self.push_screen(Read(TITLE_SPACE, space_text(spaces, waiting)))
        self.show()

    async def action_requirements(self) -> None:
        """Show what the run is monitored for, and what is certain of it."""
        view = self.view
        if view is None:
            self.say("No mission is running here")
            return
        shown = requirements_text(view.run, view.requirements.values())
        await self.push_screen(Read(TITLE_REQUIREMENTS, shown))
        self.show()

    def action_filter(self) -> None:
        """Let the operator type a text; only log lines with it are shown."""
        self.log_pane.ask_filter()

    async def action_help(self) -> None:
        """Show all keys."""
        await self.push_screen(Read("Keys", help_text()))
        self.show()

    async def action_leave(self) -> None:
        """Quit; ask first if a mission has not ended."""
        running = [each.run for each in self.follower.views.values() if not each.status.ended]
        if not running:
            self.exit()
            return

        def done(choice: str | None) -> None:
            if choice == "leave":
                self.exit()

        go_on = "the mission" if len(running) == 1 else "the missions"
        choices = [Choice("leave", f"Quit, and let {go_on} go on"), Choice("stay", "Stay")]
        if running == [self.run_shown]:
            text = f"{running[0]} is running. To stop it, press ^X twice."
        else:
            text = f"Not ended: {', '.join(running)}. To stop all, press ^A twice."
        await self.push_screen(Choose("Quit", choices, text), done)
        self.show()

    async def on_click(self, event: events.Click) -> None:
        """Do what a text that is clicked stands for. Textual's own links would be underlined."""
        if (action := event.style.meta.get("does")) and not self.in_dialog:
            await self.run_action(action)

    def action_map(self) -> None:
        """Let the arrow keys move the map, or the mission again."""
        self.activate_map(not self.map_active)

    def action_arrow(self, right: int, down: int) -> None:
        """Move the map, if it is active; else the mission."""
        if self.map_active:
            self.map_pane.pan(right, down)
        elif down:
            self.action_scroll("#mission", down)

    def action_zoom(self, closer: bool) -> None:
        """Show less of the world, or more, on the map."""
        if self.map_pane.display:
            self.map_pane.zoom(closer)

    def action_fit(self) -> None:
        """Show everything on the map."""
        if self.map_pane.display:
            self.map_pane.fit()

    def action_follow_next(self, step: int) -> None:
        """Keep the next vehicle, or the one before, in the centre of the map."""
        if self.map_pane.display:
            self.map_pane.follow_next(step)

    def action_scroll(self, what: str, lines: int) -> None:
        """Scroll a pane."""
        found = self.screen_stack[0].query_one(what, VerticalScroll)
        found.scroll_relative(y=lines, animate=False)

    def action_scroll_log(self, lines: int) -> None:
        """Scroll the log."""
        self.log_pane.move(lines)
