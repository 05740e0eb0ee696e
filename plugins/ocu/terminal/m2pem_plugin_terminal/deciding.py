"""The key that decides about incidents."""

from typing import Any

from m2pem.api import IncidentVerdict, OpenIncident
from m2pem.api.data_text import named_value
from m2pem.errors import M2pemError
from m2pem_plugin_terminal import incidents
from m2pem_plugin_terminal.actions import Actions
from m2pem_plugin_terminal.dialogs import Ask, Choose, Confirm
from m2pem_plugin_terminal.incidents import Decision


class Deciding(Actions):
    """Lists incidents, and asks what each choice needs."""

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
        try:
            text = incidents.blocked_text(incident, await self.control.waiting())
        except M2pemError as error:
            self.say(str(error), alarm=True)
            return
        choice = await self.push_screen_wait(Choose(incident.task, listed, text))
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
            effects = incidents.effect_text(incident, decision, preview)
            if await self.push_screen_wait(Confirm(f"{choice} {incident.incident}?", effects)):
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
