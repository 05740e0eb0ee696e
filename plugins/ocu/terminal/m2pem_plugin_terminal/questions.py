"""The questions that stand, one of them shown, with its decisions on the keys 1 to 9."""

from collections.abc import Callable, Mapping

from rich.text import Text
from textual.app import ComposeResult
from textual.containers import Vertical, VerticalScroll
from textual.widgets import Static

from m2pem.api.control import OpenPrompt, RunId

SETTLES_IN_S = 0.7
"""A question that has just appeared takes no key: it may have been meant for the one before."""

MOST_DECISIONS = 9


class Questions(Vertical):
    """Hidden while there is none. `show` says what stands; `decide` what a key means."""

    def __init__(self, now: Callable[[], float]) -> None:
        super().__init__(id="questions")
        self._text = Static(id="question")
        self._decisions = Static(id="decisions")
        self._now = now
        self._standing: dict[tuple[RunId, str], OpenPrompt] = {}
        self._current: tuple[RunId, str] | None = None
        self._since = 0.0

    def compose(self) -> ComposeResult:
        """The text, which scrolls if it is long, and the decisions, which are always seen."""
        yield VerticalScroll(self._text, id="question-text", can_focus=False)
        yield self._decisions

    @property
    def current(self) -> OpenPrompt | None:
        """The question that is shown."""
        return None if self._current is None else self._standing.get(self._current)

    @property
    def settled(self) -> bool:
        """Whether the question has been there long enough to be answered."""
        return self._now() - self._since >= SETTLES_IN_S

    def show(
        self,
        standing: Mapping[tuple[RunId, str], OpenPrompt],
        label: Callable[[OpenPrompt], str],
        run: RunId,
    ) -> None:
        """Show what stands; `label` names the element, `run` is the run that is looked at."""
        self._standing = dict(standing)
        if self._current not in self._standing:
            self._turn_to(next(iter(self._standing), None))
        self.display = self._current is not None
        prompt = self.current
        if prompt is None:
            return
        place = list(self._standing).index((prompt.run, prompt.prompt)) + 1
        several = len(self._standing) > 1
        count = f"Question {place} of {len(self._standing)}" if several else "Question"
        address = prompt.prompt if prompt.run == run else f"{prompt.run} {prompt.prompt}"
        role = f" for {prompt.role}" if prompt.role else ""
        turn = "   (Tab: next)" if several else ""
        self.border_title = Text(f"{count}{role}: {label(prompt)} ({address}){turn}")
        self._text.update(Text(prompt.text))
        self._decisions.update(_decisions(prompt))

    def turn(self) -> None:
        """Show the next one."""
        keys = list(self._standing)
        if self._current in keys and len(keys) > 1:
            self._turn_to(keys[(keys.index(self._current) + 1) % len(keys)])

    def decide(self, number: int) -> str | None:
        """The decision on a key, from 1; None when there is none."""
        prompt = self.current
        if prompt is None or not 1 <= number <= min(len(prompt.decisions), MOST_DECISIONS):
            return None
        return prompt.decisions[number - 1].value

    def _turn_to(self, key: tuple[RunId, str] | None) -> None:
        self._current = key
        self._since = self._now()


def _decisions(prompt: OpenPrompt) -> Text:
    text = Text()
    for number, decision in enumerate(prompt.decisions[:MOST_DECISIONS], 1):
        # A decision is not broken over two lines.
        label = (decision.label or decision.value).replace(" ", "\N{NO-BREAK SPACE}")
        text.append(f"\N{NO-BREAK SPACE}{number}\N{NO-BREAK SPACE}", "bold #1b2129 on #e8c468")
        text.append(f"\N{NO-BREAK SPACE}{label}", "#e3e8ee")
        text.append("   ")
    if len(prompt.decisions) > MOST_DECISIONS:
        text.append(f"and more: m2pem answer {prompt.run} {prompt.prompt}", "#9aa4af")
    text.rstrip()
    return text
