"""m2pem as a contact of TAK: prompts go out as chat, and come back answered.

A contact is an event with the details `takv`, `contact` and `__group`: then others may send it
routes, markers, areas and chat. Only a message to the contact itself answers a prompt: what people
write to each other in a room does not.
"""

import logging
import math
import platform
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version

from m2pem.api import MissionControl, OpenPrompt, PromptClosed
from m2pem.errors import M2pemError
from m2pem_plugin_cot.events import chat_event, contact_event
from m2pem_plugin_cot.received import Received, printable

log = logging.getLogger("m2pem.cot")

CONTACT_EVERY_S = 10.0
EVERY_ROOM = "All Chat Rooms"
MAX_TEXT = 2000
READ_WITHIN_S = 2.0
"""A word that comes sooner may be the answer to the question before."""


@dataclass(frozen=True, slots=True)
class Contact:
    """As others see m2pem. `chat`: whether prompts are sent as chat."""

    uid: str
    callsign: str
    chat: bool

    def event(self, origin: tuple[float, float, float], now_us: int) -> bytes:
        """Return the event by which a server and other contacts know it."""
        device = platform.node() or "host"
        software = ("m2pem", version("m2pem"), platform.system(), device)
        return contact_event(self.uid, self.callsign, software, origin, now_us, 3 * CONTACT_EVERY_S)

    def is_meant(self, received: Received) -> bool:
        """Whether an event is for everyone, or for this contact among others."""
        return not received.to or bool({self.uid, self.callsign} & set(received.to))


class Chat:
    """The open prompts, as chat. `send`: sends an event; `now_us`: the time of events."""

    def __init__(
        self,
        control: MissionControl,
        contact: Contact,
        send: Callable[[bytes], None],
        now_us: Callable[[], int],
    ) -> None:
        self._control, self._contact = control, contact
        self._send, self._now_us = send, now_us
        self._number = 0
        self._since_s: dict[tuple[str, str], float] = {}

    async def follow(self) -> None:
        """Send each prompt that opens, and how it was closed."""
        async for event in self._control.subscribe():
            match event:
                case OpenPrompt():
                    self._since_s[event.run, event.prompt] = time.monotonic()
                    self._say(_asked(event))
                case PromptClosed(run, prompt, decision, by):
                    self._since_s.pop((run, prompt), None)
                    how = f"{decision} ({by or 'no name'})" if decision else "withdrawn"
                    self._say(f"{run} {prompt}: {how}")

    def repeat(self) -> None:
        """Send what is open again, as to a server that was not connected."""
        for prompt in self._control.prompts():
            self._say(_asked(prompt))

    async def take(self, received: Received, source: str) -> None:
        """Answer a prompt as a message says, or reply why not."""
        try:
            found, decision = self._meant(received.text)
            by = f"cot {received.name} ({received.uid}) at {source}"
            await self._control.answer(found.run, found.prompt, decision, by=by)
        except (M2pemError, ValueError) as error:
            self._say(str(error), (received.uid, received.name))

    def _meant(self, text: str) -> tuple[OpenPrompt, str]:
        """Return the prompt and the decision that a text means.

        Raises:
            ValueError: it is none, or may be one of several.
        """
        words, prompts = _folded(text), self._control.prompts()
        choices = [(prompt, each) for prompt in prompts for each in prompt.decisions]
        named = [(p, d) for p, d in choices if words == _folded(f"{_name(p)} {d.label or d.value}")]
        found = named or [(p, d) for p, d in choices if words == _folded(d.label or d.value)]
        if len(found) > 1:
            names = ", ".join(f"{_name(prompt)} {words}" for prompt, _ in found)
            raise ValueError(f"{printable(text)!r} may answer several questions; write: {names}")
        if not found:
            asked = "; ".join(map(_asked, prompts)) or "nothing is asked now"
            raise ValueError(f"{printable(text)!r} is no answer: {asked}")
        prompt, decision = found[0]
        open_s = time.monotonic() - self._since_s.get((prompt.run, prompt.prompt), math.inf)
        if not named and open_s < READ_WITHIN_S:
            raise ValueError(f"{printable(text)!r} may be meant for another: {_asked(prompt)}")
        return prompt, decision.value

    def _say(self, text: str, to: tuple[str, str] = (EVERY_ROOM, EVERY_ROOM)) -> None:
        self._number += 1
        contact, now_us = self._contact, self._now_us()
        text = text[:MAX_TEXT]
        self._send(chat_event(contact.uid, contact.callsign, to, self._number, text, now_us))


def _asked(prompt: OpenPrompt) -> str:
    answers = " | ".join(each.label or each.value for each in prompt.decisions)
    return f"{_name(prompt)}: {prompt.text or prompt.element} (answer to this contact: {answers})"


def _name(prompt: OpenPrompt) -> str:
    return f"{prompt.run} {prompt.prompt}"


def _folded(text: str) -> str:
    return " ".join(text.split()).casefold()
