"""The keys of the operator control unit, and what they do."""

import time
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any, ClassVar

from rich.text import Text
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll

from m2pem.api import (
    IncidentVerdict,
    OpenIncident,
    ResourceId,
    RunView,
    ScheduledMission,
    ScheduledStatus,
)
from m2pem.api.control import MissionControl
from m2pem.api.data_text import named_value
from m2pem.api.operator import operator_name
from m2pem.api.runs import RunId, RunStatus
from m2pem.errors import BusyError, M2pemError, OperatorError
from m2pem_plugin_terminal import incidents
from m2pem_plugin_terminal.alerts import TITLE as TITLE_ALERTS
from m2pem_plugin_terminal.dialogs import Ask, Choice, Choose, Confirm, Read, help_text
from m2pem_plugin_terminal.display import Display
from m2pem_plugin_terminal.handover import (
    RETURNED,
    TEXT,
    TITLE,
    choices,
    effects_text,
    with_operator,
)
from m2pem_plugin_terminal.incidents import Decision
from m2pem_plugin_terminal.missions import NO_MISSIONS, ChooseMission, preview_text
from m2pem_plugin_terminal.missions import TITLE as TITLE_MISSIONS
from m2pem_plugin_terminal.schedule import ALL, NOTHING_SCHEDULED, entry_choices, schedule_choices
from m2pem_plugin_terminal.schedule import TITLE as TITLE_SCHEDULE
from m2pem_plugin_terminal.shared_space import TITLE as TITLE_SPACE
from m2pem_plugin_terminal.shared_space import space_text
from m2pem_plugin_terminal.status_lines import STOP_ALL


