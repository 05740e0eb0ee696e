"""The keys that start missions, now or later, and that show the schedule."""

from pathlib import Path

from rich.text import Text

from m2pem.api import ScheduledMission, ScheduledStatus
from m2pem.errors import BusyError, M2pemError
from m2pem_plugin_terminal.actions import Actions
from m2pem_plugin_terminal.dialogs import Choose, Read
from m2pem_plugin_terminal.missions import NO_MISSIONS, ChooseMission, preview_text
from m2pem_plugin_terminal.missions import TITLE as TITLE_MISSIONS
from m2pem_plugin_terminal.schedule import ALL, NOTHING_SCHEDULED, entry_choices, schedule_choices
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
        await self.confirm("Start", question, preview_text(preview), start)

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
