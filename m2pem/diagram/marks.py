"""What a drawing points out: a run's path with numbers, what is stuck, what is never reached."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from m2pem.diagram.ink import IS_STUCK, ON_PATH, PLAIN, UNREACHED, WAITS, Ink
from m2pem.diagram.picture import Picture


@dataclass(frozen=True, slots=True)
class Marks:
    """What to point out, by ids of elements and flows.

    `steps`: by step of a run, numbered from 1, what it passes; the number stands at the first of
    them. `stuck`: where something is wrong, and `waiting`: where else a token stands at the end,
    both with a reason that is shown as a tooltip. `tokens`: where a token is
    drawn. `missing`: flows on which a token is waited for
    that never comes. `unreached`: what no run gets to.
    """

    steps: Sequence[Sequence[str]] = ()
    stuck: Mapping[str, str] = field(default_factory=dict)
    waiting: Mapping[str, str] = field(default_factory=dict)
    tokens: frozenset[str] = frozenset()
    missing: frozenset[str] = frozenset()
    unreached: frozenset[str] = frozenset()

    def on(self, drawn: frozenset[str], parents: Mapping[str, str]) -> "Marks":
        """The same for a file in which only some is drawn: an inside counts for its outside."""

        def at(name: str) -> str:
            while name not in drawn and name in parents:
                name = parents[name]
            return name

        def moved(marked: Mapping[str, str]) -> dict[str, str]:
            found: dict[str, str] = {}
            for name, reason in marked.items():
                known = found.get(at(name))
                found[at(name)] = f"{known}\n{reason}" if known else reason
            return found

        return Marks(
            [list(dict.fromkeys(at(name) for name in step)) for step in self.steps],
            moved(self.stuck),
            moved(self.waiting),
            frozenset(at(name) for name in self.tokens),
            self.missing & drawn,
            self.unreached & drawn,
        )

    def numbers(self) -> dict[str, list[int]]:
        """By element, the steps whose number stands at it."""
        found: dict[str, list[int]] = {}
        for number, step in enumerate(self.steps, 1):
            if step:
                found.setdefault(step[0], []).append(number)
        return found

    def inks(self) -> dict[str, Ink]:
        """By element that is marked, how it is drawn."""
        found: dict[str, Ink] = {}
        groups: Iterable[tuple[Iterable[str], Ink]] = (
            (self.unreached, UNREACHED),
            ((name for step in self.steps for name in step), ON_PATH),
            (self.waiting, WAITS),
            (self.missing, IS_STUCK),
            (self.stuck, IS_STUCK),
        )
        for names, ink in groups:
            found |= dict.fromkeys(names, ink)
        return found

    def legend(self) -> list[tuple[Ink, str]]:
        """What the marks that there are mean."""
        meant = (
            (any(self.steps), ON_PATH, "the run, step by step"),
            (bool(self.stuck), IS_STUCK, "what is wrong, and where"),
            (bool(self.waiting), WAITS, "other tokens at that moment"),
            (bool(self.unreached), UNREACHED, "never reached"),
        )
        shown = [(ink, words) for there, ink, words in meant if there]
        return [*shown, (PLAIN, "not in this run")] if any(self.steps) else shown


def ids_of(picture: Picture) -> frozenset[str]:
    """What is drawn."""
    shapes = {shape.id for shape in picture.shapes}
    return frozenset(shapes | {line.id for line in picture.lines})


def numbered(numbers: Sequence[int], most: int = 4) -> str:
    """Steps as a short text: the first ones, if they are many."""
    if len(numbers) > most:
        return ", ".join(map(str, numbers[: most - 1])) + ", \u2026"
    return ", ".join(map(str, numbers))
