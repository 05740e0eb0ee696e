"""The keys of alerts: the list, what is done about one, and the bell."""

from rich.text import Text
from textual import work

from m2pem.api import OperatorAlert
from m2pem.errors import M2pemError
from m2pem_plugin_terminal.alerts import NONE, TITLE, alert_choices, alert_text, what_to_do
from m2pem_plugin_terminal.deciding import Deciding
from m2pem_plugin_terminal.dialogs import Choose, Read


class Alerting(Deciding):
    """The executive's alerts, with who has seen them and who takes care."""

    def action_toggle_bell(self) -> None:
        """Switch the bell on or off."""
        self.alarm_bell.on = not self.alarm_bell.on
        self.say("The bell rings" if self.alarm_bell.on else "The bell is off")

    @work(exit_on_error=False)
    async def action_alerts(self) -> None:
        """List the alerts; the one that is chosen can be acknowledged and owned."""
        try:
            found = {each.alert: each for each in await self.control.alerts(over=True)}
            listed = alert_choices(list(found.values()), self.clock_us())
            if not listed:
                await self.push_screen_wait(Read(TITLE, Text(NONE)))
                return
            chosen = await self.push_screen_wait(Choose(TITLE, listed))
            if chosen is not None:
                await self._do_about(found[chosen])
        except M2pemError as error:
            self.say(f"Alerts: {error}", alarm=True)

    async def _do_about(self, alert: OperatorAlert) -> None:
        listed, text = what_to_do(alert, self.by), alert_text(alert, self.clock_us())
        title = f"{alert.alert}: {alert.severity}"
        match await self.push_screen_wait(Choose(title, listed, text)):
            case "acknowledge":
                await self.control.acknowledge_alert(alert.alert, by=self.by)
            case "own":
                await self.control.own_alert(alert.alert, by=self.by)
            case "disown":
                await self.control.own_alert(alert.alert, owner="", by=self.by)
            case "look":
                await self.follower.load(alert.run)
                self.look_at(alert.run)
            case "decide":
                await self.action_incidents()