class TerminalApp(Display):
    """The display with its keys. `by`: the name that is journaled."""

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
        Binding("m", "missions"),
        Binding("i", "incidents"),
        Binding("r", "runs"),
        Binding("c", "schedule"),
        Binding("f", "space"),
        Binding("a", "alerts"),
        Binding("slash", "filter"),
        Binding("question_mark", "help"),
        Binding("q", "leave"),
        Binding("up", "scroll('#mission', -1)"),
        Binding("down", "scroll('#mission', 1)"),
        Binding("pageup", "scroll_log(-4)"),
        Binding("pagedown", "scroll_log(4)"),
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
        super().__init__(control, now=now)
        self.by = operator_name() if by is None else by

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Leave Escape and Tab to dialogs and fields unless the display needs them."""
        if action == "disarm":
            return self.stop_press.armed or (not self._in_dialog and self.log_pane.filtering)
        if action == "next_prompt":
            return not self._in_dialog
        return True

    @property
    def _in_dialog(self) -> bool:
        return len(self.screen_stack) > 1

    def _carry_out(self, what: str, call: Awaitable[Any]) -> None:
        """Ask the executive without waiting; show what it refuses."""

        async def send() -> None:
            try:
                await call
            except M2pemError as error:
                self.say(f"{what}: {error}", alarm=True)

        self.run_worker(send(), exit_on_error=False)

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
            while self._in_dialog:
                self.pop_screen()
            self._carry_out("Stop", self.control.stop(view.run, by=self.by))
        self.show()

    def action_stop_all(self) -> None:
        """Stop every run at the second press."""
        if self.stop_press.press(STOP_ALL):
            self.say("Stopping all runs ...", alarm=True)
            while self._in_dialog:
                self.pop_screen()
            self._carry_out(STOP_ALL, self.control.stop_all(by=self.by))
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
        """Escape: cancel the first press of STOP, or show the whole log."""
        if self.stop_press.armed:
            self.stop_press.disarm()
        else:
            self.log_pane.clear_filter()
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

        self._carry_out("Not taken", answer())

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
            self._carry_out("Go on", self.control.resume(view.run, by=self.by))
        else:
            self._carry_out("Pause", self.control.pause(view.run, by=self.by))

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
                self._carry_out("Signal", self.control.signal(signal, run=view.run, by=self.by))

        await self.push_screen(Choose("Send a signal", choices), send)
        self.show()

    async def action_take(self) -> None:
        """Choose a vehicle or payload of which to acquire or release control."""
        try:
            holders = await self.control.holders()
            labels = await self.control.holder_labels()
        except M2pemError as error:
            self.say(str(error), alarm=True)
            return

        def task(holder: str) -> str:
            return self._task_label(holder) or labels.get(holder, holder)

        def chosen(resource: str | None) -> None:
            if resource is None:
                return
            holder = holders[ResourceId(resource)]
            if holder == self.by:
                self._carry_out("Give back", self._ask_to_give_back(resource))
            elif with_operator(holder):
                self.say(f"{resource} is with {holder}", alarm=True)
            else:
                self._carry_out("Take", self._ask_to_take(resource))

        listed = choices(self.control.fleet(), holders, self.by, task)
        await self.push_screen(Choose(TITLE, listed, TEXT), chosen)
        self.show()

    async def _ask_to_take(self, resource: str) -> None:
        """Show the effects of acquiring control; `y` confirms. Ask again if they have changed."""
        effects = await self.control.preview_take(resource)

        async def take() -> None:
            if await self.control.preview_take(resource) != effects:
                self.say(f"Not taken: what {resource} does has changed. Read it again", alarm=True)
                await self._ask_to_take(resource)
            else:
                await self.control.take(resource, by=self.by)

        await self._confirm("Take", f"Take {resource}?", effects_text(resource, effects), take)

    async def _confirm(
        self, what: str, title: str, text: Text, call: Callable[[], Awaitable[None]]
    ) -> None:
        """Have the operator confirm a text with a key that has no other use."""

        def confirmed(yes: bool | None) -> None:
            if yes:
                self._carry_out(what, call())

        await self.push_screen(Confirm(title, text), confirmed)
        self.show()

    async def _ask_to_give_back(self, resource: str) -> None:
        async def give_back() -> None:
            await self._give_back(resource)

        await self._confirm("Give back", f"Give back {resource}?", Text(RETURNED), give_back)

    async def _give_back(self, resource: str) -> None:
        """Release control, unless another operator has acquired it since the list was shown."""
        holder = (await self.control.holders()).get(ResourceId(resource), "")
        if with_operator(holder) and holder != self.by:
            raise OperatorError(f"{resource} is with {holder}")
        await self.control.give_back(resource, by=self.by)

    async def action_incidents(self) -> None:
        """Choose an incident, and decide about it."""
        try:
            found = {each.incident: each for each in await self.control.incidents()}
        except M2pemError as error:
            self.say(str(error), alarm=True)
            return
        if not found:
            self.say(incidents.NONE)
            return

        def chosen(incident: str | None) -> None:
            if incident is not None:
                self.run_worker(self._decide_about(found[incident]), exit_on_error=False)

        listed = incidents.incident_choices(list(found.values()))
        if len(listed) == 1:
            chosen(listed[0].value)
        else:
            await self.push_screen(Choose(incidents.TITLE, listed), chosen)
        self.show()

    async def _decide_about(self, incident: OpenIncident) -> None:
        """Ask for the choice and what it needs; `y` confirms, after a look at what follows."""
        listed = incidents.decision_choices(incident)
        choice = await self.push_screen_wait(Choose(incident.task, listed, str(incident)))
        if choice is None:
            return
        try:
            decision = await self._ask_for_details(incident, choice)
            if decision is None:
                return
            place = (incident.run, incident.incident, choice)
            needs: dict[str, Any] = {
                "data": decision.data,
                "to": decision.to,
                "roles": decision.roles,
            }
            preview = await self.control.preview_incident(*place, **needs)
            text = incidents.effect_text(incident, decision, preview)
            if await self.push_screen_wait(Confirm(f"{choice} {incident.incident}?", text)):
                stuck = preview.verdict is IncidentVerdict.CANNOT_COMPLETE
                await self.control.resolve_incident(
                    *place, **needs, by=self.by, even_if_stuck=stuck
                )
        except M2pemError as error:
            self.say(f"Not taken: {error}", alarm=True)

    async def _ask_for_details(self, incident: OpenIncident, choice: str) -> Decision | None:
        """Ask for the data, target or resource of a choice; None: the operator gave up."""
        title = incidents.LABELS[choice]
        if choice == "set_data":
            line = await self.push_screen_wait(Ask(title, "name=value"))
            return None if line is None else Decision(choice, data=dict([named_value(line)]))
        if choice == "move":
            listed = incidents.target_choices(incident)
            to = await self.push_screen_wait(Choose(title, listed))
            return None if to is None else Decision(choice, to=to)
        if choice == "retry_with":
            roles = incidents.role_choices(incident)
            role: str | None = roles[0].value
            if len(roles) > 1:
                role = await self.push_screen_wait(Choose(title, roles))
            if role is None:
                return None
            listed = incidents.resource_choices(self.control.fleet())
            resource = await self.push_screen_wait(Choose(f"{title}: {role}", listed))
            return None if resource is None else Decision(choice, roles={role: [resource]})
        return Decision(choice)

    async def action_missions(self) -> None:
        """Choose a mission file to start."""
        try:
            files = await self.control.missions()
        except M2pemError as error:
            self.say(str(error), alarm=True)
            return
        if not files:
            await self.push_screen(Read(TITLE_MISSIONS, Text(NO_MISSIONS)))
            return

        def chosen(file: str | None) -> None:
            if file is not None:
                self._carry_out("Start", self._ask_to_start(file))

        await self.push_screen(ChooseMission(files, self.control.preview_start), chosen)
        self.show()

    async def _ask_to_start(self, file: str) -> None:
        """Show what would begin; `y` confirms. Show in full what refuses the start."""
        preview = await self.control.preview_start(file)
        name = Path(file).name
        if preview.refused:
            await self.push_screen(Read(f"{name} cannot start", preview_text(preview)))
            self.show()
            return

        async def start() -> None:
            try:
                run = await self.control.start(file, by=self.by, even_if_busy=bool(preview.busy))
            except BusyError:  # since the operator read that all is free
                await self._ask_to_start(file)
            except M2pemError as error:
                await self.push_screen(Read(f"{name} was not started", Text(str(error))))
                self.show()
            else:
                self.say(f"{name} was started: {run}")

        question = f"Start {name} all the same?" if preview.busy else f"Start {name}?"
        await self._confirm("Start", question, preview_text(preview), start)

    def _task_label(self, holder: str) -> str:
        view = self.follower.views.get(holder.rpartition(".")[0])
        found = view and (view.behaviors.get(holder) or view.allocations.get(holder))
        return view.label(found.element) if view and found else ""

    async def action_runs(self) -> None:
        """Choose the run to show."""
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

    async def action_schedule(self) -> None:
        """Choose an entry of the schedule to hold, release or cancel."""
        try:
            schedule = await self.control.scheduled()
        except M2pemError as error:
            self.say(str(error), alarm=True)
            return
        active = {each.entry: each for each in schedule.entries if not each.status.over}
        if not active and not schedule.hold:
            await self.push_screen(Read(TITLE_SCHEDULE, Text(NOTHING_SCHEDULED)))
            return

        def chosen(entry: str | None) -> None:
            if entry == ALL:
                self._carry_out("Schedule", self._hold_or_release(None, held=bool(schedule.hold)))
            elif entry is not None:
                self.run_worker(self._ask_about(active[entry]), exit_on_error=False)

        text = f"The schedule is {schedule.hold}." if schedule.hold else ""
        await self.push_screen(Choose(TITLE_SCHEDULE, schedule_choices(schedule), text), chosen)
        self.show()

    async def _ask_about(self, mission: ScheduledMission) -> None:
        """Let the operator choose what to do with an entry."""
        held = mission.status is ScheduledStatus.HELD

        def chosen(what: str | None) -> None:
            if what == "cancel":
                self._carry_out("Cancel", self.control.unschedule(mission.entry, by=self.by))
            elif what == "start":
                self._carry_out("Start", self.control.start_scheduled(mission.entry, by=self.by))
            elif what is not None:
                self._carry_out("Schedule", self._hold_or_release(mission.entry, held=held))

        await self.push_screen(Choose(mission.entry, entry_choices(mission), str(mission)), chosen)
        self.show()

    async def _hold_or_release(self, entry: str | None, *, held: bool) -> None:
        if held:
            await self.control.release_schedule(entry, by=self.by)
        else:
            await self.control.hold_schedule(entry, by=self.by)

    async def _load_and_look(self, run: RunId) -> None:
        try:
            await self.follower.load(run)
        except M2pemError as error:
            self.say(str(error), alarm=True)
        else:
            self.look_at(run)

    async def action_space(self) -> None:
        """Show who is in shared space, and which tasks wait for what."""
        try:
            spaces, waiting = await self.control.shared_space(), await self.control.waiting()
        except M2pemError as error:
            self.say(str(error), alarm=True)
            return
        await self.push_screen(Read(TITLE_SPACE, space_text(spaces, waiting)))
        self.show()

    async def action_alerts(self) -> None:
        """Show all alerts; those that are shown have been seen."""
        await self.push_screen(Read(TITLE_ALERTS, self.alerts.see()))
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

    def action_scroll(self, what: str, lines: int) -> None:
        """Scroll a pane."""
        found = self.screen_stack[0].query_one(what, VerticalScroll)
        found.scroll_relative(y=lines, animate=False)

    def action_scroll_log(self, lines: int) -> None:
        """Scroll the log."""
        self.log_pane.move(lines)
