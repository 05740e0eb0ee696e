"""The prompt pane: one of the open prompts, with its decisions on the keys 1 to 9."""

from collections.abc import Callable, Mapping

from rich.style import Style
from rich.text import Text
from textual.app import ComposeResult
from textual.containers import Vertical, VerticalScroll
from textual.widgets import Static

from m2pem.api.runs import OpenPrompt, RunId

SETTLES_IN_S = 0.7
"""Seconds in which a new prompt ignores keys: they may be meant for the prompt before it."""

MOST_DECISIONS = 9


class PromptPane(Vertical):
    """Hidden while no prompt is open. `show` sets the open prompts; `decision_on` reads a key."""

    def __init__(self, now: Callable[[], float]) -> None:
        super().__init__(id="questions")
        self._text = Static(id="question")
        self._decisions = Static(id="decisions")
        self._now = now
        self._open: dict[tuple[RunId, str], OpenPrompt] = {}
        self._current: tuple[RunId, str] | None = None
        self._since = 0.0

    def compose(self) -> ComposeResult:
        """Compose the text, which scrolls if it is long, and the decisions, which stay visible."""
        yield VerticalScroll(self._text, id="question-text", can_focus=False)
        yield self._decisions

    @property
    def current(self) -> OpenPrompt | None:
        """The prompt that is shown."""
        return None if self._current is None else self._open.get(self._current)

    @property
    def settled(self) -> bool:
        """Whether keys answer the prompt: it has been visible long enough."""
        return self._now() - self._since >= SETTLES_IN_S

    def show(
        self,
        prompts: Mapping[tuple[RunId, str], OpenPrompt],
        label: Callable[[OpenPrompt], str],
        run: RunId,
        time_left: Callable[[OpenPrompt], str],
    ) -> None:
        """Show the open prompts; `label` names the element, `run` is the run that is shown.

        `time_left`: how long a prompt is open yet, in words that begin with a comma, or "".
        """
        self._open = dict(prompts)
        if self._current not in self._open:
            self._show_prompt(next(iter(self._open), None))
        self.display = self._current is not None
        prompt = self.current
        if prompt is None:
            return
        place = list(self._open).index((prompt.run, prompt.prompt)) + 1
        several = len(self._open) > 1
        count = f"Question {place} of {len(self._open)}" if several else "Question"
        address = prompt.prompt if prompt.run == run else f"{prompt.run} {prompt.prompt}"
        role = f" for {prompt.role}" if prompt.role else ""
        left = time_left(prompt)
        hint = "   (Tab: next)" if several else ""
        self.border_title = Text(f"{count}{role}: {label(prompt)} ({address}){left}{hint}")
        self._text.update(Text(prompt.text))
        self._decisions.update(_decisions(prompt))

    def show_next(self) -> None:
        """Show the next prompt."""
        keys = list(self._open)
        if self._current in keys and len(keys) > 1:
            self._show_prompt(keys[(keys.index(self._current) + 1) % len(keys)])

    def decision_on(self, number: int) -> str | None:
        """Return the decision on a key, from 1; None when there is none."""
        prompt = self.current
        if prompt is None or not 1 <= number <= min(len(prompt.decisions), MOST_DECISIONS):
            return None
        return prompt.decisions[number - 1].value

    def _show_prompt(self, key: tuple[RunId, str] | None) -> None:
        self._current = key
        self._since = self._now()


def _decisions(prompt: OpenPrompt) -> Text:
    text = Text()
    for number, decision in enumerate(prompt.decisions[:MOST_DECISIONS], 1):
        # A decision is not broken over two lines.
        label = (decision.label or decision.value).replace(" ", "\N{NO-BREAK SPACE}")
        start = len(text)
        text.append(f"\N{NO-BREAK SPACE}{number}\N{NO-BREAK SPACE}", "bold #1b2129 on #e8c468")
        text.append(f"\N{NO-BREAK SPACE}{label}", "#e3e8ee")
        text.stylize(Style.from_meta({"does": f"answer({number})"}), start)
        text.append("   ")
    if len(prompt.decisions) > MOST_DECISIONS:
        text.append(f"and more: m2pem answer {prompt.run} {prompt.prompt}", "#9aa4af")
    text.rstrip()
    return text
