"""The key that takes a vehicle or payload from the missions, or gives it back."""

from rich.text import Text

from m2pem.api import ResourceId
from m2pem.errors import M2pemError, OperatorError
from m2pem_plugin_terminal.actions import Actions
from m2pem_plugin_terminal.dialogs import Ask, Choice, Choose
from m2pem_plugin_terminal.handover import (
    FORCED,
    RETURNED,
    TEXT,
    TITLE,
    choices,
    effects_text,
    with_operator,
)


class Taking(Actions):
    """Acquiring and releasing control."""

    async def action_take(self) -> None:
        """Choose a vehicle or payload of which to acquire or release control."""
        try:
            holders = await self.control.holders()
            labels = await self.control.holder_labels()
        except M2pemError as error:
            self.say(str(error), alarm=True)
            return

        def task(holder: str) -> str:
            return self.task_label(holder) or labels.get(holder, holder)

        def chosen(resource: str | None) -> None:
            if resource is None:
                return
            holder = holders[ResourceId(resource)]
            if holder == self.by:
                self.carry_out("Give back", self._ask_to_give_back(resource))
            elif with_operator(holder):
                self.run_worker(self._of_another(resource, holder), exit_on_error=False)
            else:
                self.carry_out("Take", self._ask_to_take(resource))

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

        await self.confirm("Take", f"Take {resource}?", effects_text(resource, effects), take)

    async def _ask_to_give_back(self, resource: str) -> None:
        async def give_back() -> None:
            await self._give_back(resource)

        await self.confirm("Give back", f"Give back {resource}?", Text(RETURNED), give_back)

    async def _give_back(self, resource: str) -> None:
        """Release control, unless another operator has acquired it since the list was shown."""
        holder = (await self.control.holders()).get(ResourceId(resource), "")
        if with_operator(holder) and holder != self.by:
            raise OperatorError(f"{resource} is with {holder}")
        await self.control.give_back(resource, by=self.by)

    async def _of_another(self, resource: str, holder: str) -> None:
        """Ask the operator who has a resource for it; or, if that one is gone, give it back."""
        listed = [
            Choice("ask", f"Ask {holder} for {resource}"),
            Choice("force", "Give it back to the missions", "only if they are gone"),
        ]
        wanted = await self.push_screen_wait(Choose(f"{resource} is with {holder}", listed))
        try:
            if wanted == "ask":
                await self.control.request_control(resource, by=self.by)
            elif wanted == "force":
                title = f"Give back {resource} for {holder}?"
                reason = await self.push_screen_wait(Ask(title, f"{RETURNED} {FORCED}"))
                if reason is not None:
                    await self.control.give_back(resource, reason=reason, by=self.by)
        except M2pemError as error:
            self.say(str(error), alarm=True)

    def task_label(self, holder: str) -> str:
        """Return the task of a run that is known here, by what has a resource for it; else ""."""
        view = self.follower.views.get(holder.rpartition(".")[0])
        found = view and (view.behaviors.get(holder) or view.allocations.get(holder))
        return view.label(found.element) if view and found else ""
