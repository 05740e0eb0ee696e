"""The keys of operators among each other: who is present, who asks for what, and notes."""

from collections.abc import Sequence

from textual import work

from m2pem.api import OpenControlRequest, OperatorPresence, person_of
from m2pem.errors import M2pemError
from m2pem_plugin_terminal.actions import Actions
from m2pem_plugin_terminal.dialogs import Ask, Choice, Choose

TITLE = "Operators"
TEXT = "Choose a request to give or keep what is asked for, or to ask no longer."
NONE = "No operator is present, and none asks for anything"
GIVE, KEEP, WITHDRAW = "give", "keep", "withdraw"


def operator_choices(
    requests: Sequence[OpenControlRequest], present: Sequence[OperatorPresence], by: str
) -> list[Choice]:
    """Return a line for each request, those to the operator `by` first, then for each operator."""
    mine = sorted(requests, key=lambda each: not _same(each.holder, by))
    return [
        *(
            Choice(
                each.resource,
                f"{each.by} asks {'you' if _same(each.holder, by) else each.holder} for "
                f"{each.resource}",
                f"{each.left_s:.0f} s",
            )
            for each in mine
        ),
        *(Choice("", each.by, str(each).removeprefix(each.by).lstrip(": ")) for each in present),
    ]


def answers(request: OpenControlRequest, by: str) -> list[Choice]:
    """Return what an operator may do about a request."""
    if _same(request.holder, by):
        return [
            Choice(GIVE, f"Give {request.resource} to {request.by}"),
            Choice(KEEP, f"Keep {request.resource}"),
        ]
    return [Choice(WITHDRAW, "Ask no longer")] if _same(request.by, by) else []


class People(Actions):
    """Requests for control, presence and notes."""

    @work(exit_on_error=False)
    async def action_operators(self) -> None:
        """Show who is present and who asks for what; answer a request."""
        try:
            requests = list(await self.control.control_requests())
            listed = operator_choices(requests, await self.control.operators(), self.by)
            if not listed:
                self.say(NONE)
                return
            resource = await self.push_screen_wait(Choose(TITLE, listed, TEXT if requests else ""))
            chosen = next((each for each in requests if each.resource == resource), None)
            if chosen is not None:
                await self._answer_request(chosen)
        except M2pemError as error:
            self.say(str(error), alarm=True)

    async def _answer_request(self, request: OpenControlRequest) -> None:
        offered = answers(request, self.by)
        if not offered:
            self.say(f"{request.by} asks {request.holder}, not you")
            return
        answer = await self.push_screen_wait(Choose(str(request), offered))
        if answer is not None:
            await self.control.answer_control(request.resource, give=answer == GIVE, by=self.by)

    @work(exit_on_error=False)
    async def action_note(self) -> None:
        """Write a note into the log of the run that is shown."""
        view = self.view
        if view is None or view.status.ended:
            self.say("No mission is running here")
            return
        text = await self.push_screen_wait(
            Ask(f"Note for the log of {view.run}", "All operators see it.")
        )
        if text is None or not text.strip():
            return
        try:
            await self.control.add_note(view.run, text, by=self.by)
        except M2pemError as error:
            self.say(f"Not noted: {error}", alarm=True)


def _same(name: str, other: str) -> bool:
    return person_of(name) == person_of(other)
