"""The keys that start missions, now or later, and that show the schedule."""

from contextlib import suppress
from pathlib import Path

from rich.text import Text
from textual import work

from m2pem.api import WHEN_FREE, RunId, ScheduledMission, ScheduledStatus, When
from m2pem.errors import BusyError, M2pemError
from m2pem_plugin_terminal.actions import Actions
from m2pem_plugin_terminal.dialogs import Ask, Choose, ConfirmStart, Read
from m2pem_plugin_terminal.missions import NO_MISSIONS, ChooseMission, preview_text
from m2pem_plugin_terminal.missions import TITLE as TITLE_MISSIONS
from m2pem_plugin_terminal.runs import TITLE as TITLE_RUNS
from m2pem_plugin_terminal.runs import next_run, run_choices
from m2pem_plugin_terminal.schedule import (
    ALL,
    NOTHING_SCHEDULED,
    WHEN_HINT,
    entry_choices,
    schedule_choices,
    when_of,
)
from m2pem_plugin_terminal.schedule import TITLE as TITLE_SCHEDULE


class Starting(Actions):
    """Missions that are chosen from the files there are, and the schedule."""

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
                self.carry_out("Start", self._ask_to_start(file))

        await self.push_screen(ChooseMission(files, self.control.preview_start), chosen)
        self.show()

    async def _ask_to_start(self, file: str) -> None:
        """Show what would begin; `y` starts it, `w` has it wait, `l` has it started later. Show in
        full what refuses the start."""
        preview = await self.control.preview_start(file)
        name = Path(file).name
        if preview.refused:
            await self.push_screen(Read(f"{name} cannot start", preview_text(preview)))
            self.show()
            return
        question = f"Start {name} all the same?" if preview.busy else f"Start {name}?"

        def chosen(what: str | None) -> None:
            if what == "start":
                self.carry_out("Start", self._start(file, busy=bool(preview.busy)))
            elif what == "wait":
                self.carry_out("Schedule", self._schedule(file, WHEN_FREE))
            elif what == "later":
                self.run_worker(self._ask_when(file), exit_on_error=False)

        await self.push_screen(ConfirmStart(question, preview_text(preview)), chosen)
        self.show()

    async def _start(self, file: str, *, busy: bool) -> None:
        name = Path(file).name
        try:
            run = await self.control.start(file, by=self.by, even_if_busy=busy)
        except BusyError:  # since the operator read that all is free
            await self._ask_to_start(file)
        except M2pemError as error:
            await self.push_screen(Read(f"{name} was not started", Text(str(error))))
            self.show()
        else:
            self.say(f"{name} was started: {run}")

    async def _ask_when(self, file: str) -> None:
        asked = Ask(f"Start {Path(file).name} later", WHEN_HINT)
        time = await self.push_screen_wait(asked)
        if time and time.strip():
            try:
                await self._schedule(file, when_of(time))
            except M2pemError as error:
                self.say(f"Schedule: {error}", alarm=True)

    async def _schedule(self, file: str, when: When) -> None:
        await self.control.schedule(file, when=when, by=self.by)  # an alert says it

    async def action_runs(self) -> None:
        """Choose the run to show, or an entry of the schedule."""
        try:
            runs = await self.control.runs()
        except M2pemError as error:
            self.say(str(error), alarm=True)
            return
        schedule = None
        with suppress(M2pemError):  # this executive may serve none
            schedule = await self.control.scheduled()
        entries = {each.entry: each for each in schedule.entries} if schedule else {}

        def look(chosen: str | None) -> None:
            if chosen in entries:
                self.run_worker(self._ask_about(entries[chosen]), exit_on_error=False)
            elif chosen is not None:
                self.action_look(chosen)

        await self.push_screen(Choose(TITLE_RUNS, run_choices(runs, schedule)), look)
        self.show()

    def action_next_run(self, step: int) -> None:
        """Show the next run of those that go on, or the one before."""
        going_on = [run for run, view in self.follower.views.items() if not view.status.ended]
        run = next_run(going_on, self.run_shown, step)
        if run is not None:
            self.look_at(run)

    @work(exit_on_error=False)
    async def action_look(self, run: RunId) -> None:
        """Show a run."""
        try:
            await self.follower.load(run)
        except M2pemError as error:
            self.say(str(error), alarm=True)
        else:
            self.look_at(run)

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
                self.carry_out("Schedule", self._hold_or_release(None, held=bool(schedule.hold)))
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
                self.carry_out("Cancel", self.control.unschedule(mission.entry, by=self.by))
            elif what == "start":
                self.carry_out("Start", self.control.start_scheduled(mission.entry, by=self.by))
            elif what is not None:
                self.carry_out("Schedule", self._hold_or_release(mission.entry, held=held))

        await self.push_screen(Choose(mission.entry, entry_choices(mission), str(mission)), chosen)
        self.show()

    async def _hold_or_release(self, entry: str | None, *, held: bool) -> None:
        if held:
            await self.control.release_schedule(entry, by=self.by)
        else:
            await self.control.hold_schedule(entry, by=self.by)
