"""A part of what a rule will do, and how parts are put together."""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from m2pem.verify.system import Action, Flag, Step


@dataclass(frozen=True, slots=True)
class Effect:
    """Fields as in `Rule`. `kill_scopes` stand for all places in them, `quiet_scopes` must have
    no token in them. `guard` and `assign` are by variable."""

    steps: tuple[Step, ...] = ()
    consume: tuple[int, ...] = ()
    read: frozenset[int] = frozenset()
    inhibit: frozenset[int] = frozenset()
    quiet_scopes: frozenset[int] = frozenset()
    moves: tuple[tuple[int, int], ...] = ()
    copies: tuple[tuple[int, int], ...] = ()
    kill: frozenset[int] = frozenset()
    kill_scopes: frozenset[int] = frozenset()
    produce: tuple[int, ...] = ()
    guard: "dict[int, frozenset[int]]" = field(default_factory=dict)
    assign: dict[int, int] = field(default_factory=dict)
    flag: Flag | None = None
    flagged: str = ""

    def then(self, other: "Effect") -> "Effect | None":
        """Both, this one first; None when they ask for what excludes each other."""
        guard = dict(self.guard)
        for variable, values in other.guard.items():
            if variable in self.assign:
                if self.assign[variable] not in values:
                    return None
                continue
            both = guard[variable] & values if variable in guard else values
            if not both:
                return None
            guard[variable] = both
        read, inhibit = self.read | other.read, self.inhibit | other.inhibit
        if read & inhibit or inhibit & set(self.consume + other.consume):
            return None
        return Effect(
            self.steps + other.steps,
            self.consume + other.consume,
            read,
            inhibit,
            self.quiet_scopes | other.quiet_scopes,
            self.moves + other.moves,
            self.copies + other.copies,
            self.kill | other.kill,
            self.kill_scopes | other.kill_scopes,
            self.produce + other.produce,
            guard,
            {**self.assign, **other.assign},
            self.flag or other.flag,
            self.flagged or other.flagged,
        )

    def saying(self, element: str, action: Action, detail: str = "") -> "Effect":
        """With one more step at its beginning."""
        return replace(self, steps=(Step(element, action, detail), *self.steps))


def product(first: Iterable[Effect], second: Iterable[Effect]) -> list[Effect]:
    """Every pair of the two that does not exclude itself."""
    others = list(second)
    pairs = (one.then(other) for one in first for other in others)
    return [pair for pair in pairs if pair is not None]
